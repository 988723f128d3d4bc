"""What is timed, the clock, and the test that all compute the same numbers.

Ratios of one run hold on a noisy machine, absolute times do not: every contender is timed once a round, so
that what slows the machine slows everyone. In each round the order is another, and each contender computes
once untimed before it is timed: its data are as near as they can be, and the threads of the one before have
gone to sleep.
"""

from __future__ import annotations

import gc
import random
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from urdfkin.model.tree import FloatArray

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


@dataclass(frozen=True)
class Table:
    """What the rows of one table share.

    Attributes:
        section: A name of `sections.SECTIONS`.
        robot: A name of the catalogue, or how many joints a chain has.
        quantity: jacobian, acceleration or placement.
        numbers: How many float64 one configuration's result has.
        size: What the section grows: joints, frames, configurations.
    """

    section: str
    robot: str
    quantity: str
    numbers: int
    size: int = 0


@dataclass(frozen=True)
class Row(Table):
    """One contender's figures.

    Attributes:
        who: The contender.
        n: How many configurations were computed at a time.
        median_ns: For one configuration, over the rounds.
        minimum_ns: For one configuration.
        ratio: The baseline's median over this one's; more than 1 is faster than the baseline.
        remark: What a reader must know to read the figure.
    """

    who: str = ""
    n: int = 0
    median_ns: float = 0.0
    minimum_ns: float = 0.0
    ratio: float | None = None
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


def times(works: Sequence[Work], rounds: int) -> dict[str, list[float]]:
    """Nanoseconds for one configuration: each of `works` once a round, in another order in each round."""
    found: dict[str, list[float]] = {work.who: [] for work in works}
    shuffled, order = list(works), random.Random(0)
    collecting = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            order.shuffle(shuffled)
            for work in shuffled:
                work.compute()
                begin = time.perf_counter()
                work.compute()
                found[work.who].append((time.perf_counter() - begin) / work.n * 1e9)
    finally:
        if collecting:
            gc.enable()
    return found


def measure(table: Table, works: Sequence[Work], rounds: int, baseline: Work | None = None) -> list[Row]:
    """Time `works`.

    Args:
        table: What the rows share.
        works: Contenders, computed once before, so that nothing is compiled here.
        rounds: At least one.
        baseline: The one of `works` that the others are held against.
    """
    found = times(works, rounds)
    medians = {who: statistics.median(values) for who, values in found.items()}

    def row(work: Work) -> Row:
        ratio = None if baseline is None else round(medians[baseline.who] / medians[work.who], 3)
        own: dict[str, Any] = {"who": work.who, "n": work.n, "remark": work.remark, "ratio": ratio}
        fastest = round(min(found[work.who]), 3)
        return Row(**asdict(table), **own, median_ns=round(medians[work.who], 3), minimum_ns=fastest)

    return [row(work) for work in works]
