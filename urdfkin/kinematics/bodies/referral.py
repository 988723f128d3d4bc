"""Velocity of one point of a link from that of another: the tool and the last frame.

Section 7.4.8, equation 7.115. Six-vectors are [linear; angular]. The angular velocity is the same at both.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.arrays import chapter as eq
from urdfkin.kinematics.inputs import FloatArray, vectors


def tool_velocity(velocity: ArrayLike, d_n_tool: ArrayLike) -> FloatArray:
    """d-dot_{0,tool} = d-dot_0n + w x d_{n,tool}: from frame n out to the tool.

    Args:
        velocity: (..., 6) of frame n, m/s and rad/s, in frame 0.
        d_n_tool: (..., 3) from O_n to O_tool, metres, in frame 0.

    Returns:
        (..., 6) of the tool frame, in frame 0.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    velocity, d = vectors(velocity, "velocity", 6), vectors(d_n_tool, "d_n_tool")
    linear, w = velocity[..., :3], velocity[..., 3:]
    moved = eq.point_velocity(linear, w, d)
    return np.concatenate(np.broadcast_arrays(moved, w), axis=-1)


def frame_velocity(velocity: ArrayLike, d_n_tool: ArrayLike) -> FloatArray:
    """d-dot_0n = d-dot_{0,tool} - w x d_{n,tool}: from the tool back to frame n (7.115).

    Args:
        velocity: (..., 6) of the tool frame, m/s and rad/s, in frame 0.
        d_n_tool: (..., 3) from O_n to O_tool, metres, in frame 0.

    Returns:
        (..., 6) of frame n, in frame 0.

    Raises:
        InputError: a shape or a value that is not finite.

    Example:
        >>> frame_velocity([0.0, 1.0, 0.0, 0.0, 0.0, 2.0], [0.5, 0.0, 0.0])
        array([0., 0., 0., 0., 0., 2.])
    """
    return tool_velocity(velocity, -vectors(d_n_tool, "d_n_tool"))
