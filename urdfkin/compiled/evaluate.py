"""Arrays in, arrays out: the compiled walks behind plain functions.

Inputs are flat batches, (n, nq) and (n, nv), already checked; `urdfkin.robot` checks, reshapes and verifies.
One row that was broadcast to n is read again for each configuration, and never copied.
A core is loaded when it is first needed, so that a first use compiles only what it needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled.batch import in_blocks
from urdfkin.compiled.compiling import Core
from urdfkin.compiled.kernel_args import KernelArgs, lines, scratch
from urdfkin.compiled.memory import LANES
from urdfkin.compiled.plan import LARGE, CompiledTree
from urdfkin.compiled.program import Program, program_of
from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.model.base_motion import STILL_STATE, against_gravity
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.system.processes import importing

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
_PLACES = KernelArgs.BASE, KernelArgs.Q, KernelArgs.V, KernelArgs.A
#: Bytes of an output that no near cache keeps until it is read: it is written past them.
_STREAMED = 2 << 20
#: Numbers of a block that stay in half of the nearest cache until it is full.
_MOST_STAGED = 3072

_STRIDES = KernelArgs.STRIDE_BASE, KernelArgs.STRIDE_Q, KernelArgs.STRIDE_V, KernelArgs.STRIDE_A


def _cores() -> Any:
    with importing:
        from urdfkin.compiled import kernels  # noqa: PLC0415
    return kernels


class How(TypedDict, total=False):
    """What every function here takes by name.

    Attributes:
        base: (n, 24) or (1, 24) the base's state.
        out: C-contiguous float64 array of the result's size to write into.
        threads: How many compute; None: every processor from a number of configurations on.
    """

    base: FloatArray
    out: FloatArray | None
    threads: int | None


def placements(plan: CompiledTree, q: FloatArray, **how: Unpack[How]) -> FloatArray:
    """(n, frames, 4, 4) T_world_frame: 7.77 with the rotations alongside."""
    program = program_of(plan, turned=True)
    return _computed(_cores().placements, plan, program, [q], _ALIGNED, (4, 4), **how)


def velocities(
    plan: CompiledTree, q: FloatArray, v: FloatArray, reference: Reference = _ALIGNED, **how: Unpack[How]
) -> FloatArray:
    """(n, frames, 6) [linear; angular]: 7.127, 7.128."""
    local = reference is Reference.LOCAL
    core = _cores().local_velocities if local else _cores().velocities
    return _computed(core, plan, program_of(plan, turned=local), [q, v], reference, (6,), **how)


def accelerations(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference = _ALIGNED,
    **how: Unpack[How],
) -> FloatArray:
    """(n, frames, 6) [linear; angular], classical: 7.129, 7.130."""
    local = reference is Reference.LOCAL
    core = _cores().local_accelerations if local else _cores().accelerations
    return _computed(core, plan, program_of(plan, turned=local), [q, v, a], reference, (6,), **how)


def jacobians(
    plan: CompiledTree, q: FloatArray, reference: Reference = _ALIGNED, **how: Unpack[How]
) -> FloatArray:
    """(n, frames, 6, nv) velocity Jacobians: 7.85."""
    program = program_of(plan, turned=reference is Reference.LOCAL, columns=True)
    return _computed(_cores().jacobians, plan, program, [q], reference, (6, plan.nv), **how)


def jacobian_rates(
    plan: CompiledTree, q: FloatArray, v: FloatArray, reference: Reference = _ALIGNED, **how: Unpack[How]
) -> FloatArray:
    """(n, frames, 6, nv) time derivatives of the velocity Jacobians: the J-dot of 7.126."""
    program = program_of(plan, turned=reference is Reference.LOCAL, columns=True)
    return _computed(_cores().jacobian_rates, plan, program, [q, v], reference, (6, plan.nv), **how)


def hessians(
    plan: CompiledTree, q: FloatArray, reference: Reference = _ALIGNED, **how: Unpack[How]
) -> FloatArray:
    """(n, frames, 6, nv, nv) derivatives of the velocity Jacobians: [..., i, j] of column i by rate j."""
    program = program_of(plan, turned=reference is Reference.LOCAL, columns=True, pairs=True)
    return _computed(_cores().hessians, plan, program, [q], reference, (6, plan.nv, plan.nv), **how)


def imus(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    *,
    gravity: FloatArray,
    **how: Unpack[How],
) -> FloatArray:
    """(n, frames, 6) [proper acceleration; angular velocity] in each frame's own axes.

    An accelerometer cannot tell gravity from a world that is accelerated against it, and so the base is.
    """
    how["base"] = against_gravity(how.get("base", STILL_STATE), gravity)
    program = program_of(plan, turned=True)
    return _computed(_cores().imus, plan, program, [q, v, a], Reference.LOCAL, (6,), **how)


def _computed(
    core: Core,
    plan: CompiledTree,
    program: Program,
    inputs: Sequence[FloatArray],
    reference: Reference,
    shape: tuple[int, ...],
    *,
    base: FloatArray = STILL_STATE,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> FloatArray:
    """(n, frames, *shape) by a core, of q, and v, and a.

    Raises:
        NotFiniteError: an input is not finite.
        RangeError: a result is not, although the inputs are.
    """
    shape = len(inputs[0]), len(plan.frames), *shape
    out = np.empty(shape) if out is None else out.reshape(shape)
    inputs = [x[:1] if _is_the_same_for_all(x) else x for x in inputs]
    staged = is_staged(out)

    def compute(parts: Sequence[FloatArray], part: FloatArray) -> int:
        task, kept = task_of(program, reference, parts, part, staged=staged)
        outcome = core(task.ctypes.data)
        del kept
        return outcome

    if in_blocks(compute, [base, *inputs], out, threads) or plan.is_large or _is_large(base):
        _demand_finite([base, *inputs], out)
    return out


def is_staged(out: FloatArray) -> bool:
    """Whether results are put together block by block, then written past the caches, whole lines at a time.

    A line that is written in pieces is read before, and an output beyond a cache's size is nowhere near.
    """
    return out.nbytes >= _STREAMED and LANES * out[0].size <= _MOST_STAGED


def task_of(
    program: Program, reference: Reference, inputs: Sequence[FloatArray], out: FloatArray, *, staged: bool
) -> tuple[NDArray[np.int64], object]:
    """A core's task, and the memory that has to live until it is done.

    Args:
        program: The walk's.
        reference: Of the results.
        inputs: The base's state, q, and v, and a as far as they are wanted; of one row, or as many as `out`.
        out: (n, ...) to be filled.
        staged: Whether its blocks are (`is_staged`).
    """
    width, memory, task = out[0].size, scratch(program), np.zeros(len(KernelArgs), dtype=np.int64)
    stage = lines(LANES * width if staged else 0)
    task[KernelArgs.PROGRAM], task[KernelArgs.CONSTANTS] = program.addresses
    task[KernelArgs.SCRATCH], task[KernelArgs.OUT] = memory.ctypes.data, out.ctypes.data
    task[KernelArgs.REFERENCE], task[KernelArgs.N], task[KernelArgs.WIDTH] = reference, len(out), width
    task[KernelArgs.STAGE] = stage.ctypes.data if staged else 0
    for place, of_place, x in zip(_PLACES, _STRIDES, inputs, strict=False):
        task[place], task[of_place] = x.ctypes.data, 0 if len(x) == 1 else x.shape[1]
    if inputs[0] is STILL_STATE:
        task[KernelArgs.BASE] = 0
    return task, (memory, stage)


def _is_the_same_for_all(x: FloatArray) -> bool:
    """Whether rows are one row that was broadcast."""
    return len(x) > 1 and x.strides[0] == 0


def _is_large(base: FloatArray) -> bool:
    return base is not STILL_STATE and not float(np.abs(base).max(initial=0.0)) < LARGE


def _demand_finite(inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Results that are finite, from inputs that are; where all is ordinary nothing needs to be looked at."""
    if not all(np.isfinite(x).all() for x in inputs):
        raise NotFiniteError("q, v and a must be finite")
    finite = np.isfinite(out).all(axis=tuple(range(1, out.ndim)))
    if not finite.all():
        raise RangeError(
            "a result leaves the range of double precision",
            where=f"sample {int(finite.argmin())} of {len(out)}" if len(out) > 1 else None,
            remedy="give smaller numbers",
        )
