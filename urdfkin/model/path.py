"""Poses and Jacobian of a path that consists of constant poses and elementary motions.

`T(x) = C_0 E_1(x_1) C_1 E_2(x_2) ...`

Each C_k is a constant pose. Each E_k is one of the motions Rx, Ry, Rz, Tx, Ty and Tz by the amount x_k.
Chains, Denavit-Hartenberg tables, screws, and the models of `dh --compare` and `calibrate` have this form.
The amounts x_k (rad or m) are joint values, cells of a table, or parameters. Let p be the position of the
path's end. The derivative of the end's pose with respect to x_k is a twist (dp/dx_k, w). Let e be the
direction of the axis of E_k, and O a point of this axis, both in the first frame of the path. The twist is:

| motion | dp/dx_k | w |
|---|---|---|
| rotation | `e x (p - O)` | `e` |
| translation | `e` | 0 |

This twist is a column of the Jacobian in equation 7.85.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import check_range
from urdfkin.kinematics.number_kinds import array_equations as eq
from urdfkin.kinematics.rotation import coordinate_rotation
from urdfkin.model.tree import FloatArray

_IDENTITY = np.eye(4)


@dataclass(frozen=True, slots=True)
class ElementaryMotion:
    """A rotation about, or translation along, a coordinate axis."""

    axis: int  #: 0 for x, 1 for y, 2 for z.
    turns: bool


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """A product of constant poses and elementary motions.

    The amounts (..., motions) are angles (rad) or distances (m).

    >>> arm = Path((ElementaryMotion(2, turns=True), elementary_pose(0, False, 2.0)))
    >>> arm.poses([np.pi / 2])[:3, 3].round(12).tolist()
    [0.0, 2.0, 0.0]
    >>> arm.pose_and_jacobian([0.0])[1].ravel().tolist()
    [0.0, 2.0, 0.0, 0.0, 0.0, 1.0]
    """

    steps: tuple[FloatArray | ElementaryMotion, ...]

    def finite_frames(self, amounts: ArrayLike) -> FloatArray:
        """Return `frames`, or raise RangeError if a result is not finite."""
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            return check_range(self.frames(amounts))

    def frames(self, amounts: ArrayLike) -> FloatArray:
        """Return the poses (..., steps, 4, 4) after each step."""
        amounts = np.asarray(amounts, np.float64)
        frames = np.empty((*amounts.shape[:-1], len(self.steps), 4, 4))
        for i, T in enumerate(self._after_each_step(amounts)):
            frames[..., i, :, :] = T
        return frames

    def _after_each_step(self, amounts: FloatArray) -> Iterator[FloatArray]:
        """Yield poses that may share memory."""
        # A motion that is 0 in all samples is skipped.
        moving = np.asarray(amounts.any(axis=tuple(range(amounts.ndim - 1))))
        T: FloatArray = np.broadcast_to(_IDENTITY, (*amounts.shape[:-1], 4, 4))
        k = 0
        for step in self.steps:
            if isinstance(step, ElementaryMotion):
                if moving[k]:
                    T = _apply_motion(T, step, amounts[..., k])
                k += 1
            else:
                T = T @ step
            yield T

    def poses(self, amounts: ArrayLike) -> FloatArray:
        """Return the poses (..., 4, 4) at the path's end."""
        amounts = np.asarray(amounts, np.float64)
        T: FloatArray = np.broadcast_to(_IDENTITY, (*amounts.shape[:-1], 4, 4))
        for T in self._after_each_step(amounts):  # noqa: B007
            pass
        return np.array(T)

    def pose_and_jacobian(self, amounts: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the end's pose (..., 4, 4) and Jacobian (..., 6, motions), [linear; angular]."""
        return self.pose_and_jacobian_from_frames(self.frames(amounts))

    def pose_and_jacobian_from_frames(self, frames: FloatArray) -> tuple[FloatArray, FloatArray]:
        T = frames[..., -1, :, :]
        motions = [(i, step) for i, step in enumerate(self.steps) if isinstance(step, ElementaryMotion)]
        # The axis of a motion has the same components in the frames before and after the motion.
        at = [i for i, _ in motions]
        axes = frames[..., at, :3, [step.axis for _, step in motions]]
        columns = np.zeros((*T.shape[:-2], 6, len(motions)))
        columns[..., :3, :] = np.moveaxis(axes, 0, -1)
        turning = [k for k, (_, step) in enumerate(motions) if step.turns]
        arms = T[..., :3, 3] - frames[..., [at[k] for k in turning], :3, 3]
        linear, angular = eq.turning_column(axes[turning], arms)
        columns[..., :3, turning] = np.moveaxis(linear, 0, -1)
        columns[..., 3:, turning] = np.moveaxis(angular, 0, -1)
        return T, columns


def elementary_pose(axis: int, turns: bool, amount: ArrayLike) -> FloatArray:
    amount = np.asarray(amount, np.float64)
    T = np.tile(_IDENTITY, (*amount.shape, 1, 1))
    return _apply_motion(T, ElementaryMotion(axis, turns), amount) if amount.any() else T


def _apply_motion(T: FloatArray, motion: ElementaryMotion, amount: FloatArray) -> FloatArray:
    moved = np.array(T)
    if motion.turns:
        moved[..., :3, :3] = T[..., :3, :3] @ coordinate_rotation(motion.axis, amount)
    else:
        moved[..., :3, 3] += amount[..., np.newaxis] * T[..., :3, motion.axis]
    return moved
