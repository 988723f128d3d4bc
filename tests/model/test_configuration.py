"""Which values of a joint are outside its bounds, and what Pinocchio's layout may hold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from urdfkin.errors import InputError
from urdfkin.model.configuration import from_pinocchio, limit_violations, to_pinocchio
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, Mimic, build_tree

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


def with_everything() -> KinematicTree:
    """A wheel, a planar joint, and a follower of the wheel that turns without end too."""
    z = np.array([0.0, 0.0, 1.0])
    kinds = [
        ("wheel", JointKind.CONTINUOUS, None),
        ("table", JointKind.PLANAR, None),
        ("slide", JointKind.PRISMATIC, Mimic("wheel", -2.0, 0.3)),
        ("gear", JointKind.CONTINUOUS, Mimic("wheel", 3.0, 0.1)),
    ]
    rows = [
        (Joint(name, kind, 0, np.eye(4), z, mimic=mimic), f"l{i}", f"l{i + 1}")
        for i, (name, kind, mimic) in enumerate(kinds)
    ]
    return build_tree("everything", "l0", rows)


@pytest.mark.parametrize("mimic", [True, False])
def test_pinocchios_layout_leads_back(mimic: bool) -> None:
    tree = with_everything()
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (2, 5, 4))
    there = to_pinocchio(tree, q, mimic=mimic)
    assert there.shape == (2, 5, 6 if mimic else 9)
    np.testing.assert_allclose(from_pinocchio(tree, there, mimic=mimic), q, atol=1e-14)


@pytest.mark.parametrize("turns", [0, 1, -3])
@pytest.mark.parametrize("angle", [-math.pi, math.pi, np.nextafter(-math.pi, 0.0), 3.0, -0.0])
def test_an_angle_comes_back_in_one_turn_whose_two_ends_are_in_it(angle: float, turns: int) -> None:
    tree = with_everything()
    there = to_pinocchio(tree, np.full(4, angle + turns * math.tau), mimic=True)
    back = from_pinocchio(tree, there, mimic=True)
    found = back[[0, 3]]  # the wheel's, and the planar joint's
    assert (np.abs(found) <= math.pi).all()
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angle), atol=1e-14)
    if not turns:
        assert (found == angle).all()


@pytest.mark.parametrize(("off", "refused"), [(1e-12, False), (1e-8, True), (-1e-3, True), (0.5, True)])
@pytest.mark.parametrize("name", ["slide", "gear"])
def test_a_follower_that_does_not_follow_is_refused(name: str, off: float, refused: bool) -> None:
    tree = with_everything()
    q = np.array([[0.2, 0.0, 0.0, 0.0], [0.4, 1.0, 2.0, 3.0]])
    there = to_pinocchio(tree, q)
    if name == "slide":
        there[1, 6] += off
    else:
        angle = 3.0 * 0.4 + 0.1 + off
        there[1, 7:] = math.cos(angle), math.sin(angle)
    if not refused:
        np.testing.assert_allclose(from_pinocchio(tree, there), q, atol=1e-14)
        return
    with pytest.raises(InputError, match=f"{name}.*off by {abs(off):.3g}|off by {abs(off):.3g}.*{name}"):
        from_pinocchio(tree, there)


@pytest.mark.parametrize("at", [0, 4])
def test_a_pair_that_is_no_cosine_and_sine_is_refused(at: int) -> None:
    tree = with_everything()
    there = to_pinocchio(tree, np.array([0.2, 0.5, -0.5, 1.0]), mimic=True)
    there[at : at + 2] *= 1.0 + 2e-6
    with pytest.raises(InputError, match="must have norm 1"):
        from_pinocchio(tree, there, mimic=True)


@pytest.mark.parametrize("length", [5, 7, 9])
def test_a_configuration_of_another_length_is_refused(length: int) -> None:
    with pytest.raises(InputError, match="wrong length"):
        from_pinocchio(with_everything(), np.zeros(length), mimic=True)
