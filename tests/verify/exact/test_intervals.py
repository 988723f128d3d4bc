"""What is computed on intervals holds the true value, whole numbers being the witness."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.high_precision import mp as independent
from tests.strategies import rotations
from urdfkin.model.tree import FloatArray
from urdfkin.verify.exact.intervals import ends, intervals, of_digits
from urdfkin.verify.exact.numbers import Matrix

BITS = (53, 169)
finite = st.floats(allow_nan=False, allow_infinity=False)


def true_ends(x: Any) -> tuple[Fraction, Fraction]:
    """The ends of an interval, without rounding."""
    low, high = (
        Fraction(-int(man) if sign else int(man)) * Fraction(2) ** int(exp) for sign, man, exp, _ in x._mpi_
    )
    return low, high


def fraction(x: Any) -> Fraction:
    """A number of mpmath's, without rounding."""
    sign, man, exp, _ = x._mpf_
    return Fraction(-int(man) if sign else int(man)) * Fraction(2) ** int(exp)


WORDS = ("0.1", "-.5", "3.", "+2e3", "1E-7", "0", "-0.0", "1.5707963267948966", "1e22", "123456789" * 9)
FAR = ("1e300", "-1.7976931348623157e308", "5e-324", "1e-400", "2.5e-1000", "3.1e777", "-9.9e-5001")


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("word", [*WORDS, *FAR])
def test_a_decimal_lies_in_its_interval_however_large_its_exponent(word: str, bits: int) -> None:
    low, high = true_ends(intervals(bits).mpf(word))
    assert low <= Fraction(word) <= high
    assert high - low <= abs(Fraction(word)) / 2 ** (bits - 3)


@given(finite)
def test_a_double_is_an_interval_of_itself(x: float) -> None:
    assert true_ends(intervals(53).mpf(x)) == (Fraction(x), Fraction(x))


@pytest.mark.parametrize("bits", BITS)
@given(x=st.floats(1e-300, 1e300))
def test_the_squares_of_a_roots_ends_lie_on_either_side(bits: int, x: float) -> None:
    low, high = true_ends(intervals(bits).sqrt(intervals(bits).mpf(x)))
    assert low**2 <= Fraction(x) <= high**2
    assert high - low <= high / 2 ** (bits - 3)


def test_the_root_of_a_square_is_exact() -> None:
    assert true_ends(intervals(53).sqrt(intervals(53).mpf(25.0))) == (Fraction(5), Fraction(5))


@pytest.mark.slow
@pytest.mark.parametrize("bits", BITS)
@given(angle=st.one_of(finite, st.floats(-7.0, 7.0), st.integers(-9, 9).map(lambda k: k * math.pi / 2)))
def test_cosine_and_sine_of_every_double_lie_in_their_intervals(bits: int, angle: float) -> None:
    context = independent.clone()
    context.prec = 1100 + 2 * bits  # what reducing 1e308 rad takes
    found = intervals(bits).cos_sin(intervals(bits).mpf(angle))
    for interval, function in zip(found, (context.cos, context.sin), strict=True):
        low, high = true_ends(interval)
        assert low <= fraction(function(context.mpf(angle))) <= high
        assert high - low <= Fraction(2) ** (3 - bits)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("exponent", [-20, -60, -100, -200, -1000])
def test_what_taylors_series_leaves_out_is_in_the_intervals(exponent: int, bits: int) -> None:
    # Of so small an angle, a double, the sums are exact: without the remainder they have no width.
    x = Fraction(2) ** exponent
    cosine, sine = map(true_ends, intervals(bits).cos_sin(intervals(bits).mpf(2.0**exponent)))
    # Both lie between two sums of their alternating series.
    assert sine[0] < x - x**3 / 6 + x**5 / 120
    assert sine[1] > x - x**3 / 6
    assert cosine[0] < 1 - x**2 / 2 + x**4 / 24
    assert cosine[1] > 1 - x**2 / 2


@pytest.mark.parametrize("word", ["0.1", "-1.5708", "3.14159265358979", "100.7", "0"])
def test_cosine_and_sine_of_a_wide_interval_hold_those_of_all_that_is_in_it(word: str) -> None:
    coarse, context = intervals(53), independent.clone()
    x = coarse.mpf(word) + coarse.around(coarse.mpf("0.01"))
    cosine, sine = map(true_ends, coarse.cos_sin(x))
    for step in range(-10, 11):
        angle = context.mpf(word) + context.mpf(step) / 1000
        assert cosine[0] <= fraction(context.cos(angle)) <= cosine[1]
        assert sine[0] <= fraction(context.sin(angle)) <= sine[1]


def orthogonal_factor(M: FloatArray) -> Any:
    """U of M = U H by Higham's iteration, (X + X^-T) / 2, at 60 digits."""
    X = independent.matrix(M.tolist())
    for _ in range(12):
        X = (X + (X**-1).T) / 2
    return X


@pytest.mark.slow
@pytest.mark.parametrize("digits", [15, 50])
@given(R=rotations, off=st.integers(0, 2**32 - 1).map(np.random.default_rng))
def test_the_nearest_rotation_lies_in_its_intervals(digits: int, R: FloatArray, off: Any) -> None:
    M = R + off.uniform(-5e-10, 5e-10, (3, 3))
    context = of_digits(digits)
    x, y, z = (tuple(context.mpf(number) for number in row) for row in M.tolist())
    found: Matrix = context.nearest_rotation((x, y, z))
    expected = orthogonal_factor(M)
    room = Fraction(10) ** -57  # what the 60 digits of the witness may be off by
    for i in range(3):
        for j in range(3):
            low, high = true_ends(found[i][j])
            assert low - room <= fraction(expected[i, j]) <= high + room
            assert high - low < Fraction(10) ** (1 - digits)


def test_a_rotation_is_its_own_nearest_without_width() -> None:
    context = of_digits(15)
    turn = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    x, y, z = (tuple(context.mpf(number) for number in row) for row in turn)
    found = context.nearest_rotation((x, y, z))
    assert [[true_ends(number) for number in row] for row in found] == [
        [(Fraction(number), Fraction(number)) for number in row] for row in turn
    ]


numerators = st.integers(-(2**200), 2**200)


@given(numerators, st.integers(-1400, 1100))
def test_doubles_around_an_interval_lie_outside_it_and_next_to_it(man: int, exponent: int) -> None:
    context = intervals(400)
    x = context.mpf(1) * man * context.mpf(2) ** exponent
    (low, high), true = ends(x), Fraction(man) * Fraction(2) ** exponent
    assert low == -math.inf or Fraction(low) <= true
    assert high == math.inf or true <= Fraction(high)
    assert low == high or math.nextafter(low, math.inf) == high


def test_a_whole_number_has_itself_for_ends() -> None:
    assert ends(1) == (1.0, 1.0)
