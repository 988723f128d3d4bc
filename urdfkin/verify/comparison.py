"""Compare results of urdfkin and an oracle, in multiples of eps * scale and as a fraction of the bound.

`disagreement` defines the difference of two numbers. NumPy takes as long for the differences as Pinocchio
takes for the results. Therefore, a compiled kernel replaces NumPy after some computing time
(`urdfkin.compiled.preload`). The kernel and NumPy return equal numbers.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from urdfkin.compiled import preload
from urdfkin.kinematics.roundings import EPS, SMALLEST_SUBNORMAL
from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import VERIFY_KERNELS_MODULE, Bound, broadcast_k

#: Kernels that check a call with a single configuration.
CHECK_KERNEL_NAMES = "worst", "coupling"
_NO_BITS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class BatchComparison:
    """Comparison of a batch with the oracle's results.

    Attributes:
        worst: Largest difference, in multiples of eps * scale.
        bound_ratio: Largest ratio of difference to bound.
        index: Index of the result with the largest ratio.
    """

    result_count: int = 0
    worst: float = 0.0
    bound_ratio: float = 0.0
    index: tuple[int, ...] = ()

    def __add__(self, other: BatchComparison) -> BatchComparison:
        """Combine the comparisons of two batches.

        A bound ratio of NaN counts as the largest.
        """
        second_is_larger = other.bound_ratio > self.bound_ratio or (
            np.isnan(other.bound_ratio) and not np.isnan(self.bound_ratio)
        )
        first, second = (other, self) if second_is_larger else (self, other)
        return BatchComparison(
            self.result_count + other.result_count,
            float(np.maximum(self.worst, other.worst)),
            first.bound_ratio,
            first.index or second.index,
        )

    @property
    def agrees(self) -> bool:
        return self.bound_ratio <= 1.0


def compare(ours: FloatArray, theirs: FloatArray, bound: Bound, leading_axes: int) -> BatchComparison:
    return compare_units(worst_disagreements(ours, theirs, bound.scale, leading_axes), bound)


def compare_units(units: FloatArray, bound: Bound) -> BatchComparison:
    """Compare the largest difference of each result with its bound.

    Args:
        units: The largest differences, in eps * scale.
        bound: The bounds.
    """
    if not units.size:
        return BatchComparison()
    bound_ratio = bound_ratios(units, broadcast_k(bound, units.shape))
    index = np.unravel_index(int(bound_ratio.argmax()), bound_ratio.shape)
    return BatchComparison(
        units.size, float(units.max()), float(bound_ratio.max()), tuple(int(i) for i in index)
    )


def bound_ratios(units: FloatArray, k: FloatArray) -> FloatArray:
    """Return the ratios `units / k` of difference to bound.

    The ratio is inf if the bound is invalid (k is NaN).
    """
    return np.where(np.isnan(k), np.inf, units / k)


@np.errstate(all="ignore")
def disagreement(ours: FloatArray, theirs: FloatArray, scale: FloatArray) -> FloatArray:
    """Return |ours - theirs| in multiples of eps * scale.

    The result is inf if a number or its scale is inf or NaN. For unequal numbers with a scale of 0, the
    result is inf too.
    """
    unit = np.where(scale > 0.0, np.maximum(EPS * scale, SMALLEST_SUBNORMAL), 0.0)
    difference = np.abs(ours - theirs)
    units = np.where(difference == 0.0, 0.0, difference / unit)
    return np.where(np.isfinite(difference) & np.isfinite(scale), units, np.inf)


def worst_disagreements(
    ours: FloatArray, theirs: FloatArray, scale: FloatArray, leading_axes: int
) -> FloatArray:
    """Return the largest difference in each result, in multiples of eps * scale.

    The result has the first `leading_axes` axes of `ours`. The other axes belong to one result.
    """
    leading, own = ours.shape[:leading_axes], ours.shape[leading_axes:]
    n, width = math.prod(leading), math.prod(own)
    is_scale_shared = leading_axes > 0 and scale.ndim == ours.ndim and len(scale) == 1
    shape = (1, *ours.shape[1:]) if is_scale_shared else ours.shape
    our_rows, their_rows = _as_rows(ours, ours.shape, n, width), _as_rows(theirs, ours.shape, n, width)
    scale_rows = _as_rows(scale, shape, math.prod(shape[:leading_axes]), width)
    if (kernel := preload.get_kernel("worst", module=VERIFY_KERNELS_MODULE)) is None:
        begin = time.thread_time()
        scale_of_each = scale_rows if len(scale_rows) == n else scale_rows[np.arange(n) % len(scale_rows)]
        worst: FloatArray = disagreement(our_rows, their_rows, scale_of_each).max(axis=1, initial=0.0)
        preload.add_time("worst", time.thread_time() - begin)
    else:
        worst = units = unit = np.empty(n)
        bits = out_bits = _NO_BITS
        # If `scale_rows` has fewer than n rows, the kernel needs working memory: `unit`, `units` and `bits`.
        if len(scale_rows) < n:
            unit, units, out_bits = np.empty(scale_rows.size), np.zeros(width), worst.view(np.int64)
            bits = units.view(np.int64)
        kernel(our_rows, their_rows, scale_rows, worst, out_bits, unit, units, bits)
    return worst.reshape(leading)


def _as_rows(x: FloatArray, shape: tuple[int, ...], n: int, width: int) -> FloatArray:
    if x.shape != shape:  # `broadcast_to` is slow.
        x = np.broadcast_to(x, shape)
    return np.ascontiguousarray(x).reshape(n, width)


def load_kernels() -> None:
    """Compile or load all Numba kernels."""
    preload.load_all_kernels()
    for name in (*CHECK_KERNEL_NAMES, "lengths"):
        preload.load_kernel(name, VERIFY_KERNELS_MODULE)
