"""An interval contains the true value, which fractions and mpmath compute."""

import math
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal, localcontext
from fractions import Fraction
from threading import Event
from typing import Any

import numpy as np
import pytest
from flint import arb
from hypothesis import given
from hypothesis import strategies as st

from tests.high_precision import mp as independent
from tests.high_precision import orthogonal_factor
from tests.strategies import rotations
from urdfkin.model.recursion import Matrix
from urdfkin.model.tree import FloatArray
from urdfkin.verify.exact.numbers import (
    as_interval,
    format_decimal,
    interval_ends,
    nearest_rotation,
    precision,
)

DIGITS = (15, 50)
#: Eight units in the last place of 53 and of 169 bits.
WIDTH = {15: Fraction(2) ** -50, 50: Fraction(2) ** -166}
finite = st.floats(allow_nan=False, allow_infinity=False)


def true_ends(x: Any) -> tuple[Fraction, Fraction]:
    numbers = (each.man_exp() for each in (x.mid(), x.rad()))
    middle, radius = (Fraction(int(man)) * Fraction(2) ** int(exp) for man, exp in numbers)
    return middle - radius, middle + radius


def fraction(x: Any) -> Fraction:
    sign, man, exp, _ = x._mpf_
    return Fraction(-int(man) if sign else int(man)) * Fraction(2) ** int(exp)


WORDS = ("0.1", "-.5", "3.", "+2e3", "1E-7", "0", "-0.0", "1.5707963267948966", "1e22", "123456789" * 9)
FAR = ("1e300", "-1.7976931348623157e308", "5e-324", "1e-400", "2.5e-1000", "3.1e777", "-9.9e-5001")


@pytest.mark.parametrize("digits", DIGITS)
@pytest.mark.parametrize("word", [*WORDS, *FAR])
def test_a_decimal_with_any_exponent_lies_in_the_interval(word: str, digits: int) -> None:
    with precision(digits):
        low, high = true_ends(arb(word))
    assert low <= Fraction(word) <= high
    assert high - low <= abs(Fraction(word)) * WIDTH[digits]


@given(finite)
def test_the_interval_of_a_double_has_zero_width(x: float) -> None:
    assert true_ends(as_interval(x)) == (Fraction(x), Fraction(x))


@pytest.mark.parametrize("digits", DIGITS)
@given(x=st.floats(1e-300, 1e300))
def test_the_interval_of_a_square_root_contains_the_root(digits: int, x: float) -> None:
    with precision(digits):
        low, high = true_ends(as_interval(x).sqrt())
    assert low**2 <= Fraction(x) <= high**2
    assert high - low <= high * WIDTH[digits]


@pytest.mark.slow
@pytest.mark.parametrize("digits", DIGITS)
@given(angle=st.one_of(finite, st.floats(-7.0, 7.0), st.integers(-9, 9).map(lambda k: k * math.pi / 2)))
def test_cosine_and_sine_of_every_double_lie_in_the_computed_intervals(digits: int, angle: float) -> None:
    context = independent.clone()
    # The reduction of 1e308 rad needs 1,024 bits. The number 1 - cos(5e-324) begins after 2,148 bits.
    context.prec = 2200 + 8 * digits
    with precision(digits):
        found = as_interval(angle).sin_cos()
    for interval, function in zip(found, (context.sin, context.cos), strict=True):
        low, high = true_ends(interval)
        assert low <= fraction(function(context.mpf(angle))) <= high
        assert high - low <= WIDTH[digits]


@pytest.mark.parametrize("digits", DIGITS)
@pytest.mark.parametrize("exponent", [-20, -60, -100, -200, -1000])
def test_intervals_of_sine_and_cosine_include_the_omitted_terms_of_the_series(
    exponent: int, digits: int
) -> None:
    # For such a small angle, the first terms are exact doubles; only the omitted terms give the interval a
    # width.
    x = Fraction(2) ** exponent
    with precision(digits):
        sine, cosine = map(true_ends, as_interval(2.0**exponent).sin_cos())
    # Sine and cosine lie between two partial sums of their alternating series.
    assert sine[0] < x - x**3 / 6 + x**5 / 120
    assert sine[1] > x - x**3 / 6
    assert cosine[0] < 1 - x**2 / 2 + x**4 / 24
    assert cosine[1] > 1 - x**2 / 2


def nearest(M: FloatArray, digits: int) -> Matrix:
    with precision(digits):
        x, y, z = (tuple(map(as_interval, row)) for row in M.tolist())
        return nearest_rotation((x, y, z))


@pytest.mark.slow
@pytest.mark.parametrize("digits", [15, 50])
@given(R=rotations, off=st.integers(0, 2**32 - 1).map(np.random.default_rng))
def test_the_nearest_rotation_lies_in_the_computed_intervals(digits: int, R: FloatArray, off: Any) -> None:
    M = R + off.uniform(-5e-10, 5e-10, (3, 3))
    found, expected = nearest(M, digits), orthogonal_factor(M)
    room = Fraction(10) ** -57  # what the 60 digits of mpmath may be off by
    for i, j in np.ndindex(3, 3):
        low, high = true_ends(found[i][j])
        assert low - room <= fraction(expected[i, j]) <= high + room
        assert high - low < Fraction(10) ** (1 - digits)


def test_intervals_of_the_nearest_rotation_include_the_residual_of_newtons_method() -> None:
    # Six steps give about 550 digits, so 1000 digits need the bound of the residual.
    M = np.array([[0.28, -0.96, 0.0], [0.96, 0.28, 0.0], [0.0, 0.0, 1.0]])
    M += np.random.default_rng(1).uniform(-5e-10, 5e-10, (3, 3))
    found = nearest(M, 1000)
    with independent.workdps(1010):
        expected = orthogonal_factor(M)
        for i, j in np.ndindex(3, 3):
            low, high = true_ends(found[i][j])
            assert low <= fraction(expected[i, j]) <= high
            assert high - low < Fraction(10) ** -500


def test_the_nearest_rotation_of_an_exact_rotation_is_equal_with_zero_width() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for row, right in zip(nearest(turn, 15), turn.tolist(), strict=True):
        assert [true_ends(number) for number in row] == [(number, number) for number in right]


@given(st.integers(-(2**200), 2**200), st.integers(-1400, 1100))
def test_the_doubles_around_an_interval_are_the_nearest_outside_the_interval(man: int, exponent: int) -> None:
    with precision(120):
        low, high = interval_ends(arb((man, exponent)))
    true = Fraction(man) * Fraction(2) ** exponent
    assert low == -math.inf or Fraction(low) <= true
    assert high == math.inf or true <= Fraction(high)
    assert low == high or math.nextafter(low, math.inf) == high


def test_both_ends_of_a_whole_number_are_the_number() -> None:
    assert interval_ends(1) == (1.0, 1.0)


moderate = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


@given(moderate, moderate.filter(bool), moderate)
def test_a_decimal_is_the_true_value_rounded_to_seventeen_digits(x: float, y: float, z: float) -> None:
    true = Fraction(x) / Fraction(y) + Fraction(z)
    with precision(50):
        found = format_decimal(as_interval(x) / y + z, 1e-15)
    with localcontext(prec=17):
        expected = Decimal(true.numerator) / Decimal(true.denominator)
    if found is None:  # x / y and z cancel, but for less than thirty digits
        assert abs(true) < Fraction(1, 10**25) * abs(Fraction(z))
    elif found == "0":
        assert abs(true) < Fraction(1, 10**25)
    else:
        assert Decimal(found) == expected
        assert float(found) == float(expected)


def test_a_ball_with_a_too_large_radius_has_no_decimal() -> None:
    with precision(50):
        assert format_decimal(arb(1.0, 1e-19), 1.0) is None
        assert format_decimal(arb(0.0, 1e-19), 1e-12) is None
        assert format_decimal(arb(0.0, 1e-19), 1e-3) == "0"


def test_a_second_thread_waits_until_the_first_thread_no_longer_needs_its_precision() -> None:
    first_entered, second_entered, leave = Event(), Event(), Event()

    def first() -> None:
        with precision(15):
            first_entered.set()
            leave.wait(30.0)

    def second() -> None:
        with precision(300):
            second_entered.set()

    with ThreadPoolExecutor(2) as pool:
        results = [pool.submit(first)]
        assert first_entered.wait(30.0)
        results.append(pool.submit(second))
        entered_early = second_entered.wait(0.2)
        leave.set()
        for result in results:
            result.result(30.0)
    assert not entered_early
    assert second_entered.is_set()
