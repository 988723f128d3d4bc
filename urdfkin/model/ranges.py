"""Ranges of the coordinates: each joint's own limits, and where its mimic joints keep theirs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urdfkin.kinematics.roundings import EPS, FOLLOWER
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, Mimic

#: A coordinate whose bounds are wider than this, or missing, has this range: rad or m.
WIDEST = 10.0


@dataclass(frozen=True, slots=True)
class NarrowedRange:
    """A joint whose mimic joints leave their limits before it reaches its own.

    Attributes:
        joint: Name of the joint that is mimicked.
        own: Its own range.
        kept: The part of it in which its mimic joints keep their limits; None where there is none.
        by: Names of these mimic joints.
        unit: Of the ranges, "rad" or "m".
    """

    joint: str
    own: tuple[float, float]
    kept: tuple[float, float] | None
    by: tuple[str, ...]
    unit: str

    def __str__(self) -> str:
        names = ", ".join(self.by)
        own = f"joint {self.joint} ranges over {range_words(self.own)} {self.unit}"
        if self.kept is None:
            return f"{own}; nowhere do its mimic joints keep all their limits ({names})"
        return f"{own}; its mimic joints keep their limits from {range_words(self.kept)} only ({names})"


def range_words(ends: tuple[float, float]) -> str:
    """Both ends of a range.

    >>> range_words((-0.005, 0.055))
    '-0.005 to 0.055'
    """
    return f"{ends[0]:.6g} to {ends[1]:.6g}"


def own_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """The range of each joint with one coordinate of its own: the file's limits of that joint alone."""
    return {joint.name: _own_range(joint) for joint in tree.joints if joint.nq == 1}


def coordinate_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """The same where mimic joints keep their limits too, if there is such a part of the range."""
    ranges = own_ranges(tree)
    narrowed = {one.joint: one.kept for one in narrowed_ranges(tree)}
    return {name: narrowed.get(name) or own for name, own in ranges.items()}


def narrowed_ranges(tree: KinematicTree) -> tuple[NarrowedRange, ...]:
    """The ranges that limits of mimic joints narrow."""
    followers: dict[str, list[Joint]] = {}
    for joint in tree.joints:
        if joint.mimic is not None and joint.limit is not None:
            followers.setdefault(joint.mimic.leader, []).append(joint)
    ranges = own_ranges(tree)
    found = (
        _narrowed(tree.joints[tree.joint_index(name)], ranges[name], joints)
        for name, joints in followers.items()
    )
    return tuple(one for one in found if one is not None)


def _narrowed(leader: Joint, own: tuple[float, float], joints: list[Joint]) -> NarrowedRange | None:
    lower, upper = own
    by = list[str]()
    for joint in joints:
        assert joint.mimic is not None
        assert joint.limit is not None
        if kept_range(joint.mimic, joint.limit, *own) != own:
            by.append(joint.name)
        lower, upper = kept_range(joint.mimic, joint.limit, lower, upper)
    if not by:
        return None
    kept = (lower, upper) if lower < upper else None
    return NarrowedRange(leader.name, own, kept, tuple(by), "rad" if leader.kind.turns else "m")


def kept_range(rule: Mimic, limit: Limit, lower: float, upper: float) -> tuple[float, float]:
    """The part of a joint's range in which its mimic joint keeps its limits; empty if there is none."""

    def keeps(leader: float) -> bool:
        # As `configuration.limit_violations` counts: a bound printed in decimal is rounded.
        own = rule.multiplier * leader + rule.offset
        return bool(np.nextafter(limit.lower, -np.inf) <= own <= np.nextafter(limit.upper, np.inf))

    if keeps(lower) and keeps(upper):  # and so all between: what is not cut keeps its bits
        return lower, upper
    if rule.multiplier == 0.0:
        return math.inf, -math.inf
    ends = sorted((end - rule.offset) / rule.multiplier for end in (limit.lower, limit.upper))
    # Inwards by what the follower's own value may be rounded by.
    room = (
        FOLLOWER * EPS * (max(map(abs, (limit.lower, limit.upper))) + abs(rule.offset)) / abs(rule.multiplier)
    )
    if not math.isfinite(room):  # a follower with a single bound
        room = FOLLOWER * EPS * max((abs(end) for end in ends if math.isfinite(end)), default=0.0)
    return (
        lower if keeps(lower) else max(lower, ends[0] + room),
        upper if keeps(upper) else min(upper, ends[1] - room),
    )


def _own_range(joint: Joint) -> tuple[float, float]:
    if joint.kind is JointKind.CONTINUOUS:
        return -math.pi, math.pi
    if joint.limit is None:
        return -WIDEST, WIDEST
    lower, upper = (min(max(bound, -WIDEST), WIDEST) for bound in (joint.limit.lower, joint.limit.upper))
    return (lower, upper) if lower <= upper else (upper, lower)
