"""Numbers are written as a person writes them, and read back the same."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdfkin.dh.units import Angles, Lengths, Units, fraction_text, pi_fraction, read_number, units_of
from urdfkin.errors import InputError


@pytest.mark.parametrize("twelfths", range(-24, 25))
def test_a_multiple_of_fifteen_degrees_is_a_fraction_of_pi_and_reads_back_to_the_bit(twelfths: int) -> None:
    radians = twelfths * math.pi / 12.0
    text = Units().angle(radians)
    assert "pi" in text or text == "0"
    assert abs(read_number(text, "x") - radians) <= 4e-16 * abs(radians)
    assert Units(Angles.DEGREES).angle(radians) == str(15 * twelfths)


def test_a_rounded_right_angle_is_not_called_one() -> None:
    assert pi_fraction(1.5707963) is None
    assert Units().angle(1.5708) == "1.5708"
    assert Units(Angles.DEGREES, digits=9).angle(1.5708) == "90.0002105"


@given(st.floats(-10, 10))
def test_any_number_reads_back(value: float) -> None:
    assert read_number(repr(value), "x") == value
    assert read_number(value, "x") == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi", math.pi),
        ("-pi/2", -math.pi / 2),
        ("3*pi/4", 3 * math.pi / 4),
        (" 2 pi / 3 ", 2 * math.pi / 3),
        ("1e-3", 1e-3),
    ],
)
def test_multiples_of_pi_are_read(text: str, value: float) -> None:
    assert read_number(text, "x") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("value", ["p", "pi/", "", "1,5", None, True, [1]])
def test_what_is_no_number_is_refused_with_its_place(value: object) -> None:
    with pytest.raises(InputError, match=r"row 2, alpha: this is not a number"):
        read_number(value, "row 2, alpha")


def test_units_are_named() -> None:
    assert units_of("degrees", "millimetres") == Units(Angles.DEGREES, Lengths.MILLIMETRES)
    with pytest.raises(InputError, match="`radians` or `degrees`"):
        units_of("grad")
    assert fraction_text(pi_fraction(-math.pi / 12) or pytest.fail("no fraction")) == "-pi/12"
