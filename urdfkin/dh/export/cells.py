"""What the written forms share: headings, cells with their variable, transforms, the formula.

Nothing here knows a format; each form passes its own way to write pi, products and names.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from urdfkin.dh.row import Convention, DHRow
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.model.tree import FloatArray

FORMULA = {
    Convention.STANDARD: "T(i-1, i) = Rz(theta) Tz(d) Tx(a) Rx(alpha)",
    Convention.MODIFIED: "T(i-1, i) = Tx(a(i-1)) Rx(alpha(i-1)) Rz(theta) Tz(d)",
}
HAYATI_FORMULA = {
    Convention.STANDARD: "T(i-1, i) = Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)",
    Convention.MODIFIED: "T(i-1, i) = Tx(a(i-1)) Rx(alpha(i-1)) Ry(beta(i-1)) Rz(theta) Tz(d)",
}

#: Of a bound's last digit: what is beyond it by no more is rounding, and not rounded up.
_ON_THE_DIGIT = 1.0 - 1e-12


def formula(table: DHTable) -> str:
    """The product that a row stands for."""
    return (HAYATI_FORMULA if table.has_hayati_rows else FORMULA)[table.convention]


def variable(
    table: DHTable,
    row: DHRow,
    times: str = " ",
    name: str = "q{}",
    number: Callable[[float], str] = "{:.10g}".format,
) -> str:
    """The joint's value in terms of the table's coordinates: q1, -q2, 2 q1 + 0.1."""
    leader = row.mimic.leader if row.mimic else row.joint
    q = name.format(table.joint_names.index(leader) + 1)
    multiplier = row.sense * (row.mimic.multiplier if row.mimic else 1.0)
    return {1.0: q, -1.0: f"-{q}"}.get(multiplier, f"{number(multiplier)}{times}{q}")


def coordinate_names(table: DHTable, shown: Callable[[str], str] = str) -> str:
    """Which coordinate is whose, where that is not row by row."""
    if [row.joint for row in table.rows] == list(table.joint_names):
        return ""
    return "with " + ", ".join(f"q{i} = {shown(name)}" for i, name in enumerate(table.joint_names, 1))


def constant_of(row: DHRow) -> float:
    """What is added to the variable: the cell and the follower's own offset."""
    cell = row.theta if row.kind.turns else row.d
    return cell + row.sense * row.mimic.offset if row.mimic else cell


def added(variable: str, constant: str) -> str:
    """`variable + constant` without zero terms and double signs."""
    if constant == "0":
        return variable
    return f"{variable} - {constant[1:]}" if constant.startswith("-") else f"{variable} + {constant}"


def cells(table: DHTable, row: DHRow, units: Units, pi: str = "pi", **style: Any) -> list[str]:
    """a, alpha, d, theta and, if any row needs it, beta, with the variable where it belongs."""
    moves = variable(table, row, **style)
    theta, d = units.angle(row.theta, pi), units.length(row.d)
    if row.kind.turns:
        theta = added(moves, units.angle(constant_of(row), pi))
    else:
        d = added(moves, units.length(constant_of(row)))
    named = {"a": units.length(row.a), "alpha": units.angle(row.alpha, pi), "d": d, "theta": theta}
    texts = [named[name] for name in units.columns]
    return [*texts, units.angle(row.beta, pi)] if table.has_hayati_rows else texts


def headings(table: DHTable, units: Units) -> list[str]:
    """Names of the columns of `cells`, with units."""
    at = "(i-1)" if table.convention is Convention.MODIFIED else ""
    angle, length = units.angle_name, units.length_name
    named = {
        "a": f"a{at} [{length}]",
        "alpha": f"alpha{at} [{angle}]",
        "d": f"d [{length}]",
        "theta": f"theta [{angle}]",
    }
    names = [named[name] for name in units.columns]
    return [*names, f"beta{at} [{angle}]"] if table.has_hayati_rows else names


def is_identity(T: FloatArray) -> bool:
    """Whether a pose is the identity to the bit."""
    return bool(np.array_equal(T, np.eye(4)))


def pose_lines(T: FloatArray, digits: int = 10) -> list[str]:
    """The three upper rows of a pose, aligned, in metres."""
    texts = [[f"{x + 0.0:.{digits}g}" for x in row] for row in T[:3]]
    widths = [max(len(row[i]) for row in texts) for i in range(4)]
    return ["  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in texts]


def at_most(value: float) -> str:
    """A bound with three digits, rounded up so that it stays one.

    Example:
        >>> at_most(7.5912e-06), at_most(0.0)
        ('7.60e-06', '0')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.ceil(value / unit * _ON_THE_DIGIT) * unit:.2e}"


def snap_lines(table: DHTable, bullet: str = "  ") -> list[str]:
    """What was snapped, in sentences, then a line for each change."""
    snap = table.snap
    if snap is None:
        return []
    if not snap.changes:
        return [f"Snapped within {snap.tolerance:.3g} rad: nothing had to move."]
    metres, radians = at_most(snap.metres), at_most(snap.radians)
    measured = f"{snap.measured_metres:.2e} m and {snap.measured_radians:.2e} rad"
    lines = [
        f"Snapped within {snap.tolerance:.3g} rad: the tip moves by at most {metres} m and turns by at most",
        f"{radians} rad, guaranteed within the limits of sliding joints",
        f"({measured} measured on {snap.samples} samples).",
    ]
    for change in snap.changes:
        n = len(table.rows)
        row = "base" if change.row < 0 else "tool" if change.row >= n else f"row {change.row + 1}"
        moved = f"turned {change.angle:.2e} rad, tip at most {at_most(change.tip)} m"
        lines.append(f"{bullet}{row}: {change.what}, {moved}")
    return lines
