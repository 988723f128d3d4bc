"""Which values of a joint are outside its bounds, and how little of it is enough."""

from __future__ import annotations

import math

import numpy as np
import pytest

from urdfkin.configuration import limit_violations
from urdfkin.tree import Joint, JointKind, KinematicTree, Limit, Mimic, build_tree

LOWER, UPPER = -0.7, 1.3


def two_joints(mimic: Mimic | None = None) -> KinematicTree:
    """A joint `a` with bounds, and a sliding one `b` that may go from 0 to 0.1 m."""
    z = np.array([0.0, 0.0, 1.0])
    a = Joint("a", JointKind.REVOLUTE, 0, np.eye(4), z, Limit(LOWER, UPPER, 1.0, 1.0))
    b = Joint("b", JointKind.PRISMATIC, 0, np.eye(4), z, Limit(0.0, 0.1, 1.0, 1.0), mimic)
    return build_tree("two", "l0", [(a, "l0", "l1"), (b, "l1", "l2")])


@pytest.mark.parametrize(
    "a", [LOWER, 0.0, UPPER, math.nextafter(LOWER, -1.0), math.nextafter(UPPER, 2.0)], ids=str
)
def test_a_bound_is_within_itself_and_so_is_its_neighbour(a: float) -> None:
    assert limit_violations(two_joints(), np.array([a, 0.05])) == []


@pytest.mark.parametrize("beyond", [1e-12, 1e-6, 1e-3, 1.0])
@pytest.mark.parametrize(("bound", "sign"), [(LOWER, -1.0), (UPPER, 1.0)])
def test_however_little_a_joint_is_outside_it_is_said(bound: float, sign: float, beyond: float) -> None:
    q = np.array([[0.0, 0.05], [bound + sign * beyond, 0.05], [0.1, 0.05]])
    (line,) = limit_violations(two_joints(), q)
    assert line == f"joint a: {bound + sign * beyond:.6g} is outside [-0.7, 1.3]"


def test_the_worst_value_of_a_batch_is_told_for_each_joint() -> None:
    q = np.array([[[1.4, -0.2], [1.9, 0.0]], [[-0.8, 0.3], [0.0, 0.05]]])
    assert limit_violations(two_joints(), q) == [
        "joint a: 1.9 is outside [-0.7, 1.3]",
        "joint b: -0.2 is outside [0, 0.1]",
    ]


@pytest.mark.parametrize(("a", "b"), [(0.15, None), (0.21, "0.11"), (-0.01, None), (-0.02, "-0.005")])
def test_a_follower_is_held_to_its_own_bounds(a: float, b: str | None) -> None:
    found = limit_violations(two_joints(Mimic("a", 0.5, 0.005)), np.array([a]))
    assert found == ([] if b is None else [f"joint b: {b} is outside [0, 0.1]"])


def test_a_joint_without_bounds_and_a_batch_without_rows_are_never_outside() -> None:
    free = Joint("c", JointKind.CONTINUOUS, 0, np.eye(4), np.array([0.0, 0.0, 1.0]))
    tree = build_tree("free", "l0", [(free, "l0", "l1")])
    assert limit_violations(tree, np.array([1e9])) == []
    assert limit_violations(two_joints(), np.empty((0, 2))) == []
