"""An interval contains the true value, which fractions and mpmath compute."""

import math
from decimal import Decimal, localcontext
from fractions import Fraction
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
from urdfkin.verify.exact.numbers import decimal, ends, exact, nearest_rotation, precision

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
def test_a_decimal_lies_in_its_interval_however_large_its_exponent(word: str, digits: int) -> None:
    with precision(digits):
        low, high = true_ends(arb(word))
    assert low <= Fraction(word) <= high
    assert high - low <= abs(Fraction(word)) * WIDTH[digits]


@given(finite)
def test_a_double_is_an_interval_of_itself(x: float) -> None:
    assert true_ends(exact(x)) == (Fraction(x), Fraction(x))


@pytest.mark.parametrize("digits", DIGITS)
@given(x=st.floats(1e-300, 1e300))
def test_the_squares_of_a_roots_ends_lie_on_either_side(digits: int, x: float) -> None:
    with precision(digits):
        low, high = true_ends(exact(x).sqrt())
    assert low**2 <= Fraction(x) <= high**2
    assert high - low <= high * WIDTH[digits]


def test_the_root_of_a_square_is_exact() -> None:
    assert true_ends(exact(25.0).sqrt()) == (Fraction(5), Fraction(5))


@pytest.mark.slow
@pytest.mark.parametrize("digits", DIGITS)
@given(angle=st.one_of(finite, st.floats(-7.0, 7.0), st.integers(-9, 9).map(lambda k: k * math.pi / 2)))
def test_cosine_and_sine_of_every_double_lie_in_their_intervals(digits: int, angle: float) -> None:
    context = independent.clone()
    context.prec = 1100 + 8 * digits  # what reducing 1e308 rad takes
    with precision(digits):
        found = exact(angle).sin_cos()
    for interval, function in zip(found, (context.sin, context.cos), strict=True):
        low, high = true_ends(interval)
        assert low <= fraction(function(context.mpf(angle))) <= high
        assert high - low <= WIDTH[digits]


@pytest.mark.parametrize("digits", DIGITS)
@pytest.mark.parametrize("exponent", [-20, -60, -100, -200, -1000])
def test_what_taylors_series_leaves_out_is_in_the_intervals(exponent: int, digits: int) -> None:
    # For such a small angle, the first terms are exact doubles; only the omitted terms give the interval a
    # width.
    x = Fraction(2) ** exponent
    with precision(digits):
        sine, cosine = map(true_ends, exact(2.0**exponent).sin_cos())
    # Sine and cosine lie between two partial sums of their alternating series.
    assert sine[0] < x - x**3 / 6 + x**5 / 120
    assert sine[1] > x - x**3 / 6
    assert cosine[0] < 1 - x**2 / 2 + x**4 / 24
    assert cosine[1] > 1 - x**2 / 2


@pytest.mark.parametrize("word", ["0.1", "-1.5708", "3.14159265358979", "100.7", "0"])
def test_cosine_and_sine_of_a_wide_interval_hold_those_of_all_that_is_in_it(word: str) -> None:
    context = independent.clone()
    sine, cosine = map(true_ends, (arb(word) + arb(0, 0.01)).sin_cos())
    for step in range(-10, 11):
        angle = context.mpf(word) + context.mpf(step) / 1000
        assert cosine[0] <= fraction(context.cos(angle)) <= cosine[1]
        assert sine[0] <= fraction(context.sin(angle)) <= sine[1]


def nearest(M: FloatArray, digits: int) -> Matrix:
    with precision(digits):
        x, y, z = (tuple(map(exact, row)) for row in M.tolist())
        return nearest_rotation((x, y, z))


@pytest.mark.slow
@pytest.mark.parametrize("digits", [15, 50])
@given(R=rotations, off=st.integers(0, 2**32 - 1).map(np.random.default_rng))
def test_the_nearest_rotation_lies_in_its_intervals(digits: int, R: FloatArray, off: Any) -> None:
    M = R + off.uniform(-5e-10, 5e-10, (3, 3))
    found, expected = nearest(M, digits), orthogonal_factor(M)
    room = Fraction(10) ** -57  # what the 60 digits of mpmath may be off by
    for i, j in np.ndindex(3, 3):
        low, high = true_ends(found[i][j])
        assert low - room <= fraction(expected[i, j]) <= high + room
        assert high - low < Fraction(10) ** (1 - digits)


def test_what_newtons_steps_leave_is_in_the_intervals_of_the_nearest_rotation() -> None:
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


def test_a_rotation_is_its_own_nearest_without_width() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for row, right in zip(nearest(turn, 15), turn.tolist(), strict=True):
        assert [true_ends(number) for number in row] == [(number, number) for number in right]


@given(st.integers(-(2**200), 2**200), st.integers(-1400, 1100))
def test_doubles_around_an_interval_lie_outside_it_and_next_to_it(man: int, exponent: int) -> None:
    with precision(120):
        low, high = ends(arb((man, exponent)))
    true = Fraction(man) * Fraction(2) ** exponent
    assert low == -math.inf or Fraction(low) <= true
    assert high == math.inf or true <= Fraction(high)
    assert low == high or math.nextafter(low, math.inf) == high


def test_a_whole_number_has_itself_for_ends() -> None:
    assert ends(1) == (1.0, 1.0)


moderate = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


@given(moderate, moderate.filter(bool), moderate)
def test_a_decimal_is_the_true_value_rounded_to_seventeen_digits(x: float, y: float, z: float) -> None:
    true = Fraction(x) / Fraction(y) + Fraction(z)
    with precision(50):
        found = decimal(exact(x) / y + z, 1e-15)
    with localcontext(prec=17):
        expected = Decimal(true.numerator) / Decimal(true.denominator)
    if found is None:  # x / y and z cancel, but for less than thirty digits
        assert abs(true) < Fraction(1, 10**25) * abs(Fraction(z))
    elif found == "0":
        assert abs(true) < Fraction(1, 10**25)
    else:
        assert Decimal(found) == expected
        assert float(found) == float(expected)


def test_a_ball_that_is_too_large_has_no_decimal() -> None:
    with precision(50):
        assert decimal(arb(1.0, 1e-19), 1.0) is None
        assert decimal(arb(0.0, 1e-19), 1e-12) is None
        assert decimal(arb(0.0, 1e-19), 1e-3) == "0"
