"""Number types for the recursion in plain Python, for one configuration.

Compiled kernels use the number types of `urdfkin.compiled.machine.numbers`. Results with and without
compilation are exactly the same doubles.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from typing import Any

#: Let L be this number. No result overflows if coordinates, velocities, lengths and multipliers are below L.
#: A mimic joint multiplies a velocity or a displacement by its multiplier, so both are below L^2. For N
#: joints, an angular velocity w and a path length d are therefore below N L^2. The largest product is w^2 d,
#: which is below N^3 L^6.
NO_OVERFLOW_BOUND = 1e45

LARGEST_ANGLE = 2.0**20 * math.pi / 2.0
_TWO_OVER_PI, PI_2, PI_2_REST = 2.0 / math.pi, math.pi / 2.0, 6.123233995736766e-17
#: Adding this constant rounds a number between -2^51 and 2^51 to an integer. The sum's mantissa contains the
#: integer in its lowest bits.
ROUNDING_SHIFT = 1.5 * 2.0**52
SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)


def _c_fma() -> Callable[[float, float, float], float]:
    function = ctypes.PyDLL(None).fma
    function.restype, function.argtypes = ctypes.c_double, (ctypes.c_double,) * 3
    return function


def _fma_without_errors(
    own: Callable[..., float], c: Callable[..., float]
) -> Callable[[float, float, float], float]:
    """Return a fused multiply-add that returns inf or nan where `math.fma` raises an error."""

    def fma(x: float, y: float, z: float) -> float:
        try:
            return own(x, y, z)
        except (OverflowError, ValueError):
            return c(x, y, z)

    return fma


fma = _fma_without_errors(math.fma, _c_fma()) if hasattr(math, "fma") else _c_fma()


class Number:
    __slots__ = ("x",)

    def __init__(self, x: float) -> None:
        self.x = x

    def __mul__(self, other: Any) -> Any:
        kind = type(other)
        if kind is Number:
            return Product(self.x, other.x)
        if kind is ConstantNumber:
            return other if other.value != 1 else self
        return Product(self.x, _double(other))

    def __rmul__(self, other: int) -> Product:
        return Product(float(other), self.x)

    def __add__(self, other: Any) -> Any:
        kind = type(other)
        if kind is Product:
            return Number(fma(other.x, other.y, self.x))
        if kind is Number:
            return Number(self.x + other.x)
        if kind is ConstantNumber and not other.value:
            return self if other.value == 0 else other
        return Number(self.x + _double(other))

    def __sub__(self, other: Any) -> Any:
        kind = type(other)
        if kind is Product:
            return Number(fma(-other.x, other.y, self.x))
        if kind is Number:
            return Number(self.x - other.x)
        if kind is ConstantNumber and not other.value:
            return self if other.value == 0 else other
        return Number(self.x - _double(other))

    def __rsub__(self, other: int) -> Number:
        return Number(other - self.x)

    def __neg__(self) -> Number:
        return Number(-self.x)


class Product:
    """A product, stored as two factors."""

    __slots__ = ("x", "y")

    def __init__(self, x: float, y: float) -> None:
        self.x, self.y = x, y

    def __mul__(self, other: Any) -> Any:
        if type(other) is ConstantNumber:
            return other if other.value != 1 else self
        return Product(self.x * self.y, _double(other))

    def __rmul__(self, other: int) -> Product:
        return Product(float(other), self.x * self.y)

    def __add__(self, other: Any) -> Any:
        kind = type(other)
        if kind is Product:
            return Number(fma(other.x, other.y, self.x * self.y))
        if kind is ConstantNumber and not other.value:
            return self if other.value == 0 else other
        return Number(fma(self.x, self.y, _double(other)))

    def __sub__(self, other: Any) -> Any:
        kind = type(other)
        if kind is Product:
            return Number(fma(-other.x, other.y, self.x * self.y))
        if kind is ConstantNumber and not other.value:
            return self if other.value == 0 else other
        return Number(fma(self.x, self.y, -_double(other)))

    def __rsub__(self, other: int) -> Number:
        return Number(fma(-self.x, self.y, float(other)))

    def __neg__(self) -> Product:
        return Product(-self.x, self.y)


class ConstantNumber:
    """The constant 0 or 1, or `unused()`."""

    __slots__ = ("value",)

    def __init__(self, value: int | None) -> None:
        self.value = value

    def __mul__(self, other: Any) -> Any:
        if self.value == 1 or (type(other) is ConstantNumber and other.value is None):
            return other
        return self

    def __rmul__(self, other: int) -> Any:
        return self if self.value != 1 else other

    def __add__(self, other: Any) -> Any:
        if self.value is None or (type(other) is ConstantNumber and not other.value):
            return self if self.value is None or other.value == 0 else other
        return other if self.value == 0 else Number(1.0) + other

    def __sub__(self, other: Any) -> Any:
        if self.value is None or (type(other) is ConstantNumber and not other.value):
            return self if self.value is None or other.value == 0 else other
        return -other if self.value == 0 else Number(1.0) - other

    def __rsub__(self, other: int) -> Any:
        return other if self.value == 0 else Number(float(other)) - self

    def __neg__(self) -> Any:
        return Number(-1.0) if self.value else self


def _double(x: Any) -> float:
    """Convert a number to a float; the number must not be `unused()`."""
    if type(x) is Product:
        return x.x * x.y
    return x.x if type(x) is Number else float((x.value or 0) if type(x) is ConstantNumber else x)


_ZERO, _ONE, _UNUSED = ConstantNumber(0), ConstantNumber(1), ConstantNumber(None)


def zero() -> ConstantNumber:
    return _ZERO


def one() -> ConstantNumber:
    return _ONE


def unused() -> ConstantNumber:
    return _UNUSED


def round_product(x: Any) -> Any:
    return Number(x.x * x.y) if type(x) is Product else x


# -- memory ----------------------------------------------------------------------------------------------


def load_number(scratch: Sequence[Number], row: int) -> Number:
    return scratch[row]


def load_number_if(marker: Any, scratch: Sequence[Number], row: int) -> Any:
    return marker if marker is _UNUSED else scratch[row]


def store_number(scratch: list[Number], row: int, x: Any) -> None:
    if x is not _UNUSED:
        scratch[row] = x if type(x) is Number else Number(_double(x))


def load_constant(constants: Sequence[Number], i: int) -> Number:
    return constants[i]


broadcast = Number  # The compiled `broadcast` copies a double to all eight lanes of a vector.


def array_data(array: Any) -> Any:
    return array.tolist()


def doubles_at(address: Any) -> Any:
    """Return the list `address`; the compiled function converts an address to a pointer."""
    return address


integers_at = doubles_at


def read_rows(
    m: int, x: Sequence[float], at: int, stride: int, count: int, scratch: list[Number], row: int
) -> None:
    scratch[row : row + count] = map(Number, x[at : at + count])


def write_rows(
    m: int,
    scratch: Sequence[Number],
    rows: Sequence[int],
    first: int,
    count: int,
    to: list[float],
    at: int,
    _: int,
) -> None:
    to[at : at + count] = [scratch[row].x for row in rows[first : first + count]]


def add_squares(total: Number, x: Sequence[float], at: int, count: int) -> Number:
    return Number(total.x + sum(y * y for y in x[at : at + count]))


def is_in_range(total: Number) -> bool:
    return total.x < NO_OVERFLOW_BOUND * NO_OVERFLOW_BOUND


def wait_for_writes(*_: object) -> None:
    """Do nothing. The compiled function waits until all results are in memory."""


stream = wait_for_writes


# -- sine and cosine -------------------------------------------------------------------------------------


def sine_cosine(scratch: object, row: int, angle: Number) -> tuple[Number, Number]:
    """Return (sine, cosine) of an angle.

    See `urdfkin.compiled.machine.sine` for the steps.
    """
    x = angle.x
    if not abs(x) < LARGEST_ANGLE:
        return (Number(math.sin(x)), Number(math.cos(x))) if math.isfinite(x) else (Number(math.nan),) * 2
    n = fma(x, _TWO_OVER_PI, ROUNDING_SHIFT) - ROUNDING_SHIFT
    near = fma(n, -PI_2, x)
    r = fma(n, -PI_2_REST, near)
    r_error = fma(n, -PI_2_REST, near - r)
    z = r * r
    z_error = fma(r, r, -z)
    leading = fma(z, -0.5, 1.0)
    leading_error = fma(z, -0.5, 1.0 - leading)
    sine = r + fma(r * z, _polynomial(z, SINE), r_error * leading)
    rest = fma(z * z, _polynomial(z, COSINE), leading_error)
    rest = fma(z_error, -0.5, rest)
    cosine = leading + fma(-r, r_error, rest)
    quarters = int(n)
    pair = (cosine, sine) if quarters & 1 else (sine, cosine)
    return (
        Number(-pair[0] if quarters & 2 else pair[0]),
        Number(-pair[1] if quarters + 1 & 2 else pair[1]),
    )


def _polynomial(z: float, coefficients: Sequence[float]) -> float:
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = fma(z, value, coefficient)
    return value
