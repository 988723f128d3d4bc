"""Configurations and rates to check with: random within limits, and the special ones.

Which results of a call are checked: all of them, none, or a stated number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import InputError
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.rotation.quaternion import rotation_of
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import neutral
from urdfkin.model.ranges import coordinate_ranges, own_ranges
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

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
    return _uniform(tree, n, rng, coordinate_ranges(tree))


def _uniform(
    tree: KinematicTree, n: int, rng: np.random.Generator, ranges: dict[str, tuple[float, float]]
) -> FloatArray:
    q = np.empty((n, tree.nq))
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


def special(tree: KinematicTree) -> FloatArray:
    """(3, nq): neutral, every joint at its own lower bound, every joint at its own upper bound."""
    q = np.tile(neutral(tree), (3, 1))
    ranges = own_ranges(tree)
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

    They cover each joint's own limits, also where a mimic joint leaves its limits: the equations hold there.
    Rates are standard normal; every eighth sample has rates a hundred times as large, where the terms of
    7.129 and 7.130 that are quadratic in them dominate.
    """
    q = _uniform(tree, n, rng, own_ranges(tree))
    if with_special:
        q = np.concatenate((special(tree), q))
    v, a = rng.standard_normal((2, len(q), tree.nv))
    v[::8] *= 100.0
    a[::8] *= 100.0
    return Samples(q, v, a)


#: Every result, no result, or those of `SAMPLE` configurations.
Verify = bool | Literal["sample"]

#: How many configurations of a call `verify="sample"` checks.
SAMPLE = 100

#: Numbers and configurations compared at a time: few enough for a cache and for memory not to grow with a
#: batch, many enough for array expressions to be worth their call.
_AT_A_TIME = 131_072
_MOST = 4096


def checked_choice(verify: object) -> Verify:
    """What was asked for.

    Raises:
        InputError: it is none of True, False and "sample".
    """
    if verify is True or verify is False:
        return verify
    if isinstance(verify, str) and verify == "sample":
        return "sample"
    raise InputError('verify is True, False or "sample"', found=safe_repr(verify))


def parts(verify: Verify, n: int, numbers: int) -> Iterator[slice | IntArray]:
    """The configurations to check, of `n`, in parts of a good size.

    Args:
        verify: True or "sample".
        n: How many configurations there are.
        numbers: How many numbers the results of one have.

    Yields:
        Indices. A sample is drawn without regard to order, which a batch often has, and always the same.
    """
    step = min(_MOST, max(1, _AT_A_TIME // max(1, numbers)))
    if verify == "sample" and n > SAMPLE:
        drawn = np.sort(np.random.default_rng(0).choice(n, SAMPLE, replace=False))
        yield from (drawn[i : i + step] for i in range(0, SAMPLE, step))
    else:
        yield from (slice(i, min(i + step, n)) for i in range(0, n, step))
