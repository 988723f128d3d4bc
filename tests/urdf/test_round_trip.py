"""A tree that is written as URDF and read back is the same tree, and Pinocchio agrees on its kinematics."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from tests.reading import tree_of
from tests.strategies import rotation, rotations, trees
from tests.urdfs import loaded
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, build_tree
from urdfkin.urdf.lint import Severity, check_text
from urdfkin.urdf.reader import rpy_of_quaternion
from urdfkin.urdf.writer import to_urdf

EPS = float(np.finfo(float).eps)


def assert_same(found: KinematicTree, given_tree: KinematicTree) -> None:
    assert (found.name, found.links) == (given_tree.name, given_tree.links)
    for a, b in zip(found.joints, given_tree.joints, strict=True):
        assert (a.name, a.kind, a.parent, a.limit, a.mimic) == (b.name, b.kind, b.parent, b.limit, b.mimic)
        np.testing.assert_array_equal(a.T_parent_joint[:, 3], b.T_parent_joint[:, 3])
        np.testing.assert_allclose(a.T_parent_joint[:3, :3], b.T_parent_joint[:3, :3], rtol=0, atol=8 * EPS)
        np.testing.assert_allclose(a.axis, b.axis, rtol=0, atol=2 * EPS)


@pytest.mark.slow
@given(trees())
def test_a_written_tree_reads_back_as_itself(tree: KinematicTree) -> None:
    text = to_urdf(tree).encode()
    errors = [str(f) for f in check_text(text) if f.severity is Severity.ERROR]
    assert errors == []
    assert_same(tree_of(text), tree)


@pytest.mark.slow
@given(trees())
def test_writing_twice_changes_nothing_but_the_last_digits_of_angles(tree: KinematicTree) -> None:
    once = tree_of(to_urdf(tree).encode())
    assert_same(tree_of(to_urdf(once).encode()), once)


@pytest.mark.slow
@pytest.mark.filterwarnings("error::urdfkin.NotVerifiedWarning")
@settings(max_examples=30)
@given(trees(max_joints=6))
def test_pinocchio_agrees_on_every_written_tree(tree: KinematicTree) -> None:
    if any(finding.oracle for finding in check_text(to_urdf(tree).encode())):
        return
    robot = loaded(tree)
    q = robot.sample(2, seed=0) if robot.nq else np.zeros((2, 0))
    v = np.full((2, robot.nv), 0.7)
    frame = f"link:{tree.links[-1]}"
    robot.placement(q, frame)  # each raises VerificationError when Pinocchio disagrees
    robot.jacobian(q, frame)
    robot.acceleration(q, v, v, frame)


def test_a_tree_of_nothing_but_a_link_reads_back() -> None:
    tree = build_tree("stone", "only", [])
    assert_same(tree_of(to_urdf(tree).encode()), tree)


@pytest.mark.slow
@given(rotations)
def test_angles_give_the_rotation_back_even_where_pitch_is_a_quarter_turn(R: FloatArray) -> None:
    np.testing.assert_allclose(rotation(*rpy_of(R)), R, rtol=0, atol=6 * EPS)


@pytest.mark.slow
@pytest.mark.parametrize("off", [0.0, 1e-300, 1e-17, 1e-12, 1e-9, 1e-8, 1e-7, 1e-4])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_are_exact_on_the_way_into_the_gimbal_lock(off: float, sign: float) -> None:
    generator = np.random.default_rng(0)
    for _ in range(200):
        R = rotation(generator.uniform(-3, 3), sign * (math.pi / 2 - off), generator.uniform(-3, 3))
        np.testing.assert_allclose(rotation(*rpy_of(R)), R, rtol=0, atol=6 * EPS)


@pytest.mark.parametrize("kind", [JointKind.REVOLUTE, JointKind.PRISMATIC])
def test_a_joint_that_needs_limits_is_not_written_without(kind: JointKind) -> None:
    joint = Joint("j", kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]))
    with pytest.raises(InputError, match="finite position limits"):
        to_urdf(build_tree("r", "a", [(joint, "a", "b")]))


def test_a_name_that_xml_cannot_hold_is_not_written() -> None:
    with pytest.raises(InputError, match=r"U\+0000"):
        to_urdf(build_tree("r", "a\0b", []))


def test_an_infinite_effort_makes_the_file_version_1_2() -> None:
    limit, z = Limit(-1, 1, 2.0, math.inf), np.array([0.0, 0.0, 1.0])
    joint = Joint("j", JointKind.REVOLUTE, 0, np.eye(4), z, limit=limit)
    tree = build_tree("r", "a", [(joint, "a", "b")])
    text = to_urdf(tree)
    assert 'version="1.2"' in text
    assert [f.oracle for f in check_text(text.encode())] == [None]
    assert_same(tree_of(text.encode()), tree)


@pytest.mark.parametrize("scale", [1.0, 1e-140, 1e140, -3.0])
def test_a_quaternion_of_any_length_is_a_rotation(scale: float) -> None:
    half = math.pi / 8
    quaternion = [scale * value for value in (math.sin(half), 0.0, 0.0, math.cos(half))]
    np.testing.assert_allclose(rpy_of_quaternion(quaternion), (math.pi / 4, 0.0, 0.0), atol=2 * EPS)
