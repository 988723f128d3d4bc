"""The table as aligned text, with its convention, formula, base and tool said."""

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
from urdfkin.errors.printable import printable


def write(table: DHTable, units: Units) -> str:
    """Lines for a terminal, the last one ended."""
    title = f"{table.robot}: {table.base_frame} to {table.tip_frame}"
    lines = [f"{title}, {table.convention} Denavit-Hartenberg parameters", formula(table), ""]
    body = [["i", "joint", *headings(table, units)]]
    body += [[str(i), row.joint, *cells(table, row, units)] for i, row in enumerate(table.rows, 1)]
    lines += aligned(body)
    if not table.rows:
        lines.append("(nothing moves between the two frames)")
    if names := coordinate_names(table):
        lines += ["", names]
    for what, T in (("base", table.base), ("tool", table.tool)):
        if not is_identity(T):
            lines += ["", f"{what} (metres):", *("  " + line for line in pose_lines(T, units.digits))]
        else:
            lines += [] if what == "tool" and is_identity(table.base) else [""]
            lines.append(f"{what}: the identity")
    if table.snap is not None:
        lines += ["", *snap_lines(table)]
    return "\n".join(map(printable, lines)) + "\n"


def aligned(body: list[list[str]]) -> list[str]:
    """Columns side by side with a rule under the headings: names to the left, numbers to the right."""
    body = [[printable(text) for text in row] for row in body]
    widths = [max(len(row[i]) for row in body) for i in range(len(body[0]))]
    lines = []
    for row in body:
        texts = [
            text.ljust(width) if i == 1 else text.rjust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(texts).rstrip())
    return [lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]]
