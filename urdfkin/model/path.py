"""A path: a product of constant poses and elementary motions. The module computes its poses and its Jacobian.

    T(x) = C_0 E_1(x_1) C_1 E_2(x_2) ...,      E_k = Rx, Ry, Rz, Tx, Ty or Tz of the amount x_k

Chains, Denavit-Hartenberg tables, screws, and the models that `dh --compare` and `calibrate` fit have this
form. Only the meaning of the amounts x_k differs: joint values, cells of a table, or parameters. The
derivative of the pose at the path's end with respect to an amount is a twist. Let e be the axis of the motion
and O a point of this axis, in the frame before the path. The twist is then

    rotation   dp/dx = e x (p - O),   w = e;       translation   dp/dx = e,   w = 0

This twist is a column of the Jacobian in equation 7.85.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.number_kinds import array_equations as eq
from urdfkin.kinematics.rotation import coordinate_rotation
from urdfkin.model.tree import FloatArray


@dataclass(frozen=True, slots=True)
class Motion:
    """A rotation about, or a translation along, a coordinate axis of the current frame.

    Attributes:
        axis: The axis: 0, 1 or 2.
        turns: Whether the motion is a rotation.
    """

    axis: int
    turns: bool


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """A product of constant poses and elementary motions.

    Attributes:
        steps: Constant poses (4, 4) and motions, first to last.

    Example:
        >>> arm = Path((Motion(2, turns=True), elementary(0, False, 2.0)))
        >>> arm.poses([np.pi / 2])[:3, 3].round(12).tolist()
        [0.0, 2.0, 0.0]
        >>> arm.columns([0.0])[1].ravel().tolist()
        [0.0, 2.0, 0.0, 0.0, 0.0, 1.0]
    """

    steps: tuple[FloatArray | Motion, ...]

    def frames(self, amounts: ArrayLike) -> FloatArray:
        """Return the poses (..., steps, 4, 4) after each step, for amounts (..., motions) in rad or m."""
        amounts = np.asarray(amounts, np.float64)
        frames = np.empty((*amounts.shape[:-1], len(self.steps), 4, 4))
        T: FloatArray = np.broadcast_to(np.eye(4), (*amounts.shape[:-1], 4, 4))
        k = 0
        for i, step in enumerate(self.steps):
            if isinstance(step, Motion):
                T = _moved(T, step, amounts[..., k])
                k += 1
            else:
                T = T @ step
            frames[..., i, :, :] = T
        return frames

    def poses(self, amounts: ArrayLike) -> FloatArray:
        """Return the pose (..., 4, 4) at the end of the path for amounts (..., motions)."""
        return np.ascontiguousarray(self.frames(amounts)[..., -1, :, :])

    def columns(self, amounts: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the pose at the path's end, and its Jacobian (..., 6, motions), [linear; angular].

        Each column is the derivative with respect to one amount.
        """
        frames = self.frames(amounts)
        T = frames[..., -1, :, :]
        motions = [(i, step) for i, step in enumerate(self.steps) if isinstance(step, Motion)]
        # A motion does not move its own axis, so the frame after the motion also contains the axis.
        columns = np.zeros((*T.shape[:-2], 6, len(motions)))
        for k, (i, step) in enumerate(motions):
            axis = frames[..., i, :3, step.axis]
            linear = axis
            if step.turns:
                linear, columns[..., 3:, k] = eq.turning_column(axis, T[..., :3, 3] - frames[..., i, :3, 3])
            columns[..., :3, k] = linear
        return T, columns


def elementary(axis: int, turns: bool, amount: ArrayLike) -> FloatArray:
    """Return the poses (..., 4, 4) of a rotation about a coordinate axis, or of a translation along it.

    The amounts (...) are angles in rad or distances in m.
    """
    amount = np.asarray(amount, np.float64)
    return _moved(np.tile(np.eye(4), (*amount.shape, 1, 1)), Motion(axis, turns), amount)


def _moved(T: FloatArray, motion: Motion, amount: FloatArray) -> FloatArray:
    """Return poses (..., 4, 4) multiplied by the elementary motion with amounts (...)."""
    if not amount.any():  # an amount of zero changes nothing, and many cells of a table are zero
        return T
    moved = np.array(T)
    if motion.turns:
        moved[..., :3, :3] = T[..., :3, :3] @ coordinate_rotation(motion.axis, amount)
    else:
        moved[..., :3, 3] += amount[..., np.newaxis] * T[..., :3, motion.axis]
    return moved
