"""Find the convention, units or columns with which a table that disagrees would agree with a URDF.

Every reading of the table (`urdfkin.dh.hypotheses`) has a shape: distances and angles of consecutive axes,
and the offsets between the feet of their common normals. The shape does not depend on signs, zeros, base and
tool, and is fast to compute. The few readings with a shape closest to the URDF's are fitted.
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

#: Number of readings to fit; tilt of parallel axes (rad); relative cost of one more difference.
_TRIED, _PARALLEL, _WORTH = 3, 2e-2, 0.1
#: Largest fraction of the original tip error that a reading may leave.
_EXPLAINS = 0.05


@dataclass(frozen=True, slots=True)
class CommonMistake:
    """A reading in which a table agrees.

    Attributes:
        reading: The reading.
        said: The reading that the table names.
        metres: Position error of the tip at the worst sample, after a fit of base, tool and offsets.
        radians: Orientation error of the tip at the worst sample.
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
        """Return plain data."""
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
    """Return the reading in which a table agrees, or None.

    Args:
        chain: The path of the URDF.
        data: The table's plain data from `urdfkin.dh.parse_table.mapping_from_text`.
        tolerance: Tolerance at the tip (metres).
        off: Tip error of the table as it is read (metres); the result must leave at most 5 % of it.
    """
    kinds = [joint.kind.turns for joint in chain.joints]
    own = shape(derive(chain, Choices(last=Last.FLANGE)), chain.reach)
    try:
        said = as_said(data)
    except InputError:  # an invalid convention or unit: another error reports it
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
        except RangeError:  # this reading makes a length too large
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
    """Return the convention with which a table without a named convention agrees with a path.

    Args:
        chain: The path of the URDF.
        data: The table's plain data.
        tolerance: Tolerance at the tip (metres).
        where: The table's file.

    Raises:
        InputError: both conventions agree equally well, or neither does with any units.
    """
    found = list[tuple[Convention, Comparison]]()
    errors = list[InputError]()
    for convention in Convention:
        try:
            table = table_from_mapping({**data, "convention": convention})
            found.append((convention, compare(chain, table, tolerance)))
        except InputError as error:
            errors.append(error)
    written = [one for one, how in found if how.agrees and how.written_metres <= tolerance]
    passing = [one for one, how in found if how.passes]
    agreeing = [one for one, how in found if how.agrees]
    mistaken = [one for one, how in found if how.mistakes]
    best = written or passing or agreeing or mistaken
    if len(best) == 1:
        return best[0]
    if not best and (slip := diagnose(chain, data, tolerance)) and slip.reading.convention:
        return slip.reading.convention
    if errors and not found:
        raise errors[0]
    raise InputError(
        f"the table does not name its convention, and {'both conventions fit' if best else 'neither fits'}",
        where=where,
        found=f"tip errors {' and '.join(f'{how.metres * 1e3:.3g} mm as {one}' for one, how in found)}",
        remedy="write convention = 'standard' or 'modified' (in text: a line `convention: standard`)",
        question=Question.WHICH_DH_CONVENTION,
    )


def shape(table: DHTable, scale: float) -> FloatArray:
    """Return numbers of a table that do not depend on signs, zeros, base and tool.

    They are in metres, and in radians times `scale`. For each pair of axes they are the distance and the
    angle of their lines. For each joint between two pairs of axes that are not parallel, they include the
    offset along it; offsets along parallel axes are summed. The line of a prismatic axis is free, so
    distances from it and offsets beside it are zero. Offsets along the first axis are also left out, because
    the base absorbs them.
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
