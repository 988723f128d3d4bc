"""MATLAB code for its Symbolic Math Toolbox; runs in Octave with the package symbolic as well."""

from __future__ import annotations

from fractions import Fraction

from urdfkin.dh.export.code import header, identifier
from urdfkin.dh.export.matlab import frames
from urdfkin.dh.export.symbols import Fractions, columns, rows
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units


class _Matlab(Fractions):
    def ratio(self, x: Fraction) -> str:
        return f"sym({x.numerator})/{x.denominator}"

    def decimal(self, x: float) -> str:
        return f"vpa('{x!r}')"


def write(table: DHTable, units: Units) -> str:
    """A function file `ROBOT_symbolic.m`: `[T, q] = ROBOT_symbolic()`; `matlabFunction(T, 'Vars', {q})`."""
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
