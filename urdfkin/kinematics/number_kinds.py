"""Two versions of the textbook's equations: one computes results, the other bounds the results.

`array_equations` computes with NumPy arrays. The last axis of an array contains the three components of a
vector, so one call computes a whole batch.

`length_equations` computes the scale of a result: an upper bound on the sum of the absolute values of its
terms. The scale is at least as large as every term, every partial sum and the result. Rounding errors are
proportional to the scale. The result can be much smaller than the scale, because large terms can cancel.

| Result | Scale |
|---|---|
| vector | length of the vector, or an upper bound on the length |
| difference | sum |
| cross product | product of two lengths |
| rotated vector | length of the vector |

A scale is 0 or at least `SMALLEST_NORMAL`, the smallest normal number, for two reasons:

| Product of small numbers | Error |
|---|---|
| below `SMALLEST_NORMAL` | up to half the smallest subnormal number |
| underflow to zero | large, if a later factor is large: the computed product is still zero |
"""

from __future__ import annotations

from operator import add
from typing import Any

import numpy as np

from urdfkin.kinematics.arithmetic import bind_equations
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.roundings import SMALLEST_NORMAL

array_equations = bind_equations(
    plus=np.add,
    minus=np.subtract,
    times=lambda c, x: np.asarray(c)[..., np.newaxis] * x,
    dot=lambda x, y: (x * y).sum(axis=-1),
    cross=np.cross,
    rotate=lambda R, x: (R @ x[..., np.newaxis])[..., 0],
    transposed=lambda R: R.swapaxes(-1, -2),
    product=np.matmul,
)

#: The length of a vector: a float, or an array with a number for each configuration.
Length = Any


def product(x: Length, y: Length) -> Length:
    """Return x y, but at least `SMALLEST_NORMAL` for nonzero lengths.

    >>> product(1e-200, 1e-200) == SMALLEST_NORMAL, product(0.0, 1e-200), product(np.array([2.0]), 3.0)
    (True, 0.0, array([6.]))
    """
    if type(x) is float and type(y) is float:
        return SMALLEST_NORMAL if x * y < SMALLEST_NORMAL and x != 0.0 and y != 0.0 else x * y
    xy = np.asarray(np.multiply(x, y))
    if xy.min(initial=np.inf) >= SMALLEST_NORMAL:
        return xy
    return np.where(
        (xy < SMALLEST_NORMAL) & (np.not_equal(x, 0.0) & np.not_equal(y, 0.0)), SMALLEST_NORMAL, xy
    )


def magnitude(x: FloatArray) -> FloatArray:
    """Return |x|, but at least `SMALLEST_NORMAL` for nonzero numbers.

    >>> magnitude(np.array([0.0, -5e-324, -2.0])).tolist() == [0.0, SMALLEST_NORMAL, 2.0]
    True
    """
    return np.where(x == 0.0, 0.0, np.maximum(np.abs(x), SMALLEST_NORMAL))


def norm(x: FloatArray) -> FloatArray:
    """Return the lengths (...) of vectors (..., n), at least `SMALLEST_NORMAL` for nonzero vectors."""
    return magnitude(
        np.hypot.reduce(x, axis=-1)
    )  # Squares could underflow or overflow, but np.hypot does not.


#: For each equation, a function that returns the scale of the result. The arguments are lengths of vectors
#: and absolute values of numbers. Arguments that are arrays follow NumPy's broadcasting rules.
length_equations = bind_equations(
    plus=add,
    minus=add,
    times=product,
    dot=product,
    cross=product,
    rotate=lambda R, x: x,
    transposed=lambda R: R,
    product=lambda R, S: S,
)
