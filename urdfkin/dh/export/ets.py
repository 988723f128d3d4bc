"""Export a table as a sequence of elementary transforms (Haviland and Corke) in Python for roboticstoolbox.

Each elementary transform is a rotation, a translation or a joint. The fifth parameter of a Hayati row is one
more transform. The numerical solvers of roboticstoolbox accept such a sequence.
"""

from __future__ import annotations

from urdfkin.dh.export.numeric_code import bounds, demand_free, docstring, numbers, plain
from urdfkin.dh.export.text import is_identity
from urdfkin.dh.table import Convention, DHRow, DHTable
from urdfkin.dh.units import Units
from urdfkin.model.tree import FloatArray


def write_ets(table: DHTable, units: Units) -> str:
    """Return a module with `ets`, and `robot`, a Robot of these transforms.

    Raises:
        InputError: a mimic joint.
    """
    del units
    demand_free(table, "a sequence of elementary transforms")
    lines = docstring(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "from roboticstoolbox import ET", ""]
    lines += ["ets = rtb.ETS(", "    [", *_pose(table.base, always=not table.rows)]
    lines += [
        f"        {', '.join(_row(row, table.convention))},  # {plain(row.joint)}" for row in table.rows
    ]
    lines += [*_pose(table.tool), "    ]", ")", f'robot = rtb.Robot(ets, name="{plain(table.robot)}")']
    return "\n".join(lines) + "\n"


def joint(row: DHRow) -> list[str]:
    """Return roboticstoolbox's arguments for a joint's sense and limits."""
    limits = bounds(row)
    return ["flip=True"] * (row.sense < 0) + ([f"qlim=[{limits}]"] if limits else [])


def _row(row: DHRow, convention: Convention) -> list[str]:
    moves = ", ".join(joint(row))
    along = [
        *_unless_zero("Rz", row.theta),
        *([f"ET.Rz({moves})"] * row.kind.turns),
        *_unless_zero("tz", row.d),
    ]
    along += [f"ET.tz({moves})"] * (not row.kind.turns)
    across = [*_unless_zero("tx", row.a), *_unless_zero("Rx", row.alpha), *_unless_zero("Ry", row.beta)]
    return along + across if convention is Convention.STANDARD else across + along


def _unless_zero(name: str, value: float) -> list[str]:
    return [f"ET.{name}({value!r})"] if value else []


def _pose(T: FloatArray, *, always: bool = False) -> list[str]:
    if is_identity(T) and not always:
        return []
    return [f"        ET.SE3(np.array([{numbers(T.ravel())}]).reshape(4, 4)),"]
