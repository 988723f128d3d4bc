"""What the forms in symbols share: rows as a person writes them, and how exactly numbers are written."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

from urdfkin.dh.export.cells import cells, formula
from urdfkin.dh.export.code import header
from urdfkin.dh.row import Convention
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units, fraction_text, pi_fraction
from urdfkin.model.tree import FloatArray

#: No decimal that somebody wrote is a fraction with larger numbers.
_LONGEST = 10**9
_BODY = '''
def step(a, alpha, d, theta, beta=0):
    """{formula}."""
    ct, st, ca, sa, cb, sb = cos(theta), sin(theta), cos(alpha), sin(alpha), cos(beta), sin(beta)
    S = matrix([[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
    X = matrix([[cb, 0, sb, a], [sa * sb, ca, -sa * cb, 0], [-ca * sb, sa, ca * cb, 0], [0, 0, 0, 1]])
    return {product}


def placement(q):
    """Pose of the tip in the base, 4 x 4, for {n} {kind}, rad and m."""
    T = BASE
    for row in rows(q):
        T = T @ step(*row)
    return T @ TOOL
'''


class Doubles(Units):
    """Numbers to the last bit, in metres and radians."""

    def length(self, metres: float) -> str:
        """A length, or any number."""
        return repr(metres) if metres else "0"

    def angle(self, radians: float, pi: str = "pi") -> str:
        """An angle."""
        return self.length(radians)


class Fractions(Doubles):
    """Multiples of pi, and fractions: 0.425 is 17/40. Other angles, and what was computed, are decimals."""

    def length(self, metres: float) -> str:
        """A length, or any number."""
        sign, x = "-" if metres < 0.0 else "", Fraction(repr(abs(metres)))
        if x.denominator == 1 and x < _LONGEST:
            return f"{sign}{x}"
        return sign + (self.ratio(x) if x.denominator <= _LONGEST else self.decimal(abs(metres)))

    def angle(self, radians: float, pi: str = "pi") -> str:
        """An angle."""
        if (fraction := pi_fraction(radians)) is not None:
            return re.sub(r"(\d)(?=[a-z])", r"\1*", fraction_text(fraction, pi))
        return ("-" if radians < 0.0 else "") + self.decimal(abs(radians))

    def ratio(self, x: Fraction) -> str:
        """A fraction that somebody may have written as a decimal."""
        return f"Rational({x.numerator}, {x.denominator})"

    def decimal(self, x: float) -> str:
        """Any other number."""
        return repr(x)


def columns(table: DHTable) -> str:
    """What a row holds."""
    return "a, alpha, d, theta" + (", beta" if table.has_hayati_rows else "")


def rows(table: DHTable, number: Doubles, **style: Any) -> list[str]:
    """The cells of each row, with commas between them."""
    return [", ".join(cells(table, row, number, number=number.length, **style)) for row in table.rows]


def matrix(T: FloatArray, number: Doubles) -> list[str]:
    """A pose, row by row."""
    return [", ".join(map(number.length, row)) for row in T.tolist()]


def module(table: DHTable, number: Doubles, imports: str, kind: str, split: str = "q") -> str:
    """Python with `rows(q)` and `placement(q)`.

    Args:
        table: Any table.
        number: How numbers are written.
        imports: What brings cos, sin and matrix.
        kind: What q is made of.
        split: Its numbers, one by one.
    """
    head, names = header(table), [f"q{i}" for i in range(1, len(table.joint_names) + 1)]
    lines = ['"""' + head[0] + ".", "", *(f"{line}." for line in head[1:]), '"""', "", imports]
    lines += ["", "", "def rows(q):", f'    """{columns(table)} of each row."""']
    lines += [f"    [{', '.join(names)}] = {split}", "    return ["]
    lines += [f"        ({row})," for row in rows(table, number, times=" * ")] + ["    ]", "", ""]
    for what, T in (("BASE", table.base), ("TOOL", table.tool)):
        lines += [f"{what} = matrix(", "    [", *(f"        [{row}]," for row in matrix(T, number)), "    ]"]
        lines.append(")")
    product = "S @ X" if table.convention is Convention.STANDARD else "X @ S"
    body = _BODY.format(formula=formula(table), product=product, n=len(names), kind=kind)
    return "\n".join([*lines, ""]) + "\n" + body
