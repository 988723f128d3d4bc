"""Euler rates against derivatives at 60 digits, and their singularity, said and measured."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.high_precision import angular_velocity, array, mp, turn
from tests.kinematics.rotation.strategies import ROUNDING, angles
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    SEQUENCES,
    angular_velocity_from_euler_rates,
    euler_condition,
    euler_rate_inverse,
    euler_rate_matrix,
    euler_rates,
    singularity_distance,
)

ANGLES, RATES = np.array([0.4, 1.3, -2.1]), np.array([0.7, -1.1, 2.3])


def moving(name: str) -> Callable[[Any], Any]:
    """R(t) of the sequence, angles ANGLES + t RATES, written out as a product of three turns."""
    letters, order = name.lower(), slice(None) if name.isupper() else slice(None, None, -1)

    def R(t: Any) -> Any:
        turns = [
            turn(axis, mp.mpf(a) + t * mp.mpf(r)) for axis, a, r in zip(letters, ANGLES, RATES, strict=True)
        ]
        first, second, third = turns[order]
        return first * second * third

    return R


@pytest.mark.parametrize("name", SEQUENCES)
def test_euler_rates_give_the_angular_velocity_and_back(name: str) -> None:
    w = array(angular_velocity(moving(name), 0.0))
    assert np.abs(angular_velocity_from_euler_rates(name, ANGLES, RATES) - w).max() <= 2 * ROUNDING
    assert np.abs(euler_rates(name, ANGLES, w) - RATES).max() <= 16 * ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(st.tuples(angles, st.floats(0.2, 1.3), angles))
def test_the_closed_inverse_is_the_inverse(name: str, turns: tuple[float, float, float]) -> None:
    product = euler_rate_inverse(name, turns) @ euler_rate_matrix(name, turns)
    assert np.abs(product - np.eye(3)).max() <= 16 * ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(st.floats(-4.0, 4.0))
def test_the_condition_number_is_that_of_the_matrix(name: str, middle: float) -> None:
    turns = [0.3, middle, -0.8]
    if float(singularity_distance(name, turns)) > 1e-3:
        expected = float(np.linalg.cond(euler_rate_matrix(name, turns)))
        assert abs(float(euler_condition(name, turns)) / expected - 1.0) <= 1e-9


@pytest.mark.parametrize(
    ("name", "middle"), [("ZYZ", 0.0), ("ZYZ", np.pi), ("xyz", np.pi / 2), ("XYZ", -np.pi / 2)]
)
def test_at_the_singularity_the_rates_are_refused_with_the_distance_and_never_infinite(
    name: str, middle: float
) -> None:
    for off in (0.0, 1e-10):
        with pytest.raises(RepresentationSingularityError, match="representational singularity") as caught:
            euler_rates(name, [0.1, middle + off, 0.2], [1.0, 0.0, 0.0])
        assert caught.value.distance == pytest.approx(off, abs=1e-15)
        assert caught.value.sequence == name


def test_the_worst_sample_of_a_batch_is_named() -> None:
    batch = np.full((2, 3, 3), 1.0)
    batch[1, 2, 1] = 0.0
    with pytest.raises(RepresentationSingularityError, match=r"sample \[1, 2\]"):
        euler_rates("ZYZ", batch, np.ones(3))


def test_near_the_singularity_the_condition_grows_as_two_over_the_distance() -> None:
    for distance in (1e-3, 1e-6, 1e-8):
        near = [0.0, distance, 0.0]
        assert float(euler_condition("ZYZ", near)) * distance == pytest.approx(2.0, rel=1e-6)
        assert np.isfinite(euler_rates("ZYZ", near, [1.0, 2.0, 3.0])).all()


def test_the_condition_does_not_exist_at_the_singularity() -> None:
    with pytest.raises(RepresentationSingularityError):
        euler_condition("ZYZ", [0.0, 0.0, 0.0])


@given(st.floats(-30.0, 30.0))
def test_the_distance_is_zero_where_and_only_where_the_determinant_is(middle: float) -> None:
    turns: FloatArray = np.array([0.5, middle, 1.0])
    for name in ("ZYZ", "zyx"):
        determinant = abs(float(np.linalg.det(euler_rate_matrix(name, turns))))
        assert abs(float(np.sin(singularity_distance(name, turns))) - determinant) <= ROUNDING
