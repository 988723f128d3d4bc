"""What a second witness says: three answers to each question, held against each other, and who stands alone.

Two answers agree when they lie within what both sides may round by: urdfkin's and Pinocchio's within their
bound, urdfkin's and the witness's within theirs, Pinocchio's and the witness's within the two together. Where
one pair agrees and neither agrees with the third, the third stands alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.model.tree import FloatArray
from urdfkin.verify.bounds import Bound, result_k
from urdfkin.verify.worst import worst_of_each

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
