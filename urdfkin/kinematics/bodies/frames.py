"""A frame that moves in another, and rows of such frames.

Sections 7.3 and 7.6, equations 7.58 to 7.61, 7.49 and 7.125.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from functools import reduce

import numpy as np

from urdfkin.kinematics.arrays import chapter as eq
from urdfkin.kinematics.inputs import FloatArray, rotations, vectors


@dataclass(frozen=True, slots=True, eq=False)
class MovingFrame:
    """Where frame 1 is in frame 0 and how it moves, everything expressed in frame 0.

    Attributes:
        R_0_1: (..., 3, 3) orientation.
        d_0_1: (..., 3) interorigin vector from O_0 to O_1, metres.
        w_0_1: (..., 3) angular velocity, rad/s.
        v_0_1: (..., 3) rate of `d_0_1`, m/s.
        alpha_0_1: (..., 3) angular acceleration, rad/s^2.
        a_0_1: (..., 3) rate of `v_0_1`, m/s^2.

    Raises:
        InputError: a shape, a value that is not finite, or `R_0_1` is no rotation.
    """

    R_0_1: FloatArray
    d_0_1: FloatArray
    w_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    v_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    alpha_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    a_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for entry in fields(self):
            check = rotations if entry.name == "R_0_1" else vectors
            array = np.array(check(getattr(self, entry.name), entry.name), order="C")
            array.setflags(write=False)
            object.__setattr__(self, entry.name, array)


def turned(R: FloatArray, p: FloatArray) -> FloatArray:
    """R p for (..., 3, 3) and (..., 3)."""
    return (R @ p[..., np.newaxis])[..., 0]


def compose(outer: MovingFrame, inner: MovingFrame) -> MovingFrame:
    """Frame 2 in frame 0, from frame 1 in frame 0 and frame 2 in frame 1 (7.60, 7.61).

    O_2 is a point that moves in frame 1, so that 7.58, 7.124 and 7.125 give its motion. Angular
    velocities add (7.49), and the rate of that sum has the term w_01 x w_12.

    Args:
        outer: Frame 1 in frame 0.
        inner: Frame 2 in frame 1: its "frame 0" is our frame 1.

    Returns:
        Frame 2 in frame 0.
    """
    R, w = outer.R_0_1, outer.w_0_1
    d_12, v_12, a_12 = (turned(R, x) for x in (inner.d_0_1, inner.v_0_1, inner.a_0_1))
    w_12, alpha_12 = turned(R, inner.w_0_1), turned(R, inner.alpha_0_1)
    return MovingFrame(
        R @ inner.R_0_1,
        outer.d_0_1 + d_12,
        w + w_12,
        eq.moving_point_velocity(outer.v_0_1, w, d_12, v_12),
        eq.free_angular_acceleration(outer.alpha_0_1, w, w_12, alpha_12),
        eq.moving_point_acceleration(outer.a_0_1, outer.alpha_0_1, w, d_12, v_12, a_12),
    )


def compose_all(frames: Iterable[MovingFrame]) -> MovingFrame:
    """The last of a row of frames, each given in the one before it, in frame 0 (7.50, 7.61).

    Args:
        frames: Frame i + 1 in frame i, for i = 0, 1, ...; none at all gives frame 0 itself.

    Returns:
        The last frame in frame 0.
    """
    return reduce(compose, frames, MovingFrame(np.eye(3), np.zeros(3)))


def seen_from(T_0_1: FloatArray, T_0_2: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """(..., 4, 4) T_1_2 = T_0_1^-1 T_0_2: frame 2 in frame 1, both given in frame 0 (7.77)."""
    T = np.empty(np.broadcast_shapes(T_0_1.shape, T_0_2.shape)) if out is None else out
    back = T_0_1[..., :3, :3].swapaxes(-1, -2)
    T[..., :3, :3] = back @ T_0_2[..., :3, :3]
    T[..., :3, 3] = turned(back, T_0_2[..., :3, 3] - T_0_1[..., :3, 3])
    T[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return T
