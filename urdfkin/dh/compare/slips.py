"""What a table that does not fit would have to be read as to fit: the slip is named, not only its size.

Of all readings (`urdfkin.dh.hypotheses`) those are tried whose shape is the URDF's: how far consecutive axes
are apart, at which angle, and the offsets between the feet of their common normals. These do not change with
signs, zeros, base and tool, and cost nothing to compute; a few readings that come close are then fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from urdfkin.dh.compare.agreement import best_fit, compare
from urdfkin.dh.compare.result import Comparison
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import Choices, Last, derive
from urdfkin.dh.hypotheses import ConventionHypothesis, as_said, other_readings
from urdfkin.dh.rows import table_from_mapping
from urdfkin.dh.table import Convention, DHTable
from urdfkin.errors import InputError, Question, RangeError
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

#: Readings that are fitted; radians of tilt below which axes are parallel; what one slip more must be worth.
_TRIED, _PARALLEL, _WORTH = 3, 2e-2, 0.1
#: A reading explains a table if it leaves no more than this of what the table is off as it is read.
_EXPLAINS = 0.05


@dataclass(frozen=True, slots=True)
class CommonMistake:
    """A reading in which a table fits.

    Attributes:
        reading: How to read it.
        said: How it says that it is to be read.
        metres: How far the tip is then off at the worst of the samples, base, tool and offsets fitted.
        radians: Likewise its orientation.
    """

    reading: ConventionHypothesis
    said: ConventionHypothesis
    metres: float
    radians: float

    def __str__(self) -> str:
        return (
            f"this fits to {self.metres * 1e3:.3g} mm and {self.radians:.3g} rad when read as"
            f" {self.reading.words(self.said)}"
        )

    def as_mapping(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "convention": str(self.reading.convention),
            "lengths": str(self.reading.lengths),
            "angles": str(self.reading.angles),
            "columns": list(self.reading.columns),
            "tip_off_at_most_m": self.metres,
            "tip_turned_at_most_rad": self.radians,
        }


def diagnose(
    chain: FrameChain, data: Mapping[str, Any], tolerance: float, off: float = math.inf
) -> CommonMistake | None:
    """The slip that explains why a table does not fit, or None.

    Args:
        chain: The path of the URDF.
        data: The table's plain data, as `urdfkin.dh.parse_table.mapping_from_text` reads them.
        tolerance: Metres at the tip up to which a table agrees.
        off: Metres that the tip is off as the table is read; what leaves most of that explains nothing.
    """
    kinds = [joint.kind.turns for joint in chain.joints]
    own = shape(derive(chain, Choices(last=Last.FLANGE)), chain.reach)
    try:
        said = as_said(data)
    except InputError:  # what it says is no convention or no unit: that is the slip
        return None
    close = list[tuple[float, int, ConventionHypothesis, DHTable]]()
    for reading, table in other_readings(data):
        if [row.kind.turns for row in table.rows] != kinds or not kinds:
            return None
        apart = float(np.abs(shape(table, chain.reach) - own).sum())
        close.append((apart, reading.slips(said), reading, table))
    if not close:
        return None
    worth = _WORTH * min(apart for apart, *_ in close) + tolerance
    close.sort(key=lambda one: one[0] + worth * one[1])
    found = list[tuple[float, CommonMistake]]()
    for _, slips, reading, table in close[:_TRIED]:
        try:
            metres, radians = best_fit(chain, table, tolerance)
        except RangeError:  # lengths that only this reading makes so large
            continue
        off_here = metres + radians * chain.reach
        if off_here <= max(tolerance, min(_EXPLAINS * off, _EXPLAINS * chain.reach)):
            found.append((off_here + tolerance * slips, CommonMistake(reading, said, metres, radians)))
            if off_here <= tolerance:
                break
    return min(found, key=lambda one: one[0])[1] if found else None


def convention_that_fits(
    chain: FrameChain, data: Mapping[str, Any], tolerance: float, where: str = "table"
) -> Convention:
    """The convention of a table that names none: the one in which it fits a path.

    Args:
        chain: The path of the URDF.
        data: The table's plain data.
        tolerance: Metres at the tip up to which a table agrees.
        where: The table's file.

    Raises:
        InputError: both conventions fit equally well, or none does in any unit.
    """
    found = list[tuple[Convention, Comparison]]()
    refused = list[InputError]()
    for convention in Convention:
        try:
            table = table_from_mapping({**data, "convention": convention})
            found.append((convention, compare(chain, table, tolerance)))
        except InputError as error:
            refused.append(error)
    written = [one for one, how in found if how.agrees and how.written_metres <= tolerance]
    passing = [one for one, how in found if how.passes]
    agreeing = [one for one, how in found if how.agrees]
    mistaken = [one for one, how in found if how.mistakes]
    best = written or passing or agreeing or mistaken
    if len(best) == 1:
        return best[0]
    if not best and (slip := diagnose(chain, data, tolerance)) and slip.reading.convention:
        return slip.reading.convention
    if refused and not found:
        raise refused[0]
    raise InputError(
        f"the table does not say its convention, and {'both conventions fit' if best else 'neither fits'}",
        where=where,
        found=f"off by {' and '.join(f'{how.metres * 1e3:.3g} mm as {one}' for one, how in found)}",
        remedy="write convention = 'standard' or 'modified', in a sheet a line `convention: standard`",
        question=Question.WHICH_DH_CONVENTION,
    )


def shape(table: DHTable, scale: float) -> FloatArray:
    """What signs, zeros, base and tool leave of a table: metres, and radians times `scale`.

    For each pair of axes their distance and the angle between their lines; for each joint between pairs that
    are not parallel the offset along it, gathered along parallel axes. A sliding axis has no place: distances
    from it and offsets beside it say nothing, nor do offsets along the first axis, which the base takes up.
    """
    rows = to_convention(table, Convention.STANDARD).rows
    numbers, offset, known = list[float](), 0.0, False
    for row, following in pairwise(rows):
        placed = row.kind.turns and following.kind.turns
        tilt = math.atan2(math.hypot(math.sin(row.alpha), math.sin(row.beta)), abs(math.cos(row.alpha)))
        parallel = tilt < _PARALLEL
        offset, known = offset + row.d, known and placed
        numbers += [
            abs(offset) if known and not parallel else 0.0,
            abs(row.a) if placed else 0.0,
            scale * tilt,
        ]
        offset = math.copysign(1.0, math.cos(row.alpha)) * offset if parallel else 0.0
        known = placed if not parallel else known
    return np.array(numbers)
