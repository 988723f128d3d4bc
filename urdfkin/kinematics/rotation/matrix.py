"""The cross product as a matrix, and the vector back out of the matrix.

Section 7.2, equation 7.16 and the text's appendix A; 7.31, 7.46.


The rotation that a matrix means which is one only to nine digits: the nearest.

A user's matrix has as many digits as were printed. Its columns are then orthogonal to those digits only, and
ways to make a rotation of it (through a quaternion, through angles, column by column) differ by as much. One
of them is defined by the matrix alone: the rotation nearest to it in the Frobenius norm, the orthogonal
factor U of its polar decomposition M = U H.


A rotation whose z column is a given axis: a joint's frame in the text's sense.

Section 7.4: joint i turns about z_{i-1}; a URDF joint turns about any axis of its frame.


The rate of a rotation matrix and the angular velocity, each from the other; sums of angular velocities.

Sections 7.2.2 and 7.2.3, equations 7.35 to 7.50. `w_0_1` turns frame 1 relative to frame 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, matrices, rotations, unit_vectors, vectors


def skew(w: ArrayLike) -> FloatArray:
    """S(w), the skew-symmetric matrix with S(w) p = w x p (7.16).

    Args:
        w: (..., 3), any unit, any frame.

    Returns:
        (..., 3, 3), in the unit and frame of `w`.

    Raises:
        InputError: `w` is not (..., 3) or not finite.

    Example:
        >>> skew([0.0, 0.0, 1.0]) + 0.0
        array([[ 0., -1.,  0.],
               [ 1.,  0.,  0.],
               [ 0.,  0.,  0.]])
    """
    w = vectors(w, "w")
    S = np.zeros((*w.shape, 3))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    S[..., 1, 2], S[..., 2, 0], S[..., 0, 1] = -w[..., 0], -w[..., 1], -w[..., 2]
    return S


def unskew(S: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """The vector w of a skew-symmetric matrix S = S(w), the inverse of `skew`.

    Rounding leaves a symmetric part in a computed S; the mean of each pair of entries removes it.

    Args:
        S: (..., 3, 3).
        tolerance: How large the symmetric part may be, as a part of the largest entry of S.

    Returns:
        (..., 3), in the unit and frame of `S`.

    Raises:
        InputError: `S` is not (..., 3, 3), not finite, or not skew-symmetric (7.26, 7.37).

    Example:
        >>> unskew(skew([1.0, 2.0, 3.0]))
        array([1., 2., 3.])
    """
    S = matrices(S, "S")
    size = np.abs(S).max(axis=(-1, -2), initial=0.0)
    symmetric = np.abs(S + S.swapaxes(-1, -2)).max(axis=(-1, -2), initial=0.0) / 2.0
    if (symmetric > tolerance * size).any():
        raise InputError(
            "S must be skew-symmetric, S + S^T = 0", found=f"a symmetric part of {symmetric.max():.3g}"
        )
    pairs = (S[..., 2, 1] - S[..., 1, 2], S[..., 0, 2] - S[..., 2, 0], S[..., 1, 0] - S[..., 0, 1])
    return np.stack(pairs, axis=-1) / 2.0


def rotate_skew(R_0_1: ArrayLike, S_1: ArrayLike) -> FloatArray:
    """The similarity R S(w) R^T = S(R w): a skew matrix expressed in another frame (7.46).

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        S_1: (..., 3, 3) skew-symmetric, S of a vector in frame 1.

    Returns:
        (..., 3, 3) S of the same vector in frame 0.

    Raises:
        InputError: a shape, or `R_0_1` is no rotation.
    """
    R_0_1 = rotations(R_0_1, "R_0_1")
    return R_0_1 @ matrices(S_1, "S_1") @ R_0_1.swapaxes(-1, -2)


#: A matrix whose entries are no farther than this from a rotation's is one to rounding, and stays as it is.
ROUNDED = 1e-15


def nearest_rotation(M: ArrayLike, name: str = "M") -> FloatArray:
    """The nearest rotation, to rounding.

    One step of Newton's (Bjorck and Bowie's) method, M - M (M^T M - I)/2. With M = U (I + E) it leaves
    U (I - 3/2 E^2); here |E| is 3e-9 at most, which leaves 1.4e-17, an eighth of a rounding.

    Args:
        M: (..., 3, 3), a rotation to nine decimals.
        name: How to call it in the message.

    Returns:
        (..., 3, 3).

    Raises:
        InputError: a shape, or no rotation.
    """
    M = rotations(M, name)
    defect = np.swapaxes(M, -1, -2) @ M - np.eye(3)
    nearest: FloatArray = M - M @ (0.5 * defect)
    return nearest


def polar_factor(M: FloatArray) -> FloatArray:
    """The same for matrices that are farther from a rotation: as printed with a few digits, or measured.

    Args:
        M: (3, 3), of positive determinant.

    Example:
        >>> polar_factor(np.diag([1.0, 1.001, 0.999])).tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ Vt)


def axis_aligning(axis: ArrayLike) -> FloatArray:
    """A rotation whose third column is `axis`; for the coordinate axes its entries are exactly 0 and +-1.

    It is the shortest turn from z to the axis when the axis does not point down, and half a turn about x
    before that when it does, so that no axis is near a singular case (Duff and others, "Building an
    Orthonormal Basis, Revisited", 2017).

    Args:
        axis: (..., 3) unit axis.

    Returns:
        (..., 3, 3) rotation; z gives the identity.

    Raises:
        InputError: a shape, or an axis that is not of unit length.

    Example:
        >>> axis_aligning([1.0, 0.0, 0.0])
        array([[ 0.,  0.,  1.],
               [ 0.,  1.,  0.],
               [-1.,  0.,  0.]])
    """
    axis = unit_vectors(axis, "axis")
    x, y, z = np.moveaxis(axis, -1, 0)
    sign = np.copysign(1.0, z)
    scale = -1.0 / (sign + z)
    first = (1.0 + sign * x * x * scale, sign * x * y * scale, -sign * x)
    second = (x * y * scale, sign + y * y * scale, -y)
    columns = [np.stack(column, axis=-1) for column in (first, second)]
    # Adding zero turns -0 into 0: a matrix one can read.
    return np.stack([*columns, axis], axis=-1) + 0.0


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
