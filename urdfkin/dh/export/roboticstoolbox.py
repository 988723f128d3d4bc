"""Python code for roboticstoolbox: a `DHRobot` of Revolute and Prismatic links, DH or MDH."""

from __future__ import annotations

import math

from urdfkin.dh.export.code import header, is_coupled, numbers, plain
from urdfkin.dh.row import Convention, DHRow
from urdfkin.dh.snapping import LARGEST_TOLERANCE
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors import InputError
from urdfkin.kinematics.roundings import EPS


def write(table: DHTable, units: Units) -> str:
    """A module with `robot`, a DHRobot.

    Raises:
        InputError: a Hayati row or a follower, which DHRobot cannot hold.
    """
    del units
    where = f"table of {table.robot}"
    if table.has_hayati_rows:
        longest = max(table.rows, key=lambda row: row.foot)
        tilt = max(math.hypot(math.sin(row.alpha), math.sin(row.beta)) for row in table.rows if row.beta)
        snap = 10.0 ** math.ceil(math.log10(tilt))
        rounding = "snap (--snap), which says what it moves,"
        if snap <= LARGEST_TOLERANCE:
            rounding = f"snap={snap:.0e} (--snap {snap:.0e}), which says what it moves,"
        raise InputError(
            "DHRobot has no fifth parameter for the table's Hayati rows",
            where=where,
            found=f"beta = {longest.beta:.3g} rad in the row of {longest.joint}",
            remedy=f"make the table with {rounding} or use the NumPy form; near_parallel='strict' would need"
            f" d = {longest.foot:.2g} m there, whose rounding is {EPS * longest.foot * 1e3:.1g} mm",
        )
    if is_coupled(table):
        raise InputError(
            "DHRobot has no joint that follows another",
            where=where,
            remedy="load with mimic off, or use the NumPy form",
        )
    lines = ['"""' + header(table)[0] + ".", "", *(f"{line}." for line in header(table)[1:]), '"""', ""]
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
    flip = ", flip=True" if row.sense < 0 else ""
    return f"rtb.{kind}{suffix}({constant}, a={row.a!r}, alpha={row.alpha!r}, offset={offset!r}{flip})"
