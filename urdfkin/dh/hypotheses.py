"""Read a table under other conventions, units and column names, to find a misread table.

`other_readings` changes the convention, units or column names of the same data (`urdfkin.dh.rows` defines
their form) and parses them again. A reading with an impossible value, such as an angle of eighty turns, is
rejected by the parser.

`doubts` finds a suspicious table without a URDF. It checks the units, and whether two columns are exchanged.
Designers choose right angles and thirds of them for angles, and hardly ever such numbers for lengths. An arm
is between some centimetres and some metres long. With a URDF, `urdfkin.dh.compare.slips` decides exactly.
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

#: Keys of a row that a reading uses, and keys of a table that it ignores because base and tool are fitted.
_CELLS = ("joint", "kind", "sense", "beta", *ORDER)
_ENDS = ("base", "tool", "coordinates")


@dataclass(frozen=True, slots=True)
class ConventionHypothesis:
    """One way to read a table.

    Attributes:
        convention: Standard or modified; None if the table names none.
        lengths: Metres or millimetres.
        angles: Radians or degrees.
        columns: True contents of the columns named a, alpha, d, theta (or in this order).
    """

    convention: Convention | None
    lengths: Lengths
    angles: Angles
    columns: tuple[str, ...] = ORDER

    def of(self, data: Mapping[str, Any]) -> DHTable:
        """Return the table under this reading, without base and tool; raise InputError if it is invalid."""
        said = {"convention": self.convention, "lengths": self.lengths, "angles": self.angles}
        rows = [self._row(row) for row in data["rows"]]
        return table_from_mapping({**_bare(data), **said, "rows": rows})

    def _row(self, row: Mapping[str, Any]) -> dict[str, Any]:
        meant = dict(zip(ORDER, self.columns, strict=True))
        return {meant.get(key, key): value for key, value in row.items()}

    def slips(self, other: ConventionHypothesis) -> int:
        """Count the differences from another reading; two exchanged columns count as one."""
        moved = sum(mine != theirs for mine, theirs in zip(self.columns, other.columns, strict=True))
        return len(self._differences(other)) + (moved + 1) // 2

    def words(self, other: ConventionHypothesis) -> str:
        """Describe the differences from another reading: modified, millimetres, columns ..."""
        words = self._differences(other)
        if self.columns != other.columns:
            words.append(f"its columns {', '.join(ORDER)} as {', '.join(self.columns)}")
        return ", ".join(words)

    def _differences(self, other: ConventionHypothesis) -> list[str]:
        mine, theirs = ((one.convention, one.lengths, one.angles) for one in (self, other))
        return [str(word) for word, instead in zip(mine, theirs, strict=True) if word is not instead]


def as_said(data: Mapping[str, Any]) -> ConventionHypothesis:
    """Return the reading that the data name; raise InputError for an unknown convention or unit."""
    units = units_of(data.get("angles", "radians"), data.get("lengths", "metres"))
    convention = convention_of(data["convention"]) if "convention" in data else None
    return ConventionHypothesis(convention, units.lengths, units.angles)


def other_readings(data: Mapping[str, Any]) -> Iterator[tuple[ConventionHypothesis, DHTable]]:
    """Yield every other reading that gives a valid table, the fewest differences first."""
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
    """Return a row of a file's data by name, without mimic rules and limits."""
    named = row if isinstance(row, Mapping) else dict(zip((*ORDER, "kind"), row, strict=False))
    return {key: value for key, value in named.items() if key in _CELLS}


#: Range of plausible lengths in a row of an arm (metres).
_LONGEST, _SHORTEST = 20.0, 1e-3


def doubts(table: DHTable) -> list[str]:
    """Return warnings about units or columns that look misread, each with its remedy.

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
                f"the columns {length} and {angle} look exchanged: {length} contains the round angles"
            )
    return found
