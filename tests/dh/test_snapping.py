"""In no configuration does a snapped table move the tip further than the stated bound."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.dh.arms import CONVENTIONS, EPS, arm
from tests.random_chains import configurations, rotation, shift, trees, z_joint
from tests.reading import present
from urdfkin.dh import DHTable, make_dh_table
from urdfkin.dh.export import export
from urdfkin.dh.export.text import measure_printed_table
from urdfkin.dh.snapping import _make_change, _snap_pose, rotation_angle, row_of_constant
from urdfkin.dh.table import SnapChange, SnapReport
from urdfkin.dh.units import Units
from urdfkin.model.chain import make_chain
from urdfkin.model.configuration import ASSUMED_LIMIT
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Limit, Mimic, build_tree


def nearly_round(seed: int, noise: float, joints: int = 5, slides: bool = True) -> KinematicTree:
    """Return joints with parallel or perpendicular axes, each rotation with an error of up to `noise`."""
    rng = np.random.default_rng(seed)
    steps = []
    for _ in range(joints):
        turn = rotation("xyz"[rng.integers(3)], rng.integers(-3, 4) * math.pi / rng.choice([2, 4, 6]))
        off = rotation("x", rng.uniform(-noise, noise)) @ rotation("y", rng.uniform(-noise, noise))
        step = shift(*rng.choice([0.0, 0.1, 0.25, -0.3], 3)) @ turn @ off
        steps.append(step @ rotation("z", rng.uniform(-noise, noise)))
    kinds = "".join(rng.choice(list("RRP" if slides else "R"), joints))
    return arm(*steps, kinds=kinds, tip=shift(0.1, 0, 0.2) @ rotation("x", rng.uniform(-noise, noise)))


def worst(table: DHTable, tree: KinematicTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest position error and orientation error of the tip."""
    exact, found = make_chain(tree, "tip").placement(q), table.placement(q)
    metres = np.linalg.norm(found[..., :3, 3] - exact[..., :3, 3], axis=-1)
    return metres, rotation_angle(found[..., :3, :3], exact[..., :3, :3])


@pytest.mark.slow
@given(st.integers(0, 10_000), st.sampled_from([1e-9, 3.7e-6, 1e-4, 2e-3]), st.sampled_from(CONVENTIONS))
@settings(max_examples=50)
def test_no_configuration_moves_the_tip_by_more_than_declared(seed: int, noise: Any, convention: Any) -> None:
    tree = nearly_round(seed, noise)
    table = make_dh_table(tree, "tip", convention=convention, snap=3 * noise)
    assert table.snap is not None
    q = configurations(tree.nq, 40, seed) * 2.0  # also configurations far beyond the limits
    metres, radians = worst(table, tree, q)
    allowed_metres, allowed_radians = table.tolerance(q)
    assert (metres <= allowed_metres + 100 * EPS).all()
    assert (radians <= allowed_radians).all()


@pytest.mark.slow
@given(trees(min_joints=1), st.sampled_from([1e-6, 1e-3, 0.05]))
@settings(max_examples=50)
def test_snapping_a_random_chain_moves_the_tip_within_the_declared_bound(
    tree: KinematicTree, tolerance: float
) -> None:
    table = make_dh_table(tree, "tip", snap=tolerance)
    q = configurations(tree.nq, 20)
    own = make_chain(tree, "tip").coupling.select(tree, q)
    metres, radians = worst(table, tree, own)
    allowed_metres, allowed_radians = table.tolerance(own)
    # Offsets that cancel are in no cell, but their sum has rounding errors.
    rounding = 20 * EPS * (1 + len(tree.joints)) * make_chain(tree, "tip").lengths.sum()
    assert (metres <= allowed_metres + rounding).all()
    assert (radians <= allowed_radians).all()


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=40)
def test_the_declared_bound_is_at_most_thirty_times_the_measured_error(seed: int) -> None:
    tree = nearly_round(seed, 1e-4, slides=False)
    snap = present(make_dh_table(tree, "tip", snap=3e-4).snap)
    assume(snap.metres > 1e-6)
    assert snap.measured_metres <= snap.metres
    assert snap.metres <= 30.0 * snap.measured_metres


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=30)
def test_angles_close_to_multiples_of_fifteen_degrees_are_snapped(seed: int) -> None:
    table = make_dh_table(nearly_round(seed, 1e-6), "tip", snap=1e-4)
    for row in table.rows:
        for angle in (row.alpha, row.theta):
            # Between skew axes at round angles, theta can have any value; cells near a round value are exact.
            twelfth = round(angle * 12 / math.pi) * math.pi / 12
            assert angle == twelfth or abs(angle - twelfth) > 1e-4
        assert row.beta == 0.0


@pytest.mark.parametrize("tilt", [0.0, 2e-3])
def test_snapping_changes_no_exact_right_angle_and_no_angle_beyond_the_tolerance(tilt: float) -> None:
    table = make_dh_table(
        arm(np.eye(4), shift(0.3, 0, 0) @ rotation("x", math.pi / 2 + tilt)), "tip", snap=1e-3
    )
    snap = present(table.snap)
    assert table.rows[0].alpha == pytest.approx(math.pi / 2 + tilt)
    assert (snap.changes, snap.metres, snap.radians) == ((), 0.0, 0.0)


# -- the bound: each angle times the distance from its pivot to the tip ---------------------------------


OFF = 1e-5


def test_the_tip_movement_of_a_change_is_the_angle_times_the_lever() -> None:
    assert SnapChange(0, "origin of a", 1e-3, 4.0).tip_displacement == 4e-3
    assert SnapChange(0, "origin of a", 1e-3, 0.0).tip_displacement == 0.0


def test_the_lever_of_a_snapped_angle_is_the_length_of_the_remaining_chain() -> None:
    for (first, last), lever in [((OFF, 0.0), 3.0 + 0.5), ((0.0, OFF), 0.5)]:
        bent = (rotation("x", math.pi / 2 + tilt) for tilt in (first, last))
        steps = (way @ turn for way, turn in zip((shift(0, 0, 1.0), shift(3.0, 0, 0)), bent, strict=True))
        tree = arm(np.eye(4), *steps, tip=shift(0, 0.5, 0))
        snap = present(make_dh_table(tree, "tip", snap=10 * OFF).snap)
        assert snap.radians == pytest.approx(OFF, rel=1e-9)
        assert snap.metres == pytest.approx(OFF * lever, rel=1e-9)
        assert 0.0 < snap.measured_metres <= snap.metres


@pytest.mark.parametrize("beyond", [0.0, 3.0])
def test_the_lever_of_two_combined_fixed_angles_begins_at_the_next_joint(beyond: float) -> None:
    """Neither angle is nearly round, but their sum is."""
    bolt, turned = rotation("x", 0.3), rotation("x", math.pi / 2 - 0.3 + OFF)
    tree = arm(np.eye(4), bolt, turned, shift(beyond, 0, 0), kinds="RFRR", tip=shift(0, 0.5, 0))
    snap = present(make_dh_table(tree, "tip", snap=10 * OFF).snap)
    assert [change.lever for change in snap.changes] == [pytest.approx(beyond + 0.5)]
    assert snap.metres == pytest.approx(OFF * (beyond + 0.5), rel=1e-9)
    assert 0.0 < snap.measured_metres <= snap.metres


def sliding(limit: Limit | None, tilt: float = OFF) -> KinematicTree:
    """Return a tilt, a revolute joint, a prismatic joint, and 2 m to the tip."""
    joints = [
        (z_joint("a", rotation("x", math.pi / 2 + tilt)), "l0", "l1"),
        (z_joint("b", rotation("y", math.pi / 2), JointKind.PRISMATIC, limit=limit), "l1", "l2"),
        (z_joint("end", shift(0, 0, 2.0), JointKind.FIXED), "l2", "tip"),
    ]
    return build_tree("sliding", "l0", joints)


@pytest.mark.parametrize(
    ("limit", "travel"),
    [
        (None, ASSUMED_LIMIT),
        (Limit(-math.inf, 3.0, 1.0, 1.0), ASSUMED_LIMIT),
        (Limit(-0.5, 3.0, 1.0, 1.0), 3.0),
        (Limit(-4.0, 3.0, 1.0, 1.0), 4.0),
    ],
)
def test_the_travel_of_a_prismatic_joint_lengthens_the_lever(limit: Limit | None, travel: float) -> None:
    snap = present(make_dh_table(sliding(limit), "tip", snap=10 * OFF).snap)
    assert snap.per_metre == {"b": pytest.approx(OFF, rel=1e-9)}
    assert snap.metres == pytest.approx(OFF * (2.0 + travel), rel=1e-9)
    assert 0.0 < snap.measured_metres <= snap.metres
    assert snap.bound({"b": np.array([0.0, -5.0])}) == pytest.approx([2.0 * OFF, 7.0 * OFF], rel=1e-9)


@pytest.mark.parametrize("form", ["terminal", "markdown", "latex", "sympy", "json", "toml"])
def test_each_format_with_the_bound_states_the_assumed_travel_of_a_joint_without_limits(form: str) -> None:
    endless, limited = (
        export(make_dh_table(sliding(limit), "tip", snap=10 * OFF), form)
        for limit in (None, Limit(-1.0, 1.0, 1.0, 1.0))
    )
    condition = f"joints without limits travel at most {ASSUMED_LIMIT:g} m"
    assert condition in " ".join(endless.split())
    assert condition not in " ".join(limited.split())
    within = "prismatic joints are within their limits"
    assert within in " ".join(endless.replace("#", "").split())
    assert within in " ".join(limited.replace("#", "").split())


def test_the_error_of_printed_digits_states_the_limits_and_the_assumed_travel_of_prismatic_joints() -> None:
    endless, limited = (
        measure_printed_table(make_dh_table(sliding(limit, 0.1), "tip"), Units(digits=3))
        for limit in (None, Limit(-1.0, 1.0, 1.0, 1.0))
    )
    within = "this holds if prismatic joints are within their limits"
    travel = f" and joints without limits travel at most {ASSUMED_LIMIT:g} m"
    assert str(endless).endswith(within + travel)
    assert str(limited).endswith(within)
    assert limited.metres < endless.metres <= present(endless.bound)


@pytest.mark.parametrize("base", ["base", "a"])
def test_the_bound_of_printed_digits_covers_a_small_multiplier_of_a_mimic_rule(base: str) -> None:
    # The printed multiplier has 10 digits. Its error is multiplied by the value of the mimicked joint.
    rule, ahead = Mimic("big", 1.0 / 29.0, 0.0), shift(1.0, 0.0, 0.0)
    joints = [
        (z_joint("big", limit=Limit(-3.0, 3.0, 1.0, 1.0)), "base", "a"),
        (z_joint("small", ahead, limit=Limit(-0.11, 0.11, 1.0, 1.0), mimic=rule), "a", "b"),
        (z_joint("end", ahead, JointKind.FIXED), "b", "tip"),
    ]
    found = measure_printed_table(
        make_dh_table(build_tree("arm", "base", joints), "tip", base), Units(digits=15)
    )
    assert 0.0 < found.metres <= present(found.bound)


def test_the_bounds_cover_a_mimic_joint_that_leaves_its_own_limits() -> None:
    # Joint "far" moves between 1 m and 7 m, although its limits allow only 0.1 m.
    tilted, narrow = rotation("x", math.pi / 4 + OFF), Limit(-0.1, 0.1, 1.0, 1.0)
    joints = [
        (z_joint("near", tilted, JointKind.PRISMATIC, limit=Limit(0.0, 3.0, 1.0, 1.0)), "l0", "l1"),
        (
            z_joint("far", tilted, JointKind.PRISMATIC, limit=narrow, mimic=Mimic("near", 2.0, 1.0)),
            "l1",
            "tip",
        ),
    ]
    tree = build_tree("arm", "l0", joints)
    snap = present(make_dh_table(tree, "tip", snap=10 * OFF).snap)
    assert 0.0 < snap.measured_metres <= snap.metres
    printed = measure_printed_table(make_dh_table(tree, "tip"), Units(digits=3))
    assert 0.0 < printed.metres <= present(printed.bound)


def test_a_snap_report_sums_the_bounds_of_all_changes() -> None:
    changes = (SnapChange(1, "x", 1e-3, 2.0, ("s",)), SnapChange(-1, "y", 2e-3, 5.0))
    said = SnapReport(1e-2, changes, 0.0, 0.0, {"s": 1e-3})
    assert said.rows == (-1, 1)
    assert said.bound({"s": np.array([0.0, -10.0])}) == pytest.approx([0.012, 0.022])


def test_the_bounds_per_metre_of_a_prismatic_joint_are_summed_over_changes() -> None:
    slide = shift(1.0, 0, 0) @ rotation("x", math.pi / 2 + 2 * OFF)
    tree = arm(rotation("x", math.pi / 2 + OFF), slide, kinds="RP")
    snap = present(make_dh_table(tree, "tip", snap=10 * OFF).snap)
    assert snap.per_metre == {"j2": pytest.approx(3 * OFF, rel=1e-9)}


@pytest.mark.parametrize("psi", [-2.5, -0.4, 0.3, 1.1, 3.0])
@pytest.mark.parametrize("tilt", [0.0, OFF, math.pi - OFF, math.pi, 1.0])
def test_a_snapped_pose_rotates_by_at_most_the_reported_angle(tilt: float, psi: float) -> None:
    A = shift(1, 2, 3) @ rotation("z", 0.7) @ rotation("x", tilt) @ rotation("z", psi)
    pose, angle = _snap_pose(A, 10 * OFF)
    assert angle <= 2 * OFF
    assert rotation_angle(pose[:3, :3], A[:3, :3]) <= max(angle, 1e-12)
    assert (pose[:3, 3] == [1, 2, 3]).all()


@pytest.mark.parametrize(("convention", "row"), [("standard", 0), ("modified", 1)])
def test_the_row_of_a_constant_depends_on_the_convention(convention: str, row: int) -> None:
    tree = arm(np.eye(4), shift(0.3, 0, 0) @ rotation("x", 1.0), tip=shift(0.1, 0.2, 0) @ rotation("y", 0.3))
    table = make_dh_table(tree, "tip", convention=convention)
    assert [row_of_constant(table, k) for k in range(3)] == [-1, row, 2]
    plain = replace(table, tool=np.eye(4))
    assert [row_of_constant(plain, k) for k in range(3)] == [-1, row, 1]


@pytest.mark.parametrize(
    ("pivot", "prismatic_joints"), [(0, "j1 j3"), (1, "j1 j3"), (2, "j3"), (3, "j3"), (4, "")]
)
def test_prismatic_joints_behind_the_pivot_lengthen_the_lever(pivot: int, prismatic_joints: str) -> None:
    path = make_chain(arm(np.eye(4), shift(1, 0, 0), shift(0, 2, 0), kinds="PRP", tip=shift(0, 0, 4)), "tip")
    found = _make_change(path, pivot, "something", OFF)
    assert found.prismatic_joints == tuple(prismatic_joints.split())
    assert found.lever == pytest.approx({0: 7.0, 1: 7.0, 2: 6.0, 3: 4.0, 4: 0.0}[pivot])
