"""Convert a table to the other convention, to a kinematic tree, or to a URDF.

`urdfkin.dh.table` defines the conventions and the factors X.

| New convention | New base or tool | Part of a row |
|---|---|---|
| modified | new tool = X_n . tool | a base Tx(a) Rx(alpha) becomes a and alpha of the first row |
| standard | new base = base . X_1 | a tool Tx(a) Rx(alpha) becomes a and alpha of the last row |

If base or tool becomes part of a row, the new base or tool is the identity.

In a tree, the z axis of a joint's frame is the joint's axis. For a standard table, joint i has frame i - 1.
For a modified table, joint i has frame i.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from urdfkin.dh.table import DHConvention, DHRow, DHTable, as_a_and_alpha, as_table, convention_of
from urdfkin.model.tree import (
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
)
from urdfkin.urdf.writer import to_urdf as write_urdf


def to_convention(table: DHTable, convention: str) -> DHTable:
    """Return the table in the convention "standard" or "modified"."""
    table, target = as_table(table), convention_of(convention)
    if target is table.convention or not table.rows:
        return replace(table, convention=target)
    rows = table.rows
    steps = [(row.a, row.alpha, row.beta) for row in rows]
    if target is DHConvention.MODIFIED:
        first = as_a_and_alpha(table.base)
        steps = [(*(first or (0.0, 0.0)), 0.0), *steps[:-1]]
        base, tool = np.eye(4) if first else table.base, rows[-1].X @ table.tool
    else:
        last = as_a_and_alpha(table.tool)
        steps = [*steps[1:], (*(last or (0.0, 0.0)), 0.0)]
        base, tool = table.base @ rows[0].X, np.eye(4) if last else table.tool
    rows = tuple(
        replace(row, a=a, alpha=alpha, beta=beta) for row, (a, alpha, beta) in zip(rows, steps, strict=True)
    )
    return replace(table, convention=target, rows=rows, base=base, tool=tool)


#: Limits (m, m/s, N) for a prismatic joint without limits.
#: URDF requires limits for prismatic joints.
DEFAULT_PRISMATIC_LIMIT = Limit(-1000.0, 1000.0, 1000.0, 1000.0)


def to_tree(table: DHTable) -> KinematicTree:
    """Return the table as a tree.

    A mimicked joint without a row becomes a joint on the base.
    """
    links = link_names(as_table(table))
    joints = _serial_joints(table, [(_tree_kind(row), _tree_limit(row), row.mimic) for row in table.rows])
    triples = list(zip(joints, links, links[1:], strict=False))
    names = {row.joint for row in table.rows}
    for mimicked_joint in table.joint_names:
        if mimicked_joint not in names:
            turns = next(
                row.kind.turns
                for row in table.rows
                if row.mimic and row.mimic.mimicked_joint == mimicked_joint
            )
            kind, limit = (
                (JointKind.CONTINUOUS, None) if turns else (JointKind.PRISMATIC, DEFAULT_PRISMATIC_LIMIT)
            )
            joint = Joint(mimicked_joint, kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]), limit)
            triples.append((joint, links[0], make_unique(f"{mimicked_joint}_link", links)))
    return build_tree(table.robot, links[0], triples)


def to_urdf(table: DHTable) -> str:
    """Return the robot's URDF without shapes and masses."""
    return write_urdf(to_tree(table))


def to_free_tree(table: DHTable) -> KinematicTree:
    """Return a tree without joint limits and mimic rules, with one coordinate per row."""
    kinds = [JointKind.CONTINUOUS if row.kind.turns else JointKind.PRISMATIC for row in table.rows]
    joints = _serial_joints(table, [(kind, None, None) for kind in kinds])
    return make_serial_tree(table.robot, link_names(table), joints)


def make_serial_tree(robot: str, links: Sequence[str], joints: Sequence[Joint]) -> KinematicTree:
    """Connect links i and i + 1 by joint i.

    A mimicked joint outside `joints` becomes a joint on the base. The tip is the last link.
    """
    triples, names = list[tuple[Joint, str, str]](), {joint.name for joint in joints}
    for joint in joints:
        if joint.mimic and (name := joint.mimic.mimicked_joint) not in names:
            names.add(name)
            kind, limit = (
                (JointKind.CONTINUOUS, None)
                if joint.kind.turns
                else (JointKind.PRISMATIC, DEFAULT_PRISMATIC_LIMIT)
            )
            mimicked_joint = Joint(name, kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]), limit)
            triples.append((mimicked_joint, links[0], make_unique(f"{name}_link", list(links))))
    return build_tree(robot, links[0], [*triples, *zip(joints, links, links[1:], strict=False)])


def _serial_joints(
    table: DHTable, details: list[tuple[JointKind, Limit | None, Mimic | None]]
) -> list[Joint]:
    *poses, T_tip = relative_frame_poses(table)
    joints = [
        Joint(row.joint, kind, 0, T, np.array([0.0, 0.0, float(row.sense)]), limit, mimic)
        for row, T, (kind, limit, mimic) in zip(table.rows, poses, details, strict=True)
    ]
    name = make_unique(f"{table.tip_frame}_fixed", [*(row.joint for row in table.rows), *table.joint_names])
    return [*joints, Joint(name, JointKind.FIXED, 0, T_tip, np.array([1.0, 0.0, 0.0]))]


def relative_frame_poses(table: DHTable) -> list[FloatArray]:
    """Return the pose of each frame, and of the tip, in the previous frame, with all joints at zero."""
    if not table.rows:
        return [table.base @ table.tool]
    if table.convention is DHConvention.STANDARD:
        *poses, T_last_tip = [row.S @ row.X for row in table.rows]
        return [np.array(table.base), *poses, T_last_tip @ table.tool]
    first, *poses = [row.X @ row.S for row in table.rows]
    return [table.base @ first, *poses, np.array(table.tool)]


def link_names(table: DHTable) -> list[str]:
    return make_link_names(table.base_frame, [row.joint for row in table.rows], table.tip_frame)


def make_link_names(base: str, joints: Sequence[str], tip: str) -> list[str]:
    """Return a different name for each link of a serial chain."""
    names = [base]
    for joint in joints:
        names.append(make_unique(f"{joint}_link", [*names, tip]))
    return [*names, make_unique(tip, names)]


def make_unique(name: str, taken: list[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _tree_kind(row: DHRow) -> JointKind:
    return JointKind.CONTINUOUS if row.kind.turns and _has_no_bound(row.limit) else row.kind


def _tree_limit(row: DHRow) -> Limit | None:
    """Return the row's limit. A prismatic joint without position limits gets default limits.

    The URDF writer rejects a joint with only one position limit.
    """
    if row.kind.turns or not _has_no_bound(row.limit):
        return row.limit
    limit, given = DEFAULT_PRISMATIC_LIMIT, row.limit
    if given is None:
        return limit
    velocity, effort = (
        one if math.isfinite(one) else default
        for one, default in ((given.velocity, limit.velocity), (given.effort, limit.effort))
    )
    return replace(limit, velocity=velocity, effort=effort)


def _has_no_bound(limit: Limit | None) -> bool:
    return limit is None or (math.isinf(limit.lower) and math.isinf(limit.upper))
