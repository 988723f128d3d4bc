"""Khalil and Kleinfinger's table as text, Markdown, comma-separated values and plain data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, fields
from typing import Any

from urdfkin.dh.export.cells import added
from urdfkin.dh.export.terminal import aligned
from urdfkin.dh.tree_parameters import TreeParameters, TreeRow
from urdfkin.dh.units import Units
from urdfkin.errors.printable import csv_cell, csv_text, markdown_code, printable

FORMULA = "T(i, j) = Rz(gamma) Tz(b) Tx(d) Rx(alpha) Ry(beta) Rz(theta) Tz(r), i = a(j)"


def as_mapping(table: TreeParameters) -> dict[str, Any]:
    """Plain data, metres and radians; rows are numbered from 1, the root is 0."""
    return {
        "notation": "Khalil-Kleinfinger",
        "robot": table.robot,
        "root": table.root,
        "rows": [{**asdict(row), "antecedent": row.antecedent + 1} for row in table.rows],
        "T_frame_link": table.T_frame_link.tolist(),
    }


def write_tree(table: TreeParameters, form: str, units: Units) -> str:
    """The table as "terminal", "markdown" or "csv"; csv is in metres and radians, with T_frame_link."""
    if form == "csv":
        return _csv(table)
    shown = markdown_code if form == "markdown" else str
    title = f"{shown(table.robot)}: Khalil-Kleinfinger parameters, {shown(table.root)} is frame 0"
    body = [_heads(table, units), *(_cells(table, j, units, shown) for j in range(len(table.rows)))]
    if form == "markdown":
        lines = ["| " + " | ".join(row) + " |" for row in body]
        rule = "| " + " | ".join(["---:"] * len(body[0])) + " |"
        return "\n".join([f"{title}: `{FORMULA}`", "", lines[0], rule, *lines[1:]]) + "\n"
    return "\n".join([printable(title), FORMULA, "", *aligned(body)]) + "\n"


def _csv(table: TreeParameters) -> str:
    """A line for each row: its numbers, then the three upper rows of T_frame_link, T11 to T34."""
    places = [f"T{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4)]
    lines: list[list[object]] = [[*(field.name for field in fields(TreeRow)), *places]]
    for row, T in zip(as_mapping(table)["rows"], table.T_frame_link[:, :3].tolist(), strict=True):
        own = [csv_cell(value) if isinstance(value, str) else value for value in row.values()]
        lines.append([*own, *(x for line in T for x in line)])
    return csv_text(lines)


def _heads(table: TreeParameters, units: Units) -> list[str]:
    angle, length = units.angle_name, units.length_name
    heads = ["j", "joint", "a(j)", "sigma", f"gamma [{angle}]", f"b [{length}]", f"alpha [{angle}]"]
    heads += [f"d [{length}]", f"theta [{angle}]", f"r [{length}]"]
    return [*heads, f"beta [{angle}]"] if _bent(table) else heads


def _cells(table: TreeParameters, j: int, units: Units, shown: Callable[[str], str]) -> list[str]:
    row = table.rows[j]
    theta, r = units.angle(row.theta), units.length(row.r)
    # A follower's own offset is part of its constant, as in the other tables.
    leader = shown(row.leader)
    own = f"q({leader})" if row.leader == row.joint else f"{row.multiplier:.10g} q({leader})"
    if row.sigma == 0:
        theta = added(own, units.angle(row.theta + row.offset))
    elif row.sigma == 1:
        r = added(own, units.length(row.r + row.offset))
    cells = [str(j + 1), shown(row.joint), str(row.antecedent + 1), str(row.sigma), units.angle(row.gamma)]
    cells += [units.length(row.b), units.angle(row.alpha), units.length(row.d), theta, r]
    return [*cells, units.angle(row.beta)] if _bent(table) else cells


def _bent(table: TreeParameters) -> bool:
    return any(row.beta for row in table.rows)
