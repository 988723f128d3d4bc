"""The bound of a snapped table, number for number: each angle times the way from its pivot to the tip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.dh.arms import arm
from tests.random_chains import rotation, shift
from urdfkin.dh import dh_table
from urdfkin.dh.statement import SnapChange, SnapStatement
from urdfkin.tree import Joint, JointKind, KinematicTree, Limit, build_tree

OFF = 1e-5


def test_a_change_moves_the_tip_by_its_angle_times_its_lever() -> None:
    assert SnapChange(0, "origin of a", 1e-3, 4.0).tip == 4e-3
    assert SnapChange(0, "origin of a", 1e-3, 0.0).tip == 0.0


def test_an_angle_at_the_first_joint_is_seen_along_the_whole_way_and_one_at_the_last_along_the_rest() -> None:
    quarter = math.pi / 2
    for tilts, lever in [((OFF, 0.0), 3.0 + 0.5), ((0.0, OFF), 0.5)]:
        tree = arm(
            np.eye(4),
            shift(0, 0, 1.0) @ rotation("x", quarter + tilts[0]),
            shift(3.0, 0, 0) @ rotation("x", quarter + tilts[1]),
            tip=shift(0, 0.5, 0),
        )
        snap = dh_table(tree, "tip", snap=10 * OFF).snap
        assert snap is not None
        assert snap.radians == pytest.approx(OFF, rel=1e-9)
        assert snap.metres == pytest.approx(OFF * lever, rel=1e-9)
        assert 0.0 < snap.measured_metres <= snap.metres


@pytest.mark.parametrize("beyond", [0.0, 3.0])
def test_an_angle_made_of_two_fixed_ones_is_seen_from_the_joint_behind_it(beyond: float) -> None:
    """Neither origin is nearly round, both together are."""
    z = np.array([0.0, 0.0, 1.0])
    joints = [
        (Joint("a", JointKind.REVOLUTE, 0, np.eye(4), z), "l0", "l1"),
        (Joint("bolt", JointKind.FIXED, 0, rotation("x", 0.3), z), "l1", "l2"),
        (Joint("b", JointKind.REVOLUTE, 0, rotation("x", math.pi / 2 - 0.3 + OFF), z), "l2", "l3"),
        (Joint("c", JointKind.REVOLUTE, 0, shift(beyond, 0, 0), z), "l3", "l4"),
        (Joint("end", JointKind.FIXED, 0, shift(0, 0.5, 0), z), "l4", "tip"),
    ]
    snap = dh_table(build_tree("bolted", "l0", joints), "tip", snap=10 * OFF).snap
    assert snap is not None
    assert [change.lever for change in snap.changes] == [pytest.approx(beyond + 0.5)]
    assert snap.metres == pytest.approx(OFF * (beyond + 0.5), rel=1e-9)
    assert 0.0 < snap.measured_metres <= snap.metres


def sliding(limit: Limit | None, tilt: float = OFF) -> KinematicTree:
    """A tilt before a joint that turns, then one that slides, then 2 m to the tip."""
    z = np.array([0.0, 0.0, 1.0])
    joints = [
        (Joint("a", JointKind.REVOLUTE, 0, rotation("x", math.pi / 2 + tilt), z), "l0", "l1"),
        (Joint("b", JointKind.PRISMATIC, 0, rotation("y", math.pi / 2), z, limit), "l1", "l2"),
        (Joint("end", JointKind.FIXED, 0, shift(0, 0, 2.0), z), "l2", "tip"),
    ]
    return build_tree("sliding", "l0", joints)


@pytest.mark.parametrize(
    ("limit", "travel"), [(None, 1.0), (Limit(-0.5, 3.0, 1.0, 1.0), 3.0), (Limit(-4.0, 3.0, 1.0, 1.0), 4.0)]
)
def test_the_travel_of_what_slides_lengthens_the_lever(limit: Limit | None, travel: float) -> None:
    snap = dh_table(sliding(limit), "tip", snap=10 * OFF).snap
    assert snap is not None
    assert snap.per_metre == {"b": pytest.approx(OFF, rel=1e-9)}
    assert snap.metres == pytest.approx(OFF * (2.0 + travel), rel=1e-9)
    assert snap.bound({"b": np.array([0.0, -5.0])}) == pytest.approx([2.0 * OFF, 7.0 * OFF], rel=1e-9)


def test_a_statement_adds_up_what_is_said_of_each_change() -> None:
    changes = (SnapChange(1, "x", 1e-3, 2.0, ("s",)), SnapChange(-1, "y", 2e-3, 5.0))
    said = SnapStatement(1e-2, changes, 0.0, 0.0, {"s": 1e-3})
    assert said.rows == (-1, 1)
    assert said.bound({"s": np.array([0.0, -10.0])}) == pytest.approx([0.012, 0.022])
