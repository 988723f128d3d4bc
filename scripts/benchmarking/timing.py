"""Measure the run time of each compared library, and check that all libraries compute the same numbers.

Each round measures every library once, in a different order. Ratios are therefore reliable on a noisy
machine, and absolute times are not. Before each timed run, the contender computes once without timing. The
processor's cache then contains the contender's data, and the threads of other contenders are idle.
"""

import gc
import random
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from scripts.benchmarking.subject import Subject
from urdfkin.model.tree import FloatArray

#: Allowed difference (m, rad, m/s^2, rad/s^2) between contenders; it is much larger than rounding.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Work:
    """A timed task; `compute` uses the first `n` configurations of the subject."""

    who: str
    n: int
    compute: Callable[[], object]
    #: Function that returns the results in urdfkin's conventions; None if there is nothing to compare.
    result: Callable[[], FloatArray] | None = None
    tolerance: float = TOLERANCE
    remark: str = ""


@dataclass(frozen=True)
class Row:
    """A row of a table: the measurements of one contender.

    `numbers` is the number of values in the result for one configuration, and `n` is the number of
    configurations of a call. The table varies `size`, a number of joints, frames or configurations.
    """

    section: str
    robot: str
    quantity: str
    numbers: int
    size: int = 0
    who: str = ""
    n: int = 0
    median_ns: float = 0.0
    minimum_ns: float = 0.0
    #: Median time of the baseline, divided by the median time of the contender.
    ratio: float | None = None
    remark: str = ""


class DifferenceError(Exception):
    """The results of contenders differ, so their times are not comparable."""


def agree(works: Sequence[Work], reference: Work, what: str) -> None:
    """Compute all results once as a warm-up; raise DifferenceError if one differs from `reference`."""
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


def times(
    works: Sequence[Work], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, FloatArray]:
    """Return the times (ns) for one configuration, one for each round."""
    found: dict[str, list[float]] = {work.who: [] for work in works}
    shuffled, order = list(works), random.Random(0)
    gc.disable()
    try:
        for _ in range(rounds):
            order.shuffle(shuffled)
            for work in shuffled:
                work.compute()
                begin = clock()
                work.compute()
                found[work.who].append((clock() - begin) / work.n * 1e9)
    finally:
        gc.enable()
    return {who: np.array(values) for who, values in found.items()}


def measure(
    table: Row,
    works: Sequence[Work],
    rounds: int,
    baseline: Work | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> list[Row]:
    """Measure tasks that have already run once, so that their kernels are compiled."""
    found = times(works, rounds, clock)
    medians = {who: float(np.median(values)) for who, values in found.items()}
    return [
        replace(
            table,
            who=work.who,
            n=work.n,
            median_ns=round(medians[work.who], 3),
            minimum_ns=round(float(found[work.who].min()), 3),
            ratio=None if baseline is None else round(medians[baseline.who] / medians[work.who], 3),
            remark=work.remark,
        )
        for work in works
    ]


@dataclass(frozen=True)
class Calls:
    """The lines of Python that call a library for one configuration.

    The lines become the body of a loop, so the measured time includes no call of the benchmark itself.
    """

    who: str
    names: Mapping[str, Any]  # The lines use these variables, and `q`, `v` and `a`.
    lines: tuple[str, ...]  # The value of the last line is the result.
    #: Lines that write the result of configuration k into `out[k]`; None writes the value of the last line.
    store: tuple[str, ...] | None = None
    #: Index in urdfkin of each coordinate of the library; None if the orders are equal.
    order: list[int] | None = None
    #: Shape of one configuration's result in a batch; None means urdfkin's shape.
    shape: tuple[int, ...] | None = None
    #: Converts a batch's raw results to urdfkin's conventions.
    read: Callable[[FloatArray], FloatArray] = field(default=lambda raw: raw)
    #: Converts the value of the last line to an array with the layout of one row of a batch.
    read_one: Callable[[Any], FloatArray] = field(default=np.array)
    remark: str = ""

    def batch(self, subject: Subject, quantity: str) -> Work:
        inputs = [self._ordered(x) for x in subject.inputs(quantity, subject.loop)]
        out = np.empty((subject.loop, *(self.shape or subject.width(quantity))))
        loop = self.loop()
        run, result = lambda: loop(out, *inputs), lambda: self.read(out)
        return Work(self.who, subject.loop, run, result, remark=self.remark)

    def loop(self) -> Callable[..., None]:
        """Return a function that loops over a batch; it writes the results to `out`."""
        body = self.store or (*self.lines[:-1], f"out[k] = {self.lines[-1]}")
        return _function(self.names, "out, *inputs", "for k, (q, v, a) in enumerate(rows(inputs)):", body)

    def single(self, subject: Subject, quantity: str) -> Work:
        """Return the timed task for single calls; their results are not stored."""
        inputs = [list(self._ordered(x)) for x in subject.inputs(quantity, subject.loop)]
        rows = list(_rows(inputs))
        repeat = _function(self.names, "rows_", "for q, v, a in rows_:", self.lines)
        last = (*self.lines[:-1], f"return {self.lines[-1]}")
        one = _function(self.names, "q, v, a", "if True:", last)

        def result() -> FloatArray:
            return self.read(np.stack([self.read_one(one(*row)) for row in rows[:20]]))

        return Work(self.who, len(rows), lambda: repeat(rows), result, TOLERANCE, self.remark)

    def _ordered(self, x: FloatArray) -> FloatArray:
        return x if self.order is None else np.ascontiguousarray(x[:, self.order])


def _rows(inputs: Any) -> Any:
    """Yield (q, v, a) for each configuration, or (q, q, q) if q is the only input."""
    return zip(*(inputs if len(inputs) == 3 else [inputs[0]] * 3), strict=True)


def _function(
    names: Mapping[str, Any], arguments: str, head: str, body: tuple[str, ...]
) -> Callable[..., Any]:
    """Compile a function: first the line `head`, then the indented lines `body`, which may use `names`."""
    here = {"rows": _rows, **names}
    parameters = ", ".join((arguments, *(f"{name}={name}" for name in here)))
    source = "\n".join([f"def function({parameters}):", f"    {head}", *(f"        {line}" for line in body)])
    exec(compile(source, "<calls>", "exec"), here)
    function: Callable[..., Any] = here["function"]
    return function
