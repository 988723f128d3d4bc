"""Configurations and rates to check with: random within limits, and the special ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urdfkin.kinematics.rotation.quaternion import rotation_of
from urdfkin.kinematics.roundings import EPS, FOLLOWER
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import neutral
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic

#: A coordinate whose bounds are wider than this, or missing, is drawn from this range: rad or m.
WIDEST = 10.0
#: How far a planar or floating joint is moved from its place: m.
_ROOM = 2.0


@dataclass(frozen=True, slots=True)
class Samples:
    """`q` (n, nq), `v` and `a` (n, nv)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


def sample(tree: KinematicTree, n: int, rng: np.random.Generator) -> FloatArray:
    """(n, nq) configurations, uniform within limits.

    Continuous joints take any angle, planar and floating ones any orientation and a place within 2 m; a
    bound that is missing or beyond 10 (rad or m) is drawn as 10. A leader stays where its followers are
    within their limits too; if it has no room there, where it is within its own, and
    `configuration.limit_violations` names the followers.
    """
    q = np.empty((n, tree.nq))
    ranges = coordinate_ranges(tree)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1:
            q[:, at] = rng.uniform(*ranges[joint.name], (n, 1))[:, 0]
        elif joint.nq:
            q[:, at : at + joint.nq] = _sample_joint(joint, n, rng)
    return q


def _sample_joint(joint: Joint, n: int, rng: np.random.Generator) -> FloatArray:
    if joint.kind is JointKind.PLANAR:
        return np.hstack((rng.uniform(-_ROOM, _ROOM, (n, 2)), rng.uniform(-math.pi, math.pi, (n, 1))))
    return _sample_floating(n, rng)


def _sample_floating(n: int, rng: np.random.Generator) -> FloatArray:
    quaternion = rng.standard_normal((n, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.hstack((rng.uniform(-_ROOM, _ROOM, (n, 3)), quaternion))


def coordinate_ranges(tree: KinematicTree) -> dict[str, tuple[float, float]]:
    """For each joint with one coordinate of its own, the range that it is drawn from."""
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


def special(tree: KinematicTree) -> FloatArray:
    """(3, nq): neutral, every joint at its lower bound, every joint at its upper bound."""
    q = np.tile(neutral(tree), (3, 1))
    ranges = coordinate_ranges(tree)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1:
            q[1, at], q[2, at] = ranges[joint.name]
    return q


def draw_base(n: int, rng: np.random.Generator) -> BaseMotion:
    """A root link's motion for `n` samples: placed as a floating joint is, with rates as those of `draw`."""
    placed = _sample_floating(n, rng)
    placement = np.tile(np.eye(4), (n, 1, 1))
    placement[:, :3, :3], placement[:, :3, 3] = rotation_of(placed[:, 3:]), placed[:, :3]
    velocity, acceleration = rng.standard_normal((2, n, 6))
    velocity[::8] *= 100.0
    acceleration[::8] *= 100.0
    return BaseMotion(placement, velocity, acceleration)


def draw(tree: KinematicTree, n: int, rng: np.random.Generator, *, with_special: bool) -> Samples:
    """Samples for a validation: `n` random ones, and the special configurations if asked for.

    Rates are standard normal; every eighth sample has rates a hundred times as large, where the terms of
    7.129 and 7.130 that are quadratic in them dominate.
    """
    q = sample(tree, n, rng)
    if with_special:
        q = np.concatenate((special(tree), q))
    v, a = rng.standard_normal((2, len(q), tree.nv))
    v[::8] *= 100.0
    a[::8] *= 100.0
    return Samples(q, v, a)
