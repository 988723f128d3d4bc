"""The rotation that a matrix means which is one only to nine digits: the nearest.

A user's matrix has as many digits as were printed. Its columns are then orthogonal to those digits only, and
ways to make a rotation of it (through a quaternion, through angles, column by column) differ by as much. One
of them is defined by the matrix alone: the rotation nearest to it in the Frobenius norm, the orthogonal
factor U of its polar decomposition M = U H.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray, rotations

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
