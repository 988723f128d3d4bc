"""A URDF is read like the specification and Pinocchio read it, and a written tree is read back unchanged."""

import math
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings

import urdfkin
from tests.reading import present, tree_of
from tests.strategies import rotation, trees
from tests.urdf.lint.cases.arm import LIMIT, arm, base_link, fixed, shape
from tests.urdfs import joint, loaded, mimic
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, build_tree
from urdfkin.robot import Robot
from urdfkin.urdf.lint import Severity, check_text
from urdfkin.urdf.reader import rpy_of_quaternion
from urdfkin.urdf.writer import to_urdf
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


# -- written trees ---------------------------------------------------------------------------------------

EPS = float(np.finfo(float).eps)


def assert_same(found: KinematicTree, expected: KinematicTree) -> None:
    assert (found.name, found.links) == (expected.name, expected.links)
    for a, b in zip(found.joints, expected.joints, strict=True):
        assert (a.name, a.kind, a.parent, a.limit, a.mimic) == (b.name, b.kind, b.parent, b.limit, b.mimic)
        np.testing.assert_array_equal(a.T_parent_joint[:, 3], b.T_parent_joint[:, 3])
        np.testing.assert_allclose(a.T_parent_joint[:3, :3], b.T_parent_joint[:3, :3], rtol=0, atol=8 * EPS)
        np.testing.assert_allclose(a.axis, b.axis, rtol=0, atol=2 * EPS)


@pytest.mark.slow
@given(trees())
@example(build_tree("stone", "only", []))
def test_a_tree_written_once_or_twice_is_read_back_unchanged(tree: KinematicTree) -> None:
    text = to_urdf(tree).encode()
    assert [str(f) for f in check_text(text) if f.severity is Severity.ERROR] == []
    once = tree_of(text)
    assert_same(once, tree)
    assert_same(tree_of(to_urdf(once).encode()), once)


@pytest.mark.slow
@pytest.mark.filterwarnings("error::urdfkin.NotVerifiedWarning")
@settings(max_examples=30)
@given(trees(max_joints=6))
def test_pinocchio_agrees_on_every_written_tree(tree: KinematicTree) -> None:
    if any(finding.pinocchio_reading for finding in check_text(to_urdf(tree).encode())):
        return
    robot = loaded(tree)
    q = robot.sample(2, seed=0) if robot.nq else np.zeros((2, 0))
    v = np.full((2, robot.nv), 0.7)
    frame = f"link:{tree.links[-1]}"
    # Each call raises VerificationError if Pinocchio disagrees.
    robot.placement(q, frame)
    robot.jacobian(q, frame)
    robot.acceleration(q, v, v, frame)


@pytest.mark.slow
@pytest.mark.parametrize("off", [0.0, 1e-300, 1e-17, 1e-12, 1e-9, 1e-8, 1e-7, 1e-4])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_roll_pitch_and_yaw_are_exact_near_the_gimbal_lock(off: float, sign: float) -> None:
    generator = np.random.default_rng(0)
    for _ in range(200):
        R = rotation(generator.uniform(-3, 3), sign * (math.pi / 2 - off), generator.uniform(-3, 3))
        np.testing.assert_allclose(rotation(*rpy_of(R)), R, rtol=0, atol=6 * EPS)


def test_a_joint_without_required_limits_and_a_name_that_xml_does_not_allow_are_refused() -> None:
    for kind in (JointKind.REVOLUTE, JointKind.PRISMATIC):
        free = Joint("j", kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]))
        with pytest.raises(InputError, match="finite position limits"):
            to_urdf(build_tree("r", "a", [(free, "a", "b")]))
    with pytest.raises(InputError, match=r"U\+0000"):
        to_urdf(build_tree("r", "a\0b", []))


def test_an_infinite_effort_limit_is_written_in_urdf_version_1_2() -> None:
    limit, z = Limit(-1, 1, 2.0, math.inf), np.array([0.0, 0.0, 1.0])
    own = Joint("j", JointKind.REVOLUTE, 0, np.eye(4), z, limit=limit)
    tree = build_tree("r", "a", [(own, "a", "b")])
    text = to_urdf(tree)
    assert 'version="1.2"' in text
    assert [f.pinocchio_reading for f in check_text(text.encode())] == [None]
    assert_same(tree_of(text.encode()), tree)


@pytest.mark.parametrize("scale", [1.0, 1e-140, 1e140, -3.0])
def test_a_quaternion_of_any_length_is_a_rotation(scale: float) -> None:
    half = math.pi / 8
    quaternion = [scale * value for value in (math.sin(half), 0.0, 0.0, math.cos(half))]
    np.testing.assert_allclose(rpy_of_quaternion(quaternion), (math.pi / 4, 0.0, 0.0), atol=2 * EPS)
