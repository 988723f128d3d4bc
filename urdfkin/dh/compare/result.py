"""Store the result of comparing a table with a URDF, and write the result as text."""

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
from urdfkin.kinematics.roundings import EPS, fit_roundings
from urdfkin.model.configuration import ASSUMED_LIMIT
from urdfkin.model.tree import Limit, is_bounded

Parts = list[str | Table | Matrix]

#: Largest tip error (rad, or metres per metre of reach) that counts as zero after a correction of cells.
#: The rounding errors of a fit are far smaller, and those of numbers in data sheets are far larger.
EXPLAINED = 1e-9
#: `resolution` replaces a smaller tip error (rad, or metres per metre of reach) by this number.
_FINEST = 1e-12
#: This factor exceeds 1, because doubles cannot represent most decimal numbers exactly.
_HALF = 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class CellDifference:
    """One cell of a published table that differs from the URDF's value (metres or radians).

    Attributes:
        tip: Largest displacement (metres) of the tip on the samples if only this cell differs.
        last_digit: Half a unit of the last digit of `reference`; 0 if the value is exact or its text is
            unknown.
    """

    row: int
    joint: str
    cell: str
    reference: float
    urdf: float
    tip: float
    last_digit: float = 0.0

    @property
    def difference(self) -> float:
        return self.urdf - self.reference

    @property
    def is_rounding(self) -> bool:
        return abs(self.difference) <= self.last_digit * _HALF

    @property
    def is_length(self) -> bool:
        return self.cell in ("a", "d")

    def formatted(self, value: float, units: Units) -> str:
        return units.length(value) if self.is_length else units.angle(value)


@dataclass(frozen=True, slots=True)
class AbsorbedOffset:
    """Distance and angle by which the fit moved a table's base or tool."""

    metres: float
    radians: float


class MistakeKind(StrEnum):
    SIGN = "sign"
    RIGHT_ANGLE = "right angle"
    EXCHANGED = "rows exchanged"
    REVERSED = "rows reversed"


@dataclass(frozen=True, slots=True)
class Fitted:
    """Parameters that a fit must change; `zeros` and `reversed` are numbers of joints."""

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
    """A likely mistake in a table; after the mistake is corrected, a fit changes fewer parameters.

    `table`, `fitted` and the tip errors `metres` and `radians` are those after the correction.
    """

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: CellDifference | None
    table: DHTable
    fitted: Fitted
    metres: float
    radians: float


@dataclass(frozen=True, slots=True, eq=False)
class TableComparison:
    """Result of a comparison of a table with a URDF.

    Attributes:
        reference: The table with the URDF's joint names and with fitted base, tool, joint signs and joint
            offsets. The method `placement` of this table takes the URDF's joint coordinates.
        travel: Sum of the largest distances (m) of the prismatic joints from zero.
        senses: Sign of each joint, +1 or -1. The table's variable is sign * q + offset, where q is the URDF's
            joint value.
        metres, radians: Largest errors of the fitted table's tip on the samples.
        most_metres, most_radians: Proven upper bounds of the errors of the fitted table's tip for all angles,
            and for all displacements within limits. A prismatic joint without limits is assumed to be within
            10 m of zero. The bounds do not include rounding errors.
        written_metres, written_radians: Largest errors of the unfitted table's tip on the samples.
        instead: The cells that must change so that the table agrees without a fit. Empty if these cells are
            too many, or if a tip error remains after their correction.
        hidden: Row index and name of each cell whose error is hidden by a fit of base, tool and joint
            offsets.
        residual: Tip error (metres) that remains if the differing cells take the URDF's values.
    """

    reference: DHTable
    reach: float
    travel: float
    fitted: bool
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: AbsorbedOffset
    tool: AbsorbedOffset
    metres: float
    radians: float
    most_metres: float
    most_radians: float
    written_metres: float
    written_radians: float
    differences: tuple[CellDifference, ...]
    instead: tuple[CellDifference, ...]
    hidden: tuple[tuple[int, str], ...]
    mistakes: tuple[Mistake, ...]
    residual: float
    tolerance: float
    samples: int

    @property
    def agrees(self) -> bool:
        """Whether the tip error (angles multiplied by the reach) is within `tolerance` on all samples."""
        return self.metres <= self.tolerance and self.radians * self.reach <= self.tolerance

    @property
    def passes(self) -> bool:
        return self.agrees and not self.mistakes

    @property
    def rounding(self) -> float:
        """Largest tip error that rounding can cause, in radians, or in metres per metre of reach."""
        return EPS * fit_roundings(len(self.reference.rows))

    @property
    def rounding_metres(self) -> float:
        """Largest distance (m) between tips that rounding can cause; the displacements are also rounded."""
        return self.rounding * (self.reach + self.travel)

    @property
    def resolution(self) -> float:
        """The power of ten (radians, or metres per metre of reach) to which fitted numbers are rounded."""
        return resolution(self.metres / self.reach, self.radians)

    @property
    def exact(self) -> bool:
        """Whether the table is proven to differ from the URDF only by rounding.

        The proof covers the same joint values as `most_metres`.
        """
        return self.most_metres <= self.rounding_metres and self.most_radians <= self.rounding

    @property
    def condition(self) -> str:
        """The assumption about prismatic joints without limits, as text; empty if there are no such joints.

        A joint counts as a joint without limits if `has_range` is false.
        """
        rows = self.reference.rows
        free = [row.joint for row in rows if not row.kind.turns and not has_range(row.limit)]
        return f"{', '.join(free)} within {ASSUMED_LIMIT:g} m of zero" if free else ""

    @property
    def as_written(self) -> bool:
        """Whether the written table, with its base, tool and zeros, equals the URDF up to rounding."""
        return self.written_metres <= self.rounding_metres and self.written_radians <= self.rounding


def has_range(limit: Limit | None) -> bool:
    """Return whether a prismatic joint's limits are finite and allow more than one value.

    A comparison also moves a joint with equal limits: at a single value, the samples do not depend on the
    direction of the joint's axis. The default of both limits is 0, so a URDF may omit the limits.
    """
    return is_bounded(limit) and limit.lower < limit.upper


def resolution(share: float, radians: float) -> float:
    """Return the power of ten to which fitted numbers are rounded.

    The result is the smallest power of ten that is at least twice the tip error and at least twice `_FINEST`.
    `share` is the position error of the tip in metres per metre of reach.
    """
    return float(10.0 ** math.ceil(math.log10(2.0 * max(share, radians, _FINEST))))


def document(found: TableComparison, units: Units) -> TextDocument:
    title, *verdict = _verdict(found)
    parts: Parts = [*verdict, *(_mistakes(found, units) if found.mistakes else _cells(found, units))]
    if found.residual > EXPLAINED * found.reach and not found.mistakes:
        parts.append(
            f"No change of cells explains the whole difference: {found.residual * 1e3:.3g} mm remain"
            " unexplained."
        )
        if not found.fitted:
            parts.append(
                "The table may have a different base frame or tool. Omit --no-fit to fit base and tool."
            )
    if found.agrees or not found.mistakes:
        parts += _fitted(found, units)
    if not found.agrees:
        parts += ["", str(QuestionsSection.DH_AND_URDF_DISAGREE)]
    return TextDocument(title, parts)


def _fitted(found: TableComparison, units: Units) -> Parts:
    parts: Parts = []
    table, fine = found.reference, found.resolution
    variables = [
        f"  {row.joint}: {format_sum('-q' if sense < 0 else 'q', _format_offset(offset, row, fine, units))}"
        for row, sense, offset in zip(table.rows, found.senses, found.offsets, strict=True)
        if sense < 0 or abs(offset) > fine
    ]
    if variables:
        parts += ["", "Joint variables of the table (q is the URDF's joint value):", *variables]
    for what, T in (("base", table.base), ("tool", table.tool)):
        rounded = np.round(T / fine) * fine
        if np.abs(rounded - np.eye(4)).max() > fine:
            parts += ["", f"{what} (metres):", pose_matrix(rounded, 6)]
    return parts


def _verdict(found: TableComparison) -> list[str]:
    table = found.reference
    path = f"{table.robot}, {table.base_frame} to {table.tip_frame}"
    agrees = "agrees only" if found.mistakes else "agrees exactly" if found.exact else "agrees"
    verdict = agrees if found.agrees else "DIFFERS"
    error = _tip_error(found.metres, found.radians)
    condition = f", with {found.condition}" if found.condition else ""
    values = f"for all joint values within limits{condition}"
    proof = f"{found.samples} samples; proven bound {values}: {_proven(found)}"
    if found.as_written:
        return [f"The table {verdict} without a fit: {path}: {error}", f"({proof})."]
    if not found.fitted:
        return [
            f"The table {verdict}: {path}: {error}",
            f"({proof}; base, tool and joint variables are not fitted).",
        ]
    fine, ends = found.resolution, (found.base, found.tool)
    changes = [
        f"{what} by {_errors(end.metres, end.radians)}"
        for what, end in zip(("the base", "the tool"), ends, strict=True)
        if end.metres > found.rounding_metres or end.radians > found.rounding
    ]
    zeros = sum(abs(offset) > fine for offset in found.offsets)
    reversed_ = sum(sense < 0 for sense in found.senses)
    if zeros:
        changes.append(f"the zeros of {zeros} joint{'s' * (zeros > 1)} (listed below)")
    if reversed_:
        s = "s" * (reversed_ > 1)
        changes.append(f"the sign{s} of {reversed_} joint{s} (listed below)")
    after_fit = "after a fit of base, tool and joint offsets"
    once = f" {after_fit}" if found.agrees and changes else ""
    fitted = "" if found.agrees else f"; {after_fit}"
    lines = [f"The table {verdict}{once}: {path}: {error}", f"({proof}{fitted})."]
    lines.append(f"Without a fit, {_tip_error(found.written_metres, found.written_radians)}.")
    if changes:
        lines.append(
            f"The fit changed {', '.join(changes)}. Use --no-fit to compare the table without a fit."
        )
        both_ends = all(max(end.metres / found.reach, end.radians) > fine for end in ends)
        if found.agrees and not found.mistakes and (both_ends or zeros or reversed_):
            lines.append(
                "These changes can hide a wrong sign. To find a wrong sign, write base, tool and zeros"
                " into the table."
            )
    return lines


def _errors(metres: float, radians: float) -> str:
    return f"{metres * 1e3:.3g} mm and {radians:.3g} rad"


def _tip_error(metres: float, radians: float) -> str:
    return f"the tip is off by up to {_errors(metres, radians)}"


def _proven(found: TableComparison) -> str:
    if found.exact:
        return "only rounding errors"
    return "none" if math.isinf(found.most_metres) else _errors(found.most_metres, found.most_radians)


def _mistakes(found: TableComparison, units: Units) -> list[str]:
    first = found.mistakes[0]
    remaining_fit = "without a fit" if not first.fitted.count else f"after a fit of only {first.fitted}"
    subject = "One change makes" if len(found.mistakes) == 1 else "Each of these changes makes"
    lines = ["", f"{subject} the table right {remaining_fit}:"]
    for mistake in found.mistakes:
        error = _tip_error(mistake.metres, mistake.radians)
        lines.append(f"  {_change(mistake, found.reference, units)}; {error}")
    if found.agrees:
        lines.append(
            "Correct the table. If the fitted base, tool and zeros are intended, write them into the table."
        )
    return lines


def _change(mistake: Mistake, table: DHTable, units: Units) -> str:
    if mistake.cell is None:
        if mistake.kind is MistakeKind.REVERSED:
            return "the rows in reverse order"
        return f"rows {' and '.join(str(row + 1) for row in mistake.rows)} exchanged"
    cell = mistake.cell
    unit = units.length_name if cell.is_length else units.angle_name
    why = "its sign" if mistake.kind is MistakeKind.SIGN else "a right angle"
    row = f"row {cell.row + 1}, {table.rows[cell.row].joint}"
    right, wrong = (cell.formatted(value, units) for value in (cell.urdf, cell.reference))
    return f"{row}: {cell.cell} = {right} {unit}, not {wrong} ({why})"


def _cells(found: TableComparison, units: Units) -> Parts:
    unit = f"({units.length_name}, {units.angle_name})"
    parts: Parts = []
    if found.differences:
        parts += ["", f"Cells that differ {unit}:", _table(found.differences, units)]
        rounded = sum(one.is_rounding for one in found.differences)
        if rounded:
            count = "All" if rounded == len(found.differences) else f"{rounded} of {len(found.differences)}"
            parts.append(f"{count} differences are within the last digit of the table (*).")
    elif found.as_written:
        parts.append("Every cell agrees with the URDF.")
    elif found.exact:
        parts.append(
            "After the fit of base, tool and joint offsets, every compared cell agrees with the URDF."
        )
    if found.hidden and not found.as_written:
        cells = ", ".join(f"{cell}{row + 1}" for row, cell in found.hidden)
        same = "a change of base, tool or joint offsets has the same effect"
        parts.append(f"These cells are not compared, because {same}: {cells}.")
    if {(one.row, one.cell) for one in found.instead} - {(one.row, one.cell) for one in found.differences}:
        parts += ["", f"To agree without a fit, these cells must change {unit}:"]
        parts.append(_table(found.instead, units))
    return parts


def _table(cells: Sequence[CellDifference], units: Units) -> Table:
    rows = []
    for one in cells:
        texts = (one.formatted(value, units) for value in (one.reference, one.urdf, one.difference))
        name = one.cell + "*" * one.is_rounding
        rows.append((str(one.row + 1), one.joint, name, *texts, f"{one.tip * 1e3:.3g}"))
    heads = ("row", "joint", "cell", "table", "URDF", "difference", "tip [mm]")
    return Table(heads, rows, left=(1,), names=(1,))


def _format_offset(offset: float, row: DHRow, fine: float, units: Units) -> str:
    """Round an offset to a multiple of `fine`, and format it.

    An angle that differs by at most `fine` from a multiple of 15 degrees is rounded to this multiple.
    """
    if abs(offset) <= fine:
        return "0"
    if not row.kind.turns:
        return units.length(round(offset / fine) * fine)
    twelfth = nearest_twelfth(offset)
    return units.angle(twelfth if abs(offset - twelfth) <= fine else round(offset / fine) * fine)
