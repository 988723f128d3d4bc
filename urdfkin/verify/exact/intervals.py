"""Intervals that hold the true value, proven from whole numbers on.

mpmath's sums, differences, products, quotients and whole powers of intervals are taken in whole numbers and
rounded outward once. Its square root, sine, cosine and its reading of large exponents are good to the last
digit, without a proof; here they are made of what is proven.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from mpmath.ctx_iv import MPIntervalContext
from mpmath.libmp import dps_to_prec, from_float, from_int, mpf_gt, mpf_lt, to_float

from urdfkin.verify.exact.numbers import Matrix, Number, defect, nearest_rotation

#: Bits beyond those asked for, where something is doubled or iterated.
_SPARE = 30
#: Sine and cosine are summed for angles below 2^-10, and doubled from there.
_SMALL = 10


class Intervals:
    """A kind of number for `urdfkin.verify.exact.recursion`: intervals whose ends have so many bits.

    Args:
        bits: Of the ends; 53 are those of a double.
    """

    def __init__(self, bits: int) -> None:
        self.bits = bits
        self._field = MPIntervalContext()
        self._field.prec = bits

    def mpf(self, value: str | float) -> Number:
        """A decimal as it is written, in as small an interval as there is; or a double, as it is."""
        if not isinstance(value, str):
            return self._field.mpf(value)
        mantissa, _, exponent = value.lower().partition("e")
        whole, _, fraction = mantissa.partition(".")
        digits, shift = self._whole(int(whole + fraction)), int(exponent or 0) - len(fraction)
        power = self._whole(10) ** abs(shift)
        return digits * power if shift > 0 else digits / power

    def _whole(self, number: int) -> Number:
        """All digits of it, however many."""
        end = from_int(number)
        return self._field.make_mpf((end, end))

    def sqrt(self, x: Number) -> Number:
        """The root of x lies between any m > 0 and x / m, which Heron knew."""
        m = self._field.sqrt(x.mid).mid
        other = x / m
        return self._field.mpf((min(m, other.a), max(m, other.b)))

    def cos_sin(self, angle: Number) -> tuple[Number, Number]:
        """Cosine and sine of the middle, which change by no more than the angle does.

        Those of a small part of it are sums of Taylor's series, whose remainder is less than the next term;
        1 - 2 s^2 and 2 s c double the angle, and what is not known of it four times at most.
        """
        if angle == 0:
            return self.mpf(1), self.mpf(0)
        middle = angle.mid
        halvings = max(0, self._field.mag(middle) + _SMALL)
        wide = intervals(self.bits + 2 * halvings + _SPARE)
        small = wide._own(middle) / 2**halvings  # exact: the ends lose no bit
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
        """From -|x| to |x|, with the largest |x| there is in x."""
        size = abs(x).b
        return self._field.mpf((-size, size))

    def _own(self, x: Number) -> Number:
        """An interval of another precision; what is computed with it is rounded here."""
        return self._field.make_mpf(x._mpi_)

    def nearest_rotation(self, M: Matrix) -> Matrix:
        """The rotation nearest to a matrix which is one to some digits, proven.

        Newton's steps leave a matrix X = U (1 + E) of the same orthogonal factor U. X^T X - 1 = 2 E + E^2 is
        larger than E, whose eigenvalues are above -1: |X - U| <= |X^T X - 1|.
        """
        wide = intervals(self.bits + _SPARE)
        X = nearest_rotation(_each(wide._own, M))
        rest = wide.around(sum(abs(x) for row in defect(X) for x in row))
        return _each(lambda x: self._own(x + rest) + 0, X)


def _each(function: Callable[[Number], Number], M: Matrix) -> Matrix:
    """A matrix of the results."""
    x, y, z = ((function(a), function(b), function(c)) for a, b, c in M)
    return x, y, z


@cache
def intervals(bits: int) -> Intervals:
    """The kind of number, made once."""
    return Intervals(bits)


def of_digits(digits: int) -> Intervals:
    """Intervals whose ends have so many decimal digits, and a little more."""
    return intervals(dps_to_prec(digits))


def ends(x: Number) -> tuple[float, float]:
    """The doubles between which an interval lies, or a whole number: the nearest to its ends, outward."""
    if isinstance(x, int):
        return float(x), float(x)
    a, b = x._mpi_
    low, high = to_float(a), to_float(b)
    # `to_float` is off by less than one double, subnormal and infinite ones included.
    if mpf_lt(a, from_float(low)):
        low = math.nextafter(low, -math.inf)
    if mpf_gt(b, from_float(high)):
        high = math.nextafter(high, math.inf)
    return low, high
