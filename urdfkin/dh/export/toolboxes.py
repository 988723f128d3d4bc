"""Export a table for two toolboxes: roboticstoolbox (Python) and MATLAB's Robotics System Toolbox.

For roboticstoolbox the code makes a `DHRobot` of Revolute and Prismatic links (DH or MDH) with their limits.
A DHRobot has no fifth parameter, and has at least one joint. A table with Hayati rows, or without rows,
therefore becomes a `Robot` of elementary transforms.

For the Robotics System Toolbox the code makes a `rigidBodyTree`. The toolbox's "dh" and "mdh" transforms
ignore theta of a revolute joint and d of a prismatic one, so they would lose offsets. They also have no
Hayati rows. The code therefore sets each joint's frame by a matrix of the table, and the joint's axis is z.

The MATLAB code is tested in Octave with substitutes for the toolbox's classes (`scripts/forms/octave`). It
has not been tested in MATLAB.
"""

from __future__ import annotations

from urdfkin.dh.convert import frame_poses
from urdfkin.dh.export import ets
from urdfkin.dh.export.numeric_code import (
    bounds,
    demand_free,
    docstring,
    header,
    identifier,
    matrix,
    numbers,
    plain,
)
from urdfkin.dh.table import Convention, DHRow, DHTable
from urdfkin.dh.units import Units


def write_roboticstoolbox(table: DHTable, units: Units) -> str:
    """Return a module with `robot`: a DHRobot, or a Robot if a DHRobot cannot express the table.

    Raises:
        InputError: a mimic joint, which neither class supports.
    """
    if table.has_hayati_rows or not table.rows:
        return ets.write_ets(table, units)
    demand_free(table, "DHRobot")
    lines = docstring(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "", "robot = rtb.DHRobot(", "    ["]
    lines += [f"        {_link(row, table.convention)}," for row in table.rows]
    lines += ["    ],", f'    name="{plain(table.robot)}",']
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines.append(f"    {what}=np.array([{numbers(T.ravel())}]).reshape(4, 4),")
    return "\n".join([*lines, ")"]) + "\n"


def _link(row: DHRow, convention: Convention) -> str:
    suffix = "DH" if convention is Convention.STANDARD else "MDH"
    kind, constant, offset = (
        ("Revolute", f"d={row.d!r}", row.theta)
        if row.kind.turns
        else ("Prismatic", f"theta={row.theta!r}", row.d)
    )
    given = [constant, f"a={row.a!r}", f"alpha={row.alpha!r}", f"offset={offset!r}"]
    return f"rtb.{kind}{suffix}({', '.join([*given, *ets.joint(row)])})"


def write_matlab_rst(table: DHTable, units: Units) -> str:
    """Return a function file `ROBOT_tree.m`; its function returns a rigidBodyTree."""
    del units
    demand_free(table, "rigidBodyTree")
    poses = frame_poses(table)
    lines = [f"function robot = {identifier(table.robot)}_tree()", *(f"% {line}" for line in header(table))]
    lines += ["robot = rigidBodyTree('DataFormat', 'row');", f"robot.BaseName = '{plain(table.base_frame)}';"]
    parent = "robot.BaseName"
    for row, T in zip(table.rows, poses[:-1], strict=True):
        kind = "revolute" if row.kind.turns else "prismatic"
        lines += matrix("T", T.tolist(), 4)
        lines += [
            f"body = rigidBody('{plain(row.joint)}_link');",
            f"joint = rigidBodyJoint('{plain(row.joint)}', '{kind}');",
            "setFixedTransform(joint, T);",
            f"joint.JointAxis = [0 0 {row.sense}];",
        ]
        if limits := bounds(row):
            lines.append(f"joint.PositionLimits = [{limits}];")
        lines += ["body.Joint = joint;", f"addBody(robot, body, {parent});"]
        parent = f"'{plain(row.joint)}_link'"
    lines += [*matrix("T", poses[-1].tolist(), 4), f"body = rigidBody('{plain(table.tip_frame)}_tip');"]
    lines += ["setFixedTransform(body.Joint, T);", f"addBody(robot, body, {parent});", "end"]
    return "\n".join(lines) + "\n"
