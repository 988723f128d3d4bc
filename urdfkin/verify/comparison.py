"""Kernel for the largest difference of each result, in one pass over the numbers.

`bounds.disagreement` defines the difference. An implementation with NumPy expressions took as long as
Pinocchio's computation of the results.
"""

from __future__ import annotations

import math

import numpy as np

from urdfkin.compiled.compiling import ROWS, SCRATCH, helper, kernel
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT
from urdfkin.model.tree import FloatArray


def worst_of_each(ours: FloatArray, theirs: FloatArray, scale: FloatArray, axes: int) -> FloatArray:
    """Return the largest `bounds.disagreement` of each result.

    Args:
        ours: urdfkin's results. The first `axes` axes count results, the others belong to one result.
        theirs: The oracle's results, of the same shape.
        scale: Scale of the bound; it broadcasts against the results.
        axes: Number of leading axes that count results.

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
    """Return whether a row is finite. If x is not finite, 0 * x is NaN, and so is every sum with it."""
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * x[i, j]
    return total == 0.0


@helper(fastmath={"nnan", "nsz"})
def _largest(ours, theirs, scale, i):
    """Return the largest difference in a row. The numbers are finite, so any order gives the same result."""
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
    """Compile the kernel or read it from disk, before its first use."""
    _ = _worst.compiled
