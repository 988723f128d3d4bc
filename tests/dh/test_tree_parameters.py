"""The table of Khalil and Kleinfinger gives the pose of every link; for a chain, it is the modified table."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.dh.arms import arm
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift, step, trees
from urdfkin.dh import dh_table, units_of
from urdfkin.dh.tree_parameters import as_csv, as_mapping, document, tree_parameters
from urdfkin.errors import InputError
from urdfkin.model.tree import Joint, JointKind, KinematicTree, build_tree, with_root_joint

EPS = float(np.finfo(np.float64).eps)


@st.composite
def branching(draw: st.DrawFn) -> KinematicTree:
    """Return a robot whose links have several child joints, some of them fixed."""
    kinds = (JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.CONTINUOUS, JointKind.FIXED)
    joints = []
    for i in range(draw(st.integers(1, 9))):
        axis = rotation("x", draw(st.floats(-3, 3)))[2, :3]
        joint = Joint(f"j{i}", draw(st.sampled_from(kinds)), 0, draw(step()), axis / np.linalg.norm(axis))
        joints.append((joint, f"l{draw(st.integers(0, i))}", f"l{i + 1}"))
    return build_tree("bush", "l0", joints)


@pytest.mark.slow
@given(st.one_of(branching(), trees(min_joints=1)))
@settings(max_examples=30)
def test_every_link_has_the_placement_that_pinocchio_computes(tree: KinematicTree) -> None:
    table, q, oracle = tree_parameters(tree), configurations(tree.nq, 4), TreeOracle(tree)
    found = table.placements(q)
    reach = table.reach(q)
    for j, link in enumerate(tree.links[1:]):
        error = np.abs(found[:, j] - oracle.placement(q, link, "l0"))
        assert error[:, :3, :3].max() <= EPS * table.roundings
        assert (error[:, :3, 3].max(axis=-1) <= EPS * table.roundings * reach[:, j] + 1e-300).all()


@pytest.mark.slow
@given(branching())
@settings(max_examples=40)
def test_no_length_exceeds_ten_times_the_reach(tree: KinematicTree) -> None:
    reach = sum(math.hypot(*joint.T_parent_joint[:3, 3]) for joint in tree.joints)
    for row in tree_parameters(tree).rows:
        assert max(abs(row.b), abs(row.d), abs(row.r)) <= 10.0 * reach


@pytest.mark.slow
@given(branching())
@settings(max_examples=40)
def test_gamma_and_b_are_zero_on_the_first_moving_child(tree: KinematicTree) -> None:
    met = {-1}
    for row in tree_parameters(tree).rows:
        if row.sigma < 2 and row.antecedent not in met:
            met.add(row.antecedent)
            assert (row.gamma, row.b) == (0.0, 0.0)


def test_for_a_chain_the_table_equals_the_modified_table() -> None:
    bent, last = shift(0.05, 0, 0.1) @ rotation("x", math.pi / 2), rotation("x", -1.0) @ shift(0.02, 0, 0.3)
    tree = arm(shift(0, 0, 0.3), bent, shift(0.4, 0, 0.1), last)
    modified = dh_table(tree, "tip", convention="modified")
    rows = [row for row in tree_parameters(tree).rows if row.sigma < 2]
    for row, other in zip(rows, modified.rows, strict=True):
        assert (row.gamma, row.b) == (0.0, 0.0)
        mine = (row.d, row.alpha, row.r, row.theta, row.beta)
        assert np.abs(np.subtract(mine, other.cells)).max() <= 1e-14


def test_a_floating_joint_is_refused_with_a_remedy() -> None:
    with pytest.raises(InputError, match=r"joint root_joint: a floating joint .* without root_joint"):
        tree_parameters(with_root_joint(arm(np.eye(4)), JointKind.FLOATING))


def test_the_written_table_contains_the_antecedents() -> None:
    tree = arm(shift(0, 0, 0.3), shift(0.05, 0, 0) @ rotation("x", math.pi / 2), kinds="RP")
    table = tree_parameters(tree)
    lines = document(table, units_of("degrees", "millimetres")).text().splitlines()
    assert lines[0] == "arm: Khalil-Kleinfinger parameters, l0 is frame 0"
    assert lines[6].split() == ["2", "j2", "1", "1", "0", "0", "90", "50", "0", "q(j2)"]
    assert document(table, units_of()).markdown().count("|") == 11 * 5
    sheet = list(csv.DictReader(as_csv(table).splitlines()))
    assert list(sheet[0])[:4] == ["joint", "link", "antecedent", "sigma"]
    for row, T in zip(sheet, table.T_frame_link, strict=True):
        assert [float(row[f"T{i}{j}"]) for i in (1, 2, 3) for j in (1, 2, 3, 4)] == T[:3].ravel().tolist()
    assert [row["antecedent"] for row in as_mapping(table)["rows"]] == [0, 1, 2]
