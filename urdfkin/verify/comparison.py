"""The largest disagreement of each result, in one pass over the numbers.

`bounds.disagreement` says what is computed; as array expressions it took as long as Pinocchio itself.
"""

from __future__ import annotations

import math

import numpy as np

from urdfkin.compiled.compiling import ROWS, SCRATCH, helper, kernel
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT
from urdfkin.model.tree import FloatArray


def worst_of_each(ours: FloatArray, theirs: FloatArray, scale: FloatArray, axes: int) -> FloatArray:
    """The largest `bounds.disagreement` of each result.

    Args:
        ours: Results with `axes` leading axes; what is left is one result.
        theirs: The same from Pinocchio.
        scale: Of a bound, broadcastable against them.
        axes: How many leading axes count results.

    Returns:
        An array of the leading axes' shape, in eps * scale.
    """
    leading, own = ours.shape[:axes], ours.shape[axes:]
    flat = [
        np.ascontiguousarray(np.broadcast_to(x, ours.shape)).reshape(math.prod(leading), math.prod(own))
        for x in (ours, theirs, scale)
    ]
    worst = np.zeros(len(flat[0]))
    _worst(*flat, worst)
    return worst.reshape(leading)


@helper(fastmath={"reassoc"})
def _finite(x, i):
    """Whether a row is: 0 times what is not is no number, and stays so in a sum in any order."""
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * x[i, j]
    return total == 0.0


@helper(fastmath={"nnan", "nsz"})
def _largest(ours, theirs, scale, i):
    """The largest of a row of finite numbers, which the compiler may look for in any order."""
    largest = 0.0
    for j in range(ours.shape[1]):
        size, difference = scale[i, j], abs(ours[i, j] - theirs[i, j])
        must_be_equal = math.inf if difference > 0.0 else 0.0
        units = difference / max(EPS * size, LEAST_UNIT) if size > 0.0 else must_be_equal
        largest = max(largest, units)
    return largest


@kernel(ROWS, ROWS, ROWS, SCRATCH)
def _worst(ours, theirs, scale, worst):
    for i in range(len(worst)):
        good = _finite(ours, i) and _finite(theirs, i) and _finite(scale, i)
        worst[i] = _largest(ours, theirs, scale, i) if good else math.inf
    return 0


def load_kernel() -> None:
    """Have it compiled, or read from disk, before it is needed."""
    _ = _worst.compiled
