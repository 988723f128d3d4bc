"""The table in Markdown, for a README or an issue."""

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
from urdfkin.errors.printable import markdown_code, markdown_text


def write(table: DHTable, units: Units) -> str:
    """A heading line, the table, base and tool, and what was snapped."""
    body = [["i", "joint", *headings(table, units)]]
    body += [
        [str(i), markdown_code(row.joint), *cells(table, row, units)] for i, row in enumerate(table.rows, 1)
    ]
    robot, base, tip = (markdown_code(name) for name in (table.robot, table.base_frame, table.tip_frame))
    title = f"**{robot}**, {base} to {tip}"
    lines = [f"{title}, {table.convention} Denavit-Hartenberg parameters: `{formula(table)}`", ""]
    lines += [_line(body[0]), _line(["---:", ":---", *["---:"] * (len(body[0]) - 2)])]
    lines += [_line(row) for row in body[1:]]
    if names := coordinate_names(table, markdown_code):
        lines += ["", names]
    for what, T in (("Base", table.base), ("Tool", table.tool)):
        if is_identity(T):
            lines += ["", f"{what}: the identity."]
        else:
            lines += ["", f"{what} (metres):", "", "```", *pose_lines(T, units.digits), "```"]
    if table.snap is not None:
        said = snap_lines(table, "- ")  # joints are named in it
        lines += ["", *(f"- {markdown_text(s[2:])}" if s.startswith("- ") else s for s in said)]
    return "\n".join(lines) + "\n"


def _line(texts: list[str]) -> str:
    return "| " + " | ".join(texts) + " |"
