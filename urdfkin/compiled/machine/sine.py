"""Sine and cosine of several angles at once, to 0.65 units in the last place.

| Absolute value of the angle x | Method |
|---|---|
| below 2^20 quarter turns | Cody and Waite, with fdlibm's polynomials (Sun, k_sin.c and k_cos.c) |
| larger, or nan | the C library, for only these angles of a vector |

Cody and Waite's method, with n quarter turns:

    PI_2 + PI_2_REST: nearly pi/2; two doubles are enough because of fused multiply-adds
    r = x - n PI_2 - n PI_2_REST, in [-pi/4, pi/4]
    r_error: rounding error of r
    absolute error of a sine or cosine near 0 <= 1e-27

The result of a configuration does not depend on the other configurations in the vector.
"""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from urdfkin.compiled.machine.compiling import inline
from urdfkin.compiled.machine.memory import store_number
from urdfkin.compiled.machine.numbers import build_fma
from urdfkin.compiled.plan import LANES
from urdfkin.compiled.python_numbers import COSINE, LARGEST_ANGLE, PI_2, PI_2_REST, ROUNDING_SHIFT, SINE

_TWO_OVER_PI = 2.0 / math.pi


@inline
def sine_cosine(scratch, row, x):
    """Return sines and cosines of angles.

    If an angle is nan or large, the function writes the angles to scratch row `row`.
    """
    sine, cosine = _small_sine_cosine(x)
    if _any_large(x):
        store_number(scratch, row, x)
        for k in range(row * LANES, (row + 1) * LANES):
            if not abs(scratch[k]) < LARGEST_ANGLE:
                sine = _insert_lane(sine, k - row * LANES, math.sin(scratch[k]))
                cosine = _insert_lane(cosine, k - row * LANES, math.cos(scratch[k]))
    return sine, cosine


@intrinsic
def _small_sine_cosine(context: Any, x: Any) -> Any:
    """Return sines and cosines of angles below `LARGEST_ANGLE`; other results are not valid."""

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
                value = build_fma(builder, z, value, all_lanes(coefficient))
            return value

        shifted = build_fma(builder, x, all_lanes(_TWO_OVER_PI), all_lanes(ROUNDING_SHIFT))
        quarters = builder.bitcast(shifted, whole)
        n = builder.fsub(shifted, all_lanes(ROUNDING_SHIFT))
        # Let d be the double nearest to pi/2. If n != 0, x and n d are multiples of 2^-53, and |x - n d| is
        # less than 1, so this difference is exact. If n = 0, then x - n d = x, which is also exact. `r_error`
        # is the rounding error of r, and `z_error` is the rounding error of z = r^2.
        near = build_fma(builder, n, all_lanes(-PI_2), x)
        r = build_fma(builder, n, all_lanes(-PI_2_REST), near)
        r_error = build_fma(builder, n, all_lanes(-PI_2_REST), builder.fsub(near, r))
        z = builder.fmul(r, r)
        z_error = build_fma(builder, r, r, builder.fneg(z))
        # `leading` is 1 - z/2, the beginning of the cosine's series; `leading_error` is its rounding error.
        leading = build_fma(builder, z, all_lanes(-0.5), all_lanes(1.0))
        leading_error = build_fma(builder, z, all_lanes(-0.5), builder.fsub(all_lanes(1.0), leading))
        # To first order, sin(r + r_error) = sin r + r_error cos r,
        # and cos(r + r_error) = cos r - r_error sin r.
        # The largest term is added last, so rounding errors stay small.
        sine = build_fma(builder, builder.fmul(r, z), polynomial(z, SINE), builder.fmul(r_error, leading))
        sine = builder.fadd(r, sine)
        rest = build_fma(builder, builder.fmul(z, z), polynomial(z, COSINE), leading_error)
        rest = build_fma(builder, z_error, all_lanes(-0.5), rest)
        rest = build_fma(builder, builder.fneg(r), r_error, rest)
        cosine = builder.fadd(leading, rest)

        def apply_sign(value: Any, turns: Any) -> Any:
            sign = builder.shl(builder.and_(turns, bits(2)), bits(62))
            return builder.bitcast(builder.xor(builder.bitcast(value, whole), sign), x.type)

        # An odd number of quarter turns exchanges sine and cosine. Let k be the number of quarter turns
        # modulo 4. The sine changes its sign if k is 2 or 3, and the cosine if k is 1 or 2.
        odd = builder.icmp_signed("!=", builder.and_(quarters, bits(1)), bits(0))
        pair = (
            apply_sign(builder.select(odd, cosine, sine), quarters),
            apply_sign(builder.select(odd, sine, cosine), builder.add(quarters, bits(1))),
        )
        return context.make_tuple(builder, signature.return_type, pair)

    return types.UniTuple(x, 2)(x), generate


@intrinsic
def _any_large(context: Any, x: Any) -> Any:
    """Return whether any angle is nan or at least `LARGEST_ANGLE`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (x,) = arguments
        width = x.type.count
        size = builder.bitcast(x, ir.VectorType(ir.IntType(64), width))
        positive = ir.Constant(size.type, [2**63 - 1] * width)
        size = builder.bitcast(builder.and_(size, positive), x.type)
        large = builder.fcmp_unordered(">=", size, ir.Constant(x.type, [LARGEST_ANGLE] * width))
        as_bits = builder.bitcast(large, ir.IntType(width))
        return builder.icmp_unsigned("!=", as_bits, ir.Constant(as_bits.type, 0))

    return types.boolean(x), generate


@intrinsic
def _insert_lane(context: Any, x: Any, lane: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, lane, value = arguments
        return builder.insert_element(x, value, lane)

    return x(x, types.intp, types.float64), generate
