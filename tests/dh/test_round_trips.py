"""There and back: the other convention, a tree, a table again; the placement never changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracle import TreeOracle
from tests.random_chains import configurations, trees
from urdfkin.dh import table_from_rows
from urdfkin.dh.convert import to_convention, to_tree
from urdfkin.dh.make import dh_table
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.errors import InputError
from urdfkin.model.chain import chain
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic

conventions = st.sampled_from(["standard", "modified"])


def agree(first: FloatArray, second: FloatArray, table: DHTable, q: FloatArray) -> bool:
    metres, radians = table.tolerance(q)
    error = np.abs(first - second)
    lengths, turns = error[..., :3, 3].max(axis=-1), error[..., :3, :3].max(axis=(-1, -2))
    return bool((lengths <= 3 * metres).all() and (turns <= 3 * radians).all())


def same_cells(first: DHTable, second: DHTable) -> bool:
    one, two = (np.array([row.cells for row in table.rows]) for table in (first, second))
    return bool(np.allclose(one, two, rtol=0, atol=1e-12))


@pytest.mark.slow
@given(trees(), conventions, st.sampled_from(["tip", "flange"]))
@settings(max_examples=50)
def test_a_convention_to_the_other_and_back_is_the_same_table(tree: Any, convention: str, last: str) -> None:
    table = dh_table(tree, "tip", convention=convention, last=last)
    other = "modified" if convention == "standard" else "standard"
    there = to_convention(table, other)
    back = to_convention(there, convention)
    q = configurations(len(table.joint_names))
    assert there.convention == other
    assert agree(table.placement(q), there.placement(q), table, q)
    assert agree(table.placement(q), back.placement(q), table, q)


@pytest.mark.slow
@given(trees(), conventions)
@settings(max_examples=40)
def test_a_table_as_a_tree_places_the_tip_alike_in_pinocchio(tree: KinematicTree, convention: str) -> None:
    table = dh_table(tree, "tip", convention=convention)
    robot = to_tree(table)
    tip = robot.links[robot.frame_link("tip")]
    q = configurations(robot.nq, 4)
    path = chain(robot, tip)
    own = path.coupling.select(robot, q)
    assert set(path.joint_names) == set(table.joint_names)
    order = [path.joint_names.index(name) for name in table.joint_names]
    theirs = TreeOracle(robot).placement(q, tip, robot.links[0])
    assert agree(table.placement(own[:, order]), theirs, table, own)


@pytest.mark.slow
@given(trees(mimics=False), conventions)
@settings(max_examples=40)
def test_a_table_from_the_tree_of_a_table_is_as_exact(tree: KinematicTree, convention: str) -> None:
    table = dh_table(tree, "tip", convention=convention)
    again = dh_table(to_tree(table), "tip", convention=convention)
    q = configurations(len(table.joint_names))
    assert agree(table.placement(q), again.placement(q), table, q)


#: The Stanford arm.
STANFORD = [
    [0, "-pi/2", 0.412, 0], [0, "pi/2", 0.154, 0], [0.0203, 0, 0, "-pi/2", "P"], [0, "-pi/2", 0, 0],
    [0, "pi/2", 0, 0], [0, 0, 0, 0],
]  # fmt: skip


def test_the_stanford_arm_survives_the_way_to_a_tree_and_back_cell_by_cell() -> None:
    table = table_from_rows(STANFORD, "standard")
    again = dh_table(to_tree(table), "tip")
    assert same_cells(table, again)
    np.testing.assert_allclose(again.base, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(again.tool, np.eye(4), atol=1e-15)


def test_a_leader_off_the_path_stays_a_coordinate_in_the_tree() -> None:
    row = DHRow(0.3, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "follower", mimic=Mimic("far", 2.0, 0.1))
    table = DHTable(DHConvention.STANDARD, (row,))
    robot = to_tree(table)
    assert table.joint_names == ("far",)
    assert robot.nq == 1
    q = np.array([[0.2]])
    np.testing.assert_allclose(TreeOracle(robot).placement(q, "tip", "base"), table.placement(q), atol=1e-15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": float("nan")}, "row of joint j: a is not a finite number"),
        ({"sense": 2}, r"`sense` must be \+1 or -1"),
        ({"kind": JointKind.FLOATING}, "revolute, continuous or prismatic"),
    ],
)
def test_an_inconsistent_row_is_refused(change: dict[str, object], message: str) -> None:
    row = DHRow(0.0, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "j")
    with pytest.raises(InputError, match=message):
        replace(row, **change)  # type: ignore[arg-type]


def test_two_rows_of_one_joint_and_a_bent_base_are_refused() -> None:
    row = DHRow(0.0, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "j")
    with pytest.raises(InputError, match="two rows name the same joint: found 'j'"):
        DHTable(DHConvention.STANDARD, (row, row))
    with pytest.raises(InputError, match="rotation and a translation"):
        DHTable(DHConvention.STANDARD, (row,), base=np.diag([1.0, 1.0, 2.0, 1.0]))
    with pytest.raises(InputError, match=r"\(4, 4\)"):
        DHTable(DHConvention.STANDARD, (row,), tool=np.eye(3))
