"""The equations on lengths: how large the terms are that a result is summed from.

Instead of a vector stands its length, or a bound of it: a minus becomes a plus, a cross product the product
of two lengths, and a rotation changes nothing. What an equation gives then, no term, no partial sum and no
result of the equation itself can exceed. Rounding errors are proportional to it, not to the result, which
may be small because large terms cancel.

Nothing but zero counts as smaller than `SMALLEST`, the smallest normal number. Below it a product is off by
half the smallest subnormal number, not by half an eps of itself, and so as much as `SMALLEST` would be; and a
product that is zero because two small numbers were multiplied may still meet a large one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics.arithmetic import bound
from urdfkin.kinematics.roundings import SMALLEST

FloatArray = NDArray[np.float64]


def product(x: FloatArray | float, y: FloatArray | float) -> FloatArray:
    """`x y` for numbers that are not negative, and no less than `SMALLEST` unless one of them is zero."""
    xy = np.asarray(np.multiply(x, y))
    small = xy < SMALLEST
    if not small.any():
        return xy
    return np.where(small & (np.not_equal(x, 0.0) & np.not_equal(y, 0.0)), SMALLEST, xy)


def counted(x: FloatArray) -> FloatArray:
    """Sizes |x|: what is not zero counts as `SMALLEST` at least.

    >>> counted(np.array([0.0, -5e-324, -2.0])).tolist() == [0.0, SMALLEST, 2.0]
    True
    """
    return np.where(x == 0.0, 0.0, np.maximum(np.abs(x), SMALLEST))


def norm(x: FloatArray) -> FloatArray:
    """(...,) the lengths of vectors (..., n)."""
    # hypot neither under- nor overflows where squares would.
    return counted(np.hypot.reduce(x, axis=-1))


#: A number, a vector and what it is turned by are arrays of the same shape, or broadcast; a unit vector is 1.
chapter = bound(
    plus=np.add,
    minus=np.add,
    times=product,
    dot=product,
    cross=product,
    rotate=lambda R, x: x,
    transposed=lambda R: R,
    product=lambda R, S: S,
)
