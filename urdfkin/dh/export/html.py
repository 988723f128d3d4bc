"""The table in HTML, to stand in a page or a notebook's cell."""

from __future__ import annotations

from urdfkin.dh.export.cells import (
    cells,
    coordinate_names,
    formula,
    headings,
    is_identity,
    pose_lines,
    snap_lines,
)
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors.showing import Sheet, Table


def write(table: DHTable, units: Units) -> str:
    """A title, the formula, the table, base and tool, and what was snapped."""
    heads = ["i", "joint", *headings(table, units)]
    rows = [
        (str(i), row.joint, *cells(table, row, units, pi="\u03c0")) for i, row in enumerate(table.rows, 1)
    ]
    ends = f"{table.robot}: {table.base_frame} to {table.tip_frame}"
    parts: list[str | Table] = [formula(table), Table(heads, rows, left=2)]
    parts += [names] if (names := coordinate_names(table)) else []
    for what, T in (("base", table.base), ("tool", table.tool)):
        if is_identity(T):
            parts.append(f"{what}: the identity")
        else:
            lines = [line.split() for line in pose_lines(T, units.digits)]
            parts += [f"{what} (metres):", Table(("x", "y", "z", "position"), lines, left=0)]
    parts += snap_lines(table)
    title = f"{ends}, {table.convention} Denavit-Hartenberg parameters"
    return Sheet(title, parts).html() + "\n"
