"""Export a table as code for symbols: Python with SymPy or CasADi, and MATLAB's Symbolic Math Toolbox.

- SymPy: pi/2 stays pi/2, and 0.425 becomes 17/40, so that the algebra is exact.
- CasADi: the pose is an expression of SX, MX or DM, for functions and their derivatives.
- MATLAB: the code also runs in Octave with the package symbolic.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

from urdfkin.dh.export.numeric_code import frames, header, identifier
from urdfkin.dh.export.text import cells, formula
from urdfkin.dh.table import Convention, DHTable
from urdfkin.dh.units import Units, fraction_text, pi_fraction
from urdfkin.model.tree import FloatArray

#: Largest denominator and largest integer of a handwritten number; other numbers are decimals.
_LONGEST = 10**9
_BODY = '''
def step(a, alpha, d, theta, beta=0):
    """Return {formula}."""
    ct, st, ca, sa, cb, sb = cos(theta), sin(theta), cos(alpha), sin(alpha), cos(beta), sin(beta)
    S = matrix([[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
    X = matrix([[cb, 0, sb, a], [sa * sb, ca, -sa * cb, 0], [-ca * sb, sa, ca * cb, 0], [0, 0, 0, 1]])
    return {product}


def placement(q):
    """Return the 4 x 4 pose of the tip in the base for {n} {kind}, rad and m."""
    T = BASE
    for row in rows(q):
        T = T @ step(*row)
    return T @ TOOL
'''


class Doubles(Units):
    """Exact decimal numbers in metres and radians."""

    def length(self, metres: float) -> str:
        """Format a length or another number."""
        return repr(metres) if metres else "0"

    def angle(self, radians: float, pi: str = "pi") -> str:
        """Format an angle."""
        return self.length(radians)


class Fractions(Doubles):
    """Exact multiples of pi and fractions (0.425 is 17/40); other angles and long numbers are decimals."""

    def length(self, metres: float) -> str:
        """Format a length or another number."""
        sign, x = "-" if metres < 0.0 else "", Fraction(repr(abs(metres)))
        if x.denominator == 1 and x < _LONGEST:
            return f"{sign}{x}"
        return sign + (self.ratio(x) if x.denominator <= _LONGEST else self.decimal(abs(metres)))

    def angle(self, radians: float, pi: str = "pi") -> str:
        """Format an angle."""
        if (fraction := pi_fraction(radians)) is not None:
            return re.sub(r"(\d)(?=[a-z])", r"\1*", fraction_text(fraction, pi))
        return ("-" if radians < 0.0 else "") + self.decimal(abs(radians))

    def ratio(self, x: Fraction) -> str:
        """Format a fraction with a handwritten decimal value."""
        return f"Rational({x.numerator}, {x.denominator})"

    def decimal(self, x: float) -> str:
        """Format any other number."""
        return repr(x)


def columns(table: DHTable) -> str:
    """Return the names of a row's cells."""
    return "a, alpha, d, theta" + (", beta" if table.has_hayati_rows else "")


def rows(table: DHTable, number: Doubles, **style: Any) -> list[str]:
    """Return the cells of each row, separated by commas."""
    return [", ".join(cells(table, row, number, number=number.length, **style)) for row in table.rows]


def matrix(T: FloatArray, number: Doubles) -> list[str]:
    """Return the rows of a pose as text."""
    return [", ".join(map(number.length, row)) for row in T.tolist()]


def module(table: DHTable, number: Doubles, imports: str, kind: str, split: str = "q") -> str:
    """Return Python code with `rows(q)` and `placement(q)`.

    Args:
        table: Any table.
        number: Number format.
        imports: Code that imports cos, sin and matrix.
        kind: Description of q's elements.
        split: Expression for the list of q's elements.
    """
    head, names = header(table), [f"q{i}" for i in range(1, len(table.joint_names) + 1)]
    lines = ['"""' + head[0] + ".", "", *(f"{line}." for line in head[1:]), '"""', "", imports]
    lines += ["", "", "def rows(q):", f'    """Return {columns(table)} of each row."""']
    lines += [f"    [{', '.join(names)}] = {split}", "    return ["]
    lines += [f"        ({row})," for row in rows(table, number, times=" * ")] + ["    ]", "", ""]
    for what, T in (("BASE", table.base), ("TOOL", table.tool)):
        lines += [f"{what} = matrix(", "    [", *(f"        [{row}]," for row in matrix(T, number)), "    ]"]
        lines.append(")")
    product = "S @ X" if table.convention is Convention.STANDARD else "X @ S"
    body = _BODY.format(formula=formula(table), product=product, n=len(names), kind=kind)
    return "\n".join([*lines, ""]) + "\n" + body


_SYMPY_IMPORTS = "from sympy import Matrix as matrix\nfrom sympy import Rational, cos, pi, sin"


def write_sympy(table: DHTable, units: Units) -> str:
    """Return a module with `placement(q)`, for `q = symbols("q1:7")` or numbers."""
    del units
    return module(table, Fractions(), _SYMPY_IMPORTS, "symbols or numbers")


_CASADI_IMPORTS = '''from casadi import cos, horzcat, sin, vertcat, vertsplit


def matrix(rows):
    """Make a matrix from its rows."""
    return vertcat(*(horzcat(*row) for row in rows))'''


def write_casadi(table: DHTable, units: Units) -> str:
    """Return a module with `placement(q)`, for a column `q = SX.sym("q", 6)`."""
    del units
    return module(table, Doubles(), _CASADI_IMPORTS, "numbers of a column SX, MX or DM", "vertsplit(q)")


class _Matlab(Fractions):
    def ratio(self, x: Fraction) -> str:
        return f"sym({x.numerator})/{x.denominator}"

    def decimal(self, x: float) -> str:
        return f"vpa('{x!r}')"


def write_matlab_symbolic(table: DHTable, units: Units) -> str:
    """Return a function file `ROBOT_symbolic.m` for MATLAB.

    Use it as `[T, q] = ROBOT_symbolic()`, then `matlabFunction(T, 'Vars', {q})`.
    """
    del units
    number, n = _Matlab(), len(table.joint_names)
    lines = [f"function [T, q] = {identifier(table.robot)}_symbolic()"]
    lines += [f"% {line}" for line in header(table)]
    names = " ".join(f"q{i}" for i in range(1, n + 1))
    lines += [f"syms {names} real", f"q = [{names.replace(' ', '; ')}];"] if n else ["q = sym(zeros(0, 1));"]
    found = rows(table, number, pi="sym(pi)", times=" * ")
    lines += [f"% {columns(table)}", "rows = sym([", *(f"    {row}" for row in found), "]);"]
    lines.append("one = sym(eye(4));")
    for what, T in (("base", table.base), ("tool", table.tool)):
        changed = [(i, j) for i in range(4) for j in range(4) if T[i, j] != (i == j)]
        set_ = (f"{what}({i + 1}, {j + 1}) = {number.length(float(T[i, j]))};" for i, j in changed)
        lines.append(" ".join([f"{what} = one;", *set_]))
    lines += ["T = base;", "for i = 1:size(rows, 1)"]
    lines += ["    a = rows(i, 1); alpha = rows(i, 2); d = rows(i, 3); theta = rows(i, 4);"]
    lines += [f"    beta = {'rows(i, 5)' if table.has_hayati_rows else '0'};"]
    return "\n".join([*lines, frames(table)])
