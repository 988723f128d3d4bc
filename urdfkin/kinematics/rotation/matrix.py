"""Rotation matrices: skew-symmetric matrices, nearest rotations, time derivatives and angular velocities.

| Functions | Section and equations of the textbook |
|---|---|
| `skew`, `unskew`, `rotate_skew` | 7.2: 7.16, 7.31, 7.46; appendix A |
| `rotation_rate`, `angular_velocity_of`, `turning_vector_rate` | 7.2.2: 7.35 to 7.42 |
| `add_angular_velocities` | 7.2.3: 7.43 to 7.50 |
| `axis_aligning` | 7.4 |

`w_0_1` is the angular velocity of frame 1 relative to frame 0.

A user's matrix often has only a few digits, so its columns are only approximately orthogonal. Such a matrix
can be converted to a rotation by a quaternion, by angles or column by column. The results differ in the last
digit of the given matrix. `nearest_rotation` and `polar_factor` return the rotation that is nearest to the
matrix in the Frobenius norm. This rotation is unique: it is the orthogonal factor U of the polar
decomposition M = U H.

The textbook's joint i turns about the axis z_{i-1} of a frame. A URDF joint turns about any axis of its
frame. `axis_aligning` returns the rotation between the two frames.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, matrices, rotations, unit_vectors, vectors


def skew(w: ArrayLike) -> FloatArray:
    """Return S(w), the skew-symmetric matrix with S(w) p = w x p (7.16).

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
    """Return the vector w of a skew-symmetric matrix S = S(w), the inverse of `skew`.

    A computed S has a small symmetric part, caused by rounding. The function removes this part: each
    component of w is the mean of two entries, S_ij and -S_ji.

    Args:
        S: (..., 3, 3).
        tolerance: Largest allowed entry of the symmetric part, relative to the largest entry of S.

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
    """Return R S(w) R^T = S(R w), a skew-symmetric matrix expressed in another frame (7.46).

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        S_1: (..., 3, 3) skew-symmetric matrix of a vector in frame 1.

    Returns:
        (..., 3, 3) skew-symmetric matrix of the same vector in frame 0.

    Raises:
        InputError: a wrong shape, or `R_0_1` is not a rotation.
    """
    R_0_1 = rotations(R_0_1, "R_0_1")
    return R_0_1 @ matrices(S_1, "S_1") @ R_0_1.swapaxes(-1, -2)


#: If no entry of a matrix differs from that of the nearest rotation by more than this number, the matrix is a
#: rotation up to rounding and is not changed.
ROUNDED = 1e-15


def nearest_rotation(M: ArrayLike, name: str = "M") -> FloatArray:
    """Return the rotation that is nearest to a matrix M, up to rounding.

    The method is one Newton step (Bjorck and Bowie): M - M (M^T M - I)/2. With M = U (I + E) the result is U
    (I - 3/2 E^2). Here |E| is 3e-9 at most, so the error of the result is 1.4e-17 at most, an eighth of a
    rounding error.

    Args:
        M: (..., 3, 3), a rotation whose entries are rounded to nine decimals.
        name: Name of the argument, for messages.

    Returns:
        (..., 3, 3).

    Raises:
        InputError: a wrong shape, or `M` is not a rotation.
    """
    M = rotations(M, name)
    defect = np.swapaxes(M, -1, -2) @ M - np.eye(3)
    nearest: FloatArray = M - M @ (0.5 * defect)
    return nearest


def polar_factor(M: FloatArray) -> FloatArray:
    """Return the rotation nearest to a matrix that has larger errors than `nearest_rotation` allows.

    An example is a matrix that is printed with few digits.

    Args:
        M: (3, 3) matrix with a positive determinant.

    Example:
        >>> polar_factor(np.diag([1.0, 1.001, 0.999])).tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ Vt)


def axis_aligning(axis: ArrayLike) -> FloatArray:
    """Return a rotation with `axis` as its third column.

    If the axis does not point down (its z component is not negative), the result is the shortest rotation
    from z to the axis. If the axis points down, the result is half a turn about x, followed by the shortest
    rotation from -z to the axis. The computation therefore has no singularity near any axis (Duff and others,
    "Building an Orthonormal Basis, Revisited", 2017). For a coordinate axis the entries are exactly 0 and
    +-1.

    Args:
        axis: (..., 3) unit axis.

    Returns:
        (..., 3, 3) rotation; the identity for the axis z.

    Raises:
        InputError: a wrong shape, or an axis that is not of unit length.

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
    # Adding zero turns -0 into 0, so that printed matrices are easier to read.
    return np.stack([*columns, axis], axis=-1) + 0.0


def rotation_rate(R_0_1: ArrayLike, w_0_1: ArrayLike) -> FloatArray:
    """Return the time derivative R-dot = S(w) R of a rotation matrix (7.38, 7.42).

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        w_0_1: (..., 3) angular velocity of frame 1, rad/s, expressed in frame 0.

    Returns:
        (..., 3, 3) time derivative of `R_0_1`, 1/s.

    Raises:
        InputError: a wrong shape, or `R_0_1` is not a rotation.
    """
    return skew(vectors(w_0_1, "w_0_1")) @ rotations(R_0_1, "R_0_1")


def angular_velocity_of(R_0_1: ArrayLike, R_rate: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """Return the angular velocity w, for which S(w) = R-dot R^T (7.38).

    Equations 7.35 to 7.37 show that such a w exists.

    Args:
        R_0_1: (..., 3, 3) orientation of frame 1 in frame 0.
        R_rate: (..., 3, 3) time derivative of `R_0_1`, 1/s.
        tolerance: Largest allowed entry of the symmetric part of R-dot R^T, relative to the largest entry of
            R-dot R^T.

    Returns:
        (..., 3) angular velocity of frame 1, rad/s, expressed in frame 0.

    Raises:
        InputError: a wrong shape, `R_0_1` is not a rotation, or `R_rate` is not the rate of a rotation.

    Example:
        >>> R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> angular_velocity_of(R, rotation_rate(R, [1.0, 2.0, 3.0]))
        array([1., 2., 3.])
    """
    R_0_1 = rotations(R_0_1, "R_0_1")
    return unskew(matrices(R_rate, "R_rate") @ R_0_1.swapaxes(-1, -2), tolerance)


def turning_vector_rate(w_0_1: ArrayLike, p_0: ArrayLike) -> FloatArray:
    """Return the time derivative w x p of a vector p that is fixed in a turning frame (7.39 to 7.41).

    Args:
        w_0_1: (..., 3) angular velocity of the frame, rad/s, expressed in frame 0.
        p_0: (..., 3) vector, metres, expressed in frame 0.

    Returns:
        (..., 3) time derivative of the vector in frame 0, m/s.

    Raises:
        InputError: a wrong shape, or a value that is not finite.
    """
    return np.cross(vectors(w_0_1, "w_0_1"), vectors(p_0, "p_0"))


def add_angular_velocities(Rs: ArrayLike, ws: ArrayLike) -> FloatArray:
    """Return the angular velocity w_0n of the last frame (7.43 to 7.50).

    It is the sum of the angular velocities of each frame relative to the previous frame, after each is
    expressed in frame 0.

    Args:
        Rs: (..., n, 3, 3); entry i is the orientation of frame i + 1 in frame i.
        ws: (..., n, 3); entry i is the angular velocity of frame i + 1 relative to frame i, rad/s, expressed
            in frame i.

    Returns:
        (..., 3) angular velocity of frame n relative to frame 0, rad/s, expressed in frame 0.

    Raises:
        InputError: a wrong shape, different numbers n in `Rs` and `ws`, or a matrix that is not a rotation.
    """
    Rs, ws = rotations(Rs, "Rs"), vectors(ws, "ws")
    if Rs.ndim < 3 or ws.ndim < 2 or Rs.shape[-3] != ws.shape[-2]:
        raise InputError(
            "Rs (..., n, 3, 3) and ws (..., n, 3) must have the same n",
            found=f"{Rs.shape} and {ws.shape}",
        )
    batch = np.broadcast_shapes(Rs.shape[:-3], ws.shape[:-2])
    total, R_0_i = np.zeros((*batch, 3)), np.broadcast_to(np.eye(3), (*batch, 3, 3))
    for i in range(ws.shape[-2]):
        total = total + (R_0_i @ ws[..., i, :, np.newaxis])[..., 0]
        R_0_i = R_0_i @ Rs[..., i, :, :]
    return total
