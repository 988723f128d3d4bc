"""A batch gives the same numbers however it is cut."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest

import urdfkin
from urdfkin.compiled import evaluate
from urdfkin.compiled.evaluate import in_blocks
from urdfkin.compiled.plan import LANES
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray


@pytest.fixture(scope="module")
def panda() -> urdfkin.Robot:
    return urdfkin.load("panda", verify=False)


@pytest.mark.parametrize("n", [1, LANES - 1, LANES, LANES + 1, 5 * LANES + 3])
def test_results_are_equal_to_the_last_bit_for_any_number_of_threads(panda: urdfkin.Robot, n: int) -> None:
    q = panda.sample(n, seed=3)
    v, a = np.random.default_rng(3).standard_normal((2, n, panda.nv))
    for reference in urdfkin.Reference:
        one = panda.acceleration(q, v, a, "panda_hand", reference, threads=1)
        jacobian = panda.jacobian(q, "panda_hand", reference, threads=1)
        for threads in (2, 3, 64):
            many = panda.acceleration(q, v, a, "panda_hand", reference, threads=threads)
            np.testing.assert_array_equal(many, one)
            again = panda.jacobian(q, "panda_hand", reference, threads=threads)
            np.testing.assert_array_equal(again, jacobian)


def test_a_batch_large_enough_for_threads_by_itself_is_the_same(panda: urdfkin.Robot) -> None:
    q = panda.sample(5000, seed=5)
    alone = panda.placement(q, "panda_hand", threads=1)
    np.testing.assert_array_equal(panda.placement(q, "panda_hand"), alone)


@pytest.mark.parametrize("offset", range(8))
@pytest.mark.parametrize("n", [1, LANES, 3 * LANES + 5])
def test_what_is_written_past_the_caches_is_the_same_wherever_it_begins(
    panda: urdfkin.Robot, monkeypatch: pytest.MonkeyPatch, offset: int, n: int
) -> None:
    q = panda.sample(n, seed=7)
    v, a = np.random.default_rng(7).standard_normal((2, n, panda.nv))
    frames = ["panda_hand", "panda_link3"]
    jacobians, accelerations = panda.jacobian(q, frames), panda.acceleration(q, v, a, frames)
    monkeypatch.setattr(evaluate, "_STREAMED", 0)
    for threads in (1, 2):
        with _between(jacobians, offset) as out:
            panda.jacobian(q, frames, out=out, threads=threads)
        with _between(accelerations, offset) as out:
            panda.acceleration(q, v, a, frames, out=out, threads=threads)


@contextmanager
def _between(expected: FloatArray, offset: int) -> Iterator[FloatArray]:
    """Memory to be filled with what is expected; what lies before and behind it must stay."""
    around = np.full(expected.size + 16, np.pi)
    out = around[offset : offset + expected.size].reshape(expected.shape)
    yield out
    np.testing.assert_array_equal(out, expected)
    assert (around[:offset] == np.pi).all()
    assert (around[offset + expected.size :] == np.pi).all()


def test_less_than_one_thread_is_refused(panda: urdfkin.Robot) -> None:
    with pytest.raises(InputError, match="threads"):
        panda.placement(panda.neutral(), "panda_hand", threads=0)


def test_what_was_bad_in_any_part_is_told() -> None:
    def compute(inputs: Sequence[FloatArray], out: FloatArray) -> int:
        out[:] = inputs[1][:, :1]
        return int(inputs[1][:, 0].max())

    base, out = np.zeros((1, 24)), np.empty((5 * LANES, 1))
    for bad in (None, 0, 2 * LANES, 5 * LANES - 1):
        q = np.zeros((5 * LANES, 3))
        if bad is not None:
            q[bad] = 1.0
        for threads in (1, 2):
            assert in_blocks(compute, [base, q], out, threads) == int(bad is not None)
            np.testing.assert_array_equal(out[:, 0], q[:, 0])


def test_a_single_configuration_gives_the_same_bits_whatever_lies_beside_it(panda: urdfkin.Robot) -> None:
    q = panda.sample(1, seed=6)
    expected = panda.placement(q[0], "panda_hand")
    for neighbour in (np.nan, 1e300, -7.0):
        memory = np.full((3, panda.nq), neighbour)
        memory[0] = q[0]
        np.testing.assert_array_equal(panda.placement(memory[:1], "panda_hand"), expected[None])
