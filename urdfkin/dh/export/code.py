"""What the code writers share: exact numbers, identifiers, one header comment, the rows as numbers."""

from __future__ import annotations

import keyword
import math
import re

from urdfkin.dh.export.cells import formula
from urdfkin.dh.row import DHRow
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray


def identifier(name: str) -> str:
    """A name that C, Python and MATLAB all accept.

    Example:
        >>> identifier("ur5 robot"), identifier("2dof"), identifier("for")
        ('ur5_robot', 'robot_2dof', 'for_')
    """
    word = re.sub(r"[^A-Za-z0-9_]", "_", name) or "robot"
    if not word[0].isalpha():
        word = f"robot_{word.lstrip('_')}"
    return f"{word}_" if keyword.iskeyword(word) else word


def docstring(table: DHTable) -> list[str]:
    """The same as the docstring of a Python module, with a blank line."""
    first, *others = (f"{line}." for line in header(table))
    return ['"""' + first, "", *others, '"""', ""]


def header(table: DHTable) -> list[str]:
    """What a reader of the code must know, without comment marks; names cannot end a comment early."""
    lines = [
        f"{table.robot}: {table.base_frame} to {table.tip_frame}",
        f"{table.convention} Denavit-Hartenberg parameters, metres and radians",
        formula(table),
        f"q = ({', '.join(table.joint_names)})",
    ]
    if table.snap is not None and table.snap.changes:
        lines.append(f"angles snapped: the tip moves at most {table.snap.metres:.3g} m")
    return [plain(line) for line in lines]


def plain(text: str) -> str:
    """Printable ASCII without the marks that could end a comment or a string."""
    return re.sub(r"[^ -~]|[\"'\\*%]", "_", text)


def numbers(values: FloatArray | list[float]) -> str:
    """Numbers that read back to the same bits."""
    return ", ".join(repr(float(value)) for value in values)


def row_numbers(table: DHTable) -> list[list[float]]:
    """a, alpha, d, theta, beta, 1 for turning and 0 for sliding, sense."""
    return [[*row.cells, float(row.kind.turns), float(row.sense)] for row in table.rows]


def demand_free(table: DHTable, what: str) -> None:
    """Refuse a table with followers where `what` knows none."""
    if any(row.mimic is not None for row in table.rows):
        raise InputError(
            f"{what} has no joint that follows another",
            where=f"table of {table.robot}",
            remedy="load with mimic off, or use a form in plain code, such as numpy or matlab",
        )


def bounds(row: DHRow) -> str:
    """Lower and upper, with a comma between them; "" where a side is open."""
    limit = row.limit
    if limit is None or not (math.isfinite(limit.lower) and math.isfinite(limit.upper)):
        return ""
    return numbers([limit.lower, limit.upper])
