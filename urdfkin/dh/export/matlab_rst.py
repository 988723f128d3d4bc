"""MATLAB code for the Robotics System Toolbox: a `rigidBodyTree`.

The toolbox's own "dh" and "mdh" fixed transforms ignore theta of a revolute joint and d of a prismatic one,
so that offsets would be lost, and know no Hayati row. The joints are therefore placed by the matrices of
the table's own frames, and turn about z.

What is written runs in Octave on classes that stand in for the toolbox's (`scripts/forms/octave`); nobody has
run it in MATLAB yet.
"""

from __future__ import annotations

from urdfkin.dh.export.code import bounds, demand_free, header, identifier, plain
from urdfkin.dh.export.matlab import matrix
from urdfkin.dh.table import DHTable
from urdfkin.dh.to_tree import frame_poses
from urdfkin.dh.units import Units


def write(table: DHTable, units: Units) -> str:
    """A function file `ROBOT_tree.m` that returns a rigidBodyTree."""
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
