"""Followers' columns are added to their leaders' as J_full G says, whatever the numbers are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scripts.check_bits import WAYS
from urdfkin.compiled.preload import only
from urdfkin.verify.oracle import coupled


@given(st.data())
def test_it_is_the_product_with_g_to_the_last_bit(data: st.DataObject) -> None:
    nv, full = data.draw(st.integers(1, 5)), data.draw(st.integers(1, 8))
    index = np.array(
        data.draw(st.lists(st.integers(0, nv - 1), min_size=full, max_size=full)), dtype=np.int64
    )
    factor = np.array(data.draw(st.lists(st.floats(-2.0, 2.0), min_size=full, max_size=full)))
    columns = np.array(data.draw(st.permutations(range(full)))[: data.draw(st.integers(0, full))], np.int64)
    shape = data.draw(st.sampled_from([(), (1,), (3, 6), (2, 0, 6), (2, 3, 6)]))
    numbers = st.floats() | st.just(np.inf) | st.just(np.nan)
    pool = data.draw(st.lists(numbers, min_size=1, max_size=30))
    J = np.resize(np.array(pool), (*shape, full))
    expected = np.zeros((*shape, nv))
    with np.errstate(all="ignore"):
        for column in columns:
            expected[..., index[column]] += J[..., column] * factor[column]
    for way in WAYS:
        with only(way):
            np.testing.assert_array_equal(coupled(J, columns, index, factor, nv), expected)


def test_it_takes_views_and_leaves_them_as_they_are() -> None:
    J = np.arange(24.0).reshape(2, 3, 4).swapaxes(0, 1)
    J.setflags(write=False)
    places = np.array([0, 2], dtype=np.int64)
    found = coupled(J, places, np.array([0, 0, 1, 1]), np.array([1.0, 1.0, -2.0, 1.0]), 2)
    np.testing.assert_array_equal(found, J[..., [0, 2]] * [1.0, -2.0])


@pytest.mark.parametrize("rows", [0, 1])
def test_a_robot_without_rates_has_no_columns(rows: int) -> None:
    nothing = np.zeros(0, dtype=np.int64)
    assert coupled(np.zeros((rows, 6, 0)), nothing, nothing, np.zeros(0), 0).shape == (rows, 6, 0)
