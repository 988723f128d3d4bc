"""A tree that is written as URDF and read again is the same tree, and Pinocchio confirms its kinematics."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from tests.reading import tree_of
from tests.strategies import rotation, trees
from tests.urdfs import loaded
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, build_tree
from urdfkin.urdf.lint import Severity, check_text
from urdfkin.urdf.reader import rpy_of_quaternion
from urdfkin.urdf.writer import to_urdf

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
    if any(finding.oracle for finding in check_text(to_urdf(tree).encode())):
        return
    robot = loaded(tree)
    q = robot.sample(2, seed=0) if robot.nq else np.zeros((2, 0))
    v = np.full((2, robot.nv), 0.7)
    frame = f"link:{tree.links[-1]}"
    # Each call raises VerificationError if Pinocchio disagrees.
    robot.placement(q, frame)
    robot.jacobian(q, frame)
    robot.acceleration(q, v, v, frame)


def test_a_tree_with_one_link_is_read_back() -> None:
    tree = build_tree("stone", "only", [])
    assert_same(tree_of(to_urdf(tree).encode()), tree)


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
        joint = Joint("j", kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]))
        with pytest.raises(InputError, match="finite position limits"):
            to_urdf(build_tree("r", "a", [(joint, "a", "b")]))
    with pytest.raises(InputError, match=r"U\+0000"):
        to_urdf(build_tree("r", "a\0b", []))


def test_an_infinite_effort_limit_is_written_in_urdf_version_1_2() -> None:
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
