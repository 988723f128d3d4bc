"""Tables from rows that people write: code, TOML, JSON and CSV, in the units they say.

One form underlies all of them, a mapping:

    convention = "modified"         # or "standard"; never guessed
    angles = "degrees"              # radians when not said
    lengths = "millimetres"         # metres when not said
    robot, base_frame, tip_frame    # names, optional
    base, tool                      # 4 x 4 (or 3 x 4), always metres; the identity when not said
    rows = [{joint = "j1", kind = "revolute", a = 0, alpha = "-pi/2", d = 0.3, theta = 0}, ...]

A row may also be a list [a, alpha, d, theta, "R" or "P"]; `theta` and `d` are the constant parts. In a
modified table a and alpha of row i are a_{i-1} and alpha_{i-1}.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.row import DHRow, convention_of
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Angles, Lengths, Units, read_number, units_of
from urdfkin.errors import InputError
from urdfkin.tree import FloatArray, JointKind, Limit, Mimic

_KINDS = {
    "r": JointKind.REVOLUTE,
    "p": JointKind.PRISMATIC,
    "revolute": JointKind.REVOLUTE,
    "continuous": JointKind.CONTINUOUS,
    "prismatic": JointKind.PRISMATIC,
}
_ROW_KEYS = ("joint", "kind", "a", "alpha", "d", "theta", "sense", "beta", "mimic", "limit")
_TABLE_KEYS = ("convention", "angles", "lengths", "robot", "base_frame", "tip_frame", "base", "tool", "rows")
#: Keys that a file may carry for people: where the numbers come from, and about which URDF.
NOTES = ("source", "source_kind", "note", "name", "urdf", "snap", "last", "fit_sign", "checked")


def table_from_rows(
    rows: Sequence[Any],
    convention: str,
    *,
    angles: str = "radians",
    lengths: str = "metres",
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
    robot: str = "robot",
    base_frame: str = "base",
    tip_frame: str = "tip",
) -> DHTable:
    """A table from rows written by hand.

    Args:
        rows: Each a `DHRow` (always metres and radians), a mapping with the row's fields, or a list
            [a, alpha, d, theta] with an optional "R" or "P".
        convention: "standard" or "modified".
        angles: "radians" or "degrees".
        lengths: "metres" or "millimetres".
        base: (4, 4) or (3, 4) T_base_0, metres; the identity when None.
        tool: Likewise T_n_tip.
        robot: The robot's name.
        base_frame: What the base is called.
        tip_frame: What the tip is called.

    Raises:
        InputError: an unknown convention or unit, a row that is none, two rows for one joint.

    Example:
        >>> table = table_from_rows([[0, 90, 0.3, 0], [0.4, 0, 0, 0]], "standard", angles="degrees")
        >>> table.joint_names, table.placement([0, 0])[:3, 3].tolist()
        (('joint_1', 'joint_2'), [0.4, 0.0, 0.3])
    """
    units = units_of(angles, lengths)
    made = tuple(_row(row, i, units) for i, row in enumerate(rows))
    return DHTable(
        convention_of(convention),
        made,
        _pose(base, "base"),
        _pose(tool, "tool"),
        robot,
        base_frame,
        tip_frame,
    )


def table_from_mapping(data: Mapping[str, Any]) -> DHTable:
    """A table from the mapping of the module's first lines.

    Raises:
        InputError: no convention, an unknown key, or whatever `table_from_rows` raises.
    """
    if "convention" not in data:
        raise InputError(
            "the table does not say its convention", remedy="write convention = 'standard' or 'modified'"
        )
    for key in data:
        if key not in _TABLE_KEYS and key not in NOTES:
            raise InputError(
                "unknown key in a table", found=repr(key), remedy=f"keys are {', '.join(_TABLE_KEYS)}"
            )
    options = {key: data[key] for key in _TABLE_KEYS if key in data and key not in ("convention", "rows")}
    rows = data.get("rows")
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        raise InputError("a table needs a list of rows", found=repr(rows))
    return table_from_rows(rows, str(data["convention"]), **options)


def _row(row: Any, index: int, units: Units) -> DHRow:
    if isinstance(row, DHRow):
        return row
    where = f"row {index + 1}"
    if isinstance(row, Mapping):
        return _row_of_mapping(row, index, units, where)
    if not isinstance(row, Sequence) or isinstance(row, str) or not 4 <= len(row) <= 5:
        raise InputError(
            "a row is a mapping or [a, alpha, d, theta, 'R' or 'P']", where=where, found=repr(row)
        )
    fields = dict(zip(("a", "alpha", "d", "theta", "kind"), row, strict=False))
    return _row_of_mapping(fields, index, units, where)


def _row_of_mapping(row: Mapping[str, Any], index: int, units: Units, where: str) -> DHRow:
    for key in row:
        if key not in _ROW_KEYS:
            raise InputError(
                "unknown key in a row",
                where=where,
                found=repr(key),
                remedy=f"keys are {', '.join(_ROW_KEYS)}",
            )
    kind = _KINDS.get(str(row.get("kind", "R")).lower())
    if kind is None:
        raise InputError(
            "a row is revolute, continuous or prismatic",
            where=where,
            found=repr(row["kind"]),
            remedy="write R or P",
        )
    return DHRow(
        a=_length(row.get("a", 0.0), units, f"{where}, a"),
        alpha=_angle(row.get("alpha", 0.0), units, f"{where}, alpha"),
        d=_length(row.get("d", 0.0), units, f"{where}, d"),
        theta=_angle(row.get("theta", 0.0), units, f"{where}, theta"),
        kind=kind,
        joint=str(row.get("joint") or f"joint_{index + 1}"),
        sense=int(read_number(row.get("sense", 1), f"{where}, sense")),
        beta=_angle(row.get("beta", 0.0), units, f"{where}, beta"),
        mimic=_mimic(row.get("mimic"), where),
        limit=_limit(row.get("limit"), where),
    )


def _length(value: Any, units: Units, where: str) -> float:
    metres = read_number(value, where)
    return metres / 1000.0 if units.lengths is Lengths.MILLIMETRES else metres


def _angle(value: Any, units: Units, where: str) -> float:
    """Radians; "pi/2" is radians whatever the unit of plain numbers, 90 degrees is pi/2 to the bit."""
    number = read_number(value, where)
    if units.angles is Angles.RADIANS or (isinstance(value, str) and "pi" in value):
        return number
    twelfths = number / 15.0
    return twelfths * math.pi / 12.0 if twelfths == round(twelfths) else math.radians(number)


def _mimic(value: Any, where: str) -> Mimic | None:
    if value is None:
        return None
    if not isinstance(value, Mapping) or "leader" not in value:
        raise InputError("mimic is {leader, multiplier, offset}", where=where, found=repr(value))
    numbers = [
        read_number(value.get(key, default), f"{where}, {key}")
        for key, default in (("multiplier", 1.0), ("offset", 0.0))
    ]
    return Mimic(str(value["leader"]), *numbers)


def _limit(value: Any, where: str) -> Limit | None:
    if value is None:
        return None
    if not isinstance(value, Mapping):
        raise InputError("limit is {lower, upper, velocity, effort}", where=where, found=repr(value))
    keys = (("lower", -np.inf), ("upper", np.inf), ("velocity", np.inf), ("effort", np.inf))
    return Limit(*(read_number(value.get(key, default), f"{where}, {key}") for key, default in keys))


def _pose(value: ArrayLike | None, what: str) -> FloatArray:
    if value is None:
        return np.eye(4)
    try:
        pose = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"the {what} is a matrix of numbers", found=repr(value)) from None
    return np.vstack([pose, [0.0, 0.0, 0.0, 1.0]]) if pose.shape == (3, 4) else pose
