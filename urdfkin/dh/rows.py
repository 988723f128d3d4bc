"""Tables from rows that people write: code, TOML, JSON and CSV, in the units they say.

One form underlies all of them, a mapping:

    convention = "modified"         # or "standard"; never guessed
    angles = "degrees"              # radians when not said
    lengths = "millimetres"         # metres when not said
    robot, base_frame, tip_frame    # names, optional
    base, tool                      # 4 x 4 (or 3 x 4); the identity when not said
    coordinates = ["leader", ...]   # only where a joint follows one that is on no row
    rows = [{joint = "j1", kind = "revolute", a = 0, alpha = "-pi/2", d = 0.3, theta = 0}, ...]

A row may also be a list [a, alpha, d, theta, "R" or "P"]; `theta` and `d` are the constant parts. In a
modified table a and alpha of row i are a_{i-1} and alpha_{i-1}. A row's `mimic` is {leader, multiplier,
offset}, its `limit` {lower, upper, velocity, effort}. The units hold for cells, limits, offsets of followers
and for the places of base and tool; a multiplier is a ratio of SI values, an effort N or N m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.row import DHRow, convention_of
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units, read_number, units_of
from urdfkin.dh.written_row import name_of, refuse_other_order, written_row
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.demands import shown
from urdfkin.errors.questions import Question
from urdfkin.model.tree import FloatArray

_TABLE_KEYS = (
    *("convention", "angles", "lengths", "robot", "base_frame", "tip_frame", "base", "tool"),
    *("coordinates", "rows"),
)
#: Keys that a file may carry for people: where the numbers come from, and about which URDF.
NOTES = ("source", "source_kind", "note", "name", "urdf", "snap", "last", "fit_sign", "checked")


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
    """A table from rows written by hand.

    Args:
        rows: Each a `DHRow` (always metres and radians), a mapping with the row's fields, or a list
            [a, alpha, d, theta] with an optional "R" or "P".
        convention: "standard" or "modified".
        angles: "radians" or "degrees".
        lengths: "metres" or "millimetres".
        base: (4, 4) or (3, 4) T_base_0, its lengths like the rows'; the identity when None.
        tool: Likewise T_n_tip.
        robot: The robot's name.
        base_frame: What the base is called.
        tip_frame: What the tip is called.
        coordinates: Joints that move rows without standing in one: leaders that are elsewhere on the robot.

    Raises:
        InputError: an unknown convention or unit, a row that is none or none at all, two rows for one joint.
        UnknownNameError: a row follows a joint that is neither a row's nor a coordinate.

    Example:
        >>> table = table_from_rows([[0, 90, 0.3, 0], [0.4, 0, 0, 0]], "standard", angles="degrees")
        >>> table.joint_names, table.placement([0, 0])[:3, 3].tolist()
        (('joint_1', 'joint_2'), [0.4, 0.0, 0.3])
    """
    units = units_of(angles, lengths)
    rows = rows.tolist() if isinstance(rows, np.ndarray) else rows
    if not isinstance(rows, Sequence) or isinstance(rows, (str, bytes)):
        raise InputError("a table needs a list of rows", where="rows", found=shown(rows))
    if len(rows) == 0 and base is None and tool is None:
        raise InputError(
            "a table without rows, base and tool says nothing",
            where="rows",
            found="[]",
            remedy="write a row for each moving joint",
        )
    refuse_other_order(rows)
    made = tuple(written_row(row, i, units) for i, row in enumerate(rows))
    _check_leaders(made, coordinates)
    return DHTable(
        convention_of(convention),
        made,
        _pose(base, "base", units),
        _pose(tool, "tool", units),
        name_of(robot, "robot"),
        name_of(base_frame, "base_frame"),
        name_of(tip_frame, "tip_frame"),
    )


def table_from_mapping(data: Mapping[str, Any]) -> DHTable:
    """A table from the mapping of the module's first lines.

    Raises:
        InputError: no convention, an unknown key, or whatever `table_from_rows` raises.
    """
    if "convention" not in data:
        raise InputError(
            "the table does not say its convention",
            remedy="write convention = 'standard' or 'modified', in a sheet a line `convention: standard`",
            question=Question.WHICH_DH_CONVENTION,
        )
    for key in data:
        if key not in _TABLE_KEYS and key not in NOTES:
            raise InputError(
                "unknown key in a table", found=repr(key), remedy=f"keys are {', '.join(_TABLE_KEYS)}"
            )
    options = {key: data[key] for key in _TABLE_KEYS if key in data and key not in ("convention", "rows")}
    return table_from_rows(data.get("rows"), data["convention"], **options)


def _check_leaders(rows: Sequence[DHRow], coordinates: Any) -> None:
    """A leader has a row of its own, or is said to be elsewhere; it does not follow another."""
    if not isinstance(coordinates, Sequence) or isinstance(coordinates, str):
        raise InputError("coordinates are a list of names", where="coordinates", found=repr(coordinates))
    leads = {row.joint for row in rows if row.mimic is None}
    known = [*leads, *(name_of(name, "coordinates") for name in coordinates)]
    for i, row in enumerate(rows):
        if row.mimic is None or row.mimic.leader in known:
            continue
        where = f"row {i + 1}, leader"
        if any(row.mimic.leader == other.joint for other in rows):
            raise InputError(
                "a joint cannot follow one that follows",
                where=where,
                found=repr(row.mimic.leader),
                remedy="name the joint at the end, with the multipliers multiplied",
            )
        error = UnknownNameError("joint", row.mimic.leader, known, where=where)
        error.remedy = f"{error.remedy}; a leader that no row has is named in coordinates = [...]"
        raise error


def _pose(value: ArrayLike | None, what: str, units: Units) -> FloatArray:
    if value is None:
        return np.eye(4)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    rows = value if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) else ()
    if len(rows) not in (3, 4) or not all(isinstance(row, Sequence) and len(row) == 4 for row in rows):
        raise InputError(f"the {what} is a matrix of numbers, 4 x 4 or 3 x 4", where=what, found=shown(value))
    pose = np.eye(4)
    for i, row in enumerate(rows):
        pose[i] = [
            read_number(number, f"{what}, row {i + 1}, column {j + 1}") for j, number in enumerate(row)
        ]
    if units.counts_millimetres:
        pose[:3, 3] /= 1000.0
    return pose
