"""Numbers as URDF writes them: ASCII, finite, and exactly as many as the vector has.

The grammar is that of `xs:double` without its special values, which is what urdfdom accepts. Python's own
`float` is far more generous (`1_0`, Arabic digits, `nan`) and is only asked once the grammar has agreed.
"""

from __future__ import annotations

import html
import math
import re
from dataclasses import dataclass

from urdfkin.diagnostics.codes import numbers as codes
from urdfkin.diagnostics.codes.base import Code
from urdfkin.diagnostics.document import Element
from urdfkin.diagnostics.escape import quoted
from urdfkin.diagnostics.reporter import Reporter

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_BLANKS = re.compile(r"[ \t\r\n]+")


@dataclass(slots=True)
class NumberReader:
    """Reads numbers out of attributes and reports what is wrong with them.

    Attributes:
        report: Where findings go.
        bad_number: Code for what is no number; another one where nothing depends on it.
        bad_vector: Code for the wrong count.
    """

    report: Reporter
    bad_number: Code = codes.BAD_NUMBER
    bad_vector: Code = codes.BAD_VECTOR

    def scalar(self, element: Element, attribute: str, default: float | None = None) -> float | None:
        """One number; `default` when the attribute is missing, None when it cannot be read."""
        written = element.attributes.get(attribute)
        if written is None:
            return default
        value = self._number(element, attribute, _BLANKS.sub(" ", written).strip(" "))
        if value is not None and written != written.rstrip():
            self._refused(element, attribute, "a blank after the number")
        elif value is not None and self.report.has_raw_blanks:
            self._check_raw(element, attribute, single=True)
        return value

    def vector(self, element: Element, attribute: str, count: int = 3) -> tuple[float, ...] | None:
        """`count` numbers, or None when the attribute is missing or cannot be read."""
        written = element.attributes.get(attribute)
        if written is None:
            return None
        pieces = [piece for piece in _BLANKS.split(written) if piece]
        values: list[float] = []
        for piece in pieces:
            value = self._number(element, attribute, piece)
            if value is None:
                return None
            values.append(value)
        if len(values) != count:
            self.report.add(
                self.bad_vector,
                f"{attribute} needs {count} numbers and has {len(values)}",
                element,
                attribute=attribute,
                found=f"{attribute}={quoted(written)}",
                remedy=f"write {count} numbers with a space between them",
            )
            return None
        if self.report.has_raw_blanks:
            self._check_raw(element, attribute, single=False)
        return tuple(values)

    def _number(self, element: Element, attribute: str, piece: str) -> float | None:
        value = float(piece) if _NUMBER.fullmatch(piece) and len(piece) <= _LONGEST else None
        if value is not None and math.isfinite(value):
            if value == 0.0 and any(digit in _NOT_ZERO for digit in re.split("[eE]", piece)[0]):
                self.report.add(
                    codes.UNDERFLOW,
                    f"{attribute} holds a number too small for a double; it is zero",
                    element,
                    attribute=attribute,
                    found=quoted(piece),
                    remedy="check the exponent",
                )
            return value
        what = attribute if element.tag in _PLAIN else f"{attribute} of <{element.tag}>"
        if value is not None:
            message, remedy = "is too large for a double", "check the exponent"
        else:
            message, remedy = "is not a number", _remedy(piece)
        self.report.add(
            self.bad_number,
            f"{what} {message}" if piece == element.attributes[attribute] else f"a part of {what} {message}",
            element,
            attribute=attribute,
            found=quoted(piece),
            remedy=remedy,
        )
        return None

    def _check_raw(self, element: Element, attribute: str, *, single: bool) -> None:
        """Whether urdfdom, which sees tabs and line ends that XML turns into spaces, reads the value."""
        raw = self.report.raw(element, attribute)
        if raw is None:
            return
        pieces = (
            [html.unescape(raw)] if single else [piece for piece in html.unescape(raw).split(" ") if piece]
        )
        if not all(_NUMBER.fullmatch(piece.lstrip("\t\r\n ")) for piece in pieces):
            self._refused(element, attribute, "a tab or line end between or after the numbers")

    def _refused(self, element: Element, attribute: str, what: str) -> None:
        self.report.add(
            codes.WHITESPACE,
            f"{attribute} has {what}, which urdfdom refuses",
            element,
            attribute=attribute,
            found=quoted(self.report.raw(element, attribute) or element.attributes[attribute]),
            remedy="write single spaces between numbers and none around them",
        )


_NOT_ZERO = "123456789"

#: Elements whose attributes need no further words.
_PLAIN = ("origin", "axis", "limit")

#: Longest number that is read; Python's conversion takes time quadratic in the length of absurd ones.
_LONGEST = 2000


#: What a piece of text looks like -> what to do about it; the first that matches.
_REMEDIES = (
    (r"[+-]?(nan|inf|infinity)", "only finite numbers have a meaning here"),
    (r".*\$[({].*", "expand the xacro first"),
    (r".*,.*", "separate numbers by spaces and write decimals with a point"),
    (r"[+-]?0x.*", "write it in decimal digits"),
    (r"[+-]?[0-9.]+d[+-]?[0-9]+", "write the exponent with e"),
    (r".*[^\x00-\x7f].*", "write ASCII digits"),
    (r".*_.*", "write the digits without underscores"),
    (r"[\[({].*|.*[\])}]", "write the numbers without brackets"),
    (r"[+-]?[0-9.]+e[+-]?", "write digits after the e"),
    (r"[+-]?[0-9.]+[a-z]+", "write the number without a unit"),
    (r"", "it is empty; write a number, or leave the attribute out"),
)


def _remedy(piece: str) -> str:
    """What to do about a piece of text that is not a number."""
    found = (text for pattern, text in _REMEDIES if re.fullmatch(pattern, piece, re.IGNORECASE | re.DOTALL))
    return next(found, "write a number such as -1.5 or 2e-3")
