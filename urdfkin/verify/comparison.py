"""Compute the largest difference of each result from the oracle's result (`bounds.disagreement`).

For large batches a compiled kernel computes the differences in one pass, because NumPy would take as long as
Pinocchio itself. The kernel and NumPy return equal numbers.
"""

from __future__ import annotations

import math
import time

import numpy as np

from urdfkin.compiled import preload
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT
from urdfkin.model.tree import FloatArray

#: `CHECKS` names the kernels that check one configuration, `_OF_BATCHES` the kernel of batches.
KERNELS = "urdfkin.verify.kernels"
CHECKS = "worst", "coupling"
_OF_BATCHES = "lengths"
_NO_BITS = np.empty(0, dtype=np.int64)


def worst_of_each(ours: FloatArray, theirs: FloatArray, scale: FloatArray, axes: int) -> FloatArray:
    """Return the largest difference of each result, in multiples of eps * scale (`bounds.disagreement`).

    The shape of the array is that of the first `axes` axes, which are not axes of one result. For placements
    (n, frames, 4, 4), `axes` is 2, and each result is a 4 by 4 matrix. The scale can be broadcast to the
    shape of the results.
    """
    leading, own = ours.shape[:axes], ours.shape[axes:]
    n, numbers = math.prod(leading), math.prod(own)
    shared = axes > 0 and scale.ndim == ours.ndim and len(scale) == 1
    shape = (1, *ours.shape[1:]) if shared else ours.shape
    one, other = _rows(ours, ours.shape, n, numbers), _rows(theirs, ours.shape, n, numbers)
    size = _rows(scale, shape, math.prod(shape[:axes]), numbers)
    if (kernel := preload.kernel("worst", home=KERNELS)) is None:
        begin = time.thread_time()
        worst = _worst(one, other, size if len(size) == n else size[np.arange(n) % len(size)])
        preload.spend("worst", time.thread_time() - begin)
    else:
        worst = units = unit = np.empty(n)
        bits = out_bits = _NO_BITS
        if len(size) < n:  # the kernel needs scratch memory if several results share a row of the scale
            unit, units, out_bits = np.empty(size.size), np.zeros(numbers), worst.view(np.int64)
            bits = units.view(np.int64)
        kernel(one, other, size, worst, out_bits, unit, units, bits)
    return worst.reshape(leading)


def _rows(x: FloatArray, shape: tuple[int, ...], n: int, numbers: int) -> FloatArray:
    if x.shape != shape:
        x = np.broadcast_to(x, shape)
    return np.ascontiguousarray(x).reshape(n, numbers)


@np.errstate(all="ignore")
def _worst(ours: FloatArray, theirs: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the largest difference in each row, in eps * scale; inf if a number is not finite."""
    difference = np.abs(ours - theirs)
    units = np.where(
        scale > 0.0,
        difference / np.maximum(EPS * scale, LEAST_UNIT),
        np.where(difference > 0.0, np.inf, 0.0),
    )
    finite = np.logical_and.reduce([np.isfinite(x).all(axis=1) for x in (ours, theirs, scale)])
    worst: FloatArray = np.where(finite, units.max(axis=1, initial=0.0), np.inf)
    return worst


def load_kernels() -> None:
    """Compile or load all Numba kernels, so that worker processes do not compile them."""
    preload.load_kernels()
    for name in (*CHECKS, _OF_BATCHES):
        preload.load(name, KERNELS)
