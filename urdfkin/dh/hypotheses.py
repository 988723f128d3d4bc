"""The few ways in which a table is misread: convention, units, and what its columns are called.

Each is another reading of the same plain data (`urdfkin.dh.rows` says what stands in them), made by changing
what the data say and reading them again; so whatever a table may not be, an angle of eighty turns say, rules
a reading out by itself.


What looks misread in a table that nothing is held against: its units, or two of its columns.

Right angles and their thirds are what designers choose for angles, and hardly ever for lengths; and an arm
is some centimetres to some metres long. A table that is the other way round was meant otherwise. Where there
is a URDF, `urdfkin.dh.compare.slips` knows instead of guessing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import Any

from urdfkin.dh.rows import ORDER, table_from_mapping
from urdfkin.dh.table import Convention, DHTable, convention_of, looks_round
from urdfkin.dh.units import Angles, Lengths, units_of
from urdfkin.errors import InputError

#: What a reading does not need: it is about the four cells of each row, and the ends are fitted.
_CELLS = ("joint", "kind", "sense", "beta", *ORDER)
_ENDS = ("base", "tool", "coordinates")


@dataclass(frozen=True, slots=True)
class ConventionHypothesis:
    """One way to read a table.

    Attributes:
        convention: Standard or modified; None where a table names none.
        lengths: Metres or millimetres.
        angles: Radians or degrees.
        columns: What the columns that are called a, alpha, d, theta (or come in this order) really hold.
    """

    convention: Convention | None
    lengths: Lengths
    angles: Angles
    columns: tuple[str, ...] = ORDER

    def of(self, data: Mapping[str, Any]) -> DHTable:
        """The table that the data are, read so, without base and tool; InputError where it cannot be one."""
        said = {"convention": self.convention, "lengths": self.lengths, "angles": self.angles}
        rows = [self._row(row) for row in data["rows"]]
        return table_from_mapping({**_bare(data), **said, "rows": rows})

    def _row(self, row: Mapping[str, Any]) -> dict[str, Any]:
        meant = dict(zip(ORDER, self.columns, strict=True))
        return {meant.get(key, key): value for key, value in row.items()}

    def slips(self, other: ConventionHypothesis) -> int:
        """How many things differ from another reading; a pair of columns that changed places is one."""
        moved = sum(mine != theirs for mine, theirs in zip(self.columns, other.columns, strict=True))
        return len(self._said_differently(other)) + (moved + 1) // 2

    def words(self, other: ConventionHypothesis) -> str:
        """What is to be said differently, from another reading: modified, millimetres, columns ..."""
        words = self._said_differently(other)
        if self.columns != other.columns:
            words.append(f"its columns {', '.join(ORDER)} as {', '.join(self.columns)}")
        return ", ".join(words)

    def _said_differently(self, other: ConventionHypothesis) -> list[str]:
        mine, theirs = ((one.convention, one.lengths, one.angles) for one in (self, other))
        return [str(word) for word, instead in zip(mine, theirs, strict=True) if word is not instead]


def as_said(data: Mapping[str, Any]) -> ConventionHypothesis:
    """How the data say that they are to be read; InputError for a convention or a unit that is none."""
    units = units_of(data.get("angles", "radians"), data.get("lengths", "metres"))
    convention = convention_of(data["convention"]) if "convention" in data else None
    return ConventionHypothesis(convention, units.lengths, units.angles)


def other_readings(data: Mapping[str, Any]) -> Iterator[tuple[ConventionHypothesis, DHTable]]:
    """Every other way to read a table in which it is one, the fewest slips first."""
    if not _has_rows(data):
        return
    data, said = {**data, "rows": [_row(row) for row in data["rows"]]}, as_said(data)
    every = (ConventionHypothesis(*one) for one in product(Convention, Lengths, Angles, permutations(ORDER)))
    for reading in sorted(every, key=lambda one: one.slips(said)):
        if reading == said:
            continue
        try:
            yield reading, reading.of(data)
        except InputError:
            continue


def _has_rows(data: Mapping[str, Any]) -> bool:
    rows = data.get("rows")
    return isinstance(rows, list) and all(isinstance(row, (list, Mapping)) for row in rows)


def _bare(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in _ENDS}


def _row(row: Mapping[str, Any] | Sequence[Any]) -> dict[str, Any]:
    """A row of a file's data by name, without followers and limits."""
    named = row if isinstance(row, Mapping) else dict(zip((*ORDER, "kind"), row, strict=False))
    return {key: value for key, value in named.items() if key in _CELLS}


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
