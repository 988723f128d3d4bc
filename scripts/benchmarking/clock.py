"""The clock: every contender once a round, so that what slows the machine slows everyone.

Ratios of one run hold on a noisy machine, absolute times do not. In each round the order is another, and each
contender computes once untimed before it is timed: its data are as near as they can be, and the threads of
the one before have gone to sleep.
"""

from __future__ import annotations

import gc
import random
import statistics
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from scripts.benchmarking.work import Work


@dataclass(frozen=True)
class Row:
    """One contender's figures.

    Attributes:
        section: Which table it stands in: batch, single, verified, joints, frames, sizes.
        robot: A name of the catalogue, or how many joints a chain has.
        quantity: jacobian, acceleration or placement.
        who: The contender.
        n: How many configurations were computed at a time.
        median_ns: For one configuration, over the rounds.
        minimum_ns: For one configuration.
        ratio: The baseline's median over this one's; more than 1 is faster than the baseline.
        size: What the section grows: joints, frames, configurations.
        numbers: How many float64 one configuration's result has.
        remark: What a reader must know to read the figure.
    """

    section: str
    robot: str
    quantity: str
    who: str
    n: int
    median_ns: float
    minimum_ns: float
    ratio: float | None
    size: int
    numbers: int
    remark: str = ""

    def as_data(self) -> dict[str, Any]:
        """For a JSON file."""
        return asdict(self)


@dataclass(frozen=True)
class Table:
    """What the rows of one table share; the fields are `Row`'s."""

    section: str
    robot: str
    quantity: str
    numbers: int
    size: int = 0


def measure(table: Table, works: Sequence[Work], rounds: int, baseline: Work | None = None) -> list[Row]:
    """Time `works`, each once a round, in another order in each round.

    Args:
        table: What the rows share.
        works: Contenders, computed once before, so that nothing is compiled here.
        rounds: At least one.
        baseline: The one of `works` that the others are held against.
    """
    times: dict[str, list[float]] = {work.who: [] for work in works}
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
                times[work.who].append((time.perf_counter() - begin) / work.n * 1e9)
    finally:
        if collecting:
            gc.enable()
    medians = {who: statistics.median(values) for who, values in times.items()}
    return [
        Row(
            section=table.section,
            robot=table.robot,
            quantity=table.quantity,
            who=work.who,
            n=work.n,
            median_ns=round(medians[work.who], 3),
            minimum_ns=round(min(times[work.who]), 3),
            ratio=None if baseline is None else round(medians[baseline.who] / medians[work.who], 3),
            size=table.size,
            numbers=table.numbers,
            remark=work.remark,
        )
        for work in works
    ]
