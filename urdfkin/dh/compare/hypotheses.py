"""Find another convention, other units or other columns with which a table fits a URDF.

An interpretation of a table consists of a convention, units and column names. Each interpretation gives the
robot a different shape: distances, angles and offsets of consecutive axes. `find_better_interpretation` ranks
the interpretations by this number, and fits at most the three best interpretations:

    sum of |shape of the table - shape of the URDF| + cost * number of differences

The differences are those from the interpretation that the file states.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise, permutations, product
from typing import Any

import numpy as np

from urdfkin.dh.compare.agreement import compare, fast_fit_errors
from urdfkin.dh.compare.result import TableComparison
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import DerivationOptions, derive
from urdfkin.dh.parse_table import parse_table_data
from urdfkin.dh.rows import name_cells, table_from_mapping
from urdfkin.dh.table import DHConvention, DHTable, convention_of, looks_round
from urdfkin.dh.units import COLUMNS, AngleUnit, LengthUnit, parse_units
from urdfkin.errors import InputError, QuestionsSection, RangeError
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

_MAX_FITS = 3
#: Tilt (rad) below which two axes are treated as parallel.
_PARALLEL_TILT = 2e-2
#: Cost of each difference from the interpretation that the file states, as a fraction of the smallest shape
#: difference of all candidates. The tolerance is added to this cost.
_DIFFERENCE_COST_RATIO = 0.1
#: A better interpretation has a tip error within the tolerance. A larger tip error suffices if it is at most
#: this fraction of the reach, and of the tip error of the stated interpretation.
_BETTER_FRACTION = 0.05
#: `find_better_interpretation` ignores all other keys of a row, such as limits and mimic rules.
_ROW_KEYS = ("joint", "kind", "sense", "beta", *COLUMNS)
#: The keys "base" and "tool" are ignored because base and tool are fitted. The key "coordinates" is ignored
#: because it has an effect only with mimic rules.
_IGNORED_KEYS = ("base", "tool", "coordinates")
#: Plausible lengths of an arm (metres).
_MAX_LENGTH, _MIN_LENGTH = 20.0, 1e-3


@dataclass(frozen=True, slots=True)
class BetterInterpretation:
    """Another interpretation of a table.

    Attributes:
        metres, radians: Largest tip errors after a fit.
    """

    interpretation: Interpretation
    stated: Interpretation
    metres: float
    radians: float

    def __str__(self) -> str:
        return (
            f"the table agrees with the URDF to {self.metres * 1e3:.3g} mm and {self.radians:.3g} rad"
            f" when it is read as {self.interpretation.differences(self.stated)}"
        )

    def as_mapping(self) -> dict[str, Any]:
        return {
            "convention": str(self.interpretation.convention),
            "lengths": str(self.interpretation.lengths),
            "angles": str(self.interpretation.angles),
            "columns": list(self.interpretation.columns),
            "tip_off_at_most_m": self.metres,
            "tip_turned_at_most_rad": self.radians,
        }


def find_better_interpretation(
    chain: FrameChain, data: Mapping[str, Any], tolerance: float, stated_error: float = math.inf
) -> BetterInterpretation | None:
    """Find another interpretation that fits the URDF.

    The tip error must meet this condition:

        error <= max(tolerance, 0.05 min(stated_error, reach))

    `tolerance` is in metres. The file states an interpretation, and `stated_error` is the position error (m)
    after a fit with this interpretation. `data` comes from `mapping_from_text`.
    """
    kinds = [joint.kind.turns for joint in chain.joints]
    shape_of_urdf = path_shape(derive(chain, DerivationOptions(last="flange")), chain.reach)
    try:
        stated = parse_interpretation(data)
    except InputError:  # `table_from_mapping` reports this error.
        return None
    candidates = list[tuple[float, int, Interpretation, DHTable]]()
    for interpretation, table in other_interpretations(data):
        # A joint is prismatic if its variable is in the column d. Other column names can therefore change a
        # joint's kind.
        if [row.kind.turns for row in table.rows] != kinds or not kinds:
            continue
        difference = float(np.abs(path_shape(table, chain.reach) - shape_of_urdf).sum())
        candidates.append((difference, interpretation.difference_count(stated), interpretation, table))
    if not candidates:
        return None
    cost = _DIFFERENCE_COST_RATIO * min(difference for difference, *_ in candidates) + tolerance
    candidates.sort(key=lambda candidate: candidate[0] + cost * candidate[1])
    better = list[tuple[float, BetterInterpretation]]()
    for _, count, interpretation, table in candidates[:_MAX_FITS]:
        try:
            metres, radians = fast_fit_errors(chain, table, tolerance)
        except RangeError:  # A length is too large in this interpretation.
            continue
        error = metres + radians * chain.reach
        if error <= max(tolerance, min(_BETTER_FRACTION * stated_error, _BETTER_FRACTION * chain.reach)):
            result = BetterInterpretation(interpretation, stated, metres, radians)
            better.append((error + tolerance * count, result))
            if error <= tolerance:
                break
    return min(better, key=lambda rated: rated[0])[1] if better else None


def find_dh_convention(
    chain: FrameChain, data: Mapping[str, Any], tolerance: float, where: str = "table"
) -> DHConvention:
    """Find the convention that fits better.

    If neither convention fits, other units and columns are tried.

    Raises:
        InputError: both conventions fit equally well, or no interpretation fits.
    """
    comparisons = dict[DHConvention, TableComparison]()
    errors = list[InputError]()
    for convention in DHConvention:
        try:
            table = parse_table_data({**data, "convention": convention}, where)
            comparisons[convention] = compare(chain, table, tolerance)
        except InputError as error:
            errors.append(error)
    tests: tuple[Callable[[TableComparison], object], ...] = (
        lambda comparison: comparison.agrees and comparison.unfitted_metres <= tolerance,
        lambda comparison: comparison.agrees_without_mistakes,
        lambda comparison: comparison.agrees,
        lambda comparison: comparison.mistakes,
    )
    by_test = ([name for name, comparison in comparisons.items() if test(comparison)] for test in tests)
    best = next(filter(None, by_test), [])
    if len(best) == 1:
        return best[0]
    if (
        not best
        and (better := find_better_interpretation(chain, data, tolerance))
        and better.interpretation.convention
    ):
        return better.interpretation.convention
    if errors and not comparisons:
        raise errors[0]
    tip_errors = (f"{comparison.metres * 1e3:.3g} mm as {name}" for name, comparison in comparisons.items())
    raise InputError(
        f"the table does not name its convention, and {'both conventions fit' if best else 'neither fits'}",
        where=where,
        found=f"tip errors {' and '.join(tip_errors)}",
        remedy="write convention = 'standard' or 'modified' (in text: a line `convention: standard`)",
        question=QuestionsSection.WHICH_DH_CONVENTION,
    )


def path_shape(table: DHTable, scale: float) -> FloatArray:
    """Return offsets, distances and angles between consecutive axes.

    Joint signs, joint offsets, base and tool have no effect. Angles are multiplied by `scale`. Lengths that
    depend on free choices are replaced by 0. These are lengths next to a prismatic axis, the offset along the
    first axis, and the offset along parallel axes.
    """
    rows = to_convention(table, DHConvention.STANDARD).rows
    numbers, offset, is_defined = list[float](), 0.0, False
    for row, following in pairwise(rows):
        both_turn = row.kind.turns and following.kind.turns
        tilt = math.atan2(math.hypot(math.sin(row.alpha), math.sin(row.beta)), abs(math.cos(row.alpha)))
        parallel = tilt < _PARALLEL_TILT
        offset, is_defined = offset + row.d, is_defined and both_turn
        numbers += [
            abs(offset) if is_defined and not parallel else 0.0,
            abs(row.a) if both_turn else 0.0,
            scale * tilt,
        ]
        offset = math.copysign(1.0, math.cos(row.alpha)) * offset if parallel else 0.0
        is_defined = is_defined if parallel else both_turn
    return np.array(numbers)


@dataclass(frozen=True, slots=True)
class Interpretation:
    """Convention, units and columns of a table.

    Attributes:
        columns: Quantities in the columns a, alpha, d and theta, in this order.
            For example, ("d", "alpha", "a", "theta") exchanges a and d.
    """

    convention: DHConvention | None
    lengths: LengthUnit
    angles: AngleUnit
    columns: tuple[str, ...] = COLUMNS

    def table(self, data: Mapping[str, Any]) -> DHTable:
        """Read `data` with this interpretation, without base and tool."""
        stated = {"convention": self.convention, "lengths": self.lengths, "angles": self.angles}
        contents = dict(zip(COLUMNS, self.columns, strict=True))
        rows = [{contents.get(key, key): value for key, value in row.items()} for row in data["rows"]]
        rest = {key: value for key, value in data.items() if key not in _IGNORED_KEYS}
        return table_from_mapping({**rest, **stated, "rows": rows})

    def difference_count(self, other: Interpretation) -> int:
        """Count the differences; two exchanged columns are one difference."""
        columns = sum(
            column != expected for column, expected in zip(self.columns, other.columns, strict=True)
        )
        return len(self._convention_and_units(other)) + (columns + 1) // 2

    def differences(self, other: Interpretation) -> str:
        """Describe differences, such as "modified, millimetres"."""
        names = self._convention_and_units(other)
        if self.columns != other.columns:
            names.append(f"its columns {', '.join(COLUMNS)} as {', '.join(self.columns)}")
        return ", ".join(names)

    def _convention_and_units(self, other: Interpretation) -> list[str]:
        values, other_values = ((one.convention, one.lengths, one.angles) for one in (self, other))
        return [
            str(name) for name, other_name in zip(values, other_values, strict=True) if name is not other_name
        ]


def parse_interpretation(data: Mapping[str, Any]) -> Interpretation:
    units = parse_units(data.get("angles", "radians"), data.get("lengths", "metres"))
    convention = convention_of(data["convention"]) if "convention" in data else None
    return Interpretation(convention, units.lengths, units.angles)


def other_interpretations(data: Mapping[str, Any]) -> Iterator[tuple[Interpretation, DHTable]]:
    """Yield other valid interpretations and tables.

    Interpretations with fewer differences come first.
    """
    rows = data.get("rows")
    if not isinstance(rows, list) or not all(isinstance(row, (list, Mapping)) for row in rows):
        return
    named = (row if isinstance(row, Mapping) else name_cells(row) for row in rows)
    stated = parse_interpretation(data)
    data = {**data, "rows": [{key: row[key] for key in row if key in _ROW_KEYS} for row in named]}
    options = product(DHConvention, LengthUnit, AngleUnit, permutations(COLUMNS))
    interpretations = [Interpretation(*choice) for choice in options]
    for interpretation in sorted(interpretations, key=lambda one: one.difference_count(stated)):
        if interpretation != stated:
            with suppress(InputError):
                yield interpretation, interpretation.table(data)


def find_table_warnings(table: DHTable) -> list[str]:
    warnings = []
    columns = {name: [getattr(row, name) for row in table.rows if getattr(row, name)] for name in COLUMNS}
    lengths = [abs(length) for length in (*columns["a"], *columns["d"])]
    if lengths and max(lengths) > _MAX_LENGTH and all(length > _MIN_LENGTH * 1e3 for length in lengths):
        warnings.append(
            f"lengths up to {max(lengths):.4g} m look like numbers in millimetres:"
            " for a table in millimetres, write lengths = 'millimetres'"
        )
    elif lengths and max(lengths) < _MIN_LENGTH * 2.0:
        warnings.append(
            f"all lengths are at most {max(lengths) * 1e3:.3g} mm, so the numbers are probably metres:"
            " for a table in metres, write lengths = 'metres'"
        )
    angles = [*columns["alpha"], *columns["theta"]]
    if angles and all(looks_round(math.degrees(angle)) for angle in angles):
        warnings.append(
            f"angles such as {math.degrees(angles[0]):.3g} degrees look like numbers in radians:"
            " for a table in radians, write angles = 'radians'"
        )
    for length, angle in (("a", "alpha"), ("d", "theta")):
        lengths_look_round = len(columns[length]) > 1 and all(map(looks_round, columns[length]))
        if lengths_look_round and columns[angle] and not any(map(looks_round, columns[angle])):
            warnings.append(
                f"the columns {length} and {angle} look exchanged: column {length} contains multiples of"
                " 15 degrees"
            )
    return warnings
