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

from scripts.benchmarking.workload import Workload
from urdfkin.model.tree import FloatArray

#: Maximum allowed difference from the reference contender (m, rad, m/s^2, rad/s^2). Rounding errors are much
#: smaller than this difference.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class TimedTask:
    label: str
    n: int  # number of configurations that one call of `compute` computes
    compute: Callable[[], object]
    #: Function that returns the results in urdfkin's conventions; None: the results are not compared.
    result: Callable[[], FloatArray] | None = None
    tolerance: float = TOLERANCE
    remark: str = ""


@dataclass(frozen=True)
class Row:
    """The measurements of one contender."""

    section: str
    robot: str
    quantity: str
    numbers: int  # number of values in one result
    size: int = 0  # number of joints, frames or configurations, in a section that varies this number
    label: str = ""
    n: int = 0  # number of configurations in a call
    median_ns: float = 0.0
    minimum_ns: float = 0.0
    #: Median time of the baseline, divided by the median time of the contender.
    ratio: float | None = None
    remark: str = ""


class DifferenceError(Exception):
    """The results of contenders differ."""


def check_agreement(tasks: Sequence[TimedTask], reference: TimedTask, title: str) -> None:
    """Compare all results with the result of `reference`."""
    if reference.result is None:
        raise ValueError("the reference has no result")
    reference.compute()
    expected = np.array(reference.result())
    for task in tasks:
        task.compute()
        if task.result is None:
            continue
        ours = task.result()
        n = min(len(ours), len(expected))
        ours, theirs = ours[:n], expected[:n]
        if ours.shape != theirs.shape:
            raise DifferenceError(f"{title}: {task.label} has the shape {ours.shape}, not {theirs.shape}")
        if not np.allclose(ours, theirs, rtol=0.0, atol=task.tolerance):
            worst = float(np.abs(ours - theirs).max())
            raise DifferenceError(f"{title}: {task.label} and {reference.label} differ by {worst:.3g}")


def measure_times(
    tasks: Sequence[TimedTask], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, FloatArray]:
    """Return the time (ns) for one configuration in each round, by task."""
    times: dict[str, list[float]] = {task.label: [] for task in tasks}
    shuffled, order = list(tasks), random.Random(0)
    gc.disable()
    try:
        for _ in range(rounds):
            order.shuffle(shuffled)
            for task in shuffled:
                task.compute()
                begin = clock()
                task.compute()
                times[task.label].append((clock() - begin) / task.n * 1e9)
    finally:
        gc.enable()
    return {label: np.array(values) for label, values in times.items()}


def measure_rows(
    table: Row,
    tasks: Sequence[TimedTask],
    rounds: int,
    baseline: TimedTask | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> list[Row]:
    times = measure_times(tasks, rounds, clock)
    medians = {label: float(np.median(values)) for label, values in times.items()}
    return [
        replace(
            table,
            label=task.label,
            n=task.n,
            median_ns=round(medians[task.label], 3),
            minimum_ns=round(float(times[task.label].min()), 3),
            ratio=None if baseline is None else round(medians[baseline.label] / medians[task.label], 3),
            remark=task.remark,
        )
        for task in tasks
    ]


@dataclass(frozen=True)
class Calls:
    """The lines of Python that call a library; they are compiled into the body of the timed loop."""

    label: str
    #: Variables of the lines, by name. The lines can also use the variables `q`, `v` and `a`.
    names: Mapping[str, Any]
    lines: tuple[str, ...]  # The value of the last line is the result.
    #: Lines that write the result of configuration k into `out[k]`; None: the result of `lines` is written.
    store: tuple[str, ...] | None = None
    #: The library's coordinate i is urdfkin's coordinate `order[i]`.
    #: None: the same order.
    order: list[int] | None = None
    #: Shape of the library's result for one configuration.
    #: None: the shape of urdfkin's result.
    shape: tuple[int, ...] | None = None
    #: Function that converts a batch's raw results to urdfkin's conventions.
    read: Callable[[FloatArray], FloatArray] = field(default=lambda raw: raw)
    #: Function that converts a call's result to the layout of `out[k]`.
    read_one: Callable[[Any], FloatArray] = field(default=np.array)
    remark: str = ""

    def make_batch_task(self, workload: Workload, quantity: str) -> TimedTask:
        inputs = [self._reorder(x) for x in workload.inputs(quantity, workload.loop)]
        out = np.empty((workload.loop, *(self.shape or workload.result_shape(quantity))))
        loop = self.make_loop()
        run, result = lambda: loop(out, *inputs), lambda: self.read(out)
        return TimedTask(self.label, workload.loop, run, result, remark=self.remark)

    def make_loop(self) -> Callable[..., None]:
        body = self.store or (*self.lines[:-1], f"out[k] = {self.lines[-1]}")
        return _compile_function(
            self.names, "out, *inputs", "for k, (q, v, a) in enumerate(rows(inputs)):", body
        )

    def make_single_task(self, workload: Workload, quantity: str) -> TimedTask:
        inputs = [list(self._reorder(x)) for x in workload.inputs(quantity, workload.loop)]
        rows = list(_rows(inputs))
        repeat = _compile_function(self.names, "rows_", "for q, v, a in rows_:", self.lines)
        last = (*self.lines[:-1], f"return {self.lines[-1]}")
        one = _compile_function(self.names, "q, v, a", "if True:", last)

        def result() -> FloatArray:
            return self.read(np.stack([self.read_one(one(*row)) for row in rows[:20]]))

        return TimedTask(self.label, len(rows), lambda: repeat(rows), result, TOLERANCE, self.remark)

    def _reorder(self, x: FloatArray) -> FloatArray:
        return x if self.order is None else np.ascontiguousarray(x[:, self.order])


def _rows(inputs: Any) -> Any:
    """Yield (q, v, a) for each configuration. If the only input is q, yield (q, q, q)."""
    return zip(*(inputs if len(inputs) == 3 else [inputs[0]] * 3), strict=True)


def _compile_function(
    names: Mapping[str, Any], arguments: str, head: str, body: tuple[str, ...]
) -> Callable[..., Any]:
    here = {"rows": _rows, **names}
    parameters = ", ".join((arguments, *(f"{name}={name}" for name in here)))
    source = "\n".join([f"def function({parameters}):", f"    {head}", *(f"        {line}" for line in body)])
    exec(compile(source, "<calls>", "exec"), here)
    function: Callable[..., Any] = here["function"]
    return function
