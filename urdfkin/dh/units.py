"""Convert a table's numbers from and to text: fractions of pi, degrees, millimetres.

A table itself is always in metres and radians. Other units exist only in its input and output.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from numbers import Real

from urdfkin.dh.expression import cell_of
from urdfkin.errors import InputError
from urdfkin.errors.numbers import in_radians
from urdfkin.errors.validators import safe_repr


class Angles(StrEnum):
    """Unit of angles in text."""

    RADIANS = "radians"
    DEGREES = "degrees"


class Lengths(StrEnum):
    """Unit of lengths in text."""

    METRES = "metres"
    MILLIMETRES = "millimetres"


#: Default order of the four columns. Craig's order is alpha, a, d, theta; the Robotics Toolbox's is theta, d,
#: a, alpha.
COLUMNS = ("a", "alpha", "d", "theta")


@dataclass(frozen=True, slots=True)
class Units:
    """Format of a table's numbers; radians and metres by default.

    Attributes:
        angles: Radians (exact multiples of pi/12 as fractions of pi) or degrees.
        lengths: Metres or millimetres.
        digits: Significant digits.
        columns: Order of the columns in printed tables.
    """

    angles: Angles = Angles.RADIANS
    lengths: Lengths = Lengths.METRES
    digits: int = 10
    columns: tuple[str, ...] = COLUMNS

    @property
    def counts_millimetres(self) -> bool:
        """Whether lengths are millimetres."""
        return self.lengths is Lengths.MILLIMETRES

    @property
    def angle_name(self) -> str:
        """Unit in a column's heading."""
        return "rad" if self.angles is Angles.RADIANS else "deg"

    @property
    def length_name(self) -> str:
        """Unit in a column's heading."""
        return "m" if self.lengths is Lengths.METRES else "mm"

    def angle(self, radians: float, pi: str = "pi") -> str:
        """Format an angle.

        Args:
            radians: The angle.
            pi: Text for pi.

        Example:
            >>> Units().angle(-math.pi / 2), Units(Angles.DEGREES).angle(math.pi / 12)
            ('-pi/2', '15')
        """
        fraction = pi_fraction(radians)
        if self.angles is Angles.DEGREES:
            return str(fraction * 180) if fraction is not None else self._number(math.degrees(radians))
        if fraction is None:
            return self._number(radians)
        return fraction_text(fraction, pi)

    def length(self, metres: float) -> str:
        """Format a length.

        Example:
            >>> Units(lengths=Lengths.MILLIMETRES).length(0.0825)
            '82.5'
        """
        return self._number(metres if self.lengths is Lengths.METRES else metres * 1000.0)

    def _number(self, value: float) -> str:
        return f"{value:.{self.digits}g}" if value else "0"


_SHORT = {"rad": "radians", "deg": "degrees", "m": "metres", "mm": "millimetres"}


def units_of(angles: str = "radians", lengths: str = "metres", digits: int = 10) -> Units:
    """Return units by name (also rad, deg, m and mm); raise InputError for an unknown name."""
    try:
        angles, lengths = (_SHORT.get(name, name) for name in (angles, lengths))
        return Units(Angles(angles), Lengths(lengths), digits)
    except (ValueError, TypeError):
        raise InputError(
            "unknown unit",
            where="angles or lengths",
            found=f"{angles!r}, {lengths!r}",
            remedy="write radians or degrees, metres or millimetres",
        ) from None


def pi_fraction(radians: float) -> Fraction | None:
    """Return an angle as a fraction of pi if it is exactly a multiple of pi/12; else None.

    Example:
        >>> pi_fraction(math.pi / 2), pi_fraction(1.5708)
        (Fraction(1, 2), None)
    """
    twelfths = round(radians * 12.0 / math.pi)
    return Fraction(twelfths, 12) if twelfths * math.pi / 12.0 == radians else None


def fraction_text(fraction: Fraction, pi: str = "pi") -> str:
    """Format a multiple of pi: 0, pi, -pi/2, 5pi/12."""
    if fraction == 0:
        return "0"
    count = {1: "", -1: "-"}.get(fraction.numerator, str(fraction.numerator))
    return f"{count}{pi}" + (f"/{fraction.denominator}" if fraction.denominator != 1 else "")


def read_number(value: object, where: str) -> float:
    """Parse a number, a number in text, or a multiple of pi such as "-pi/2" or "3*pi/4".

    Raises:
        InputError: anything else; the message names `where`.

    Example:
        >>> read_number("-pi/2", "alpha") == -math.pi / 2
        True
    """
    try:
        number = _number(value)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise InputError(
            "not a number", where=where, found=safe_repr(value), remedy="write 1.5708 or pi/2"
        ) from None
    if not math.isfinite(number):
        raise InputError("not a finite number", where=where, found=safe_repr(value))
    return number


def _number(value: object) -> float:
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise TypeError(value)
    cell = cell_of(value)
    if cell.times is not None or cell.unit not in (None, "rad"):
        raise ValueError(value)
    return cell.number


def cell_in_si(name: str, number: float, units: Units) -> float:
    """Convert the cell `name` to metres or radians; 90 degrees become exactly math.pi / 2."""
    if name in ("a", "d"):
        return number / 1000.0 if units.counts_millimetres else number
    return number if units.angles is Angles.RADIANS else in_radians(number)
