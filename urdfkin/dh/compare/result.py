"""Store the result of comparing a table with a URDF, and write the result as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from urdfkin.dh.export.text import added, pose_matrix
from urdfkin.dh.table import DHRow, DHTable, nearest_twelfth
from urdfkin.dh.units import Units
from urdfkin.errors import QuestionsSection
from urdfkin.errors.display import Matrix, Table, TextDocument
from urdfkin.kinematics.roundings import EPS, of_a_fit

Parts = list[str | Table | Matrix]

#: If at most this error remains after a change of cells, only these cells differ between table and URDF.
#: The unit is rad for angles, and metres per metre of reach for positions.
#: The rounding errors of a fit are far smaller, and the last digits in data sheets are far larger.
EXPLAINED = 1e-9
#: Fitted numbers are printed with this resolution, or with a coarser resolution.
#: The unit is rad for angles, and metres per metre of reach for lengths.
_FINEST = 1e-12
#: A difference may exceed half a unit of the last digit by the rounding of decimals to doubles.
_HALF = 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class CellDifference:
    """One cell of a published table that differs from the URDF's value.

    Attributes:
        row: Index of the row in the reference table, from 0.
        joint: Name of the joint in the URDF.
        cell: "a", "alpha", "d", "theta" or "beta".
        reference: The table's value (metres or radians).
        urdf: The URDF's value (metres or radians).
        tip: Largest displacement (metres) of the tip in the sampled configurations if only this cell differs.
        last_digit: Half a unit of the value's last digit in the table's file (metres or radians). 0 if the
            value is exact, or if its text is unknown.
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
    """Counts of the parameters that a fit must change so that a table agrees with the URDF.

    `zeros` counts zero positions of joints, and `reversed` counts positive directions of joints.
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
    """A likely mistake in a table. After its correction, fewer parameters must be fitted.

    Attributes:
        rows: Indices of the changed rows, from 0.
        cell: The changed cell; None if rows are exchanged.
        table: The table after the change.
        fitted: The parameters that must still be fitted after the change.
        metres, radians: Largest errors of the tip on the samples after the change.
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
            offsets. The method `placement` of this table takes the URDF's coordinates.
        reach: Reach of the robot (metres). Rounding errors are relative to the reach, and angles are
            multiplied by the reach to compare them with lengths.
        fitted: Whether base, tool, joint signs and joint offsets were fitted.
        senses: Sign of each joint, +1 or -1. The table's variable is sign * q + offset, where q is the URDF's
            joint value.
        offsets: Offset of each joint (radians or metres).
        metres, radians: Largest errors of the fitted table's tip on the samples.
        most_metres, most_radians: Proven upper bounds of the errors of the fitted table's tip for all joint
            values. The bounds do not include rounding errors (`urdfkin.dh.compare.agreement`).
        written_metres, written_radians: Largest errors of the unfitted table's tip on the samples.
        differences: The cells that differ, in descending order of their effect at the tip. If there is a
            single mistake, this is the cell of the mistake.
        instead: The cells that would have to change if base, tool, joint signs and joint offsets were not
            fitted. The list is empty if changes of cells do not remove the tip error, or if too many cells
            would have to change.
        hidden: Row index and name of each cell whose value cannot be determined from the tip's poses. If such
            a cell has another value, base, tool and joint offsets can compensate for the difference.
        mistakes: The likely mistakes. A mistake is likely if its correction leaves the smallest number of
            parameters to fit.
        residual: Tip error (metres) that remains if the differing cells take the URDF's values. If these
            cells are the only difference, the remaining error is only rounding.
        tolerance: Tolerance at the tip (metres).
        samples: Number of configurations at which the fitted table was checked.
    """

    reference: DHTable
    reach: float
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
        """Whether the table agrees with the URDF in all sampled configurations.

        The table agrees if the position error, and the orientation error multiplied by the reach, are within
        `tolerance`.
        """
        return self.metres <= self.tolerance and self.radians * self.reach <= self.tolerance

    @property
    def passes(self) -> bool:
        return self.agrees and not self.mistakes

    @property
    def rounding(self) -> float:
        """Limit below which errors are treated as rounding: radians, or metres per metre of reach."""
        return EPS * of_a_fit(len(self.reference.rows))

    @property
    def exact(self) -> bool:
        """Whether the table is proven to differ from the URDF only by rounding, in every configuration."""
        return self.most_metres <= self.rounding * self.reach and self.most_radians <= self.rounding

    @property
    def as_written(self) -> bool:
        """Whether the written table, with its base, tool and zeros, equals the URDF up to rounding."""
        return self.written_metres <= self.rounding * self.reach and self.written_radians <= self.rounding


def resolution(share: float, radians: float) -> float:
    """Return the power of ten to which fitted numbers are rounded: at least twice the tip error.

    `share` is the position error of the tip in metres per metre of reach, and `radians` its orientation
    error.
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
            parts.append("The table may have another base frame or tool. Omit --no-fit to fit base and tool.")
    if found.agrees or not found.mistakes:
        parts += _fitted(found, units)
    if not found.agrees:
        parts += ["", str(QuestionsSection.DH_AND_URDF_DISAGREE)]
    return TextDocument(title, parts)


def _fitted(found: TableComparison, units: Units) -> Parts:
    parts: Parts = []
    table, fine = found.reference, resolution(found.metres / found.reach, found.radians)
    moved = [
        f"  {row.joint}: {added('-q' if sense < 0 else 'q', shown_offset(offset, row, fine, units))}"
        for row, sense, offset in zip(table.rows, found.senses, found.offsets, strict=True)
        if sense < 0 or abs(offset) > fine
    ]
    if moved:
        parts += ["", "Joint variables of the table in terms of those of the URDF:", *moved]
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
    off = _off(found.metres, found.radians)
    proof = f"{found.samples} samples; proven for all values of the joints: {_proven(found)}"
    if found.as_written:
        return [f"The table {verdict} without a fit: {path}: {off}", f"({proof})."]
    if not found.fitted:
        return [
            f"The table {verdict}: {path}: {off}",
            f"({proof}; base, tool and joint variables are not fitted).",
        ]
    fine = resolution(found.metres / found.reach, found.radians)
    ends = [
        f"{what} by {change.metres * 1e3:.3g} mm and {change.radians:.3g} rad"
        for what, change in (("the base", found.base), ("the tool", found.tool))
        if change.metres > found.rounding * found.reach or change.radians > found.rounding
    ]
    zeros = sum(abs(offset) > fine for offset in found.offsets)
    if zeros:
        ends.append(f"the zeros of {zeros} joint{'s' if zeros > 1 else ''} (listed below)")
    reversed_ = sum(sense < 0 for sense in found.senses)
    if reversed_:
        ends.append(
            f"the signs of {reversed_} joints (listed below)"
            if reversed_ > 1
            else "the sign of 1 joint (listed below)"
        )
    once = " after a fit of base, tool and joint offsets" if found.agrees and ends else ""
    fitted = "" if found.agrees else "; after a fit of base, tool and joint offsets"
    lines = [f"The table {verdict}{once}: {path}: {off}", f"({proof}{fitted})."]
    lines.append(f"Without a fit, {_off(found.written_metres, found.written_radians)}.")
    if ends:
        lines.append(f"The fit changed {', '.join(ends)}. Use --no-fit to compare the table without a fit.")
        moved = [max(end.metres / found.reach, end.radians) > fine for end in (found.base, found.tool)]
        if found.agrees and not found.mistakes and (all(moved) or zeros or reversed_):
            lines.append(
                "These changes can hide a wrong sign. To find a wrong sign, write base, tool and zeros"
                " into the table."
            )
    return lines


def _off(metres: float, radians: float) -> str:
    return f"the tip is off by up to {metres * 1e3:.3g} mm and {radians:.3g} rad"


def _proven(found: TableComparison) -> str:
    if found.exact:
        return "rounding alone"
    if math.isinf(found.most_metres):
        return "nothing"
    return f"{found.most_metres * 1e3:.3g} mm and {found.most_radians:.3g} rad"


def _mistakes(found: TableComparison, units: Units) -> list[str]:
    first = found.mistakes[0]
    left = "without a fit" if not first.fitted.count else f"after a fit of only {first.fitted}"
    count = "One change makes" if len(found.mistakes) == 1 else "Each of these changes makes"
    lines = ["", f"{count} the table right {left}:"]
    for one in found.mistakes:
        off = _off(one.metres, one.radians)
        lines.append(f"  {_change(one, found.reference, units)}; {off}")
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
    one = mistake.cell
    write, unit = (
        (units.length, units.length_name) if one.cell in ("a", "d") else (units.angle, units.angle_name)
    )
    why = "its sign" if mistake.kind is MistakeKind.SIGN else "a right angle"
    row = f"row {one.row + 1}, {table.rows[one.row].joint}"
    return f"{row}: {one.cell} = {write(one.urdf)} {unit}, not {write(one.reference)} ({why})"


def _cells(found: TableComparison, units: Units) -> Parts:
    unit = f"({units.length_name}, {units.angle_name})"
    parts: Parts = []
    if found.differences:
        parts += ["", f"Cells that differ {unit}:", _table(found.differences, units)]
        rounded = sum(one.is_rounding for one in found.differences)
        if rounded:
            all_ = "All" if rounded == len(found.differences) else f"{rounded} of {len(found.differences)}"
            parts.append(f"{all_} differ only within the last digit of the table (*).")
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
        parts += ["", f"Without fitting, these cells would have to change {unit}:"]
        parts.append(_table(found.instead, units))
    return parts


def _table(cells: Sequence[CellDifference], units: Units) -> Table:
    rows = []
    for one in cells:
        write = units.length if one.cell in ("a", "d") else units.angle
        texts = [write(one.reference), write(one.urdf), write(one.difference), f"{one.tip * 1e3:.3g}"]
        star = "*" if one.is_rounding else ""
        rows.append((str(one.row + 1), one.joint, one.cell + star, *texts))
    heads = ("row", "joint", "cell", "table", "URDF", "difference", "tip [mm]")
    return Table(heads, rows, left=(1,), names=(1,))


def shown_offset(offset: float, row: DHRow, fine: float, units: Units) -> str:
    """Format an offset at the resolution `fine`.

    If an angle differs from a multiple of 15 degrees by at most `fine`, it is written as a fraction of pi.
    """
    if abs(offset) <= fine:
        return "0"
    if not row.kind.turns:
        return units.length(round(offset / fine) * fine)
    twelfth = nearest_twelfth(offset)
    return units.angle(twelfth if abs(offset - twelfth) <= fine else round(offset / fine) * fine)
