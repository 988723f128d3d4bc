"""A derived table has the poses of its chain for every geometry, and the cells that a person would write."""

import csv
import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import urdfkin
from tests.dh.arms import CONVENTIONS, EPS, arm, error_ratio
from tests.high_precision import mp, turn
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift, step, trees
from urdfkin.dh.make import make_dh_table
from urdfkin.dh.motion import acceleration, jacobian, velocity
from urdfkin.dh.table import DHConvention, DHTable
from urdfkin.dh.tree_parameters import as_csv, as_mapping, make_tree_parameters, tree_document
from urdfkin.dh.units import (
    AngleUnit,
    LengthUnit,
    Units,
    format_pi_fraction,
    parse_number,
    parse_units,
    pi_fraction,
)
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.tree import Joint, JointKind, KinematicTree, build_tree, with_root_joint

LENGTH_BOUND = 10.0


def reach_of(path: FrameChain) -> float:
    return float(path.lengths.sum())


def demand_exact(table: DHTable, path: FrameChain) -> None:
    """Demand that the table's tip has the poses of the path's tip, up to rounding."""
    q = configurations(len(path.joint_names))
    slack = 4 * EPS * (1 + sum(path.pose_counts)) * reach_of(path)
    assert error_ratio(table, table.placement(q), path.placement(q), q, slack) <= 2.0


def demand_short(table: DHTable, path: FrameChain) -> None:
    longest = max((max(abs(row.a), abs(row.d)) for row in table.rows), default=0.0)
    assert longest <= LENGTH_BOUND * reach_of(path)


@pytest.mark.slow
@given(
    trees(), st.booleans(), *map(st.sampled_from, (CONVENTIONS, ("tip", "flange"), ("last", "first", "each")))
)
@settings(max_examples=700)
def test_the_tables_of_random_chains_are_exact_and_short(
    tree: Any, backwards: bool, convention: str, last: str, offset: str
) -> None:
    ends = ("l0", "tip") if backwards else ("tip", "l0")
    path, table = (
        make_chain(tree, *ends),
        make_dh_table(tree, *ends, convention, last=last, parallel_offset=offset),
    )
    demand_exact(table, path)
    demand_short(table, path)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("tilt", [0.0101, 0.0129, 0.02, 0.04, 0.2])
def test_a_table_with_a_first_axis_close_to_the_x_axis_is_within_the_tolerance(
    tilt: float, convention: str
) -> None:
    for k in range(100):
        T = np.eye(4)
        T[:3, :3] = rotation_from_rpy([np.pi / 2, 0.0, np.pi / 2 + tilt * (1.0 + k * 1e-8)])
        tree = arm(T)
        for ends in (("tip", "l0"), ("l0", "tip")):
            path, table = make_chain(tree, *ends), make_dh_table(tree, *ends, convention)
            q = configurations(1)
            off = np.abs(table.placement(q) - path.placement(q))[:, :3, :3].max(axis=(1, 2))
            assert (off <= table.tolerance(q)[1]).all()


@pytest.mark.parametrize("turns", [1e2, 1e4])
def test_the_tolerance_covers_the_rounding_of_large_angles(turns: float) -> None:
    tree = arm(
        rotation("z", 0.3), shift(0.4, 0, 0.1) @ rotation("x", 1.1), shift(0.3, 0.2, 0) @ rotation("y", 0.7)
    )
    path, table = make_chain(tree, "tip", "l0"), make_dh_table(tree, "tip", "l0")
    q = np.random.default_rng(5).uniform(-turns, turns, (200, 3)) * math.tau
    assert error_ratio(table, table.placement(q), path.placement(q), q) <= 1.0


@pytest.mark.slow
@given(trees(min_joints=1))
@settings(max_examples=30)
def test_equal_chains_give_bitwise_equal_tables(tree: KinematicTree) -> None:
    first, second = make_dh_table(tree, "tip"), make_dh_table(replace(tree), "tip")
    assert first.rows == second.rows
    assert first.base.tobytes() == second.base.tobytes()
    assert first.tool.tobytes() == second.tool.tobytes()


def exact_placement(table: DHTable, values: list[float]) -> Any:
    """Return the product of the table's transforms at 60 digits."""
    T = mp.matrix(table.base.tolist())
    for row, value in zip(table.rows, values, strict=True):
        moved = row.sense * mp.mpf(value)
        theta = mp.mpf(row.theta) + (moved if row.kind.turns else 0)
        d = mp.mpf(row.d) + (0 if row.kind.turns else moved)
        S = mp_turn(2, theta) * mp_shift(2, d)
        a, alpha, beta = map(mp.mpf, (row.a, row.alpha, row.beta))
        X = mp_shift(0, a) * mp_turn(0, alpha) * mp_turn(1, beta)
        T = T * (S * X if table.convention is DHConvention.STANDARD else X * S)
    return T * mp.matrix(table.tool.tolist())


def exact_chain(path: FrameChain, values: list[float]) -> Any:
    T = mp.eye(4)
    for joint, value in zip(path.joints, values, strict=True):
        move = mp_turn if joint.kind.turns else mp_shift
        T = T * mp.matrix(joint.T_previous_joint.tolist()) * move(2, mp.mpf(value))
    return T * mp.matrix(path.T_last_tip.tolist())


def mp_turn(axis: int, angle: Any) -> Any:
    T = mp.eye(4)
    T[:3, :3] = turn("xyz"[axis], angle)
    return T


def mp_shift(axis: int, length: Any) -> Any:
    T = mp.eye(4)
    T[axis, 3] = length
    return T


@pytest.mark.slow
@given(trees(min_joints=1, max_joints=5), st.sampled_from(CONVENTIONS))
@settings(max_examples=30)
def test_cells_are_accurate_to_a_few_units_in_the_last_place(tree: KinematicTree, convention: str) -> None:
    path, table = make_chain(tree, "tip"), make_dh_table(tree, "tip", convention=convention)
    for q in configurations(len(path.joint_names), 3):
        values = path.coupling.values(q).tolist()
        error = exact_placement(table, values) - exact_chain(path, values)
        travel = sum(abs(v) for v, row in zip(values, table.rows, strict=True) if not row.kind.turns)
        scale = EPS * 16 * (1 + len(table.rows))
        assert max(abs(error[i, j]) for i in range(3) for j in range(3)) <= scale
        assert max(abs(error[i, 3]) for i in range(3)) <= scale * (reach_of(path) + travel)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("power", range(1, 17))
def test_axes_of_any_tilt_give_an_exact_and_short_table(power: int, convention: str) -> None:
    tilted = shift(0.4, 0.1, 0.05) @ rotation("x", 10.0**-power) @ rotation("y", 3.0 * 10.0**-power)
    tree = arm(rotation("x", 0.4) @ shift(0, 0, 0.3), tilted, tilted, rotation("x", 1.0), kinds="RRRR")
    path, table = make_chain(tree, "tip"), make_dh_table(tree, "tip", convention=convention)
    demand_exact(table, path)
    demand_short(table, path)


@pytest.mark.slow
@given(st.floats(-3, 3), st.floats(-3, 3), st.integers(3, 15), st.floats(-0.5, 0.5), st.floats(0.05, 0.5))
@settings(max_examples=40)
def test_a_tiny_tilt_of_parallel_axes_changes_the_cells_only_slightly(
    direction: float, turn: float, power: int, offset: float, a: float
) -> None:
    def table(tilt: float) -> DHTable:
        tip = rotation("z", direction) @ rotation("x", tilt) @ rotation("z", turn)
        last = rotation("x", 1.0) @ shift(0, 0, 0.2)
        return make_dh_table(arm(np.eye(4), shift(a, 0.0, offset) @ tip, last), "tip")

    level, tilted = table(0.0), table(10.0**-power)
    for before, after in zip(level.rows, tilted.rows, strict=True):
        for name in ("a", "d", "alpha", "beta"):
            assert abs(getattr(before, name) - getattr(after, name)) <= 4 * 10.0**-power + 1e-14


def test_strict_rows_have_no_beta_and_are_exact_within_the_rounding_of_long_rows() -> None:
    tilted = shift(0.4, 0.1, 0.0) @ rotation("x", 1e-6)
    tree = arm(np.eye(4), tilted, rotation("x", 1.0))
    hayati, strict = make_dh_table(tree, "tip"), make_dh_table(tree, "tip", near_parallel="strict")
    assert hayati.has_hayati_rows
    assert not strict.has_hayati_rows
    assert max(abs(row.d) for row in strict.rows) > 1e4
    demand_exact(strict, make_chain(tree, "tip"))


def test_a_strict_table_with_a_prismatic_joint_beside_a_tilt_is_short() -> None:
    tilted = shift(0.4, 0.1, 0.0) @ rotation("x", 1e-6)
    for kinds in ("RPR", "PRR", "RRP"):
        steps = [np.eye(4), tilted, rotation("x", 1.0)]
        steps = steps if kinds != "RRP" else steps[2:] + steps[:2]
        tree = arm(*steps, kinds=kinds, tip=shift(0.1, 0.2, 0.3))
        table = make_dh_table(tree, "tip", near_parallel="strict")
        demand_exact(table, make_chain(tree, "tip"))
        assert max(abs(row.d) for row in table.rows) < 1.0
        assert not table.has_hayati_rows


# -- canonical choices ---------------------------------------------------------------------------------


def cells(table: DHTable) -> list[tuple[float, ...]]:
    return [tuple(round(cell, 12) + 0.0 for cell in row.cells[:4]) for row in table.rows]


def test_the_base_is_the_identity_and_d1_stays_in_the_table() -> None:
    tree = arm(shift(0, 0, 0.3), rotation("x", math.pi / 2), tip=shift(0.2, 0, 0))
    for convention in CONVENTIONS:
        table = make_dh_table(tree, "tip", convention=convention)
        np.testing.assert_array_equal(table.base, np.eye(4))
        assert table.rows[0].d == 0.3


def test_the_option_parallel_offset_selects_the_row_of_the_offset_of_parallel_axes() -> None:
    link = shift(0.4, 0, 0.1)
    tree = arm(np.eye(4), link, link, rotation("x", math.pi / 2))
    expected = {"last": [0, 0, 0.2, 0], "first": [0.2, 0, 0, 0], "each": [0.1, 0.1, 0, 0]}
    for rule, offsets in expected.items():
        assert [d for _, _, d, _ in cells(make_dh_table(tree, "tip", parallel_offset=rule))] == offsets


def test_an_offset_changes_sign_when_it_passes_an_antiparallel_axis() -> None:
    down = shift(0.4, 0, 0.1) @ rotation("x", math.pi)
    tree = arm(np.eye(4), down, shift(0.3, 0, 0.05), rotation("x", math.pi / 2))
    rows = cells(make_dh_table(tree, "tip"))
    assert rows[0] == (0.4, round(math.pi, 12), 0.0, 0.0)
    assert [row[2] for row in rows] == [0, 0, -0.05, 0]
    assert [row[2] for row in cells(make_dh_table(tree, "tip", parallel_offset="first"))] == [0.05, 0, 0, 0]


def test_collinear_axes_have_the_same_x_axis() -> None:
    tree = arm(np.eye(4), shift(0, 0, 0.2) @ rotation("z", 0.7), rotation("x", 1.0))
    assert cells(make_dh_table(tree, "tip"))[0] == (0.0, 0.0, 0.0, 0.0)


def test_x_is_reversed_if_theta_would_exceed_a_right_angle() -> None:
    back = arm(np.eye(4), shift(-0.4, 0, 0), rotation("x", 1.0))
    assert cells(make_dh_table(back, "tip"))[0] == (-0.4, 0.0, 0.0, 0.0)
    aside = arm(np.eye(4), shift(0, -0.4, 0), rotation("x", 1.0))
    assert cells(make_dh_table(aside, "tip"))[0] == (0.4, 0.0, 0.0, round(-math.pi / 2, 12))


def test_the_cell_a_is_positive_at_a_rounded_right_angle() -> None:
    for angle in (1.5707, 1.5708, -1.5708, 1.571):
        tree = arm(np.eye(4), rotation("z", angle) @ shift(0.4, 0, 0), rotation("x", 1.0))
        assert make_dh_table(tree, "tip").rows[0].a == pytest.approx(0.4)


def test_the_tool_is_the_identity_when_the_last_row_can_reach_the_tip() -> None:
    turned = shift(0.1, 0, 0.2) @ rotation("x", 0.3)
    tree = arm(rotation("x", 1.0), np.eye(4), tip=turned)
    table, flange = make_dh_table(tree, "tip"), make_dh_table(tree, "tip", last="flange")
    np.testing.assert_array_equal(table.tool, np.eye(4))
    assert cells(table)[-1] == (0.1, 0.3, 0.2, 0.0)
    np.testing.assert_allclose(flange.tool, turned, atol=4 * EPS)
    assert cells(flange)[-1] == (0.0, 0.0, 0.0, 0.0)


def test_if_the_last_row_cannot_reach_the_tip_the_tool_contains_the_rest() -> None:
    table = make_dh_table(arm(rotation("x", 1.0), np.eye(4), tip=shift(0.1, 0.2, 0.3)), "tip")
    assert cells(table)[-1] == (0.0, 0.0, 0.3, 0.0)
    np.testing.assert_allclose(table.tool, shift(0.1, 0.2, 0.0), atol=4 * EPS)


def test_the_axis_of_a_first_prismatic_joint_passes_through_the_origin_of_the_base() -> None:
    tree = arm(shift(0.5, 0.2, 0.3), shift(0.1, 0, 0), rotation("x", math.pi / 2), kinds="PRR")
    table = make_dh_table(tree, "tip")
    np.testing.assert_array_equal(table.base, np.eye(4))
    assert table.rows[0].a == pytest.approx(math.hypot(0.6, 0.2))


def test_the_axis_of_a_last_prismatic_joint_passes_through_the_tip_if_no_tool_remains() -> None:
    tree = arm(rotation("x", 1.0), rotation("x", 1.0) @ shift(0.1, 0, 0), kinds="RP", tip=shift(0, 0.2, 0.3))
    np.testing.assert_array_equal(make_dh_table(tree, "tip").tool, np.eye(4))
    demand_exact(make_dh_table(tree, "tip"), make_chain(tree, "tip"))


def test_a_flipped_joint_has_sense_minus_one_and_the_same_coordinate() -> None:
    tree = arm(np.eye(4), rotation("x", 1.0) @ shift(0.3, 0, 0), tip=shift(0.2, 0, 0))
    table = make_dh_table(tree, "tip", flip=["j2"])
    assert [row.sense for row in table.rows] == [1, -1]
    demand_exact(table, make_chain(tree, "tip"))


def test_a_path_without_joints_is_a_table_without_rows() -> None:
    for convention in CONVENTIONS:
        table = make_dh_table(arm(tip=shift(1, 2, 3)), "tip", convention=convention)
        assert table.rows == ()
        np.testing.assert_array_equal(table.placement([]), shift(1, 2, 3))


@pytest.mark.slow
@example(kinds="PPP")
@given(st.text("RP", min_size=1, max_size=5))
@settings(max_examples=40)
def test_tables_with_prismatic_joints_at_any_position_are_exact(kinds: str) -> None:
    turns = (rotation("xyz"[i % 3], math.pi / 2 * (i % 2)) for i in range(len(kinds)))
    steps = (shift(0.1 * i, 0.2, 0.05) @ turn for i, turn in enumerate(turns))
    tree = arm(*steps, kinds=kinds, tip=shift(0.1, 0.2, 0.3))
    for convention, strict in itertools.product(CONVENTIONS, ("hayati", "strict")):
        table = make_dh_table(tree, "tip", convention=convention, near_parallel=strict)
        demand_exact(table, make_chain(tree, "tip"))


# -- bad input -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"convention": "craig"}, r"found 'craig'; write convention = 'standard' or 'modified'"),
        ({"near_parallel": "drop"}, r"`near_parallel`: found 'drop'; write 'hayati' or 'strict'"),
        ({"last": "hand"}, r"`last`: found 'hand'; write 'tip' or 'flange'"),
        ({"parallel_offset": "none"}, r"write 'last' or 'first' or 'each'"),
        ({"snap": -1.0}, r"`snap` must be (an angle|a finite)"),
        ({"snap": math.nan}, r"snap must be a finite"),
        ({"snap": 1.0}, r"`snap` must be (an angle|a finite)"),
    ],
)
def test_an_unknown_option_value_lists_the_known_values(option: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_dh_table(arm(np.eye(4)), "tip", **option)  # type: ignore[arg-type]


def test_a_flip_of_a_joint_outside_the_path_lists_similar_joints() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown joint 'j3'.*did you mean j[12]"):
        make_dh_table(arm(np.eye(4), np.eye(4)), "tip", flip=["j3"])


# -- numbers that are written and read again -----------------------------------------------------------


@pytest.mark.parametrize("twelfths", range(-24, 25))
def test_a_multiple_of_fifteen_degrees_is_written_as_a_fraction_of_pi_and_read_exactly(twelfths: int) -> None:
    radians = twelfths * math.pi / 12.0
    text = Units().format_angle(radians)
    assert "pi" in text or text == "0"
    assert abs(parse_number(text, "x") - radians) <= 4e-16 * abs(radians)
    assert Units(AngleUnit.DEGREES).format_angle(radians) == str(15 * twelfths)


def test_a_rounded_right_angle_is_not_written_as_a_fraction_of_pi() -> None:
    assert pi_fraction(1.5707963) is None
    assert pi_fraction(1e308) is None
    assert Units().format_angle(1.5708) == "1.5708"
    assert Units(AngleUnit.DEGREES, digits=9).format_angle(1.5708) == "90.0002105"


@given(st.floats(-10, 10))
def test_every_written_number_is_read_exactly(value: float) -> None:
    assert parse_number(repr(value), "x") == value
    assert parse_number(value, "x") == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi", math.pi), ("-pi/2", -math.pi / 2), ("3*pi/4", 3 * math.pi / 4),
        (" 2 pi / 3 ", 2 * math.pi / 3), ("1e-3", 1e-3),
    ],
)  # fmt: skip
def test_multiples_of_pi_are_read(text: str, value: float) -> None:
    assert parse_number(text, "x") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("value", ["p", "pi/", "", "1,5", None, True, [1]])
def test_a_value_that_is_not_a_number_is_refused_with_row_and_cell(value: object) -> None:
    with pytest.raises(InputError, match=r"row 2, alpha: this is not a number"):
        parse_number(value, "row 2, alpha")


def test_units_are_selected_by_name() -> None:
    assert parse_units("degrees", "millimetres") == Units(AngleUnit.DEGREES, LengthUnit.MILLIMETRES)
    with pytest.raises(InputError, match="`radians` or `degrees`"):
        parse_units("grad")
    assert format_pi_fraction(pi_fraction(-math.pi / 12) or pytest.fail("no fraction")) == "-pi/12"


# -- Jacobian and acceleration of a table --------------------------------------------------------------


@pytest.mark.slow
@given(trees(min_joints=1), st.sampled_from(CONVENTIONS))
@settings(max_examples=40)
def test_placement_jacobian_and_acceleration_agree_with_pinocchio(tree: Any, convention: str) -> None:
    path, table, oracle = (
        make_chain(tree, "tip"),
        make_dh_table(tree, "tip", convention=convention),
        TreeOracle(tree),
    )
    columns = list(path.coupling.v_index(tree))
    q, v, a = (configurations(tree.nq, 3, seed) for seed in (0, 1, 2))
    q_own, v_own, a_own = (path.coupling.select(tree, array) for array in (q, v, a))
    rates = np.abs(path.coupling.matrix).sum(initial=1.0) * 3.0
    reach = table.span + rates + float(np.linalg.norm(table.base[:3, 3]))
    bound = 20 * EPS * (1 + len(table.rows)) * reach
    room = 5 * len(tree.joints) * EPS * (reach_of(path) + 1)
    expected_placement = oracle.placement(q, "tip", "l0")
    assert error_ratio(table, table.placement(q_own), expected_placement, q_own, room) <= 2.0
    J, vel = jacobian(table, q_own), velocity(table, q_own, v_own)
    acc = acceleration(table, q_own, v_own, a_own)
    for i in range(len(q)):
        expected = oracle.jacobian(q[i], "tip")
        assert np.abs(J[i] - expected[:, columns]).max(initial=0.0) <= bound * rates
        assert np.abs(acc[i] - oracle.acceleration(q[i], v[i], a[i], "tip")).max() <= bound * (1 + rates) ** 2
        np.testing.assert_allclose(vel[i], J[i] @ v_own[i], atol=bound * rates, rtol=0)


def test_velocities_of_a_table_refuse_batch_shapes_that_do_not_broadcast() -> None:
    table = make_dh_table(urdfkin.load("ur5", verify=False).tree, "tool0")
    with pytest.raises(InputError, match=r"the arguments do not broadcast: found \(3,\), \(2,\)"):
        velocity(table, np.zeros((3, 6)), np.zeros((2, 6)))


def test_batches_are_broadcast_and_numbers_of_values_are_checked() -> None:
    link = shift(0.3, 0.0, 0.1) @ rotation("x", 1.0)
    table = make_dh_table(arm(link, link, link), "tip")
    q = np.zeros((4, 1, 3))
    assert jacobian(table, q).shape == (4, 1, 6, 3)
    assert acceleration(table, q, np.ones((5, 3)), np.ones(3)).shape == (4, 5, 6)
    named = velocity(table, {"j1": 0.1, "j2": 0.0, "j3": 0.0}, "neutral, j2=90deg/s")
    np.testing.assert_array_equal(named, velocity(table, [0.1, 0.0, 0.0], [0.0, np.pi / 2, 0.0]))
    with pytest.raises(InputError, match="v needs 3 values"):
        velocity(table, q, np.ones(2))
    with pytest.raises(UnknownNameError, match="unknown reference"):
        jacobian(table, q, "sideways")


# -- the table of Khalil and Kleinfinger, with every link of a tree ------------------------------------


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
    table, q, oracle = make_tree_parameters(tree), configurations(tree.nq, 4), TreeOracle(tree)
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
    for row in make_tree_parameters(tree).rows:
        assert max(abs(row.b), abs(row.d), abs(row.r)) <= 10.0 * reach


@pytest.mark.slow
@given(branching())
@settings(max_examples=40)
def test_gamma_and_b_are_zero_on_the_first_moving_child(tree: KinematicTree) -> None:
    met = {-1}
    for row in make_tree_parameters(tree).rows:
        if row.sigma < 2 and row.antecedent not in met:
            met.add(row.antecedent)
            assert (row.gamma, row.b) == (0.0, 0.0)


def test_for_a_chain_the_table_equals_the_modified_table() -> None:
    bent, last = shift(0.05, 0, 0.1) @ rotation("x", math.pi / 2), rotation("x", -1.0) @ shift(0.02, 0, 0.3)
    tree = arm(shift(0, 0, 0.3), bent, shift(0.4, 0, 0.1), last)
    modified = make_dh_table(tree, "tip", convention="modified")
    rows = [row for row in make_tree_parameters(tree).rows if row.sigma < 2]
    for row, other in zip(rows, modified.rows, strict=True):
        assert (row.gamma, row.b) == (0.0, 0.0)
        mine = (row.d, row.alpha, row.r, row.theta, row.beta)
        assert np.abs(np.subtract(mine, other.cells)).max() <= 1e-14


def test_a_floating_joint_is_refused_with_a_remedy() -> None:
    with pytest.raises(InputError, match=r"joint root_joint: a floating joint .* without root_joint"):
        make_tree_parameters(with_root_joint(arm(np.eye(4)), JointKind.FLOATING))


@pytest.mark.parametrize("fill", ["masked", "complex", "text"])
def test_a_table_of_a_robot_refuses_values_that_are_not_real_numbers(fill: str) -> None:
    table = make_tree_parameters(arm(np.eye(4)))
    q = np.zeros(len(table.coordinates))
    wrong = {"masked": np.ma.array(q, mask=True), "complex": q + 1j, "text": q.astype(str)}[fill]
    with pytest.raises(InputError, match="q must be real numbers"):
        table.placements(wrong)


def test_the_written_table_contains_the_antecedents() -> None:
    tree = arm(shift(0, 0, 0.3), shift(0.05, 0, 0) @ rotation("x", math.pi / 2), kinds="RP")
    table = make_tree_parameters(tree)
    lines = tree_document(table, parse_units("degrees", "millimetres")).text().splitlines()
    assert lines[0] == "arm: Khalil-Kleinfinger parameters, l0 is frame 0"
    assert lines[6].split() == ["2", "j2", "1", "1", "0", "0", "90", "50", "0", "q(j2)"]
    assert tree_document(table, parse_units()).markdown().count("|") == 11 * 5
    sheet = list(csv.DictReader(as_csv(table).splitlines()))
    assert list(sheet[0])[:4] == ["joint", "link", "antecedent", "sigma"]
    for row, T in zip(sheet, table.T_frame_link, strict=True):
        assert [float(row[f"T{i}{j}"]) for i in (1, 2, 3) for j in (1, 2, 3, 4)] == T[:3].ravel().tolist()
    assert [row["antecedent"] for row in as_mapping(table)["rows"]] == [0, 1, 2]
