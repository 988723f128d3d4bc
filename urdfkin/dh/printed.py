"""Compute the tip error of a printed table, which is caused by the rounding of its numbers.

The rounding error of an angle rotates the rest of the chain. This rotation moves the tip by at most the error
times the sum of all later lengths. The rounding error of a length shifts the rest of the chain. The sum of
these effects is a bound of the tip error for every configuration within the limits. The module also computes
the largest error in sampled configurations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.export.text import at_most, constant_of
from urdfkin.dh.snapping import SAMPLES, UNKNOWN, travel
from urdfkin.dh.table import DHRow, DHTable
from urdfkin.dh.tree_parameters import TreeParameters, TreeRow
from urdfkin.dh.units import Units, cell_in_si, read_number
from urdfkin.model.configuration import axis_range, values_within
from urdfkin.model.tree import FloatArray


@dataclass(frozen=True, slots=True)
class PrintedPrecision:
    """The tip error of a printed table.

    Attributes:
        digits: Number of printed significant digits.
        metres: Largest distance, on samples, between the tips of the printed table and of the exact table.
        bound: Guaranteed bound (metres) of this distance at all joint values within the limits; None if there
            is no bound.
    """

    digits: int
    metres: float
    bound: float | None
    samples: int

    def __str__(self) -> str:
        proven = "" if self.bound is None else f"; the proven bound is {at_most(self.bound)} m"
        return (
            f"printed with {self.digits} digits, the table gives the tip within {at_most(self.metres)} m"
            f" of its exact position on {self.samples} samples{proven}"
        )


def printed(table: DHTable, units: Units, pose_digits: int | None = None) -> PrintedPrecision:
    """Parse the printed form of a table, and compare the printed table with the exact table.

    `pose_digits` are the significant digits of base and tool; None: as many digits as in `units`.
    """
    digits = pose_digits or units.digits
    rows = tuple(_row(row, units) for row in table.rows)
    base, tool = (_pose(T, digits) for T in (table.base, table.tool))
    bounds = {row.joint: axis_range(row.kind, row.limit) for row in table.rows if row.mimic is None}
    q = values_within([bounds.get(name, UNKNOWN) for name in table.joint_names], SAMPLES)
    # A DHTable accepts only exact rotations, so the rounded base and tool are multiplied separately.
    between = replace(table, rows=rows, base=np.eye(4), tool=np.eye(4)).placement(q)
    off = np.linalg.norm((base @ between @ tool - table.placement(q))[:, :3, 3], axis=-1)
    bound = _bound(table, rows, base, tool)
    worst = float(off.max(initial=0.0))
    return PrintedPrecision(units.digits, worst, bound if math.isfinite(bound) else None, SAMPLES)


def _row(row: DHRow, units: Units) -> DHRow:
    a, alpha, d, theta, beta = row.cells
    rule = row.mimic
    own = row.sense * rule.offset if rule else 0.0  # The printed constant includes this offset.
    constant = constant_of(row)
    theta, d = (
        (_angle(constant, units) - own, _length(d, units))
        if row.kind.turns
        else (_angle(theta, units), _length(constant, units) - own)
    )
    if rule is not None:
        rule = replace(rule, multiplier=float(f"{rule.multiplier:.10g}"))
    a, alpha, beta = _length(a, units), _angle(alpha, units), _angle(beta, units)
    return replace(row, a=a, alpha=alpha, d=d, theta=theta, beta=beta, mimic=rule)


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
    """Return the sum of the tip errors (metres) that the rounding of each number can cause.

    The rounding error of an angle is multiplied by the largest possible distance from the row's frame to the
    tip.
    """
    lever = float(np.linalg.norm(table.tool[:3, 3]))
    total = float(np.linalg.norm((tool - table.tool)[:3, 3]))
    for row, other in zip(reversed(table.rows), reversed(rows), strict=True):
        slides = 0.0 if row.kind.turns else travel(row.limit)
        lever += abs(row.a) + abs(row.d) + slides
        if row.mimic is not None and other.mimic is not None:
            slides = max(abs(bound) for bound in axis_range(row.kind, row.limit))
            total += abs(row.mimic.multiplier - other.mimic.multiplier) * slides * max(lever, 1.0)
        changes = np.abs(np.subtract(row.cells, other.cells))
        total += float(changes[[0, 2]].sum() + changes[[1, 3, 4]].sum() * lever)
    turned, shifted = (base - table.base)[:3, :3], (base - table.base)[:3, 3]
    stretched = 1.0 + float(np.linalg.norm(turned))
    total = total * stretched + float(np.linalg.norm(turned)) * lever + float(np.linalg.norm(shifted))
    return total + table.rounding(np.zeros(len(table.joint_names))).item()


def printed_tree(table: TreeParameters, units: Units, q: FloatArray) -> PrintedPrecision:
    """Return the error of a robot's printed parameters at `q` (n, coordinates), at the worst link."""
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
