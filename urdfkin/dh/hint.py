"""Cells that look like angles which the file rounded (1.5708, 3.14159265359), and the `snap` that cures them.

A tilt of 5e-12 rad is no rounding of the computation (`urdfkin.dh.noise`), so a table keeps it, and the
offsets of some 1e-12 m that come with it. Whoever reads the table should be told that they are the file's.
"""

from __future__ import annotations

from collections.abc import Callable

from urdfkin.dh.elements import nearest_twelfth
from urdfkin.dh.table import DHTable
from urdfkin.kinematics.roundings import ANGLE, EPS

#: Radians off a multiple of 15 degrees, and metres for each metre of span, that look like such rounding.
LARGEST = 1e-4
#: Tolerances that are tried, in radians, the smallest first.
TOLERANCES = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)


def noisy_cells(table: DHTable) -> list[tuple[str, str, float]]:
    """(joint, cell, how far it is from a round value), radians and metres, the smallest first."""
    found = []
    for row in table.rows:
        for name, angle in (("alpha", row.alpha), ("theta", row.theta), ("beta", row.beta)):
            off = abs(angle - nearest_twelfth(angle))
            if ANGLE * EPS < off <= LARGEST:
                found.append((row.joint, name, off))
        for name, length in (("a", row.a), ("d", row.d)):
            if 0.0 < abs(length) <= LARGEST * table.span:
                found.append((row.joint, name, abs(length)))
    return sorted(found, key=lambda one: one[2])


def snap_hint(table: DHTable, snapped: Callable[[float], DHTable]) -> str | None:
    """A line that says which cells look like rounding and which tolerance makes most of them round.

    Args:
        table: An exact table.
        snapped: Makes the same table with a tolerance.

    Returns:
        None where nothing looks so, or no tolerance helps.
    """
    noisy = noisy_cells(table) if table.snap is None else []
    if not noisy:
        return None
    left = {tolerance: len(noisy_cells(snapped(tolerance))) for tolerance in TOLERANCES}
    best = min(TOLERANCES, key=lambda tolerance: left[tolerance])
    if left[best] >= len(noisy):
        return None
    joint, cell, size = noisy[0]
    unit = "m" if cell in ("a", "d") else "rad"
    many = f"{len(noisy)} cells look" if len(noisy) > 1 else "a cell looks"
    return (
        f"{many} like angles that the file rounded ({cell} of {joint}: {size:.2g} {unit}):"
        f" --snap {best:.0e} leaves {left[best] or 'none'} and says what it moves"
    )
