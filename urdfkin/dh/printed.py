"""Compute the tip error due to the rounding of numbers in a printed table."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.export.text import at_most, constant_of
from urdfkin.dh.snapping import SAMPLES, samples_within_limits
from urdfkin.dh.table import DHRow, DHTable, is_identity
from urdfkin.dh.tree_parameters import TreeParameters, TreeRow
from urdfkin.dh.units import Units, cell_in_si, read_number
from urdfkin.model.configuration import TRAVEL_CONDITION, axis_range, largest_value
from urdfkin.model.tree import FloatArray


@dataclass(frozen=True, slots=True)
class PrintedPrecision:
    """Tip error of a printed table on samples; `bound` (m) is guaranteed within the joint limits.

    If `unlimited` is true, a prismatic joint has no limits. The error and the bound then assume a travel of
    at most `WIDEST`.
    """

    digits: int
    metres: float
    bound: float | None
    samples: int
    unlimited: bool = False

    def __str__(self) -> str:
        proven = "" if self.bound is None else f"; the proven bound is {at_most(self.bound)} m"
        condition = f"; this holds if {TRAVEL_CONDITION}" if self.unlimited else ""
        return (
            f"printed with {self.digits} digits, the table gives the tip within {at_most(self.metres)} m"
            f" of its exact position on {self.samples} samples{proven}{condition}"
        )


def printed(table: DHTable, units: Units, pose_digits: int | None = None) -> PrintedPrecision:
    """Return the tip error of a printed table with `pose_digits` significant digits in base and tool."""
    rows = tuple(_printed_row(row, units) for row in table.rows)
    base, tool = (_printed_pose(T, pose_digits or units.digits) for T in (table.base, table.tool))
    q = samples_within_limits(table)
    # DHTable rejects coarsely rounded rotations, so the printed base and tool are multiplied separately.
    T_0_n = replace(table, rows=rows, base=np.eye(4), tool=np.eye(4)).placement(q)
    distances = np.linalg.norm((base @ T_0_n @ tool - table.placement(q))[:, :3, 3], axis=-1)
    bound = _bound(table, rows, base, tool)
    finite_bound = bound if math.isfinite(bound) else None
    measured, unlimited = float(distances.max(initial=0.0)), bool(table.unlimited)
    return PrintedPrecision(units.digits, measured, finite_bound, SAMPLES, unlimited)


def _printed_row(row: DHRow, units: Units) -> DHRow:
    rule = row.mimic
    mimic_offset = row.sense * rule.offset if rule else 0.0  # The printed constant includes this offset.
    if row.kind.turns:
        theta, d = _angle(constant_of(row), units) - mimic_offset, _length(row.d, units)
    else:
        theta, d = _angle(row.theta, units), _length(constant_of(row), units) - mimic_offset
    if rule is not None:
        rule = replace(rule, multiplier=float(f"{rule.multiplier:.10g}"))
    a, alpha, beta = _length(row.a, units), _angle(row.alpha, units), _angle(row.beta, units)
    return replace(row, a=a, alpha=alpha, d=d, theta=theta, beta=beta, mimic=rule)


def _angle(radians: float, units: Units) -> float:
    text = units.angle(radians)
    number = read_number(text, "printed")
    return number if "pi" in text else cell_in_si("theta", number, units)


def _length(metres: float, units: Units) -> float:
    return cell_in_si("d", read_number(units.length(metres), "printed"), units)


def _printed_pose(T: FloatArray, digits: int) -> FloatArray:
    return T if is_identity(T) else np.array([[float(f"{x:.{digits}g}") for x in row] for row in T])


def _bound(table: DHTable, rows: tuple[DHRow, ...], base: FloatArray, tool: FloatArray) -> float:
    """Return a bound (m) of the tip error that the rounded numbers of a printed table cause together.

    The rounding error of an angle moves the tip by at most this error times `lever`. The length `lever` is an
    upper bound of the distance from the row's frame to the tip.
    """
    lever = float(np.linalg.norm(table.tool[:3, 3]))
    total = float(np.linalg.norm((tool - table.tool)[:3, 3]))
    for row, printed_row in zip(reversed(table.rows), reversed(rows), strict=True):
        lever += abs(row.a) + abs(row.d) + (0.0 if row.kind.turns else largest_value(row.limit))
        if row.mimic is not None and printed_row.mimic is not None:
            largest = max(map(abs, axis_range(row.kind, row.limit)))
            multiplier_error = abs(row.mimic.multiplier - printed_row.mimic.multiplier)
            total += multiplier_error * largest * max(lever, 1.0)
        errors = np.abs(np.subtract(row.cells, printed_row.cells))
        total += float(errors[[0, 2]].sum() + errors[[1, 3, 4]].sum() * lever)
    base_error = base - table.base
    rotation_error = float(np.linalg.norm(base_error[:3, :3]))
    total = total * (1.0 + rotation_error) + rotation_error * lever + float(np.linalg.norm(base_error[:3, 3]))
    return total + table.rounding(np.zeros(len(table.joint_names))).item()


def printed_tree(table: TreeParameters, units: Units, q: FloatArray) -> PrintedPrecision:
    """Compare the link positions of a printed and an exact table at `q` (n, coordinates)."""
    again = replace(table, rows=tuple(_printed_tree_row(row, units) for row in table.rows))
    distances = np.linalg.norm((again.placements(q) - table.placements(q))[..., :3, 3], axis=-1)
    return PrintedPrecision(units.digits, float(distances.max(initial=0.0)), None, len(q))


def _printed_tree_row(row: TreeRow, units: Units) -> TreeRow:
    theta_offset, r_offset = (row.offset if row.sigma == kind else 0.0 for kind in (0, 1))
    return replace(
        row,
        gamma=_angle(row.gamma, units),
        b=_length(row.b, units),
        alpha=_angle(row.alpha, units),
        d=_length(row.d, units),
        beta=_angle(row.beta, units),
        theta=_angle(row.theta + theta_offset, units) - theta_offset,
        r=_length(row.r + r_offset, units) - r_offset,
        multiplier=float(f"{row.multiplier:.10g}"),
    )
