"""What a table loses by being written with so many digits: read again from its text, against the exact one.

Every angle that is written rounded turns what lies beyond, at a lever of all later lengths at most; every
length shifts it. These add up to a bound that holds for every configuration within the limits; what is
measured is the largest distance on samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.export.text import at_most, constant_of
from urdfkin.dh.snapping import SAMPLES, range_of, travel, values_within
from urdfkin.dh.table import DHRow, DHTable
from urdfkin.dh.tree_parameters import TreeParameters, TreeRow
from urdfkin.dh.units import Units, cell_in_si, read_number
from urdfkin.model.tree import FloatArray


@dataclass(frozen=True, slots=True)
class PrintedPrecision:
    """What the digits lose.

    Attributes:
        digits: How many there are.
        metres: The largest distance between the tips, as printed and exact, on the samples.
        bound: Metres that no configuration within the limits exceeds; None where nothing is guaranteed.
        samples: How many.
    """

    digits: int
    metres: float
    bound: float | None
    samples: int

    def __str__(self) -> str:
        guaranteed = "" if self.bound is None else f", at most {at_most(self.bound)} m"
        return (
            f"as printed, with {self.digits} digits: within {at_most(self.metres)} m of the exact table on"
            f" {self.samples} samples{guaranteed}"
        )


def printed(table: DHTable, units: Units, pose_digits: int | None = None) -> PrintedPrecision:
    """Read a table's printed form again and hold it against the table.

    Args:
        table: The table.
        units: In which it is printed.
        pose_digits: Digits of base and tool, if others.
    """
    digits = pose_digits or units.digits
    rows = tuple(_row(row, units) for row in table.rows)
    base, tool = (_pose(T, digits) for T in (table.base, table.tool))
    bounds = {row.joint: range_of(row) for row in table.rows if row.mimic is None}
    q = values_within(bounds, table.joint_names, SAMPLES)
    # Rounded entries are no rotation: base and tool are multiplied on as they are printed.
    between = replace(table, rows=rows, base=np.eye(4), tool=np.eye(4)).placement(q)
    off = np.linalg.norm((base @ between @ tool - table.placement(q))[:, :3, 3], axis=-1)
    bound = _bound(table, rows, base, tool)
    worst = float(off.max(initial=0.0))
    return PrintedPrecision(units.digits, worst, bound if math.isfinite(bound) else None, SAMPLES)


def _row(row: DHRow, units: Units) -> DHRow:
    """The row as its text says."""
    a, alpha, d, theta, beta = row.cells
    rule = row.mimic
    own = row.sense * rule.offset if rule else 0.0  # the text has it in the constant
    constant = constant_of(row)
    theta, d = (
        (_angle(constant, units) - own, _length(d, units))
        if row.kind.turns
        else (_angle(theta, units), _length(constant, units) - own)
    )
    if rule is not None:
        rule = replace(rule, multiplier=float(f"{rule.multiplier:.10g}"))
    return replace(
        row,
        a=_length(a, units),
        alpha=_angle(alpha, units),
        d=d,
        theta=theta,
        beta=_angle(beta, units),
        mimic=rule,
    )


def _angle(radians: float, units: Units) -> float:
    text = units.angle(radians)
    number = read_number(text, "printed")
    return number if "pi" in text else cell_in_si("theta", number, units)


def _length(metres: float, units: Units) -> float:
    return cell_in_si("d", read_number(units.length(metres), "printed"), units)


def _pose(T: FloatArray, digits: int) -> FloatArray:
    if np.array_equal(T, np.eye(4)):
        return T
    return np.array([[float(f"{x:.{digits}g}") for x in row] for row in T])


def _bound(table: DHTable, rows: tuple[DHRow, ...], base: FloatArray, tool: FloatArray) -> float:
    """All changes, each with the longest lever that it may have."""
    lever = float(np.linalg.norm(table.tool[:3, 3]))
    total = float(np.linalg.norm((tool - table.tool)[:3, 3]))
    for row, other in zip(reversed(table.rows), reversed(rows), strict=True):
        slides = 0.0 if row.kind.turns else travel(row.limit)
        lever += abs(row.a) + abs(row.d) + slides
        if row.mimic is not None and other.mimic is not None:
            slides = max(abs(bound) for bound in range_of(row))
            total += abs(row.mimic.multiplier - other.mimic.multiplier) * slides * max(lever, 1.0)
        changes = np.abs(np.subtract(row.cells, other.cells))
        total += float(changes[[0, 2]].sum() + changes[[1, 3, 4]].sum() * lever)
    turned, shifted = (base - table.base)[:3, :3], (base - table.base)[:3, 3]
    stretched = 1.0 + float(np.linalg.norm(turned))
    total = total * stretched + float(np.linalg.norm(turned)) * lever + float(np.linalg.norm(shifted))
    return total + table.rounding(np.zeros(len(table.joint_names))).item()


def printed_tree(table: TreeParameters, units: Units, q: FloatArray) -> PrintedPrecision:
    """What the digits of a whole robot's parameters lose, at its worst link.

    Args:
        table: The parameters.
        units: In which they are printed.
        q: (n, coordinates) where to look.
    """
    again = replace(table, rows=tuple(_tree_row(row, units) for row in table.rows))
    off = np.linalg.norm((again.placements(q) - table.placements(q))[..., :3, 3], axis=-1)
    return PrintedPrecision(units.digits, float(off.max(initial=0.0)), None, len(q))


def _tree_row(row: TreeRow, units: Units) -> TreeRow:
    theta, r = row.theta, row.r
    turns, slides = (row.offset if row.sigma == kind else 0.0 for kind in (0, 1))
    return replace(
        row,
        gamma=_angle(row.gamma, units),
        b=_length(row.b, units),
        alpha=_angle(row.alpha, units),
        d=_length(row.d, units),
        beta=_angle(row.beta, units),
        theta=_angle(theta + turns, units) - turns,
        r=_length(r + slides, units) - slides,
        multiplier=float(f"{row.multiplier:.10g}"),
    )
