"""Make tables from handwritten rows in Python, TOML, JSON or CSV, in the units that the data state.

All formats are converted to the same mapping:

    convention = "modified"         # or "standard"; required
    angles = "degrees"              # default: radians
    lengths = "millimetres"         # default: metres
    robot, base_frame, tip_frame    # names, optional
    base, tool                      # 4 x 4 (or 3 x 4); default: the identity
    coordinates = ["j7", ...]       # only for mimicked joints that have no row
    rows = [{joint = "j1", kind = "revolute", a = 0, alpha = "-pi/2", d = 0.3, theta = 0}, ...]

A row may also be a list [a, alpha, d, theta, "R" or "P"]. `theta` and `d` are the constant parts, without the
joint's value. In a modified table, a and alpha of row i are a_{i-1} and alpha_{i-1}. A row's entry `mimic` is
{mimicked_joint, multiplier, offset}. A row's entry `limit` is {lower, upper, velocity, effort}. The units
apply to cells, limits and mimic offsets. The positions of base and tool have the unit `lengths`. A multiplier
is the ratio of two joint values in SI units. An effort is in N or N m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal, InvalidOperation
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.table import DHRow, DHTable, convention_of, looks_round
from urdfkin.dh.units import (
    COLUMNS,
    AngleUnit,
    Cell,
    InvalidCellError,
    Units,
    convert_to_si,
    parse_cell,
    parse_number,
    parse_units,
)
from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.errors.validators import safe_repr
from urdfkin.model.tree import FloatArray, JointKind, Limit, Mimic

_CELLS = (*COLUMNS, "beta")
_KINDS = {
    "r": JointKind.REVOLUTE,
    "p": JointKind.PRISMATIC,
    "revolute": JointKind.REVOLUTE,
    "continuous": JointKind.CONTINUOUS,
    "prismatic": JointKind.PRISMATIC,
}
_MIMIC_KEYS, LIMIT_KEYS = ("mimicked_joint", "multiplier", "offset"), ("lower", "upper", "velocity", "effort")
_ROW_KEYS = ("joint", "kind", *_CELLS, "sense", "mimic", "limit")
_TABLE_KEYS = (
    *("convention", "angles", "lengths", "robot", "base_frame", "tip_frame", "base", "tool"),
    *("coordinates", "rows"),
)
#: Keys of a table that have no effect on its numbers.
_NOTE_KEYS = ("source", "source_kind", "note", "name", "urdf", "snap", "last", "fit_sign", "checked", "lock")
_MAPPING_REMEDY = "write {a = ..., alpha = ..., d = ..., theta = ...}, where the order does not matter"


class NumberWithText(float):
    """A number with its original text."""

    text: str

    def __new__(cls, text: str) -> NumberWithText:
        number = super().__new__(cls, text)
        number.text = text
        return number


def half_digits_by_row(data: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
    """Return half a unit of each cell's last digit (m or rad), by row.

    `data` must be a result of `urdfkin.dh.parse_table.mapping_from_text`.
    """
    units = parse_units(data.get("angles", "radians"), data.get("lengths", "metres"))
    rows = []
    for row in data["rows"]:
        cells = row if isinstance(row, Mapping) else name_cells(row)
        rows.append({name: _half_digit_in_si(name, cells[name], units) for name in _CELLS if name in cells})
    return tuple(rows)


def _half_digit_in_si(name: str, value: object, units: Units) -> float:
    if isinstance(value, str):
        units = units_of_cell(parse_cell(value), units)
    return convert_to_si(name, half_digit(value, name in ("a", "d") and units.uses_millimetres), units)


def half_digit(value: object, whole_is_rounded: bool = False) -> float:
    """Return half a unit of a number's last digit; 0 for an exact number.

    A whole number is exact unless `whole_is_rounded`.

    >>> half_digit(NumberWithText("0.3111")), half_digit("90"), half_digit(425, True), half_digit("pi")
    (5e-05, 0.0, 0.5, 0.0)
    """
    text = value.text if isinstance(value, NumberWithText) else str(value)
    text = (parse_cell(value).text or "0") if isinstance(value, str) else text
    try:
        number = Decimal(text)
    except InvalidOperation:
        return 0.0
    exponent = number.as_tuple().exponent
    if not number or not isinstance(exponent, int) or (exponent >= 0 and not whole_is_rounded):
        return 0.0
    return 0.5 * 10.0 ** min(exponent, 0)


def name_cells(row: Sequence[Any]) -> dict[str, Any]:
    return dict(zip((*COLUMNS, "kind"), row, strict=False))


def parse_row(row: Any, index: int, units: Units) -> DHRow:
    """Parse a handwritten row; `index` begins at 0."""
    if isinstance(row, DHRow):
        return row
    row = row.tolist() if isinstance(row, np.ndarray) else row
    where = f"row {index + 1}"
    fields = row if isinstance(row, Mapping) else _parse_list(row, where)
    check_keys(fields, _ROW_KEYS, "a row", where)
    fields = _split_variable(fields, index, where)
    cells = {name: _parse_value(name, fields.get(name, 0.0), units, where) for name in _CELLS}
    return DHRow(
        **cells,
        kind=_parse_kind(fields.get("kind", "R"), where),
        joint=parse_name(fields.get("joint", f"joint_{index + 1}"), f"{where}, joint"),
        sense=_parse_sense(fields.get("sense", 1), where),
        mimic=_parse_mimic(fields.get("mimic"), fields, units, where),
        limit=_parse_limit(fields.get("limit"), fields, units, where),
    )


def _check_column_order(rows: Sequence[Any]) -> None:
    """Detect the Robotics Toolbox's order theta, d, a, alpha.

    Angles are usually multiples of 15 degrees or of pi/12. Lengths other than 0 rarely are.
    """
    lists = [row for row in rows if isinstance(row, Sequence) and not isinstance(row, str)]
    if len(lists) < len(rows) or not all(_has_list_form(row) for row in lists):
        return
    first, second, _, fourth = ([row[k] for row in lists if row[k] != 0] for k in range(4))
    if (
        second
        and fourth
        and not any(map(_looks_like_round_angle, second))
        and all(map(_looks_like_round_angle, [*first, *fourth]))
    ):
        raise InputError(
            "the columns look like theta, d, a, alpha (Robotics Toolbox); a list must have the order"
            f" {', '.join(COLUMNS)}",
            where=f"rows 1 to {len(rows)}",
            found=f"second column {second[0]!r}, fourth column {fourth[0]!r}",
            remedy=_MAPPING_REMEDY,
        )


def parse_name(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError("a name must be text", where=where, found=repr(value), remedy="write it in quotes")
    return value


def _has_list_form(row: Sequence[Any]) -> bool:
    return len(row) == len(COLUMNS) or (len(row) == len(COLUMNS) + 1 and isinstance(row[-1], str))


def _looks_like_round_angle(value: Any) -> bool:
    if isinstance(value, str):
        return "pi" in value
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return False
    return looks_round(value) or looks_round(value, twelfth=15.0)


def _parse_list(row: Any, where: str) -> dict[str, Any]:
    form = f"[{', '.join(COLUMNS)}, 'R' or 'P']"
    if not isinstance(row, Sequence) or isinstance(row, (str, bytes)):
        raise InputError(f"a row must be a mapping or {form}", where=where, found=repr(row))
    if not len(COLUMNS) <= len(row) <= len(COLUMNS) + 1:
        raise InputError(
            f"a row must be a mapping or {form}",
            where=where,
            found=f"{len(row)} entries, {list(row)!r}",
            remedy=_MAPPING_REMEDY,
        )
    if len(row) > len(COLUMNS) and not isinstance(row[-1], str):
        raise InputError(
            f"a row's fifth entry must be 'R' or 'P': {form}",
            where=where,
            found=repr(row[-1]),
            remedy=f"the Robotics Toolbox's order is theta, d, a, alpha, sigma: {_MAPPING_REMEDY}",
        )
    return name_cells(row)


def check_keys(keys: Iterable[str], known: Sequence[str], what: str, where: str | None = None) -> None:
    for key in keys:
        if key not in known:
            raise InputError(
                f"unknown key in {what}",
                where=where,
                found=repr(key),
                remedy=f"the known keys are {', '.join(known)}",
            )


def _split_variable(fields: Mapping[str, Any], index: int, where: str) -> Mapping[str, Any]:
    """Remove the joint's variable from a cell.

    The variable determines `kind` and `sense`.
    """
    texts = {name: fields[name] for name in COLUMNS if isinstance(fields.get(name), str)}
    cells = {name: _parse_cell_text(text, f"{where}, {name}") for name, text in texts.items()}
    variables = [name for name, cell in cells.items() if cell.variable_factor is not None]
    if not variables:
        return fields
    name = variables[0]
    cell, kind = cells[name], {"theta": "R", "d": "P"}.get(name)
    at, found = f"{where}, {name}", repr(texts[name])
    if (
        len(variables) > 1
        or kind is None
        or _parse_kind(fields.get("kind", kind), where).turns != (kind == "R")
    ):
        raise InputError(
            "the joint variable belongs in theta of a revolute joint, or in d of a prismatic joint",
            where=at,
            found=found,
            remedy="write only numbers into all other cells of the row",
        )
    if cell.variable_factor not in (1.0, -1.0) or cell.variable not in (None, index + 1):
        raise InputError(
            f"the variable of row {index + 1} must be q{index + 1} or -q{index + 1}",
            where=at,
            found=found,
            remedy="for a mimic joint write mimic = {mimicked_joint, multiplier, offset}",
        )
    if "sense" in fields:
        raise InputError(
            "a row with a joint variable must not have `sense`: the variable's sign is the sense",
            where=at,
            found=f"{found}, sense {fields['sense']!r}",
            remedy="write only one of them",
        )
    return {"kind": kind, **fields, name: cell.constant, "sense": cell.variable_factor}


def units_of_cell(cell: Cell, units: Units) -> Units:
    if cell.unit in ("m", "mm"):
        return parse_units(units.angles, cell.unit, units.digits)
    return parse_units(cell.unit or units.angles, units.lengths, units.digits)


def _parse_cell_text(text: str, where: str) -> Cell:
    try:
        return parse_cell(text)
    except InvalidCellError as error:
        raise InputError(
            "this is not a number",
            where=where,
            found=safe_repr(text),
            remedy=f"{error}: write 1.5708, pi/2 or 90 deg",
        ) from None


def _parse_quantity(
    name: str, value: Any, is_length: bool, units: Units, where: str
) -> tuple[float, Units, bool]:
    """Return a number, its units, and whether the value states its own unit."""
    if not isinstance(value, str):
        return parse_number(value, where), units, False
    cell = _parse_cell_text(value, where)
    if cell.variable_factor is not None:
        raise InputError(f"{name} must not contain a joint variable", where=where, found=repr(value))
    if cell.unit is None:
        return cell.number, units, False
    if (cell.unit in ("m", "mm")) != is_length:
        kind = "a length" if is_length else "an angle"
        raise InputError(f"{name} must be {kind}", where=where, found=repr(value))
    return cell.number, units_of_cell(cell, units), True


def _parse_value(name: str, value: Any, units: Units, where: str) -> float:
    is_length, at = name in ("a", "d"), f"{where}, {name}"
    number, units, has_unit = _parse_quantity(name, value, is_length, units, at)
    may_be_degrees = not is_length and not has_unit and units.angles is AngleUnit.RADIANS
    if may_be_degrees and abs(number) > 2.0 * math.pi:
        raise InputError(
            f"{name} is more than one turn in radians",
            where=at,
            found=repr(value),
            remedy="write angles = 'degrees' if the table's angles are degrees",
        )
    return convert_to_si(name, number, units)


def _parse_kind(value: Any, where: str) -> JointKind:
    kind = _KINDS.get(value.strip().lower()) if isinstance(value, str) else None
    if kind is None:
        raise InputError(
            "the kind of a row must be revolute, continuous or prismatic",
            where=f"{where}, kind",
            found=repr(value),
            remedy="write R (revolute) or P (prismatic)",
        )
    return kind


def _parse_sense(value: Any, where: str) -> int:
    number = parse_number(value, f"{where}, sense")
    if number not in (1.0, -1.0):
        raise InputError(
            "`sense` must be 1 or -1",
            where=f"{where}, sense",
            found=repr(value),
            remedy="write `sense` -1 to reverse the joint; write any other factor as `multiplier` in `mimic`",
        )
    return int(number)


def _parse_joint_value(name: str, value: Any, fields: Mapping[str, Any], units: Units, where: str) -> float:
    turns = _parse_kind(fields.get("kind", "R"), where).turns
    number, units, _ = _parse_quantity(name, value, not turns, units, f"{where}, {name}")
    return convert_to_si("theta" if turns else "d", number, units)


def _parse_mimic(value: Any, fields: Mapping[str, Any], units: Units, where: str) -> Mimic | None:
    if value is None:
        return None
    if not isinstance(value, Mapping) or "mimicked_joint" not in value:
        raise InputError(
            "`mimic` must have the form {mimicked_joint, multiplier, offset}", where=where, found=repr(value)
        )
    check_keys(value, _MIMIC_KEYS, "mimic", where)
    return Mimic(
        parse_name(value["mimicked_joint"], f"{where}, mimicked_joint"),
        parse_number(value.get("multiplier", 1.0), f"{where}, multiplier"),
        _parse_joint_value("offset", value.get("offset", 0.0), fields, units, where),
    )


def _parse_limit(value: Any, fields: Mapping[str, Any], units: Units, where: str) -> Limit | None:
    if value is None:
        return None
    if not isinstance(value, Mapping):
        raise InputError(
            "`limit` must have the form {lower, upper, velocity, effort}", where=where, found=repr(value)
        )
    check_keys(value, LIMIT_KEYS, "limit", where)
    lower, upper, velocity = (
        _parse_joint_value(name, value[name], fields, units, where) if name in value else default
        for name, default in (("lower", -math.inf), ("upper", math.inf), ("velocity", math.inf))
    )
    if lower > upper:
        raise InputError(
            "`lower` is above `upper`",
            where=f"{where}, limit",
            found=f"{value['lower']!r} and {value['upper']!r}",
        )
    effort = parse_number(value["effort"], f"{where}, effort") if "effort" in value else math.inf
    return Limit(lower, upper, velocity, effort)


def table_from_rows(
    rows: Any,
    convention: str,
    *,
    angles: str = "radians",
    lengths: str = "metres",
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
    robot: str = "robot",
    base_frame: str = "base",
    tip_frame: str = "tip",
    coordinates: Sequence[str] = (),
) -> DHTable:
    """Make a table from handwritten rows.

    Args:
        rows: The rows: each is a `DHRow`, a mapping or a list. A `DHRow` is always in metres and radians. A
            list is [a, alpha, d, theta], optionally with "R" or "P" at the end.
        convention: "standard" or "modified".
        angles: "radians" or "degrees".
        lengths: "metres" or "millimetres".
        base: (4, 4) or (3, 4) T_base_0, in the unit `lengths`; None: the identity.
        tool: (4, 4) or (3, 4) T_n_tip, in the unit `lengths`; None: the identity.
        robot: The robot's name.
        base_frame: Name of the base frame.
        tip_frame: Name of the tip frame.
        coordinates: Names of the mimicked joints that have no row.

    Raises:
        InputError: an argument or a row is invalid, a joint has two rows, or rows, base and tool are missing.
        UnknownNameError: a mimicked joint has no row and is not in `coordinates`.

    Example:
        >>> table = table_from_rows([[0, 90, 0.3, 0], [0.4, 0, 0, 0]], "standard", angles="degrees")
        >>> table.joint_names, table.placement([0, 0])[:3, 3].tolist()
        (('joint_1', 'joint_2'), [0.4, 0.0, 0.3])
    """
    units = parse_units(angles, lengths)
    rows = rows.tolist() if isinstance(rows, np.ndarray) else rows
    if not isinstance(rows, Sequence) or isinstance(rows, (str, bytes)):
        raise InputError("a table needs a list of rows", where="rows", found=safe_repr(rows))
    if len(rows) == 0 and base is None and tool is None:
        raise InputError(
            "a table needs a row, a base or a tool",
            where="rows",
            found="[]",
            remedy="write a row for each moving joint",
        )
    _check_column_order(rows)
    parsed = tuple(parse_row(row, i, units) for i, row in enumerate(rows))
    _check_mimicked_joints(parsed, coordinates)
    return DHTable(
        convention_of(convention),
        parsed,
        _parse_pose(base, "base", units),
        _parse_pose(tool, "tool", units),
        parse_name(robot, "robot"),
        parse_name(base_frame, "base_frame"),
        parse_name(tip_frame, "tip_frame"),
    )


def table_from_mapping(data: Mapping[str, Any]) -> DHTable:
    """Make a table from a mapping.

    The module's docstring shows the keys.

    Raises:
        InputError: the convention is missing, a key is unknown, or `table_from_rows` raises this error.
        UnknownNameError: as in `table_from_rows`.
    """
    if not isinstance(data, Mapping):
        raise InputError("a table must be a mapping", found=safe_repr(data))
    if "convention" not in data:
        raise InputError(
            "the table does not name its convention",
            remedy="write convention = 'standard' or 'modified' (in text: a line `convention: standard`)",
            question=QuestionsSection.WHICH_DH_CONVENTION,
        )
    check_keys([key for key in data if key not in _NOTE_KEYS], _TABLE_KEYS, "a table")
    options = {key: data[key] for key in _TABLE_KEYS if key in data and key not in ("convention", "rows")}
    return table_from_rows(data.get("rows"), data["convention"], **options)


def _check_mimicked_joints(rows: Sequence[DHRow], coordinates: Any) -> None:
    if not isinstance(coordinates, Sequence) or isinstance(coordinates, str):
        raise InputError(
            "`coordinates` must be a list of names", where="coordinates", found=repr(coordinates)
        )
    independent = {row.joint for row in rows if row.mimic is None}
    known = [*independent, *(parse_name(name, "coordinates") for name in coordinates)]
    for i, row in enumerate(rows):
        if row.mimic is None or row.mimic.mimicked_joint in known:
            continue
        where = f"row {i + 1}, mimicked_joint"
        if any(row.mimic.mimicked_joint == other.joint for other in rows):
            raise InputError(
                "a joint cannot mimic a mimic joint",
                where=where,
                found=repr(row.mimic.mimicked_joint),
                remedy=f"mimic the joint that {row.mimic.mimicked_joint!r} mimics,"
                " with the product of the two multipliers",
            )
        error = UnknownNameError("joint", row.mimic.mimicked_joint, known, where=where)
        error.remedy = (
            f"{error.remedy}; if the mimicked joint has no row, list its name in coordinates = [...]"
        )
        raise error


def _parse_pose(value: ArrayLike | None, what: str, units: Units) -> FloatArray:
    if value is None:
        return np.eye(4)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    rows = value if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) else ()
    if len(rows) not in (3, 4) or not all(isinstance(row, Sequence) and len(row) == 4 for row in rows):
        raise InputError(
            f"the {what} must be a matrix of numbers, 4 x 4 or 3 x 4", where=what, found=safe_repr(value)
        )
    pose = np.eye(4)
    for i, row in enumerate(rows):
        pose[i] = [
            parse_number(number, f"{what}, row {i + 1}, column {j + 1}") for j, number in enumerate(row)
        ]
    if units.uses_millimetres:
        pose[:3, 3] /= 1000.0
    return pose
