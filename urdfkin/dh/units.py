r"""Convert a table's numbers from text and to text.

A table object stores metres and radians. Other units are used only when a table is read or written.

The text of a cell is a sum. Examples are `q1 + pi/2`, `90 deg`, `107 mm`, `-θ₂*`, `\frac{\pi}{2}` and `180°`.
A term is a number, a multiple of pi, or a multiple of a joint variable. A number or a multiple of pi can have
a unit. A cell may contain at most one term with a variable.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from numbers import Real
from typing import cast

from urdfkin.errors import InputError
from urdfkin.errors.numbers import UNIT_SHORT_NAMES, radians_from_degrees
from urdfkin.errors.validators import as_int, safe_repr


class AngleUnit(StrEnum):
    RADIANS = "radians"
    DEGREES = "degrees"


class LengthUnit(StrEnum):
    METRES = "metres"
    MILLIMETRES = "millimetres"


#: A row that is a list has its cells in this order. Craig's book uses the order alpha, a, d, theta. The
#: Robotics Toolbox uses theta, d, a, alpha.
COLUMNS = ("a", "alpha", "d", "theta")
_UNIT_NAMES = {"rad": "radians", "deg": "degrees", "m": "metres", "mm": "millimetres"}
_MAX_CELL_LENGTH = 200
#: This number of digits distinguishes all doubles.
_MAX_DIGITS = 17


@dataclass(frozen=True, slots=True)
class Units:
    """Format of printed numbers.

    In radians, exact multiples of pi/12 become fractions of pi.

    Attributes:
        digits: Significant digits, from 1 to 17.
        columns: Order of the printed columns.
    """

    angles: AngleUnit = AngleUnit.RADIANS
    lengths: LengthUnit = LengthUnit.METRES
    digits: int = 10
    columns: tuple[str, ...] = COLUMNS

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "angles", AngleUnit(self.angles))
            object.__setattr__(self, "lengths", LengthUnit(self.lengths))
        except (ValueError, TypeError):
            raise InputError(
                "unknown unit",
                where="angles or lengths",
                found=f"{safe_repr(self.angles)}, {safe_repr(self.lengths)}",
                remedy="write `radians` or `degrees` for angles, `metres` or `millimetres` for lengths",
            ) from None
        object.__setattr__(self, "digits", as_int(self.digits, "digits", 1, _MAX_DIGITS))
        if not isinstance(self.columns, tuple | list) or sorted(map(str, self.columns)) != sorted(COLUMNS):
            raise InputError(
                f"columns must be {', '.join(COLUMNS)} in any order", found=safe_repr(self.columns)
            )

    @property
    def uses_millimetres(self) -> bool:
        return self.lengths is LengthUnit.MILLIMETRES

    @property
    def angle_name(self) -> str:
        return "rad" if self.angles is AngleUnit.RADIANS else "deg"

    @property
    def length_name(self) -> str:
        return "m" if self.lengths is LengthUnit.METRES else "mm"

    def format_angle(self, radians: float, pi: str = "pi") -> str:
        fraction = pi_fraction(radians)
        if self.angles is AngleUnit.DEGREES:
            return str(fraction * 180) if fraction is not None else self._format_number(math.degrees(radians))
        if fraction is None:
            return self._format_number(radians)
        return format_pi_fraction(fraction, pi)

    def format_length(self, metres: float) -> str:
        """Format a length.

        >>> Units(lengths=LengthUnit.MILLIMETRES).format_length(0.0825)
        '82.5'
        """
        return self._format_number(metres if self.lengths is LengthUnit.METRES else metres * 1000.0)

    def round_angle(self, radians: float) -> float:
        """Return the printed value in radians."""
        text = self.format_angle(radians)
        number = parse_number(text, "printed")
        return number if "pi" in text else convert_to_si("theta", number, self)

    def round_length(self, metres: float) -> float:
        """Return the printed value in metres."""
        return convert_to_si("d", parse_number(self.format_length(metres), "printed"), self)

    def _format_number(self, value: float) -> str:
        return f"{value:.{self.digits}g}" if value else "0"


def parse_units(angles: str = "radians", lengths: str = "metres", digits: int = 10) -> Units:
    """Return units from their names."""
    angle, length = (
        _UNIT_NAMES.get(name, name) if isinstance(name, str) else name for name in (angles, lengths)
    )
    return Units(cast("AngleUnit", angle), cast("LengthUnit", length), digits)


def pi_fraction(radians: float) -> Fraction | None:
    """Return an angle as a fraction of pi, or None if it is not exactly a multiple of pi/12."""
    if math.isinf(radians * 12.0):
        return None
    twelfths = round(radians * 12.0 / math.pi)
    return Fraction(twelfths, 12) if twelfths * math.pi / 12.0 == radians else None


def format_pi_fraction(fraction: Fraction, pi: str = "pi") -> str:
    """Format a multiple of pi, for example as pi, -pi/2 or 5pi/12."""
    if fraction == 0:
        return "0"
    count = {1: "", -1: "-"}.get(fraction.numerator, str(fraction.numerator))
    return f"{count}{pi}" + (f"/{fraction.denominator}" if fraction.denominator != 1 else "")


def parse_number(value: object, where: str) -> float:
    """Parse a number or a text such as pi/2."""
    try:
        number = _parse_number(value)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise InputError(
            "this is not a number", where=where, found=safe_repr(value), remedy="write 1.5708 or pi/2"
        ) from None
    if not math.isfinite(number):
        raise InputError("not a finite number", where=where, found=safe_repr(value))
    return number


def _parse_number(value: object) -> float:
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise TypeError(value)
    cell = parse_cell(value)
    if cell.variable_factor is not None or cell.unit not in (None, "rad"):
        raise ValueError(value)
    return cell.number


def convert_to_si(name: str, number: float, units: Units) -> float:
    """Convert a number of the column `name` to metres or radians.

    90 degrees become exactly math.pi / 2.
    """
    if name in ("a", "d"):
        return number / 1000.0 if units.uses_millimetres else number
    return number if units.angles is AngleUnit.RADIANS else radians_from_degrees(number)


_PLAIN_TEXT = str.maketrans(
    {
        **dict.fromkeys("\u2212\u2013\u2010\u2011\ufe63", "-"),
        **dict.fromkeys("π\U0001d70b\U0001d6d1", " pi "),
        **dict.fromkeys("°º˚", " deg "),
        **dict.fromkeys("θϑ\U0001d703", "theta"),
        **dict.fromkeys("α⍺\U0001d6fc", "alpha"),
        **dict.fromkeys("β\U0001d6fd", "beta"),
        **dict.fromkeys("·⋅×∙", "*"),
        **dict.fromkeys("\u00a0\u2009\u202f\u2007", " "),
        **dict(zip("₀₁₂₃₄₅₆₇₈₉₋₊ᵢⱼₙ", "0123456789-+ijn", strict=True)),
        "\u200b": "",
        "ℓ": "l",
    }
)
_LATEX_TO_PLAIN = (
    (r"\\[dt]?frac\{([^{}]*)\}\{([^{}]*)\}", r"\1/\2"),
    (r"\^\{?\\circ\}?|\\degree|\\textdegree|\\circ", " deg "),
    (r"\\(?:mathrm|text|mathit|rm|mathbf|operatorname|textbf|textit|texttt|emph)\s*\{([^{}]*)\}", r"\1"),
    (r"(?:\\cdot|\\times|\*)\s*10\^\{?([+-]?[0-9]+)\}?", r"e\1"),
    (r"\\(?:[,;:! ]|quad|qquad|left|right)|~", " "),
    (r"\\(?:cdot|times)", "*"),
    (r"\\(?:var)?(pi|theta|alpha|beta)(?![a-z])", r" \1"),
    (r"\\_", "_"),
    (r"\^\{?\*\}?", "*"),
    (r"\$|\\\(|\\\)", ""),
)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<variable>(?:q|theta|th|d)_?\{?[0-9]+\}?\*?|(?:q|theta|var|variable)(?:_?\{?[ij]\}?)?\*?)"
    r"|(?P<name>[A-Za-z]+)|(?P<sign>[-+*/]))"
)


class InvalidCellError(ValueError):
    """Invalid text of a cell."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The parsed text of a cell, for example of "-q2 + 90 deg".

    Attributes:
        number: The constant, in `unit`.
        unit: "rad" (also with pi), "deg", "m" or "mm". None means the table's unit.
        variable_factor: Factor of the variable, or None if the cell has no variable.
        variable: Number in the variable's name, for example 2 for q2.
        text: Text of a constant that is a single number, such as "90". For other constants, the text is
            empty.
    """

    number: float
    unit: str | None = None
    variable_factor: float | None = None
    variable: int | None = None
    text: str = ""

    @property
    def constant(self) -> str:
        return f"{self.number!r} {self.unit or ''}"


def to_plain_text(text: str) -> str:
    r"""Convert symbols and LaTeX to plain letters.

    >>> to_plain_text("−π/2"), to_plain_text(r"$\frac{\pi}{2} + \theta_{1}$").split(), to_plain_text("θ₁*")
    ('- pi /2', ['pi/2', '+', 'theta_{1}'], 'theta1*')
    """
    for pattern, plain in _LATEX_TO_PLAIN:
        text = re.sub(pattern, plain, text)
    return text.translate(_PLAIN_TEXT).strip()


def parse_cell(original: str) -> Cell:
    """Parse the text of a cell.

    >>> parse_cell("-q2 + 90°")
    Cell(number=90.0, unit='deg', variable_factor=-1.0, variable=2, text='90')
    """
    if len(original) > _MAX_CELL_LENGTH:
        raise InvalidCellError(f"a cell of {len(original)} characters")
    text = to_plain_text(original)
    text = "var" if text == "*" else text
    terms = _parse_terms(text[1:-1] if text.startswith("(") and text.endswith(")") else text)
    variables = [term for term in terms if term.variable]
    numbers = [term for term in terms if not term.variable]
    if len(variables) > 1:
        raise InvalidCellError("two variables in one cell")
    units = {UNIT_SHORT_NAMES[unit] for term in terms for unit in term.units}
    units |= {"rad" for term in terms if term.has_pi}
    if len(units) > 1:
        raise InvalidCellError(f"{' and '.join(sorted(units))} in one cell")
    number = numbers[0].value if numbers else 0.0
    number = sum((term.value for term in numbers[1:]), number)
    if not math.isfinite(number):
        raise InvalidCellError("not a finite number")
    digits = re.sub(r"[^0-9]", "", variables[0].variable) if variables else ""
    return Cell(
        number,
        unit=min(units, default=None),
        variable_factor=variables[0].value if variables else None,
        variable=int(digits) if digits else None,
        text=numbers[0].text if len(numbers) == 1 else "",
    )


@dataclass(slots=True)
class _Term:
    """A term of a cell's sum."""

    sign: float = 1.0
    size: float | None = None
    variable: str = ""
    units: tuple[str, ...] = ()
    has_pi: bool = False
    text: str = ""
    operator: str = ""  # A "*" or "/" that has no second operand yet.

    @property
    def value(self) -> float:
        return self.sign * (1.0 if self.size is None else self.size)

    @property
    def is_empty(self) -> bool:
        return self.size is None and not self.variable

    def append(self, token: str, kind: str) -> None:
        if kind == "sign" and not self.is_empty and not self.operator:
            self.operator = token
            return
        if kind == "variable" and not self.variable and self.operator != "/":
            self.variable = token
        elif kind == "number" and (self.size is None or self.operator):
            self.text = "" if self.text or self.has_pi else token
            self._multiply(float(token))
        elif token == "pi":
            self.has_pi, self.text = True, ""
            self._multiply(math.pi)
        elif token in UNIT_SHORT_NAMES and not self.is_empty and not self.operator:
            self.units = (*self.units, token)
        else:
            raise InvalidCellError(f"{token!r} is not understood")
        self.operator = ""

    def _multiply(self, number: float) -> None:
        size = 1.0 if self.size is None else self.size
        if self.operator == "/" and not number:
            raise InvalidCellError("a division by zero")
        self.size = size / number if self.operator == "/" else size * number


def _parse_terms(text: str) -> list[_Term]:
    terms, after_sign, position = [_Term()], False, 0
    while position < len(text):
        if (found := _TOKEN.match(text, position)) is None:
            raise InvalidCellError(f"{text[position:]!r} is not understood")
        position, token, kind = found.end(), found[0].strip(), found.lastgroup or ""
        if token in ("+", "-"):
            if after_sign or terms[-1].operator:
                raise InvalidCellError(f"two signs before {text[position:]!r}")
            if not terms[-1].is_empty:
                terms.append(_Term())
            after_sign, terms[-1].sign = True, -1.0 if token == "-" else 1.0
        else:
            terms[-1].append(token, kind)
            after_sign = False
    if after_sign or terms[-1].operator or terms[-1].is_empty:
        raise InvalidCellError("the expression ends too early" if text else "the expression is empty")
    return terms
