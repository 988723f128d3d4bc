r"""Convert a table's numbers from text and to text, with fractions of pi, degrees or millimetres.

A table itself is always in metres and radians. Other units are used only when a table is read or written.

A cell is parsed from text such as `q1 + pi/2`, `90 deg`, `107 mm`, `-θ₂*`, `\frac{\pi}{2}` or `180°`. The
text of a cell is a sum. Each term of the sum is a number, a multiple of pi, or the joint's variable, which
may occur only once. A number and a multiple of pi may have a unit. This module rejects invalid cells.
`urdfkin.dh.rows` supplies a missing unit, and decides which cells may have a variable.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from numbers import Real

from urdfkin.errors import InputError
from urdfkin.errors.numbers import UNITS, in_radians
from urdfkin.errors.validators import safe_repr


class Angles(StrEnum):
    RADIANS = "radians"
    DEGREES = "degrees"


class Lengths(StrEnum):
    METRES = "metres"
    MILLIMETRES = "millimetres"


#: Default order of the four columns.
#: Craig's order is alpha, a, d, theta; that of the Robotics Toolbox is theta, d, a, alpha.
COLUMNS = ("a", "alpha", "d", "theta")


@dataclass(frozen=True, slots=True)
class Units:
    """Format of the numbers in a printed table, with `digits` significant digits.

    Exact multiples of pi/12 in radians are written as fractions of pi.
    """

    angles: Angles = Angles.RADIANS
    lengths: Lengths = Lengths.METRES
    digits: int = 10
    columns: tuple[str, ...] = COLUMNS

    @property
    def counts_millimetres(self) -> bool:
        return self.lengths is Lengths.MILLIMETRES

    @property
    def angle_name(self) -> str:
        return "rad" if self.angles is Angles.RADIANS else "deg"

    @property
    def length_name(self) -> str:
        return "m" if self.lengths is Lengths.METRES else "mm"

    def angle(self, radians: float, pi: str = "pi") -> str:
        """Format an angle; `pi` is the text for pi.

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

        >>> Units(lengths=Lengths.MILLIMETRES).length(0.0825)
        '82.5'
        """
        return self._number(metres if self.lengths is Lengths.METRES else metres * 1000.0)

    def _number(self, value: float) -> str:
        return f"{value:.{self.digits}g}" if value else "0"


_SHORT = {"rad": "radians", "deg": "degrees", "m": "metres", "mm": "millimetres"}


def units_of(angles: str = "radians", lengths: str = "metres", digits: int = 10) -> Units:
    """Return units from their names (also rad, deg, m and mm); raise InputError for an unknown name."""
    try:
        angles, lengths = (_SHORT.get(name, name) for name in (angles, lengths))
        return Units(Angles(angles), Lengths(lengths), digits)
    except (ValueError, TypeError):
        raise InputError(
            "unknown unit",
            where="angles or lengths",
            found=f"{angles!r}, {lengths!r}",
            remedy="write `radians` or `degrees` for angles, `metres` or `millimetres` for lengths",
        ) from None


def pi_fraction(radians: float) -> Fraction | None:
    """Return an angle as a multiple of pi if it is exactly a multiple of pi/12; None for any other angle.

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
    """Parse a number, a number in text, or a multiple of pi such as "-pi/2"; raise InputError with `where`.

    >>> read_number("-pi/2", "alpha") == -math.pi / 2
    True
    """
    try:
        number = _number(value)
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise InputError(
            "this is not a number", where=where, found=safe_repr(value), remedy="write 1.5708 or pi/2"
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


#: These characters occur in web pages, PDFs and LaTeX; each has an equivalent plain text.
_SAME = str.maketrans(
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
_LATEX = (
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
_LONGEST = 200


class NoCellError(ValueError):
    """Error for a text that is not a valid cell; the message names the invalid part."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The content of a cell.

    Attributes:
        number: The constant part, in `unit`; in the table's unit if `unit` is None.
        unit: "rad" (also for a multiple of pi), "deg", "m" or "mm"; None without a unit.
        times: Factor of the joint's variable; None if the cell has no variable.
        variable: Number in the variable's name, for example 3 for q3. None if the name has no number.
        text: Text of the constant if it is a single number; "" if it is computed from several numbers.
    """

    number: float
    unit: str | None = None
    times: float | None = None
    variable: int | None = None
    text: str = ""


def spelled(text: str) -> str:
    r"""Convert a text with symbols or LaTeX to plain letters.

    >>> spelled("−π/2"), spelled(r"$\frac{\pi}{2} + \theta_{1}$").split(), spelled("θ₁*")
    ('- pi /2', ['pi/2', '+', 'theta_{1}'], 'theta1*')
    """
    for pattern, plain in _LATEX:
        text = re.sub(pattern, plain, text)
    return text.translate(_SAME).strip()


def cell_of(written: str) -> Cell:
    """Parse a cell; raise NoCellError for an invalid cell.

    >>> cell_of("-q2 + 90°")
    Cell(number=90.0, unit='deg', times=-1.0, variable=2, text='90')
    """
    if len(written) > _LONGEST:
        raise NoCellError(f"a cell of {len(written)} characters")
    text = spelled(written)
    text = "var" if text == "*" else text
    terms = _terms(text[1:-1] if text.startswith("(") and text.endswith(")") else text)
    own = [term for term in terms if term.variable]
    numbers = [term for term in terms if not term.variable]
    if len(own) > 1:
        raise NoCellError("two variables in one cell")
    units = {UNITS[unit] for term in terms for unit in term.units} | {"rad" for one in terms if one.turns}
    if len(units) > 1:
        raise NoCellError(f"{' and '.join(sorted(units))} in one cell")
    number = numbers[0].value if numbers else 0.0
    number = sum((term.value for term in numbers[1:]), number)
    if not math.isfinite(number):
        raise NoCellError("not a finite number")
    digits = re.sub(r"[^0-9]", "", own[0].variable) if own else ""
    return Cell(
        number,
        min(units, default=None),
        own[0].value if own else None,
        int(digits) if digits else None,
        numbers[0].text if len(numbers) == 1 else "",
    )


@dataclass(slots=True)
class _Term:
    """A term of a sum in a cell: the text between two signs."""

    sign: float = 1.0
    size: float | None = None
    variable: str = ""
    units: tuple[str, ...] = ()
    turns: bool = False
    text: str = ""
    operator: str = ""

    @property
    def value(self) -> float:
        return self.sign * (1.0 if self.size is None else self.size)

    @property
    def is_empty(self) -> bool:
        return self.size is None and not self.variable

    def take(self, token: str, kind: str) -> None:
        """Add a token to the term; raise NoCellError if the token cannot follow the tokens before it."""
        divides, joined = self.operator == "/", self.operator == ""
        if kind == "sign" and not self.is_empty and joined:
            self.operator = token
            return
        if kind == "variable" and not self.variable and not divides:
            self.variable = token
        elif kind == "number" and (self.size is None or not joined):
            self.text = "" if self.text or self.turns else token
            self._times(float(token), divides)
        elif token == "pi":
            self.turns, self.text = True, ""
            self._times(math.pi, divides)
        elif token in UNITS and not self.is_empty and joined:
            self.units = (*self.units, token)
        else:
            raise NoCellError(f"{token!r} is not understood")
        self.operator = ""

    def _times(self, factor: float, divides: bool) -> None:
        size = 1.0 if self.size is None else self.size
        if divides and not factor:
            raise NoCellError("a division by zero")
        self.size = size / factor if divides else size * factor


def _terms(text: str) -> list[_Term]:
    terms, signed, position = [_Term()], False, 0
    while position < len(text):
        if (found := _TOKEN.match(text, position)) is None:
            raise NoCellError(f"{text[position:]!r} is not understood")
        position, token, kind = found.end(), found[0].strip(), found.lastgroup or ""
        if token in ("+", "-"):
            if signed or terms[-1].operator:
                raise NoCellError(f"two signs before {text[position:]!r}")
            if not terms[-1].is_empty:
                terms.append(_Term())
            signed, terms[-1].sign = True, -1.0 if token == "-" else 1.0
        else:
            terms[-1].take(token, kind)
            signed = False
    if signed or terms[-1].operator or terms[-1].is_empty:
        raise NoCellError("the expression ends too early" if text else "the expression is empty")
    return terms
