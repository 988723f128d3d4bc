"""Section 7.4.5: the planar two-link manipulator, three ways; equations 7.86 to 7.100.

a1 = 0.5 m and a2 = 0.4 m, as in robots/planar_two_link.urdf.
"""

import numpy as np

from tests.high_precision import array, mp
from tests.text.robots import close, motion, robot
from urdfkin.kinematics.bodies import (
    jacobian_column,
    joint_angular_velocity,
    link_endpoint_velocity,
    planar_rotation,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import rotation_about

A1, A2 = 0.5, 0.4
MOVING = motion("planar_two_link", 3)
Q, V = MOVING.q, MOVING.v
Z = np.array([0.0, 0.0, 1.0])
S1, C1, S12, C12 = np.sin(Q[0]), np.cos(Q[0]), np.sin(Q.sum()), np.cos(Q.sum())


def tip() -> FloatArray:
    return robot("planar_two_link").velocity(Q, V, "tip")


def jacobian() -> FloatArray:
    return robot("planar_two_link").jacobian(Q, "tip")


def test_7_86_the_position_of_the_tip_is_that_of_the_geometry() -> None:
    position = robot("planar_two_link").placement(Q, "tip")[:3, 3]
    assert close(position, [A1 * C1 + A2 * C12, A1 * S1 + A2 * S12, 0.0])
    assert close(position, array(MOVING.d(2)(mp.mpf(0))))


def test_7_87_differentiating_the_geometry_gives_the_tips_velocity() -> None:
    x_rate = -A1 * V[0] * S1 - A2 * V.sum() * S12
    y_rate = A1 * V[0] * C1 + A2 * V.sum() * C12
    assert close(tip()[:2], [x_rate, y_rate])
    assert close(tip()[:3], MOVING.vel(2))


def test_7_88_to_7_90_the_planar_jacobian_has_the_texts_entries() -> None:
    J = [[-A1 * S1 - A2 * S12, -A2 * S12], [A1 * C1 + A2 * C12, A2 * C12]]
    assert close(jacobian()[:2], J)
    assert close(jacobian()[:2] @ V, tip()[:2])


def test_7_91_and_7_92_each_joint_rotates_the_link_about_z0() -> None:
    for i in (1, 2):
        assert close(joint_angular_velocity(MOVING.axis(i), V[i - 1], turns=True), V[i - 1] * Z)


def test_7_93_the_angular_velocity_of_the_second_link_is_the_sum_of_the_joint_velocities() -> None:
    assert close(tip()[3:], V.sum() * Z)
    assert close(tip()[3:], MOVING.w(2))


def test_7_94_the_tips_velocity_is_the_sum_of_two_cross_products() -> None:
    x1, x2 = (rotation_about(Z, angle)[:, 0] for angle in (Q[0], Q.sum()))
    both = np.cross(V[0] * Z, A1 * x1) + np.cross(V.sum() * Z, A2 * x2)
    assert close(tip()[:3], both)


def test_7_95_and_7_96_each_link_adds_a_velocity_along_the_y_axis_of_the_link() -> None:
    both = link_endpoint_velocity(Q[0], V[0], A1) + link_endpoint_velocity(Q.sum(), V.sum(), A2)
    assert close(tip()[:2], both)
    y1, y2 = planar_rotation(Q[0])[:, 1], planar_rotation(Q.sum())[:, 1]
    assert close(y1, [-S1, C1])
    assert close(y2, [-S12, C12])
    assert close(tip()[:2], A1 * V[0] * y1 + A2 * V.sum() * y2)


def test_7_97_the_tips_velocity_is_also_a_sum_over_moment_arms() -> None:
    d_02, d_12 = MOVING.origin(2), MOVING.origin(2) - MOVING.origin(1)
    shares = V[0] * jacobian_column(Z, d_02, turns=True) + V[1] * jacobian_column(Z, d_12, turns=True)
    assert close(tip(), shares)


def test_7_98_the_linear_rows_of_the_jacobian_are_cross_products_with_the_moment_arms() -> None:
    d_02, d_12 = MOVING.origin(2), MOVING.origin(2) - MOVING.origin(1)
    assert close(jacobian()[:3], np.stack((np.cross(Z, d_02), np.cross(Z, d_12)), axis=-1))
    assert close(jacobian()[:3] @ V, MOVING.vel(2))


def test_7_99_and_7_100_the_full_velocity_jacobian_has_the_joint_axes_as_angular_rows() -> None:
    assert close(jacobian()[3:], np.stack((Z, Z), axis=-1))
    assert close(jacobian() @ V, np.concatenate((MOVING.vel(2), MOVING.w(2))))
