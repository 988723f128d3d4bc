"""Measure the sections of the benchmark.

Before each measurement, the results of all contenders are compared.
"""

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
    urdfkin_calls,
    urdfkin_tasks,
)
from scripts.benchmarking.operations import count_operations
from scripts.benchmarking.timing import Calls, Row, TimedTask, check_agreement, measure_rows, measure_times
from scripts.benchmarking.workload import QUANTITIES, ROBOT_FRAMES, TIP, Workload, chain_urdf
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


def contender_rows(section: str, n: int, contenders: Sequence[Contender], rounds: int) -> Iterator[Row]:
    """Measure the time for Jacobians and accelerations, for one section of the page.

    | section | libraries | calls |
    |---|---|---|
    | `batch` | all | batches |
    | `single` | all | one configuration |
    | `checked` | urdfkin, Pinocchio | one configuration; urdfkin checks each result |
    | `verified` | urdfkin, Pinocchio | batches with `verify=True`, `"sample"` and False |
    """
    for workload, quantity, table in _open_workloads(section, n):
        title = f"{workload.name}, {'' if section == 'batch' else f'{section} '}{quantity}"
        calls = pinocchio_calls(workload.urdf, workload.frame, quantity)
        loop = calls.make_batch_task(workload, quantity)
        if section == "batch":
            tasks = [task for contender in contenders for task in contender.make_tasks(workload, quantity)]
            loop = next(task for task in tasks if task.label == PROCESSES)
            baseline = next(task for task in tasks if task.label == LOOP)
        elif section == "single":
            single_calls = [
                call for contender in contenders for call in contender.make_single_calls(workload, quantity)
            ]
            tasks = [call.make_single_task(workload, quantity) for call in single_calls]
            baseline = next(task for task in tasks if task.label == LOOP)
        elif section == "checked":
            checked = urdfkin_calls(workload, quantity, verify=True)
            tasks = [call.make_single_task(workload, quantity) for call in (*checked, calls)]
            baseline = tasks[-1]
        else:
            baseline = loop = replace(loop, label=STORED)
            tasks = [
                *(_make_checked_task(workload, quantity, verify) for verify in (True, "sample", False)),
                loop,
            ]
            tasks.append(replace(calls.make_single_task(workload, quantity), label=NOT_STORED))
            if quantity == "jacobian":
                tasks.append(
                    replace(all_joints_calls(workload).make_batch_task(workload, quantity), label=ALL_JOINTS)
                )
        check_agreement(tasks, loop, title)
        clock = time.perf_counter if section in ("batch", "single") else time.thread_time
        yield from measure_rows(table, tasks, rounds, baseline, clock)


def operation_counts() -> Iterator[tuple[str, int]]:
    for workload, quantity, _ in _open_workloads("operations", 1):
        yield f"{workload.name}, {quantity}", count_operations(workload.plan, quantity)


def _make_checked_task(workload: Workload, quantity: str, verify: bool | str) -> TimedTask:
    method, inputs = getattr(workload.robot, quantity), workload.inputs(quantity, workload.loop)
    out = np.empty((workload.loop, *workload.result_shape(quantity)))
    compute = partial(method, *inputs, workload.frame, out=out, verify=verify)
    return TimedTask(f"urdfkin, verify={verify!r}", workload.loop, compute, lambda: out)


def _open_workloads(section: str, n: int) -> Iterator[tuple[Workload, str, Row]]:
    for source in ROBOT_FRAMES:
        with Workload(*source, n) as workload:
            for quantity in QUANTITIES:
                yield workload, quantity, _make_row(section, workload, quantity)


def _make_row(section: str, workload: Workload, quantity: str, size: int = 0) -> Row:
    return Row(section, workload.name, quantity, workload.result_size(quantity), size)


def joint_rows(joints: Sequence[int], numbers: int, rounds: int) -> Iterator[Row]:
    """Measure chains with the given numbers of joints.

    The Jacobians of a batch have about `numbers` elements in total. A batch has at least 16 configurations.
    """
    for size in joints:
        n = max(numbers // (6 * size), 16)
        with Workload(chain_urdf(size), TIP, n, name=f"chain of {size}") as workload:
            yield from _growth_rows("joints", workload, size, rounds)


def size_rows(sizes: Sequence[int], rounds: int) -> Iterator[Row]:
    for size in sizes:
        with Workload(*ROBOT_FRAMES[0], size) as workload:
            yield from _growth_rows("sizes", workload, size, rounds)


def _growth_rows(section: str, workload: Workload, size: int, rounds: int) -> Iterator[Row]:
    for quantity in QUANTITIES:
        tasks = [task for task in urdfkin_tasks(workload, quantity) if task.label in (ONE, FLOOR)]
        pinocchio = pinocchio_calls(workload.urdf, workload.frame, quantity).make_batch_task(
            workload, quantity
        )
        tasks += [pinocchio] * (section == "joints")
        check_agreement(tasks, pinocchio, f"{workload.name}, {quantity}, {size} {section}")
        baseline = pinocchio if section == "joints" else None
        yield from measure_rows(_make_row(section, workload, quantity, size), tasks, rounds, baseline)


def frame_rows(n: int, counts: Sequence[int], rounds: int) -> Iterator[Row]:
    with Workload(*ROBOT_FRAMES[-1], n) as workload:
        robot, q, links = workload.robot, workload.q, workload.robot.link_names
        for count in sorted({min(count, len(links)) for count in counts}):
            frames = [f"link:{links[i]}" for i in np.linspace(0, len(links) - 1, count).astype(int)]
            out, every = np.empty((count, n, 4, 4)), np.empty((n, count, 4, 4))
            together = partial(robot.placement, q, frames, out=every, threads=1, verify=False)

            def apart(frames: list[str] = frames, out: FloatArray = out) -> FloatArray:
                for k, frame in enumerate(frames):
                    robot.placement(q, frame, out=out[k], threads=1, verify=False)
                return out.swapaxes(0, 1)

            tasks = [TimedTask(ONE_PASS, n, together, together), TimedTask(ONE_BY_ONE, n, apart, apart)]
            check_agreement(tasks, tasks[1], f"{workload.name}, {count} placements")
            table = Row("frames", workload.name, "placement", 16 * count, count)
            yield from measure_rows(table, tasks, rounds, tasks[1])


# For a batch, the benchmark measures kernels that have only the first k steps, for each k. The time of step k
# is the time for k steps, minus the time for k - 1 steps. For one configuration, the benchmark measures seven
# lines of Python (`_calls`). The time of a step follows from differences between the times of the lines.

#: Maps each step of a batch to the instructions of the compiled program that execute this step.
PARTS: Mapping[str, frozenset[Op]] = {
    "reading inputs": frozenset(),
    "sines and cosines": frozenset(),
    "forward recursion": frozenset(Op) - {Op.END, Op.STORE_AXIS, Op.COLUMN, Op.WRITE},
    "columns": frozenset((Op.STORE_AXIS, Op.COLUMN)),
    "writing results": frozenset((Op.WRITE,)),
}


def batch_step_times(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time of each step (ns per configuration), for each robot and quantity."""
    for workload, quantity, _ in _open_workloads("where", n):
        program = compile_program(workload.plan, orientations=False, columns=quantity == "jacobian")
        tasks = [
            _make_kernel_task(workload, quantity, truncate_program(program, end), part)
            for end, part in enumerate(PARTS, start=1)
        ]
        if quantity == "acceleration":
            tasks = [task for task in tasks if task.label != "columns"]
        times = measure_times(tasks, rounds)
        before, parts = np.zeros(rounds), {}
        for label, total in times.items():
            parts[label], before = total - before, total
        yield _make_entry("batch", workload, quantity, parts, before)


def truncate_program(program: KernelProgram, parts: int) -> KernelProgram:
    ops = frozenset[Op]().union(*list(PARTS.values())[:parts])
    words = program.words.copy()
    code = words[words[ProgramHeader.CODE] :].reshape(-1, INSTRUCTION_WIDTH)
    chosen = [line for line in code if Op(line[0]) in ops]
    end = np.zeros((1, INSTRUCTION_WIDTH), dtype=np.int64)
    words = np.concatenate([words[: words[ProgramHeader.CODE]], *chosen, *end])
    if parts < 2:
        words[ProgramHeader.ANGLES_END] = words[ProgramHeader.ANGLES]
    return replace(program, words=words)


def _make_kernel_task(workload: Workload, quantity: str, program: KernelProgram, label: str) -> TimedTask:
    inputs = [FIXED_BASE_STATE, *workload.inputs(quantity, workload.n)]
    out = np.empty((workload.n, *workload.result_shape(quantity)))
    buffered = label == "writing results" and uses_buffer(out)
    kernel_args, memory = make_kernel_args(
        program, Reference.LOCAL_WORLD_ALIGNED, inputs, out, buffered=buffered
    )
    core = getattr(kernels, f"{quantity}s")
    # The kernel arguments contain only addresses of the arrays in `owners`, so the default argument keeps
    # these arrays alive.
    owners = program, memory, out, inputs

    def compute(_: object = owners) -> None:
        core(kernel_args.ctypes.data)

    compute()
    return TimedTask(label, workload.n, compute)


def call_step_times(n: int, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield the time (ns) of each step of a call for one configuration."""
    for workload, quantity, _ in _open_workloads("where", n):
        calls = list(_calls(workload, quantity))
        tasks = [call.make_single_task(workload, quantity) for call in calls]
        for task in tasks:
            task.compute()
        loop, function, refused, array, computed, prepared, method = measure_times(tasks, rounds).values()
        parts = {
            "Python's call of a method": function - loop,
            "the method's call of the forward recursion": refused - loop,
            "forward recursion": computed - refused,
            "rest of the prepared evaluator": prepared - computed - (function - loop),
            "NumPy's new array": array - loop,
            "rest of the robot's method": method - prepared - (array - loop),
        }
        yield _make_entry("single", workload, quantity, parts, method - loop)


class _NoOperation:
    def jacobian(self, q: object, out: object = None) -> object:
        return out

    def acceleration(self, q: object, v: object, a: object, out: object = None) -> object:
        return out


def _calls(workload: Workload, quantity: str) -> Iterator[Calls]:
    q_v_a = "q" if quantity == "jacobian" else "q, v, a"
    compute, _ = make_single_evaluator(quantity, workload.plan, Reference.LOCAL_WORLD_ALIGNED)
    names = {
        "robot": workload.robot,
        "fast": workload.robot.prepare(workload.frame),
        "frame": workload.frame,
        "function": getattr(_NoOperation(), quantity),
        "compute": compute,
        "empty": np.empty,
        "shape": workload.result_shape(quantity),
        "out": np.empty(workload.result_shape(quantity)),
    }
    for line in (
        "q",  # This line calls no function, so the measured time is the time of the loop.
        f"function({q_v_a}, out=out)",
        f"compute({q_v_a}, shape)",  # `compute` rejects a tuple as `out`.
        "empty(shape)",
        f"compute({q_v_a}, out)",
        f"fast.{quantity}({q_v_a}, out=out)",
        f"robot.{quantity}({q_v_a}, frame, verify=False)",
    ):
        yield Calls(line, names, (line,))


def _make_entry(
    kind: str, workload: Workload, quantity: str, parts: Mapping[str, FloatArray], total: FloatArray
) -> dict[str, Any]:
    medians = {part: round(float(np.median(taken)), 2) for part, taken in parts.items()}
    ns = round(float(np.median(total)), 2)
    return {"kind": kind, "robot": workload.name, "quantity": quantity, "ns": ns, "parts": medians}
