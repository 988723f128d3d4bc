"""If yourdfpy and Pinocchio read a URDF differently, urdfkin follows the specification and Pinocchio."""

import warnings
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.reading import present
from tests.urdf.lint.cases.arm import LIMIT, arm, base_link, fixed, shape
from tests.urdfs import joint, mimic
from urdfkin.robot import Robot
from urdfkin.verify.verifier import NotVerifiedWarning

TIP = "link:tool"


def verified(text: str, **options: Any) -> Robot:
    """Load a robot and verify its quantities with Pinocchio."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        warnings.simplefilter("error", NotVerifiedWarning)
        robot = urdfkin.load(text, **options)
    q = robot.sample(3, seed=1)
    v, a = np.random.default_rng(0).normal(size=(2, 3, robot.nv))
    robot.placement(q, TIP)
    robot.velocity(q, v, TIP)
    robot.jacobian(q, TIP)
    robot.acceleration(q, v, a, TIP)
    assert robot.certificate().verified
    return robot


@pytest.mark.parametrize("axis", ["0 0 2", "1e-9 0 0", "0 1e100 0", "3 4 0", "0.577 0.577 0.577"])
def test_every_axis_is_normalised(axis: str) -> None:
    robot = verified(arm(attributes='type="prismatic"', axis=f'<axis xyz="{axis}"/>'))
    T = robot.placement([[0.0, 0.0], [1.0, 0.0]], TIP)
    assert np.linalg.norm(T[1, :3, 3] - T[0, :3, 3]) == pytest.approx(1.0, abs=1e-15)
    assert np.linalg.norm(robot.tree.joints[0].axis) == pytest.approx(1.0, abs=1e-15)


def test_the_default_axis_is_x() -> None:
    assert verified(arm(axis="")).tree.joints[0].axis.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("element", ["<axis/>", '<axis note="z"/>', "<axis><!-- 0 0 1 --></axis>"])
def test_an_axis_element_without_xyz_is_refused_except_for_a_planar_joint(element: str) -> None:
    with pytest.raises(urdfkin.UrdfError, match="URDF504"):
        urdfkin.load(arm(axis=element))
    verified(arm(axis=element, attributes='type="planar"'))


def test_joints_are_sorted_depth_first_and_by_name_not_as_in_the_file() -> None:
    more = '<link name="x"/><joint name="a0" type="continuous"><parent link="base"/><child link="x"/></joint>'
    assert verified(arm(more=more)).joint_names == ("a0", "j1", "j2")


def test_a_mimic_joint_has_no_coordinate() -> None:
    text = arm(follow='<mimic joint="j1" multiplier="-2" offset="0.1"/>')
    robot, free = verified(text), verified(text, mimic=False)
    assert robot.nq == 1
    T = free.placement([0.3, -2 * 0.3 + 0.1], TIP)
    np.testing.assert_allclose(robot.placement([0.3], TIP), T, atol=1e-15)


def test_a_continuous_mimic_joint_has_no_coordinate_and_a_fixed_joint_cannot_mimic() -> None:
    text = arm(second='type="continuous"', follow='<mimic joint="j1"/>')
    assert verified(text.replace(LIMIT + "<mimic", "<mimic")).nq == 1
    verified(arm(second='type="fixed"', follow='<mimic joint="j1"/>'))


def test_a_chain_of_mimic_joints_is_resolved() -> None:
    third = joint("j3", "revolute", "tool", "x", axis="", more=LIMIT + mimic("j2", 3, 0.5))
    more = f'<link name="x"/>{third}'
    robot = verified(arm(follow='<mimic joint="j1" multiplier="-2" offset="0.1"/>', more=more))
    rule = present(robot.tree.joints[2].mimic)
    assert (rule.leader, rule.multiplier) == ("j1", -6.0)
    assert rule.offset == pytest.approx(3 * 0.1 + 0.5)


@pytest.mark.parametrize("axis", ['<axis xyz="1 0 0"/>', '<axis xyz="0 0 1"/>', ""])
def test_a_planar_joint_moves_in_the_xy_plane_whatever_its_axis_is(axis: str) -> None:
    robot = verified(arm(attributes='type="planar"', axis=axis, limit="", origin=""))
    assert robot.placement([0.3, -0.2, 0.0, 0.0], "link:l1")[:3, 3].tolist() == [0.3, -0.2, 0.0]


def test_a_floating_joint_has_seven_joint_values_and_six_velocities() -> None:
    robot = verified(arm(attributes='type="floating"', axis="", limit=""))
    assert (robot.nq, robot.nv) == (8, 7)


def test_limits_of_a_continuous_joint_are_ignored_and_a_missing_limit_is_zero() -> None:
    limit = present(verified(arm(attributes='type="continuous"')).tree.joints[0].limit)
    assert (limit.lower, limit.upper) == (-np.inf, np.inf)
    robot = verified(arm(limit='<limit upper="1" effort="1" velocity="1"/>'))
    limit = present(robot.tree.joints[0].limit)
    assert (limit.lower, limit.upper) == (0.0, 1.0)


def test_a_quaternion_is_used_from_version_1_1_on() -> None:
    turned = '<origin xyz="0 0 1" quat_xyzw="0 0 1 1"/>'
    old, new = (verified(arm(origin=turned, robot=f'name="r" {x}')) for x in ("", 'version="1.1"'))
    np.testing.assert_array_equal(old.placement(old.neutral(), "link:l1")[:3, :3], np.eye(3))
    R = new.placement(new.neutral(), "link:l1")[:3, :3]
    np.testing.assert_allclose(R, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


#: Texts that yourdfpy refuses or misreads.
STUMBLES = {
    "shape": base_link(shape('<box size="a b"/>')),
    "inertia": base_link('<inertial><inertia ixx="1"/></inertial>'),
    "mass": base_link('<inertial><mass value="x"/></inertial>'),
    "visual": base_link("<visual/>"),
    "namespace": arm(robot='name="r" xmlns="http://example.org"'),
    "nesting": arm(more="<a>" * 400 + "</a>" * 400),
    "colour": arm(more='<material name="m"><color rgba="1 1"/></material>'),
    "doctype": arm(head='<?xml version="1.0"?><!DOCTYPE robot>'),
    "mark": "\ufeff" + arm(),
    "comments": arm(head="<!-- first -->").replace("<parent", "<!-- x --><parent"),
}


@pytest.mark.parametrize("text", STUMBLES.values(), ids=STUMBLES)
def test_texts_that_yourdfpy_refuses_or_misreads_are_read_as_by_pinocchio(text: str) -> None:
    verified(text)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (arm(origin='<origin xyz="0\t0 1"/>'), "URDF303"),
        (arm(limit='<limit lower="-1" upper="1" effort="-1" velocity="1"/>'), "URDF509"),
        (arm(more='<link name="x"/>' + fixed("universe", "tool", "x")), "URDF404"),
        (arm(more='<link name="a\nb"/>' + fixed("k", "tool", "a\nb")), "URDF406"),
    ],
)
def test_a_robot_that_pinocchio_cannot_check_is_computed_but_not_verified(text: str, code: str) -> None:
    with pytest.warns(urdfkin.UrdfWarning, match=code):
        robot = urdfkin.load(text)
    with pytest.warns(NotVerifiedWarning, match=code):
        T = robot.placement(robot.neutral(), TIP)
    assert np.isfinite(T).all()
    assert not robot.certificate().verified


def test_a_robot_with_one_velocity_and_a_robot_with_denormal_lengths_are_verified() -> None:
    verified(arm(second='type="fixed"'))
    verified(arm(origin='<origin xyz="0 1e-310 3e-167"/>'))
