"""Section 7.4.6: the polar robot of figure 7.15, equations 7.101 to 7.108."""

import numpy as np

from tests.text.robots import close, motion, robot
from urdfkin.dh import motion as motion_of
from urdfkin.kinematics.bodies import interorigin_vector, interorigin_velocity, joint_angular_velocity
from urdfkin.kinematics.inputs import FloatArray

MOVING = motion("polar", 4)
Q, V = MOVING.q, MOVING.v
D2 = Q[1]
Z0 = np.array([0.0, 0.0, 1.0])
X1, Z1 = MOVING.x(1), MOVING.axis(2)


def velocities() -> FloatArray:
    return robot("polar").velocity(Q, V, ["arm", "slider"])


def test_7_101_link_1_rotates_about_z0() -> None:
    assert close(velocities()[0, 3:], V[0] * Z0)


def test_7_102_the_prismatic_joint_causes_no_rotation() -> None:
    assert close(joint_angular_velocity(Z1, V[1], turns=False), 0.0)
    assert close(velocities()[1, 3:] - velocities()[0, 3:], 0.0)


def test_7_103_link_2_has_the_angular_velocity_of_link_1() -> None:
    assert close(velocities()[1, 3:], V[0] * Z0)
    assert close(velocities()[1, 3:], MOVING.w(2))


def test_7_104_and_7_106_the_first_two_origins_coincide_and_do_not_move() -> None:
    assert not robot("polar").placement(Q, "arm")[:3, 3].any()
    assert not velocities()[0, :3].any()


def test_7_105_the_second_interorigin_vector_lies_along_the_prismatic_axis() -> None:
    vector = interorigin_vector(D2, Z1, 0.0, X1)
    assert close(robot("polar").placement(Q, "slider")[:3, 3], D2 * Z1)
    assert close(vector, D2 * Z1)


def test_7_107_the_rate_of_the_interorigin_vector_has_a_part_across_and_a_part_along_the_axis() -> None:
    found = interorigin_velocity(V[0] * Z0, D2 * Z1, Z1, V[1], turns=False)
    assert close(found, -V[0] * D2 * X1 + V[1] * Z1)
    assert close(found, MOVING.between_rate(2))


def test_7_108_the_endpoints_velocity_is_the_rate_of_the_interorigin_vector() -> None:
    assert close(velocities()[1, :3], -V[0] * D2 * X1 + V[1] * Z1)
    assert close(velocities()[1, :3], MOVING.vel(2))


def test_the_polar_robots_standard_table_has_the_rows_of_figure_7_15() -> None:
    table = robot("polar").dh("slider")
    # i, a_i, d_i, alpha_i, theta_i, with the joint's coordinate for each *.
    rows = [(row.a, row.d, row.alpha, row.theta) for row in table.rows]
    assert rows == [(0.0, 0.0, -np.pi / 2, 0.0), (0.0, 0.0, np.pi / 2, 0.0)]
    assert [row.kind.turns for row in table.rows] == [True, False]
    assert np.array_equal(table.base, np.eye(4))
    assert np.array_equal(table.tool, np.eye(4))
    assert close(table.placement(Q)[:3, 3], MOVING.origin(2))
    assert close(table.placement(Q)[:3, :3], MOVING.rotation(2))
    assert close(motion_of.jacobian(table, Q) @ V, np.concatenate((MOVING.vel(2), MOVING.w(2))))
