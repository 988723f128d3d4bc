"""The rate of a rotation matrix and the angular velocity, each from the other; sums of angular velocities.

Sections 7.2.2 and 7.2.3, equations 7.35 to 7.50. `w_0_1` turns frame 1 relative to frame 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, matrices, rotations, vectors
from urdfkin.kinematics.rotation.skew import skew, unskew


def rotation_rate(R_0_1: ArrayLike, w_0_1: ArrayLike) -> FloatArray:
    """R-dot = S(w) R (7.38, 7.42).

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        w_0_1: (..., 3) angular velocity of frame 1, rad/s, expressed in frame 0.

    Returns:
        (..., 3, 3) time derivative of `R_0_1`, 1/s.

    Raises:
        InputError: a shape, or `R_0_1` is no rotation.
    """
    return skew(vectors(w_0_1, "w_0_1")) @ rotations(R_0_1, "R_0_1")


def angular_velocity_of(R_0_1: ArrayLike, R_rate: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """The w of S(w) = R-dot R^T (7.38 read backwards; 7.35 to 7.37 say that a w exists).

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        R_rate: (..., 3, 3) its time derivative, 1/s.
        tolerance: How far R-dot R^T may be from skew-symmetric, relative to its largest entry.

    Returns:
        (..., 3) angular velocity of frame 1, rad/s, expressed in frame 0.

    Raises:
        InputError: a shape, `R_0_1` is no rotation, or `R_rate` is no rate of one.

    Example:
        >>> R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> angular_velocity_of(R, rotation_rate(R, [1.0, 2.0, 3.0]))
        array([1., 2., 3.])
    """
    R_0_1 = rotations(R_0_1, "R_0_1")
    return unskew(matrices(R_rate, "R_rate") @ R_0_1.swapaxes(-1, -2), tolerance)


def turning_vector_rate(w_0_1: ArrayLike, p_0: ArrayLike) -> FloatArray:
    """W x p: the rate of a vector that is fixed in a turning frame (7.39 to 7.41).

    Args:
        w_0_1: (..., 3) angular velocity of the frame, rad/s, expressed in frame 0.
        p_0: (..., 3) the vector, metres, expressed in frame 0.

    Returns:
        (..., 3) its rate in frame 0, m/s.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    return np.cross(vectors(w_0_1, "w_0_1"), vectors(p_0, "p_0"))


def add_angular_velocities(Rs: ArrayLike, ws: ArrayLike) -> FloatArray:
    """w_0n, the sum of a row of relative angular velocities, each turned into frame 0 (7.43 to 7.50).

    Args:
        Rs: (..., n, 3, 3); row i is the orientation of frame i + 1 in frame i.
        ws: (..., n, 3); row i is the angular velocity of frame i + 1 relative to frame i, rad/s, expressed
            in frame i.

    Returns:
        (..., 3) angular velocity of frame n relative to frame 0, rad/s, expressed in frame 0.

    Raises:
        InputError: a shape, different numbers of frames, or a matrix that is no rotation.
    """
    Rs, ws = rotations(Rs, "Rs"), vectors(ws, "ws")
    if Rs.ndim < 3 or ws.ndim < 2 or Rs.shape[-3] != ws.shape[-2]:
        raise InputError(
            "Rs (..., n, 3, 3) and ws (..., n, 3) must speak of the same frames",
            found=f"{Rs.shape} and {ws.shape}",
        )
    batch = np.broadcast_shapes(Rs.shape[:-3], ws.shape[:-2])
    total, R_0_i = np.zeros((*batch, 3)), np.broadcast_to(np.eye(3), (*batch, 3, 3))
    for i in range(ws.shape[-2]):
        total = total + (R_0_i @ ws[..., i, :, np.newaxis])[..., 0]
        R_0_i = R_0_i @ Rs[..., i, :, :]
    return total
