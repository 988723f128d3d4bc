"""Single calls from Python, all overhead included."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from scripts.benchmarking.clock import Row, Table, measure
from scripts.benchmarking.contenders import Contender
from scripts.benchmarking.contenders.pinocchio_loop import pinocchio_calls
from scripts.benchmarking.subject import QUANTITIES, Subject
from scripts.benchmarking.work import agree


def single_rows(subject: Subject, contenders: Sequence[Contender], rounds: int) -> Iterator[Row]:
    """Every contender that takes one configuration; ratios are to Pinocchio's calls.

    Raises:
        DifferenceError: contenders disagree.
    """
    for quantity in QUANTITIES:
        modules = [c.module for c in contenders if hasattr(c.module, "calls")]
        calls = [one for module in modules for one in module.calls(subject, quantity)]
        works = [one.single(subject, quantity) for one in calls]
        reference = pinocchio_calls(subject.urdf, subject.frame, quantity)
        what = f"{subject.name}, single {quantity}"
        agree(works, reference.batch(subject, quantity), what)
        baseline = next(work for work in works if work.who == reference.who)
        table = Table("single", subject.name, quantity, subject.numbers(quantity), 1)
        yield from measure(table, works, rounds, baseline)
