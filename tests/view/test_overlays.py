"""The ellipsoid is the image of the unit ball of rates, and the arrows are the numbers at one scale."""

from __future__ import annotations

import numpy as np
import pytest

import urdfkin
from urdfkin.kinematics.rotation import rotation_of
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.view.stage import acceleration_arrows, jacobian_arrows, velocity_ellipsoid
from urdfkin.view.viewer import numbers


@pytest.fixture(scope="module")
def x() -> FrameMotion:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(0)
    v, a = rng.standard_normal((2, 1, robot.nv))
    return frame_motion(robot, (robot.sample(1, 3), v, a), robot.tip_frame)


@pytest.mark.parametrize("angular", [False, True])
def test_velocities_of_unit_rates_touch_the_ellipsoid_and_none_leaves_it(
    angular: bool, x: FrameMotion
) -> None:
    shape = velocity_ellipsoid(x, 1.0, angular=angular)
    R = rotation_of(np.roll(shape.wxyz, -1))
    J = x.jacobian[0, slice(3, 6) if angular else slice(0, 3)]
    rates = np.random.default_rng(1).standard_normal((2000, J.shape[1]))
    rates /= np.linalg.norm(rates, axis=1, keepdims=True)
    scale = 0.3 / np.linalg.svd(J, compute_uv=False)[0]
    inside = np.linalg.norm((scale * rates @ J.T @ R) / shape.half, axis=1)
    assert inside.max() <= 1.0 + 1e-12
    # Rates along the right singular vectors reach the ends of the axes.
    Vh = np.linalg.svd(J)[2]
    tips = np.linalg.norm((scale * Vh[:3] @ J.T @ R) / shape.half, axis=1)
    np.testing.assert_allclose(tips, 1.0, rtol=1e-12)


def test_a_flat_ellipsoid_can_still_be_seen() -> None:
    robot = urdfkin.load("ur5")
    zero = np.zeros((1, 6))
    shape = velocity_ellipsoid(frame_motion(robot, (zero, zero, zero), "base_link"), 2.0)
    np.testing.assert_array_equal(shape.half, 0.004)


def test_arrows_are_the_columns_and_parts_at_one_scale(x: FrameMotion) -> None:
    rates = urdfkin.load("panda").rate_names
    arrows = jacobian_arrows(x, rates, 1.0, angular=False)
    vectors = arrows.points[:, 1] - arrows.points[:, 0]
    columns = x.jacobian[0, :3].T[[rates.index(name) for name in arrows.names]]
    ratio = vectors / np.where(columns == 0.0, np.inf, columns)
    np.testing.assert_allclose(ratio[ratio != 0.0], ratio.max(), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).max(), 0.3)
    parts = acceleration_arrows(x, 1.0)
    assert parts.names[-1] == "sum"
    ends = parts.points[:, 1] - parts.points[:, 0]
    np.testing.assert_allclose(ends[:-1].sum(axis=0), ends[-1], atol=1e-12)


def test_the_words_say_the_numbers_and_what_pinocchio_says(x: FrameMotion) -> None:
    words = numbers(x)
    assert "**✓ verified** by Pinocchio" in words
    assert f"{x.placement[0, 0, 3]:.4g}" in words
