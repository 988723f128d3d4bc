"""Transfer numbers between arrays and scratch memory, eight configurations at a time.

In an array, all numbers of one configuration are adjacent. Scratch memory consists of rows of `LANES`
doubles. A row contains one quantity of all eight configurations. The transfer is therefore a transposition.
Shuffle instructions transpose blocks of 8, 4, 2 or 1 numbers of each configuration.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.compiled.machine.compiling import inline
from urdfkin.compiled.machine.numbers import UNUSED, ConstantNumber, Lanes, as_number, build_broadcast
from urdfkin.compiled.plan import LANES
from urdfkin.compiled.python_numbers import NO_OVERFLOW_BOUND

LANES_TYPE = Lanes(LANES)
DOUBLES, INTEGERS = types.CPointer(types.float64), types.CPointer(types.int64)


def _vector_pointer(builder: Any, numbers: Any, at: Any, width: int) -> Any:
    return builder.bitcast(builder.gep(numbers, [at]), ir.VectorType(ir.DoubleType(), width).as_pointer())


def _row_pointer(builder: Any, scratch: Any, row: Any) -> Any:
    return _vector_pointer(builder, scratch, builder.mul(row, ir.Constant(row.type, LANES)), LANES)


@intrinsic
def load_number(context: Any, scratch: Any, row: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_row_pointer(builder, *arguments), align=64)

    return LANES_TYPE(DOUBLES, types.intp), generate


@intrinsic
def load_number_if(context: Any, marker: Any, scratch: Any, row: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(marker, ConstantNumber):
            return context.get_dummy_value()
        return builder.load(_row_pointer(builder, *arguments[1:]), align=64)

    return (UNUSED if isinstance(marker, ConstantNumber) else LANES_TYPE)(
        marker, DOUBLES, types.intp
    ), generate


@intrinsic
def store_number(context: Any, scratch: Any, row: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        scratch, row, value = arguments
        if x != UNUSED:
            vector = as_number(context, builder, x, value, LANES)
            builder.store(vector, _row_pointer(builder, scratch, row), align=64)
        return context.get_dummy_value()

    return types.void(DOUBLES, types.intp, x), generate


@intrinsic
def load_constant(context: Any, constants: Any, i: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build_broadcast(builder, builder.load(builder.gep(arguments[0], [arguments[1]])), LANES)

    return LANES_TYPE(DOUBLES, types.intp), generate


@intrinsic
def broadcast(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build_broadcast(builder, arguments[0], LANES)

    return LANES_TYPE(types.float64), generate


@intrinsic
def array_data(context: Any, array: Any) -> Any:
    """Return a pointer to the numbers. Unlike an array, a pointer has no negative indices."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), generate


def _make_pointer_function(kind: Any) -> Any:
    @intrinsic
    def pointer_at(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return kind(types.int64), generate

    return pointer_at


doubles_at, integers_at = map(_make_pointer_function, (DOUBLES, INTEGERS))


#: Maximum number of doubles that `prefetch` loads. If `count` is larger, `prefetch` does nothing. 3072
#: doubles are 24 KiB, half of a first-level cache of 48 KiB.
_MAX_PREFETCHED = 3072


def _slice_vector(builder: Any, vector: Any, start: int, width: int) -> Any:
    mask = ir.Constant(ir.VectorType(ir.IntType(32), width), list(range(start, start + width)))
    return builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), mask)


def _concatenate(builder: Any, pieces: Sequence[Any]) -> Any:
    """Concatenate vectors of equal length; the number of vectors must be a power of two."""
    while len(pieces) > 1:
        width = 2 * pieces[0].type.count
        mask = ir.Constant(ir.VectorType(ir.IntType(32), width), list(range(width)))
        pieces = [builder.shuffle_vector(a, b, mask) for a, b in zip(pieces[::2], pieces[1::2], strict=True)]
    return pieces[0]


def _transpose_blocks(builder: Any, vectors: Sequence[Any]) -> list[Any]:
    """Transpose each square block of a matrix.

    `vectors` are the rows, and their number must be a power of two. Each pass exchanges the upper right and
    the lower left quarter of each block of 2 w by 2 w numbers.
    """
    x, w = list(vectors), 1
    while w < len(x):
        for i in range(len(x)):
            if not i & w:
                first = [LANES + j - w if j & w else j for j in range(LANES)]
                second = [LANES + j if j & w else j + w for j in range(LANES)]
                masks = (ir.Constant(ir.VectorType(ir.IntType(32), LANES), m) for m in (first, second))
                x[i], x[i + w] = (builder.shuffle_vector(x[i], x[i + w], mask) for mask in masks)
        w *= 2
    return x


def _add_constant(builder: Any, number: Any, constant: int) -> Any:
    return builder.add(number, ir.Constant(number.type, constant))


def _make_reader(width: int) -> Any:
    @intrinsic
    def read(context: Any, x: Any, at: Any, stride: Any, scratch: Any, row: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            x, at, stride, scratch, row = arguments
            pieces = []
            for _ in range(LANES):
                pieces.append(builder.load(_vector_pointer(builder, x, at, width), align=8))
                at = builder.add(at, stride)
            rows = _transpose_blocks(builder, [_concatenate(builder, pieces[i::width]) for i in range(width)])
            for i, vector in enumerate(rows):
                builder.store(
                    vector, _row_pointer(builder, scratch, _add_constant(builder, row, i)), align=64
                )
            return context.get_dummy_value()

        return types.void(DOUBLES, *[types.intp] * 2, DOUBLES, types.intp), generate

    return read


def _make_writer(width: int) -> Any:
    @intrinsic
    def write(context: Any, scratch: Any, rows: Any, first: Any, to: Any, at: Any, stride: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            scratch, rows, first, to, at, stride = arguments
            vectors = []
            for i in range(width):
                row = builder.load(builder.gep(rows, [_add_constant(builder, first, i)]))
                vectors.append(builder.load(_row_pointer(builder, scratch, row), align=64))
            blocks = _transpose_blocks(builder, vectors)
            for k in range(LANES):
                numbers = _slice_vector(builder, blocks[k % width], k // width * width, width)
                builder.store(numbers, _vector_pointer(builder, to, at, width), align=8)
                at = builder.add(at, stride)
            return context.get_dummy_value()

        return types.void(DOUBLES, INTEGERS, types.intp, DOUBLES, *[types.intp] * 2), generate

    return write


_read_8, _read_4, _read_2, _read_1 = map(_make_reader, (8, 4, 2, 1))
_write_8, _write_4, _write_2, _write_1 = map(_make_writer, (8, 4, 2, 1))


@inline
def read_rows(m, x, at, stride, count, scratch, row):
    """Read `count` numbers per configuration into scratch rows.

    The numbers of configuration k begin at `x[at + k * stride]`. If `m` is 1, one configuration fills all
    lanes.
    """
    i = 0
    if m == 1:
        for i in range(count):
            store_number(scratch, row + i, broadcast(x[at + i]))
    else:
        while i + 8 <= count:
            _read_8(x, at + i, stride, scratch, row + i)
            i += 8
        if count & 4:
            _read_4(x, at + i, stride, scratch, row + i)
            i += 4
        if count & 2:
            _read_2(x, at + i, stride, scratch, row + i)
            i += 2
        if count & 1:
            _read_1(x, at + i, stride, scratch, row + i)


@inline
def write_rows(m, scratch, rows, first, count, to, at, stride):
    """Copy `count` scratch rows to the array `to`.

    If `m` is 1, only one configuration is copied.
    """
    i = 0
    if m == 1:
        for i in range(count):
            to[at + i] = scratch[rows[first + i] * LANES]
    else:
        while i + 8 <= count:
            _write_8(scratch, rows, first + i, to, at + i, stride)
            i += 8
        if count & 4:
            _write_4(scratch, rows, first + i, to, at + i, stride)
            i += 4
        if count & 2:
            _write_2(scratch, rows, first + i, to, at + i, stride)
            i += 2
        if count & 1:
            _write_1(scratch, rows, first + i, to, at + i, stride)


@intrinsic
def _prefetch(context: Any, x: Any, at: Any) -> Any:
    """Load the cache line of `x[at]`; an address beyond the array causes no error."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), ir.IntType(8).as_pointer())
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [address.type, number, number, number])
        to_read, near, data = number(0), number(3), number(1)
        function = builder.module.declare_intrinsic("llvm.prefetch", [address.type], kind)
        builder.call(function, [address, to_read, near, data])
        return context.get_dummy_value()

    return types.void(DOUBLES, types.intp), generate


@inline
def prefetch(x, at, count):
    if count <= _MAX_PREFETCHED:
        for number in range(at, at + count, LANES):
            _prefetch(x, number)


#: While `x[at]` is read, `x[at + _PREFETCH_DISTANCE]` is loaded into the cache.
_PREFETCH_DISTANCE = 512


@intrinsic
def _load_eight(context: Any, x: Any, at: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, at = arguments
        return builder.load(_vector_pointer(builder, x, at, LANES), align=8)

    return LANES_TYPE(DOUBLES, types.intp), generate


@inline
def _add_eight_squares(total, x, at):
    _prefetch(x, at + _PREFETCH_DISTANCE)
    eight = _load_eight(x, at)
    return total + eight * eight


@inline
def add_squares(total, x, at, count):
    """Add the squares of `count` numbers to the lanes of `total`.

    The last `count % 8` squares are added in all eight lanes. Therefore, the sum of all lanes has these
    bounds:

        sum of squares <= sum of lanes <= 8 * sum of squares

    `is_in_range` compares the sum of all lanes with NO_OVERFLOW_BOUND^2.
    """
    # Four sums are faster than one, because the processor adds to different sums at the same time.
    second, third, fourth = broadcast(0.0), broadcast(0.0), broadcast(0.0)
    end = at + count
    while at + 4 * LANES <= end:
        total, second = _add_eight_squares(total, x, at), _add_eight_squares(second, x, at + LANES)
        third, fourth = (
            _add_eight_squares(third, x, at + 2 * LANES),
            _add_eight_squares(fourth, x, at + 3 * LANES),
        )
        at += 4 * LANES
    while at + LANES <= end:
        total = _add_eight_squares(total, x, at)
        at += LANES
    for i in range(at, end):
        total = total + broadcast(x[i]) * broadcast(x[i])
    return (total + second) + (third + fourth)


@intrinsic
def _sum_lanes(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lanes = [builder.extract_element(arguments[0], ir.IntType(32)(i)) for i in range(LANES)]
        return reduce(builder.fadd, lanes)

    return types.float64(x), generate


@inline
def is_in_range(total):
    return _sum_lanes(total) < NO_OVERFLOW_BOUND * NO_OVERFLOW_BOUND


@intrinsic
def _stream_eight(context: Any, x: Any, i: Any, to: Any, at: Any) -> Any:
    """Copy eight numbers, bypassing the caches; `to[at]` must begin a cache line."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, i, to, at = arguments
        line = builder.load(_vector_pointer(builder, x, i, LANES), align=8)
        store = builder.store(line, _vector_pointer(builder, to, at, LANES), align=64)
        store.set_metadata("nontemporal", builder.module.add_metadata([ir.IntType(32)(1)]))
        return context.get_dummy_value()

    return types.void(DOUBLES, types.intp, DOUBLES, types.intp), generate


@inline
def stream(x, count, to, at, address):
    """Copy `count` numbers to `to[at]` and the next elements.

    Whole cache lines bypass the caches, because a store into the caches would first read the cache line.
    `count` must be at least 7, because up to 7 numbers precede the first whole line. `address` is the address
    of `to[0]`.
    """
    edge = -(address // 8 + at) % LANES
    lines = edge + (count - edge) // LANES * LANES
    for i in range(edge):
        to[at + i] = x[i]
    for i in range(edge, lines, LANES):
        _stream_eight(x, i, to, at + i)
    for i in range(lines, count):
        to[at + i] = x[i]


@intrinsic
def wait_for_writes(context: Any) -> Any:
    """Wait until other processors can read all written numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), generate
