"""Result of a comparison of a table with a URDF, and its text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from urdfkin.dh.export.text import format_sum, pose_matrix
from urdfkin.dh.table import DHRow, DHTable, nearest_twelfth
from urdfkin.dh.units import Units
from urdfkin.errors import QuestionsSection
from urdfkin.errors.display import Matrix, Table, TextDocument
from urdfkin.kinematics.roundings import EPS, fitted_table_roundings
from urdfkin.model.configuration import ASSUMED_LIMIT
from urdfkin.model.tree import Limit, is_bounded

Parts = list[str | Table | Matrix]

#: After a correction of cells, tip errors up to this number count as zero (rad, or m per m of reach). The
#: rounding errors of a fit are far below this number, and those of data sheets far above.
NEGLIGIBLE_ERROR = 1e-9
#: `fit_resolution` increases smaller tip errors to this number (rad, or metres per metre of reach).
_MIN_TIP_ERROR = 1e-12
#: Factor of half a digit, above 1 because doubles cannot represent most decimal numbers exactly.
_HALF_DIGIT_MARGIN = 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class CellDifference:
    """A cell that differs from the URDF.

    Values are in m or rad.

    Attributes:
        row: Index of the row, from 0.
        tip_displacement: Largest distance (m) by which a correction of this cell moves the tip, on samples.
        half_digit: Half a unit of the last digit of `reference`.
            0 for an exact value, and for a value without text.
    """

    row: int
    joint: str
    cell: str
    reference: float
    urdf: float
    tip_displacement: float
    half_digit: float = 0.0

    @property
    def difference(self) -> float:
        return self.urdf - self.reference

    @property
    def is_rounding(self) -> bool:
        return abs(self.difference) <= self.half_digit * _HALF_DIGIT_MARGIN

    @property
    def is_length(self) -> bool:
        return self.cell in ("a", "d")

    def format_value(self, value: float, units: Units) -> str:
        return units.format_length(value) if self.is_length else units.format_angle(value)


@dataclass(frozen=True, slots=True)
class AbsorbedOffset:
    """Change of base or tool by a fit."""

    metres: float
    radians: float


class MistakeKind(StrEnum):
    SIGN = "sign"
    RIGHT_ANGLE = "right angle"
    EXCHANGED = "rows exchanged"
    REVERSED = "rows reversed"


@dataclass(frozen=True, slots=True)
class FitChanges:
    """The parameters that a fit changes.

    Attributes:
        zeros: Number of changed joint offsets.
        reversed: Number of changed joint signs.
    """

    base: bool = False
    tool: bool = False
    zeros: int = 0
    reversed: int = 0

    @property
    def count(self) -> int:
        return self.base + self.tool + self.zeros + self.reversed

    def __str__(self) -> str:
        ends = [name for name, fitted in (("base", self.base), ("tool", self.tool)) if fitted]
        joints = ((self.zeros, "zero"), (self.reversed, "sense"))
        counted = [f"{count} {name}{'s' * (count > 1)} of joints" for count, name in joints if count]
        return ", ".join([*ends, *counted]) or "nothing"


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """A likely mistake in a table.

    Attributes:
        rows: Indices of the wrong rows, from 0.
        cell: The wrong cell; None if the order of rows is wrong.
        table: The corrected table.
        fit_changes: Parameters that a fit of the corrected table changed.
        metres, radians: Largest tip errors of the corrected and fitted table, on samples.
    """

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: CellDifference | None
    table: DHTable
    fit_changes: FitChanges
    metres: float
    radians: float


@dataclass(frozen=True, slots=True, eq=False)
class TableComparison:
    """Result of a comparison of a table with a URDF.

    Attributes:
        fitted_table: The fitted table, with the URDF's joint names and coordinates.
        travel: Sum of the prismatic joints' largest absolute values, m.
        senses: Signs of the joints.
            The table's variable is sign * q + offset.
        metres, radians: Largest tip errors on samples, after the fit if `is_fitted`.
        metres_bound, radians_bound: Proven bounds, without rounding errors.
            The bounds hold for all angles, and for displacements within the limits.
            Without limits, a prismatic joint is assumed within 10 m of zero.
        unfitted_metres, unfitted_radians: Tip errors without a fit.
        unfitted_differences: Cells to change, so that the table agrees with the URDF without a fit.
            Empty if `is_fitted` is false, if `mistakes` is not empty, or if a tip error remains.
            Empty if more than len(differences) + 2 cells must change.
        not_compared: Row index and name of each cell that a fit cannot check, because a change of base, tool
            or joint offsets has the same effect.
        residual: Tip error after cell corrections, m.
    """

    fitted_table: DHTable
    reach: float
    travel: float
    is_fitted: bool
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: AbsorbedOffset
    tool: AbsorbedOffset
    metres: float
    radians: float
    metres_bound: float
    radians_bound: float
    unfitted_metres: float
    unfitted_radians: float
    differences: tuple[CellDifference, ...]
    unfitted_differences: tuple[CellDifference, ...]
    not_compared: tuple[tuple[int, str], ...]
    mistakes: tuple[Mistake, ...]
    residual: float
    tolerance: float
    samples: int

    @property
    def agrees(self) -> bool:
        """Whether the fitted table's tip error is within `tolerance` on samples.

        Angles are multiplied by the reach.
        """
        return self.metres <= self.tolerance and self.radians * self.reach <= self.tolerance

    @property
    def agrees_without_mistakes(self) -> bool:
        return self.agrees and not self.mistakes

    @property
    def rounding_error(self) -> float:
        """Largest tip error due to rounding (rad, or m per m of reach and travel)."""
        return EPS * fitted_table_roundings(len(self.fitted_table.rows))

    @property
    def rounding_error_metres(self) -> float:
        """Largest rounding error of position, m."""
        return self.rounding_error * (self.reach + self.travel)

    @property
    def resolution(self) -> float:
        """Rounding step of fitted numbers (rad, or m per m of reach)."""
        return fit_resolution(self.metres / self.reach, self.radians)

    @property
    def is_exact(self) -> bool:
        """Whether table and URDF provably differ only by rounding.

        The proof has the conditions of `metres_bound`: prismatic joints stay within their limits, or within
        10 m of zero if they have no limits.
        """
        return self.metres_bound <= self.rounding_error_metres and self.radians_bound <= self.rounding_error

    @property
    def range_condition(self) -> str:
        """Assumption about prismatic joints without limits."""
        rows = self.fitted_table.rows
        free = [row.joint for row in rows if not row.kind.turns and not has_range(row.limit)]
        return f"{', '.join(free)} within {ASSUMED_LIMIT:g} m of zero" if free else ""

    @property
    def is_exact_unfitted(self) -> bool:
        """Whether rounding explains the tip errors without a fit."""
        return (
            self.unfitted_metres <= self.rounding_error_metres
            and self.unfitted_radians <= self.rounding_error
        )


def has_range(limit: Limit | None) -> bool:
    """Return whether both limits are finite, and lower < upper.

    If the limits are equal, poses do not show the joint's positive direction. Both limits are 0 if a URDF
    omits them.
    """
    return is_bounded(limit) and limit.lower < limit.upper


def fit_resolution(relative_error: float, radians: float) -> float:
    """Return the rounding step of fitted numbers: a power of ten, such as 1e-4.

    `relative_error` is in m per m of reach.
    """
    return float(10.0 ** math.ceil(math.log10(2.0 * max(relative_error, radians, _MIN_TIP_ERROR))))


def comparison_document(comparison: TableComparison, units: Units) -> TextDocument:
    title, *verdict = _verdict_lines(comparison)
    parts: Parts = [
        *verdict,
        *(_mistake_lines(comparison, units) if comparison.mistakes else _cell_parts(comparison, units)),
    ]
    if comparison.residual > NEGLIGIBLE_ERROR * comparison.reach and not comparison.mistakes:
        parts.append(
            f"No change of cells explains the whole difference: {comparison.residual * 1e3:.3g} mm remain"
            " unexplained."
        )
        if not comparison.is_fitted:
            parts.append(
                "The table may have a different base frame or tool. Omit --no-fit to fit base and tool."
            )
    if comparison.agrees or not comparison.mistakes:
        parts += _fit_parts(comparison, units)
    if not comparison.agrees:
        parts += ["", str(QuestionsSection.DH_AND_URDF_DISAGREE)]
    return TextDocument(title, parts)


def _fit_parts(comparison: TableComparison, units: Units) -> Parts:
    parts: Parts = []
    table, fine = comparison.fitted_table, comparison.resolution
    variables = [
        f"  {row.joint}: {format_sum('-q' if sense < 0 else 'q', _format_offset(offset, row, fine, units))}"
        for row, sense, offset in zip(table.rows, comparison.senses, comparison.offsets, strict=True)
        if sense < 0 or abs(offset) > fine
    ]
    if variables:
        parts += ["", "Joint variables of the table (q is the URDF's joint value):", *variables]
    for what, T in (("base", table.base), ("tool", table.tool)):
        rounded = np.round(T / fine) * fine
        if np.abs(rounded - np.eye(4)).max() > fine:
            parts += ["", f"{what} (metres):", pose_matrix(rounded, 6)]
    return parts


def _verdict_lines(comparison: TableComparison) -> list[str]:
    table = comparison.fitted_table
    path = f"{table.robot}, {table.base_frame} to {table.tip_frame}"
    agrees = "agrees only" if comparison.mistakes else "agrees exactly" if comparison.is_exact else "agrees"
    verdict = agrees if comparison.agrees else "DIFFERS"
    error = _format_tip_error(comparison.metres, comparison.radians)
    condition = f", with {comparison.range_condition}" if comparison.range_condition else ""
    values = f"for all joint values within limits{condition}"
    proof = f"{comparison.samples} samples; proven bound {values}: {_format_bound(comparison)}"
    if comparison.is_exact_unfitted:
        return [f"The table {verdict} without a fit: {path}: {error}", f"({proof})."]
    if not comparison.is_fitted:
        return [
            f"The table {verdict}: {path}: {error}",
            f"({proof}; base, tool and joint variables are not fitted).",
        ]
    fine, ends = comparison.resolution, (comparison.base, comparison.tool)
    changes = [
        f"{what} by {_format_errors(end.metres, end.radians)}"
        for what, end in zip(("the base", "the tool"), ends, strict=True)
        if end.metres > comparison.rounding_error_metres or end.radians > comparison.rounding_error
    ]
    zeros = sum(abs(offset) > fine for offset in comparison.offsets)
    reversed_ = sum(sense < 0 for sense in comparison.senses)
    if zeros:
        changes.append(f"the zeros of {zeros} joint{'s' * (zeros > 1)} (listed below)")
    if reversed_:
        s = "s" * (reversed_ > 1)
        changes.append(f"the sign{s} of {reversed_} joint{s} (listed below)")
    after_fit = "after a fit of base, tool and joint offsets"
    once = f" {after_fit}" if comparison.agrees and changes else ""
    fitted = "" if comparison.agrees else f"; {after_fit}"
    lines = [f"The table {verdict}{once}: {path}: {error}", f"({proof}{fitted})."]
    lines.append(
        f"Without a fit, {_format_tip_error(comparison.unfitted_metres, comparison.unfitted_radians)}."
    )
    if changes:
        lines.append(
            f"The fit changed {', '.join(changes)}. Use --no-fit to compare the table without a fit."
        )
        both_ends = all(max(end.metres / comparison.reach, end.radians) > fine for end in ends)
        if comparison.agrees and not comparison.mistakes and (both_ends or zeros or reversed_):
            lines.append(
                "These changes can hide a wrong sign. To find a wrong sign, write the true base, tool and"
                " joint offsets into the table."
            )
    return lines


def _format_errors(metres: float, radians: float) -> str:
    return f"{metres * 1e3:.3g} mm and {radians:.3g} rad"


def _format_tip_error(metres: float, radians: float) -> str:
    return f"the tip is off by up to {_format_errors(metres, radians)}"


def _format_bound(comparison: TableComparison) -> str:
    if comparison.is_exact:
        return "only rounding errors"
    return (
        "none"
        if math.isinf(comparison.metres_bound)
        else _format_errors(comparison.metres_bound, comparison.radians_bound)
    )


def _mistake_lines(comparison: TableComparison, units: Units) -> list[str]:
    first = comparison.mistakes[0]
    remaining_fit = (
        "without a fit" if not first.fit_changes.count else f"after a fit of only {first.fit_changes}"
    )
    subject = "One change makes" if len(comparison.mistakes) == 1 else "Each of these changes makes"
    lines = ["", f"{subject} the table right {remaining_fit}:"]
    for mistake in comparison.mistakes:
        error = _format_tip_error(mistake.metres, mistake.radians)
        lines.append(f"  {_format_correction(mistake, comparison.fitted_table, units)}; {error}")
    if comparison.agrees:
        lines.append(
            "Correct the table. If the fitted base, tool and zeros are intended, write them into the table."
        )
    return lines


def _format_correction(mistake: Mistake, table: DHTable, units: Units) -> str:
    if mistake.cell is None:
        if mistake.kind is MistakeKind.REVERSED:
            return "the rows in reverse order"
        return f"rows {' and '.join(str(row + 1) for row in mistake.rows)} exchanged"
    cell = mistake.cell
    unit = units.length_name if cell.is_length else units.angle_name
    why = "its sign" if mistake.kind is MistakeKind.SIGN else "a right angle"
    row = f"row {cell.row + 1}, {table.rows[cell.row].joint}"
    right, wrong = (cell.format_value(value, units) for value in (cell.urdf, cell.reference))
    return f"{row}: {cell.cell} = {right} {unit}, not {wrong} ({why})"


def _cell_parts(comparison: TableComparison, units: Units) -> Parts:
    unit = f"({units.length_name}, {units.angle_name})"
    parts: Parts = []
    if comparison.differences:
        parts += ["", f"Cells that differ {unit}:", _difference_table(comparison.differences, units)]
        rounded = sum(one.is_rounding for one in comparison.differences)
        if rounded:
            count = (
                "All"
                if rounded == len(comparison.differences)
                else f"{rounded} of {len(comparison.differences)}"
            )
            be = "is" if rounded == 1 else "are"
            parts.append(
                "The difference is within the last digit of the table (*)."
                if len(comparison.differences) == 1
                else f"{count} differences {be} within the last digit of the table (*)."
            )
    elif comparison.is_exact_unfitted:
        parts.append("Every cell agrees with the URDF.")
    elif comparison.is_exact:
        parts.append(
            "After the fit of base, tool and joint offsets, every compared cell agrees with the URDF."
        )
    if comparison.not_compared and not comparison.is_exact_unfitted:
        cells = ", ".join(f"{cell}{row + 1}" for row, cell in comparison.not_compared)
        same = "a change of base, tool or joint offsets has the same effect"
        parts.append(f"These cells are not compared, because {same}: {cells}.")
    if {(one.row, one.cell) for one in comparison.unfitted_differences} - {
        (one.row, one.cell) for one in comparison.differences
    }:
        parts += ["", f"If these cells change {unit}, the table agrees without a fit:"]
        parts.append(_difference_table(comparison.unfitted_differences, units))
    return parts


def _difference_table(cells: Sequence[CellDifference], units: Units) -> Table:
    rows = []
    for one in cells:
        texts = (one.format_value(value, units) for value in (one.reference, one.urdf, one.difference))
        name = one.cell + "*" * one.is_rounding
        rows.append((str(one.row + 1), one.joint, name, *texts, f"{one.tip_displacement * 1e3:.3g}"))
    heads = ("row", "joint", "cell", "table", "URDF", "difference", "tip [mm]")
    return Table(heads, rows, left=(1,), names=(1,))


def _format_offset(offset: float, row: DHRow, fine: float, units: Units) -> str:
    """Round an offset to a multiple of `fine`, and format it.

    An angle within `fine` of a multiple of 15 degrees becomes this multiple.
    """
    if abs(offset) <= fine:
        return "0"
    if not row.kind.turns:
        return units.format_length(round(offset / fine) * fine)
    twelfth = nearest_twelfth(offset)
    return units.format_angle(twelfth if abs(offset - twelfth) <= fine else round(offset / fine) * fine)
