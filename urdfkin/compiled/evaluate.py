"""Compute placements, velocities, accelerations and Jacobians of arrays of configurations.

Inputs have the shapes (n, nq) and (n, nv). The functions of this module do not check the shapes. Small
batches are computed with Python numbers, and large batches by a compiled kernel. The module `preload` decides
when a kernel is used. Results are exactly the same doubles for each method and for any number of threads.

| function | result | shape | equations |
|---|---|---|---|
| `placements` | T_world_frame | (n, frames, 4, 4) | 7.77 |
| `velocities` | [linear; angular] | (n, frames, 6) | 7.127, 7.128 |
| `accelerations` | classical [linear; angular] | (n, frames, 6) | 7.129, 7.130 |
| `jacobians` | Jacobian | (n, frames, 6, nv) | 7.85 |
| `jacobian_rates` | time derivative of the Jacobian | (n, frames, 6, nv) | 7.126 |
| `hessians` | [..., i, j]: derivative of column i with respect to joint motion j | (n, frames, 6, nv, nv) | |
| `imus` | [proper acceleration; angular velocity], in frame axes | (n, frames, 6) | |
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled import preload, recursions
from urdfkin.compiled.plan import (
    LANES,
    REFERENCES,
    CompiledTree,
    KernelArgs,
    KernelProgram,
    address,
    aligned_empty,
    compile_program,
    make_scratch,
)
from urdfkin.compiled.python_numbers import NO_OVERFLOW_BOUND
from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.errors.validators import as_int
from urdfkin.model.base_motion import FIXED_BASE_STATE, subtract_gravity
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
_INPUT_ARGS = KernelArgs.BASE, KernelArgs.Q, KernelArgs.V, KernelArgs.A
#: Results of at least this size (bytes) bypass the caches, because they would not fit into them.
_MIN_BUFFERED_BYTES = 2 << 20
#: Maximum size of a kernel's buffer. 3072 doubles are 24 KiB, half of a first-level cache of 48 KiB.
_MAX_BUFFER_DOUBLES = 3072

_STRIDE_ARGS = KernelArgs.STRIDE_BASE, KernelArgs.STRIDE_Q, KernelArgs.STRIDE_V, KernelArgs.STRIDE_A


class EvaluateOptions(TypedDict, total=False):
    """Keyword arguments of the functions that compute a batch, such as `placements`.

    Attributes:
        base: State of the base, (n, 24) or (1, 24).
        out: C-contiguous float64 array for the result.
        keep_in_cache: Whether the caller reads the results immediately.
    """

    base: FloatArray
    out: FloatArray | None
    threads: int | None
    keep_in_cache: bool


def placements(plan: CompiledTree, q: FloatArray, **options: Unpack[EvaluateOptions]) -> FloatArray:
    program = compile_program(plan, orientations=True)
    return _compute("placements", plan, program, [q], _ALIGNED, (4, 4), **options)


def velocities(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    reference: Reference = _ALIGNED,
    **options: Unpack[EvaluateOptions],
) -> FloatArray:
    local = reference.own_axes
    name = "local_velocities" if local else "velocities"
    return _compute(name, plan, compile_program(plan, orientations=local), [q, v], reference, (6,), **options)


def accelerations(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference = _ALIGNED,
    **options: Unpack[EvaluateOptions],
) -> FloatArray:
    local = reference.own_axes
    name = "local_accelerations" if local else "accelerations"
    return _compute(
        name, plan, compile_program(plan, orientations=local), [q, v, a], reference, (6,), **options
    )


def jacobians(
    plan: CompiledTree, q: FloatArray, reference: Reference = _ALIGNED, **options: Unpack[EvaluateOptions]
) -> FloatArray:
    program = compile_program(plan, orientations=reference.own_axes, columns=True)
    return _compute("jacobians", plan, program, [q], reference, (6, plan.nv), **options)


def jacobian_rates(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    reference: Reference = _ALIGNED,
    **options: Unpack[EvaluateOptions],
) -> FloatArray:
    program = compile_program(plan, orientations=reference.own_axes, columns=True)
    return _compute("jacobian_rates", plan, program, [q, v], reference, (6, plan.nv), **options)


def hessians(
    plan: CompiledTree, q: FloatArray, reference: Reference = _ALIGNED, **options: Unpack[EvaluateOptions]
) -> FloatArray:
    program = compile_program(plan, orientations=reference.own_axes, columns=True, hessian=True)
    return _compute("hessians", plan, program, [q], reference, (6, plan.nv, plan.nv), **options)


def imus(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    *,
    gravity: FloatArray,
    **options: Unpack[EvaluateOptions],
) -> FloatArray:
    options["base"] = subtract_gravity(options.get("base", FIXED_BASE_STATE), gravity)
    program = compile_program(plan, orientations=True)
    return _compute("imus", plan, program, [q, v, a], Reference.LOCAL, (6,), **options)


def _compute(
    name: str,
    plan: CompiledTree,
    program: KernelProgram,
    inputs: Sequence[FloatArray],
    reference: Reference,
    shape: tuple[int, ...],
    *,
    base: FloatArray = FIXED_BASE_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
    keep_in_cache: bool = False,
) -> FloatArray:
    shape = len(inputs[0]), len(plan.frames), *shape
    out = np.empty(shape) if out is None else out.reshape(shape)
    # If an array has the stride 0, all its rows are the same memory, so the first row is enough.
    inputs = [base, *(x[:1] if len(x) > 1 and x.strides[0] == 0 else x for x in inputs)]
    if (invalid := _compute_interpreted(name, program, reference, inputs, out, threads)) is None:
        invalid = _compute_compiled(
            name, program, reference, inputs, out, threads, buffered=uses_buffer(out) and not keep_in_cache
        )
    if invalid or plan.may_overflow or _base_may_overflow(base):
        check_finite(inputs, out)
    return out


def _compute_interpreted(
    name: str,
    program: KernelProgram,
    reference: Reference,
    inputs: Sequence[FloatArray],
    out: FloatArray,
    threads: int | None,
) -> int | None:
    """Compute a batch without a kernel; return None if a kernel must compute the batch.

    Otherwise, return 1 if an input is nan, inf or too large, else 0.
    """
    if preload.get_kernel(name) is not None:
        return None
    if threads is not None:
        as_int(threads, "threads", 1)
    recursion, least_seconds, invalid = getattr(recursions, name), math.inf, 0
    flat = out.reshape(len(out), math.prod(out.shape[1:]))
    for i, row in enumerate(flat):
        start_time, result = time.thread_time(), [0.0] * len(row)
        invalid |= recursion(_list_args(program, reference, inputs, i, result))
        row[:] = result
        least_seconds = min(least_seconds, seconds := time.thread_time() - start_time)
        preload.add_time(name, seconds)
        # The first configuration takes longer than later configurations, so its time is not representative.
        if i and (left := len(flat) - 1 - i) and preload.get_kernel(name, left * least_seconds) is not None:
            return None
    return invalid


def _list_args(
    program: KernelProgram, reference: Reference, inputs: Sequence[FloatArray], i: int, result: list[float]
) -> list[Any]:
    args: list[Any] = [0] * len(KernelArgs)
    args[KernelArgs.PROGRAM], args[KernelArgs.CONSTANTS] = program.lists
    args[KernelArgs.SCRATCH], args[KernelArgs.OUT] = [None] * program.rows, result
    args[KernelArgs.REFERENCE] = REFERENCES[reference]
    args[KernelArgs.N], args[KernelArgs.OUTPUT_WIDTH] = 1, len(result)
    for index, x in zip(_INPUT_ARGS, inputs, strict=False):
        args[index] = x[0 if len(x) == 1 else i].tolist()
    if inputs[0] is FIXED_BASE_STATE:
        args[KernelArgs.BASE] = 0
    return args


def _compute_compiled(
    name: str,
    program: KernelProgram,
    reference: Reference,
    inputs: Sequence[FloatArray],
    out: FloatArray,
    threads: int | None,
    *,
    buffered: bool,
) -> int:
    kernel = preload.get_kernel(name)

    def compute(parts: Sequence[FloatArray], part: FloatArray) -> int:
        args, alive = make_kernel_args(program, reference, parts, part, buffered=buffered)
        outcome: int = kernel(address(args))
        del alive
        return outcome

    return compute_in_threads(compute, inputs, out, threads)


def uses_buffer(out: FloatArray) -> bool:
    return out.nbytes >= _MIN_BUFFERED_BYTES and LANES * out[0].size <= _MAX_BUFFER_DOUBLES


def make_kernel_args(
    program: KernelProgram,
    reference: Reference,
    inputs: Sequence[FloatArray],
    out: FloatArray,
    *,
    buffered: bool,
) -> tuple[NDArray[np.int64], object]:
    """Return a kernel's arguments and memory.

    The memory must stay alive until the kernel has finished.
    """
    width, memory, args = out[0].size, make_scratch(program), np.zeros(len(KernelArgs), dtype=np.int64)
    buffer = aligned_empty(LANES * width if buffered else 0)
    args[KernelArgs.PROGRAM], args[KernelArgs.CONSTANTS] = program.addresses
    args[KernelArgs.SCRATCH], args[KernelArgs.OUT] = address(memory), address(out)
    args[KernelArgs.N], args[KernelArgs.OUTPUT_WIDTH] = len(out), width
    args[KernelArgs.REFERENCE] = REFERENCES[reference]
    args[KernelArgs.BUFFER] = address(buffer) if buffered else 0
    for index, stride_index, x in zip(_INPUT_ARGS, _STRIDE_ARGS, inputs, strict=False):
        args[index], args[stride_index] = address(x), 0 if len(x) == 1 else x.shape[1]
    if inputs[0] is FIXED_BASE_STATE:
        args[KernelArgs.BASE] = 0
    return args, (memory, buffer)


def _base_may_overflow(base: FloatArray) -> bool:
    return base is not FIXED_BASE_STATE and not float(np.abs(base).max(initial=0.0)) < NO_OVERFLOW_BOUND


def check_finite(inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Raise NotFiniteError if an input is not finite, and RangeError if a result is not finite."""
    if not all(np.isfinite(x).all() for x in inputs):
        raise NotFiniteError("q, v and a must be finite")
    finite = np.isfinite(out).all(axis=tuple(range(1, out.ndim)))
    if not finite.all():
        raise RangeError(
            "a result leaves the range of double precision",
            where=f"sample {int(finite.argmin())} of {len(out)}" if len(out) > 1 else None,
            remedy="give smaller numbers",
        )


#: Minimum size of a batch that uses several threads by default, because starting a thread takes about ten
#: microseconds.
_MIN_THREADED_ROWS = 4096

#: Number of configurations that NumPy computes at a time, so that intermediate results fit into the cache.
ROWS_PER_PART = 2048

#: A function that computes rows of `out` from rows of `inputs`. The function returns 1 for nan, inf or too
#: large inputs, else 0.
BlockFunction = Callable[[Sequence[FloatArray], FloatArray], int]


def default_threads(n: int) -> int:
    return _processors() if n >= _MIN_THREADED_ROWS else 1


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1  # macOS has no `sched_getaffinity`.


def compute_in_threads(
    compute: BlockFunction, inputs: Sequence[FloatArray], out: FloatArray, threads: int | None
) -> int:
    """Compute `out` in several threads.

    All arrays must be C-contiguous. An input has n rows, or one row for all configurations. Threads run in
    parallel if `compute` releases Python's global interpreter lock.

    Returns:
        The largest value that `compute` returns; 0 without configurations.
    """
    n = len(out)
    threads = default_threads(n) if threads is None else as_int(threads, "threads", 1)
    if n == 0:
        return 0
    if (threads := min(threads, n // LANES)) > 1:
        threads = min(threads, _processors())
    if threads <= 1:
        return compute(inputs, out)
    work = [
        _pool().submit(compute, [x[part] if len(x) == n else x for x in inputs], out[part])
        for part in _split_rows(n, threads)
    ]
    return max([future.result() for future in work])  # Each `result()` waits for a thread.


def compute_in_parts(compute: Callable[[slice], None], n: int, threads: int | None) -> None:
    """Compute `n` rows in parts to limit memory.

    If n is 0, the function calls `compute` once, with an empty slice.
    """
    threads = default_threads(n) if threads is None else as_int(threads, "threads", 1)
    parts = [slice(i, min(i + ROWS_PER_PART, n)) for i in range(0, max(n, 1), ROWS_PER_PART)]
    count = min(threads, len(parts), _processors())
    parts_by_thread = [parts[k::count] for k in range(count)]

    def compute_all(thread_parts: Sequence[slice]) -> None:
        for part in thread_parts:
            compute(part)

    if len(parts_by_thread) == 1:
        return compute_all(parts)
    work = [_pool().submit(compute_all, thread_parts) for thread_parts in parts_by_thread]
    wait(work)  # All threads finish writing before an error is raised.
    for future in work:
        future.result()
    return None


def _split_rows(n: int, threads: int) -> list[slice]:
    blocks = n // LANES
    edges = [*(LANES * (blocks * i // threads) for i in range(threads)), n]
    return [slice(a, b) for a, b in pairwise(edges) if a < b]


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_processors(), thread_name_prefix="urdfkin")


os.register_at_fork(after_in_child=_pool.cache_clear)
