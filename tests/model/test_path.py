"""A path's frames and columns, from products of matrices and difference quotients."""

from __future__ import annotations

import numpy as np

from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.model.path import Motion, Path, elementary
from urdfkin.model.tree import pose

A = pose(exp_rotation([0.3, -0.4, 0.5]), [0.1, 0.2, 0.3])
MOTIONS = tuple(Motion(axis, turns) for turns in (True, False) for axis in range(3))
PATH = Path((A, *(step for motion in MOTIONS for step in (motion, A))))
AMOUNTS = np.random.default_rng(0).uniform(-1.0, 1.0, (4, len(MOTIONS)))


def test_the_frames_of_a_path_are_the_products_of_its_steps() -> None:
    T, frames = np.broadcast_to(A, (4, 4, 4)), PATH.frames(AMOUNTS)
    for k, motion in enumerate(MOTIONS):
        T = T @ elementary(motion.axis, motion.turns, AMOUNTS[:, k])
        np.testing.assert_allclose(frames[:, 2 * k + 1], T, atol=1e-15)
        T = T @ A
        np.testing.assert_allclose(frames[:, 2 * k + 2], T, atol=1e-15)


def test_the_columns_of_a_path_are_difference_quotients() -> None:
    poses, columns = PATH.columns(AMOUNTS)
    for k in range(len(MOTIONS)):
        step = 1e-6 * np.eye(len(MOTIONS))[k]
        before, after = PATH.poses(AMOUNTS - step), PATH.poses(AMOUNTS + step)
        turn = log_rotation(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2))
        quotient = np.hstack([(after - before)[:, :3, 3], turn]) / 2e-6
        np.testing.assert_allclose(columns[:, :, k], quotient, atol=1e-9)
    np.testing.assert_array_equal(poses, PATH.poses(AMOUNTS))


def test_a_motion_by_zero_changes_nothing() -> None:
    zero = Path((A, *MOTIONS)).poses(np.zeros(len(MOTIONS)))
    np.testing.assert_array_equal(zero, A)
