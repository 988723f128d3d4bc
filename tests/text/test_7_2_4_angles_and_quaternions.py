"""Sections 7.2.4 and 7.2.5: Euler angle and quaternion rates, 7.51 to 7.57, and example 7.3."""

from typing import Any

import numpy as np
import pytest

from tests.high_precision import about, angular_velocity, array, column, mp, rate, turn
from tests.kinematics.rotation.strategies import ROUNDING, close
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics.rotation import (
    angular_velocity_from_euler_rates,
    angular_velocity_from_quaternion_rates,
    euler_rate_inverse,
    euler_rate_matrix,
    euler_rates,
    integrate_orientation,
    quaternion_of,
    quaternion_rate_matrix,
    quaternion_rates,
    rotation_from_quaternion,
    skew,
)

PHI, THETA, PSI = ANGLES = (0.4, 1.3, -2.1)
RATES = np.array([0.7, -1.1, 2.3])
Z = np.array([0.0, 0.0, 1.0])


def R(t: Any) -> Any:
    """Return the textbook's R_z(phi) R_y(theta) R_z(psi)."""
    phi, theta, psi = (mp.mpf(a) + t * mp.mpf(r) for a, r in zip(ANGLES, RATES, strict=True))
    return turn("z", phi) * turn("y", theta) * turn("z", psi)


W = array(angular_velocity(R, 0.0))


def test_7_51_the_angular_velocity_is_the_sum_of_the_rates_about_z0_y1_and_z2() -> None:
    z0, y1, z2 = euler_rate_matrix("ZYZ", ANGLES).T
    assert close(RATES[0] * z0 + RATES[1] * y1 + RATES[2] * z2, W)


def test_7_52_y1_in_frame_0_has_the_texts_entries() -> None:
    y1 = euler_rate_matrix("ZYZ", ANGLES)[:, 1]
    assert close(y1, array(turn("z", PHI) * column(0, 1, 0)))
    assert close(y1, [-np.sin(PHI), np.cos(PHI), 0.0])


def test_7_53_z2_in_frame_0_has_the_texts_entries() -> None:
    z2 = euler_rate_matrix("ZYZ", ANGLES)[:, 2]
    assert close(z2, array(turn("z", PHI) * turn("y", THETA) * column(0, 0, 1)))
    assert close(z2, [np.cos(PHI) * np.sin(THETA), np.sin(PHI) * np.sin(THETA), np.cos(THETA)])


def test_7_54_zyz_rates_give_the_angular_velocity() -> None:
    assert close(angular_velocity_from_euler_rates("ZYZ", ANGLES, RATES), W)


def test_7_55_omega_zyz_has_the_texts_entries() -> None:
    c, s, c2, s2 = np.cos(PHI), np.sin(PHI), np.cos(THETA), np.sin(THETA)
    assert close(euler_rate_matrix("ZYZ", ANGLES), [[0, -s, c * s2], [0, c, s * s2], [1, 0, c2]])


def test_7_56_the_inverse_of_omega_gives_zyz_rates_and_is_singular_at_theta_zero() -> None:
    assert close(euler_rates("ZYZ", ANGLES, W), RATES, 16)
    assert close(euler_rate_inverse("ZYZ", ANGLES), np.linalg.inv(euler_rate_matrix("ZYZ", ANGLES)), 16)
    for theta in (0.0, np.pi):
        with pytest.raises(RepresentationSingularityError):
            euler_rates("ZYZ", [PHI, theta, PSI], W)


def quaternion(t: Any) -> Any:
    """Return the quaternion (scalar last, 60 digits) of a rotation with a positive trace."""
    matrix = about(column(1, 2, -2), 1 + t) * about(column(3, 0, 4), mp.sin(2 * t) / 2)
    q0 = mp.sqrt(1 + matrix[0, 0] + matrix[1, 1] + matrix[2, 2]) / 2
    parts = (matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1])
    return column(*(part / (4 * q0) for part in parts), q0)


def test_7_57_quaternion_rates_are_the_derivative_of_the_quaternion() -> None:
    t = 0.3
    w = array(
        angular_velocity(
            lambda s: about(column(1, 2, -2), 1 + s) * about(column(3, 0, 4), mp.sin(2 * s) / 2), t
        )
    )
    quat, exact = array(quaternion(mp.mpf(t))), array(rate(quaternion, t))
    assert close(quaternion_rates(quat, w), exact)
    assert close(angular_velocity_from_quaternion_rates(quat, exact), w)
    # The textbook's matrix, with its rows in urdfkin's order: the vector first.
    q, q0 = quat[:3], quat[3]
    assert close(quaternion_rate_matrix(quat), 0.5 * np.vstack((q0 * np.eye(3) - skew(q), -q)))


# -- example 7.3 -------------------------------------------------------------------------------------

QUARTER = np.pi / 2


def turning(first: str) -> Any:
    """Return the angular velocity of case 1 (x, then y) or case 2 (y, then x)."""
    order = {"x": (0, 1), "y": (1, 0)}[first]
    return lambda t: QUARTER * np.eye(3)[order[0] if t < 1.0 else order[1]]


@pytest.mark.slow
@pytest.mark.parametrize(("first", "z1_ends_as"), [("x", [0, -1, 0]), ("y", [1, 0, 0])])
def test_example_7_3_angular_velocities_with_equal_integrals_give_different_orientations(
    first: str, z1_ends_as: list[int]
) -> None:
    w = turning(first)
    middles = (np.arange(200) + 0.5) / 100.0
    assert np.abs(sum(w(t) for t in middles) / 100.0 - [QUARTER, QUARTER, 0.0]).max() < 1e-12
    quats = integrate_orientation(w, [0.0, 0.0, 0.0, 1.0], np.linspace(0.0, 2.0, 401))
    # A method of fourth order with 200 steps for a quarter turn has an error near 1e-11.
    assert np.abs(rotation_from_quaternion(quats[-1]) @ Z - z1_ends_as).max() < 1e-9
    assert (
        np.abs(
            rotation_from_quaternion(quaternion_of(rotation_from_quaternion(quats[-1])))
            - rotation_from_quaternion(quats[-1])
        ).max()
        <= ROUNDING
    )
