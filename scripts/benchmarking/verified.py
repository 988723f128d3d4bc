"""Verified batches: what it costs to have every result, or a sample of them, checked by Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from scripts.benchmarking.clock import Row, Table, measure
from scripts.benchmarking.contenders.pinocchio_loop import oracle_calls, pinocchio_calls
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.work import Work, agree

#: Pinocchio's own part of a check.
OWN = "Pinocchio's own calls, Python loop"
FEWEST = "Pinocchio, computeFrameJacobian, Python loop"


def verified_rows(subject: Subject, rounds: int) -> Iterator[Row]:
    """A verified batch against the calls that its check makes; ratios are to those.

    Raises:
        DifferenceError: contenders disagree.
    """
    for quantity in QUANTITIES:
        method, inputs = getattr(subject.robot, quantity), subject.inputs(quantity, subject.loop)
        out = np.empty((subject.loop, *subject.width(quantity)))

        def work(
            verify: bool | str,
            method: Callable[..., object] = method,
            inputs: tuple[object, ...] = inputs,
            out: np.ndarray = out,
        ) -> Work:
            return Work(
                f"urdfkin, verify={verify!r}",
                subject.loop,
                lambda: method(*inputs, subject.frame, out=out, verify=verify),
                lambda: out,
            )

        own = _named(oracle_calls(subject, quantity).batch(subject, quantity), OWN)
        works = [work(True), work("sample"), work(False), own]
        if quantity == "jacobian":
            fewest = pinocchio_calls(subject.urdf, subject.frame, quantity).batch(subject, quantity)
            works.append(_named(fewest, FEWEST))
        agree(works, own, f"{subject.name}, verified {quantity}")
        table = Table("verified", subject.name, quantity, subject.numbers(quantity), subject.loop)
        yield from measure(table, works, rounds, own)


def _named(work: Work, who: str) -> Work:
    return Work(who, work.n, work.compute, work.result, work.tolerance, work.remark)
