"""Export a table as code that computes with numbers or with symbols.

To compute with numbers, the languages are Python with NumPy, C99, and MATLAB (also Octave). The code contains
the rows as constants and one function. It needs no other library. The constants are exact to the last bit.
The other modules that write code use this module's functions for identifiers, headers and numbers.

To compute with symbols, the languages are Python with SymPy or CasADi, and MATLAB with the Symbolic Math
Toolbox.

- SymPy: pi/2 stays pi/2, and 0.425 becomes 17/40, so that the algebra is exact.
- CasADi: the pose is an expression of SX, MX or DM, for functions and their derivatives.
- MATLAB: the code also runs in Octave with the package symbolic.
"""

from __future__ import annotations

import keyword
import re
from fractions import Fraction
from typing import Any

from urdfkin.dh.export.text import cells, formula
from urdfkin.dh.table import Convention, DHRow, DHTable
from urdfkin.dh.units import Units, fraction_text, pi_fraction
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray, is_bounded


def identifier(name: str) -> str:
    """Return a valid name in C, Python and MATLAB.

    Example:
        >>> identifier("ur5 robot"), identifier("2dof"), identifier("for")
        ('ur5_robot', 'robot_2dof', 'for_')
    """
    word = re.sub(r"[^A-Za-z0-9_]", "_", name) or "robot"
    if not word[0].isalpha():
        word = f"robot_{word.lstrip('_')}"
    return f"{word}_" if keyword.iskeyword(word) else word


def docstring(table: DHTable) -> list[str]:
    """Return the lines of `header` as a Python module's docstring, followed by a blank line."""
    first, *others = (f"{line}." for line in header(table))
    return ['"""' + first, "", *others, '"""', ""]


def header(table: DHTable) -> list[str]:
    """Return the lines of the header without comment marks; no name in the header can end a comment."""
    lines = [
        f"{table.robot}: {table.base_frame} to {table.tip_frame}",
        f"{table.convention} Denavit-Hartenberg parameters, metres and radians",
        formula(table),
        f"q = ({', '.join(table.joint_names)})",
    ]
    if table.snap is not None and table.snap.changes:
        lines.append(f"angles snapped: the tip moves by at most {table.snap.metres:.3g} m")
    return [plain(line) for line in lines]


def plain(text: str) -> str:
    """Replace all characters that are not printable ASCII or that could end a comment or a string."""
    return re.sub(r"[^ -~]|[\"'\\*%]", "_", text)


def numbers(values: FloatArray | list[float]) -> str:
    """Format numbers so that a parser reads back the same bits."""
    return ", ".join(repr(float(value)) for value in values)


def row_numbers(table: DHTable) -> list[list[float]]:
    """Return a, alpha, d, theta, beta, 1 for revolute or 0 for prismatic, and sense of each row."""
    return [[*row.cells, float(row.kind.turns), float(row.sense)] for row in table.rows]


def demand_free(table: DHTable, what: str) -> None:
    """Raise InputError for a table with mimic joints, which the format `what` does not support."""
    if any(row.mimic is not None for row in table.rows):
        raise InputError(
            f"{what} does not support mimic joints",
            where=f"table of {table.robot}",
            remedy="load the robot with mimic off, or use another format, such as numpy or matlab",
        )


def bounds(row: DHRow) -> str:
    """Return the lower and upper limit separated by a comma; "" if one of them is infinite."""
    return numbers([row.limit.lower, row.limit.upper]) if is_bounded(row.limit) else ""


_NUMPY_BODY = '''

def placement(q):
    """Return the (..., 4, 4) pose of the tip in the base for q (..., {n}), rad and m."""
    q = np.asarray(q, dtype=float) @ COUPLING.T + COUPLING_OFFSET
    T = np.broadcast_to(BASE, (*q.shape[:-1], 4, 4))
    for i, (a, alpha, d, theta, beta, turns, sense) in enumerate(ROWS):
        moved = sense * q[..., i]
        S = along_axis(theta + turns * moved, d + (1 - turns) * moved)
        X = between_axes(a, alpha, beta)
        T = T @ {product}
    return T @ TOOL


def along_axis(theta, d):
    """Return Rz(theta) Tz(d)."""
    S = np.zeros((*theta.shape, 4, 4))
    S[..., 0, 0] = S[..., 1, 1] = np.cos(theta)
    S[..., 1, 0] = np.sin(theta)
    S[..., 0, 1] = -S[..., 1, 0]
    S[..., 2, 2] = S[..., 3, 3] = 1.0
    S[..., 2, 3] = d
    return S


def between_axes(a, alpha, beta):
    """Return Tx(a) Rx(alpha) Ry(beta)."""
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    return np.array([[cb, 0, sb, a], [sa * sb, ca, -sa * cb, 0], [-ca * sb, sa, ca * cb, 0], [0, 0, 0, 1.0]])
'''


def write_numpy(table: DHTable, units: Units) -> str:
    """Return a module with `placement(q)`."""
    del units
    coupling = table.coupling
    lines = [
        '"""' + header(table)[0] + ".",
        "",
        *(f"{line}." for line in header(table)[1:]),
        '"""',
        "",
        "import numpy as np",
        "",
    ]
    lines += ["# a, alpha, d, theta, beta, 1 for revolute and 0 for prismatic, sense", "ROWS = np.array("]
    lines += [
        "    [",
        *(f"        [{numbers(row)}]," for row in row_numbers(table)),
        "    ]",
        ").reshape(-1, 7)",
    ]
    lines.append(
        f"COUPLING = np.array([{numbers(coupling.matrix.ravel())}]).reshape({coupling.matrix.shape})"
    )
    lines.append(f"COUPLING_OFFSET = np.array([{numbers(coupling.offset)}])")
    for name, T in (("BASE", table.base), ("TOOL", table.tool)):
        lines += [f"{name} = np.array(", "    [", *(f"        [{numbers(row)}]," for row in T), "    ]", ")"]
    product = "S @ X" if table.convention is Convention.STANDARD else "X @ S"
    return "\n".join(lines) + "\n" + _NUMPY_BODY.format(n=len(table.joint_names), product=product)


_C_BODY = """
static void {name}_multiply(double T[16], const double M[16])
{{
    double P[16];
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c) {{
            P[4 * r + c] = 0.0;
            for (int k = 0; k < 4; ++k)
                P[4 * r + c] += T[4 * r + k] * M[4 * k + c];
        }}
    for (int i = 0; i < 16; ++i)
        T[i] = P[i];
}}

/* T: pose of the tip in the base, row by row; q: {n} numbers, rad and m. */
void {name}_placement(const double *q, double T[16])
{{
    for (int i = 0; i < 16; ++i)
        T[i] = {name}_base[i];
    for (int i = 0; i < {rows}; ++i) {{
        const double *row = {name}_rows[i];
        double value = {name}_coupling_offset[i];
        for (int k = 0; k < {n}; ++k)
            value += {name}_coupling[i][k] * q[k];
        const double turned = row[3] + (row[5] != 0.0 ? row[6] * value : 0.0);
        const double slid = row[2] + (row[5] != 0.0 ? 0.0 : row[6] * value);
        const double ct = cos(turned), st = sin(turned);
        const double ca = cos(row[1]), sa = sin(row[1]), cb = cos(row[4]), sb = sin(row[4]);
        const double S[16] = {{ct, -st, 0, 0, st, ct, 0, 0, 0, 0, 1, slid, 0, 0, 0, 1}};
        const double X[16] = {{cb, 0, sb, row[0], sa * sb, ca, -sa * cb, 0,
                              -ca * sb, sa, ca * cb, 0, 0, 0, 0, 1}};
        {name}_multiply(T, {first});
        {name}_multiply(T, {second});
    }}
    {name}_multiply(T, {name}_tool);
}}
"""


def write_c(table: DHTable, units: Units) -> str:
    """Return a translation unit with `ROBOT_placement`."""
    del units
    name, n, rows = identifier(table.robot), len(table.joint_names), row_numbers(table)
    lines = [
        "/* " + "\n * ".join(line.replace("/", "_") for line in header(table)) + " */",
        "#include <math.h>",
        "",
    ]
    # C has no empty arrays, so the code of a table without rows has one unused row.
    lines += ["/* a, alpha, d, theta, beta, 1 for revolute and 0 for prismatic, sense */"]
    lines += [f"static const double {name}_rows[{max(len(rows), 1)}][7] = {{"]
    lines += [f"    {{{numbers(row)}}}," for row in rows or [[0.0] * 7]]
    lines += ["};", f"static const double {name}_coupling[{max(len(rows), 1)}][{max(n, 1)}] = {{"]
    lines += [f"    {{{numbers(row)}}}," for row in (table.coupling.matrix if rows else [[0.0]])]
    lines += ["};", f"static const double {name}_coupling_offset[{max(len(rows), 1)}] = {{"]
    lines += [f"    {numbers(table.coupling.offset) if rows else '0.0'}", "};"]
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines += [f"static const double {name}_{what}[16] = {{", *(f"    {numbers(row)}," for row in T), "};"]
    order = ("S", "X") if table.convention is Convention.STANDARD else ("X", "S")
    return (
        "\n".join(lines)
        + "\n"
        + _C_BODY.format(name=name, n=n, rows=len(rows), first=order[0], second=order[1])
    )


_VALUES = """
one = eye(4);
T = base;
for i = 1:size(rows, 1)
    a = rows(i, 1); alpha = rows(i, 2); d = rows(i, 3); theta = rows(i, 4); beta = rows(i, 5);
    if rows(i, 6)
        theta = theta + rows(i, 7) * values(i);
    else
        d = d + rows(i, 7) * values(i);
    end
"""
_FRAMES = """\
    S = one; S(1:2, 1:2) = [cos(theta), -sin(theta); sin(theta), cos(theta)]; S(3, 4) = d;
    X = one; X(2:3, 2:3) = [cos(alpha), -sin(alpha); sin(alpha), cos(alpha)]; X(1, 4) = a;
    Y = one; Y([1, 3], [1, 3]) = [cos(beta), sin(beta); -sin(beta), cos(beta)];
    T = T * {product};
end
T = T * tool;
end
"""


def write_matlab(table: DHTable, units: Units) -> str:
    """Return a function file `ROBOT_placement.m`."""
    del units
    lines = [f"function T = {identifier(table.robot)}_placement(q)"]
    lines += [f"% {line}" for line in header(table)]
    lines += ["% columns: a, alpha, d, theta, beta, 1 for revolute and 0 for prismatic, sense"]
    lines += matrix("rows", row_numbers(table), 7)
    lines += matrix("coupling", table.coupling.matrix.tolist(), len(table.joint_names))
    lines += [f"values = coupling * q(:) + [{'; '.join(numbers([x]) for x in table.coupling.offset)}];"]
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines += matrix(what, T.tolist(), 4)
    return "\n".join(lines) + _VALUES + frames(table)


def frames(table: DHTable) -> str:
    """Return the end of the loop over rows; this code computes T from a, alpha, d, theta and beta."""
    product = "S * (X * Y)" if table.convention is Convention.STANDARD else "(X * Y) * S"
    return _FRAMES.format(product=product)


def matrix(name: str, rows: list[list[float]] | FloatArray, columns: int) -> list[str]:
    """Return the lines that assign a matrix; the matrix may have no rows."""
    if not len(rows):
        return [f"{name} = zeros(0, {columns});"]
    return [f"{name} = [", *(f"    {numbers(row)}" for row in rows), "];"]


#: Largest denominator and largest integer of a number that is written as a fraction; other numbers are
#: decimals.
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
    """Exact multiples of pi, and exact fractions (0.425 is 17/40).

    Other angles and numbers with many digits are decimals.
    """

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
        """Format a number of few digits as a fraction."""
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


def pose_rows(T: FloatArray, number: Doubles) -> list[str]:
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
        entries = (f"        [{row}]," for row in pose_rows(T, number))
        lines += [f"{what} = matrix(", "    [", *entries, "    ]", ")"]
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
