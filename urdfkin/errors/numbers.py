"""Strict parsing of numbers, and of numbers with units.

`parse_float` and `parse_int` accept only finite numbers in decimal ASCII digits. Python's `float` also
accepts `1_0`, Arabic digits, `nan` and `infinity`. `parse_quantity` parses a number with an
optional unit: `30deg`, `pi/2`, `5 mm`, `-2*pi/3`, `90 deg/s`.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

#: The matching time is linear in the length of the text.
DECIMAL = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_INTEGER = re.compile(r"[+-]?[0-9]+")
#: `parse_float` and `parse_int` reject texts with more characters than this number. Python converts long
#: integers in quadratic time.
_MAX_LENGTH = 2000

#: Patterns of invalid numbers, each with the remedy for the message. If several patterns match, the first
#: pattern determines the remedy.
_REMEDIES = (
    (r"", "the text is empty: write a number"),
    (r"[+-]?(nan|inf|infinity)", "write a finite number"),
    (r".*[^\x00-\x7f].*", "write ASCII digits and signs"),
    (r"[-+]?[0-9.]+_.*", "write the digits without underscores"),
    (r"0[xXbBoO].*", "write the number in decimal digits"),
    (r".*;.*", "separate numbers by commas"),
)


def parse_float(text: str) -> float | None:
    """Parse a finite number with optional surrounding blanks, or return None for other text.

    >>> [parse_float(text) for text in (" -1.5e-3", "1_0", "nan", "\u0661", "1e999")]
    [-0.0015, None, None, None, None]
    """
    text = text.strip(" \t\r\n")
    if len(text) > _MAX_LENGTH or not DECIMAL.fullmatch(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def parse_int(text: str) -> int | None:
    """Parse an integer with optional surrounding blanks, or return None for other text.

    >>> parse_int("12"), parse_int("1_2"), parse_int("1.0"), parse_int("1e3")
    (12, None, None, None)
    """
    text = text.strip(" \t\r\n")
    return int(text) if len(text) <= _MAX_LENGTH and _INTEGER.fullmatch(text) else None


def number_remedy(text: str) -> str | None:
    text = text.strip(" \t\r\n")
    found = (words for pattern, words in _REMEDIES if re.fullmatch(pattern, text, re.IGNORECASE | re.DOTALL))
    return next(found, None)


UNIT_SHORT_NAMES = {
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("deg", "degs", "degree", "degrees"), "deg"),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), "mm"),
}
_FACTOR = r"(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|pi)"
_QUANTITY = re.compile(
    rf"(?P<sign>[+-]?)\s*(?P<factors>{_FACTOR}(?:\s*[*/]\s*{_FACTOR}|\s*pi)*)"
    r"\s*(?P<unit>[a-z]+)?\s*(?P<per>/\s*s\s*(?:\^?\s*2|/\s*s)?)?"
)
_OPERATOR_AND_FACTOR = re.compile(rf"\s*([*/]?)\s*({_FACTOR})")
_MAX_QUANTITY_LENGTH = 200


class ParsedNumber(NamedTuple):
    """A parsed number, converted to radians or metres if the text has a unit.

    Attributes:
        unit: "rad", "m", or None for a number without a unit. A multiple of pi without a unit is in radians.
        seconds_exponent: Exponent of the seconds in the denominator: 1 for rad/s, 2 for rad/s^2.
    """

    value: float
    unit: str | None
    seconds_exponent: int


def parse_quantity(text: str) -> ParsedNumber | None:
    """Parse a finite number with an optional unit, or return None for other text, such as a sum.

    >>> parse_quantity("30deg").value == math.pi / 6, parse_quantity("-pi/2").value == -math.pi / 2
    (True, True)
    >>> parse_quantity("2 rad/s^2"), parse_quantity("1-2")
    (ParsedNumber(value=2.0, unit='rad', seconds_exponent=2), None)
    """
    plain = text.strip(" \t\r\n").lower()
    plain = plain.replace("°", "deg").replace("π", "pi").replace("²", "2")
    if len(plain) > _MAX_QUANTITY_LENGTH or (found := _QUANTITY.fullmatch(plain)) is None:
        return None
    unit = UNIT_SHORT_NAMES.get(found["unit"]) if found["unit"] else None
    value = _product(found["factors"])
    if value is None or (found["unit"] and unit is None):
        return None
    if "pi" in found["factors"]:
        if unit not in (None, "rad"):
            return None
        unit = "rad"
    value = -value if found["sign"] == "-" else value
    value = radians_from_degrees(value) if unit == "deg" else value / 1000.0 if unit == "mm" else value
    per = re.sub(r"[\s^]", "", found["per"] or "")
    return ParsedNumber(
        value, {"deg": "rad", "mm": "m"}.get(unit or "", unit), 2 if len(per) > 2 else len(per) // 2
    )


def _product(factors: str) -> float | None:
    value = 1.0
    for sign, factor in _OPERATOR_AND_FACTOR.findall(factors):
        number = math.pi if factor == "pi" else float(factor)
        if sign == "/" and not number:
            return None
        value = value / number if sign == "/" else value * number
    return value if math.isfinite(value) else None


def radians_from_degrees(degrees: float) -> float:
    """Convert degrees to radians.

    For k * 15 degrees, the result is the double `k * pi / 12`.
    """
    twelfths = degrees / 15.0
    return twelfths * math.pi / 12.0 if twelfths == round(twelfths) else math.radians(degrees)
