"""Eight configurations side by side in one register: numbers from memory, and back.

Scratch memory holds *rows* of `LANES` doubles, one for each configuration of a block.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.compiled.numbers import NOTHING, Known, Lanes, as_number, in_all_lanes

#: Configurations side by side: one AVX-512 register, two of AVX2.
LANES = 8
NUMBER = Lanes(LANES)
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
NUMBERS, WHOLE_NUMBERS = types.CPointer(types.float64), types.CPointer(types.int64)


def _in_row(builder: Any, s: Any, row: Any) -> Any:
    begin = builder.mul(row, ir.Constant(row.type, LANES))
    return builder.bitcast(builder.gep(s, [begin]), _VECTOR.as_pointer())


@intrinsic
def number(context: Any, s: Any, row: Any) -> Any:
    """The number in a row of scratch."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_in_row(builder, *arguments), align=64)

    return NUMBER(NUMBERS, types.intp), generate


@intrinsic
def number_if(context: Any, wanted: Any, s: Any, row: Any) -> Any:
    """The number in a row; nothing where `wanted` is nothing."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(wanted, Known):
            return context.get_dummy_value()
        return builder.load(_in_row(builder, *arguments[1:]), align=64)

    return (NOTHING if isinstance(wanted, Known) else NUMBER)(wanted, NUMBERS, types.intp), generate


@intrinsic
def put(context: Any, s: Any, row: Any, x: Any) -> Any:
    """Write a number to a row of scratch; nothing is not written."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        s, row, value = arguments
        if x != NOTHING:
            vector = as_number(context, builder, x, value, LANES)
            builder.store(vector, _in_row(builder, s, row), align=64)
        return context.get_dummy_value()

    return types.void(NUMBERS, types.intp, x), generate


@intrinsic
def constant(context: Any, g: Any, i: Any) -> Any:
    """The number `g[i]`, the same for all configurations."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return in_all_lanes(builder, builder.load(builder.gep(arguments[0], [arguments[1]])), LANES)

    return NUMBER(NUMBERS, types.intp), generate


@intrinsic
def same(context: Any, x: Any) -> Any:
    """A double as a number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return in_all_lanes(builder, arguments[0], LANES)

    return NUMBER(types.float64), generate


@intrinsic
def numbers_of(context: Any, array: Any) -> Any:
    """The numbers of an array without its shape: no test for a negative index for each of them."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), generate


def _at_address(kind: Any) -> Any:
    @intrinsic
    def at_address(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return kind(types.int64), generate

    return at_address


#: The numbers, or whole numbers, at an address.
numbers_at, whole_numbers_at = map(_at_address, (NUMBERS, WHOLE_NUMBERS))
