"""Rates of rotations, Euler angles and quaternions agree with derivatives at 60 digits."""

import warnings
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.high_precision import angular_velocity, array, mp, turn
from tests.kinematics.rotation.strategies import ROUNDING, angles, axes, vectors3
from urdfkin.errors import InputError, RangeError, RepresentationSingularityError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    EULER_SEQUENCES,
    add_angular_velocities,
    angular_velocity_from_euler_rates,
    angular_velocity_from_quaternion_rates,
    circular_velocity,
    euler_condition,
    euler_rate_inverse,
    euler_rate_matrix,
    euler_rates,
    exp_rotation,
    integrate_orientation,
    log_rotation,
    quaternion_of,
    quaternion_rate_matrix,
    quaternion_rates,
    rotate_skew,
    rotation_about,
    rotation_from_euler,
    rotation_from_quaternion,
    rotation_rate,
    singularity_distance,
    skew,
    split_along,
    turning_vector_rate,
    unskew,
)


def test_angular_velocities_add_for_each_sample_of_a_batch_and_the_empty_sum_is_zero() -> None:
    generator = np.random.default_rng(1)
    Rs, ws = exp_rotation(generator.normal(size=(4, 3, 3))), generator.normal(size=(4, 3, 3))
    assert np.allclose(
        add_angular_velocities(Rs, ws)[2], add_angular_velocities(Rs[2], ws[2]), rtol=0, atol=1e-15
    )
    assert add_angular_velocities(np.zeros((0, 3, 3)), np.zeros((0, 3))).tolist() == [0.0, 0.0, 0.0]


# -- Euler rates and their singularity -------------------------------------------------------------


ANGLES, RATES = np.array([0.4, 1.3, -2.1]), np.array([0.7, -1.1, 2.3])


def moving(name: str) -> Callable[[Any], Any]:
    letters, order = name.lower(), slice(None) if name.isupper() else slice(None, None, -1)

    def R(t: Any) -> Any:
        turns = [
            turn(axis, mp.mpf(a) + t * mp.mpf(r)) for axis, a, r in zip(letters, ANGLES, RATES, strict=True)
        ]
        first, second, third = turns[order]
        return first * second * third

    return R


@pytest.mark.parametrize("name", EULER_SEQUENCES)
def test_euler_rates_and_angular_velocity_can_be_converted_both_ways(name: str) -> None:
    w = array(angular_velocity(moving(name), 0.0))
    assert np.abs(angular_velocity_from_euler_rates(name, ANGLES, RATES) - w).max() <= 2 * ROUNDING
    assert np.abs(euler_rates(name, ANGLES, w) - RATES).max() <= 16 * ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", EULER_SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(st.tuples(angles, st.floats(0.2, 1.3), angles))
def test_the_closed_form_inverse_of_the_euler_rate_matrix_is_correct(
    name: str, turns: tuple[float, float, float]
) -> None:
    product = euler_rate_inverse(name, turns) @ euler_rate_matrix(name, turns)
    assert np.abs(product - np.eye(3)).max() <= 16 * ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", EULER_SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(st.floats(-4.0, 4.0))
def test_the_condition_number_is_that_of_the_euler_rate_matrix(name: str, middle: float) -> None:
    turns = [0.3, middle, -0.8]
    if float(singularity_distance(name, turns)) > 1e-3:
        expected = float(np.linalg.cond(euler_rate_matrix(name, turns)))
        assert abs(float(euler_condition(name, turns)) / expected - 1.0) <= 1e-9


@pytest.mark.parametrize(
    ("name", "middle"), [("ZYZ", 0.0), ("ZYZ", np.pi), ("xyz", np.pi / 2), ("XYZ", -np.pi / 2)]
)
def test_at_a_singularity_euler_rates_are_refused_with_the_distance(name: str, middle: float) -> None:
    for off in (0.0, 1e-10):
        with pytest.raises(RepresentationSingularityError, match="representational singularity") as caught:
            euler_rates(name, [0.1, middle + off, 0.2], [1.0, 0.0, 0.0])
        assert caught.value.distance == pytest.approx(off, abs=1e-15)
        assert caught.value.sequence == name


def test_the_error_names_the_sample_nearest_to_the_singularity() -> None:
    batch = np.full((2, 3, 3), 1.0)
    batch[1, 2, 1] = 0.0
    with pytest.raises(RepresentationSingularityError, match=r"sample \[1, 2\]"):
        euler_rates("ZYZ", batch, np.ones(3))


def test_the_condition_number_is_two_over_the_distance_near_a_singularity_and_refused_at_it() -> None:
    for distance in (1e-3, 1e-6, 1e-8):
        near = [0.0, distance, 0.0]
        assert float(euler_condition("ZYZ", near)) * distance == pytest.approx(2.0, rel=1e-6)
        assert np.isfinite(euler_rates("ZYZ", near, [1.0, 2.0, 3.0])).all()
    with pytest.raises(RepresentationSingularityError):
        euler_condition("ZYZ", [0.0, 0.0, 0.0])


@given(st.floats(-30.0, 30.0))
def test_the_sine_of_the_singularity_distance_is_the_determinant_of_the_rate_matrix(middle: float) -> None:
    turns: FloatArray = np.array([0.5, middle, 1.0])
    for name in ("ZYZ", "zyx"):
        determinant = abs(float(np.linalg.det(euler_rate_matrix(name, turns))))
        assert abs(float(np.sin(singularity_distance(name, turns))) - determinant) <= ROUNDING


# -- quaternion rates ------------------------------------------------------------------------------


@pytest.mark.slow
@given(axes, angles, vectors3)
def test_quaternion_rates_give_back_the_angular_velocity_and_preserve_the_norm(
    k: FloatArray, phi: float, w: FloatArray
) -> None:
    quat = quaternion_of(rotation_about(k, phi))
    frames: tuple[Literal["fixed", "body"], ...] = ("fixed", "body")
    for frame in frames:
        rates = quaternion_rates(quat, w, frame)
        assert abs(float(quat @ rates)) <= ROUNDING
        assert np.abs(angular_velocity_from_quaternion_rates(quat, rates, frame) - w).max() <= ROUNDING


@given(axes, angles)
def test_the_columns_of_the_quaternion_rate_matrix_are_perpendicular_with_length_one_half(
    k: FloatArray, phi: float
) -> None:
    E = quaternion_rate_matrix(quaternion_of(rotation_about(k, phi)))
    assert np.abs(E.T @ E - np.eye(3) / 4).max() <= ROUNDING


@pytest.mark.slow
@given(axes, angles, vectors3)
def test_body_rates_are_the_rotated_rates_of_the_fixed_frame(
    k: FloatArray, phi: float, w: FloatArray
) -> None:
    R = rotation_about(k, phi)
    quat = quaternion_of(R)
    assert np.abs(quaternion_rates(quat, w) - quaternion_rates(quat, R.T @ w, "body")).max() <= ROUNDING


# -- integration -------------------------------------------------------------------------------------


def zyz(t: float) -> FloatArray:
    return np.array([0.3 * t, 1.0 + 0.4 * np.sin(2.0 * t), t * t])


def zyz_rates(t: float) -> FloatArray:
    return np.array([0.3, 0.8 * np.cos(2.0 * t), 2.0 * t])


def wobble(t: float) -> FloatArray:
    return angular_velocity_from_euler_rates("ZYZ", zyz(t), zyz_rates(t))


def error(steps: int) -> float:
    quats = integrate_orientation(
        wobble, quaternion_of(rotation_from_euler("ZYZ", zyz(0.0))), np.linspace(0, 2, steps + 1)
    )
    assert np.abs(np.linalg.norm(quats, axis=-1) - 1.0).max() <= ROUNDING
    missed = rotation_from_quaternion(quats[-1]).T @ rotation_from_euler("ZYZ", zyz(2.0))
    return float(np.linalg.norm(log_rotation(missed)))


def test_the_integration_of_orientation_converges_with_fourth_order() -> None:
    errors = np.array([error(steps) for steps in (20, 40, 80, 160)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.abs(orders - 4.0).max() < 0.25
    assert errors[-1] < 1e-6


def test_angular_velocity_in_the_body_frame_integrates_to_the_same_orientation() -> None:
    def in_body(t: float) -> FloatArray:
        return rotation_from_euler("ZYZ", zyz(t)).T @ wobble(t)

    start = quaternion_of(rotation_from_euler("ZYZ", zyz(0.0)))
    quat = integrate_orientation(in_body, start, np.linspace(0, 2, 401), "body")[-1]
    assert np.abs(rotation_from_quaternion(quat) - rotation_from_euler("ZYZ", zyz(2.0))).max() < 1e-8


def test_rates_beyond_the_range_of_doubles_raise_a_range_error_without_a_warning() -> None:
    huge, axis, R = np.full(3, 1.7e308), np.ones(3) / np.sqrt(3.0), exp_rotation([0.1, 0.2, 0.3])
    quat = quaternion_of(R)
    calls: list[Callable[[], object]] = [
        lambda: unskew(skew(huge)),
        lambda: rotate_skew(R, skew(huge)),
        lambda: rotation_rate(R, huge),
        lambda: turning_vector_rate([1e200, 2e200, 0.0], [1e200, 0.0, 0.0]),
        lambda: add_angular_velocities(np.stack([R, R]), np.stack([huge, huge])),
        lambda: angular_velocity_from_quaternion_rates(quat, np.full(4, 1.7e308)),
        lambda: integrate_orientation(lambda _: [1e200, 0.0, 0.0], quat, [0.0, 1.0]),
        lambda: circular_velocity(axis, 1e200, [1e200, 0.0, 0.0]),
        lambda: split_along(axis, huge),
        lambda: angular_velocity_from_euler_rates("ZYZ", [0.1, 0.5, 0.2], huge),
        lambda: euler_rates("ZYZ", [0.1, 1e-8, 0.2], huge),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for call in calls:
            with pytest.raises(RangeError):
                call()
        with pytest.raises(InputError):
            rotation_rate(1e200 * np.eye(3), [0.0, 0.0, 1.0])
