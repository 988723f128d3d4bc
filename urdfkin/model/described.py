"""A robot in words: its joints with their limits, in the order of its coordinates."""

from __future__ import annotations

import math
from collections.abc import Iterator

from urdfkin.errors.showing import Sheet, Table
from urdfkin.model.tree import Joint, KinematicTree

_HEADS = ("joint", "kind", "q", "parent", "child", "lower", "upper", "velocity")


def described(tree: KinematicTree, base: str, tip: str) -> Sheet:
    """What there is to say of a robot in a terminal or a notebook's cell.

    Args:
        tree: The robot.
        base: Where chains begin unless told.
        tip: Where they end.
    """
    moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
    rows = [
        (
            tree.joints[i].name,
            tree.joints[i].kind.value,
            _coordinates(tree, i),
            tree.links[tree.joints[i].parent],
            tree.links[i + 1],
            *_limits(tree.joints[i]),
        )
        for i in moving
    ]
    fixed = len(tree.joints) - len(moving)
    return Sheet(
        f"{tree.name}: nq {tree.nq}, nv {tree.nv}, {len(tree.links)} links, {len(tree.joints)} joints",
        (
            f"Root {tree.links[0]}, default base {base}, default tip {tip}; {fixed} joints are fixed.",
            Table(_HEADS, rows, left=5),
        ),
    )


def _coordinates(tree: KinematicTree, i: int) -> str:
    joint, at = tree.joints[i], tree.q_index[i]
    if joint.mimic:
        return str(joint.mimic)
    return f"q[{at}]" if joint.nq == 1 else f"q[{at}:{at + joint.nq}]"


def _limits(joint: Joint) -> Iterator[str]:
    limit = joint.limit
    for bound in (limit.lower, limit.upper, limit.velocity) if limit else (math.inf,) * 3:
        yield "" if math.isinf(bound) else f"{bound:.6g}"
