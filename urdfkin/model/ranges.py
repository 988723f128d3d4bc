"""Ranges of the coordinates, computed from the limits of each joint and of the joints that mimic it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.kinematics.roundings import EPS, FOLLOWER
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, is_bounded

#: Largest bound of a range (rad or m); also used when a limit is missing.
WIDEST = 10.0


@dataclass(frozen=True, slots=True)
class NarrowedRange:
    """The range of a mimicked joint that the limits of its mimic joints make smaller.

    Attributes:
        joint: Name of the mimicked joint.
        own: The range that the limits of the mimicked joint give.
        kept: The part of the range `own` in which all mimic joints are within their limits; None if there is
            no such part.
        by: Names of the mimic joints whose limits make the range smaller.
        unit: Unit of the ranges, "rad" or "m".
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
            return f"{own}; no value keeps all its mimic joints within their limits ({names})"
        return f"{own}; its mimic joints keep their limits from {range_words(self.kept)} only ({names})"


def range_words(ends: tuple[float, float]) -> str:
    """Return the two ends of a range as text.

    >>> range_words((-0.005, 0.055))
    '-0.005 to 0.055'
    """
    return f"{ends[0]:.6g} to {ends[1]:.6g}"


def axis_range(kind: JointKind, limit: Limit | None, slide: float = 1.0) -> tuple[float, float]:
    """Return the range of a joint with one axis.

    Without limits, the range of a revolute joint is -pi to pi (rad), and that of a prismatic joint is -slide
    to slide (m).
    """
    if kind is not JointKind.CONTINUOUS and is_bounded(limit):
        return limit.lower, limit.upper
    return (-math.pi, math.pi) if kind.turns else (-slide, slide)


def values_within(ranges: Sequence[tuple[float, float]], count: int, seed: int = 0) -> FloatArray:
    """Draw `count` random values in each range (lower, upper), uniformly: an array (count, ranges)."""
    lower, upper = np.array(ranges).reshape(-1, 2).T
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(ranges)))


def own_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """Return the range of each joint that has exactly one coordinate.

    Only the joint's own limits are used, and not the limits of joints that mimic this joint.
    """
    return {joint.name: _own_range(joint) for joint in tree.joints if joint.nq == 1}


def coordinate_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """Return the ranges of `own_ranges`, narrowed so that the mimic joints are within their limits.

    A range is not narrowed if no part of it keeps the mimic joints within their limits.
    """
    ranges = own_ranges(tree)
    narrowed = {one.joint: one.kept for one in narrowed_ranges(tree)}
    return {name: narrowed.get(name) or own for name, own in ranges.items()}


def narrowed_ranges(tree: KinematicTree) -> tuple[NarrowedRange, ...]:
    """Return the ranges of mimicked joints that the limits of mimic joints make smaller."""
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
    """Return the part of a mimicked joint's range in which a mimic joint is within its limits.

    If there is no such part, the result is empty.
    """

    def keeps(leader: float) -> bool:
        # As in `configuration.limit_violations`: a limit printed in decimal is rounded.
        own = rule.multiplier * leader + rule.offset
        return bool(np.nextafter(limit.lower, -np.inf) <= own <= np.nextafter(limit.upper, np.inf))

    if keeps(lower) and keeps(upper):  # if the ends are within the limits, so is every value between the ends
        return lower, upper
    if rule.multiplier == 0.0:
        return math.inf, -math.inf
    ends = sorted((end - rule.offset) / rule.multiplier for end in (limit.lower, limit.upper))
    # Move the ends inwards by the rounding error of the mimic joint's value.
    room = (
        FOLLOWER * EPS * (max(map(abs, (limit.lower, limit.upper))) + abs(rule.offset)) / abs(rule.multiplier)
    )
    if not math.isfinite(room):  # a mimic joint with one limit only
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
