"""From memory to lanes and back: eight configurations at a time, eight numbers at a time.

In memory the numbers of one configuration lie together; in lanes those of one row do, one for each
configuration. Going from one to the other is a transposition. Number by number it took a third of the time
of a Jacobian; in blocks of eight by eight it is a few shuffles. What is left of a width that eight does not
divide goes in blocks of four, two and one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.recursion.lanes import LANES, lane_function

#: Lanes and numbers of a full block.
_EIGHT = 8
#: Numbers in half of a first-level cache.
_MOST_FETCHED = 3072
_NUMBERS = types.CPointer(types.float64)


def _piece(builder: Any, vector: Any, start: int, width: int) -> Any:
    """`width` elements of a vector."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), width), list(range(start, start + width)))
    return builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), mask)


def _joined(builder: Any, pieces: Sequence[Any]) -> Any:
    """Vectors of equal width, a power of two of them, one behind the other."""
    while len(pieces) > 1:
        width = 2 * pieces[0].type.count
        mask = ir.Constant(ir.VectorType(ir.IntType(32), width), list(range(width)))
        pieces = [builder.shuffle_vector(a, b, mask) for a, b in zip(pieces[::2], pieces[1::2], strict=True)]
    return pieces[0]


def _transposed(builder: Any, vectors: Sequence[Any]) -> list[Any]:
    """Square blocks, side by side in the vectors, each turned over: its own inverse.

    For w = 1, 2, 4: in each block of 2w by 2w, the upper right and the lower left w by w change rows.
    """
    x, w = list(vectors), 1
    while w < len(x):
        for i in range(len(x)):
            if not i & w:
                first = [_EIGHT + j - w if j & w else j for j in range(_EIGHT)]
                second = [_EIGHT + j if j & w else j + w for j in range(_EIGHT)]
                masks = (ir.Constant(ir.VectorType(ir.IntType(32), _EIGHT), m) for m in (first, second))
                x[i], x[i + w] = (builder.shuffle_vector(x[i], x[i + w], mask) for mask in masks)
        w *= 2
    return x


def _vector_at(builder: Any, numbers: Any, at: Any, width: int) -> Any:
    """The address of `width` numbers that begin at `numbers[at]`."""
    return builder.bitcast(builder.gep(numbers, [at]), ir.VectorType(ir.DoubleType(), width).as_pointer())


def _plus(builder: Any, number: Any, constant: int) -> Any:
    return builder.add(number, ir.Constant(number.type, constant))


def _reading(width: int) -> Any:
    """A block of eight configurations, `width` numbers of each, into rows."""

    @intrinsic
    def read(context: Any, x: Any, at: Any, stride: Any, s: Any, row: Any, half: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            x, at, stride, s, row, half = arguments
            pieces = []
            for _ in range(_EIGHT):
                pieces.append(builder.load(_vector_at(builder, x, at, width), align=8))
                at = builder.add(at, stride)
            rows = _transposed(builder, [_joined(builder, pieces[i::width]) for i in range(width)])
            to = builder.add(builder.mul(row, ir.Constant(row.type, LANES)), half)
            for i, vector in enumerate(rows):
                place = _vector_at(builder, s, _plus(builder, to, LANES * i), _EIGHT)
                builder.store(vector, place, align=8)
            return context.get_dummy_value()

        return types.void(_NUMBERS, *[types.intp] * 2, _NUMBERS, *[types.intp] * 2), generate

    return read


def _writing(width: int) -> Any:
    """`width` rows, wherever they are, into the memory of eight configurations."""

    @intrinsic
    def write(context: Any, s: Any, rows: Any, first: Any, half: Any, to: Any, at: Any, stride: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            s, rows, first, half, to, at, stride = arguments
            vectors = []
            for i in range(width):
                row = builder.load(builder.gep(rows, [_plus(builder, first, i)]))
                begin = builder.add(builder.mul(row, ir.Constant(row.type, LANES)), half)
                vectors.append(builder.load(_vector_at(builder, s, begin, _EIGHT), align=8))
            blocks = _transposed(builder, vectors)
            for k in range(_EIGHT):
                numbers = _piece(builder, blocks[k % width], k // width * width, width)
                builder.store(numbers, _vector_at(builder, to, at, width), align=8)
                at = builder.add(at, stride)
            return context.get_dummy_value()

        whole = types.CPointer(types.int64)
        return types.void(_NUMBERS, whole, *[types.intp] * 2, _NUMBERS, *[types.intp] * 2), generate

    return write


_read_8, _read_4, _read_2, _read_1 = map(_reading, (8, 4, 2, 1))
_write_8, _write_4, _write_2, _write_1 = map(_writing, (8, 4, 2, 1))


@lane_function
def read_rows(m, x, at, stride, count, s, row):
    """`count` numbers, from `x[at]` on, of each of `m` configurations `stride` apart, into rows."""
    if m == 1:
        for i in range(count):
            s[(row + i) * LANES] = x[at + i]
        return
    for half in range(0, LANES, _EIGHT):
        here, i = at + half * stride, 0
        while i + 8 <= count:
            _read_8(x, here + i, stride, s, row + i, half)
            i += 8
        if count & 4:
            _read_4(x, here + i, stride, s, row + i, half)
            i += 4
        if count & 2:
            _read_2(x, here + i, stride, s, row + i, half)
            i += 2
        if count & 1:
            _read_1(x, here + i, stride, s, row + i, half)


@lane_function
def write_rows(m, s, rows, first, count, to, at, stride):
    """Rows `rows[first]`, ... as `count` numbers, from `to[at]` on, of each of `m` configurations."""
    if m == 1:
        for i in range(count):
            to[at + i] = s[rows[first + i] * LANES]
        return
    for half in range(0, LANES, _EIGHT):
        here, i = at + half * stride, 0
        while i + 8 <= count:
            _write_8(s, rows, first + i, half, to, here + i, stride)
            i += 8
        if count & 4:
            _write_4(s, rows, first + i, half, to, here + i, stride)
            i += 4
        if count & 2:
            _write_2(s, rows, first + i, half, to, here + i, stride)
            i += 2
        if count & 1:
            _write_1(s, rows, first + i, half, to, here + i, stride)


def _fetching(to_write: int) -> Any:
    """Have the memory around `x[at]` brought near; an address beyond the end does no harm."""

    @intrinsic
    def fetch(context: Any, x: Any, at: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            address = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), ir.IntType(8).as_pointer())
            number = ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [address.type, number, number, number])
            near, data = number(3), number(1)
            function = builder.module.declare_intrinsic("llvm.prefetch", [address.type], kind)
            builder.call(function, [address, number(to_write), near, data])
            return context.get_dummy_value()

        return types.void(_NUMBERS, types.intp), generate

    return fetch


_fetch_to_read, _fetch_to_write = map(_fetching, (0, 1))


@lane_function
def fetch_inputs(m, x, at, count):
    """Ask for the `count` numbers from `x[at]` on: the next block's inputs, while this one is computed."""
    if m > 1 and count <= _MOST_FETCHED:
        for number in range(at, at + count, _EIGHT):
            _fetch_to_read(x, number)


@lane_function
def fetch_output(m, i, of, to, at, count):
    """Ask for share `i` of `of` of the `count` numbers from `to[at]` on, which a block will write.

    A block's output is scattered over more cache lines than the processor fetches at a time. Asked for while
    the walk goes on, they are there when it writes. What is too large for the cache is left alone.
    """
    if m > 1 and count <= _MOST_FETCHED:
        share = count // of + 1
        for number in range(i * share, (i + 1) * share, _EIGHT):
            _fetch_to_write(to, at + number)
