"""Kernels of checks: the largest difference of each result, and the columns of mimic joints."""

from __future__ import annotations

import math

from urdfkin.compiled.machine.compiling import NUMBERS, PLACES, ROWS, SCRATCH, helper, kernel
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT


@helper(fastmath={"reassoc"})
def _finite(x, i):
    """Return whether a row is finite.

    If x is not finite, 0 * x is NaN, and a sum with NaN in any order is NaN.
    """
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * x[i, j]
    return total == 0.0


@helper(fastmath={"reassoc"})
def _finite_difference(x, y, i):
    """Return whether all differences of two rows are finite; any number that is not finite gives False."""
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * (x[i, j] - y[i, j])
    return total == 0.0


@helper(fastmath={"nnan", "nsz"})
def _units(difference, size):
    """Return a difference in multiples of eps * scale."""
    must_be_equal = math.inf if difference > 0.0 else 0.0
    return difference / max(EPS * size, LEAST_UNIT) if size > 0.0 else must_be_equal


@helper(fastmath={"nnan", "nsz"})
def _largest(ours, theirs, scale, i, k):
    """Return the largest difference between two rows of finite numbers; the compiler may reorder comparisons.

    The scale is in row `k`.
    """
    largest = 0.0
    for j in range(ours.shape[1]):
        largest = max(largest, _units(abs(ours[i, j] - theirs[i, j]), scale[k, j]))
    return largest


@helper()
def _is_in_threes(scale, k):
    """Return whether the three linear rows of a scale are equal, and also the three angular rows."""
    width = scale.shape[1] // 6
    equal = scale.shape[1] == 6 * width
    for first in range(0, 6 * width, max(3 * width, 1)):
        for j in range(first, first + width):
            equal = equal and scale[k, j] == scale[k, j + width] == scale[k, j + 2 * width]
    return equal


@helper(fastmath={"nnan", "nsz"})
def _largest_of_threes(ours, theirs, scale, i, k):
    """Return `_largest` of six rows.

    Three rows have the same scale, so only the largest of three numbers is divided by it.
    """
    largest, width = 0.0, ours.shape[1] // 6
    for half in range(2):
        for j in range(3 * half * width, (3 * half + 1) * width):
            x = abs(ours[i, j] - theirs[i, j])
            y = abs(ours[i, j + width] - theirs[i, j + width])
            z = abs(ours[i, j + 2 * width] - theirs[i, j + 2 * width])
            largest = max(largest, _units(max(x, y, z), scale[k, j]))
    return largest


@kernel(ROWS, ROWS, ROWS, SCRATCH)
def worst(ours, theirs, scale, out):
    """Write the largest difference of each row to `out`; inf for a row with a number that is not finite.

    If the scale has fewer rows than the results, its rows are repeated.
    """
    known = in_threes = len(scale) < len(out)
    for k in range(len(scale)):
        known = known and _finite(scale, k)
        in_threes = in_threes and _is_in_threes(scale, k)
    for i in range(len(out)):
        k = i % len(scale)
        if not (_finite_difference(ours, theirs, i) and (known or _finite(scale, k))):
            out[i] = math.inf
        elif in_threes:
            out[i] = _largest_of_threes(ours, theirs, scale, i, k)
        else:
            out[i] = _largest(ours, theirs, scale, i, k)
    return 0


@kernel(ROWS, PLACES, PLACES, NUMBERS, SCRATCH)
def coupling(full, columns, index, factor, out):
    """Add the weighted Jacobian columns of all joints to `out`, which contains zeros at first."""
    nv = len(out) // max(1, len(full))
    for i in range(len(full)):
        for column in columns:
            out[i * nv + index[column]] += full[i, column] * factor[column]
    return 0
