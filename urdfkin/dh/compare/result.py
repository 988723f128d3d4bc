"""What a comparison found: cells, what was fitted, and how far the tip is off.

A comparison in words: the verdict, what was fitted, the cells that differ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from urdfkin.dh.export.text import added, aligned, pose_lines
from urdfkin.dh.table import DHRow, DHTable, nearest_twelfth
from urdfkin.dh.units import Units
from urdfkin.errors import Question
from urdfkin.errors.escape import printable
from urdfkin.kinematics.roundings import EPS, of_a_fit

#: Metres for each metre of reach, and radians, that changed cells may leave and explain all of a difference:
#: far above what a fit rounds, far below the last digit of any sheet.
EXPLAINED = 1e-9
#: Radians, or of the reach: fitted numbers are shown no finer, however well the table fits.
_FINEST = 1e-12
#: By how much more than half a digit a half may be, a decimal that was read as a double and subtracted.
_HALF = 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class CellDifference:
    """One cell that is not the URDF's.

    Attributes:
        row: Index of the row in the reference table, from 0.
        joint: Name of the joint in the URDF.
        cell: "a", "alpha", "d", "theta" or "beta".
        reference: The table's value, metres or radians.
        urdf: What it would have to be.
        tip: Metres: how far this cell alone moves the tip, at the worst of the samples.
        last_digit: Half a unit of the last digit that the table's file gives, metres or radians; 0 where the
            value was written exactly, or how it was written is not known.
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
        """URDF less reference, metres or radians."""
        return self.urdf - self.reference

    @property
    def is_rounding(self) -> bool:
        """Whether the table could not have said it better with the digits that it gives."""
        return abs(self.difference) <= self.last_digit * _HALF


@dataclass(frozen=True, slots=True)
class AbsorbedOffset:
    """What fitting gave to one end of a table, away from what is written: metres and radians."""

    metres: float
    radians: float


class MistakeKind(StrEnum):
    """How a table was mistyped."""

    SIGN = "sign"
    RIGHT_ANGLE = "right angle"
    EXCHANGED = "rows exchanged"
    REVERSED = "rows reversed"


@dataclass(frozen=True, slots=True)
class Fitted:
    """What has to be fitted for a table to agree.

    Attributes:
        base: Whether the base is.
        tool: Whether the tool is.
        zeros: How many joints have another zero.
        reversed: How many joints count the other way.
    """

    base: bool = False
    tool: bool = False
    zeros: int = 0
    reversed: int = 0

    @property
    def count(self) -> int:
        """How much that is: each end and each joint's zero and sense is one."""
        return self.base + self.tool + self.zeros + self.reversed

    def __str__(self) -> str:
        ends = [name for name, fitted in (("base", self.base), ("tool", self.tool)) if fitted]
        joints = ((self.zeros, "zero"), (self.reversed, "sense"))
        counted = [f"{count} {name}{'s' * (count > 1)} of joints" for count, name in joints if count]
        return ", ".join([*ends, *counted]) or "nothing"


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """One change of a table after which less has to be fitted.

    Attributes:
        kind: How the table was mistyped.
        rows: Indices of the rows that change, from 0.
        cell: The cell that changes; None where rows change places.
        table: The table after the change.
        fitted: What still has to be fitted.
        metres: How far the tip is then off at the worst of the samples.
        radians: Likewise its orientation.
    """

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: CellDifference | None
    table: DHTable
    fitted: Fitted
    metres: float
    radians: float


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What a comparison found.

    Attributes:
        reference: The table, its joints named as in the URDF, with base, tool, senses and offsets fitted:
            its `placement` takes the URDF's coordinates.
        reach: Metres: the robot's, by which rounding and angles are measured.
        fitted: Whether base, tool, senses and offsets were free.
        senses: Of each joint: the table's variable is sense * q + offset.
        offsets: Likewise, radians or metres.
        base: What fitting gave to the base.
        tool: What it gave to the tool.
        metres: How far the tip is off at the worst of the samples, with what was fitted.
        radians: Likewise its orientation.
        most_metres: How far the tip is off at most at any values of the joints, proven, with what was fitted
            and without what counts as rounding (`urdfkin.dh.compare.proof`).
        most_radians: Likewise its orientation.
        written_metres: Likewise the tip's distance with the table exactly as it is written.
        written_radians: Likewise its orientation.
        differences: The cells that differ, the largest effect at the tip first; the cell of the single
            mistake where there is one.
        instead: The cells that would have to change if nothing were fitted; none if that does not explain
            the URDF, or nothing but the cells of `differences` is to be explained.
        hidden: (row, cell) that base, tool and offsets stand in for: no sample can tell these.
        mistakes: Single changes of the table after which the least has to be fitted, less than without them.
        residual: Metres left when the cells are the URDF's: rounding, unless no cells explain the URDF.
        tolerance: Metres up to which the two are said to agree.
        samples: How many configurations were tried.
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
        """Whether the tip is never off by more than the tolerance, nor by its turn times the reach."""
        return self.metres <= self.tolerance and self.radians * self.reach <= self.tolerance

    @property
    def passes(self) -> bool:
        """Whether the table agrees and no single change of it would leave less to be fitted."""
        return self.agrees and not self.mistakes

    @property
    def rounding(self) -> float:
        """Radians, and metres for each metre of the robot's reach, that count as rounding."""
        return EPS * of_a_fit(len(self.reference.rows))

    @property
    def exact(self) -> bool:
        """Whether rounding explains all of the difference, in every configuration: proven."""
        return self.most_metres <= self.rounding * self.reach and self.most_radians <= self.rounding

    @property
    def as_written(self) -> bool:
        """Whether the table is the URDF's as it is written, base, tool and offsets too, to rounding."""
        return self.written_metres <= self.rounding * self.reach and self.written_radians <= self.rounding


def resolution(share: float, radians: float) -> float:
    """A power of ten below which fitted numbers only reflect how well a table fits.

    Args:
        share: How far the tip is off, metres for each metre of reach.
        radians: How far it is turned.
    """
    return float(10.0 ** math.ceil(math.log10(2.0 * max(share, radians, _FINEST))))


def comparison_text(found: Comparison, units: Units) -> str:
    """Lines for a terminal, the last one ended."""
    lines = [*_verdict(found), *(_mistakes(found, units) if found.mistakes else _cells(found, units))]
    if found.residual > EXPLAINED * found.reach and not found.mistakes:
        lines.append(f"No change of cells explains the URDF: {found.residual * 1e3:.3g} mm are left.")
        if not found.fitted:
            lines.append("Its frames may stand elsewhere: without --no-fit, base and tool are fitted.")
    if found.agrees or not found.mistakes:
        lines += _fitted(found, units)
    if not found.agrees:
        lines += ["", str(Question.DH_AND_URDF_DISAGREE)]
    return "\n".join(map(printable, lines)) + "\n"


def _fitted(found: Comparison, units: Units) -> list[str]:
    """Variables, base and tool as they were fitted, where they are not the identity."""
    lines = list[str]()
    table, fine = found.reference, resolution(found.metres / found.reach, found.radians)
    moved = [
        f"  {row.joint}: {added('-q' if sense < 0 else 'q', shown_offset(offset, row, fine, units))}"
        for row, sense, offset in zip(table.rows, found.senses, found.offsets, strict=True)
        if sense < 0 or abs(offset) > fine
    ]
    if moved:
        lines += ["", "The table's joint variables in terms of the URDF's:", *moved]
    for what, T in (("base", table.base), ("tool", table.tool)):
        rounded = np.round(T / fine) * fine
        if np.abs(rounded - np.eye(4)).max() > fine:
            lines += ["", f"{what} (metres):", *("  " + line for line in pose_lines(rounded, 6))]
    return lines


def _verdict(found: Comparison) -> list[str]:
    """What the table is, with what was fitted and without."""
    table = found.reference
    path = f"{table.robot}, {table.base_frame} to {table.tip_frame}"
    agrees = "agrees only" if found.mistakes else "agrees exactly" if found.exact else "agrees"
    verdict = agrees if found.agrees else "DIFFERS"
    off = _off(found.metres, found.radians)
    proof = f"{found.samples} samples; proven for all values of the joints: {_proven(found)}"
    if found.as_written:
        return [f"The table {verdict} as it is written: {path}: {off}", f"({proof})."]
    if not found.fitted:
        return [
            f"The table {verdict}: {path}: {off}",
            f"({proof}; nothing fitted: base, tool and joint variables as written).",
        ]
    fine = resolution(found.metres / found.reach, found.radians)
    ends = [
        f"{what} {taken.metres * 1e3:.3g} mm and {taken.radians:.3g} rad"
        for what, taken in (("the base", found.base), ("the tool", found.tool))
        if _is_taken(taken, found)
    ]
    zeros = sum(abs(offset) > fine for offset in found.offsets)
    if zeros:
        ends.append(f"the zeros of {zeros} joint{'s' if zeros > 1 else ''} (below)")
    reversed_ = sum(sense < 0 for sense in found.senses)
    if reversed_:
        ends.append(
            f"the way {reversed_} joint{'s' if reversed_ > 1 else ''} count{'s' * (reversed_ == 1)} (below)"
        )
    once = " once base, tool and joint offsets are fitted" if found.agrees and ends else ""
    fitted = "" if found.agrees else "; base, tool and joint offsets fitted"
    lines = [f"The table {verdict}{once}: {path}: {off}", f"({proof}{fitted})."]
    lines.append(f"As it is written {_off(found.written_metres, found.written_radians)}.")
    if ends:
        lines.append(f"Fitting gave {', '.join(ends)}; --no-fit keeps to what is written.")
        moved = [max(end.metres / found.reach, end.radians) > fine for end in (found.base, found.tool)]
        if found.agrees and not found.mistakes and (all(moved) or zeros or reversed_):
            lines.append(
                "A wrong sign can hide behind these. Write base, tool and zeros into the table to find it."
            )
    return lines


def _off(metres: float, radians: float) -> str:
    return f"the tip is off by up to {metres * 1e3:.3g} mm and {radians:.3g} rad"


def _proven(found: Comparison) -> str:
    """What is proven, in words."""
    if found.exact:
        return "rounding alone"
    if math.isinf(found.most_metres):
        return "nothing"
    return f"{found.most_metres * 1e3:.3g} mm and {found.most_radians:.3g} rad"


def _is_taken(taken: AbsorbedOffset, found: Comparison) -> bool:
    return taken.metres > found.rounding * found.reach or taken.radians > found.rounding


def _mistakes(found: Comparison, units: Units) -> list[str]:
    """The single changes after which the least has to be fitted."""
    first = found.mistakes[0]
    left = "as written" if not first.fitted.count else f"with these fitted alone: {first.fitted}"
    count = "One change makes" if len(found.mistakes) == 1 else "Each of these changes makes"
    lines = ["", f"{count} the table right {left}:"]
    for one in found.mistakes:
        off = _off(one.metres, one.radians)
        lines.append(f"  {_change(one, found.reference, units)}; {off}")
    if found.agrees:
        lines.append("Correct the table. If base, tool and zeros are meant, write them into it.")
    return lines


def _change(mistake: Mistake, table: DHTable, units: Units) -> str:
    """A change in words."""
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


def _cells(found: Comparison, units: Units) -> list[str]:
    """The cells that differ, those that nobody can tell, and those that could be meant instead."""
    unit = f"({units.length_name}, {units.angle_name})"
    lines = []
    if found.differences:
        lines += ["", f"Cells that differ {unit}:", *_table(found.differences, units)]
        rounded = sum(one.is_rounding for one in found.differences)
        if rounded:
            all_ = "All" if rounded == len(found.differences) else f"{rounded} of {len(found.differences)}"
            lines.append(f"{all_} within the last digit that the table gives (*).")
    elif found.as_written:
        lines.append("Every cell is the URDF's.")
    elif found.exact:
        lines.append("No cell differs that can be told from what was fitted.")
    if found.hidden and not found.as_written:
        cells = ", ".join(f"{cell}{row + 1}" for row, cell in found.hidden)
        lines.append(f"Base, tool and offsets stand in for {cells}: these were not compared.")
    if {(one.row, one.cell) for one in found.instead} - {(one.row, one.cell) for one in found.differences}:
        lines += ["", f"Without fitting, these cells would have to change {unit}:"]
        lines += _table(found.instead, units)
    return lines


def _table(cells: Sequence[CellDifference], units: Units) -> list[str]:
    body = [["row", "joint", "cell", "table", "URDF", "difference", "tip [mm]"]]
    for one in cells:
        write = units.length if one.cell in ("a", "d") else units.angle
        texts = [write(one.reference), write(one.urdf), write(one.difference), f"{one.tip * 1e3:.3g}"]
        star = "*" if one.is_rounding else ""
        body.append([str(one.row + 1), one.joint, one.cell + star, *texts])
    return aligned(body)


def shown_offset(offset: float, row: DHRow, fine: float, units: Units) -> str:
    """An offset to the resolution, as a fraction of pi where it is one to that resolution."""
    if abs(offset) <= fine:
        return "0"
    if not row.kind.turns:
        return units.length(round(offset / fine) * fine)
    twelfth = nearest_twelfth(offset)
    return units.angle(twelfth if abs(offset - twelfth) <= fine else round(offset / fine) * fine)
