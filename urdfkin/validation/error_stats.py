"""What a second witness says: three answers to each question, held against each other, and who stands alone.

Two answers agree when they lie within what both sides may round by: urdfkin's and Pinocchio's within their
bound, urdfkin's and the witness's within theirs, Pinocchio's and the witness's within the two together. Where
one pair agrees and neither agrees with the third, the third stands alone.


What a validation counts, so that it can be added up: over chunks, processes and machines.

Tallies form a commutative monoid under `+` except for ties of the worst case, which the earlier sample
wins; the sum does not depend on how the work was cut.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Bound, result_k
from urdfkin.verify.comparison import worst_of_each

#: The three, in the order of columns; the last is the second witness, whoever that is.
SIDES = ("urdfkin", "pinocchio", "witness")


@dataclass(frozen=True, slots=True)
class Pair:
    """One side's answers held against the witness's.

    Attributes:
        failed: How many results lie outside their bound.
        worst: The largest disagreement, in eps * scale of the witness's bound.
        share: The largest share of a bound.
    """

    failed: int = 0
    worst: float = 0.0
    share: float = 0.0

    def __add__(self, other: Pair) -> Pair:
        return Pair(self.failed + other.failed, max(self.worst, other.worst), max(self.share, other.share))


@dataclass(frozen=True, slots=True)
class ThreeSides:
    """A witness's answers for one quantity in one reference; they add up as tallies do.

    Attributes:
        by: The witness's name.
        urdfkin: urdfkin's against the witness's.
        pinocchio: Pinocchio's against the witness's.
        alone: For each of `SIDES`, how many results only it disagrees about.
        undecided: How many of which fewer than two answers agree, or one agrees with two that do not.
    """

    by: str
    urdfkin: Pair
    pinocchio: Pair
    alone: tuple[int, int, int] = (0, 0, 0)
    undecided: int = 0

    def __add__(self, other: ThreeSides) -> ThreeSides:
        first, second, third = (a + b for a, b in zip(self.alone, other.alone, strict=True))
        return ThreeSides(
            self.by,
            self.urdfkin + other.urdfkin,
            self.pinocchio + other.pinocchio,
            (first, second, third),
            self.undecided + other.undecided,
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON, which has no infinity: None stands for it."""
        pairs = {
            name: {
                "failed": pair.failed,
                "worst": pair.worst if np.isfinite(pair.worst) else None,
                "share_of_bound": pair.share if np.isfinite(pair.share) else None,
            }
            for name, pair in (("urdfkin", self.urdfkin), ("pinocchio", self.pinocchio))
        }
        alone = dict(zip(SIDES, self.alone, strict=True))
        return {"by": self.by, **pairs, "alone": alone, "undecided": self.undecided}


def plus(first: ThreeSides | None, second: ThreeSides | None) -> ThreeSides | None:
    """Both together, where there is a witness."""
    return first if second is None else second if first is None else first + second


def three_sides(
    by: str, ours: FloatArray, pinocchios: FloatArray, witness: FloatArray, first: Bound, second: Bound
) -> ThreeSides:
    """Hold three answers (n, frames, ...) against each other.

    Args:
        by: The witness's name.
        ours: urdfkin's.
        pinocchios: Pinocchio's.
        witness: The witness's.
        first: What urdfkin's and Pinocchio's are measured against.
        second: What urdfkin's and the witness's are.
    """
    if not ours.size:
        return ThreeSides(by, Pair(), Pair())
    both = _together(first, second)
    own, units_own = _shares(ours, witness, second)
    other, units_other = _shares(pinocchios, witness, both)
    agree = _shares(ours, pinocchios, first)[0] <= 1.0, own <= 1.0, other <= 1.0
    ours_theirs, ours_witness, theirs_witness = agree
    alone = (
        theirs_witness & ~ours_theirs & ~ours_witness,
        ours_witness & ~ours_theirs & ~theirs_witness,
        ours_theirs & ~ours_witness & ~theirs_witness,
    )
    settled = np.logical_or.reduce((*alone, ours_theirs & ours_witness & theirs_witness))
    first_alone, second_alone, third_alone = (int(one.sum()) for one in alone)
    return ThreeSides(
        by,
        Pair(int((~ours_witness).sum()), float(units_own.max()), float(own.max())),
        Pair(int((~theirs_witness).sum()), float(units_other.max()), float(other.max())),
        (first_alone, second_alone, third_alone),
        int((~settled).sum()),
    )


def _shares(one: FloatArray, other: FloatArray, bound: Bound) -> tuple[FloatArray, FloatArray]:
    """(n, frames) disagreements as shares of a bound, and in eps * scale."""
    units = worst_of_each(one, other, bound.scale, 2)
    share: FloatArray = np.nan_to_num(units / result_k(bound, units.shape), nan=np.inf)
    return share, units


def _together(first: Bound, second: Bound) -> Bound:
    """The sum of both, k eps * scale, in units of the second's scale and k where that is not 0."""
    size = first.k * first.scale + second.k * second.scale
    with np.errstate(invalid="ignore", over="ignore"):
        return Bound(size / second.k, second.k)


#: Edges of the histogram of disagreements, in eps * scale: ten bins a decade from 0.001 to 100,000.
HISTOGRAM_EDGES = np.logspace(-3, 5, 81)


#: q, v and a of one sample.
Inputs = tuple[list[float], list[float], list[float]]


@dataclass(frozen=True, slots=True)
class WorstCase:
    """The sample with the largest share of its bound, with what is needed to compute it again."""

    share: float
    units: float
    sample: int
    frame: str
    q: tuple[float, ...]
    v: tuple[float, ...]
    a: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Tally:
    """One quantity in one reference.

    Attributes:
        results: How many results were compared; each is a matrix or a six-vector.
        failed: How many of them lie outside their bound.
        worst: The largest disagreement, in eps * scale.
        share: The largest share of a bound.
        histogram: (82,) how many results disagree by how much: below the first of `HISTOGRAM_EDGES`,
            between each two, above the last.
        by_frame: The largest disagreement of each frame, in the robot's order.
        case: Where the largest share was.
        bounds: The tightest and the widest bound, in eps * scale: it grows with the joints before a frame.
        witness: What a second witness says, where one was asked.
    """

    results: int
    failed: int
    worst: float
    share: float
    histogram: tuple[int, ...]
    by_frame: tuple[float, ...]
    case: WorstCase | None
    bounds: tuple[float, float] = (math.inf, 0.0)
    witness: ThreeSides | None = None

    def __add__(self, other: Tally) -> Tally:
        first, second = self.case, other.case
        if first is None or (second is not None and _before(second, first)):
            first = second
        return Tally(
            self.results + other.results,
            self.failed + other.failed,
            max(self.worst, other.worst),
            max(self.share, other.share),
            tuple(a + b for a, b in zip(self.histogram, other.histogram, strict=True)),
            tuple(max(a, b) for a, b in zip(self.by_frame, other.by_frame, strict=True)),
            first,
            (min(self.bounds[0], other.bounds[0]), max(self.bounds[1], other.bounds[1])),
            plus(self.witness, other.witness),
        )

    def beside(self, other: Tally) -> Tally:
        """The tally of the same samples and more frames."""
        joined = replace(self, by_frame=()) + replace(other, by_frame=())
        return replace(joined, by_frame=self.by_frame + other.by_frame)

    def percentile(self, percent: float) -> float:
        """The disagreement that `percent` of the results stay below, to a histogram bin (26 %)."""
        return percentile(self.histogram, HISTOGRAM_EDGES, self.worst, percent)


def percentile(
    histogram: Sequence[int], edges: Sequence[float] | FloatArray, worst: float, percent: float
) -> float:
    """The disagreement that `percent` of a histogram's results stay below, to a bin."""
    counts = np.cumsum(histogram)
    if not counts[-1]:
        return 0.0
    bin_ = int(np.searchsorted(counts, counts[-1] * percent / 100.0))
    return float(min(edges[min(bin_, len(edges) - 1)], worst)) if bin_ else 0.0


def histogram_bin(units: float, edges: Sequence[float] | FloatArray) -> int:
    """Which place of a histogram counts a disagreement."""
    return int(np.searchsorted(edges, units, side="right"))


def _before(case: WorstCase, other: WorstCase) -> bool:
    return (case.share, -case.sample) > (other.share, -other.sample)


def tally(
    ours: FloatArray,
    theirs: FloatArray,
    bound: Bound,
    frames: tuple[str, ...],
    first_sample: int,
    inputs: Sequence[Inputs],
) -> Tally:
    """Compare (n, frames, ...) results.

    Args:
        ours: Results.
        theirs: Pinocchio's.
        bound: Scale and k, broadcastable.
        frames: A name for each frame.
        first_sample: The number of the first of the n samples.
        inputs: q, v and a of each sample, for the worst case.
    """
    n, count = ours.shape[:2]
    if not ours.size:
        return Tally(n * count, 0, 0.0, 0.0, (n * count, *([0] * len(HISTOGRAM_EDGES))), (0.0,) * count, None)
    units = worst_of_each(ours, theirs, bound.scale, 2)
    share = units / result_k(bound, units.shape)
    k, f = divmod(int(share.argmax()), count)
    q, v, a = inputs[k]
    case = WorstCase(
        float(share[k, f]), float(units[k, f]), first_sample + k, frames[f], tuple(q), tuple(v), tuple(a)
    )
    bins = np.searchsorted(HISTOGRAM_EDGES, units.ravel(), side="right")
    histogram = np.bincount(bins, minlength=len(HISTOGRAM_EDGES) + 1)
    return Tally(
        results=n * count,
        failed=int((share > 1.0).sum()),
        worst=float(units.max()),
        share=float(share.max()),
        histogram=tuple(int(x) for x in histogram),
        by_frame=tuple(float(x) for x in units.max(axis=0)),
        case=case,
        bounds=(float(bound.k.min()), float(bound.k.max())),
    )


#: What each tally of a robot is about: a quantity and the reference it was taken in.
Key = tuple[str, str]
