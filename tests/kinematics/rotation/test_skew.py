"""The skew matrix is the cross product, and gives its vector back."""

import numpy as np
import pytest
from hypothesis import given

from tests.kinematics.rotation.strategies import ROUNDING, vectors3
from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import skew, unskew


@pytest.mark.slow
@given(vectors3, vectors3)
def test_the_skew_matrix_times_a_vector_is_the_cross_product(w: FloatArray, p: FloatArray) -> None:
    assert np.abs(skew(w) @ p - np.cross(w, p)).max() <= ROUNDING


@given(vectors3)
def test_unskew_undoes_skew_exactly(w: FloatArray) -> None:
    assert np.array_equal(unskew(skew(w)), w)


def test_any_leading_shape_is_kept_empty_ones_too() -> None:
    assert skew(np.ones((4, 0, 3))).shape == (4, 0, 3, 3)
    assert unskew(np.zeros((4, 0, 3, 3))).shape == (4, 0, 3)
    w = np.arange(12.0).reshape(2, 2, 3)
    assert np.array_equal(skew(w)[1, 0], skew(w[1, 0]))


def test_a_matrix_that_is_not_skew_is_refused_with_its_symmetric_part() -> None:
    with pytest.raises(InputError, match=r"skew-symmetric.*symmetric part of 1"):
        unskew(np.eye(3))


@pytest.mark.parametrize("bad", [[1.0, 2.0], 3.0, [1.0, 2.0, np.nan], "abc", [np.inf, 0, 0]])
def test_what_is_no_finite_vector_is_refused(bad: object) -> None:
    with pytest.raises(InputError, match="w must"):
        skew(bad)  # type: ignore[arg-type]
