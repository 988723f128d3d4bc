"""Find another convention, other units or other column names with which a table agrees with a URDF.

An *interpretation* of a table consists of a convention, units and column names. In each interpretation, the
numbers of a table describe a robot with a different *shape*: the distances of consecutive axes, the angles
between them, and the offsets along the axes. A change of joint signs, joint offsets, base or tool does not
change the shape. The shape is fast to compute. Therefore, urdfkin fits only the few interpretations whose
shapes are closest to the URDF's shape.

`doubts` needs no URDF. The function uses two facts. First, most angles in the table of an arm are multiples
of 30 degrees, and lengths hardly ever look like such angles. Second, the length of an arm is between some
centimetres and some metres. If there is a URDF, `diagnose` decides by a fit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations, product
from typing import Any

import numpy as np

from urdfkin.dh.compare.agreement import best_fit, compare
from urdfkin.dh.compare.result import TableComparison
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import Choices, Last, derive
from urdfkin.dh.rows import ORDER, table_from_mapping
from urdfkin.dh.table import DHConvention, DHTable, convention_of, looks_round
from urdfkin.dh.units import Angles, Lengths, units_of
from urdfkin.errors import InputError, QuestionsSection, RangeError
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

#: `_TRIED` interpretations are fitted.
#: Axes with a smaller tilt than `_PARALLEL` (rad) are treated as parallel.
#: `_WORTH` is the relative cost of each difference from the file, for example another unit.
_TRIED, _PARALLEL, _WORTH = 3, 2e-2, 0.1
#: An interpretation is returned if its tip error is within the tolerance, or at most this fraction.
#: The fraction refers to the original tip error and to the reach.
_EXPLAINS = 0.05


@dataclass(frozen=True, slots=True)
class CommonMistake:
    """Another interpretation of a table, with which the table agrees with the URDF.

    Attributes:
        reading: The interpretation with which the table agrees with the URDF.
        said: The interpretation that the table's file states.
        metres, radians: Largest errors of the tip on the samples, after a fit of base, tool and offsets.
    """

    reading: ConventionHypothesis
    said: ConventionHypothesis
    metres: float
    radians: float

    def __str__(self) -> str:
        return (
            f"the table agrees with the URDF to {self.metres * 1e3:.3g} mm and {self.radians:.3g} rad"
            " when it is read as"
            f" {self.reading.words(self.said)}"
        )

    def as_mapping(self) -> dict[str, Any]:
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
    """Return the interpretation with which a table agrees with a URDF; None if there is none.

    `data` is the table's plain data from `urdfkin.dh.parse_table.mapping_from_text`. `off` is the tip error
    of the table as its file states it, and `tolerance` is the tolerance at the tip (metres). With the
    returned interpretation, the tip error is at most 5 % of `off`, or within `tolerance`.
    """
    kinds = [joint.kind.turns for joint in chain.joints]
    own = shape(derive(chain, Choices(last=Last.FLANGE)), chain.reach)
    try:
        said = as_said(data)
    except InputError:  # Another function reports this error.
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
        except RangeError:  # A length is too large in this interpretation.
            continue
        off_here = metres + radians * chain.reach
        if off_here <= max(tolerance, min(_EXPLAINS * off, _EXPLAINS * chain.reach)):
            found.append((off_here + tolerance * slips, CommonMistake(reading, said, metres, radians)))
            if off_here <= tolerance:
                break
    return min(found, key=lambda one: one[0])[1] if found else None


def convention_that_fits(
    chain: FrameChain, data: Mapping[str, Any], tolerance: float, where: str = "table"
) -> DHConvention:
    """Find the convention of a table whose file names no convention, by a comparison with a path.

    `tolerance` is the tolerance at the tip (metres).

    Raises:
        InputError: both conventions fit equally well, or neither convention fits, even in other units.
    """
    found = list[tuple[DHConvention, TableComparison]]()
    errors = list[InputError]()
    for convention in DHConvention:
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
        question=QuestionsSection.WHICH_DH_CONVENTION,
    )


def shape(table: DHTable, scale: float) -> FloatArray:
    """Return the shape of the robot that a table describes: distances, angles and offsets of its axes.

    Lengths are in metres, and angles are in radians times `scale`. For each pair of consecutive axes, the
    result contains the distance and the angle of the two axes. For each axis that is parallel to neither of
    its neighbours, the result also contains the offset along the axis. Offsets along consecutive parallel
    axes are summed. A prismatic joint has no fixed axis line. Therefore, the distance from a prismatic
    joint's axis to the next or previous axis is set to zero. The offsets along the neighbouring axes are also
    set to zero. The offset along the first axis is left out, because a change of the base has the same
    effect.
    """
    rows = to_convention(table, DHConvention.STANDARD).rows
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


#: Only the keys `_CELLS` of a row are used.
#: The keys `_ENDS` of a table are ignored, because base and tool are fitted.
_CELLS = ("joint", "kind", "sense", "beta", *ORDER)
_ENDS = ("base", "tool", "coordinates")


@dataclass(frozen=True, slots=True)
class ConventionHypothesis:
    """One interpretation of a table.

    Attributes:
        convention: Standard or modified; None if the table names no convention.
        columns: Contents of the table's columns in this interpretation. The columns have the names a, alpha,
            d and theta, or are unnamed and in this order.
    """

    convention: DHConvention | None
    lengths: Lengths
    angles: Angles
    columns: tuple[str, ...] = ORDER

    def of(self, data: Mapping[str, Any]) -> DHTable:
        """Return the table in this interpretation, without base and tool; raise InputError if invalid."""
        said = {"convention": self.convention, "lengths": self.lengths, "angles": self.angles}
        rows = [self._row(row) for row in data["rows"]]
        rest = {key: value for key, value in data.items() if key not in _ENDS}
        return table_from_mapping({**rest, **said, "rows": rows})

    def _row(self, row: Mapping[str, Any]) -> dict[str, Any]:
        meant = dict(zip(ORDER, self.columns, strict=True))
        return {meant.get(key, key): value for key, value in row.items()}

    def slips(self, other: ConventionHypothesis) -> int:
        """Return the number of differences; two exchanged columns are counted as one difference."""
        moved = sum(mine != theirs for mine, theirs in zip(self.columns, other.columns, strict=True))
        return len(self._differences(other)) + (moved + 1) // 2

    def words(self, other: ConventionHypothesis) -> str:
        """Name the differences from another interpretation, for example "modified" or "millimetres"."""
        words = self._differences(other)
        if self.columns != other.columns:
            words.append(f"its columns {', '.join(ORDER)} as {', '.join(self.columns)}")
        return ", ".join(words)

    def _differences(self, other: ConventionHypothesis) -> list[str]:
        mine, theirs = ((one.convention, one.lengths, one.angles) for one in (self, other))
        return [str(word) for word, instead in zip(mine, theirs, strict=True) if word is not instead]


def as_said(data: Mapping[str, Any]) -> ConventionHypothesis:
    """Return the interpretation that a file states; raise InputError for an unknown convention or unit."""
    units = units_of(data.get("angles", "radians"), data.get("lengths", "metres"))
    convention = convention_of(data["convention"]) if "convention" in data else None
    return ConventionHypothesis(convention, units.lengths, units.angles)


def other_readings(data: Mapping[str, Any]) -> Iterator[tuple[ConventionHypothesis, DHTable]]:
    """Yield every other interpretation in which the parser accepts the table, the most similar first.

    The parser rejects an impossible value, such as an angle of eighty turns.
    """
    rows = data.get("rows")
    if not isinstance(rows, list) or not all(isinstance(row, (list, Mapping)) for row in rows):
        return
    data, said = {**data, "rows": [_row(row) for row in rows]}, as_said(data)
    every = (
        ConventionHypothesis(*one) for one in product(DHConvention, Lengths, Angles, permutations(ORDER))
    )
    for reading in sorted(every, key=lambda one: one.slips(said)):
        if reading == said:
            continue
        try:
            yield reading, reading.of(data)
        except InputError:
            continue


def _row(row: Mapping[str, Any] | Sequence[Any]) -> dict[str, Any]:
    """Return a row of a file's data as a dict by cell name, without mimic rules and limits."""
    named = row if isinstance(row, Mapping) else dict(zip((*ORDER, "kind"), row, strict=False))
    return {key: value for key, value in named.items() if key in _CELLS}


#: Plausible lengths of an arm (metres)
_LONGEST, _SHORTEST = 20.0, 1e-3


def doubts(table: DHTable) -> list[str]:
    """Return warnings about units or columns that look wrong, each with a remedy.

    >>> from urdfkin.dh.rows import table_from_rows
    >>> doubts(table_from_rows([[425, 0, 0, 0], [392.25, 0, 0, 0]], "standard"))
    ["lengths up to 425 m look like millimetres: if they are millimetres, write lengths = 'millimetres'"]
    """
    found = []
    lengths = [abs(cell) for row in table.rows for cell in (row.a, row.d) if cell]
    if lengths and max(lengths) > _LONGEST and all(length > _SHORTEST * 1e3 for length in lengths):
        found.append(
            f"lengths up to {max(lengths):.4g} m look like millimetres:"
            " if they are millimetres, write lengths = 'millimetres'"
        )
    elif lengths and max(lengths) < _SHORTEST * 2.0:
        found.append(
            f"lengths of {max(lengths) * 1e3:.3g} mm at most look like metres:"
            " if they are metres, write lengths = 'metres'"
        )
    angles = [cell for row in table.rows for cell in (row.alpha, row.theta) if cell]
    if angles and all(looks_round(math.degrees(cell)) for cell in angles):
        found.append(
            "angles of 1.57 degrees look like radians: if they are radians, write angles = 'radians'"
        )
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
                f"the columns {length} and {angle} look exchanged: column {length} contains multiples of"
                " common angles"
            )
    return found
