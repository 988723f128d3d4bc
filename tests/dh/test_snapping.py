"""What a snapped table declares is a guarantee: no configuration moves the tip further."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.dh.arms import arm
from tests.random_chains import configurations, rotation, shift, trees
from urdfkin.dh import DHTable, dh_table
from urdfkin.dh.snapping import rotation_angle
from urdfkin.model.chain import chain
from urdfkin.model.tree import FloatArray, KinematicTree

EPS = float(np.finfo(np.float64).eps)


def nearly_round(seed: int, noise: float, joints: int = 5, slides: bool = True) -> KinematicTree:
    """Joints at right angles and parallel, each rotation off by up to `noise`, as a rounded file is."""
    rng = np.random.default_rng(seed)
    steps = []
    for _ in range(joints):
        turn = rotation("xyz"[rng.integers(3)], rng.integers(-3, 4) * math.pi / rng.choice([2, 4, 6]))
        off = rotation("x", rng.uniform(-noise, noise)) @ rotation("y", rng.uniform(-noise, noise))
        steps.append(
            shift(*rng.choice([0.0, 0.1, 0.25, -0.3], 3))
            @ turn
            @ off
            @ rotation("z", rng.uniform(-noise, noise))
        )
    kinds = "".join(rng.choice(list("RRP" if slides else "R"), joints))
    return arm(*steps, kinds=kinds, tip=shift(0.1, 0, 0.2) @ rotation("x", rng.uniform(-noise, noise)))


def worst(table: DHTable, tree: KinematicTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    exact = chain(tree, "tip").placement(q)
    found = table.placement(q)
    return (
        np.linalg.norm(found[..., :3, 3] - exact[..., :3, 3], axis=-1),
        rotation_angle(found[..., :3, :3], exact[..., :3, :3]),
    )


@pytest.mark.slow
@given(
    st.integers(0, 10_000),
    st.sampled_from([1e-9, 3.7e-6, 1e-4, 2e-3]),
    st.sampled_from(["standard", "modified"]),
)
@settings(max_examples=50)
def test_no_configuration_moves_the_tip_by_more_than_declared(
    seed: int, noise: float, convention: str
) -> None:
    tree = nearly_round(seed, noise)
    table = dh_table(tree, "tip", convention=convention, snap=3 * noise)
    assert table.snap is not None
    q = configurations(tree.nq, 40, seed) * 2.0  # far beyond the limits too
    metres, radians = worst(table, tree, q)
    allowed_metres, allowed_radians = table.tolerance(q)
    assert (metres <= allowed_metres + 100 * EPS).all()
    assert (radians <= allowed_radians).all()


@pytest.mark.slow
@given(trees(min_joints=1), st.sampled_from([1e-6, 1e-3, 0.05]))
@settings(max_examples=50)
def test_snapping_any_chain_keeps_its_word(tree: KinematicTree, tolerance: float) -> None:
    table = dh_table(tree, "tip", snap=tolerance)
    q = configurations(tree.nq, 20)
    own = chain(tree, "tip").coupling.select(tree, q)
    metres, radians = worst(table, tree, own)
    allowed_metres, allowed_radians = table.tolerance(own)
    # Offsets of the URDF that cancel are in no cell, but were added up and rounded on the way.
    rounding = 20 * EPS * (1 + len(tree.joints)) * chain(tree, "tip").lengths.sum()
    assert (metres <= allowed_metres + rounding).all()
    assert (radians <= allowed_radians).all()


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=40)
def test_the_declared_bound_is_not_idle(seed: int) -> None:
    tree = nearly_round(seed, 1e-4, slides=False)
    snap = dh_table(tree, "tip", snap=3e-4).snap
    assert snap is not None
    assume(snap.metres > 1e-6)
    assert snap.measured_metres <= snap.metres
    assert snap.metres <= 30.0 * snap.measured_metres


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=30)
def test_angles_that_are_nearly_round_become_round(seed: int) -> None:
    table = dh_table(nearly_round(seed, 1e-6), "tip", snap=1e-4)
    for row in table.rows:
        for angle in (row.alpha, row.theta):
            # Two skew lines at round angles may still make a theta of any value; what is near is exact.
            twelfth = round(angle * 12 / math.pi) * math.pi / 12
            assert angle == twelfth or abs(angle - twelfth) > 1e-4
        assert row.beta == 0.0


def test_a_bound_with_a_sliding_joint_grows_with_its_travel() -> None:
    tilted = rotation("x", math.pi / 2 + 1e-5) @ shift(0.3, 0, 0)
    tree = arm(tilted, shift(0.1, 0, 0.2), kinds="RP", tip=shift(0, 0, 0.1))
    snap = dh_table(tree, "tip", snap=1e-4).snap
    assert snap is not None
    assert set(snap.per_metre) == {"j2"}
    assert snap.per_metre["j2"] == pytest.approx(1e-5, rel=1e-3)
    near, far = snap.bound({"j2": np.array([0.0, 5.0])})
    assert far - near == pytest.approx(5.0 * snap.per_metre["j2"])


def test_an_exact_right_angle_is_nothing_to_snap() -> None:
    table = dh_table(arm(np.eye(4), rotation("x", math.pi / 2) @ shift(0.3, 0, 0)), "tip", snap=1e-3)
    assert table.snap is not None
    assert table.snap.changes == ()
    assert (table.snap.metres, table.snap.radians) == (0.0, 0.0)


def test_snapping_touches_no_angle_beyond_its_tolerance() -> None:
    table = dh_table(arm(np.eye(4), shift(0.3, 0, 0) @ rotation("x", math.pi / 2 + 2e-3)), "tip", snap=1e-3)
    assert table.rows[0].alpha == pytest.approx(math.pi / 2 + 2e-3)
    assert table.snap is not None
    assert table.snap.changes == ()
