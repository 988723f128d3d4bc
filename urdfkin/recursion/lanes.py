"""Vectors in lanes: sixteen configurations side by side, so that the compiler can use the vector units.

A scratch array holds *rows* of `LANES` numbers, one number for each configuration of a block. A vector is
three rows, a rotation nine, row-major. Functions here read and write one lane `k`; loops over the lanes of
a block stand where the equations stand, in `steps` and `kernels`. Row numbers are compile-time constants,
which is how the compiler sees that rows do not overlap and turns the loops into vector instructions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

#: Configurations side by side. Two AVX-512 or four AVX2 registers a row: enough to hide latencies, and a
#: chain of a hundred joints still fits the second-level cache.
LANES = 16

#: A vector as the compiler sees it: three numbers of one lane.
Vec = tuple[float, float, float]

#: How every function here and in the kernels is compiled. Nothing is reordered and multiplications are not
#: fused with additions: the compiler would fuse differently in its vector code and in its scalar code, and
#: the last bit would depend on where arrays happen to lie in memory. Division by zero gives inf as in C, so
#: that no loop carries a branch that raises. Nothing is allocated, so that arrays need no reference counts:
#: counting them took half of the time.
COMPILED: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


def jitted(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: Numba's, with the options of every function here, and those given."""

    def decorate(function: Callable[..., Any]) -> Any:
        with compiling_allowed():
            return numba.njit(**options, **COMPILED)(function)

    return decorate


@contextmanager
def compiling_allowed() -> Iterator[None]:
    """NUMBA_DISABLE_JIT is not obeyed: it is meant for functions that Python could run instead."""
    config: Any = numba.config
    before, config.DISABLE_JIT = config.DISABLE_JIT, 0
    try:
        yield
    finally:
        config.DISABLE_JIT = before


lane_function = jitted(forceinline=True)


@intrinsic
def pointer_to(context: Any, array: Any) -> Any:
    """The numbers of an array without its shape: no test for a negative index for each of them."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), generate


@intrinsic
def _address_of(context: Any, array: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.ptrtoint(data, ir.IntType(64))

    return types.int64(array), generate


@lane_function
def apart(x, out):
    """Whether two contiguous arrays of doubles have no memory in common."""
    first, to = _address_of(x), _address_of(out)
    return first + 8 * x.size <= to or to + 8 * out.size <= first


def _pointer_from_address(number: Any) -> Any:
    @intrinsic
    def pointer(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return types.CPointer(number)(types.int64), generate

    return pointer


#: The numbers, or whole numbers, at an address.
numbers_at, whole_numbers_at = map(_pointer_from_address, (types.float64, types.int64))


@lane_function
def load(s, row, k):
    """The vector in rows `row`, `row + 1`, `row + 2` of lane `k`."""
    at = row * LANES + k
    return s[at], s[at + LANES], s[at + 2 * LANES]


@lane_function
def store(s, row, k, x):
    """Write a vector."""
    at = row * LANES + k
    s[at] = x[0]
    s[at + LANES] = x[1]
    s[at + 2 * LANES] = x[2]


@lane_function
def cross(x, y):
    """`x x y`, that is S(x) y with the matrix of eq. 7.16."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


@lane_function
def plus(x, y):
    """`x + y`."""
    return x[0] + y[0], x[1] + y[1], x[2] + y[2]


@lane_function
def minus(x, y):
    """`x - y`."""
    return x[0] - y[0], x[1] - y[1], x[2] - y[2]


@lane_function
def times(c, x):
    """`c x` for a number c."""
    return c * x[0], c * x[1], c * x[2]


@lane_function
def dot(x, y):
    """`x . y`."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@lane_function
def column(s, row, j, k):
    """Column `j` of the rotation that begins at `row`: one of its axes, in the world frame."""
    at = (row + j) * LANES + k
    return s[at], s[at + 3 * LANES], s[at + 6 * LANES]


@lane_function
def rotate(s, row, x, k):
    """`R x` for the rotation that begins at `row`."""
    return dot(load(s, row, k), x), dot(load(s, row + 3, k), x), dot(load(s, row + 6, k), x)


@lane_function
def rotate_back(s, row, x, k):
    """`R^T x` for the rotation that begins at `row`."""
    return dot(column(s, row, 0, k), x), dot(column(s, row, 1, k), x), dot(column(s, row, 2, k), x)


@intrinsic
def copy_rows(context: Any, m: Any, s: Any, source: Any, target: Any, count: Any) -> Any:
    """Copy `count` whole rows, each at once; with one lane, only that.

    Rows whose number is not a constant are met here and nowhere else: the compiler cannot see that two of
    them are apart, and would copy number by number.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        m, numbers, source, target, count = arguments
        with cgutils.for_range(builder, count) as loop:
            places = (builder.add(first, loop.index) for first in (source, target))
            begin = (builder.mul(place, place.type(LANES)) for place in places)
            at, to = (builder.gep(numbers, [number]) for number in begin)
            with builder.if_else(builder.icmp_signed("==", m, m.type(1))) as (one, all_lanes):
                with one:
                    builder.store(builder.load(at), to)
                with all_lanes:
                    row = ir.VectorType(ir.DoubleType(), LANES).as_pointer()
                    whole = builder.load(builder.bitcast(at, row), align=8)
                    builder.store(whole, builder.bitcast(to, row), align=8)
        return context.get_dummy_value()

    numbers = types.CPointer(types.float64)
    return types.void(types.intp, numbers, types.intp, types.intp, types.intp), generate


# Sine and cosine of a whole block: Cody and Waite's reduction to [-pi/4, pi/4] with pi/2 in three parts,
# then the polynomials of fdlibm (Sun Microsystems, k_sin.c and k_cos.c). The first two parts have 33 bits,
# so that n * part is exact while n < 2^20; beyond that an angle takes the library's functions. It alone: what
# stands beside it in the block must not change a configuration's result.
_LARGEST_ANGLE = 2.0**20 * math.pi / 2.0
_PI_2_PARTS = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
_S = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
_C = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
_P1, _P2, _P3 = _PI_2_PARTS
_S1, _S2, _S3, _S4, _S5, _S6 = _S
_C1, _C2, _C3, _C4, _C5, _C6 = _C
_2_PI = 2.0 / math.pi
_NO_FRACTION = 1.5 * 2.0**52


@lane_function
def _nearest(x):
    """The nearest whole number, for |x| < 2^51: adding 1.5 * 2^52 leaves no room for a fraction.

    `floor` would be a call out of the loop for each lane.
    """
    return (x + _NO_FRACTION) - _NO_FRACTION


@lane_function
def sine_cosine(m, s, angle, sine, cosine):
    """Rows `sine` and `cosine` from row `angle`, to the last digit, without a branch in the loop.

    Large angles come by themselves, so that no lane depends on what its neighbours hold.
    """
    large = 0
    for k in range(m):
        large |= int(abs(s[angle * LANES + k]) >= _LARGEST_ANGLE)
    for k in range(m):
        x = s[angle * LANES + k]
        n = _nearest(x * _2_PI)
        r = ((x - n * _P1) - n * _P2) - n * _P3
        z = r * r
        sin_r = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
        cos_r = 1.0 - (0.5 * z - z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))))
        # Quarter turns: an odd n swaps the two, n mod 4 in {2, 3} changes the sine's sign and
        # n mod 4 in {1, 2} the cosine's.
        half = _nearest(0.5 * n - 0.25)
        odd = n - 2.0 * half
        sign = 1.0 - 2.0 * (half - 2.0 * _nearest(0.5 * half - 0.25))
        s[sine * LANES + k] = sign * (cos_r if odd > 0.5 else sin_r)
        s[cosine * LANES + k] = sign * (1.0 - 2.0 * odd) * (sin_r if odd > 0.5 else cos_r)
    if large:
        for k in range(m):
            x = s[angle * LANES + k]
            if abs(x) >= _LARGEST_ANGLE:
                s[sine * LANES + k] = math.sin(x)
                s[cosine * LANES + k] = math.cos(x)
