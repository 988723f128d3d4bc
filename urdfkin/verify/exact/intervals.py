"""Interval arithmetic with rigorous bounds.

mpmath computes sums, differences, products, quotients and integer powers of intervals in integer arithmetic
and rounds them outward once, which is rigorous. mpmath's square root, sine, cosine and parser of large
exponents are accurate, but their bounds are not proven. This module has rigorous versions of these functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from mpmath.ctx_iv import MPIntervalContext
from mpmath.libmp import dps_to_prec, from_float, from_int, mpf_gt, mpf_lt, to_float

from urdfkin.verify.exact.numbers import Matrix, Number, defect, nearest_rotation

#: Additional bits of precision during iterations.
_SPARE = 30
#: Taylor's series is used for angles below 2^-10. Sine and cosine of larger angles follow from the
#: double-angle formulas.
_SMALL = 10


class Intervals:
    """Functions of intervals with ends of a given precision, for `urdfkin.verify.exact.recursion`.

    Args:
        bits: Precision of the ends, bits; a double has 53.
    """

    def __init__(self, bits: int) -> None:
        self.bits = bits
        self._field = MPIntervalContext()
        self._field.prec = bits

    def mpf(self, value: str | float) -> Number:
        """Return the smallest interval that contains a decimal, or the exact interval of a double."""
        if not isinstance(value, str):
            return self._field.mpf(value)
        mantissa, _, exponent = value.lower().partition("e")
        whole, _, fraction = mantissa.partition(".")
        digits, shift = self._whole(int(whole + fraction)), int(exponent or 0) - len(fraction)
        power = self._whole(10) ** abs(shift)
        return digits * power if shift > 0 else digits / power

    def _whole(self, number: int) -> Number:
        """Return the exact interval of an integer of any size."""
        end = from_int(number)
        return self._field.make_mpf((end, end))

    def sqrt(self, x: Number) -> Number:
        """Return the square root. For any m > 0 it lies between m and x / m (Heron)."""
        m = self._field.sqrt(x.mid).mid
        other = x / m
        return self._field.mpf((min(m, other.a), max(m, other.b)))

    def cos_sin(self, angle: Number) -> tuple[Number, Number]:
        """Return cosine and sine of an angle: those of its midpoint, widened by half its width.

        The midpoint is halved until Taylor's series converges fast. The remainder of the series is below its
        next term. Then the formulas 1 - 2 s^2 and 2 s c double the angle. Each doubling enlarges the error at
        most four times.
        """
        if angle == 0:
            return self.mpf(1), self.mpf(0)
        middle = angle.mid
        halvings = max(0, self._field.mag(middle) + _SMALL)
        wide = intervals(self.bits + 2 * halvings + _SPARE)
        small = wide._own(middle) / 2**halvings  # exact: a division by a power of two
        sums, term, k = [wide.mpf(1), wide.mpf(0)], wide.mpf(1), 0
        while wide._field.mag(term) > -wide.bits:
            k += 1
            term = term * small / k
            sums[k % 2] += term if k % 4 < 2 else -term
        rest = wide.around(term * small / (k + 1))
        c, s = (total + rest for total in sums)
        for _ in range(halvings):
            c, s = 1 - 2 * s * s, 2 * s * c
        spread = self.around(angle - middle)
        return self._own(c) + spread, self._own(s) + spread

    def around(self, x: Number) -> Number:
        """Return the interval from -m to m, where m is the largest |x| in `x`."""
        size = abs(x).b
        return self._field.mpf((-size, size))

    def _own(self, x: Number) -> Number:
        """Return an interval of another precision as an interval of this context, with the same ends."""
        return self._field.make_mpf(x._mpi_)

    def nearest_rotation(self, M: Matrix) -> Matrix:
        """Return the rotation nearest to a matrix that is a rotation to some digits, with rigorous bounds.

        Newton's iteration returns X = U (1 + E) with the same orthogonal factor U. X^T X - 1 = 2 E + E^2. The
        eigenvalues of E are above -1, so |E| <= |2 E + E^2| and |X - U| <= |X^T X - 1|.
        """
        wide = intervals(self.bits + _SPARE)
        X = nearest_rotation(_each(wide._own, M))
        rest = wide.around(sum(abs(x) for row in defect(X) for x in row))
        return _each(lambda x: self._own(x + rest) + 0, X)


def _each(function: Callable[[Number], Number], M: Matrix) -> Matrix:
    """Return the matrix with the function applied to each number."""
    x, y, z = ((function(a), function(b), function(c)) for a, b, c in M)
    return x, y, z


@cache
def intervals(bits: int) -> Intervals:
    """Return the context for a precision; it is created once."""
    return Intervals(bits)


def of_digits(digits: int) -> Intervals:
    """Return the context for a number of decimal digits."""
    return intervals(dps_to_prec(digits))


def ends(x: Number) -> tuple[float, float]:
    """Return the ends of an interval or an integer, rounded outward to doubles."""
    if isinstance(x, int):
        return float(x), float(x)
    a, b = x._mpi_
    low, high = to_float(a), to_float(b)
    # The error of `to_float` is less than the distance to the next double, also for subnormal and infinite
    # numbers.
    if mpf_lt(a, from_float(low)):
        low = math.nextafter(low, -math.inf)
    if mpf_gt(b, from_float(high)):
        high = math.nextafter(high, math.inf)
    return low, high
