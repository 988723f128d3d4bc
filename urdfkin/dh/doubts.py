"""What looks misread in a table that nothing is held against: its units, or two of its columns.

Right angles and their thirds are what designers choose for angles, and hardly ever for lengths; and an arm
is some centimetres to some metres long. A table that is the other way round was meant otherwise. Where there
is a URDF, `urdfkin.dh.compare.slips` knows instead of guessing.
"""

from __future__ import annotations

import math

from urdfkin.dh.elements import looks_round
from urdfkin.dh.table import DHTable

#: Metres: a row of an arm is not longer, nor is a thousandth of it shorter than a millimetre.
_LONGEST, _SHORTEST = 20.0, 1e-3


def doubts(table: DHTable) -> list[str]:
    """What looks misread, in sentences that say what to write instead.

    Example:
        >>> from urdfkin.dh.rows import table_from_rows
        >>> doubts(table_from_rows([[425, 0, 0, 0], [392.25, 0, 0, 0]], "standard"))
        ["lengths up to 425 m look like millimetres: write lengths = 'millimetres' if they are"]
    """
    found = []
    lengths = [abs(cell) for row in table.rows for cell in (row.a, row.d) if cell]
    if lengths and max(lengths) > _LONGEST and all(length > _SHORTEST * 1e3 for length in lengths):
        found.append(
            f"lengths up to {max(lengths):.4g} m look like millimetres:"
            " write lengths = 'millimetres' if they are"
        )
    elif lengths and max(lengths) < _SHORTEST * 2.0:
        found.append(
            f"lengths of {max(lengths) * 1e3:.3g} mm at most look like metres:"
            " write lengths = 'metres' if they are"
        )
    angles = [cell for row in table.rows for cell in (row.alpha, row.theta) if cell]
    if angles and all(looks_round(math.degrees(cell)) for cell in angles):
        found.append("angles of 1.57 degrees look like radians: write angles = 'radians' if they are")
    for length, angle in (("a", "alpha"), ("d", "theta")):
        called_lengths, called_angles = (
            [getattr(row, name) for row in table.rows if getattr(row, name)] for name in (length, angle)
        )
        if (
            len(called_lengths) > 1
            and called_angles
            and all(map(looks_round, called_lengths))
            and not any(map(looks_round, called_angles))
        ):
            found.append(
                f"the columns {length} and {angle} look exchanged: the round angles stand in {length}"
            )
    return found
