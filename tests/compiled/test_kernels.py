"""Kernels for batches, and the breakdown of an acceleration."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest

import urdfkin
from tests.odd_tree import odd_tree, pose, state
from urdfkin.compiled import evaluate
from urdfkin.compiled.breakdown import ACCELERATION_KINDS, acceleration_breakdown
from urdfkin.compiled.evaluate import accelerations, compute_in_threads
from urdfkin.compiled.plan import LANES, compile_tree
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import KinematicTree


@pytest.fixture(scope="module")
def panda() -> urdfkin.Robot:
    return urdfkin.load("panda", verify=False)


@pytest.mark.parametrize("n", [1, LANES - 1, LANES, LANES + 1, 5 * LANES + 3, 5000])
def test_results_are_equal_to_the_last_bit_for_any_number_of_threads(panda: urdfkin.Robot, n: int) -> None:
    q = panda.sample(n, seed=3)
    v, a = np.random.default_rng(3).standard_normal((2, n, panda.nv))
    for reference in urdfkin.Reference:
        one = panda.acceleration(q, v, a, "panda_hand", reference, threads=1)
        jacobian = panda.jacobian(q, "panda_hand", reference, threads=1)
        for threads in (2, 3, 64, None):
            many = panda.acceleration(q, v, a, "panda_hand", reference, threads=threads)
            np.testing.assert_array_equal(many, one)
            again = panda.jacobian(q, "panda_hand", reference, threads=threads)
            np.testing.assert_array_equal(again, jacobian)


@pytest.mark.parametrize("offset", range(8))
@pytest.mark.parametrize("n", [1, LANES, 3 * LANES + 5])
def test_streaming_stores_give_the_same_bits_at_any_address(
    panda: urdfkin.Robot, monkeypatch: pytest.MonkeyPatch, offset: int, n: int
) -> None:
    q = panda.sample(n, seed=7)
    v, a = np.random.default_rng(7).standard_normal((2, n, panda.nv))
    frames = ["panda_hand", "panda_link3"]
    jacobians, accelerations = panda.jacobian(q, frames), panda.acceleration(q, v, a, frames)
    monkeypatch.setattr(evaluate, "_MIN_BUFFERED_BYTES", 0)
    for threads in (1, 2):
        with _between(jacobians, offset) as out:
            panda.jacobian(q, frames, out=out, threads=threads)
        with _between(accelerations, offset) as out:
            panda.acceleration(q, v, a, frames, out=out, threads=threads)


@contextmanager
def _between(expected: FloatArray, offset: int) -> Iterator[FloatArray]:
    """Yield a part of an array; demand that it then equals `expected`, and that the rest is unchanged."""
    around = np.full(expected.size + 16, np.pi)
    out = around[offset : offset + expected.size].reshape(expected.shape)
    yield out
    np.testing.assert_array_equal(out, expected)
    assert (around[:offset] == np.pi).all()
    assert (around[offset + expected.size :] == np.pi).all()


def test_an_error_in_the_rows_of_any_thread_is_reported() -> None:
    def compute(inputs: Sequence[FloatArray], out: FloatArray) -> int:
        out[:] = inputs[1][:, :1]
        return int(inputs[1][:, 0].max())

    base, out = np.zeros((1, 24)), np.empty((5 * LANES, 1))
    for bad in (None, 0, 2 * LANES, 5 * LANES - 1):
        q = np.zeros((5 * LANES, 3))
        if bad is not None:
            q[bad] = 1.0
        for threads in (1, 2):
            assert compute_in_threads(compute, [base, q], out, threads) == int(bad is not None)
            np.testing.assert_array_equal(out[:, 0], q[:, 0])


# -- breakdown of an acceleration ------------------------------------------------------------------


ROOM = 64 * np.finfo(np.float64).eps * 30.0


@pytest.fixture(scope="module")
def odd() -> KinematicTree:
    return odd_tree()


@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("link", ["base", "body", "wrist", "tyre"])
def test_the_parts_sum_to_the_acceleration_of_the_recursion(
    odd: KinematicTree, link: str, reference: Reference
) -> None:
    at = odd.link_index(link)
    q, v, a = state(odd, 21, 1)
    generator = np.random.default_rng(2)
    base = BaseMotion(pose(generator), generator.normal(size=6), generator.normal(size=6)).state(())
    parts = acceleration_breakdown(odd, at, q, v, a, reference, base)
    whole = accelerations(compile_tree(odd, [at]), q, v, a, reference, base=base)[:, 0]
    assert np.abs(parts.total - whole).max() <= ROOM
    assert np.abs(parts.base + parts.by_kind.sum(axis=-2) - whole).max() <= ROOM


def test_a_joint_without_velocity_and_acceleration_contributes_nothing(odd: KinematicTree) -> None:
    q, v, a = state(odd, 3, 3)
    slide = odd.v_index[odd.joint_index("slide")]
    v[:, slide] = a[:, slide] = 0.0
    parts = acceleration_breakdown(odd, odd.link_index("wrist"), q, v, a)
    assert parts.joints == ("free", "arm", "slide", "follower")
    assert not parts.by_joint[:, 2].any()
    assert parts.by_joint[:, 1].all()
    # The wrist turns about its own origin, so the origin does not move.
    assert not parts.by_joint[:, 3, :3].any()
    assert parts.by_joint[:, 3, 3:].all()


def test_scaling_velocity_and_acceleration_scales_each_kind_of_term_by_the_formula(
    odd: KinematicTree,
) -> None:
    q, v, a = state(odd, 3, 4)
    wrist, slide = odd.link_index("wrist"), odd.v_index[odd.joint_index("slide")]
    once = acceleration_breakdown(odd, wrist, q, v, a).terms[:, 2]
    v[:, slide] *= 2.0
    a[:, slide] *= 3.0
    now = acceleration_breakdown(odd, wrist, q, v, a).terms[:, 2]
    for kind, factor in (("coriolis", 2.0), ("sliding", 3.0)):
        at = ACCELERATION_KINDS.index(kind)
        assert np.abs(now[:, at] - factor * once[:, at]).max() <= ROOM
        assert once[:, at, :3].all()
    for kind in ("transverse", "centripetal"):
        assert not now[:, ACCELERATION_KINDS.index(kind)].any()


def test_the_breakdown_of_an_empty_batch_is_empty(odd: KinematicTree) -> None:
    q, v, a = state(odd, 1, 5)
    assert acceleration_breakdown(odd, 5, q[:0], v[:0], a[:0]).total.shape == (0, 6)


# -- rate of the Jacobian --------------------------------------------------------------------------
