"""Motions of points and frames agree with positions at 60 digits; also the manipulator Jacobian."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.high_precision import angular_acceleration, angular_velocity, array, mp, rate, second_rate
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame
from urdfkin.errors import InputError, RangeError, RepresentationSingularityError, UnknownNameError
from urdfkin.kinematics.bodies import (
    MovingFrame,
    analytical_jacobian,
    compose,
    compose_all,
    frame_velocity,
    interorigin_vector,
    interorigin_velocity,
    jacobian_column,
    link_endpoint_velocity,
    orientation_of,
    planar_rotation,
    planar_rotation_derivative,
    point_acceleration,
    point_position,
    point_velocity,
    pose_rate_inverse,
    pose_rate_matrix,
    pose_rates,
    tool_velocity,
    velocity_jacobian,
    velocity_of_pose_rates,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    EULER_SEQUENCES,
    exp_rotation,
    rotation_from_euler,
    rotation_from_quaternion,
)


def test_the_motion_of_composed_frames_is_the_derivative_of_the_product_of_transformations() -> None:
    def R(t: Any) -> Any:
        return ORIENTATIONS[0](t) * ORIENTATIONS[1](t) * ORIENTATIONS[2](t)

    def d(t: Any) -> Any:
        return ORIGINS[0](t) + ORIENTATIONS[0](t) * (ORIGINS[1](t) + ORIENTATIONS[1](t) * ORIGINS[2](t))

    last = compose_all(frame(i) for i in range(3))
    expected = (
        (last.R_0_1, R(mp.mpf(T)), 1),
        (last.d_0_1, d(mp.mpf(T)), 1),
        (last.w_0_1, angular_velocity(R, T), 8),
        (last.v_0_1, rate(d, T), 32),
        (last.alpha_0_1, angular_acceleration(R, T), 64),
        (last.a_0_1, second_rate(d, T), 256),
    )
    for found, exact, room in expected:
        assert np.abs(found - array(exact)).max() <= room * ROUNDING


def test_an_empty_list_of_frames_gives_frame_zero() -> None:
    still = compose_all([])
    assert np.array_equal(still.R_0_1, np.eye(3))
    assert not still.d_0_1.any()


def test_batches_of_frames_and_points_broadcast() -> None:
    one = frame(0)
    row = MovingFrame(np.stack([one.R_0_1] * 4), one.d_0_1, one.w_0_1)
    points = np.arange(36.0).reshape(3, 4, 3)
    parts = point_acceleration(row, points)
    assert parts.total.shape == parts.origin.shape == (3, 4, 3)
    single = point_acceleration(MovingFrame(one.R_0_1, one.d_0_1, one.w_0_1), points[2, 1])
    assert np.array_equal(parts.total[2, 1], single.total)


def test_a_frame_refuses_an_invalid_rotation_and_copies_its_arrays() -> None:
    with pytest.raises(InputError, match="R_0_1 must be a rotation"):
        MovingFrame(2.0 * np.eye(3), np.zeros(3))
    origin = np.zeros(3)
    moving = MovingFrame(np.eye(3), origin)
    origin[0] = 1.0
    assert moving.d_0_1[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        moving.d_0_1[0] = 1.0


def test_the_derivative_of_a_planar_rotation_is_the_rotation_by_a_further_right_angle() -> None:
    thetas = np.linspace(-4.0, 4.0, 9)
    assert np.abs(planar_rotation_derivative(thetas) - planar_rotation(thetas + np.pi / 2)).max() <= ROUNDING


# -- the manipulator Jacobian --------------------------------------------------------------------------


R = exp_rotation([0.5, -0.8, 0.3])
REPRESENTATIONS = (*EULER_SEQUENCES, "quaternion")


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_pose_rates_are_the_difference_quotients_of_the_orientation_representation(
    representation: str,
) -> None:
    velocity, step = np.array([0.1, 0.2, 0.3, -0.4, 0.9, 0.6]), 1e-3
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}

    def turned(t: float) -> FloatArray:
        return orientation_of(representation, exp_rotation(velocity[3:] * t) @ R)

    slope = sum(w / step * (turned(n * step) - turned(-n * step)) for n, w in weights.items())
    rates = pose_rates(representation, R, velocity)
    assert np.array_equal(rates[:3], velocity[:3])
    assert np.abs(rates[3:] - slope).max() < 1e-11
    assert np.abs(velocity_of_pose_rates(representation, R, rates) - velocity).max() <= 8 * ROUNDING


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_manipulator_jacobian_and_velocity_jacobian_can_be_converted_both_ways(representation: str) -> None:
    J_v = np.random.default_rng(0).normal(size=(4, 6, 7))
    Rs = exp_rotation(np.random.default_rng(1).normal(size=(4, 3)))
    J = analytical_jacobian(representation, Rs, J_v)
    assert J.shape == ((4, 7, 7) if representation == "quaternion" else (4, 6, 7))
    assert np.abs(velocity_jacobian(representation, Rs, J) - J_v).max() <= 256 * ROUNDING


def test_the_representation_matrix_of_a_quaternion_has_a_right_inverse_at_every_angle() -> None:
    for angle in (0.0, 1e-9, 1.0, np.pi):
        turned = exp_rotation([0.0, angle, 0.0])
        product = pose_rate_matrix("quaternion", turned) @ pose_rate_inverse("quaternion", turned)
        assert np.abs(product - np.eye(6)).max() <= ROUNDING
    assert np.abs(rotation_from_quaternion(orientation_of("quaternion", R)) - R).max() <= ROUNDING


def test_at_a_representation_singularity_the_jacobian_is_refused_with_the_distance() -> None:
    for sequence, middle in (("ZYZ", 0.0), ("xyz", np.pi / 2)):
        singular = rotation_from_euler(sequence, [0.3, middle, 0.0])
        with pytest.raises(
            RepresentationSingularityError, match=f"{sequence}.*rad from the singularity"
        ) as caught:
            analytical_jacobian(sequence, singular, np.ones((6, 3)))
        assert caught.value.distance < 1e-9
        # The angular velocity of Euler rates exists in every configuration.
        assert np.isfinite(velocity_jacobian(sequence, singular, np.ones((6, 3)))).all()


def test_the_caller_chooses_the_least_distance_to_a_singularity() -> None:
    near = rotation_from_euler("ZYZ", [0.3, 1e-4, 0.0])
    assert np.isfinite(analytical_jacobian("ZYZ", near, np.ones((6, 3)))).all()
    with pytest.raises(RepresentationSingularityError):
        analytical_jacobian("ZYZ", near, np.ones((6, 3)), nearest=1e-3)


def test_unknown_representations_and_shapes_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="Euler sequence 'zzz'"):
        analytical_jacobian("zzz", R, np.ones((6, 3)))
    with pytest.raises(InputError, match=r"J_v must have the shape"):
        analytical_jacobian("ZYZ", R, np.ones((5, 3)))


def test_velocities_are_converted_to_the_tool_and_back() -> None:
    generator = np.random.default_rng(2)
    velocity, d = generator.normal(size=(5, 6)), generator.normal(size=(5, 3))
    there = tool_velocity(velocity, d)
    assert np.array_equal(there[:, 3:], velocity[:, 3:])
    assert np.abs(frame_velocity(there, d) - velocity).max() <= 4 * ROUNDING


def test_the_composition_of_other_values_than_moving_frames_is_refused() -> None:
    one = MovingFrame(np.eye(3), np.zeros(3))
    for first, second in ((one, None), (np.eye(4), one)):
        with pytest.raises(InputError, match="a moving frame must be a MovingFrame: found"):
            compose(first, second)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="compose_all needs a list of MovingFrames"):
        compose_all(one)  # type: ignore[arg-type]


def test_results_beyond_the_range_of_doubles_raise_a_range_error_without_a_warning() -> None:
    huge, axis = np.array([1.7e308, -1.7e308, 1.7e308]), np.ones(3) / np.sqrt(3.0)
    R = exp_rotation([0.1, 0.2, 0.3])
    moving = MovingFrame(R, huge, huge, huge, huge, huge)
    parts = point_velocity(MovingFrame(np.eye(3), np.zeros(3), v_0_1=huge), np.zeros(3), huge)
    six = np.full(6, 1.7e308)
    calls: list[Callable[[], object]] = [
        lambda: compose_all([moving, moving]),
        lambda: point_position(moving, huge),
        lambda: point_velocity(moving, huge),
        lambda: parts.total,
        lambda: point_acceleration(moving, huge),
        lambda: interorigin_vector(1.7e308, axis, 1.7e308, axis),
        lambda: interorigin_velocity(huge, huge, axis, 1.0, turns=True),
        lambda: jacobian_column(axis, huge, turns=True),
        lambda: link_endpoint_velocity(0.3, 1e200, 1e200),
        lambda: tool_velocity(six, huge),
        lambda: analytical_jacobian("ZYZ", R, np.full((6, 2), 1.7e308)),
        lambda: velocity_jacobian("quaternion", R, np.full((7, 2), 1.7e308)),
        lambda: pose_rates("ZYZ", R, six),
        lambda: velocity_of_pose_rates("ZYZ", R, six),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for call in calls:
            with pytest.raises(RangeError):
                call()
