"""What is timed: one contender's way to one quantity; and the test that all compute the same numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.tree import FloatArray

#: What results may differ by, in m, rad, m/s^2, rad/s^2: a guard against other work, no measure of accuracy.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Work:
    """One contender's way to one quantity.

    Attributes:
        who: The contender, as the tables call it.
        n: How many configurations `compute` computes, the first of the subject's.
        compute: What is timed.
        result: What it computes in urdfkin's conventions, for some of the configurations from the first on;
            None where there is nothing to compare, as for the floor. Not timed.
        tolerance: What a number may differ by from Pinocchio's.
        remark: What a reader must know to read the figure.
    """

    who: str
    n: int
    compute: Callable[[], object]
    result: Callable[[], FloatArray] | None = None
    tolerance: float = TOLERANCE
    remark: str = ""


class DifferenceError(Exception):
    """Contenders disagree: no time of theirs means anything."""


def agree(works: Sequence[Work], reference: Work, what: str) -> None:
    """Compute everything once, which also warms everyone up, and hold it against `reference`'s result.

    Raises:
        DifferenceError: with the contender and the largest difference.
    """
    if reference.result is None:
        raise ValueError("the reference has no result")
    reference.compute()
    expected = np.array(reference.result())
    for work in works:
        work.compute()
        if work.result is None:
            continue
        ours = work.result()
        n = min(len(ours), len(expected))
        ours, theirs = ours[:n], expected[:n]
        if ours.shape != theirs.shape:
            raise DifferenceError(f"{what}: {work.who} has the shape {ours.shape}, not {theirs.shape}")
        if not np.allclose(ours, theirs, rtol=0.0, atol=work.tolerance):
            worst = float(np.abs(ours - theirs).max())
            raise DifferenceError(f"{what}: {work.who} and {reference.who} differ by {worst:.3g}")
