"""One row of a table as people write it, a mapping or a list, taken literally or refused with its place."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from urdfkin.dh.elements import looks_round
from urdfkin.dh.expression import Cell, NoCellError, cell_of
from urdfkin.dh.row import DHRow
from urdfkin.dh.units import Angles, Units, cell_in_si, read_number, units_of
from urdfkin.errors import InputError
from urdfkin.errors.demands import shown
from urdfkin.model.tree import JointKind, Limit, Mimic

#: What a list has in this order, with "R" or "P" behind it if it says so; beta has no place there.
ORDER = ("a", "alpha", "d", "theta")
_KINDS = {
    "r": JointKind.REVOLUTE,
    "p": JointKind.PRISMATIC,
    "revolute": JointKind.REVOLUTE,
    "continuous": JointKind.CONTINUOUS,
    "prismatic": JointKind.PRISMATIC,
}
_KEYS = ("joint", "kind", *ORDER, "sense", "beta", "mimic", "limit")
_BY_NAME = "write {a = ..., alpha = ..., d = ..., theta = ...}, which no order can confuse"


def written_row(row: Any, index: int, units: Units) -> DHRow:
    """The row that somebody wrote.

    Args:
        row: A `DHRow`, a mapping of its fields, or a list in the order of `ORDER`.
        index: Which row it is, from 0.
        units: Of its numbers.

    Raises:
        InputError: anything else, with the row and the column.
    """
    if isinstance(row, DHRow):
        return row
    row = row.tolist() if isinstance(row, np.ndarray) else row
    where = f"row {index + 1}"
    fields = row if isinstance(row, Mapping) else _of_list(row, where)
    _known(fields, _KEYS, "a row", where)
    fields = _without_variable(fields, index, where)
    cells = {name: _cell(name, fields.get(name, 0.0), units, where) for name in (*ORDER, "beta")}
    return DHRow(
        **cells,
        kind=_kind(fields.get("kind", "R"), where),
        joint=name_of(fields.get("joint", f"joint_{index + 1}"), f"{where}, joint"),
        sense=_sense(fields.get("sense", 1), where),
        mimic=_mimic(fields.get("mimic"), fields, units, where),
        limit=_limit(fields.get("limit"), fields, units, where),
    )


def refuse_other_order(rows: Sequence[Any]) -> None:
    """Refuse lists whose columns stand in the Robotics Toolbox's order, theta, d, a, alpha.

    Angles are multiples of 15 degrees nearly everywhere, lengths hardly ever. Lists whose second column is
    never such a multiple, but whose first and fourth always are, have angles there and lengths here.

    Raises:
        InputError: with both orders.
    """
    lists = [row for row in rows if isinstance(row, Sequence) and not isinstance(row, str)]
    if len(lists) < len(rows) or not all(_has_order(row) for row in lists):
        return
    first, second, _, fourth = ([row[k] for row in lists if not _is_zero(row[k])] for k in range(4))
    if second and fourth and not any(map(_is_round, second)) and all(map(_is_round, [*first, *fourth])):
        raise InputError(
            "the columns look like theta, d, a, alpha, the Robotics Toolbox's order; a row that is a list has"
            f" {', '.join(ORDER)}",
            where=f"rows 1 to {len(rows)}",
            found=f"second column {second[0]!r}, fourth column {fourth[0]!r}",
            remedy=_BY_NAME,
        )


def name_of(value: Any, where: str) -> str:
    """A name; raises InputError for what is no text or empty."""
    if not isinstance(value, str) or not value.strip():
        raise InputError("a name is text", where=where, found=repr(value), remedy="write it in quotes")
    return value


def _has_order(row: Sequence[Any]) -> bool:
    return len(row) == len(ORDER) or (len(row) == len(ORDER) + 1 and isinstance(row[-1], str))


def _is_zero(value: Any) -> bool:
    return not isinstance(value, str) and value == 0


def _is_round(value: Any) -> bool:
    """Whether a cell, be it radians or degrees, is a multiple of 15 degrees as far as people write them."""
    if isinstance(value, str):
        return "pi" in value
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return False
    return looks_round(value) or looks_round(value, twelfth=15.0)


def _of_list(row: Any, where: str) -> dict[str, Any]:
    wanted = f"[{', '.join(ORDER)}, 'R' or 'P']"
    if not isinstance(row, Sequence) or isinstance(row, (str, bytes)):
        raise InputError(f"a row is a mapping or {wanted}", where=where, found=repr(row))
    if not len(ORDER) <= len(row) <= len(ORDER) + 1:
        raise InputError(
            f"a row is a mapping or {wanted}",
            where=where,
            found=f"{len(row)} entries, {list(row)!r}",
            remedy=_BY_NAME,
        )
    if len(row) > len(ORDER) and not isinstance(row[-1], str):
        raise InputError(
            f"a row's fifth entry is 'R' or 'P': {wanted}",
            where=where,
            found=repr(row[-1]),
            remedy=f"the Robotics Toolbox's order is theta, d, a, alpha, sigma: {_BY_NAME}",
        )
    return dict(zip((*ORDER, "kind"), row, strict=False))


def _known(given: Mapping[str, Any], keys: Sequence[str], what: str, where: str) -> None:
    for key in given:
        if key not in keys:
            raise InputError(
                f"unknown key in {what}", where=where, found=repr(key), remedy=f"keys are {', '.join(keys)}"
            )


def _without_variable(fields: Mapping[str, Any], index: int, where: str) -> Mapping[str, Any]:
    """The row with "q3 + pi" taken apart into a constant, a kind and a sense."""
    written = {name: fields[name] for name in ORDER if isinstance(fields.get(name), str)}
    cells = {name: _read(value, f"{where}, {name}") for name, value in written.items()}
    own = [name for name, cell in cells.items() if cell.times is not None]
    if not own:
        return fields
    name, cell = own[0], cells[own[0]]
    kind = {"theta": "R", "d": "P"}.get(name)
    at = f"{where}, {name}"
    if len(own) > 1 or kind is None or _kind(fields.get("kind", kind), where).turns != (kind == "R"):
        raise InputError(
            "the variable of a joint stands in theta if it turns and in d if it slides",
            where=at,
            found=repr(written[name]),
            remedy="write numbers into the other cells",
        )
    if cell.times not in (1.0, -1.0) or cell.variable not in (None, index + 1) or "sense" in fields:
        raise InputError(
            f"the variable of row {index + 1} is q{index + 1} or -q{index + 1}",
            where=at,
            found=repr(written[name]),
            remedy="a joint that follows another has mimic = {leader, multiplier, offset}",
        )
    constant = f"{cell.number!r} {cell.unit or ''}"
    return {"kind": kind, **fields, name: constant, "sense": cell.times}


def units_in(cell: Cell, units: Units) -> Units:
    """The units of a cell: its own, where it says one."""
    if cell.unit in ("m", "mm"):
        return units_of(units.angles, cell.unit, units.digits)
    return units_of(cell.unit or units.angles, units.lengths, units.digits)


def _read(text: str, where: str) -> Cell:
    try:
        return cell_of(text)
    except NoCellError as error:
        raise InputError(
            "not a number", where=where, found=shown(text), remedy=f"{error}: write 1.5708, pi/2 or 90 deg"
        ) from None


def _cell(name: str, value: Any, units: Units, where: str) -> float:
    """A cell in metres or radians; no angle of a table is more than a turn."""
    in_pi = False
    if isinstance(value, str):
        cell = _read(value, f"{where}, {name}")
        number, in_pi = cell.number, cell.unit == "rad"
        if cell.unit is not None:
            if (cell.unit in ("m", "mm")) != (name in ("a", "d")):
                kind = "a length" if name in ("a", "d") else "an angle"
                raise InputError(f"{name} is {kind}", where=f"{where}, {name}", found=repr(value))
            units = units_in(cell, units)
    else:
        number = read_number(value, f"{where}, {name}")
    if name in ("a", "d"):
        return cell_in_si(name, number, units)
    if not in_pi and units.angles is Angles.RADIANS and abs(number) > 2.0 * math.pi:
        raise InputError(
            f"{name} is more than a turn, if it is radians",
            where=f"{where}, {name}",
            found=repr(value),
            remedy="write angles = 'degrees' if the table's angles are degrees",
        )
    return cell_in_si(name, number, units)


def _kind(value: Any, where: str) -> JointKind:
    kind = _KINDS.get(value.strip().lower()) if isinstance(value, str) else None
    if kind is None:
        raise InputError(
            "a row is revolute, continuous or prismatic",
            where=f"{where}, kind",
            found=repr(value),
            remedy="write R or P",
        )
    return kind


def _sense(value: Any, where: str) -> int:
    number = read_number(value, f"{where}, sense")
    if number not in (1.0, -1.0):
        raise InputError(
            "the sense is 1 or -1",
            where=f"{where}, sense",
            found=repr(value),
            remedy="-1 counts the joint the other way; a factor stands in mimic as multiplier",
        )
    return int(number)


def _own(name: str, value: Any, fields: Mapping[str, Any], units: Units, where: str) -> float:
    """A number in the unit of the joint's own value: an angle if it turns, a length if it slides."""
    number = read_number(value, f"{where}, {name}")
    return cell_in_si("theta" if _kind(fields.get("kind", "R"), where).turns else "d", number, units)


def _mimic(value: Any, fields: Mapping[str, Any], units: Units, where: str) -> Mimic | None:
    if value is None:
        return None
    if not isinstance(value, Mapping) or "leader" not in value:
        raise InputError("mimic is {leader, multiplier, offset}", where=where, found=repr(value))
    _known(value, ("leader", "multiplier", "offset"), "mimic", where)
    return Mimic(
        name_of(value["leader"], f"{where}, leader"),
        read_number(value.get("multiplier", 1.0), f"{where}, multiplier"),
        _own("offset", value.get("offset", 0.0), fields, units, where),
    )


def _limit(value: Any, fields: Mapping[str, Any], units: Units, where: str) -> Limit | None:
    if value is None:
        return None
    if not isinstance(value, Mapping):
        raise InputError("limit is {lower, upper, velocity, effort}", where=where, found=repr(value))
    _known(value, ("lower", "upper", "velocity", "effort"), "limit", where)
    lower, upper, velocity = (
        _own(name, value[name], fields, units, where) if name in value else default
        for name, default in (("lower", -math.inf), ("upper", math.inf), ("velocity", math.inf))
    )
    if lower > upper:
        raise InputError(
            "lower is above upper",
            where=f"{where}, limit",
            found=f"{value['lower']!r} and {value['upper']!r}",
        )
    effort = read_number(value["effort"], f"{where}, effort") if "effort" in value else math.inf
    return Limit(lower, upper, velocity, effort)
