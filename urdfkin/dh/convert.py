"""From one convention to the other: the same factors, bracketed differently.

    standard   base . (S_1 X_1) (S_2 X_2) ... (S_n X_n) . tool
    modified   base' . (X_0 S_1) (X_1 S_2) ... (X_{n-1} S_n) . tool'

X_n moves into the tool on the way to modified, and X_0 into the base on the way back. Where base or tool is
itself a step Tx(a) Rx(alpha), it moves into the row that gained a place, so that both ways undo each other.


Back again: a table as a kinematic tree, with each joint standing on its Denavit-Hartenberg frame.

In a standard table joint i turns about z_{i-1}, so its frame is frame i - 1, and the way to the next one is
S_i X_i with the joint at zero: d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64). In a modified table joint i turns
about its own z_i, so its frame is frame i, reached by X_{i-1} S_i. The tree is what the recursion runs on,
and what a URDF is written from.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdfkin.dh.table import Convention, DHRow, DHTable, as_step, convention_of
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, build_tree, is_bounded
from urdfkin.urdf.writer import to_urdf as write_urdf


def to_convention(table: DHTable, convention: str) -> DHTable:
    """The same table in a convention by name; raises InputError for an unknown one."""
    wanted = convention_of(convention)
    if wanted is table.convention or not table.rows:
        return replace(table, convention=wanted)
    return to_modified(table) if wanted is Convention.MODIFIED else to_standard(table)


def to_modified(table: DHTable) -> DHTable:
    """A standard table as a modified one: row i takes a, alpha and beta from row i - 1."""
    first = as_step(table.base)
    steps = [(*(first or (0.0, 0.0)), 0.0), *((row.a, row.alpha, row.beta) for row in table.rows[:-1])]
    base = np.eye(4) if first else table.base
    return _with(table, Convention.MODIFIED, steps, base, table.rows[-1].X @ table.tool)


def to_standard(table: DHTable) -> DHTable:
    """A modified table as a standard one: row i takes a, alpha and beta from row i + 1."""
    last = as_step(table.tool)
    steps = [*((row.a, row.alpha, row.beta) for row in table.rows[1:]), (*(last or (0.0, 0.0)), 0.0)]
    tool = np.eye(4) if last else table.tool
    return _with(table, Convention.STANDARD, steps, table.base @ table.rows[0].X, tool)


def _with(
    table: DHTable,
    convention: Convention,
    steps: list[tuple[float, float, float]],
    base: FloatArray,
    tool: FloatArray,
) -> DHTable:
    rows = tuple(
        replace(row, a=a, alpha=alpha, beta=beta)
        for row, (a, alpha, beta) in zip(table.rows, steps, strict=True)
    )
    return replace(table, convention=convention, rows=rows, base=base, tool=tool)


#: A sliding joint that no file bounds: a kilometre either way, m and m/s and N.
UNBOUNDED_SLIDE = Limit(-1000.0, 1000.0, 1000.0, 1000.0)


def to_tree(table: DHTable) -> KinematicTree:
    """The robot that the table describes, its root the table's base frame and its leaf the tip.

    Joint names, senses, limits and followers are the rows'. A leader that is not on the path gets a joint of
    its own on a link beside the base, so that the coordinates stay the table's. A revolute joint without
    limits becomes continuous; a sliding one gets a kilometre either way, since a URDF must say something.

    Args:
        table: Any table.
    """
    joints, here = list[tuple[Joint, str, str]](), link_names(table)
    for i, (row, T) in enumerate(zip(table.rows, frame_poses(table)[:-1], strict=True)):
        axis = np.array([0.0, 0.0, float(row.sense)])
        joint = Joint(row.joint, _kind(row), 0, T, axis, _limit(row), row.mimic)
        joints.append((joint, here[i], here[i + 1]))
    joints.append((_fixed(f"{table.tip_frame}_fixed", frame_poses(table)[-1], table), here[-2], here[-1]))
    names = {row.joint for row in table.rows}
    for leader in table.joint_names:
        if leader not in names:
            turns = next(row.kind.turns for row in table.rows if row.mimic and row.mimic.leader == leader)
            kind, limit = (JointKind.CONTINUOUS, None) if turns else (JointKind.PRISMATIC, UNBOUNDED_SLIDE)
            joint = Joint(leader, kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]), limit)
            joints.append((joint, here[0], _new(f"{leader}_link", here)))
    return build_tree(table.robot, here[0], joints)


def to_urdf(table: DHTable) -> str:
    """A URDF of the table's robot, without shapes and masses; see `to_tree` for names and limits."""
    return write_urdf(to_tree(table))


def free_tree(table: DHTable) -> KinematicTree:
    """The same tree with followers set free: one coordinate a row, in row order."""
    joints, here = list[tuple[Joint, str, str]](), link_names(table)
    poses = frame_poses(table)
    for i, row in enumerate(table.rows):
        axis = np.array([0.0, 0.0, float(row.sense)])
        kind = JointKind.CONTINUOUS if row.kind.turns else JointKind.PRISMATIC
        joints.append((Joint(row.joint, kind, 0, poses[i], axis), here[i], here[i + 1]))
    joints.append((_fixed(f"{table.tip_frame}_fixed", poses[-1], table), here[-2], here[-1]))
    return build_tree(table.robot, here[0], joints)


def frame_poses(table: DHTable) -> list[FloatArray]:
    """Each joint's frame in the one before it, at zero, then the tip in the last joint's frame."""
    S = [row.S() for row in table.rows]
    X = [row.X for row in table.rows]
    if table.convention is Convention.STANDARD:
        ways = [s @ x for s, x in zip(S, X, strict=True)]
        poses = [np.eye(4), *ways]
        poses[0], poses[-1] = table.base @ poses[0], poses[-1] @ table.tool
        return poses if table.rows else [table.base @ table.tool]
    ways = [x @ s for x, s in zip(X, S, strict=True)]
    if not ways:
        return [table.base @ table.tool]
    return [table.base @ ways[0], *ways[1:], np.array(table.tool)]


def link_names(table: DHTable) -> list[str]:
    """The base, a link for each row, the tip; no name twice."""
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
    """By the row's own word, not by whether it turns: that the table's matrices ask, which check the URDF."""
    unbounded = row.kind is JointKind.REVOLUTE and not is_bounded(row.limit)
    return JointKind.CONTINUOUS if unbounded else row.kind


def _limit(row: DHRow) -> Limit | None:
    if is_bounded(row.limit) or row.kind is JointKind.CONTINUOUS:
        return row.limit
    return None if row.kind.turns else UNBOUNDED_SLIDE
