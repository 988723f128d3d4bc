"""Undeclared prefixes and unexpanded xacro that do not affect the motion of the robot."""

import xml.etree.ElementTree as Xml
from contextlib import nullcontext

import pytest
from hypothesis import given
from hypothesis import strategies as st

import urdfkin
from tests.urdf.lint.cases.arm import MESH, arm
from tests.urdfs import loaded
from urdfkin.urdf.lint import Finding, Severity
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.view.scene import shapes

UNDECLARED = "URDF214"
FOLLOWS = '<mimic joint="j1" multiplier="-2" offset="0.1"/>'
SPHERE = '<link name="base"><visual><geometry><sphere radius="1"/></geometry></visual></link>'


def undeclared(text: str) -> list[Finding]:
    return [finding for finding in urdfkin.check(text) if finding.code == UNDECLARED]


@pytest.mark.slow
@pytest.mark.parametrize("more", ["<drake:x/>", '<gazebo drake:a="1"/>'])
def test_a_robot_with_a_mimic_joint_and_an_undeclared_prefix_is_verified(more: str) -> None:
    robot = loaded(arm(follow=FOLLOWS, more=more))
    T = robot.placement([0.3], "tool")
    assert robot.certificate().verified
    assert (loaded(arm(follow=FOLLOWS)).placement([0.3], "tool") == T).all()


@pytest.mark.slow
def test_the_accuracy_study_and_the_viewer_read_a_file_with_an_undeclared_prefix() -> None:
    robots = (loaded(arm(follow=FOLLOWS, more=more)) for more in ("<d:x/>", ""))
    with_prefix, without = (accuracy_study(robot, samples=2).lines[0] for robot in robots)
    assert with_prefix == without
    (shape,) = shapes(loaded(arm(base=SPHERE, more="<drake:x/>")))
    assert (shape.link, shape.kind) == ("base", "sphere")


def test_each_undeclared_prefix_is_reported_once_and_the_prefix_xacro_as_unexpanded_xacro() -> None:
    more = '<a:x/><b:x/>\n  <a:y/><gazebo c:u="1" xmlns:d="http://d"/><d:z/>'
    found = undeclared(arm(more=more))
    assert [(f.line, f.column) for f in found] == [(8, 3), (8, 9), (9, 17), (9, 45)]
    assert {f.severity for f in found} == {Severity.WARNING}
    assert [f.found for f in found] == ['"<a:x>" and 1 more', '"<b:x>"', '"c:u"', '"<d:z>"']
    found = urdfkin.check(arm(more='<xacro:leg prefix="left"/>'))
    assert [finding.code for finding in found if finding.severity is not Severity.NOTE] == ["URDF202"]


DECLARED = [
    '<d:x xmlns:d="http://d"/>', '<gazebo xmlns:d="http://d"><d:x d:y="1"/></gazebo>',
    '<gazebo xml:lang="en"/>', "<gazebo>a:b</gazebo>", '<gazebo a="b:c"/>',
]  # fmt: skip


@pytest.mark.parametrize("more", DECLARED)
def test_a_declared_prefix_is_not_reported(more: str) -> None:
    assert undeclared(arm(more=more)) == []


PARTS = [
    '<gazebo xmlns:a="http://a">', '<gazebo xmlns:b="http://b" a:u="1">', "<a:x>", "<b:x>", '<x b:u="1">',
]  # fmt: skip


def _nested(parts: list[str]) -> str:
    """Write some of the elements inside each other, and others after each other."""
    if not parts:
        return ""
    tag = parts[0][1:-1].split(" ")[0]
    cut = len(parts) // 2
    return f"{parts[0]}{_nested(parts[1 : cut + 1])}</{tag}>{_nested(parts[cut + 1 :])}"


@pytest.mark.slow
@given(st.lists(st.sampled_from(PARTS), max_size=7))
def test_an_undeclared_prefix_is_reported_exactly_if_a_reader_with_namespaces_refuses_the_file(
    parts: list[str],
) -> None:
    text = f'<robot name="r"><link name="base"/>{_nested(parts)}</robot>'
    with pytest.raises(Xml.ParseError) if undeclared(text) else nullcontext():
        Xml.fromstring(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        arm(base=MESH.format("package://tools/$(arg tool)/tool.stl")),
        arm(base='<link name="base"><xacro:insert_block name="inertia"/></link>'),
        arm(more='<gazebo><xacro:plugin/><p name="${x}"/></gazebo>'),
    ],
)
def test_a_robot_whose_motion_does_not_depend_on_xacro_is_verified(text: str) -> None:
    robot = loaded(text)
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
def test_a_robot_whose_motion_depends_on_xacro_is_refused(text: str) -> None:
    (error,) = [f for f in urdfkin.check(text) if f.code == "URDF202" and f.severity is Severity.ERROR]
    assert "expand the file first" in str(error.remedy)
