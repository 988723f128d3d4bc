"""`integrate` and `difference`: Pinocchio's, and each undoes the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio
import pytest

import urdfkin
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue

EPS = np.finfo(float).eps
#: A robot without followers for each kind of joint: continuous ones, and what it hangs from.
SUBJECTS = [("kinova", None), ("a1", "floating"), ("a1", "planar")]


def both(name: str, root: str | None) -> tuple[Robot, Any]:
    roots = {"floating": pinocchio.JointModelFreeFlyer, "planar": pinocchio.JointModelPlanar}
    path = str(catalogue()[name].path)
    model = pinocchio.buildModelFromUrdf(path, *([roots[root]()] if root else []))
    return urdfkin.load(name, root_joint=root, verify=False), model


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.49, 0.51, 2.5])
@pytest.mark.parametrize(("name", "root"), SUBJECTS)
def test_a_step_is_pinocchios_and_its_difference_leads_back(name: str, root: str | None, size: float) -> None:
    robot, model = both(name, root)
    q = robot.sample(20, seed=3)
    v = np.random.default_rng(4).uniform(-1.0, 1.0, (20, robot.nv))
    v *= size / np.abs(v).max(axis=1, keepdims=True)
    if root == "floating":
        v[:, 3:6] *= min(1.0, 3.0 / np.linalg.norm(v[:, 3:6], axis=1).max())
    ahead = robot.integrate(q, v)
    theirs = np.array(
        [pinocchio.integrate(model, *pair) for pair in zip(robot.to_pinocchio(q), v, strict=True)]
    )
    assert same_pose(robot.to_pinocchio(ahead), theirs) < 64 * EPS * (1.0 + np.abs(theirs).max())
    back = robot.difference(q, ahead)
    np.testing.assert_allclose(back, v, rtol=0.0, atol=256 * EPS * (4.0 + size))
    pairs = zip(robot.to_pinocchio(q), robot.to_pinocchio(ahead), strict=True)
    theirs = np.array([pinocchio.difference(model, *pair) for pair in pairs])
    # Pinocchio's logarithms give some digits away near 0.
    np.testing.assert_allclose(back, theirs, rtol=0.0, atol=1e-9)


def same_pose(ours: FloatArray, theirs: FloatArray) -> float:
    """How far two of Pinocchio's configurations are apart, where a quaternion's negative is the same."""
    flipped = theirs.copy()
    flipped[:, 3:7] *= -1.0
    apart = np.minimum(np.abs(ours - theirs).max(axis=1), np.abs(ours - flipped).max(axis=1))
    return float(apart.max())


@pytest.mark.parametrize(("name", "root"), SUBJECTS)
def test_small_steps_at_constant_rates_are_one_large_one(name: str, root: str | None) -> None:
    robot, _ = both(name, root)
    q, v = robot.sample(5, seed=1), np.random.default_rng(2).uniform(-1.0, 1.0, (5, robot.nv))
    walked = q
    for _ in range(8):
        walked = robot.integrate(walked, v / 8.0)
    np.testing.assert_allclose(robot.difference(robot.integrate(q, v), walked), 0.0, atol=1e-13)


def test_the_frames_velocity_is_the_difference_quotient_along_a_step() -> None:
    robot, _ = both("a1", "floating")
    q, v = robot.sample(1, seed=5)[0], np.random.default_rng(6).uniform(-1.0, 1.0, robot.nv)
    h = 1e-5
    ends = (robot.placement(robot.integrate(q, sign * h * v), "FL_foot")[:3, 3] for sign in (1.0, -1.0))
    ahead, behind = ends
    np.testing.assert_allclose((ahead - behind) / (2 * h), robot.velocity(q, v, "FL_foot")[:3], atol=1e-8)


def test_batches_broadcast_or_are_refused() -> None:
    robot, _ = both("a1", "planar")
    q, v = robot.sample(4), np.ones((3, 1, robot.nv))
    assert robot.integrate(q, v).shape == (3, 4, robot.nq)
    assert robot.difference(q, robot.neutral()).shape == (4, robot.nv)
    with pytest.raises(urdfkin.InputError, match="the batch shapes do not fit"):
        robot.integrate(q, np.ones((3, robot.nv)))


def test_a_wheel_counts_its_turns_and_goes_back_the_shortest_way() -> None:
    robot, _ = both("kinova", None)
    wheel = robot.coordinate_names.index("j2s6s200_joint_1")
    turned = robot.integrate("neutral", "neutral, j2s6s200_joint_1=350deg/s")
    assert turned[wheel] == pytest.approx(np.radians(350.0))
    assert robot.difference("neutral", turned)[wheel] == pytest.approx(np.radians(-10.0))
