"""Export a table as code for symbolic computation, and format names and numbers in code.

Multiples of pi/12 and short decimals are exact: pi/2 stays pi/2, and 0.425 becomes 17/40. Other numbers are
written as decimals. The Python code uses SymPy. The MATLAB code uses the Symbolic Math Toolbox, or Octave's
package symbolic.
"""

from __future__ import annotations

import keyword
import re
from fractions import Fraction
from typing import Any

from urdfkin.dh.export.text import format_cells, formula
from urdfkin.dh.snapping import travel_condition
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.dh.units import COLUMNS, Units, format_pi_fraction, pi_fraction
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray, is_bounded


def make_identifier(name: str) -> str:
    """Return a name of ASCII letters, digits and "_" that is no Python keyword.

    >>> make_identifier("ur5 robot"), make_identifier("2dof"), make_identifier("for")
    ('ur5_robot', 'robot_2dof', 'for_')
    """
    word = re.sub(r"[^A-Za-z0-9_]", "_", name) or "robot"
    if not word[0].isalpha():
        word = f"robot_{word.lstrip('_')}"
    return f"{word}_" if keyword.iskeyword(word) else word


def docstring_lines(table: DHTable) -> list[str]:
    first, *others = (f"{line}." for line in header_lines(table))
    return ['"""' + first, "", *others, '"""', ""]


def header_lines(table: DHTable) -> list[str]:
    lines = [
        f"{table.robot}: {table.base_frame} to {table.tip_frame}",
        f"{table.convention} Denavit-Hartenberg parameters, metres and radians",
        formula(table),
        f"q = ({', '.join(table.joint_names)})",
    ]
    if table.snap is not None and table.snap.changes:
        condition = f" if {holds_if}" if (holds_if := travel_condition(table)) else ""
        lines.append(f"the rounding of angles moves the tip by at most {table.snap.metres:.3g} m{condition}")
    return [sanitize(line) for line in lines]


def sanitize(text: str) -> str:
    """Replace characters that are not ASCII or could end a comment or string."""
    return re.sub(r"[^ -~]|[\"'\\*%]", "_", text)


def format_numbers(values: FloatArray | list[float]) -> str:
    """Format numbers without loss of bits."""
    return ", ".join(repr(float(value)) for value in values)


def check_no_mimic(table: DHTable, what: str) -> None:
    if any(row.mimic is not None for row in table.rows):
        raise InputError(
            f"{what} does not support mimic joints",
            where=f"table of {table.robot}",
            remedy="load the robot with --no-mimic (mimic=False), or use another format, such as numpy",
        )


def format_limits(row: DHRow) -> str:
    """Return "lower, upper" if both limits are finite, otherwise ""."""
    return format_numbers([row.limit.lower, row.limit.upper]) if is_bounded(row.limit) else ""


def matrix_lines(name: str, rows: list[list[float]] | FloatArray, columns: int) -> list[str]:
    if not len(rows):
        return [f"{name} = zeros(0, {columns});"]
    return [f"{name} = [", *(f"    {format_numbers(row)}" for row in rows), "];"]


#: Fractions with a larger denominator are written as decimals.
_MAX_DENOMINATOR = 10**9


class Fractions(Units):
    """Format angles as multiples of pi, lengths as fractions."""

    def format_length(self, metres: float) -> str:
        sign, x = "-" if metres < 0.0 else "", Fraction(repr(abs(metres)))
        if x.denominator == 1 and x < _MAX_DENOMINATOR:
            return f"{sign}{x}"
        return sign + (
            self.format_ratio(x) if x.denominator <= _MAX_DENOMINATOR else self.format_decimal(abs(metres))
        )

    def format_angle(self, radians: float, pi: str = "pi") -> str:
        if (fraction := pi_fraction(radians)) is not None:
            return re.sub(r"(\d)(?=[a-z])", r"\1*", format_pi_fraction(fraction, pi))
        return ("-" if radians < 0.0 else "") + self.format_decimal(abs(radians))

    def format_ratio(self, x: Fraction) -> str:
        return f"Rational({x.numerator}, {x.denominator})"

    def format_decimal(self, x: float) -> str:
        return repr(x)


def column_names(table: DHTable) -> str:
    return ", ".join([*COLUMNS, *["beta"] * table.has_hayati_rows])


def format_rows(table: DHTable, number: Fractions, **style: Any) -> list[str]:
    return [
        ", ".join(format_cells(table, row, number, number=number.format_length, **style))
        for row in table.rows
    ]


_SYMPY_TEMPLATE = '''from sympy import Matrix, Rational, cos, pi, sin


def rows(q):
    """Return {columns} of each row."""
    [{names}] = q
    return [
{rows}
    ]


BASE = Matrix({base})
TOOL = Matrix({tool})


def step(a, alpha, d, theta, beta=0):
    """Return {formula}."""
    ct, st, ca, sa, cb, sb = cos(theta), sin(theta), cos(alpha), sin(alpha), cos(beta), sin(beta)
    S = Matrix([[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
    X = Matrix([[cb, 0, sb, a], [sa * sb, ca, -sa * cb, 0], [-ca * sb, sa, ca * cb, 0], [0, 0, 0, 1]])
    return {product}


def placement(q):
    """Return the 4 x 4 pose of the tip in the base for {n} symbols or numbers, rad and m."""
    T = BASE
    for row in rows(q):
        T = T @ step(*row)
    return T @ TOOL
'''


def write_sympy(table: DHTable) -> str:
    """Return a SymPy module with `placement(q)`."""
    number, n = Fractions(), len(table.joint_names)
    base, tool = (
        "[" + ", ".join(f"[{', '.join(map(number.format_length, row))}]" for row in T.tolist()) + "]"
        for T in (table.base, table.tool)
    )
    return (
        "\n".join(docstring_lines(table))
        + "\n"
        + _SYMPY_TEMPLATE.format(
            columns=column_names(table),
            names=", ".join(f"q{i}" for i in range(1, n + 1)),
            rows="\n".join(f"        ({row})," for row in format_rows(table, number, times=" * ")),
            base=base,
            tool=tool,
            formula=formula(table),
            product="S @ X" if table.convention is DHConvention.STANDARD else "X @ S",
            n=n,
        )
    )


_MATLAB_TEMPLATE_END = """\
    S = one; S(1:2, 1:2) = [cos(theta), -sin(theta); sin(theta), cos(theta)]; S(3, 4) = d;
    X = one; X(2:3, 2:3) = [cos(alpha), -sin(alpha); sin(alpha), cos(alpha)]; X(1, 4) = a;
    Y = one; Y([1, 3], [1, 3]) = [cos(beta), sin(beta); -sin(beta), cos(beta)];
    T = T * {product};
end
T = T * tool;
end
"""


class _MatlabFractions(Fractions):
    def format_ratio(self, x: Fraction) -> str:
        return f"sym({x.numerator})/{x.denominator}"

    def format_decimal(self, x: float) -> str:
        return f"vpa('{x!r}')"


def write_matlab_symbolic(table: DHTable) -> str:
    """Return a MATLAB file with `ROBOT_symbolic`."""
    number, n = _MatlabFractions(), len(table.joint_names)
    lines = [f"function [T, q] = {make_identifier(table.robot)}_symbolic()"]
    lines += [f"% {line}" for line in header_lines(table)]
    names = " ".join(f"q{i}" for i in range(1, n + 1))
    lines += [f"syms {names} real", f"q = [{names.replace(' ', '; ')}];"] if n else ["q = sym(zeros(0, 1));"]
    cells_of_rows = format_rows(table, number, pi="sym(pi)", times=" * ")
    lines += [f"% {column_names(table)}", "rows = sym([", *(f"    {row}" for row in cells_of_rows), "]);"]
    lines.append("one = sym(eye(4));")
    for what, T in (("base", table.base), ("tool", table.tool)):
        entries = [(i, j) for i in range(4) for j in range(4) if T[i, j] != (i == j)]
        assignments = (
            f"{what}({i + 1}, {j + 1}) = {number.format_length(float(T[i, j]))};" for i, j in entries
        )
        lines.append(" ".join([f"{what} = one;", *assignments]))
    lines += ["T = base;", "for i = 1:size(rows, 1)"]
    lines += ["    a = rows(i, 1); alpha = rows(i, 2); d = rows(i, 3); theta = rows(i, 4);"]
    lines += [f"    beta = {'rows(i, 5)' if table.has_hayati_rows else '0'};"]
    product = "S * (X * Y)" if table.convention is DHConvention.STANDARD else "(X * Y) * S"
    return "\n".join([*lines, _MATLAB_TEMPLATE_END.format(product=product)])
