"""Kernels of checks: the largest difference of each result, and the columns of mimic joints."""

from __future__ import annotations

import math

from urdfkin.compiled.machine.compiling import NUMBERS, PLACES, ROWS, SCRATCH, helper, kernel
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT


@helper(fastmath={"reassoc"})
def _finite(x, i):
    """Return whether a row is finite: 0 * x is NaN if x is not, and NaN remains in a sum in any order."""
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * x[i, j]
    return total == 0.0


@helper(fastmath={"nnan", "nsz"})
def _largest(ours, theirs, scale, i):
    """Return the largest difference in a row of finite numbers; the compiler may reorder the comparisons."""
    largest = 0.0
    for j in range(ours.shape[1]):
        size, difference = scale[i, j], abs(ours[i, j] - theirs[i, j])
        must_be_equal = math.inf if difference > 0.0 else 0.0
        units = difference / max(EPS * size, LEAST_UNIT) if size > 0.0 else must_be_equal
        largest = max(largest, units)
    return largest


@kernel(ROWS, ROWS, ROWS, SCRATCH)
def worst(ours, theirs, scale, out):
    """Write the largest difference in each row; inf for a row that is not finite."""
    for i in range(len(out)):
        good = _finite(ours, i) and _finite(theirs, i) and _finite(scale, i)
        out[i] = _largest(ours, theirs, scale, i) if good else math.inf
    return 0


@kernel(ROWS, PLACES, PLACES, NUMBERS, SCRATCH)
def coupling(full, columns, index, factor, out):
    """Add the columns of mimic joints to `out`, which is zero."""
    nv = len(out) // max(1, len(full))
    for i in range(len(full)):
        for column in columns:
            out[i * nv + index[column]] += full[i, column] * factor[column]
    return 0
