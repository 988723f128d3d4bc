"""A number with its unit as people write it: `30deg`, `pi/2`, `5 mm`, `-2*pi/3`, `90 deg/s`."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

#: Units by the names that people give them -> the short one.
UNITS = {
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("deg", "degs", "degree", "degrees"), "deg"),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), "mm"),
}
_FACTOR = r"(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|pi)"
_WRITTEN = re.compile(
    rf"(?P<sign>[+-]?)\s*(?P<factors>{_FACTOR}(?:\s*[*/]\s*{_FACTOR}|\s*pi)*)"
    r"\s*(?P<unit>[a-z]+)?\s*(?P<per>/\s*s\s*(?:\^?\s*2|/\s*s)?)?"
)
_STEP = re.compile(rf"\s*([*/]?)\s*({_FACTOR})")
_LONGEST = 200


class Measured(NamedTuple):
    """What a text says.

    Attributes:
        value: In radians or metres where it says a unit, else as it stands.
        unit: "rad" or "m"; None where it says none. A multiple of pi without a unit is in radians.
        per: How often it is divided by a second: 1 for a rate, 2 for a rate's rate.
    """

    value: float
    unit: str | None
    per: int


def measured(text: str) -> Measured | None:
    """The finite number that a text is, with its unit; None where it is none, or a sum.

    >>> measured("30deg").value == math.pi / 6, measured("-pi/2").value == -math.pi / 2
    (True, True)
    >>> measured("5 mm"), measured("2 rad/s^2"), measured("0.3"), measured("1-2"), measured("1_0")
    (Measured(value=0.005, unit='m', per=0), Measured(value=2.0, unit='rad', per=2), \
Measured(value=0.3, unit=None, per=0), None, None)
    """
    plain = text.strip(" \t\r\n").lower()
    plain = plain.replace("°", "deg").replace("π", "pi").replace("²", "2")
    if len(plain) > _LONGEST or (found := _WRITTEN.fullmatch(plain)) is None:
        return None
    unit = UNITS.get(found["unit"]) if found["unit"] else None
    value = _product(found["factors"])
    if value is None or (found["unit"] and unit is None):
        return None
    if "pi" in found["factors"]:
        if unit not in (None, "rad"):
            return None
        unit = "rad"
    value = -value if found["sign"] == "-" else value
    value = in_radians(value) if unit == "deg" else value / 1000.0 if unit == "mm" else value
    per = re.sub(r"[\s^]", "", found["per"] or "")
    return Measured(
        value, {"deg": "rad", "mm": "m"}.get(unit or "", unit), 2 if len(per) > 2 else len(per) // 2
    )


def _product(factors: str) -> float | None:
    value = 1.0
    for sign, factor in _STEP.findall(factors):
        number = math.pi if factor == "pi" else float(factor)
        if sign == "/" and not number:
            return None
        value = value / number if sign == "/" else value * number
    return value if math.isfinite(value) else None


def in_radians(degrees: float) -> float:
    """Radians; multiples of 15 degrees are those of pi/12 to the bit.

    >>> in_radians(90.0) == math.pi / 2
    True
    """
    twelfths = degrees / 15.0
    return twelfths * math.pi / 12.0 if twelfths == round(twelfths) else math.radians(degrees)
