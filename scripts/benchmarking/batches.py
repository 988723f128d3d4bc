"""Batches: everyone's Jacobians and accelerations of the same configurations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from scripts.benchmarking.clock import Row, Table, measure
from scripts.benchmarking.contenders import Contender
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.work import agree


def batch_rows(subject: Subject, contenders: Sequence[Contender], rounds: int) -> Iterator[Row]:
    """Every contender, results first; ratios are to Pinocchio's Python loop.

    Raises:
        DifferenceError: contenders disagree.
    """
    from scripts.benchmarking.contenders.pinocchio_loop import LOOP  # noqa: PLC0415
    from scripts.benchmarking.contenders.pinocchio_processes import PROCESSES  # noqa: PLC0415

    for quantity in QUANTITIES:
        works = [work for c in contenders if c.module for work in c.module.batches(subject, quantity)]
        named = {work.who: work for work in works}
        # The processes compute the whole batch, so that every row of everyone's result is held.
        agree(works, named[PROCESSES], f"{subject.name}, {quantity}")
        table = Table("batch", subject.name, quantity, subject.numbers(quantity), subject.n)
        yield from measure(table, works, rounds, named[LOOP])
