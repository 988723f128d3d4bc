"""Draw random configurations and joint velocities, and choose the results of a call to check."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import InputError
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.rotation import rotation_of
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import coordinate_ranges, neutral, own_ranges
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Positions of planar and floating joints lie between -_RANGE and _RANGE, in metres.
_RANGE = 2.0


@dataclass(frozen=True, slots=True)
class Samples:
    """`q` (n, nq), `v` and `a` (n, nv)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


def sample(tree: KinematicTree, n: int, rng: np.random.Generator) -> FloatArray:
    """Return random configurations (n, nq), uniform within the limits.

    Continuous joints take any angle. Planar and floating joints take any orientation and positions within
    +-2 m. A missing limit, or a limit beyond 10 (rad or m), counts as 10. The limits of mimic joints restrict
    the mimicked joint too. If no value is within the limits of the mimicked joint and of the mimic joint,
    only the limits of the mimicked joint apply. `configuration.limit_violations` then names the mimic joint.
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
    return _SAMPLED[joint.kind](n, rng)


def _sample_planar(n: int, rng: np.random.Generator) -> FloatArray:
    return np.hstack((rng.uniform(-_RANGE, _RANGE, (n, 2)), rng.uniform(-math.pi, math.pi, (n, 1))))


def _sample_floating(n: int, rng: np.random.Generator) -> FloatArray:
    quaternion = rng.standard_normal((n, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.hstack((rng.uniform(-_RANGE, _RANGE, (n, 3)), quaternion))


#: The samples of a joint with several coordinates.
_SAMPLED = {JointKind.PLANAR: _sample_planar, JointKind.FLOATING: _sample_floating}


def special(tree: KinematicTree) -> FloatArray:
    """Return (3, nq): zero configuration, all joints at the lower limit, all joints at the upper limit."""
    q = np.tile(neutral(tree), (3, 1))
    ranges = own_ranges(tree)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.nq == 1:
            q[1, at], q[2, at] = ranges[joint.name]
    return q


def draw_base(n: int, rng: np.random.Generator) -> BaseMotion:
    """Return random motions of the root link, with poses of a floating joint and velocities as in `draw`."""
    placed = _sample_floating(n, rng)
    placement = np.tile(np.eye(4), (n, 1, 1))
    placement[:, :3, :3], placement[:, :3, 3] = rotation_of(placed[:, 3:]), placed[:, :3]
    velocity, acceleration = rng.standard_normal((2, n, 6))
    velocity[::8] *= 100.0
    acceleration[::8] *= 100.0
    return BaseMotion(placement, velocity, acceleration)


def draw(tree: KinematicTree, n: int, rng: np.random.Generator, *, with_special: bool) -> Samples:
    """Return samples for a validation: `n` random samples and, if requested, the samples of `special`.

    The samples cover the full range of each joint, even if a mimic joint then exceeds its own limits. The
    equations are valid beyond the limits too. Joint velocities and accelerations are standard normal. In
    every eighth sample these velocities and accelerations are a hundred times larger, so that the quadratic
    terms of eq. 7.129 and 7.130 dominate.
    """
    q = _uniform(tree, n, rng, own_ranges(tree))
    if with_special:
        q = np.concatenate((special(tree), q))
    v, a = rng.standard_normal((2, len(q), tree.nv))
    v[::8] *= 100.0
    a[::8] *= 100.0
    return Samples(q, v, a)


#: True: check all results of a call.
#: False: check none.
#: The string "sample": check the results of `SAMPLE` configurations.
Verify = bool | Literal["sample"]

#: Number of configurations of a call that `verify="sample"` checks.
SAMPLE = 100

#: Largest number of values, and of configurations, that are compared at a time.
#: The number is large enough for efficient array expressions and fits into the processor's cache.
#: The number also limits the memory for large batches.
_AT_A_TIME = 262_144
_MOST = 4096


def checked_choice(verify: object) -> Verify:
    """Return a valid value of `verify`.

    Raises:
        InputError: the value is not True, False or "sample".
    """
    if verify is True or verify is False:
        return verify
    if isinstance(verify, str) and verify == "sample":
        return "sample"
    raise InputError('verify must be True, False or "sample"', found=safe_repr(verify))


def parts(verify: Verify, n: int, numbers: int) -> Iterator[slice | IntArray]:
    """Yield the indices of the configurations to check, in parts.

    Args:
        verify: True or "sample".
        n: Number of configurations.
        numbers: Number of values in the results of one configuration.

    Yields:
        Slices or arrays of indices. A sample is random with a fixed seed. A regular choice could be biased,
        because batches are often ordered.
    """
    step = min(_MOST, max(1, _AT_A_TIME // max(1, numbers)))
    if verify == "sample" and n > SAMPLE:
        drawn = np.sort(np.random.default_rng(0).choice(n, SAMPLE, replace=False))
        yield from (drawn[i : i + step] for i in range(0, SAMPLE, step))
    else:
        yield from (slice(i, min(i + step, n)) for i in range(0, n, step))
