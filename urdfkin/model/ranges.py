"""Between which values a coordinate keeps its joint, and the followers of it, within their limits."""

from __future__ import annotations

import math

import numpy as np

from urdfkin.kinematics.roundings import EPS, FOLLOWER
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, Mimic

#: A coordinate whose bounds are wider than this, or missing, has this range: rad or m.
WIDEST = 10.0


def coordinate_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """For each joint with one coordinate of its own, the range that it is drawn from in samples."""
    ranges = {joint.name: _own_range(joint) for joint in tree.joints if joint.nq == 1}
    followers: dict[str, list[tuple[Mimic, Limit]]] = {}
    for joint in tree.joints:
        if joint.mimic is not None and joint.limit is not None:
            followers.setdefault(joint.mimic.leader, []).append((joint.mimic, joint.limit))
    for leader, rules in followers.items():
        lower, upper = ranges[leader]
        for rule, limit in rules:
            lower, upper = _kept(rule, limit, lower, upper)
        if lower < upper:
            ranges[leader] = lower, upper
    return ranges


def _kept(rule: Mimic, limit: Limit, lower: float, upper: float) -> tuple[float, float]:
    """The part of a leader's range in which a follower keeps its limits; empty if none does."""

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
