"""Section 7.7: accelerations of the text's robots, equations 7.126 to 7.130, and a moving base."""

import numpy as np
import pytest

from tests.high_precision import array, mp
from tests.text.robots import Motion, close, motion, robot
from urdfkin.kinematics.bodies import interorigin_velocity, joint_angular_velocity
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.base_motion import BaseMotion

ELBOW, POLAR, PLANAR = motion("elbow", 8), motion("polar", 9), motion("planar_two_link", 10)
ENDS = {"elbow": "wrist", "polar": "slider", "planar_two_link": "tip"}
LINKS = {
    "elbow": ("trunk", "upper_arm", "elbow_link", "forearm", "wrist_pitch", "wrist"),
    "polar": ("arm", "slider"),
}


def end_acceleration(moving: Motion) -> FloatArray:
    return robot(moving.name).acceleration(moving.q, moving.v, moving.a, ENDS[moving.name])


@pytest.mark.parametrize("moving", [ELBOW, POLAR, PLANAR], ids=lambda moving: moving.name)
def test_7_126_the_acceleration_is_J_a_and_the_jacobians_rate_times_v(moving: Motion) -> None:
    n = len(moving.rows)
    J = robot(moving.name).jacobian(moving.q, ENDS[moving.name])
    J_rate = robot(moving.name).jacobian_rate(moving.q, moving.v, ENDS[moving.name])
    exact = np.concatenate((moving.acc(n), moving.alpha(n)))
    assert close(J @ moving.a + J_rate @ moving.v, exact, 16.0)


def test_7_127_angular_velocity_goes_from_link_to_link() -> None:
    for moving, turning in ((ELBOW, [True] * 6), (POLAR, [True, False])):
        w = robot(moving.name).velocity(moving.q, moving.v, LINKS[moving.name])[:, 3:]
        before = np.zeros(3)
        for i, turns in enumerate(turning, start=1):
            assert close(w[i - 1], before + joint_angular_velocity(moving.axis(i), moving.v[i - 1], turns))
            assert close(w[i - 1], moving.w(i))
            before = w[i - 1]


@pytest.mark.slow
def test_7_128_and_so_does_linear_velocity() -> None:
    for moving, turning in ((ELBOW, [True] * 6), (POLAR, [True, False])):
        vel = np.zeros(3)
        for i, turns in enumerate(turning, start=1):
            d_vector = array(moving.between(i)(mp.mpf(0)))
            vel = vel + interorigin_velocity(moving.w(i), d_vector, moving.axis(i), moving.v[i - 1], turns)
            assert close(vel, moving.vel(i), 4.0)
        assert close(robot(moving.name).velocity(moving.q, moving.v, ENDS[moving.name])[:3], vel, 4.0)


@pytest.mark.slow
def test_7_129_angular_acceleration_gains_a_term_where_a_turning_link_carries_an_axis() -> None:
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
def test_7_130_linear_acceleration_of_a_rotary_chain() -> None:
    acc = np.zeros(3)
    for i in range(1, 7):
        d = array(ELBOW.between(i)(mp.mpf(0)))
        acc = acc + np.cross(ELBOW.alpha(i), d) + np.cross(ELBOW.w(i), np.cross(ELBOW.w(i), d))
        assert close(acc, ELBOW.acc(i), 16.0)
    assert close(end_acceleration(ELBOW)[:3], ELBOW.acc(6), 16.0)


def test_7_130_a_slide_adds_its_acceleration_and_twice_the_cross_product() -> None:
    d, z, w = array(POLAR.between(2)(mp.mpf(0))), POLAR.axis(2), POLAR.w(1)
    acc = np.cross(POLAR.alpha(2), d) + np.cross(w, np.cross(w, d))
    acc = acc + POLAR.a[1] * z + 2.0 * POLAR.v[1] * np.cross(w, z)
    assert close(acc, POLAR.acc(2), 8.0)
    assert close(end_acceleration(POLAR)[:3], POLAR.acc(2), 8.0)


def test_7_130_every_part_of_the_breakdown_has_its_name() -> None:
    parts = robot("polar").acceleration_breakdown(POLAR.q, POLAR.v, POLAR.a, "slider")
    z0, z1, d = POLAR.axis(1), POLAR.axis(2), POLAR.origin(2)
    transverse, centripetal, coriolis, sliding = parts.by_kind[:, :3]
    assert close(transverse, POLAR.a[0] * np.cross(z0, d), 4.0)
    assert close(centripetal, -(POLAR.v[0] ** 2) * d, 4.0)
    assert close(coriolis, 2.0 * POLAR.v[0] * POLAR.v[1] * np.cross(z0, z1), 4.0)
    assert close(sliding, POLAR.a[1] * z1, 4.0)
    assert close(parts.total[:3], POLAR.acc(2), 8.0)


def test_a_moving_base_supplies_the_initial_conditions() -> None:
    # Frame -1 of the text: the base turns about an axis and falls, and the polar robot goes on as before.
    generator = np.random.default_rng(11)
    R, p = exp_rotation([0.3, -0.4, 0.5]), np.array([0.2, 0.1, 0.7])
    w, vel, alpha, acc = generator.normal(size=(4, 3))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    base = BaseMotion(T, np.concatenate((vel, w)), np.concatenate((acc, alpha)))
    d, d_rate, d_rate_rate = (R @ x for x in (POLAR.origin(2), POLAR.vel(2), POLAR.acc(2)))
    expected = (
        acc + np.cross(alpha, d) + np.cross(w, np.cross(w, d)) + 2.0 * np.cross(w, d_rate) + d_rate_rate
    )
    found = robot("polar").acceleration(POLAR.q, POLAR.v, POLAR.a, "slider", base=base)
    assert close(found[:3], expected, 16.0)
    assert close(found[3:], alpha + R @ POLAR.alpha(2) + np.cross(w, R @ POLAR.w(2)), 16.0)


def test_the_initial_conditions_of_a_base_at_rest_are_zero() -> None:
    # The text prints "w-dot_{-1,0}" without "= 0": the list of initial conditions ends in the middle.
    still = robot("elbow").acceleration(ELBOW.q, np.zeros(6), np.zeros(6), "base")
    assert not still.any()
    assert np.array_equal(
        robot("elbow").acceleration(ELBOW.q, ELBOW.v, ELBOW.a, "wrist", base=BaseMotion()),
        end_acceleration(ELBOW),
    )
