"""One configuration after the other: a function that Python calls as it calls its own built-in ones.

Numba's way into compiled code takes as long as the walk itself: it asks each argument for its type and
unpacks every array. CPython hands a built-in function the addresses of its arguments and asks nothing. This
one looks at the few words of each array that it needs, which lie where CPython and NumPy promise them to C
code, and keeps the interpreter's lock for the microsecond. What it does not take as it is, it leaves alone,
and says so.

A task is taken in one step that no thread comes between, with the lock or without. One that is at work for
another thread is left alone too: the caller then goes another way.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.compiled import kernels
from urdfkin.compiled.compiling import Core, compiled, core
from urdfkin.compiled.kernel_args import KernelArgs, scratch
from urdfkin.compiled.memory import WHOLE_NUMBERS, whole_numbers_at
from urdfkin.compiled.plan import CompiledTree, IntArray
from urdfkin.compiled.program import program_of
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

_CORE, _BUSY, _COUNT = int(KernelArgs.CORE), int(KernelArgs.BUSY), int(KernelArgs.COUNT)
_Q, _OUT, _NQ, _NV, _ORDERS = (
    int(KernelArgs.Q),
    int(KernelArgs.OUT),
    int(KernelArgs.NQ),
    int(KernelArgs.NV),
    int(KernelArgs.ORDERS),
)
_AXES, _ROWS, _COLUMNS = int(KernelArgs.AXES), int(KernelArgs.ROWS), int(KernelArgs.COLUMNS)

#: Words, of eight bytes, of a Python object: its type, what is its own, and the items of a tuple.
_OWN = object.__basicsize__ // 8
_TYPE, _ITEMS = _OWN - 1, tuple.__basicsize__ // 8
#: Of NumPy's arrays (PyArrayObject_fields; the numbers of axes and of flags fill half a word), and of their
#: kinds of number (PyArray_Descr): one word with the byte order and NumPy's number for the kind.
_DATA, _NDIM, _SHAPE, _KIND, _FLAGS = _OWN, _OWN + 1, _OWN + 2, _OWN + 5, _OWN + 6
_KIND_AND_ORDER, _NATIVE, _DOUBLE = _OWN + 1, ord("="), 12
_HALF, _BYTE = 0xFFFFFFFF, 0xFF
#: C-contiguous and aligned; and writable.
_READABLE, _WRITABLE = 0x101, 0x501

_keep = types.ExternalFunction("Py_IncRef", types.void(types.int64))
_drop = types.ExternalFunction("Py_DecRef", types.void(types.int64))
_made = types.ExternalFunction("PyObject_CallOneArg", types.int64(types.int64, types.int64))


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
def _doubles(given, ndarray, flags, axes, rows, columns):
    """Where an array's doubles lie; 0 where it is another kind of thing, or of another shape."""
    x = whole_numbers_at(given)
    if x[_TYPE] != ndarray or x[_NDIM] & _HALF != axes or x[_FLAGS] & flags != flags:
        return 0
    kind, shape = whole_numbers_at(x[_KIND])[_KIND_AND_ORDER], whole_numbers_at(x[_SHAPE])
    if kind >> 32 != _DOUBLE or kind >> 16 & _BYTE != _NATIVE:
        return 0
    alike = shape[0] == rows
    for axis in range(1, axes):
        alike = alike and shape[axis] == columns
    return x[_DATA] if alike else 0


@core
def one_configuration(bound, arguments, count):
    """q, or q and v, or q, v and a, then where to write or None: the result, or None where it was not taken.

    Args:
        bound: Address of the tuple it was bound to: a task, what arrays are, None, what makes an array, of
            which shape, and what the task needs.
        arguments: Address of theirs.
        count: How many they are.
    """
    items, given = whole_numbers_at(bound), whole_numbers_at(arguments)
    address, ndarray, none = whole_numbers_at(items[_ITEMS])[_DATA], items[_ITEMS + 1], items[_ITEMS + 2]
    orders = whole_numbers_at(address)[_ORDERS]
    if count == orders + 1:
        out = given[orders]
        if out == none:
            out = _made(items[_ITEMS + 3], items[_ITEMS + 4])
        else:
            _keep(out)
        if out == 0 or _done(address, given, out, ndarray):
            return out
        _drop(out)
    _keep(none)
    return none


@compiled
def _done(address, given, to, ndarray):
    """Have the core compute into an array; whether it did."""
    task = whole_numbers_at(address)
    orders, rows, columns, width = task[_ORDERS], task[_ROWS], task[_COLUMNS], task[_NQ]
    out = _doubles(to, ndarray, _WRITABLE, task[_AXES], rows, columns)
    good = out != 0
    size = 8 * rows
    for _ in range(1, task[_AXES]):
        size *= columns
    for i in range(orders):
        x = _doubles(given[i], ndarray, _READABLE, 1, width, 1) if good else 0
        apart = x + 8 * width <= out or out + size <= x
        good, width = x != 0 and apart, task[_NV]
    if not good or _taken(task, _BUSY):
        return False
    for i in range(orders):
        task[_Q + i] = whole_numbers_at(given[i])[_DATA]
    task[_OUT] = out
    good = _call(task[_CORE], address) == 0
    task[_COUNT] += good
    _give_back(task, _BUSY)
    return good


class _Method(ctypes.Structure):
    """CPython's PyMethodDef."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("address", ctypes.c_void_p),
        ("convention", ctypes.c_int),
        ("text", ctypes.c_char_p),
    )


_FASTCALL = 0x80
_FUNCTION = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.POINTER(_Method), ctypes.py_object, ctypes.c_void_p)


def _built_in(name: str, address: int, *bound: object) -> Callable[..., FloatArray | None]:
    """The code at an address as a function, which keeps alive what it is bound to."""
    method = _Method(name.encode(), address, _FASTCALL, None)
    new = _FUNCTION(("PyCFunction_NewEx", ctypes.pythonapi))
    function: Callable[..., FloatArray | None] = new(ctypes.byref(method), (*bound, method), None)
    return function


@cache
def arrays_are_known() -> bool:
    """Whether arrays are laid out as C code expects them; another NumPy's are left to NumPy."""
    x = np.zeros((2, 3))
    if np.ndarray.__basicsize__ < 8 * (_FLAGS + 1) or np.dtype.__basicsize__ < 8 * (_KIND_AND_ORDER + 1):
        return False
    word = ctypes.POINTER(ctypes.c_int64)
    own, kind = (ctypes.cast(id(part), word) for part in (x, x.dtype))
    return (
        (own[_TYPE], own[_DATA], own[_NDIM] & _HALF) == (id(np.ndarray), x.ctypes.data, 2)
        and ctypes.cast(own[_SHAPE], word)[:2] == [2, 3]
        and (own[_KIND], own[_FLAGS] & _WRITABLE) == (id(x.dtype), _WRITABLE)
        and (kind[_KIND_AND_ORDER] >> 32, kind[_KIND_AND_ORDER] >> 16 & _BYTE) == (x.dtype.num, _NATIVE)
    )


#: For each quantity: its core, that for LOCAL, how many of q, v and a they take, and how many axes of a
#: result are the rates'.
_HOW: dict[str, tuple[Core, Core, int, int]] = {
    "placement": (kernels.placements, kernels.placements, 1, 0),
    "velocity": (kernels.velocities, kernels.local_velocities, 2, 0),
    "jacobian": (kernels.jacobians, kernels.jacobians, 1, 1),
    "hessian": (kernels.hessians, kernels.hessians, 1, 2),
    "acceleration": (kernels.accelerations, kernels.local_accelerations, 3, 0),
}


def single(
    quantity: str, plan: CompiledTree, reference: Reference
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    """What computes a quantity of a plan's only frame, compiled or read from disk; its base stands still.

    Returns:
        The function, (q, ..., out or None) -> result or None where it was not taken, and its task, which
        counts results.
    """
    core, local_core, orders, columns = _HOW[quantity]
    local = reference is Reference.LOCAL
    turned = quantity == "placement" or local
    program = program_of(plan, turned=turned, columns=columns > 0, pairs=columns > 1)
    memory = scratch(program)
    shape = (4, 4) if quantity == "placement" else (6, *[plan.nv] * columns)
    address = (local_core if local else core).address
    compute, task = _called(address, orders, shape, plan, program, memory)
    task[KernelArgs.PROGRAM], task[KernelArgs.CONSTANTS] = program.addresses
    task[KernelArgs.SCRATCH], task[KernelArgs.REFERENCE] = memory.ctypes.data, reference
    return compute, task


def called(
    core: Any, orders: int, shape: tuple[int, ...], plan: CompiledTree
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    """The same for a function of C's that takes a task, a result being of some shape.

    Args:
        core: Of `ctypes`.
        orders: How many of q, v and a it takes.
        shape: Of the result.
        plan: Whose q and v they are.
    """
    address = ctypes.cast(core, ctypes.c_void_p).value
    return _called(address or 0, orders, shape, plan, core)


def _called(
    address: int, orders: int, shape: tuple[int, ...], plan: CompiledTree, *alive: object
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    task = np.zeros(len(KernelArgs), dtype=np.int64)
    task[KernelArgs.CORE], task[KernelArgs.ORDERS], task[KernelArgs.N] = address, orders, 1
    task[KernelArgs.NQ], task[KernelArgs.NV] = (
        plan.nq,
        plan.nv,
    )  # strides are 0: there is no next configuration
    task[KernelArgs.AXES], task[KernelArgs.ROWS], task[KernelArgs.COLUMNS] = len(shape), *(*shape, 1)[:2]
    bound = task, np.ndarray, None, np.empty, shape, *alive
    return _built_in("compute", one_configuration.address, *bound), task
