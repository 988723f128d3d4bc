"""Sine and cosine of several angles at once, to 0.65 units in the last place.

The angle is reduced to [-pi/4, pi/4] by Cody and Waite's method; the rounding error of the reduction is
computed too. The polynomials are those of fdlibm (Sun Microsystems, k_sin.c and k_cos.c). Below 2^20 quarter
turns it is enough to represent pi/2 by two doubles, because the multiplications and additions are fused. Near
a multiple of pi/2, the sine or the cosine is near 0; this value has an error of up to 1e-27. For a larger
angle, its lane uses the functions of the C library. The other lanes do not, because the result of a
configuration must not depend on the other configurations.
"""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.compiled.compiling import compiled
from urdfkin.compiled.memory import LANES, put
from urdfkin.compiled.numbers import fused

_LARGEST_ANGLE = 2.0**20 * math.pi / 2.0
_2_PI, _PI_2, _PI_2_REST = 2.0 / math.pi, math.pi / 2.0, 6.123233995736766e-17
#: If this constant is added to a number below 2^51, the last bits of the sum are the nearest integer.
_NO_FRACTION = 1.5 * 2.0**52
_SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
_COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)


@compiled
def sine_cosine(s, row, x):
    """Return (sine, cosine) of angles; `row` is a row of scratch memory that may be overwritten."""
    sine, cosine = _of_small(x)
    if _any_large(x):
        put(s, row, x)
        for k in range(row * LANES, (row + 1) * LANES):
            if not abs(s[k]) < _LARGEST_ANGLE:
                sine, cosine = (
                    _with_lane(sine, k - row * LANES, math.sin(s[k])),
                    _with_lane(cosine, k - row * LANES, math.cos(s[k])),
                )
    return sine, cosine


@intrinsic
def _of_small(context: Any, x: Any) -> Any:
    """Return sine and cosine of angles of less than 2^20 quarter turns, without a branch."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (x,) = arguments
        width = x.type.count
        whole = ir.VectorType(ir.IntType(64), width)

        def all_lanes(value: float) -> Any:
            return ir.Constant(x.type, [value] * width)

        def bits(value: int) -> Any:
            return ir.Constant(whole, [value] * width)

        def polynomial(z: Any, coefficients: tuple[float, ...]) -> Any:
            value = all_lanes(coefficients[-1])
            for coefficient in coefficients[-2::-1]:
                value = fused(builder, z, value, all_lanes(coefficient))
            return value

        shifted = fused(builder, x, all_lanes(_2_PI), all_lanes(_NO_FRACTION))
        quarters = builder.bitcast(shifted, whole)
        n = builder.fsub(shifted, all_lanes(_NO_FRACTION))
        # `near` is exact, because both terms are multiples of 2^-53 and their difference is below 1. The
        # rounding error of r is `lost`, and that of z is `z_lost`.
        near = fused(builder, n, all_lanes(-_PI_2), x)
        r = fused(builder, n, all_lanes(-_PI_2_REST), near)
        lost = fused(builder, n, all_lanes(-_PI_2_REST), builder.fsub(near, r))
        z = builder.fmul(r, r)
        z_lost = fused(builder, r, r, builder.fneg(z))
        # `most` is 1 - z/2, and `most_lost` is its rounding error.
        most = fused(builder, z, all_lanes(-0.5), all_lanes(1.0))
        most_lost = fused(builder, z, all_lanes(-0.5), builder.fsub(all_lanes(1.0), most))
        # sin(r + lost) = sin r + lost cos r, cos(r + lost) = cos r - lost sin r. The largest term is added
        # last; the other terms are small, so their rounding errors are small too.
        sine = fused(builder, builder.fmul(r, z), polynomial(z, _SINE), builder.fmul(lost, most))
        sine = builder.fadd(r, sine)
        rest = fused(builder, builder.fmul(z, z), polynomial(z, _COSINE), most_lost)
        rest = fused(builder, z_lost, all_lanes(-0.5), rest)
        rest = fused(builder, builder.fneg(r), lost, rest)
        cosine = builder.fadd(most, rest)

        def signed(value: Any, turns: Any) -> Any:
            sign = builder.shl(builder.and_(turns, bits(2)), bits(62))
            return builder.bitcast(builder.xor(builder.bitcast(value, whole), sign), x.type)

        # An odd number of quarter turns exchanges sine and cosine. Two or three quarter turns change the sign
        # of the sine; one or two quarter turns change the sign of the cosine.
        odd = builder.icmp_signed("!=", builder.and_(quarters, bits(1)), bits(0))
        pair = (
            signed(builder.select(odd, cosine, sine), quarters),
            signed(builder.select(odd, sine, cosine), builder.add(quarters, bits(1))),
        )
        return context.make_tuple(builder, signature.return_type, pair)

    return types.UniTuple(x, 2)(x), generate


@intrinsic
def _any_large(context: Any, x: Any) -> Any:
    """Return whether a lane contains an angle of 2^20 quarter turns or more, or nan."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (x,) = arguments
        width = x.type.count
        size = builder.bitcast(x, ir.VectorType(ir.IntType(64), width))
        positive = ir.Constant(size.type, [2**63 - 1] * width)
        size = builder.bitcast(builder.and_(size, positive), x.type)
        large = builder.fcmp_unordered(">=", size, ir.Constant(x.type, [_LARGEST_ANGLE] * width))
        as_bits = builder.bitcast(large, ir.IntType(width))
        return builder.icmp_unsigned("!=", as_bits, ir.Constant(as_bits.type, 0))

    return types.boolean(x), generate


@intrinsic
def _with_lane(context: Any, x: Any, lane: Any, value: Any) -> Any:
    """Return a copy of the number x in which one lane contains another double."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, lane, value = arguments
        return builder.insert_element(x, value, lane)

    return x(x, types.intp, types.float64), generate
