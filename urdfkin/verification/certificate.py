"""What was checked, how closely it agreed, and what was not checked."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np

from urdfkin.errors import UrdfkinError
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Bound, Quantity, disagreement


class VerificationError(UrdfkinError):
    """urdfkin and Pinocchio disagree by more than rounding can explain: one of the two is wrong.

    Attributes:
        quantity: What was compared.
        frame: Of which frame.
        reference: In which reference.
        index: Position of the worst sample in the batch.
        ours: urdfkin's value of that sample.
        theirs: Pinocchio's.
        bound: What the two may differ by, number for number.
        reproduce: A line that computes the case again.
    """

    is_disagreement = True

    def __init__(
        self,
        quantity: Quantity,
        frame: str,
        reference: str,
        *,
        index: tuple[int, ...],
        ours: FloatArray,
        theirs: FloatArray,
        bound: FloatArray,
        units: float,
        reproduce: str,
    ) -> None:
        difference = float(np.abs(ours - theirs).max())
        super().__init__(
            f"the {quantity} of {frame} ({reference}) disagrees with Pinocchio's",
            where=f"sample {list(index)}" if index else None,
            found=f"a difference of {difference:.3g}, {units:.3g} eps*scale",
            remedy=f"reproduce it with: {reproduce}",
        )
        self.quantity, self.frame, self.reference, self.index = quantity, frame, reference, index
        self.ours, self.theirs, self.bound, self.reproduce = ours, theirs, bound, reproduce


@dataclass(frozen=True, slots=True)
class Comparison:
    """One batch of results held against Pinocchio's.

    Attributes:
        results: How many results (matrices or six-vectors) were compared.
        worst: The largest disagreement, in eps * scale.
        share: The largest disagreement as a share of its bound; above 1 is a failure.
        index: Where the largest share is, in the results' leading axes.
    """

    results: int
    worst: float
    share: float
    index: tuple[int, ...]

    @property
    def agrees(self) -> bool:
        """Whether every number lies within its bound."""
        return self.share <= 1.0


def compare(ours: FloatArray, theirs: FloatArray, bound: Bound, axes: int) -> Comparison:
    """Hold results against Pinocchio's.

    Args:
        ours: Results with `axes` leading axes; what is left is one result.
        theirs: The same from Pinocchio.
        bound: Scale and k, broadcastable against them.
        axes: How many leading axes count results.
    """
    units = disagreement(ours, theirs, bound)
    if not units.size:
        return Comparison(int(np.prod(ours.shape[:axes])), 0.0, 0.0, ())
    share = units / bound.k
    index = np.unravel_index(int(share.argmax()), share.shape)[:axes]
    results = int(np.prod(ours.shape[:axes]))
    return Comparison(results, float(units.max()), float(share.max()), tuple(int(i) for i in index))


@dataclass(frozen=True, slots=True)
class Line:
    """A quantity's line in a certificate.

    Attributes:
        quantity: What was computed.
        checked: How many results Pinocchio confirmed.
        worst: The largest disagreement among them, in eps * scale.
        share: The same as a share of the bound.
        unchecked: How many results were handed out without a check.
    """

    quantity: Quantity
    checked: int
    worst: float
    share: float
    unchecked: int


@dataclass(frozen=True, slots=True)
class Certificate:
    """What a robot's results so far are worth.

    Attributes:
        robot: The robot's name.
        pinocchio: The version that checked.
        lines: One for each quantity that was computed.
        not_verified: Why results were not checked, in words; empty where all were.
    """

    robot: str
    pinocchio: str
    lines: tuple[Line, ...]
    not_verified: tuple[str, ...]

    @property
    def verified(self) -> bool:
        """Whether results were handed out and every one of them was checked."""
        return any(line.checked for line in self.lines) and not any(line.unchecked for line in self.lines)

    def __str__(self) -> str:
        head = f"{self.robot}, checked by Pinocchio {self.pinocchio}"
        rows = [head] + [
            f"  {line.quantity}: {line.checked} checked, worst {line.worst:.2g} eps*scale"
            f" ({line.share:.1%} of the bound)"
            + (f", {line.unchecked} not checked" if line.unchecked else "")
            for line in self.lines
        ]
        return "\n".join(rows + [f"  not verified: {reason}" for reason in self.not_verified])


@dataclass
class Ledger:
    """Counts what a robot hands out; safe to use from several threads."""

    _lines: dict[Quantity, Line] = field(default_factory=dict)
    _reasons: dict[str, None] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def checked(self, quantity: Quantity, comparison: Comparison) -> None:
        """Enter results that Pinocchio confirmed."""
        with self._lock:
            old = self._lines.get(quantity, Line(quantity, 0, 0.0, 0.0, 0))
            self._lines[quantity] = Line(
                quantity,
                old.checked + comparison.results,
                max(old.worst, comparison.worst),
                max(old.share, comparison.share),
                old.unchecked,
            )

    def unchecked(self, quantity: Quantity, results: int, reason: str) -> None:
        """Enter results that were handed out without a check, and why."""
        with self._lock:
            old = self._lines.get(quantity, Line(quantity, 0, 0.0, 0.0, 0))
            self._lines[quantity] = Line(quantity, old.checked, old.worst, old.share, old.unchecked + results)
            self._reasons[reason] = None

    def certificate(self, robot: str, pinocchio: str) -> Certificate:
        """What stands in the ledger now."""
        with self._lock:
            lines = tuple(self._lines[quantity] for quantity in Quantity if quantity in self._lines)
            return Certificate(robot, pinocchio, lines, tuple(self._reasons))

    def __reduce__(self) -> tuple[type[Ledger], tuple[()]]:
        # A copy in another process starts its own account.
        return type(self), ()
