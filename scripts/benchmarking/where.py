"""Measure how the time of a batch, and of a single call, is divided among its parts.

The forward recursion is a program of a few instructions (`urdfkin.compiled.plan`). To measure a part, the
program runs with the instructions of this part and without them. The difference of the two times is the time
of the part. The parts of a single call are measured with calls that stop early, such as a call of an empty
Python function and a call with rejected arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.subject import QUANTITIES, SUBJECTS, Subject
from scripts.benchmarking.timing import Work, times
from urdfkin.compiled.evaluate import is_staged, task_of
from urdfkin.compiled.machine import kernels
from urdfkin.compiled.machine.single import single
from urdfkin.compiled.plan import WIDTH, Head, Op, Program, program_of
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

#: For each part of a batch computation: the instructions of this part.
#: The script adds the parts in this order.
PARTS: Mapping[str, frozenset[Op]] = {
    "reading inputs": frozenset(),
    "sines and cosines": frozenset(),
    "forward recursion": frozenset(Op) - {Op.END, Op.KEEP, Op.COLUMN, Op.EMIT},
    "columns": frozenset((Op.KEEP, Op.COLUMN)),
    "writing results": frozenset((Op.EMIT,)),
}


def parts_of_batches(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time of each part of a batch, in ns for one configuration, with one thread."""
    for subject, quantity in _subjects(n):
        program = program_of(subject.plan, turned=False, columns=quantity == "jacobian")
        works = [_core(subject, quantity, cut(program, end), part) for end, part in enumerate(PARTS, start=1)]
        if quantity == "acceleration":
            # an acceleration has no Jacobian columns to compute
            works = [work for work in works if work.who != "columns"]
        found = _times(works, rounds)
        before, parts = np.zeros(rounds), {}
        for who, taken in found.items():
            parts[who], before = taken - before, taken
        yield _entry("batch", subject, quantity, parts, before)


def cut(program: Program, parts: int) -> Program:
    """Return the first parts of a program."""
    ops = frozenset[Op]().union(*list(PARTS.values())[:parts])
    words = program.words.copy()
    code = words[words[Head.CODE] :].reshape(-1, WIDTH)
    chosen = [line for line in code if Op(line[0]) in ops]
    end = np.zeros((1, WIDTH), dtype=np.int64)  # an instruction with the operation Op.END
    words = np.concatenate([words[: words[Head.CODE]], *chosen, *end])
    if parts < 2:
        words[Head.ANGLES_END] = words[Head.ANGLES]
    return replace(program, words=words)


def _core(subject: Subject, quantity: str, program: Program, who: str) -> Work:
    """Return the timed task in which a kernel computes a whole batch."""
    inputs = [STILL_STATE, *subject.inputs(quantity, subject.n)]
    out = np.empty((subject.n, *subject.width(quantity)))
    staged = who == "writing results" and is_staged(out)
    task, memory = task_of(program, Reference.LOCAL_WORLD_ALIGNED, inputs, out, staged=staged)
    core = getattr(kernels, f"{quantity}s")
    owners = program, memory, out, inputs  # the kernel arguments contain the addresses of these arrays

    def compute(_: object = owners) -> None:
        core(task.ctypes.data)

    compute()
    return Work(who, subject.n, compute)


# -- single calls ----------------------------------------------------------------------------------------


def parts_of_calls(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time (ns) of each part of a single call, for a prepared frame and for the robot's method."""
    for subject, quantity in _subjects(n):
        calls = list(_calls(subject, quantity))
        works = [call.single(subject, quantity) for call in calls]
        for work in works:
            work.compute()
        loop, function, refused, array, computed, prepared, method = _times(works, rounds).values()
        parts = {
            "Python's call of a method": function - loop,
            "its call of the forward recursion": refused - loop,
            "forward recursion": computed - refused,
            "rest of the prepared evaluator": prepared - computed - (function - loop),
            "NumPy's new array": array - loop,
            "rest of the robot's method": method - prepared - (array - loop),
        }
        yield _entry("single", subject, quantity, parts, method - loop)


def _calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    q_v_a = "q" if quantity == "jacobian" else "q, v, a"
    compute, _ = single(quantity, subject.plan, Reference.LOCAL_WORLD_ALIGNED)
    names = {
        "robot": subject.robot,
        "fast": subject.robot.prepare(subject.frame),
        "frame": subject.frame,
        "function": _function(quantity),
        "compute": compute,
        "empty": np.empty,
        "shape": subject.width(quantity),
        "out": np.empty(subject.width(quantity)),
    }
    for line in (
        "q",  # an expression without a call measures the cost of the loop
        f"function({q_v_a}, out=out)",
        f"compute({q_v_a}, shape)",  # a tuple is rejected after the check of the arrays
        "empty(shape)",
        f"compute({q_v_a}, out)",
        f"fast.{quantity}({q_v_a}, out=out)",
        f"robot.{quantity}({q_v_a}, frame, verify=False)",
    ):
        yield Calls(line, names, (line,))


def _function(quantity: str) -> Callable[..., object]:
    """Return a method without code that has the same arguments as a prepared frame's method."""

    class Empty:
        def jacobian(self, q: object, out: object = None) -> object:
            return out

        def acceleration(self, q: object, v: object, a: object, out: object = None) -> object:
            return out

    method: Callable[..., object] = getattr(Empty(), quantity)
    return method


# -- for batches and for single calls --------------------------------------------------------------------


def _subjects(n: int) -> Iterator[tuple[Subject, str]]:
    for source in SUBJECTS:
        with Subject(*source, n) as subject:
            for quantity in QUANTITIES:
                yield subject, quantity


def _times(works: list[Work], rounds: int) -> dict[str, FloatArray]:
    return {who: np.array(values) for who, values in times(works, rounds).items()}


def _entry(
    kind: str, subject: Subject, quantity: str, parts: Mapping[str, FloatArray], total: FloatArray
) -> dict[str, Any]:
    """Return the medians over all rounds.

    Two times are subtracted only within a round, so that other load of the machine affects both times
    equally.
    """
    medians = {part: round(float(np.median(taken)), 2) for part, taken in parts.items()}
    ns = round(float(np.median(total)), 2)
    return {"kind": kind, "robot": subject.name, "quantity": quantity, "ns": ns, "parts": medians}
