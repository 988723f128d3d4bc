"""Section 7.6: the acceleration of points, equations 7.123 to 7.125 and example 7.4."""

from typing import Any

import numpy as np

from tests.high_precision import array, column, mp, rate, second_rate
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame, point
from urdfkin.kinematics.bodies import (
    MovingFrame,
    planar_rotation_derivative,
    point_acceleration,
    point_velocity,
)
from urdfkin.kinematics.rotation import rotation_about


def moving(t: Any) -> Any:
    return ORIGINS[0](t) + ORIENTATIONS[0](t) * point(t)


def close(found: Any, expected: Any, room: float = 64.0) -> bool:
    return bool(np.abs(np.asarray(found) - expected).max() <= room * ROUNDING)


def test_7_123_a_fixed_point_has_a_transverse_and_a_centripetal_acceleration() -> None:
    p_1 = column(1, mp.mpf(1) / 2, -2)
    parts = point_acceleration(frame(0), array(p_1))
    assert close(parts.total, array(second_rate(lambda t: ORIGINS[0](t) + ORIENTATIONS[0](t) * p_1, T)), 256)
    assert not parts.coriolis.any()
    assert not parts.relative.any()
    p_0 = frame(0).R_0_1 @ array(p_1)
    assert close(parts.transverse, np.cross(frame(0).alpha_0_1, p_0))
    # By the identity w x (w x p) = w (w . p) - p (w . w), computed the other way.
    w = frame(0).w_0_1
    assert close(parts.centripetal, w * (w @ p_0) - p_0 * (w @ w), 256)


def test_7_124_a_moving_point_adds_its_own_velocity() -> None:
    velocity = point_velocity(frame(0), array(point(mp.mpf(T))), array(rate(point, T)))
    assert close(velocity.total, array(rate(moving, T)))
    assert close(velocity.relative, frame(0).R_0_1 @ array(rate(point, T)))


def test_7_125_a_moving_point_adds_coriolis_and_its_own_acceleration() -> None:
    p_1, v_1, a_1 = array(point(mp.mpf(T))), array(rate(point, T)), array(second_rate(point, T))
    parts = point_acceleration(frame(0), p_1, v_1, a_1)
    assert close(parts.total, array(second_rate(moving, T)), 256)
    # Coriolis stands at right angles to w and to the relative velocity, as seen in frame 0.
    assert abs(parts.coriolis @ frame(0).w_0_1) <= 64 * ROUNDING
    assert abs(parts.coriolis @ (frame(0).R_0_1 @ v_1)) <= 64 * ROUNDING


def test_example_7_4_motion_in_the_plane_points_inwards_and_along_the_tangent() -> None:
    theta, rate_1, rate_rate = 0.7, 1.6, -2.2
    p_1 = np.array([0.5, -0.3, 0.0])
    z = np.array([0.0, 0.0, 1.0])
    R = rotation_about(z, theta)
    turning = MovingFrame(R, np.zeros(3), rate_1 * z, np.zeros(3), rate_rate * z)
    parts = point_acceleration(turning, p_1)
    assert close(parts.centripetal, -(rate_1**2) * R @ p_1)
    assert close(parts.transverse[:2], rate_rate * planar_rotation_derivative(theta) @ p_1[:2])
    assert close(parts.transverse, rate_rate * rotation_about(z, theta + np.pi / 2) @ p_1)
