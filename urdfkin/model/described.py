"""A robot in words: its joints with their axes, places and limits, in the order of its coordinates."""

from __future__ import annotations

import math

from urdfkin.errors.showing import Sheet, Table
from urdfkin.model.tree import Joint, KinematicTree

#: What is said of a joint, in rad and rad/s, of prismatic joints in m and m/s.
COLUMNS = ("kind", "axis", "q", "v", "lower", "upper", "speed", "follows")


def described(tree: KinematicTree, base: str, tip: str) -> Sheet:
    """What there is to say of a robot in a terminal or a notebook's cell.

    Args:
        tree: The robot.
        base: Where chains begin unless told.
        tip: Where they end.
    """
    moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
    columns = COLUMNS if any(joint.mimic for joint in tree.joints) else COLUMNS[:-1]
    rows = [
        (
            tree.joints[i].name,
            tree.links[tree.joints[i].parent],
            tree.links[i + 1],
            *cells_of(tree, i)[: len(columns)],
        )
        for i in moving
    ]
    fixed = len(tree.joints) - len(moving)
    return Sheet(
        f"{tree.name}: nq {tree.nq}, nv {tree.nv}, {len(tree.links)} links, {len(tree.joints)} joints",
        (
            f"Root {tree.links[0]}, default base {base}, default tip {tip}; {fixed} joints are fixed.",
            Table(("joint", "parent", "child", *columns), rows, left=7),
        ),
    )


def cells_of(tree: KinematicTree, i: int) -> tuple[str, ...]:
    """The cells of `COLUMNS` for joint `i`; of a fixed joint its kind alone."""
    joint = tree.joints[i]
    if not joint.kind.nv:
        return (joint.kind.value, *[""] * (len(COLUMNS) - 1))
    q, v = _place("q", tree.q_index[i], joint.kind.nq), _place("v", tree.v_index[i], joint.kind.nv)
    limit = joint.limit
    limits = ("", "", "") if limit is None else map(_bound, (limit.lower, limit.upper, limit.velocity))
    return (joint.kind.value, _axis(joint), q, v, *limits, _follows(joint))


def _place(letter: str, at: int, count: int) -> str:
    return f"{letter}[{at}]" if count == 1 else f"{letter}[{at}:{at + count}]"


def _axis(joint: Joint) -> str:
    """`z`, `-x`, or the three numbers where it is none of the frame's own axes."""
    if not joint.kind.has_axis:
        return ""
    numbers = joint.axis.tolist()
    if sorted(map(abs, numbers)) == [0.0, 0.0, 1.0]:
        k = next(k for k, x in enumerate(numbers) if x)
        return f"{'-' if numbers[k] < 0.0 else ''}{'xyz'[k]}"
    return " ".join(f"{x:.4g}" for x in numbers)


def _follows(joint: Joint) -> str:
    if joint.mimic is None:
        return ""
    leader, factor, offset = joint.mimic.leader, joint.mimic.multiplier, joint.mimic.offset
    return (f"{factor:g} * " if factor != 1.0 else "") + leader + (f" {offset:+g}" if offset else "")


def _bound(value: float) -> str:
    return "" if math.isinf(value) else f"{value:.6g}"
