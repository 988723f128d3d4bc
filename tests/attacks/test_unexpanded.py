"""What xacro left behind is an error where motion depends on it, and only there."""

import warnings

import pytest

import urdfkin
from tests.urdf.lint.cases.arm import MESH, arm
from urdfkin.urdf.lint import Severity


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        arm(base=MESH.format("package://tools/$(arg tool)/tool.stl")),
        arm(base='<link name="base"><xacro:insert_block name="inertia"/></link>'),
        arm(more='<gazebo><xacro:plugin/><p name="${x}"/></gazebo>'),
    ],
)
def test_a_robot_whose_motion_needs_no_xacro_is_loaded_and_verified(text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        robot = urdfkin.load(text)
    robot.placement([0.1, 0.2], "tool")
    assert robot.certificate().verified


@pytest.mark.parametrize(
    "text",
    [
        arm(more="<xacro:arm/>"),
        arm(inside="<xacro:limits/>"),
        arm(axis='<axis xyz="${z}"/>'),
        arm(limit='<limit lower="${low}" upper="1" effort="1" velocity="1"/>'),
        arm(attributes='type="$(arg kind)"'),
        arm(base='<link name="${side}_base"/>'),
        arm(base=MESH.format("$(arg a)"), origin='<origin xyz="0 0 $(arg h)"/>'),
    ],
)
def test_where_motion_depends_on_it_the_robot_is_refused(text: str) -> None:
    (error,) = [f for f in urdfkin.check(text) if f.code == "URDF202" and f.severity is Severity.ERROR]
    assert error.remedy is not None
    assert "expand the file first" in error.remedy
