"""The equations bound to another kind of vector, or to another kind of function.

`urdfkin.kinematics.equations` computes with triples of numbers. Where a vector is something else, an array, a
length, a piece of LaTeX, the same functions run with other ones in the place of `plus`, `cross` and the like.


The equations on NumPy arrays whose last axis holds a vector's three numbers: whole batches at once.

The equations on lengths: how large the terms are that a result is summed from.

Instead of a vector stands its length, or a bound of it: a minus becomes a plus, a cross product the product
of two lengths, and a rotation changes nothing. What an equation gives then, no term, no partial sum and no
result of the equation itself can exceed. Rounding errors are proportional to it, not to the result, which
may be small because large terms cancel.

Nothing but zero counts as smaller than `SMALLEST`, the smallest normal number. Below it a product is off by
half the smallest subnormal number, not by half an eps of itself, and so as much as `SMALLEST` would be; and a
product that is zero because two small numbers were multiplied may still meet a large one.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics import equations
from urdfkin.kinematics.roundings import SMALLEST

#: The functions on vectors, which all others are made of.
VECTORS = ("plus", "minus", "times", "dot", "cross", "rotate", "transposed", "product")


def bound(
    *, made: Callable[[Callable[..., Any]], Any] = lambda function: function, **vectors: Any
) -> SimpleNamespace:
    """Every function of `equations`, under its name, computing with what is given here.

    Args:
        made: What becomes of each function, a compiler's decorator for instance.
        vectors: Functions to use instead of those of `equations`.

    >>> lengths = bound(plus=lambda x, y: x + y, cross=lambda x, y: x * y)
    >>> lengths.point_velocity(1.0, 2.0, 3.0)
    7.0
    """
    names: dict[str, Any] = {}
    for name, function in _functions():
        copy = FunctionType(function.__code__, names, name, function.__defaults__)
        copy.__doc__, copy.__module__ = function.__doc__, function.__module__
        names[name] = vectors.get(name) or made(copy)
    return SimpleNamespace(**names)


def _functions() -> list[tuple[str, FunctionType]]:
    return [(name, value) for name, value in vars(equations).items() if isinstance(value, FunctionType)]


#: A number is an array without that axis, a rotation one with two axes of three.
array_equations = bound(
    plus=np.add,
    minus=np.subtract,
    times=lambda c, x: np.asarray(c)[..., np.newaxis] * x,
    dot=lambda x, y: (x * y).sum(axis=-1),
    cross=np.cross,
    rotate=lambda R, x: (R @ x[..., np.newaxis])[..., 0],
    transposed=lambda R: R.swapaxes(-1, -2),
    product=np.matmul,
)


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
length_equations = bound(
    plus=np.add,
    minus=np.add,
    times=product,
    dot=product,
    cross=product,
    rotate=lambda R, x: x,
    transposed=lambda R: R,
    product=lambda R, S: S,
)
