"""Misprints of the chapter, each proved: what is printed does not hold, what is meant does."""

import numpy as np

from tests.high_precision import array, column, mp, rate, turn
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame, point
from tests.text.robots import close, motion, robot
from urdfkin.kinematics.bodies import (
    analytical_jacobian,
    compose,
    jacobian_column,
    joint_angular_velocity,
    point_acceleration,
    velocity_jacobian,
)
from urdfkin.kinematics.rotation import (
    euler_rate_matrix,
    quaternion_of,
    quaternion_rates,
    rotation_about,
    skew,
)
from urdfkin.model.base_motion import BaseMotion


def test_omega_zyz_is_singular_at_pi_as_well_as_at_zero() -> None:
    for theta in (0.0, np.pi, -np.pi):
        assert abs(np.linalg.det(euler_rate_matrix("ZYZ", [0.4, theta, 1.0]))) <= ROUNDING
    for theta in (0.5, np.pi / 2, 3.0):
        determinant = np.linalg.det(euler_rate_matrix("ZYZ", [0.4, theta, 1.0]))
        assert abs(determinant + np.sin(theta)) <= ROUNDING


def test_the_exact_flow_keeps_the_quaternions_length_and_an_euler_step_does_not() -> None:
    quat, w, step = quaternion_of(rotation_about([0.6, 0.8, 0.0], 1.2)), np.array([0.0, 0.6, 0.8]), 0.1
    rates = quaternion_rates(quat, w)
    assert abs(quat @ rates) <= ROUNDING
    assert abs(np.linalg.norm(quat + step * rates) - np.sqrt(1.0 + 0.05**2)) <= ROUNDING


def test_the_vector_in_7_17_is_the_links_angular_velocity() -> None:
    theta, speed, a1 = 0.9, -1.7, 0.8
    d_01 = rotation_about([0.0, 0.0, 1.0], theta) @ [a1, 0.0, 0.0]
    exact = array(
        rate(lambda t: turn("z", mp.mpf(theta) + t * mp.mpf(speed)) * column(mp.mpf(a1), 0, 0), 0.0)
    )
    w_0, w_01 = np.zeros(3), speed * np.array([0.0, 0.0, 1.0])
    assert np.abs(skew(w_01) @ d_01 - exact).max() <= ROUNDING
    assert np.abs(skew(w_0) @ d_01 - exact).max() > 0.1


def test_the_relative_velocity_of_7_61_is_expressed_in_the_frame_before() -> None:
    first, second = frame(0), frame(1)
    both = compose(first, second)
    exact = array(rate(lambda t: ORIGINS[0](t) + ORIENTATIONS[0](t) * ORIGINS[1](t), T))
    rest = first.v_0_1 + np.cross(first.w_0_1, first.R_0_1 @ second.d_0_1)
    assert np.abs(rest + first.R_0_1 @ second.v_0_1 - exact).max() <= 32 * ROUNDING
    assert np.abs(rest + both.R_0_1 @ second.v_0_1 - exact).max() > 0.1


def test_the_kind_in_7_62_is_that_of_joint_i() -> None:
    polar = motion("polar")
    turns = [True, False]
    right = sum(joint_angular_velocity(polar.axis(i), polar.v[i - 1], turns[i - 1]) for i in (1, 2))
    wrong = sum(joint_angular_velocity(polar.axis(i), polar.v[i - 1], turns[2 - i]) for i in (1, 2))
    assert close(right, polar.w(2))
    assert not close(wrong, polar.w(2))


def test_the_moment_arm_begins_at_the_origin_on_the_joints_axis() -> None:
    elbow = motion("elbow")
    J = robot("elbow").jacobian(elbow.q, "wrist")
    for i, right in ((2, True), (2, False)):
        start = elbow.origin(i - 1) if right else elbow.origin(i)
        found = jacobian_column(elbow.axis(i), elbow.origin(6) - start, turns=True)
        assert close(found, J[:, i - 1]) is right


def test_7_121_holds_for_a_robot_that_is_not_the_elbow() -> None:
    polar = motion("polar")
    J_v, R = robot("polar").jacobian(polar.q, "slider"), polar.rotation(2)
    # ZYZ angles are singular for a robot that turns about z alone; rpy are not.
    assert close(velocity_jacobian("xyz", R, analytical_jacobian("xyz", R, J_v)), J_v)
    assert J_v.shape != (6, 6)


def test_coriolis_is_perpendicular_to_the_velocity_as_frame_0_sees_it() -> None:
    v_1 = array(rate(point, T))
    coriolis = point_acceleration(frame(0), array(point(mp.mpf(T))), v_1).coriolis
    assert abs(coriolis @ (frame(0).R_0_1 @ v_1)) <= 64 * ROUNDING
    assert abs(coriolis @ v_1) > 0.1


def test_a_base_at_rest_has_no_angular_acceleration_either() -> None:
    still, turning = np.zeros(6), BaseMotion(acceleration=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    elbow = motion("elbow")
    assert not robot("elbow").acceleration(elbow.q, still, still, "wrist", base=BaseMotion()).any()
    assert np.abs(robot("elbow").acceleration(elbow.q, still, still, "wrist", base=turning)).max() > 0.1
