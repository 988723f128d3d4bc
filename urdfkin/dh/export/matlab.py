"""MATLAB code of plain matrices; runs in Octave as well."""

from __future__ import annotations

from urdfkin.dh.export.code import header, identifier, numbers, row_numbers
from urdfkin.dh.row import Convention
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.model.tree import FloatArray

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


def write(table: DHTable, units: Units) -> str:
    """A function file `ROBOT_placement.m`."""
    del units
    lines = [f"function T = {identifier(table.robot)}_placement(q)"]
    lines += [f"% {line}" for line in header(table)]
    lines += ["% columns: a, alpha, d, theta, beta, 1 for turning and 0 for sliding, sense"]
    lines += matrix("rows", row_numbers(table), 7)
    lines += matrix("coupling", table.coupling.matrix.tolist(), len(table.joint_names))
    lines += [f"values = coupling * q(:) + [{'; '.join(numbers([x]) for x in table.coupling.offset)}];"]
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines += matrix(what, T.tolist(), 4)
    return "\n".join(lines) + _VALUES + frames(table)


def frames(table: DHTable) -> str:
    """The end of a loop over rows, from a, alpha, d, theta and beta to T."""
    product = "S * (X * Y)" if table.convention is Convention.STANDARD else "(X * Y) * S"
    return _FRAMES.format(product=product)


def matrix(name: str, rows: list[list[float]] | FloatArray, columns: int) -> list[str]:
    """Lines that assign a matrix, also one without rows."""
    if not len(rows):
        return [f"{name} = zeros(0, {columns});"]
    return [f"{name} = [", *(f"    {numbers(row)}" for row in rows), "];"]
