"""A comparison in words: the verdict, the freedoms that were fitted, the cells that differ."""

from __future__ import annotations

import numpy as np

from urdfkin.dh.compare.compare import Comparison
from urdfkin.dh.elements import nearest_twelfth
from urdfkin.dh.export.terminal import aligned
from urdfkin.dh.export.words import added, pose_lines
from urdfkin.dh.row import DHRow
from urdfkin.dh.units import Units


def comparison_text(found: Comparison, units: Units) -> str:
    """Lines for a terminal, the last one ended."""
    table = found.reference
    path = f"{table.robot}, {table.base_frame} to {table.tip_frame}"
    off = f"the tip is off by at most {found.metres * 1e3:.3g} mm and {found.radians:.3g} rad"
    verdict = "agrees exactly" if found.exact else "agrees" if found.agrees else "DIFFERS"
    lines = [
        f"The table {verdict}: {path}: {off}",
        f"({found.samples} samples, base, tool and joint offsets fitted).",
    ]
    if not found.differences:
        lines.append("Every cell is the URDF's.")
    else:
        body = [["row", "joint", "cell", "table", "URDF", "difference", "tip [mm]"]]
        for one in found.differences:
            write = units.length if one.cell in ("a", "d") else units.angle
            texts = [write(one.reference), write(one.urdf), write(one.difference), f"{one.tip * 1e3:.3g}"]
            body.append([str(one.row + 1), one.joint, one.cell, *texts])
        lines += ["", f"Cells that differ ({units.length_name}, {units.angle_name}):", *aligned(body)]
    if found.residual > 1e-9 * max(table.span, 1.0):
        lines.append(f"No change of cells explains the URDF: {found.residual * 1e3:.3g} mm are left.")
    fine = resolution(found)
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
    return "\n".join(lines) + "\n"


def resolution(found: Comparison) -> float:
    """A power of ten below which fitted numbers only reflect how well the table fits."""
    error = max(found.metres / max(found.reference.span, 1e-9), found.radians, 1e-12)
    return float(10.0 ** np.ceil(np.log10(2.0 * error)))


def shown_offset(offset: float, row: DHRow, fine: float, units: Units) -> str:
    """An offset to the resolution, as a fraction of pi where it is one to that resolution."""
    if abs(offset) <= fine:
        return "0"
    if not row.kind.turns:
        return units.length(round(offset / fine) * fine)
    twelfth = nearest_twelfth(offset)
    return units.angle(twelfth if abs(offset - twelfth) <= fine else round(offset / fine) * fine)
