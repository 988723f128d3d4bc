"""A rotation whose z column is a given axis: a joint's frame in the text's sense.

Section 7.4: joint i turns about z_{i-1}; a URDF joint turns about any axis of its frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray, unit_vectors


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
