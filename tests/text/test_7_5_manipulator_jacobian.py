"""Section 7.5: the manipulator Jacobian of the elbow robot, equations 7.116 to 7.122.

The forward kinematics x = f(theta) is written down at 60 digits, Euler angles and all, and differentiated.
"""

from typing import Any

import numpy as np
import pytest

from tests.high_precision import array, column, mp, rate
from tests.text.robots import Motion, close, motion, only, robot
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics.bodies import (
    analytical_jacobian,
    pose_rates,
    representation_matrix,
    velocity_jacobian,
    velocity_of_pose_rates,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import euler_of, euler_rate_matrix

MOVING = motion("elbow", 7)
R_06 = MOVING.rotation(6)


def pose(moving: Motion, t: Any) -> Any:
    """X = (x1, x2, x3, phi, theta, psi): position and ZYZ angles of frame 6."""
    R, d = moving.R(6)(t), moving.d(6)(t)
    theta = mp.atan2(mp.sqrt(R[0, 2] ** 2 + R[1, 2] ** 2), R[2, 2])
    phi, psi = mp.atan2(R[1, 2], R[0, 2]), mp.atan2(R[2, 1], -R[2, 0])
    return column(d[0], d[1], d[2], phi, theta, psi)


def derivative_by_joint(j: int) -> FloatArray:
    """Column j of the derivative of f: the rates of x with joint j alone moving, by its rate."""
    alone = only(MOVING, j)
    slope: FloatArray = array(rate(lambda t: pose(alone, t), 0.0)) / alone.v[j - 1]
    return slope


def velocity() -> FloatArray:
    return robot("elbow").velocity(MOVING.q, MOVING.v, "wrist")


def test_7_116_and_7_117_the_rates_of_x_are_the_manipulator_jacobian_times_the_joint_rates() -> None:
    x_rate = array(rate(lambda t: pose(MOVING, t), 0.0))
    J = robot("elbow").analytical_jacobian(MOVING.q, "wrist", "ZYZ")
    assert close(J @ MOVING.v, x_rate, 8.0)


@pytest.mark.parametrize("j", range(1, 7))
def test_7_118_its_elements_are_the_derivatives_of_f_by_each_joint(j: int) -> None:
    J = robot("elbow").analytical_jacobian(MOVING.q, "wrist", "ZYZ")
    assert close(J[:, j - 1], derivative_by_joint(j), 8.0)


def test_7_119_C_takes_the_rates_of_x_to_the_velocities() -> None:
    x_rate = array(rate(lambda t: pose(MOVING, t), 0.0))
    assert close(velocity_of_pose_rates("ZYZ", R_06, x_rate), velocity(), 8.0)
    assert close(pose_rates("ZYZ", R_06, velocity()), x_rate, 8.0)


def test_7_120_C_has_the_identity_and_omega_on_its_diagonal() -> None:
    C = representation_matrix("ZYZ", R_06)
    assert np.array_equal(C[:3], np.eye(3, 6))
    assert not C[3:, :3].any()
    assert close(C[3:, 3:], euler_rate_matrix("ZYZ", euler_of("ZYZ", R_06)))
    assert close(C[3:, 3:] @ array(rate(lambda t: pose(MOVING, t), 0.0))[3:], MOVING.w(6), 8.0)


def test_7_121_the_velocity_jacobian_is_C_times_the_manipulator_jacobian() -> None:
    J = np.stack([derivative_by_joint(j) for j in range(1, 7)], axis=-1)
    assert close(velocity_jacobian("ZYZ", R_06, J), robot("elbow").jacobian(MOVING.q, "wrist"), 8.0)


def test_7_122_the_manipulator_jacobian_is_the_inverse_of_C_times_the_velocity_jacobian() -> None:
    J_v = robot("elbow").jacobian(MOVING.q, "wrist")
    J = analytical_jacobian("ZYZ", R_06, J_v)
    assert close(J, np.linalg.solve(representation_matrix("ZYZ", R_06), J_v), 16.0)
    assert close(J @ MOVING.v, array(rate(lambda t: pose(MOVING, t), 0.0)), 8.0)


def test_7_122_fails_where_omega_cannot_be_inverted_and_a_quaternion_does_not() -> None:
    # At zero the elbow's wrist stands upright: theta = 0, and ZYZ cannot say how it turns.
    with pytest.raises(RepresentationSingularityError, match="ZYZ"):
        robot("elbow").analytical_jacobian(np.zeros(6), "wrist", "ZYZ")
    assert robot("elbow").analytical_jacobian(np.zeros(6), "wrist", "quaternion").shape == (7, 6)
