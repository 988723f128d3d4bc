"""Configurations and rates to check with: random within limits, and the special ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urdfkin.configuration import neutral
from urdfkin.tree import FloatArray, Joint, JointKind, KinematicTree

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
    bound that is missing or beyond 10 (rad or m) is drawn as 10.
    """
    q = np.empty((n, tree.nq))
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq:
            q[:, at : at + joint.nq] = _sample_joint(joint, n, rng)
    return q


def _sample_joint(joint: Joint, n: int, rng: np.random.Generator) -> FloatArray:
    if joint.kind is JointKind.CONTINUOUS:
        return rng.uniform(-math.pi, math.pi, (n, 1))
    if joint.kind is JointKind.PLANAR:
        return np.hstack((rng.uniform(-_ROOM, _ROOM, (n, 2)), rng.uniform(-math.pi, math.pi, (n, 1))))
    if joint.kind is JointKind.FLOATING:
        quaternion = rng.standard_normal((n, 4))
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        return np.hstack((rng.uniform(-_ROOM, _ROOM, (n, 3)), quaternion))
    lower, upper = bounds(joint)
    return rng.uniform(lower, upper, (n, 1))


def bounds(joint: Joint) -> tuple[float, float]:
    """The range that a joint of one coordinate is drawn from."""
    if joint.limit is None:
        return -WIDEST, WIDEST
    lower, upper = (min(max(bound, -WIDEST), WIDEST) for bound in (joint.limit.lower, joint.limit.upper))
    return (lower, upper) if lower <= upper else (upper, lower)


def special(tree: KinematicTree) -> FloatArray:
    """(3, nq): neutral, every joint at its lower bound, every joint at its upper bound."""
    q = np.tile(neutral(tree), (3, 1))
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1 and joint.kind is not JointKind.CONTINUOUS:
            q[1, at], q[2, at] = bounds(joint)
        elif joint.kind is JointKind.CONTINUOUS:
            q[1, at], q[2, at] = -math.pi, math.pi
    return q


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
