"""A batch gives the same numbers however it is cut."""

import numpy as np
import pytest

import urdfkin
from urdfkin.errors import InputError
from urdfkin.recursion.lanes import LANES


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


def test_less_than_one_thread_is_refused(panda: urdfkin.Robot) -> None:
    with pytest.raises(InputError, match="threads"):
        panda.placement(panda.neutral(), "panda_hand", threads=0)
