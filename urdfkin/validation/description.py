"""A robot as data: what it is made of, as `urdfkin info --format json` and the validation report have it."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from urdfkin.model.ranges import NarrowedRange, narrowed_ranges

if TYPE_CHECKING:
    from urdfkin.model.tree import Joint
    from urdfkin.robot import Robot


def describe(robot: Robot) -> dict[str, Any]:
    """Plain data for JSON: coordinates, frames, and every joint with its placement, axis and limits.

    >>> import urdfkin
    >>> data = describe(urdfkin.load("ur5"))
    >>> data["nq"], {joint["kind"] for joint in data["joints"]} == {"fixed", "revolute"}
    (6, True)
    """
    tree = robot.tree
    narrowed = {one.joint: one for one in narrowed_ranges(tree)}
    return {
        "name": robot.name,
        "source": robot.source,
        "path": robot.path,
        "sha256": robot.sha256,
        "mimic": robot.origin.mimic if robot.verifier.mimic else False,
        "root_joint": robot.root_joint,
        "nq": robot.nq,
        "nv": robot.nv,
        "base": robot.base_frame,
        "tip": robot.tip_frame,
        "coordinates": list(robot.coordinate_names),
        "rates": list(robot.rate_names),
        "frames": list(robot.frame_names),
        "links": list(robot.link_names),
        "joints": [_joint(robot, i, narrowed) for i in range(len(tree.joints))],
    }


def _joint(robot: Robot, i: int, narrowed: dict[str, NarrowedRange]) -> dict[str, Any]:
    tree = robot.tree
    joint = tree.joints[i]
    return {
        "name": joint.name,
        "kind": joint.kind.value,
        "parent": tree.links[joint.parent],
        "child": tree.links[i + 1],
        "placement": joint.T_parent_joint.tolist(),
        "axis": joint.axis.tolist() if joint.kind.has_axis else None,
        "q": tree.q_index[i] if joint.kind.nq else None,
        "v": tree.v_index[i] if joint.kind.nv else None,
        "limit": _limit(joint),
        "mimic": asdict(joint.mimic) if joint.mimic else None,
        "kept": _kept(narrowed.get(joint.name)),
    }


def _kept(narrowed: NarrowedRange | None) -> dict[str, Any] | None:
    """The part of a joint's range in which its mimic joints keep their limits, where they narrow it."""
    if narrowed is None:
        return None
    lower, upper = narrowed.kept or (None, None)
    return {"lower": lower, "upper": upper, "by": list(narrowed.by)}


def _limit(joint: Joint) -> dict[str, float | None] | None:
    """Bounds; what is infinite is None, as JSON has no infinity."""
    limit = joint.limit
    if limit is None:
        return None
    named = {"lower": limit.lower, "upper": limit.upper, "velocity": limit.velocity, "effort": limit.effort}
    return {name: value if math.isfinite(value) else None for name, value in named.items()}
