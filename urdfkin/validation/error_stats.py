"""Error statistics of a validation.

The statistics of several chunks, processes and machines can be added. The addition is commutative and
associative. Therefore, the sum does not depend on the division of the samples into chunks. The worst case of
a sum is the worst case of its terms.

With a second oracle, `CrossCheck` compares three results. Each of the three pairs of libraries has its own
bound. The bound on the difference between Pinocchio and the second oracle is the sum of the other two bounds.
If two results agree and the third result agrees with neither, the third result is the outlier.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Bound, broadcast_k
from urdfkin.verify.comparison import bound_ratios, worst_disagreements

#: The libraries of a cross check, in the order of columns.
CROSS_CHECKED_LIBRARIES = ("urdfkin", "pinocchio", "second_oracle")


@dataclass(frozen=True, slots=True)
class OraclePair:
    """Comparison of urdfkin or Pinocchio with the second oracle.

    Attributes:
        worst: Largest disagreement, in eps * scale.
    """

    failed: int = 0
    worst: float = 0.0
    bound_ratio: float = 0.0

    def __add__(self, other: OraclePair) -> OraclePair:
        return OraclePair(
            self.failed + other.failed,
            max(self.worst, other.worst),
            max(self.bound_ratio, other.bound_ratio),
        )


@dataclass(frozen=True, slots=True)
class CrossCheck:
    """Comparison of urdfkin, Pinocchio and a second oracle.

    Attributes:
        by: Name of the second oracle.
        alone: For each library in `CROSS_CHECKED_LIBRARIES`, the number of results in which only this library
            differs from the two others.
    """

    by: str
    urdfkin: OraclePair
    pinocchio: OraclePair
    alone: tuple[int, int, int] = (0, 0, 0)
    undecided: int = 0

    def __add__(self, other: CrossCheck) -> CrossCheck:
        first, second, third = (a + b for a, b in zip(self.alone, other.alone, strict=True))
        return CrossCheck(
            self.by,
            self.urdfkin + other.urdfkin,
            self.pinocchio + other.pinocchio,
            (first, second, third),
            self.undecided + other.undecided,
        )

    def as_dict(self) -> dict[str, Any]:
        return asdict(self) | {"alone": dict(zip(CROSS_CHECKED_LIBRARIES, self.alone, strict=True))}


def add_cross_checks(first: CrossCheck | None, second: CrossCheck | None) -> CrossCheck | None:
    return first if second is None else second if first is None else first + second


def make_cross_check(
    by: str,
    results: FloatArray,
    pinocchio_results: FloatArray,
    second_oracle_results: FloatArray,
    pinocchio_bound: Bound,
    second_oracle_bound: Bound,
) -> CrossCheck:
    """Compare urdfkin, Pinocchio and the second oracle in pairs.

    The results have the shape (n, frames, ...). Both bounds are for differences from urdfkin's results.
    """
    if not results.size:
        return CrossCheck(by, OraclePair(), OraclePair())
    agrees_with_pinocchio, _ = _compare_pair(results, pinocchio_results, pinocchio_bound)
    agrees_with_second, urdfkin = _compare_pair(results, second_oracle_results, second_oracle_bound)
    pinocchio_agrees_with_second, pinocchio = _compare_pair(
        pinocchio_results, second_oracle_results, _sum_of_bounds(pinocchio_bound, second_oracle_bound)
    )
    alone = (
        pinocchio_agrees_with_second & ~agrees_with_pinocchio & ~agrees_with_second,
        agrees_with_second & ~agrees_with_pinocchio & ~pinocchio_agrees_with_second,
        agrees_with_pinocchio & ~agrees_with_second & ~pinocchio_agrees_with_second,
    )
    is_decided = np.logical_or.reduce(
        (*alone, agrees_with_pinocchio & agrees_with_second & pinocchio_agrees_with_second)
    )
    urdfkin_alone, pinocchio_alone, second_oracle_alone = (int(one.sum()) for one in alone)
    counts = urdfkin_alone, pinocchio_alone, second_oracle_alone
    return CrossCheck(by, urdfkin, pinocchio, counts, int((~is_decided).sum()))


def _compare_pair(one: FloatArray, other: FloatArray, bound: Bound) -> tuple[NDArray[np.bool_], OraclePair]:
    units = worst_disagreements(one, other, bound.scale, 2)
    bound_ratio = bound_ratios(units, broadcast_k(bound, units.shape))
    agrees = bound_ratio <= 1.0
    return agrees, OraclePair(int((~agrees).sum()), float(units.max()), float(bound_ratio.max()))


def _sum_of_bounds(first: Bound, second: Bound) -> Bound:
    total = first.k * first.scale + second.k * second.scale
    with np.errstate(invalid="ignore", over="ignore"):
        return Bound(total / second.k, second.k)


#: Edges of the histogram, in eps * scale: ten bins per decade.
HISTOGRAM_EDGES = np.logspace(-3, 5, 81)
#: Key of error statistics: the quantity, and the reference frame ("" if there is none).
Key = tuple[str, str]
Inputs = tuple[list[float], list[float], list[float]]


@dataclass(frozen=True, slots=True)
class WorstCase:
    """Sample with the largest `bound_ratio`.

    Attributes:
        units: Disagreement, in eps * scale.
        bound_ratio: Disagreement divided by the bound.
    """

    bound_ratio: float
    units: float
    sample: int
    frame: str
    q: tuple[float, ...]
    v: tuple[float, ...]
    a: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ErrorStats:
    """Error statistics of one quantity in one reference frame.

    Attributes:
        results: Number of compared matrices or six-vectors.
        worst: The largest disagreement, in eps * scale.
        bound_ratio: The largest ratio of a disagreement to its bound.
        histogram: (82,) numbers of results in bins, which `HISTOGRAM_EDGES` separates. The first bin is below
            the first edge, and the last bin is above the last edge.
        worst_by_frame: The largest disagreement of each frame, in eps * scale, in the robot's order.
        bounds: Smallest and largest bound on a result's disagreement, in eps * scale.
    """

    results: int
    failed: int
    worst: float
    bound_ratio: float
    histogram: tuple[int, ...]
    worst_by_frame: tuple[float, ...]
    case: WorstCase | None
    bounds: tuple[float, float] = (math.inf, 0.0)
    cross_check: CrossCheck | None = None

    def __add__(self, other: ErrorStats) -> ErrorStats:
        cases = [case for case in (self.case, other.case) if case is not None]
        return ErrorStats(
            self.results + other.results,
            self.failed + other.failed,
            max(self.worst, other.worst),
            max(self.bound_ratio, other.bound_ratio),
            tuple(a + b for a, b in zip(self.histogram, other.histogram, strict=True)),
            tuple(max(a, b) for a, b in zip(self.worst_by_frame, other.worst_by_frame, strict=True)),
            max(cases, key=lambda case: (case.bound_ratio, -case.sample), default=None),
            (min(self.bounds[0], other.bounds[0]), max(self.bounds[1], other.bounds[1])),
            add_cross_checks(self.cross_check, other.cross_check),
        )

    def join_frames(self, other: ErrorStats) -> ErrorStats:
        """Join the statistics of different frames for the same samples."""
        joined = replace(self, worst_by_frame=()) + replace(other, worst_by_frame=())
        return replace(joined, worst_by_frame=self.worst_by_frame + other.worst_by_frame)

    def percentile(self, percent: float) -> float:
        return percentile(self.histogram, HISTOGRAM_EDGES, self.worst, percent)


def percentile(
    histogram: Sequence[int], edges: Sequence[float] | FloatArray, worst: float, percent: float
) -> float:
    """Return the upper edge of the bin that contains a percentile.

    The result is at most `worst`. It is 0.0 for the first bin, and the last edge for the last bin. The error
    is at most the width of the bin, except in the last bin.
    """
    counts = np.cumsum(histogram)
    if not counts[-1]:
        return 0.0
    bin_ = int(np.searchsorted(counts, counts[-1] * percent / 100.0))
    return float(min(edges[min(bin_, len(edges) - 1)], worst)) if bin_ else 0.0


def histogram_bin(units: float, edges: Sequence[float] | FloatArray) -> int:
    return int(np.searchsorted(edges, units, side="right"))


def compute_error_stats(
    results: FloatArray,
    oracle_results: FloatArray,
    bound: Bound,
    frames: tuple[str, ...],
    first_sample: int,
    inputs: Sequence[Inputs],
) -> ErrorStats:
    """Compare results (n, frames, ...) of urdfkin and Pinocchio.

    `frames` are the names of the frames, joints or columns. A result fails if the factor k of its bound is
    not finite and positive.
    """
    n, count = results.shape[:2]
    if not results.size:
        return ErrorStats(
            n * count, 0, 0.0, 0.0, (n * count, *([0] * len(HISTOGRAM_EDGES))), (0.0,) * count, None
        )
    units = worst_disagreements(results, oracle_results, bound.scale, 2)
    bound_ratio = bound_ratios(units, broadcast_k(bound, units.shape))
    k, f = divmod(int(bound_ratio.argmax()), count)
    q, v, a = inputs[k]
    case = WorstCase(
        float(bound_ratio[k, f]),
        float(units[k, f]),
        first_sample + k,
        frames[f],
        tuple(q),
        tuple(v),
        tuple(a),
    )
    bins = np.searchsorted(HISTOGRAM_EDGES, units.ravel(), side="right")
    histogram = np.bincount(bins, minlength=len(HISTOGRAM_EDGES) + 1)
    return ErrorStats(
        results=n * count,
        failed=int((bound_ratio > 1.0).sum()),
        worst=float(units.max()),
        bound_ratio=float(bound_ratio.max()),
        histogram=tuple(int(x) for x in histogram),
        worst_by_frame=tuple(float(x) for x in units.max(axis=0)),
        case=case,
        bounds=(float(bound.k.min()), float(bound.k.max())),
    )
