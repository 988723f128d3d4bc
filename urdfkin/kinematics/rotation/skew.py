"""The cross product as a matrix, and the vector back out of the matrix.

Section 7.2, equation 7.16 and the text's appendix A; 7.31, 7.46.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, matrices, rotations, vectors


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
