"""Sections 7.5 to 7.7: the manipulator Jacobian and accelerations, equations 7.116 to 7.130."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.high_precision import array, column, mp, rate, second_rate
from tests.kinematics.rotation import strategies
from tests.kinematics.rotation.strategies import ROUNDING
from tests.moving import ORIENTATIONS, ORIGINS, T, frame, point
from tests.text.robots import Motion, close, motion, only, robot
from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics.bodies import (
    MovingFrame,
    analytical_jacobian,
    interorigin_velocity,
    joint_angular_velocity,
    planar_rotation_derivative,
    point_acceleration,
    point_velocity,
    pose_rate_matrix,
    pose_rates,
    velocity_jacobian,
    velocity_of_pose_rates,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import euler_of, euler_rate_matrix, exp_rotation, rotation_about
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import pose as pose_of

MOVING = motion("elbow", 7)
R_06 = MOVING.rotation(6)


def pose(moving: Motion, t: Any) -> Any:
    """Return X = (x1, x2, x3, phi, theta, psi), the position and ZYZ angles of frame 6."""
    R, d = moving.R(6)(t), moving.d(6)(t)
    theta = mp.atan2(mp.sqrt(R[0, 2] ** 2 + R[1, 2] ** 2), R[2, 2])
    phi, psi = mp.atan2(R[1, 2], R[0, 2]), mp.atan2(R[2, 1], -R[2, 0])
    return column(d[0], d[1], d[2], phi, theta, psi)


def derivative_by_joint(j: int) -> FloatArray:
    """Return column j of f's derivative: the rates of x if only joint j moves, divided by its velocity."""
    alone = only(MOVING, j)
    slope: FloatArray = array(rate(lambda t: pose(alone, t), 0.0)) / alone.v[j - 1]
    return slope


def velocity() -> FloatArray:
    return robot("elbow").velocity(MOVING.q, MOVING.v, "wrist")


def test_7_116_and_7_117_the_rates_of_x_are_the_manipulator_jacobian_times_joint_velocities() -> None:
    x_rate = array(rate(lambda t: pose(MOVING, t), 0.0))
    J = robot("elbow").analytical_jacobian(MOVING.q, "wrist", "ZYZ")
    assert close(J @ MOVING.v, x_rate, 8.0)


@pytest.mark.parametrize("j", range(1, 7))
def test_7_118_the_elements_of_the_manipulator_jacobian_are_derivatives_by_each_joint(j: int) -> None:
    J = robot("elbow").analytical_jacobian(MOVING.q, "wrist", "ZYZ")
    assert close(J[:, j - 1], derivative_by_joint(j), 8.0)


def test_7_119_C_converts_the_rates_of_x_to_velocities() -> None:
    x_rate = array(rate(lambda t: pose(MOVING, t), 0.0))
    assert close(velocity_of_pose_rates("ZYZ", R_06, x_rate), velocity(), 8.0)
    assert close(pose_rates("ZYZ", R_06, velocity()), x_rate, 8.0)


def test_7_120_C_has_the_identity_and_omega_on_its_diagonal() -> None:
    C = pose_rate_matrix("ZYZ", R_06)
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
    assert close(J, np.linalg.solve(pose_rate_matrix("ZYZ", R_06), J_v), 16.0)
    assert close(J @ MOVING.v, array(rate(lambda t: pose(MOVING, t), 0.0)), 8.0)


def test_7_122_a_singular_omega_is_refused_and_a_quaternion_has_no_singularity() -> None:
    # In the zero configuration, theta is 0, which is a singularity of the ZYZ angles.
    with pytest.raises(RepresentationSingularityError, match="ZYZ"):
        robot("elbow").analytical_jacobian(np.zeros(6), "wrist", "ZYZ")
    assert robot("elbow").analytical_jacobian(np.zeros(6), "wrist", "quaternion").shape == (7, 6)


# -- section 7.6: acceleration of points, equations 7.123 to 7.125, example 7.4 --------------------


def moving(t: Any) -> Any:
    return ORIGINS[0](t) + ORIENTATIONS[0](t) * point(t)


agree = partial(strategies.close, room=64.0)


def test_7_123_a_fixed_point_has_a_transverse_and_a_centripetal_acceleration() -> None:
    p_1 = column(1, mp.mpf(1) / 2, -2)
    parts = point_acceleration(frame(0), array(p_1))
    assert agree(
        parts.total, array(second_rate(lambda t: ORIGINS[0](t) + ORIENTATIONS[0](t) * p_1, T)), room=256
    )
    assert not parts.coriolis.any()
    assert not parts.relative.any()
    p_0 = frame(0).R_0_1 @ array(p_1)
    assert agree(parts.transverse, np.cross(frame(0).alpha_0_1, p_0))
    # The identity w x (w x p) = w (w . p) - p (w . w) gives an independent result.
    w = frame(0).w_0_1
    assert agree(parts.centripetal, w * (w @ p_0) - p_0 * (w @ w), room=256)


def test_7_124_the_velocity_of_a_moving_point_includes_the_relative_velocity() -> None:
    velocity = point_velocity(frame(0), array(point(mp.mpf(T))), array(rate(point, T)))
    assert agree(velocity.total, array(rate(moving, T)))
    assert agree(velocity.relative, frame(0).R_0_1 @ array(rate(point, T)))


def test_7_125_the_acceleration_of_a_moving_point_includes_coriolis_and_relative_terms() -> None:
    p_1, v_1, a_1 = array(point(mp.mpf(T))), array(rate(point, T)), array(second_rate(point, T))
    parts = point_acceleration(frame(0), p_1, v_1, a_1)
    assert agree(parts.total, array(second_rate(moving, T)), room=256)
    # The Coriolis term is perpendicular to w and to the relative velocity, as seen in frame 0.
    assert abs(parts.coriolis @ frame(0).w_0_1) <= 64 * ROUNDING
    assert abs(parts.coriolis @ (frame(0).R_0_1 @ v_1)) <= 64 * ROUNDING


def test_example_7_4_motion_in_the_plane_points_inwards_and_along_the_tangent() -> None:
    theta, rate_1, rate_rate = 0.7, 1.6, -2.2
    p_1 = np.array([0.5, -0.3, 0.0])
    z = np.array([0.0, 0.0, 1.0])
    R = rotation_about(z, theta)
    turning = MovingFrame(R, np.zeros(3), rate_1 * z, np.zeros(3), rate_rate * z)
    parts = point_acceleration(turning, p_1)
    assert agree(parts.centripetal, -(rate_1**2) * R @ p_1)
    assert agree(parts.transverse[:2], rate_rate * planar_rotation_derivative(theta) @ p_1[:2])
    assert agree(parts.transverse, rate_rate * rotation_about(z, theta + np.pi / 2) @ p_1)


# -- section 7.7: accelerations of robots, equations 7.126 to 7.130 --------------------------------


ELBOW, POLAR, PLANAR = motion("elbow", 8), motion("polar", 9), motion("planar_two_link", 10)
ENDS = {"elbow": "wrist", "polar": "slider", "planar_two_link": "tip"}
LINKS = {
    "elbow": ("trunk", "upper_arm", "elbow_link", "forearm", "wrist_pitch", "wrist"),
    "polar": ("arm", "slider"),
}


def end_acceleration(moving: Motion) -> FloatArray:
    return robot(moving.name).acceleration(moving.q, moving.v, moving.a, ENDS[moving.name])


@pytest.mark.parametrize("moving", [ELBOW, POLAR, PLANAR], ids=lambda moving: moving.name)
def test_7_126_the_acceleration_is_J_a_plus_the_jacobian_rate_times_v(moving: Motion) -> None:
    n = len(moving.rows)
    J = robot(moving.name).jacobian(moving.q, ENDS[moving.name])
    J_rate = robot(moving.name).jacobian_rate(moving.q, moving.v, ENDS[moving.name])
    exact = np.concatenate((moving.acc(n), moving.alpha(n)))
    assert close(J @ moving.a + J_rate @ moving.v, exact, 16.0)


def test_7_127_angular_velocity_is_computed_recursively_from_link_to_link() -> None:
    for moving, turning in ((ELBOW, [True] * 6), (POLAR, [True, False])):
        w = robot(moving.name).velocity(moving.q, moving.v, LINKS[moving.name])[:, 3:]
        before = np.zeros(3)
        for i, turns in enumerate(turning, start=1):
            assert close(w[i - 1], before + joint_angular_velocity(moving.axis(i), moving.v[i - 1], turns))
            assert close(w[i - 1], moving.w(i))
            before = w[i - 1]


@pytest.mark.slow
def test_7_128_linear_velocity_is_computed_recursively_from_link_to_link() -> None:
    for moving, turning in ((ELBOW, [True] * 6), (POLAR, [True, False])):
        vel = np.zeros(3)
        for i, turns in enumerate(turning, start=1):
            d_vector = array(moving.between(i)(mp.mpf(0)))
            vel = vel + interorigin_velocity(moving.w(i), d_vector, moving.axis(i), moving.v[i - 1], turns)
            assert close(vel, moving.vel(i), 4.0)
        assert close(robot(moving.name).velocity(moving.q, moving.v, ENDS[moving.name])[:3], vel, 4.0)


@pytest.mark.slow
def test_7_129_the_recursion_of_angular_acceleration_includes_the_rotation_of_the_joint_axis() -> None:
    alphas = robot("elbow").acceleration(ELBOW.q, ELBOW.v, ELBOW.a, LINKS["elbow"])[:, 3:]
    before = np.zeros(3)
    for i in range(1, 7):
        z = ELBOW.axis(i)
        before = before + ELBOW.a[i - 1] * z + ELBOW.v[i - 1] * np.cross(ELBOW.w(i - 1), z)
        assert close(alphas[i - 1], before, 8.0)
        assert close(alphas[i - 1], ELBOW.alpha(i), 8.0)
    slider = robot("polar").acceleration(POLAR.q, POLAR.v, POLAR.a, "slider")[3:]
    assert close(slider, POLAR.alpha(1))


@pytest.mark.slow
def test_7_130_linear_acceleration_of_a_rotary_chain_is_computed_recursively() -> None:
    acc = np.zeros(3)
    for i in range(1, 7):
        d = array(ELBOW.between(i)(mp.mpf(0)))
        acc = acc + np.cross(ELBOW.alpha(i), d) + np.cross(ELBOW.w(i), np.cross(ELBOW.w(i), d))
        assert close(acc, ELBOW.acc(i), 16.0)
    assert close(end_acceleration(ELBOW)[:3], ELBOW.acc(6), 16.0)


def test_7_130_a_prismatic_joint_adds_joint_acceleration_and_coriolis_acceleration() -> None:
    d, z, w = array(POLAR.between(2)(mp.mpf(0))), POLAR.axis(2), POLAR.w(1)
    acc = np.cross(POLAR.alpha(2), d) + np.cross(w, np.cross(w, d))
    acc = acc + POLAR.a[1] * z + 2.0 * POLAR.v[1] * np.cross(w, z)
    assert close(acc, POLAR.acc(2), 8.0)
    assert close(end_acceleration(POLAR)[:3], POLAR.acc(2), 8.0)


def test_7_130_each_part_of_the_breakdown_has_the_value_of_a_named_term() -> None:
    parts = robot("polar").acceleration_breakdown(POLAR.q, POLAR.v, POLAR.a, "slider")
    z0, z1, d = POLAR.axis(1), POLAR.axis(2), POLAR.origin(2)
    transverse, centripetal, coriolis, sliding = parts.by_kind[:, :3]
    assert close(transverse, POLAR.a[0] * np.cross(z0, d), 4.0)
    assert close(centripetal, -(POLAR.v[0] ** 2) * d, 4.0)
    assert close(coriolis, 2.0 * POLAR.v[0] * POLAR.v[1] * np.cross(z0, z1), 4.0)
    assert close(sliding, POLAR.a[1] * z1, 4.0)
    assert close(parts.total[:3], POLAR.acc(2), 8.0)


def test_the_motion_of_the_base_is_the_initial_condition_of_the_recursion() -> None:
    # Frame -1 of the textbook: the base rotates and falls, while the polar robot moves as before.
    generator = np.random.default_rng(11)
    R, p = exp_rotation([0.3, -0.4, 0.5]), np.array([0.2, 0.1, 0.7])
    w, vel, alpha, acc = generator.normal(size=(4, 3))
    base = BaseMotion(pose_of(R, p), np.concatenate((vel, w)), np.concatenate((acc, alpha)))
    d, d_rate, d_rate_rate = (R @ x for x in (POLAR.origin(2), POLAR.vel(2), POLAR.acc(2)))
    expected = (
        acc + np.cross(alpha, d) + np.cross(w, np.cross(w, d)) + 2.0 * np.cross(w, d_rate) + d_rate_rate
    )
    found = robot("polar").acceleration(POLAR.q, POLAR.v, POLAR.a, "slider", base=base)
    assert close(found[:3], expected, 16.0)
    assert close(found[3:], alpha + R @ POLAR.alpha(2) + np.cross(w, R @ POLAR.w(2)), 16.0)
