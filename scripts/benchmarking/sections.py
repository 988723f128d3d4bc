"""Measure the sections of the benchmark; before each measurement, all results are compared."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from scripts.benchmarking.contenders import (
    FLOOR,
    LOOP,
    ONE,
    PROCESSES,
    Contender,
    all_joints_calls,
    pinocchio_calls,
    urdfkin_batches,
    urdfkin_calls,
)
from scripts.benchmarking.operations import operations
from scripts.benchmarking.subject import QUANTITIES, SUBJECTS, TIP, Subject, chain_urdf
from scripts.benchmarking.timing import Calls, Row, Work, agree, measure, times
from urdfkin.compiled.evaluate import make_kernel_args, uses_buffer
from urdfkin.compiled.machine import kernels
from urdfkin.compiled.machine.single import make_single_evaluator
from urdfkin.compiled.plan import INSTRUCTION_WIDTH, KernelProgram, Op, ProgramHeader, compile_program
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

STORED = "Pinocchio's cheapest calls, results stored"
NOT_STORED = "Pinocchio's cheapest calls, nothing stored"
ALL_JOINTS = "Pinocchio's calls for all joints, results stored"
ONE_PASS, ONE_BY_ONE = "urdfkin, all in one pass", "urdfkin, one after the other"


def contest_rows(section: str, n: int, contenders: Sequence[Contender], rounds: int) -> Iterator[Row]:
    """Measure Jacobians and accelerations by all contenders, compared with Pinocchio.

    The section `batch` measures batches, and `single` measures calls for one configuration. The section
    `checked` measures urdfkin's calls for one configuration with a check of each result. The section
    `verified` measures batches with a check of all results, of a sample of the results, or of no result.
    """
    for subject, quantity, table in _contests(section, n):
        what = f"{subject.name}, {'' if section == 'batch' else f'{section} '}{quantity}"
        calls = pinocchio_calls(subject.urdf, subject.frame, quantity)
        loop = calls.batch(subject, quantity)
        if section == "batch":
            works = [work for contender in contenders for work in contender.works(subject, quantity)]
            loop = next(work for work in works if work.who == PROCESSES)
            baseline = next(work for work in works if work.who == LOOP)
        elif section == "single":
            found = [one for contender in contenders for one in contender.singles(subject, quantity)]
            works = [one.single(subject, quantity) for one in found]
            baseline = next(work for work in works if work.who == LOOP)
        elif section == "checked":
            checked = urdfkin_calls(subject, quantity, verify=True)
            works = [one.single(subject, quantity) for one in (*checked, calls)]
            baseline = works[-1]
        else:
            baseline = loop = replace(loop, who=STORED)
            works = [*(_verified(subject, quantity, verify) for verify in (True, "sample", False)), loop]
            works.append(replace(calls.single(subject, quantity), who=NOT_STORED))
            if quantity == "jacobian":
                works.append(replace(all_joints_calls(subject).batch(subject, quantity), who=ALL_JOINTS))
        agree(works, loop, what)
        clock = time.perf_counter if section in ("batch", "single") else time.thread_time
        yield from measure(table, works, rounds, baseline, clock)


def operation_counts() -> Iterator[tuple[str, int]]:
    for subject, quantity, _ in _contests("operations", 1):
        yield f"{subject.name}, {quantity}", operations(subject.plan, quantity)


def _verified(subject: Subject, quantity: str, verify: bool | str) -> Work:
    method, inputs = getattr(subject.robot, quantity), subject.inputs(quantity, subject.loop)
    out = np.empty((subject.loop, *subject.width(quantity)))
    compute = partial(method, *inputs, subject.frame, out=out, verify=verify)
    return Work(f"urdfkin, verify={verify!r}", subject.loop, compute, lambda: out)


def _contests(section: str, n: int) -> Iterator[tuple[Subject, str, Row]]:
    for source in SUBJECTS:
        with Subject(*source, n) as subject:
            for quantity in QUANTITIES:
                yield subject, quantity, _table(section, subject, quantity)


def _table(section: str, subject: Subject, quantity: str, size: int = 0) -> Row:
    return Row(section, subject.name, quantity, subject.numbers(quantity), size)


def joint_rows(joints: Sequence[int], numbers: int, rounds: int) -> Iterator[Row]:
    """Measure chains of joints; the Jacobians of a batch contain about `numbers` elements."""
    for size in joints:
        n = max(numbers // (6 * size), 16)
        with Subject(chain_urdf(size), TIP, n, name=f"chain of {size}") as subject:
            yield from _growth("joints", subject, size, rounds)


def size_rows(sizes: Sequence[int], rounds: int) -> Iterator[Row]:
    for size in sizes:
        with Subject(*SUBJECTS[0], size) as subject:
            yield from _growth("sizes", subject, size, rounds)


def _growth(section: str, subject: Subject, size: int, rounds: int) -> Iterator[Row]:
    for quantity in QUANTITIES:
        works = [work for work in urdfkin_batches(subject, quantity) if work.who in (ONE, FLOOR)]
        pinocchio = pinocchio_calls(subject.urdf, subject.frame, quantity).batch(subject, quantity)
        works += [pinocchio] * (section == "joints")
        agree(works, pinocchio, f"{subject.name}, {quantity}, {size} {section}")
        baseline = pinocchio if section == "joints" else None
        yield from measure(_table(section, subject, quantity, size), works, rounds, baseline)


def frame_rows(n: int, counts: Sequence[int], rounds: int) -> Iterator[Row]:
    with Subject(*SUBJECTS[-1], n) as subject:
        robot, q, links = subject.robot, subject.q, subject.robot.link_names
        for count in sorted({min(count, len(links)) for count in counts}):
            frames = [f"link:{links[i]}" for i in np.linspace(0, len(links) - 1, count).astype(int)]
            out, every = np.empty((count, n, 4, 4)), np.empty((n, count, 4, 4))
            together = partial(robot.placement, q, frames, out=every, threads=1, verify=False)

            def apart(frames: list[str] = frames, out: FloatArray = out) -> FloatArray:
                for k, frame in enumerate(frames):
                    robot.placement(q, frame, out=out[k], threads=1, verify=False)
                return out.swapaxes(0, 1)

            works = [Work(ONE_PASS, n, together, together), Work(ONE_BY_ONE, n, apart, apart)]
            agree(works, works[1], f"{subject.name}, {count} placements")
            table = Row("frames", subject.name, "placement", 16 * count, count)
            yield from measure(table, works, rounds, works[1])


# The time of a step of a batch is the difference between the times of two kernels.
# Only one of these kernels has the step's instructions.
# For one configuration, the benchmark also measures calls that do only a part of the work.
# An example is a call with a rejected argument.
# The time of a step is a difference of these measured times.

#: The kernel's instructions for each step of a batch, in the order of the steps.
PARTS: Mapping[str, frozenset[Op]] = {
    "reading inputs": frozenset(),
    "sines and cosines": frozenset(),
    "forward recursion": frozenset(Op) - {Op.END, Op.STORE_AXIS, Op.COLUMN, Op.WRITE},
    "columns": frozenset((Op.STORE_AXIS, Op.COLUMN)),
    "writing results": frozenset((Op.WRITE,)),
}


def parts_of_batches(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time of each step of a batch, in ns for one configuration."""
    for subject, quantity, _ in _contests("where", n):
        program = compile_program(subject.plan, orientations=False, columns=quantity == "jacobian")
        works = [_core(subject, quantity, cut(program, end), part) for end, part in enumerate(PARTS, start=1)]
        if quantity == "acceleration":
            works = [work for work in works if work.who != "columns"]
        found = times(works, rounds)
        before, parts = np.zeros(rounds), {}
        for who, taken in found.items():
            parts[who], before = taken - before, taken
        yield _entry("batch", subject, quantity, parts, before)


def cut(program: KernelProgram, parts: int) -> KernelProgram:
    """Return a program with only the instructions of its first `parts` steps."""
    ops = frozenset[Op]().union(*list(PARTS.values())[:parts])
    words = program.words.copy()
    code = words[words[ProgramHeader.CODE] :].reshape(-1, INSTRUCTION_WIDTH)
    chosen = [line for line in code if Op(line[0]) in ops]
    end = np.zeros((1, INSTRUCTION_WIDTH), dtype=np.int64)
    words = np.concatenate([words[: words[ProgramHeader.CODE]], *chosen, *end])
    if parts < 2:
        words[ProgramHeader.ANGLES_END] = words[ProgramHeader.ANGLES]
    return replace(program, words=words)


def _core(subject: Subject, quantity: str, program: KernelProgram, who: str) -> Work:
    inputs = [FIXED_BASE_STATE, *subject.inputs(quantity, subject.n)]
    out = np.empty((subject.n, *subject.width(quantity)))
    buffered = who == "writing results" and uses_buffer(out)
    task, memory = make_kernel_args(program, Reference.LOCAL_WORLD_ALIGNED, inputs, out, buffered=buffered)
    core = getattr(kernels, f"{quantity}s")
    owners = program, memory, out, inputs  # The kernel arguments contain the addresses of these arrays.

    def compute(_: object = owners) -> None:
        core(task.ctypes.data)

    compute()
    return Work(who, subject.n, compute)


def parts_of_calls(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time (ns) of each step of a call for one configuration."""
    for subject, quantity, _ in _contests("where", n):
        calls = list(_calls(subject, quantity))
        works = [call.single(subject, quantity) for call in calls]
        for work in works:
            work.compute()
        loop, function, refused, array, computed, prepared, method = times(works, rounds).values()
        parts = {
            "Python's call of a method": function - loop,
            "call from this method to the forward recursion": refused - loop,
            "forward recursion": computed - refused,
            "rest of the prepared evaluator": prepared - computed - (function - loop),
            "NumPy's new array": array - loop,
            "rest of the robot's method": method - prepared - (array - loop),
        }
        yield _entry("single", subject, quantity, parts, method - loop)


class _Empty:
    def jacobian(self, q: object, out: object = None) -> object:
        return out

    def acceleration(self, q: object, v: object, a: object, out: object = None) -> object:
        return out


def _calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    q_v_a = "q" if quantity == "jacobian" else "q, v, a"
    compute, _ = make_single_evaluator(quantity, subject.plan, Reference.LOCAL_WORLD_ALIGNED)
    names = {
        "robot": subject.robot,
        "fast": subject.robot.prepare(subject.frame),
        "frame": subject.frame,
        "function": getattr(_Empty(), quantity),
        "compute": compute,
        "empty": np.empty,
        "shape": subject.width(quantity),
        "out": np.empty(subject.width(quantity)),
    }
    for line in (
        "q",  # A line without a call measures the time of the loop.
        f"function({q_v_a}, out=out)",
        f"compute({q_v_a}, shape)",  # `compute` needs an array as `out`, and rejects a tuple.
        "empty(shape)",
        f"compute({q_v_a}, out)",
        f"fast.{quantity}({q_v_a}, out=out)",
        f"robot.{quantity}({q_v_a}, frame, verify=False)",
    ):
        yield Calls(line, names, (line,))


def _entry(
    kind: str, subject: Subject, quantity: str, parts: Mapping[str, FloatArray], total: FloatArray
) -> dict[str, Any]:
    """Return the median time of each step over all rounds.

    The time of a step in a round is computed only from times that were measured in the same round.
    """
    medians = {part: round(float(np.median(taken)), 2) for part, taken in parts.items()}
    ns = round(float(np.median(total)), 2)
    return {"kind": kind, "robot": subject.name, "quantity": quantity, "ns": ns, "parts": medians}
