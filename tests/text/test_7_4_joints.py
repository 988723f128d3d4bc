"""Sections 7.4.1 to 7.4.4 on the elbow and the polar robot: equations 7.62 to 7.85.

Expected values are derivatives, at 60 digits, of the product of the robots' transformations.
"""

import numpy as np
import pytest

from tests.high_precision import array, mp
from tests.text.robots import close, motion, only, robot
from urdfkin.kinematics.bodies import (
    interorigin_vector,
    interorigin_velocity,
    jacobian_column,
    joint_angular_velocity,
)
from urdfkin.kinematics.inputs import FloatArray

ELBOW, POLAR = motion("elbow"), motion("polar", 2)
#: The URDF's link of each joint: its frame has link i's angular velocity and lies at O_{i-1}.
ELBOW_LINKS = ("base", "trunk", "upper_arm", "elbow_link", "forearm", "wrist_pitch", "wrist")


def w_of_links() -> FloatArray:
    velocities = robot("elbow").velocity(ELBOW.q, ELBOW.v, ELBOW_LINKS)
    return velocities[:, 3:]


def elbow_velocity() -> FloatArray:
    return robot("elbow").velocity(ELBOW.q, ELBOW.v, "wrist")


# -- a single joint ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("i", range(1, 7))
def test_7_62_a_rotary_joint_rotates_the_link_about_the_joint_axis(i: int) -> None:
    alone = only(ELBOW, i)
    w = joint_angular_velocity(alone.axis(i), alone.v[i - 1], turns=True)
    assert close(w, alone.w(i))
    assert close(robot("elbow").velocity(alone.q, alone.v, ELBOW_LINKS[i])[3:], alone.w(i))


def test_7_63_a_prismatic_joint_does_not_rotate_the_link() -> None:
    alone = only(POLAR, 2)
    assert close(joint_angular_velocity(alone.axis(2), alone.v[1], turns=False), alone.w(2))
    assert not alone.w(2).any()
    assert not robot("polar").velocity(alone.q, alone.v, "slider")[3:].any()


@pytest.mark.parametrize("i", range(1, 7))
def test_7_64_the_interorigin_vector_has_a_part_along_the_axis_and_one_along_the_normal(i: int) -> None:
    row = ELBOW.rows[i - 1]
    vector = interorigin_vector(float(row.d), ELBOW.axis(i), float(row.a), ELBOW.x(i))
    assert close(vector, array(ELBOW.between(i)(mp.mpf(0))))


@pytest.mark.parametrize("i", range(1, 7))
def test_7_65_a_single_moving_rotary_joint_rotates_only_the_part_along_the_normal(i: int) -> None:
    alone = only(ELBOW, i)
    w = joint_angular_velocity(alone.axis(i), alone.v[i - 1], turns=True)
    assert close(np.cross(w, float(alone.rows[i - 1].a) * alone.x(i)), alone.between_rate(i))


@pytest.mark.slow
@pytest.mark.parametrize("i", range(1, 7))
def test_7_66_the_rate_of_an_interorigin_vector_is_the_joints_angular_velocity_cross_the_vector(
    i: int,
) -> None:
    alone = only(ELBOW, i)
    w = joint_angular_velocity(alone.axis(i), alone.v[i - 1], turns=True)
    d_vector = array(alone.between(i)(mp.mpf(0)))
    found = interorigin_velocity(w, d_vector, alone.axis(i), alone.v[i - 1], turns=True)
    assert close(found, alone.between_rate(i))


def test_7_67_a_moving_prismatic_joint_extends_the_interorigin_vector_along_the_axis() -> None:
    alone = only(POLAR, 2)
    d_vector = array(alone.between(2)(mp.mpf(0)))
    found = interorigin_velocity(np.zeros(3), d_vector, alone.axis(2), alone.v[1], turns=False)
    assert close(found, alone.between_rate(2))
    assert close(found, alone.v[1] * alone.axis(2))


# -- all joints --------------------------------------------------------------------------------------


def test_7_68_and_7_69_a_links_angular_velocity_is_the_sum_over_the_previous_joints() -> None:
    parts = [joint_angular_velocity(ELBOW.axis(j), ELBOW.v[j - 1], turns=True) for j in range(1, 7)]
    for i in range(1, 7):
        assert close(sum(parts[:i]), ELBOW.w(i))


def test_7_70_and_7_71_a_links_angular_velocity_is_that_of_the_previous_link_plus_the_joints() -> None:
    w = w_of_links()
    for i in range(1, 7):
        own = joint_angular_velocity(ELBOW.axis(i), ELBOW.v[i - 1], turns=True)
        assert close(w[i], w[i - 1] + own)
        assert close(w[i], ELBOW.w(i))


@pytest.mark.slow
@pytest.mark.parametrize("i", range(1, 7))
def test_7_72_the_axis_rotates_with_the_previous_link_and_the_normal_with_the_link(i: int) -> None:
    row = ELBOW.rows[i - 1]
    along, normal = float(row.d) * ELBOW.axis(i), float(row.a) * ELBOW.x(i)
    parts = np.cross(ELBOW.w(i - 1), along) + np.cross(ELBOW.w(i), normal)
    assert close(parts, ELBOW.between_rate(i))
    whole = interorigin_velocity(ELBOW.w(i), along + normal, ELBOW.axis(i), ELBOW.v[i - 1], turns=True)
    assert close(whole, parts)


@pytest.mark.slow
@pytest.mark.parametrize("i", range(1, 7))
def test_7_73_the_whole_interorigin_vector_rotates_with_the_link(i: int) -> None:
    d_vector = array(ELBOW.between(i)(mp.mpf(0)))
    found = interorigin_velocity(ELBOW.w(i), d_vector, ELBOW.axis(i), ELBOW.v[i - 1], turns=True)
    assert close(found, ELBOW.between_rate(i))


def test_7_74_a_prismatic_joint_adds_the_joint_velocity_along_the_axis() -> None:
    d_vector = array(POLAR.between(2)(mp.mpf(0)))
    found = interorigin_velocity(POLAR.w(2), d_vector, POLAR.axis(2), POLAR.v[1], turns=False)
    assert close(found, POLAR.between_rate(2))


# -- the manipulator ---------------------------------------------------------------------------------


def test_7_75_and_7_76_the_last_links_angular_velocity_sums_over_all_joints() -> None:
    parts = [joint_angular_velocity(ELBOW.axis(j), ELBOW.v[j - 1], turns=True) for j in range(1, 7)]
    assert close(elbow_velocity()[3:], sum(parts))
    assert close(elbow_velocity()[3:], ELBOW.w(6))


def test_7_77_the_last_origin_is_the_sum_of_the_interorigin_vectors() -> None:
    vectors = [
        interorigin_vector(float(row.d), ELBOW.axis(i), float(row.a), ELBOW.x(i))
        for i, row in enumerate(ELBOW.rows, start=1)
    ]
    position = robot("elbow").placement(ELBOW.q, "wrist")[:3, 3]
    assert close(position, sum(vectors))
    assert close(position, ELBOW.origin(6))


def test_7_78_and_7_79_the_last_origins_velocity_is_the_sum_of_interorigin_rates() -> None:
    rates = [
        interorigin_velocity(
            ELBOW.w(i), array(ELBOW.between(i)(mp.mpf(0))), ELBOW.axis(i), ELBOW.v[i - 1], turns=True
        )
        for i in range(1, 7)
    ]
    assert close(elbow_velocity()[:3], sum(rates))
    assert close(elbow_velocity()[:3], ELBOW.vel(6))
    assert close(robot("polar").velocity(POLAR.q, POLAR.v, "slider")[:3], POLAR.vel(2))


# -- the velocity Jacobian ---------------------------------------------------------------------------


@pytest.mark.parametrize("i", range(1, 7))
def test_7_80_a_joint_contributes_joint_velocity_times_axis_cross_moment_arm(i: int) -> None:
    alone = only(ELBOW, i)
    arm = ELBOW.origin(6) - ELBOW.origin(i - 1)
    share = alone.v[i - 1] * jacobian_column(ELBOW.axis(i), arm, turns=True)
    assert close(share[:3], alone.vel(6))
    assert close(share[3:], alone.w(6))


def columns() -> FloatArray:
    arms = [ELBOW.origin(6) - ELBOW.origin(i - 1) for i in range(1, 7)]
    return np.stack([jacobian_column(ELBOW.axis(i), arms[i - 1], turns=True) for i in range(1, 7)], axis=-1)


def test_7_81_to_7_84_the_contributions_of_the_joints_sum_to_the_velocity() -> None:
    assert close(columns() @ ELBOW.v, np.concatenate((ELBOW.vel(6), ELBOW.w(6))))
    assert close(robot("elbow").jacobian(ELBOW.q, "wrist") @ ELBOW.v, elbow_velocity())


def test_7_85_a_rotary_joints_column_is_axis_cross_moment_arm_above_the_axis() -> None:
    assert close(robot("elbow").jacobian(ELBOW.q, "wrist"), columns())


def test_7_85_a_prismatic_joints_column_is_the_axis_above_zero() -> None:
    J = robot("polar").jacobian(POLAR.q, "slider")
    assert close(J[:, 1], np.concatenate((POLAR.axis(2), np.zeros(3))))
    assert close(J[:, 1], jacobian_column(POLAR.axis(2), np.zeros(3), turns=False))
    assert close(J @ POLAR.v, np.concatenate((POLAR.vel(2), POLAR.w(2))))
