"""Section 7.1: equations 7.1 to 7.5 and 7.7 for one link in the plane (figure 7.1)."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.high_precision import array, column, mp, rate
from tests.kinematics.rotation.strategies import ROUNDING
from urdfkin.kinematics.bodies import (
    link_endpoint,
    link_endpoint_velocity,
    planar_rotation,
    planar_rotation_derivative,
)

THETA, SPEED, A1 = 0.9, -1.7, 0.8


def endpoint(t: Any) -> Any:
    tip = mp.mpf(A1) * mp.expj(mp.mpf(THETA) + mp.mpf(SPEED) * t)
    return column(tip.real, tip.imag)


def test_7_1_the_endpoint_lies_at_the_links_length_along_x1() -> None:
    assert np.abs(link_endpoint(THETA, A1) - array(endpoint(mp.mpf(0)))).max() <= ROUNDING


def test_7_2_the_endpoints_velocity_is_the_derivative_of_the_position() -> None:
    assert np.abs(link_endpoint_velocity(THETA, SPEED, A1) - array(rate(endpoint, 0.0))).max() <= ROUNDING


def test_7_3_the_endpoint_is_the_rotation_of_a1_x1() -> None:
    assert np.abs(planar_rotation(THETA) @ [A1, 0.0] - array(endpoint(mp.mpf(0)))).max() <= ROUNDING


def test_7_4_the_velocity_is_the_rotations_rate_times_a1_x1() -> None:
    R_rate = SPEED * planar_rotation_derivative(THETA)
    assert np.abs(R_rate @ [A1, 0.0] - array(rate(endpoint, 0.0))).max() <= ROUNDING


def test_7_5_the_planar_rotation_is_scipys_rotation_about_z() -> None:
    thetas = np.linspace(-7.0, 7.0, 29)
    expected = Rotation.from_euler("z", thetas[:, np.newaxis]).as_matrix()[:, :2, :2]
    assert np.abs(planar_rotation(thetas) - expected).max() <= ROUNDING


def test_7_7_the_velocity_points_along_y1_with_the_speed_a1_times_the_angular_rate() -> None:
    velocity = link_endpoint_velocity(THETA, SPEED, A1)
    y1 = [-np.sin(THETA), np.cos(THETA)]
    assert abs(velocity @ y1 - A1 * SPEED) <= ROUNDING
    assert abs(velocity @ [np.cos(THETA), np.sin(THETA)]) <= ROUNDING
