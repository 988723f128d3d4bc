"""Every base-to-leaf path of every catalogue robot, both conventions: the table is Pinocchio's robot."""

from __future__ import annotations

import pytest

from urdfkin.dh.common_normals import left_out
from urdfkin.dh.make import dh_table
from urdfkin.kinematics.roundings import EPS
from urdfkin.robot.loading import load
from urdfkin.urdf.catalogue import examples

#: Tables of each robot that is checked in the fast subset.
FAST = {"ur5", "panda", "xarm7", "kinova", "so101", "tiago"}
LENGTH_BOUND = 10.0

robots = [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in examples()]


@pytest.mark.slow
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", robots)
def test_every_path_to_a_leaf_agrees_with_pinocchio_and_has_no_long_row(name: str, convention: str) -> None:
    robot = load(name)
    root = robot.tree.links[0]
    for leaf in robot.tree.leaves():
        tip = robot.tree.links[leaf]
        table = dh_table(robot.tree, tip, root, convention)
        check = robot.verifier.table(table, samples=10)
        assert check is not None
        assert check.agrees
        assert max(check.units.values()) <= 20.0 + left_out(robot.chain(tip, root)) / EPS
        reach = float(robot.chain(tip, root).lengths.sum())
        assert all(max(abs(row.a), abs(row.d)) <= LENGTH_BOUND * reach for row in table.rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "base", "tip"),
    [
        ("talos", "left_sole_link", "gripper_right_base_link"),
        ("icub", "l_sole", "r_gripper"),
        ("ur5", "tool0", "base"),
        ("hyq", "lf_foot", "rh_foot"),
    ],
)
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("snap", [0.0, 1e-3])
def test_a_path_through_the_common_ancestor_agrees_with_pinocchio(
    name: str, base: str, tip: str, convention: str, snap: float
) -> None:
    table = load(name).dh(tip, base, convention, snap=snap)
    assert table.rows
