"""A comparison in words: the verdict, what was fitted, the cells that differ."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from urdfkin.dh.compare.result import (
    EXPLAINED,
    CellDifference,
    Comparison,
    Mistake,
    MistakeKind,
    TakenUp,
    resolution,
)
from urdfkin.dh.elements import nearest_twelfth
from urdfkin.dh.export.cells import added, pose_lines
from urdfkin.dh.export.terminal import aligned
from urdfkin.dh.row import DHRow
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors.printable import printable
from urdfkin.errors.questions import Question


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


def _is_taken(taken: TakenUp, found: Comparison) -> bool:
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
