"""Make compiled functions that compute a quantity for one configuration.

Python calls a compiled function like a built-in function: CPython passes the arguments' addresses without a
check. Checking the arguments in Numba would take as long as the recursion itself. The compiled function reads
8-byte words of each array object, at the offsets that CPython and NumPy guarantee to C code. The function
holds Python's global interpreter lock for about a microsecond.

An atomic flag protects the scratch memory, even in a Python without a global interpreter lock.

| Situation | Result |
|---|---|
| unsupported arguments | None |
| an input is nan, infinite or too large | None |
| another thread is using the scratch memory | None |

After None, the caller computes the result in another way.
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

from urdfkin.compiled.machine import kernels
from urdfkin.compiled.machine.compiling import CKernel, inline
from urdfkin.compiled.machine.memory import INTEGERS, integers_at
from urdfkin.compiled.plan import (
    REFERENCES,
    CompiledTree,
    IntArray,
    KernelArgs,
    compile_program,
    make_scratch,
)
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

_KERNEL, _BUSY, _COUNT = map(int, (KernelArgs.KERNEL, KernelArgs.BUSY, KernelArgs.COUNT))
_Q, _OUT, _NQ, _NV = map(int, (KernelArgs.Q, KernelArgs.OUT, KernelArgs.NQ, KernelArgs.NV))
_ORDERS, _AXES, _ROWS, _COLUMNS = map(
    int, (KernelArgs.ORDERS, KernelArgs.AXES, KernelArgs.ROWS, KernelArgs.COLUMNS)
)

#: Number of 8-byte words in a Python object's header.
_HEADER_WORDS = object.__basicsize__ // 8
#: A Python object consists of 8-byte words. Word `_TYPE` contains the address of the object's type. In a
#: tuple, word `_ITEMS` contains the address of the first item.
_TYPE, _ITEMS = _HEADER_WORDS - 1, tuple.__basicsize__ // 8
#: Indices of 8-byte words of a NumPy array (C structure PyArrayObject_fields). The lower four bytes of
#: `_NDIM` contain the number of axes. The lower four bytes of `_FLAGS` contain the flags.
_DATA, _NDIM, _SHAPE, _KIND, _FLAGS = (
    _HEADER_WORDS,
    _HEADER_WORDS + 1,
    _HEADER_WORDS + 2,
    _HEADER_WORDS + 5,
    _HEADER_WORDS + 6,
)
#: The C structure PyArray_Descr describes the type of an array's elements. The word `_KIND_AND_ORDER`
#: contains the byte order and the type number. `_NATIVE` is the native byte order. `_DOUBLE` is the type
#: number of doubles.
_KIND_AND_ORDER, _NATIVE, _DOUBLE = _HEADER_WORDS + 1, ord("="), 12
_FOUR_BYTE_MASK, _BYTE_MASK = 0xFFFFFFFF, 0xFF
#: `_READABLE` has NumPy's flags of an input array: C-contiguous and aligned.
#: `_WRITABLE` has NumPy's flags of an output array: C-contiguous, aligned and writable.
_READABLE, _WRITABLE = 0x101, 0x501

_incref = types.ExternalFunction("Py_IncRef", types.void(types.int64))
_decref = types.ExternalFunction("Py_DecRef", types.void(types.int64))
_call_one_arg = types.ExternalFunction("PyObject_CallOneArg", types.int64(types.int64, types.int64))


@intrinsic
def _call(context: Any, address: Any, argument: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole = ir.IntType(64)
        kind = ir.FunctionType(whole, [whole]).as_pointer()
        return builder.call(builder.inttoptr(arguments[0], kind), [arguments[1]])

    return types.int64(types.int64, types.int64), generate


@intrinsic
def _test_and_set(context: Any, numbers: Any, index: Any) -> Any:
    """Atomically replace `numbers[index]` by 1, and return the previous value."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw("xchg", builder.gep(arguments[0], [arguments[1]]), one, "acquire")

    return types.int64(INTEGERS, types.intp), generate


@intrinsic
def _clear_flag(context: Any, numbers: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nil = ir.Constant(ir.IntType(64), 0)
        builder.store_atomic(nil, builder.gep(arguments[0], [arguments[1]]), "release", 8)
        return context.get_dummy_value()

    return types.void(INTEGERS, types.intp), generate


@inline
def _doubles_address(array, ndarray, flags, axes, rows, columns):
    """Return the address of the doubles, or 0 if the array is not supported.

    The array must have `axes` axes and the shape (rows, columns, columns, ...).
    """
    x = integers_at(array)
    if x[_TYPE] != ndarray or x[_NDIM] & _FOUR_BYTE_MASK != axes or x[_FLAGS] & flags != flags:
        return 0
    kind, shape = integers_at(x[_KIND])[_KIND_AND_ORDER], integers_at(x[_SHAPE])
    if kind >> 32 != _DOUBLE or kind >> 16 & _BYTE_MASK != _NATIVE:
        return 0
    shape_matches = shape[0] == rows
    for axis in range(1, axes):
        shape_matches = shape_matches and shape[axis] == columns
    return x[_DATA] if shape_matches else 0


@CKernel
def one_configuration(bound, arguments, count):
    """Compute the result for one configuration.

    `arguments` is the address of `count` arguments: (q), (q, v) or (q, v, a), then the output array or None.
    `bound` is the address of a tuple:

    | Item of `bound` | Object |
    |---|---|
    | 0 | array of kernel arguments |
    | 1 | NumPy's type of arrays |
    | 2 | None |
    | 3 | function that creates the result array |
    | 4 | shape of the result array |
    | others | objects that must stay alive as long as the compiled function |
    """
    items, inputs = integers_at(bound), integers_at(arguments)
    address, ndarray, none = integers_at(items[_ITEMS])[_DATA], items[_ITEMS + 1], items[_ITEMS + 2]
    orders = integers_at(address)[_ORDERS]
    if count == orders + 1:
        out = inputs[orders]
        if out == none:
            out = _call_one_arg(items[_ITEMS + 3], items[_ITEMS + 4])
        else:
            _incref(out)
        if out == 0 or _compute_into(address, inputs, out, ndarray):
            return out
        _decref(out)
    _incref(none)
    return none


@inline
def _compute_into(address, inputs, to, ndarray):
    """Write the result to `to`, and return whether the result is valid."""
    args = integers_at(address)
    orders, rows, columns, width = args[_ORDERS], args[_ROWS], args[_COLUMNS], args[_NQ]
    out = _doubles_address(to, ndarray, _WRITABLE, args[_AXES], rows, columns)
    valid = out != 0
    size = 8 * rows
    for _ in range(1, args[_AXES]):
        size *= columns
    for i in range(orders):
        x = _doubles_address(inputs[i], ndarray, _READABLE, 1, width, 1) if valid else 0
        disjoint = x + 8 * width <= out or out + size <= x
        valid, width = x != 0 and disjoint, args[_NV]
    if not valid or _test_and_set(args, _BUSY):
        return False
    for i in range(orders):
        args[_Q + i] = integers_at(inputs[i])[_DATA]
    args[_OUT] = out
    valid = _call(args[_KERNEL], address) == 0
    args[_COUNT] += valid
    _clear_flag(args, _BUSY)
    return valid


class _Method(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("address", ctypes.c_void_p),
        ("convention", ctypes.c_int),
        ("text", ctypes.c_char_p),
    )


_FASTCALL = 0x80
_BUILTIN_CONSTRUCTOR = ctypes.PYFUNCTYPE(
    ctypes.py_object, ctypes.POINTER(_Method), ctypes.py_object, ctypes.c_void_p
)


def _make_builtin(name: str, address: int, *bound: object) -> Callable[..., FloatArray | None]:
    """Make a function from machine code; the function keeps `bound` alive."""
    method = _Method(name.encode(), address, _FASTCALL, None)
    new = _BUILTIN_CONSTRUCTOR(("PyCFunction_NewEx", ctypes.pythonapi))
    function: Callable[..., FloatArray | None] = new(ctypes.byref(method), (*bound, method), None)
    return function


@cache
def array_layout_is_known() -> bool:
    """Return whether NumPy's arrays have the expected layout."""
    x = np.zeros((2, 3))
    if np.ndarray.__basicsize__ < 8 * (_FLAGS + 1) or np.dtype.__basicsize__ < 8 * (_KIND_AND_ORDER + 1):
        return False
    word = ctypes.POINTER(ctypes.c_int64)
    own, kind = (ctypes.cast(id(part), word) for part in (x, x.dtype))
    return (
        (own[_TYPE], own[_DATA], own[_NDIM] & _FOUR_BYTE_MASK) == (id(np.ndarray), x.ctypes.data, 2)
        and ctypes.cast(own[_SHAPE], word)[:2] == [2, 3]
        and (own[_KIND], own[_FLAGS] & _WRITABLE) == (id(x.dtype), _WRITABLE)
        and (kind[_KIND_AND_ORDER] >> 32, kind[_KIND_AND_ORDER] >> 16 & _BYTE_MASK) == (x.dtype.num, _NATIVE)
    )


#: The first kernel computes the quantity in WORLD and LOCAL_WORLD_ALIGNED, the second kernel in LOCAL. The
#: first number is the number of inputs: 1 for q, 2 for q and v, 3 for q, v and a. The second number counts
#: the array axes of length nv: 1 for a Jacobian, 2 for a Hessian.
_KERNELS: dict[str, tuple[CKernel, CKernel, int, int]] = {
    "placement": (kernels.placements, kernels.placements, 1, 0),
    "velocity": (kernels.velocities, kernels.local_velocities, 2, 0),
    "jacobian": (kernels.jacobians, kernels.jacobians, 1, 1),
    "hessian": (kernels.hessians, kernels.hessians, 1, 2),
    "acceleration": (kernels.accelerations, kernels.local_accelerations, 3, 0),
}


def make_single_evaluator(
    quantity: str, plan: CompiledTree, reference: Reference
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    """Make a function for one configuration; the base is fixed at the world's origin.

    `plan` must have one frame. The returned array contains the kernel's arguments; its element
    `KernelArgs.COUNT` counts the valid results.
    """
    kernel, local_kernel, orders, columns = _KERNELS[quantity]
    local = reference.own_axes
    orientations = quantity == "placement" or local
    program = compile_program(plan, orientations=orientations, columns=columns > 0, hessian=columns > 1)
    memory = make_scratch(program)
    shape = (4, 4) if quantity == "placement" else (6, *[plan.nv] * columns)
    address = (local_kernel if local else kernel).address
    compute, args = _make_evaluator(address, orders, shape, plan, program, memory)
    args[KernelArgs.PROGRAM], args[KernelArgs.CONSTANTS] = program.addresses
    args[KernelArgs.SCRATCH], args[KernelArgs.REFERENCE] = memory.ctypes.data, REFERENCES[reference]
    return compute, args


def wrap_c_function(
    c_function: Any, orders: int, shape: tuple[int, ...], plan: CompiledTree
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    """Make a function as `make_single_evaluator` does, from a C function instead of a kernel."""
    address = ctypes.cast(c_function, ctypes.c_void_p).value
    return _make_evaluator(address or 0, orders, shape, plan, c_function)


def _make_evaluator(
    address: int, orders: int, shape: tuple[int, ...], plan: CompiledTree, *alive: object
) -> tuple[Callable[..., FloatArray | None], IntArray]:
    args = np.zeros(len(KernelArgs), dtype=np.int64)
    args[KernelArgs.KERNEL], args[KernelArgs.ORDERS], args[KernelArgs.N] = address, orders, 1
    # All strides remain 0, because the arrays contain one configuration.
    args[KernelArgs.NQ], args[KernelArgs.NV] = plan.nq, plan.nv
    args[KernelArgs.AXES], args[KernelArgs.ROWS], args[KernelArgs.COLUMNS] = len(shape), *(*shape, 1)[:2]
    bound = args, np.ndarray, None, np.empty, shape, *alive
    return _make_builtin("compute", one_configuration.address, *bound), args
