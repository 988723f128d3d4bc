"""Convert a table to the other convention, to a kinematic tree, or to a URDF.

The standard and the modified convention group the same factors S and X of `urdfkin.dh.table` differently:

    standard   base . (S_1 X_1) (S_2 X_2) ... (S_n X_n) . tool
    modified   base' . (X_0 S_1) (X_1 S_2) ... (X_{n-1} S_n) . tool'

The conversion to the modified convention moves X_n into the tool. The conversion to the standard convention
moves X_0 into the base. No standard row contains the cells a and alpha of the first modified row. If the base
is a product Tx(a) Rx(alpha), the conversion writes a and alpha into these two cells, and the base becomes the
identity. In the conversion to the standard convention, a tool of the form Tx(a) Rx(alpha) is written into the
last row. Therefore, conversion to the other convention and back gives the original table.

In a tree, each joint's frame is a Denavit-Hartenberg frame. In a standard table z_{i-1} is the axis of joint
i, so the frame of joint i is frame i - 1. The pose of frame i in frame i - 1 is S_i X_i. If the joint is at
zero, its translation is d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64). In a modified table z_i is the axis of
joint i, so the frame of joint i is frame i. The pose of frame i in frame i - 1 is X_{i-1} S_i. The motion of
a table is computed on this tree, and `to_urdf` writes the tree as a URDF.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdfkin.dh.table import DHConvention, DHRow, DHTable, as_a_and_alpha, convention_of
from urdfkin.model.tree import (
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
    is_bounded,
)
from urdfkin.urdf.writer import to_urdf as write_urdf


def to_convention(table: DHTable, convention: str) -> DHTable:
    """Return the same table in the given convention; raise InputError for an unknown convention."""
    wanted = convention_of(convention)
    if wanted is table.convention or not table.rows:
        return replace(table, convention=wanted)
    return to_modified(table) if wanted is DHConvention.MODIFIED else to_standard(table)


def to_modified(table: DHTable) -> DHTable:
    """Convert a standard table to a modified table: row i takes a, alpha and beta from row i - 1."""
    first = as_a_and_alpha(table.base)
    steps = [(*(first or (0.0, 0.0)), 0.0), *((row.a, row.alpha, row.beta) for row in table.rows[:-1])]
    base = np.eye(4) if first else table.base
    return _with(table, DHConvention.MODIFIED, steps, base, table.rows[-1].X @ table.tool)


def to_standard(table: DHTable) -> DHTable:
    """Convert a modified table to a standard table: row i takes a, alpha and beta from row i + 1."""
    last = as_a_and_alpha(table.tool)
    steps = [*((row.a, row.alpha, row.beta) for row in table.rows[1:]), (*(last or (0.0, 0.0)), 0.0)]
    tool = np.eye(4) if last else table.tool
    return _with(table, DHConvention.STANDARD, steps, table.base @ table.rows[0].X, tool)


def _with(
    table: DHTable,
    convention: DHConvention,
    steps: list[tuple[float, float, float]],
    base: FloatArray,
    tool: FloatArray,
) -> DHTable:
    rows = tuple(
        replace(row, a=a, alpha=alpha, beta=beta)
        for row, (a, alpha, beta) in zip(table.rows, steps, strict=True)
    )
    return replace(table, convention=convention, rows=rows, base=base, tool=tool)


#: A prismatic joint without limits gets -1 km to 1 km, 1000 m/s and 1000 N in a URDF.
UNBOUNDED_SLIDE = Limit(-1000.0, 1000.0, 1000.0, 1000.0)


def to_tree(table: DHTable) -> KinematicTree:
    """Return the table's robot as a tree from the base frame to the tip.

    The tree contains the joint names, joint directions, limits and mimic rules from the rows. If a mimicked
    joint is not on the path, it becomes a separate joint on the base, so that the tree has the same
    coordinates as the table. A revolute joint without limits becomes continuous. A prismatic joint without
    limits gets -1 km to 1 km, because URDF requires limits.
    """
    here = link_names(table)
    joints = _serial(table, here, [(_kind(row), _limit(row), row.mimic) for row in table.rows])
    names = {row.joint for row in table.rows}
    for leader in table.joint_names:
        if leader not in names:
            turns = next(row.kind.turns for row in table.rows if row.mimic and row.mimic.leader == leader)
            kind, limit = (JointKind.CONTINUOUS, None) if turns else (JointKind.PRISMATIC, UNBOUNDED_SLIDE)
            joint = Joint(leader, kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]), limit)
            joints.append((joint, here[0], _new(f"{leader}_link", here)))
    return build_tree(table.robot, here[0], joints)


def to_urdf(table: DHTable) -> str:
    """Return a URDF with the names and limits of `to_tree`, and without shapes and masses."""
    return write_urdf(to_tree(table))


def free_tree(table: DHTable) -> KinematicTree:
    """Return the tree of `to_tree` without mimic rules: each row has its own coordinate, in row order."""
    kinds = [JointKind.CONTINUOUS if row.kind.turns else JointKind.PRISMATIC for row in table.rows]
    here = link_names(table)
    return build_tree(table.robot, here[0], _serial(table, here, [(kind, None, None) for kind in kinds]))


def _serial(
    table: DHTable, links: list[str], details: list[tuple[JointKind, Limit | None, Mimic | None]]
) -> list[tuple[Joint, str, str]]:
    """Return the joints of the rows and the fixed joint of the tip, each with its parent and child link."""
    *poses, T_tip = frame_poses(table)
    joints = [
        Joint(row.joint, kind, 0, T, np.array([0.0, 0.0, float(row.sense)]), limit, mimic)
        for row, T, (kind, limit, mimic) in zip(table.rows, poses, details, strict=True)
    ]
    joints.append(_fixed(f"{table.tip_frame}_fixed", T_tip, table))
    return list(zip(joints, links, links[1:], strict=False))


def frame_poses(table: DHTable) -> list[FloatArray]:
    """Return the poses of the table's joint frames and of its tip in the zero configuration.

    Each joint's frame is given in the frame before it. The last pose is the tip in the last joint's frame.
    """
    S = [row.S for row in table.rows]
    X = [row.X for row in table.rows]
    if table.convention is DHConvention.STANDARD:
        ways = [s @ x for s, x in zip(S, X, strict=True)]
        poses = [np.eye(4), *ways]
        poses[0], poses[-1] = table.base @ poses[0], poses[-1] @ table.tool
        return poses if table.rows else [table.base @ table.tool]
    ways = [x @ s for x, s in zip(X, S, strict=True)]
    if not ways:
        return [table.base @ table.tool]
    return [table.base @ ways[0], *ways[1:], np.array(table.tool)]


def link_names(table: DHTable) -> list[str]:
    """Return unique link names: the base, a link for each row, and the tip."""
    names = [table.base_frame]
    names += [_new(f"{row.joint}_link", [*names, table.tip_frame]) for row in table.rows]
    return [*names, _new(table.tip_frame, names)]


def _new(name: str, taken: list[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _fixed(name: str, T: FloatArray, table: DHTable) -> Joint:
    taken = [*(row.joint for row in table.rows), *table.joint_names]
    return Joint(_new(name, taken), JointKind.FIXED, 0, T, np.array([1.0, 0.0, 0.0]))


def _kind(row: DHRow) -> JointKind:
    """Return the kind of the row's joint in a URDF; a revolute joint without limits is continuous."""
    unbounded = row.kind is JointKind.REVOLUTE and not is_bounded(row.limit)
    return JointKind.CONTINUOUS if unbounded else row.kind


def _limit(row: DHRow) -> Limit | None:
    if is_bounded(row.limit) or row.kind is JointKind.CONTINUOUS:
        return row.limit
    return None if row.kind.turns else UNBOUNDED_SLIDE
