"""How exactly a table's file says its numbers: half a unit of the last digit, read from the literal text.

A sheet that gives 311.1 mm has nothing to say about 0.05 mm. What is written without a decimal point is taken
as exact (a right angle of 90 degrees, a zero), except for whole millimetres, which are rounded lengths; so
are multiples of pi.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal, InvalidOperation
from typing import Any

from urdfkin.dh.expression import cell_of
from urdfkin.dh.units import Units, cell_in_si, units_of
from urdfkin.dh.written_row import ORDER, units_in


class Literal(float):
    """A number that remembers how it was written: what a parser makes of a decimal."""

    text: str

    def __new__(cls, text: str) -> Literal:
        """The number that the text is."""
        number = super().__new__(cls, text)
        number.text = text
        return number


def last_digits(data: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
    """Of each row of a table's plain data: half a unit of each cell's last digit, metres and radians.

    Args:
        data: As `urdfkin.dh.read.mapping_from_text` reads it; a table can be made of it.
    """
    units = units_of(data.get("angles", "radians"), data.get("lengths", "metres"))
    return tuple(_of_row(row, units) for row in data["rows"])


def _of_row(row: Mapping[str, Any] | Sequence[Any], units: Units) -> dict[str, float]:
    cells = row if isinstance(row, Mapping) else dict(zip(ORDER, row, strict=False))
    found = {}
    for name in (*ORDER, "beta"):
        if name in cells:
            value, said = cells[name], units
            if isinstance(value, str):
                said = units_in(cell_of(value), units)
            half = half_a_digit(value, name in "ad" and said.counts_millimetres)
            found[name] = cell_in_si(name, half, said)
    return found


def half_a_digit(value: object, whole_is_rounded: bool = False) -> float:
    """Half a unit of the last digit of a number as it is written, in the number's own unit; 0 if exact.

    Example:
        >>> half_a_digit(Literal("0.3111")), half_a_digit("90"), half_a_digit(425, True), half_a_digit("pi")
        (5e-05, 0.0, 0.5, 0.0)
    """
    text = value.text if isinstance(value, Literal) else str(value)
    text = (cell_of(value).text or "0") if isinstance(value, str) else text
    try:
        number = Decimal(text)
    except InvalidOperation:
        return 0.0
    exponent = number.as_tuple().exponent
    if not number or not isinstance(exponent, int) or (exponent >= 0 and not whole_is_rounded):
        return 0.0
    return 0.5 * 10.0 ** min(exponent, 0)
