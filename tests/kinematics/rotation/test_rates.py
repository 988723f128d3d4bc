"""Rates of a rotation and angular velocity are each other's, against derivatives at 60 digits."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from tests.high_precision import about, angular_velocity, array, column, mp, rate
from tests.kinematics.rotation.strategies import ROUNDING, angles, axes, vectors3
from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    add_angular_velocities,
    angular_velocity_of,
    exp_rotation,
    rotate_skew,
    rotation_about,
    rotation_rate,
    skew,
    turning_vector_rate,
)


def tumbling(t: Any) -> Any:
    """Some motion that turns about no fixed axis."""
    return about(column(1, 2, 3), mp.sin(t)) * about(column(-1, 0, 2), t * t) * about(column(0, 1, 0), 3 * t)


@pytest.mark.parametrize("t", [0.0, 0.3, 1.7])
def test_the_rate_of_a_rotation_is_its_derivative_and_gives_w_back(t: float) -> None:
    R, R_rate, w = array(tumbling(mp.mpf(t))), array(rate(tumbling, t)), array(angular_velocity(tumbling, t))
    assert np.abs(rotation_rate(R, w) - R_rate).max() <= 4 * ROUNDING
    assert np.abs(angular_velocity_of(R, R_rate) - w).max() <= 4 * ROUNDING


def test_the_rate_of_a_vector_fixed_in_a_turning_frame_is_its_derivative() -> None:
    t, p_1 = 0.8, column(1, -2, mp.mpf(1) / 2)
    expected = array(rate(lambda s: tumbling(s) * p_1, t))
    p_0, w = array(tumbling(mp.mpf(t)) * p_1), array(angular_velocity(tumbling, t))
    assert np.abs(turning_vector_rate(w, p_0) - expected).max() <= 8 * ROUNDING


@pytest.mark.slow
@given(axes, angles, vectors3)
def test_a_turned_skew_matrix_is_the_skew_matrix_of_the_turned_vector(
    k: FloatArray, phi: float, w: FloatArray
) -> None:
    R = rotation_about(k, phi)
    assert np.abs(rotate_skew(R, skew(w)) - skew(R @ w)).max() <= 2 * ROUNDING


def test_relative_angular_velocities_add_up_to_that_of_the_product() -> None:
    parts: list[Callable[[Any], Any]] = [
        lambda t: about(column(1, 2, 3), mp.sin(t)),
        lambda t: about(column(-1, 0, 2), t * t) * about(column(0, 1, 0), 3 * t),
        lambda t: about(column(0, 1, 1), mp.exp(t)),
    ]
    t = 0.4
    Rs = np.stack([array(part(mp.mpf(t))) for part in parts])
    ws = np.stack([array(angular_velocity(part, t)) for part in parts])
    whole = array(angular_velocity(lambda s: parts[0](s) * parts[1](s) * parts[2](s), t))
    assert np.abs(add_angular_velocities(Rs, ws) - whole).max() <= 8 * ROUNDING


def test_a_batch_of_rows_adds_up_row_by_row_and_no_frame_gives_nothing() -> None:
    generator = np.random.default_rng(1)
    Rs, ws = exp_rotation(generator.normal(size=(4, 3, 3))), generator.normal(size=(4, 3, 3))
    assert np.allclose(
        add_angular_velocities(Rs, ws)[2], add_angular_velocities(Rs[2], ws[2]), rtol=0, atol=1e-15
    )
    assert add_angular_velocities(np.zeros((0, 3, 3)), np.zeros((0, 3))).tolist() == [0.0, 0.0, 0.0]


def test_what_is_no_rate_of_a_rotation_is_refused() -> None:
    with pytest.raises(InputError, match="skew-symmetric"):
        angular_velocity_of(np.eye(3), np.eye(3))
    with pytest.raises(InputError, match="the same n"):
        add_angular_velocities(np.eye(3)[np.newaxis], np.zeros((2, 3)))
