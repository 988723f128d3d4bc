"""urdfkin: one thread, every thread, and into fresh memory; with them the floor, an array written once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work
from urdfkin.tree import FloatArray

LIBRARY = "urdfkin"
ONE = "urdfkin, 1 thread"
FRESH = "urdfkin, 1 thread, no out="
FLOOR = "output written once (fill)"
THREADS = len(os.sched_getaffinity(0))
SEVERAL = f"urdfkin, {THREADS} threads"


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """The batch in one call."""
    method = getattr(subject.robot, quantity)
    inputs = subject.inputs(quantity, subject.n)
    out = np.empty((subject.n, *subject.width(quantity)))
    last: list[FloatArray] = []

    def into(threads: int) -> Callable[[], object]:
        return lambda: method(*inputs, subject.frame, out=out, threads=threads, verify=False)

    def fresh() -> None:
        last[:] = [method(*inputs, subject.frame, threads=1, verify=False)]

    yield Work(ONE, subject.n, into(1), lambda: out)
    if THREADS > 1:
        yield Work(SEVERAL, subject.n, into(THREADS), lambda: out)
    yield Work(FRESH, subject.n, fresh, lambda: last[0])
    floor = np.empty_like(out)
    yield Work(FLOOR, subject.n, lambda: floor.fill(1.0))


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """One configuration at a time: the method, and the prepared form with and without `out=`."""
    robot, arguments = subject.robot, "q" if quantity == "jacobian" else "q, v, a"
    names = {"robot": robot, "frame": subject.frame, "out": np.empty(subject.width(quantity))}
    yield Calls(
        f"urdfkin, robot.{quantity}(verify=False)",
        names,
        (f"robot.{quantity}({arguments}, frame, verify=False)",),
    )
    if hasattr(robot, "prepare"):
        names["fast"] = robot.prepare(subject.frame)
        yield Calls(f"urdfkin, prepared.{quantity}", names, (f"fast.{quantity}({arguments})",))
        yield Calls(
            f"urdfkin, prepared.{quantity}(out=)",
            names,
            (f"fast.{quantity}({arguments}, out=out)",),
        )
