"""Quaternion rates both ways and in both frames, and orientation integrated from them."""

from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given

from tests.high_precision import about, angular_velocity, array, column, mp
from tests.kinematics.rotation.strategies import ROUNDING, angles, axes, vectors3
from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    angular_velocity_from_euler_rates,
    angular_velocity_from_quaternion_rates,
    integrate_orientation,
    log_rotation,
    quaternion_of,
    quaternion_rate_matrix,
    quaternion_rates,
    rotation_about,
    rotation_from_euler,
    rotation_of,
)


def spinning(t: Any) -> Any:
    return about(column(1, 2, -2), 1 + t) * about(column(3, 0, 4), mp.sin(2 * t) / 2)


@pytest.mark.parametrize("frame", ["fixed", "body"])
def test_quaternion_rates_are_the_derivative_of_the_quaternion(frame: Literal["fixed", "body"]) -> None:
    def quat(t: float) -> FloatArray:
        return quaternion_of(array(spinning(mp.mpf(t))))

    t, step = 0.3, 1e-3
    # Sixth-order differences of the quaternion itself: truncation 1e-19, rounding eps / step.
    offsets, weights = np.array([1, 2, 3]), np.array([3 / 4, -3 / 20, 1 / 60])
    slope = sum(
        w * (quat(t + n * step) - quat(t - n * step)) / step for n, w in zip(offsets, weights, strict=True)
    )
    w_fixed = array(angular_velocity(spinning, t))
    w = w_fixed if frame == "fixed" else array(spinning(mp.mpf(t))).T @ w_fixed
    assert np.abs(quaternion_rates(quat(t), w, frame) - slope).max() <= ROUNDING / step


@pytest.mark.slow
@given(axes, angles, vectors3)
def test_angular_velocity_comes_back_and_the_norm_stays(k: FloatArray, phi: float, w: FloatArray) -> None:
    quat = quaternion_of(rotation_about(k, phi))
    frames: tuple[Literal["fixed", "body"], ...] = ("fixed", "body")
    for frame in frames:
        rates = quaternion_rates(quat, w, frame)
        assert abs(float(quat @ rates)) <= ROUNDING
        assert np.abs(angular_velocity_from_quaternion_rates(quat, rates, frame) - w).max() <= ROUNDING


@given(axes, angles)
def test_the_columns_of_the_rate_matrix_are_perpendicular_and_half_long(k: FloatArray, phi: float) -> None:
    E = quaternion_rate_matrix(quaternion_of(rotation_about(k, phi)))
    assert np.abs(E.T @ E - np.eye(3) / 4).max() <= ROUNDING


@pytest.mark.slow
@given(axes, angles, vectors3)
def test_the_body_sees_the_fixed_frames_rates_turned(k: FloatArray, phi: float, w: FloatArray) -> None:
    R = rotation_about(k, phi)
    quat = quaternion_of(R)
    assert np.abs(quaternion_rates(quat, w) - quaternion_rates(quat, R.T @ w, "body")).max() <= ROUNDING


def test_an_unknown_frame_is_refused() -> None:
    with pytest.raises(InputError, match="'fixed' or 'body'"):
        quaternion_rate_matrix([0, 0, 0, 1], "world")  # type: ignore[arg-type]


# -- integration -------------------------------------------------------------------------------------


def zyz(t: float) -> FloatArray:
    return np.array([0.3 * t, 1.0 + 0.4 * np.sin(2.0 * t), t * t])


def zyz_rates(t: float) -> FloatArray:
    return np.array([0.3, 0.8 * np.cos(2.0 * t), 2.0 * t])


def wobble(t: float) -> FloatArray:
    """Angular velocity of a motion whose orientation is known at every time."""
    return angular_velocity_from_euler_rates("ZYZ", zyz(t), zyz_rates(t))


def error(steps: int) -> float:
    quats = integrate_orientation(
        wobble, quaternion_of(rotation_from_euler("ZYZ", zyz(0.0))), np.linspace(0, 2, steps + 1)
    )
    assert np.abs(np.linalg.norm(quats, axis=-1) - 1.0).max() <= ROUNDING
    missed = rotation_of(quats[-1]).T @ rotation_from_euler("ZYZ", zyz(2.0))
    return float(np.linalg.norm(log_rotation(missed)))


def test_the_integration_converges_with_the_fourth_power_of_the_step() -> None:
    errors = np.array([error(steps) for steps in (20, 40, 80, 160)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.abs(orders - 4.0).max() < 0.25
    assert errors[-1] < 1e-6


def test_the_bodys_own_angular_velocity_integrates_to_the_same_orientation() -> None:
    def in_body(t: float) -> FloatArray:
        return rotation_from_euler("ZYZ", zyz(t)).T @ wobble(t)

    start = quaternion_of(rotation_from_euler("ZYZ", zyz(0.0)))
    quat = integrate_orientation(in_body, start, np.linspace(0, 2, 401), "body")[-1]
    assert np.abs(rotation_of(quat) - rotation_from_euler("ZYZ", zyz(2.0))).max() < 1e-8


def test_times_must_increase() -> None:
    with pytest.raises(InputError, match="increasing"):
        integrate_orientation(wobble, [0, 0, 0, 1], [0.0, 0.0])
