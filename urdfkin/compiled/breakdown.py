"""The acceleration of a frame as a sum of contributions, one for each joint and each kind of acceleration.

| symbol | quantity |
|---|---|
| u_k | velocity of the frame's origin relative to link k-1, if joints k+1, k+2, ... are fixed |
| w_{k-1} | angular velocity of link k-1 |
| d | vector from the joint's origin to the frame's origin |

For `Reference.WORLD`, the world's origin replaces the frame's origin in u_k and d. For the other reference
frames, d is the sum of the interorigin vectors after the joint (7.110). A difference of two positions in the
world would lose digits if the robot is far from the world's origin or has a long link.

    u_k = v_k z x d    for a revolute joint
    u_k = v_k z        for a prismatic joint

Equation 7.125 gives the terms of the acceleration of a moving point in a moving frame. Equation 7.130 is the
sum of these terms over all joints:

| kind | term | cause |
|---|---|---|
| transverse | a_k z x d | acceleration of a revolute joint |
| centripetal | v_k z x (v_k z x d) | velocity of a revolute joint |
| coriolis | 2 w_{k-1} x u_k | velocity of the joint while its link rotates |
| sliding | a_k z | acceleration of a prismatic joint |

The angular acceleration has the terms a_k z (transverse) and v_k w_{k-1} x z (Coriolis) of equation 7.129. A
planar or floating joint has an additional Coriolis term, because the joint's axes of translation rotate. The
additional term is o x s for the linear velocity s and the angular velocity o of the joint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, assert_never

import numpy as np

from urdfkin.compiled.evaluate import compute_in_parts, placements, velocities
from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.errors import NotFiniteError, RangeError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.kinematics.inputs import as_sample_index, check_range
from urdfkin.kinematics.number_kinds import array_equations as eq
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Kinds of acceleration that a joint contributes, in the order of `AccelerationBreakdown.terms`.
ACCELERATION_KINDS = ("transverse", "centripetal", "coriolis", "sliding")
_MAX_DISPLAYED_SAMPLES = 2


@dataclass(frozen=True, eq=False, repr=False)
class AccelerationBreakdown(Displayable):
    """Contributions of the joints to a frame's acceleration.

    The last axis of each array contains a classical acceleration [linear; angular], m/s^2 and rad/s^2.

    Attributes:
        joints: Moving joints from the base to the frame.
        base: (..., 6) acceleration that the base's motion alone causes.
        terms: (..., joints, 4, 6) contributions; `ACCELERATION_KINDS` names the four kinds.
    """

    joints: tuple[str, ...]
    base: FloatArray
    terms: FloatArray

    def __repr__(self) -> str:
        return f"<AccelerationBreakdown of {len(self.joints)} joints, batch {self.base.shape[:-1]}>"

    def contributions(self, sample: tuple[int, ...] = ()) -> Iterator[tuple[str, str, FloatArray]]:
        """Yield (joint, kind, six numbers) for each nonzero contribution of a sample.

        Args:
            sample: Indices of the sample in the batch; () for a single configuration.

        Raises:
            InputError: the sample does not exist.
        """
        sample = as_sample_index(sample, self.base.shape[:-1])
        if self.base[sample].any():
            yield "base", "moving base", self.base[sample]
        for j, joint in enumerate(self.joints):
            for k, kind in enumerate(ACCELERATION_KINDS):
                if self.terms[(*sample, j, k)].any():
                    yield joint, kind, self.terms[(*sample, j, k)]

    def _text_document(self) -> TextDocument:
        heads = ("joint", "kind", "lin x", "lin y", "lin z", "ang x", "ang y", "ang z")
        batch = self.base.shape[:-1]
        parts: list[str | Table] = ["m/s^2 and rad/s^2; the parts sum to the acceleration (7.125, 7.130)."]
        for sample in list(np.ndindex(*batch))[:_MAX_DISPLAYED_SAMPLES]:
            parts += [f"sample {list(sample)}"] if sample else []
            rows = [(joint, kind, *six.tolist()) for joint, kind, six in self.contributions(sample)]
            parts.append(Table(heads, [*rows, ("sum", "", *self.total[sample].tolist())], left=2))
        if (more := math.prod(batch) - _MAX_DISPLAYED_SAMPLES) > 0:
            parts.append(f"... and {more} more samples")
        return TextDocument("Acceleration by joint and kind", parts)

    @cached_property
    def total(self) -> FloatArray:
        """The frame's acceleration (..., 6)."""
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            return check_range(self.base + self.by_joint.sum(axis=-2))

    @cached_property
    def by_joint(self) -> FloatArray:
        """The sum of each joint's contributions (..., joints, 6)."""
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            return check_range(self.terms.sum(axis=-2))

    @cached_property
    def by_kind(self) -> FloatArray:
        """The sum of all joints' contributions of each kind (..., 4, 6)."""
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            return check_range(self.terms.sum(axis=-3))


class _RelativeMotion(NamedTuple):
    """A joint's velocity or acceleration relative to the parent link.

    Each array has the shape (n, 3) and contains world components.
    """

    linear: FloatArray
    angular: FloatArray


def acceleration_breakdown(
    tree: KinematicTree,
    link: int,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference = Reference.LOCAL_WORLD_ALIGNED,
    base: FloatArray = FIXED_BASE_STATE,
    *,
    out: FloatArray | None = None,
    threads: int | None = None,
) -> AccelerationBreakdown:
    """Return each joint's contributions to a frame's classical acceleration.

    `base` has the shape (n, 24) or (1, 24); see `BaseMotion.state`.
    The terms are written to `out` (n, joints, 4, 6).
    """
    if not np.isfinite(a).all():  # `placements` and `velocities` check q and v.
        raise NotFiniteError("q, v and a must be finite")
    moving = moving_joints(tree, link)
    plan = compile_tree(tree, [0, *(i + 1 for i in tree.path(link))])  # The frames are all links on the path.
    n = len(q)
    terms = np.empty((n, len(moving), len(ACCELERATION_KINDS), 6)) if out is None else out
    base_acceleration = np.empty((n, 6))

    def compute(part: slice) -> None:
        state = base if len(base) == 1 else base[part]
        try:
            base_acceleration[part] = _contributions(
                tree, link, plan, q[part], v[part], a[part], reference, state, terms[part]
            )
        except RangeError as error:
            if part == slice(0, n):
                raise
            where = f"samples {part.start} to {part.stop - 1}"
            raise RangeError(error.what, where=where, remedy=error.remedy) from error

    compute_in_parts(compute, n, threads)
    return AccelerationBreakdown(tuple(tree.joints[i].name for i in moving), base_acceleration, terms)


def moving_joints(tree: KinematicTree, link: int) -> list[int]:
    return [i for i in tree.path(link) if tree.joints[i].kind.nv]


@np.errstate(over="ignore", under="ignore", invalid="ignore")  # RangeError replaces these warnings.
def _contributions(
    tree: KinematicTree,
    link: int,
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    reference: Reference,
    base: FloatArray,
    terms: FloatArray,
) -> FloatArray:
    """Write the joints' contributions to `terms`, and return the base's contribution (n, 6)."""
    path = tree.path(link)
    Ts = placements(plan, q, base=base, threads=1)
    velocity = velocities(plan, q, v, base=base, threads=1)
    levers = -Ts[..., :3, 3] if reference.at_world else _levers(tree, path, q, Ts[..., :3, :3])
    moving = [(k, i) for k, i in enumerate(path) if tree.joints[i].kind.nv]
    for place, (k, i) in enumerate(moving):
        R, d, w_before = Ts[:, k + 1, :3, :3], levers[:, k + 1], velocity[:, k, 3:]
        joint, at = tree.joints[i], tree.v_index[i]
        terms[:, place] = _joint_terms(
            _relative_motion(joint, v[:, at:], R), _relative_motion(joint, a[:, at:], R), w_before, d
        )
    base_acceleration = _base_acceleration(base, levers[:, 0])
    if reference.own_axes:
        back = Ts[:, -1, :3, :3].swapaxes(-1, -2)
        base_acceleration = _rotate_six_vectors(back, base_acceleration)
        terms[...] = _rotate_six_vectors(back[:, np.newaxis, np.newaxis], terms)
    if not (np.isfinite(base_acceleration).all() and np.isfinite(terms).all()):
        raise RangeError(
            "a part of the acceleration leaves the range of double precision", remedy="give smaller numbers"
        )
    return base_acceleration


def _levers(tree: KinematicTree, path: Sequence[int], q: FloatArray, Rs: FloatArray) -> FloatArray:
    """Return the vectors (n, links, 3) from each link to the last link, in world axes."""
    levers = np.zeros(Rs.shape[:-1])
    for k in reversed(range(len(path))):
        joint, at = tree.joints[path[k]], tree.q_index[path[k]]
        R, d = joint.T_parent_joint[:3, :3], joint.T_parent_joint[:3, 3]
        # A product of two matrices would have other bits for a batch than for one configuration.
        own = d + eq.rotate(R, _joint_translation(joint, q[:, at:]))
        levers[:, k] = eq.rotate(Rs[:, k], own) + levers[:, k + 1]
    return levers


def _joint_translation(joint: Joint, q: FloatArray) -> FloatArray:
    """Return the joint's translation (n, 3) in the joint's axes."""
    translation = np.zeros((len(q), 3))
    match joint.kind:
        case JointKind.PLANAR:
            translation[:, :2] = q[:, :2]
        case JointKind.FLOATING:
            translation[:] = q[:, :3]
        case JointKind.PRISMATIC:
            value = joint.mimic.multiplier * q[:, :1] + joint.mimic.offset if joint.mimic else q[:, :1]
            translation[:] = value * joint.axis
        case JointKind.REVOLUTE | JointKind.CONTINUOUS | JointKind.FIXED:
            pass
        case _:
            assert_never(joint.kind)
    return translation


def _joint_terms(
    rate: _RelativeMotion, rate_2: _RelativeMotion, w_before: FloatArray, d: FloatArray
) -> FloatArray:
    """Return the terms (n, 4, 6) in the order of `ACCELERATION_KINDS`."""
    nothing = np.zeros_like(d)
    u = eq.point_velocity(rate.linear, rate.angular, d)
    kinds = (
        (eq.transverse(rate_2.angular, d), rate_2.angular),
        (eq.centripetal(rate.angular, d), nothing),
        (
            eq.coriolis(w_before, u) + eq.axis_rate(rate.angular, rate.linear),
            eq.axis_rate(w_before, rate.angular),
        ),
        (rate_2.linear, nothing),
    )
    return np.stack([np.concatenate(pair, axis=-1) for pair in kinds], axis=-2)


def _relative_motion(joint: Joint, x: FloatArray, R: FloatArray) -> _RelativeMotion:
    linear, angular = np.zeros((len(x), 3)), np.zeros((len(x), 3))
    if joint.kind is JointKind.PLANAR:
        linear[:, :2], angular[:, 2] = x[:, :2], x[:, 2]
    elif joint.kind is JointKind.FLOATING:
        linear[:], angular[:] = x[:, :3], x[:, 3:6]
    elif not joint.kind.has_axis:
        raise NotImplementedError(f"the motion of a {joint.kind} joint")
    else:
        factor = joint.mimic.multiplier if joint.mimic else 1.0
        (angular if joint.kind.turns else linear)[:] = factor * x[:, :1] * joint.axis
    return _RelativeMotion((R @ linear[..., np.newaxis])[..., 0], (R @ angular[..., np.newaxis])[..., 0])


def _base_acceleration(base: FloatArray, d: FloatArray) -> FloatArray:
    """Return the acceleration of a point fixed to the base, at `d` from the base's origin (7.123)."""
    w, alpha, a = base[:, 12:15], base[:, 18:21], base[:, 21:24]
    linear = eq.point_acceleration(a, alpha, w, d)
    return np.concatenate((linear, np.broadcast_to(alpha, linear.shape)), axis=-1)


def _rotate_six_vectors(R: FloatArray, six: FloatArray) -> FloatArray:
    pairs = six.reshape(*six.shape[:-1], 2, 3)
    rotated: FloatArray = (R[..., np.newaxis, :, :] @ pairs[..., np.newaxis])[..., 0]
    return rotated.reshape(six.shape)
