"""Read numbers and vectors from attributes: ASCII, finite, and the right count.

The grammar is `xs:double` without its special values, as in urdfdom. Python's `float` accepts more (`1_0`,
Arabic digits, `nan`), so it converts only text that matches the grammar.
"""

from __future__ import annotations

import html
import math
import re
from dataclasses import dataclass

from urdfkin.errors.numbers import DECIMAL
from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, REFUSES, WARNING, Rule
from urdfkin.urdf.element import Element

BAD_NUMBER = Rule("URDF301", "bad-number", ERROR)
BAD_VECTOR = Rule("URDF302", "bad-vector", ERROR)
WHITESPACE = Rule("URDF303", "whitespace-in-number", WARNING, REFUSES)
UNDERFLOW = Rule("URDF304", "underflow", WARNING)
NUMBER_TOO_LONG = Rule("URDF305", "number-too-long", ERROR)

#: White space; the pattern is unambiguous, so splitting takes linear time.
_BLANKS = re.compile(r"[ \t\r\n]+")


@dataclass(slots=True)
class NumberReader:
    """Reader of numbers in attributes, which reports invalid ones.

    Attributes:
        report: The reporter, which receives the findings.
        bad_number: The rule for invalid numbers; another one where kinematics does not use the number.
        bad_vector: The rule for a wrong count.
    """

    report: Reporter
    bad_number: Rule = BAD_NUMBER
    bad_vector: Rule = BAD_VECTOR

    def scalar(self, element: Element, attribute: str, default: float | None = None) -> float | None:
        """Return one number; `default` if the attribute is missing, None if it cannot be read."""
        written = element.attributes.get(attribute)
        if written is None:
            return default
        if self._is_too_long(element, attribute, written, self.report.limits.number):
            return None
        value = self._number(element, attribute, _BLANKS.sub(" ", written).strip(" "))
        if value is not None and written != written.rstrip():
            self._report_refused(element, attribute, "a space after the number")
        elif value is not None and self.report.has_raw_blanks:
            self._check_raw(element, attribute, 1)
        return value

    def vector(self, element: Element, attribute: str, count: int = 3) -> tuple[float, ...] | None:
        """Return `count` numbers, or None if the attribute is missing or cannot be read."""
        written = element.attributes.get(attribute)
        if written is None:
            return None
        longest = self.report.limits.number
        if self._is_too_long(element, attribute, written, count * longest):
            return None
        pieces = [piece for piece in _BLANKS.split(written) if piece]
        if any(self._is_too_long(element, attribute, piece, longest) for piece in pieces):
            return None
        values: list[float] = []
        for piece in pieces:
            value = self._number(element, attribute, piece)
            if value is None:
                return None
            values.append(value)
        if len(values) != count:
            self.report.add(
                self.bad_vector,
                f"{attribute} needs {count} numbers, but has {len(values)}",
                element,
                attribute=attribute,
                found=f"{attribute}={quoted(written)}",
                remedy=f"write {count} numbers separated by spaces",
            )
            return None
        if self.report.has_raw_blanks:
            self._check_raw(element, attribute, count)
        return tuple(values)

    def _number(self, element: Element, attribute: str, piece: str) -> float | None:
        value = float(piece) if DECIMAL.fullmatch(piece) else None
        if value is not None and math.isfinite(value):
            if value == 0.0 and any(digit in _NOT_ZERO for digit in re.split("[eE]", piece)[0]):
                self.report.add(
                    UNDERFLOW,
                    f"{attribute} contains a number too small for a double; it is read as zero",
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

    def _is_too_long(self, element: Element, attribute: str, written: str, most: int) -> bool:
        """Return whether a text is too long for numbers; their conversion takes quadratic time."""
        if len(written) <= most:
            return False
        self.report.add(
            NUMBER_TOO_LONG,
            f"{attribute} is too long for a number",
            element,
            attribute=attribute,
            found=f"{quoted(written, 30)} of {len(written)} characters, more than {most}",
            remedy="write 17 digits, enough for every double, or raise the limit with --max-number",
            severity=self.bad_number.severity,
        )
        return True

    def _check_raw(self, element: Element, attribute: str, count: int) -> None:
        """Report a value whose tabs or line ends urdfdom refuses. XML parsers replace them by spaces."""
        raw = self.report.raw(element, attribute)
        if raw is None or self._is_too_long(element, attribute, raw, count * self.report.limits.number):
            return
        seen = html.unescape(_LEADING_ZEROS.sub(r"\1", raw))
        pieces = [seen] if count == 1 else [piece for piece in seen.split(" ") if piece]
        if not all(DECIMAL.fullmatch(piece.lstrip("\t\r\n ")) for piece in pieces):
            self._report_refused(element, attribute, "a tab or line end between or after the numbers")

    def _report_refused(self, element: Element, attribute: str, what: str) -> None:
        needed = self.bad_number is BAD_NUMBER
        self.report.add(
            # If kinematics does not use the number, urdfdom ignores it and accepts the file.
            WHITESPACE if needed else self.bad_number,
            f"{attribute} has {what}, which urdfdom {'refuses' if needed else 'does not read'}",
            element,
            attribute=attribute,
            found=quoted(self.report.raw(element, attribute) or element.attributes[attribute]),
            remedy="write single spaces between numbers and none around them",
            fix=lambda: self.report.rewritten(
                element, attribute, " ".join(element.attributes[attribute].split())
            ),
        )


_NOT_ZERO = "123456789"

#: Elements whose tag is not named in messages.
_PLAIN = ("origin", "axis", "limit")

#: Leading zeros of a character reference; Python's conversion refuses thousands of them.
_LEADING_ZEROS = re.compile(r"(&#[xX]?)0+")

#: Pattern for an invalid number -> remedy; the first match counts.
_REMEDIES = (
    (r"[+-]?(nan|inf|infinity)", "write a finite number"),
    (r".*\$[({].*", "expand the xacro first"),
    (r".*,.*", "separate numbers by spaces, and write decimals with a point"),
    (r"[+-]?0x.*", "write decimal digits"),
    (r"[+-]?[0-9.]+d[+-]?[0-9]+", "write the exponent with e"),
    (r".*[^\x00-\x7f].*", "write ASCII digits"),
    (r".*_.*", "write the digits without underscores"),
    (r"[\[({].*|.*[\])}]", "write the numbers without brackets"),
    (r"[+-]?[0-9.]+e[+-]?", "write digits after the e"),
    (r"[+-]?[0-9.]+[a-z]+", "write the number without a unit"),
    (r"", "it is empty; write a number, or remove the attribute"),
)


def _remedy(piece: str) -> str:
    """Return the remedy for a text that is not a number."""
    found = (text for pattern, text in _REMEDIES if re.fullmatch(pattern, piece, re.IGNORECASE | re.DOTALL))
    return next(found, "write a number such as -1.5 or 2e-3")
