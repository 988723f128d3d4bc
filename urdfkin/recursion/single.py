"""Kernels for one configuration: they hand over nothing but its arrays, and keep the interpreter's lock.

A task that is at work for another thread is left alone: the caller then goes another way.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.recursion import cores
from urdfkin.recursion.compiling import BOUND, NUMBERS, Core, Kernel, compiled, kernel, output
from urdfkin.recursion.plan import IntArray, Plan
from urdfkin.recursion.program import program_of
from urdfkin.recursion.registers import WHOLE_NUMBERS, address_of, whole_numbers_at
from urdfkin.recursion.task import Task, scratch
from urdfkin.reference import Reference

_CORE, _BUSY, _COUNT = int(Task.CORE), int(Task.BUSY), int(Task.COUNT)
_Q, _V, _A, _OUT, _N = int(Task.Q), int(Task.V), int(Task.A), int(Task.OUT), int(Task.N)
_NQ, _NV, _ROWS, _COLUMNS = int(Task.NQ), int(Task.NV), int(Task.ROWS), int(Task.COLUMNS)


@intrinsic
def _call(context: Any, address: Any, argument: Any) -> Any:
    """What the core at an address returns."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole = ir.IntType(64)
        kind = ir.FunctionType(whole, [whole]).as_pointer()
        return builder.call(builder.inttoptr(arguments[0], kind), [arguments[1]])

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _taken(context: Any, numbers: Any, place: Any) -> Any:
    """Put 1 where 0 should stand, and say what stood there, in one step that no thread comes between."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw("xchg", builder.gep(arguments[0], [arguments[1]]), one, "acquire")

    return types.int64(WHOLE_NUMBERS, types.intp), generate


@intrinsic
def _give_back(context: Any, numbers: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nil = ir.Constant(ir.IntType(64), 0)
        builder.store_atomic(nil, builder.gep(arguments[0], [arguments[1]]), "release", 8)
        return context.get_dummy_value()

    return types.void(WHOLE_NUMBERS, types.intp), generate


@compiled
def _apart(x, out):
    """Whether two contiguous arrays of doubles have no memory in common."""
    first, to = address_of(x), address_of(out)
    return first + 8 * x.size <= to or to + 8 * out.size <= first


@compiled
def _done(bound, q, v, a, out):
    """Have the core compute; 1 where that went well."""
    address = address_of(bound)
    task = whole_numbers_at(address)
    if _taken(task, _BUSY):
        return 0
    task[_Q], task[_V], task[_A], task[_OUT] = address_of(q), address_of(v), address_of(a), address_of(out)
    good = int(_call(task[_CORE], address) == 0)
    task[_COUNT] += good
    _give_back(task, _BUSY)
    return good


@kernel(BOUND, NUMBERS, output(2), nogil=False)
def matrix(bound, q, out):
    """A placement or a Jacobian: 1, or 0 where the arrays cannot be taken or numbers are not finite.

    Shapes: q (nq,), out (4, 4) or (6, nv), memory of its own.
    """
    good = q.shape[0] == bound[_NQ] and out.shape[0] == bound[_ROWS] and out.shape[1] == bound[_COLUMNS]
    return _done(bound, q, q, q, out) if good and _apart(q, out) else 0


@kernel(BOUND, NUMBERS, NUMBERS, NUMBERS, output(1), nogil=False)
def six(bound, q, v, a, out):
    """A velocity or an acceleration, likewise.

    Shapes: q (nq,), v and a (nv,), out (6,), memory of its own.
    """
    good = q.shape[0] == bound[_NQ] and v.shape[0] == bound[_NV] and a.shape[0] == bound[_NV]
    good = good and out.shape[0] == 6 and _apart(q, out) and _apart(v, out) and _apart(a, out)
    return _done(bound, q, v, a, out) if good else 0


class Single(NamedTuple):
    """What computes one quantity of one frame in one configuration.

    Attributes:
        kernel: `matrix` or `six`, compiled; its first argument is the task.
        task: Good while `kept` is.
        kept: What the task holds addresses of.
    """

    kernel: Any
    task: IntArray
    kept: tuple[object, ...]


#: For each quantity: its core, that for LOCAL, the kernel that calls them, and whether it has columns.
_HOW: dict[str, tuple[Core, Core, Kernel, bool]] = {
    "placement": (cores.placements, cores.placements, matrix, False),
    "velocity": (cores.velocities, cores.local_velocities, six, False),
    "jacobian": (cores.jacobians, cores.jacobians, matrix, True),
    "acceleration": (cores.accelerations, cores.local_accelerations, six, False),
}


def single(quantity: str, plan: Plan, reference: Reference) -> Single:
    """Compile, or read from disk, what computes a quantity of a plan's only frame; its base stands still."""
    core, local_core, kernel, columns = _HOW[quantity]
    local = reference is Reference.LOCAL
    turned = quantity == "placement" or local
    program = program_of(plan, turned=turned, columns=columns)
    memory, task = scratch(program), np.zeros(len(Task), dtype=np.int64)
    task[Task.PROGRAM], task[Task.CONSTANTS] = program.addresses
    task[Task.SCRATCH], task[Task.REFERENCE], task[Task.N] = memory.ctypes.data, reference, 1
    task[Task.CORE] = (local_core if local else core).address
    task[Task.NQ], task[Task.NV] = plan.nq, plan.nv
    task[Task.ROWS], task[Task.COLUMNS] = (6, plan.nv) if columns else (4, 4)
    return Single(kernel.compiled, task, (program, memory))
