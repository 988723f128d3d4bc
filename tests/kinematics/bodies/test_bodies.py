"""Moving points and frames against positions written down at 60 digits and differentiated there."""

from typing import Any

import numpy as np
import pytest

from tests.high_precision import (
    angular_acceleration,
    angular_velocity,
    array,
    column,
    mp,
    rate,
    second_rate,
)
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame, point
from urdfkin.errors import InputError
from urdfkin.kinematics.bodies import (
    MovingFrame,
    compose_all,
    link_endpoint,
    link_endpoint_velocity,
    planar_rotation,
    planar_rotation_derivative,
    point_acceleration,
    point_position,
    point_velocity,
)


def test_a_moving_point_in_a_moving_frame_has_the_derivatives_of_its_position() -> None:
    def p_0(t: Any) -> Any:
        return ORIGINS[0](t) + ORIENTATIONS[0](t) * point(t)

    p_1, v_1, a_1 = array(point(mp.mpf(T))), array(rate(point, T)), array(second_rate(point, T))
    assert np.abs(point_position(frame(0), p_1) - array(p_0(mp.mpf(T)))).max() <= ROUNDING
    assert np.abs(point_velocity(frame(0), p_1, v_1).total - array(rate(p_0, T))).max() <= 8 * ROUNDING
    acceleration = point_acceleration(frame(0), p_1, v_1, a_1)
    assert np.abs(acceleration.total - array(second_rate(p_0, T))).max() <= 64 * ROUNDING


def test_the_parts_lie_as_the_text_says() -> None:
    v_1 = np.array([0.2, -1.0, 0.4])
    moving = frame(0)
    parts = point_acceleration(moving, [1.0, 2.0, 3.0], v_1)
    assert abs(parts.coriolis @ moving.w_0_1) <= 64 * ROUNDING
    assert abs(parts.coriolis @ (moving.R_0_1 @ v_1)) <= 64 * ROUNDING
    assert abs(parts.centripetal @ moving.w_0_1) <= 64 * ROUNDING
    assert parts.centripetal @ (moving.R_0_1 @ [1.0, 2.0, 3.0]) < 0.0
    assert abs(parts.transverse @ moving.alpha_0_1) <= 256 * ROUNDING


def test_a_row_of_frames_moves_as_the_product_of_its_transformations() -> None:
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


def test_no_frames_at_all_are_frame_zero() -> None:
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


def test_a_frame_refuses_what_is_no_rotation_and_keeps_its_arrays_to_itself() -> None:
    with pytest.raises(InputError, match="R_0_1 must be a rotation"):
        MovingFrame(2.0 * np.eye(3), np.zeros(3))
    origin = np.zeros(3)
    moving = MovingFrame(np.eye(3), origin)
    origin[0] = 1.0
    assert moving.d_0_1[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        moving.d_0_1[0] = 1.0


def test_one_link_in_the_plane_moves_along_its_tangent() -> None:
    theta, speed, length = 0.6, 1.5, 0.8

    def end(t: Any) -> Any:
        angle = mp.mpf(theta) + t * mp.mpf(speed)
        return mp.mpf(length) * column(mp.cos(angle), mp.sin(angle))

    assert np.abs(link_endpoint(theta, length) - array(end(mp.mpf(0)))).max() <= ROUNDING
    velocity = link_endpoint_velocity(theta, speed, length)
    assert np.abs(velocity - array(rate(end, 0.0))).max() <= ROUNDING
    assert abs(velocity @ link_endpoint(theta, length)) <= ROUNDING


def test_the_planar_derivative_is_the_rotation_a_right_angle_on() -> None:
    thetas = np.linspace(-4.0, 4.0, 9)
    assert np.abs(planar_rotation_derivative(thetas) - planar_rotation(thetas + np.pi / 2)).max() <= ROUNDING
