"""Python code for roboticstoolbox: a `DHRobot` of Revolute and Prismatic links, DH or MDH, with their limits.

A DHRobot has no fifth parameter, and one joint at least. A table with Hayati rows, or with none, is a `Robot`
of elementary transforms.
"""

from __future__ import annotations

from urdfkin.dh.export import ets
from urdfkin.dh.export.code import demand_free, docstring, numbers, plain
from urdfkin.dh.row import Convention, DHRow
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units


def write(table: DHTable, units: Units) -> str:
    """A module with `robot`, a DHRobot, or a Robot where that cannot hold the table.

    Raises:
        InputError: a follower, which neither of them can hold.
    """
    if table.has_hayati_rows or not table.rows:
        return ets.write(table, units)
    demand_free(table, "DHRobot")
    lines = docstring(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "", "robot = rtb.DHRobot(", "    ["]
    lines += [f"        {_link(row, table.convention)}," for row in table.rows]
    lines += ["    ],", f'    name="{plain(table.robot)}",']
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines.append(f"    {what}=np.array([{numbers(T.ravel())}]).reshape(4, 4),")
    return "\n".join([*lines, ")"]) + "\n"


def _link(row: DHRow, convention: Convention) -> str:
    suffix = "DH" if convention is Convention.STANDARD else "MDH"
    kind, constant, offset = (
        ("Revolute", f"d={row.d!r}", row.theta)
        if row.kind.turns
        else ("Prismatic", f"theta={row.theta!r}", row.d)
    )
    given = [constant, f"a={row.a!r}", f"alpha={row.alpha!r}", f"offset={offset!r}"]
    return f"rtb.{kind}{suffix}({', '.join([*given, *ets.joint(row)])})"
