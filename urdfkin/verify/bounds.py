"""Bounds on the difference between two correct computations of a quantity.

Each number of a result is compared with the oracle's number. The result is accepted if no difference exceeds
this bound:

    k * eps * scale,      eps = 2^-52,      k = factors * PINOCCHIO_ROUNDINGS * joints.

*Scale.* Each number is a sum of terms. The scale is an upper bound on the sum of the absolute values of these
terms (`compute_magnitudes`), in the unit of the number. Two computations may add the terms in different
orders. Large terms may cancel, so that both sums are small. The bound on the rounding errors of these sums is
still proportional to the scale.

*Number k.* The number k is the allowed number of rounding errors, to first order in eps
(`urdfkin.kinematics.roundings`). Each joint on the path adds a fixed number of rounding errors. A joint also
rotates the vectors of the joints after it, but a rotation does not amplify errors. The error therefore grows
linearly with the number of joints.

*Factors.* Each term of a quantity is a product of rotated vectors. Each vector is a factor with its own
rounding error:

| Quantity | Factors | Vectors in a term |
|---|---|---|
| position | 1 | R d |
| velocity | 2 | w, d |
| acceleration | 3 | w, w, d, or v z, w, d |
| Jacobian, linear rows | 2 | z, d |
| J-dot, linear rows | 3 | w, z, d |
| Hessian, linear rows | 3 | z, z, d |

The reference frames LOCAL and WORLD need one more factor. For LOCAL, this factor is a rotation into the
frame's axes. For WORLD, this factor is a cross product with the frame's position p.

In measurements, each joint adds less than eps * scale to a difference, because rounding errors rarely all
have the same sign. Reports give each difference as a multiple of eps * scale. These multiples can be compared
between small and large robots.

*Magnitudes.* `compute_magnitudes` replaces each vector by its length and evaluates the equations 7.58 and
7.127 to 7.130 (`urdfkin.kinematics.number_kinds`). After this replacement, no term is negative, so no
intermediate value exceeds the result. Eq. 7.129 contains the term v_i w_{i-1} x z, but Pinocchio computes v_i
w_i x z. The two terms differ by the cross product v_i^2 z x z, which is 0 except for rounding errors. The
rounding errors of this cross product are large for fast joints with an oblique axis. The bound on the angular
acceleration alpha therefore uses w_i instead of w_{i-1}.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled import preload
from urdfkin.compiled.plan import ColumnField, CompiledTree, Geometry, JointMotion, StepField
from urdfkin.kinematics import lengths as steps
from urdfkin.kinematics.lengths import LinkBounds
from urdfkin.kinematics.number_kinds import Length, magnitude, norm, product
from urdfkin.kinematics.number_kinds import length_equations as eq
from urdfkin.kinematics.roundings import EPS, MUJOCO_ROUNDINGS, PINOCCHIO_ROUNDINGS, joint_roundings
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

KERNELS = "urdfkin.verify.kernels"
_NO_ROTATION = np.eye(3).ravel()
#: First indices in the state of a moving base.
_BASE_VECTOR_INDICES = 9, 12, 15, 18, 21
#: Number of configurations per block of the kernel `lengths`.
#: A block fits into the L1 cache.
_BLOCK_LENGTH = 64


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Upper bounds on the terms of a frame's position, velocity and acceleration.

    Attributes:
        p: (n, frames) length of the path from the world origin, with prismatic displacements, m.
        w: (n, frames) angular velocity, rad/s.
        vel: (n, frames) linear velocity, m/s.
        alpha: (n, frames) angular acceleration, rad/s^2.
        acc: (n, frames) linear acceleration, m/s^2.
        roundings: (n, frames) upper bound on the rounding error of a rotated vector, divided by eps times the
            vector's length. Each factor of a term is a rotated vector. The bound counts all URDF joints on
            the path, and one additional joint as a margin. A rotated base counts as one more joint.
    """

    p: FloatArray
    w: FloatArray
    vel: FloatArray
    alpha: FloatArray
    acc: FloatArray
    roundings: FloatArray


@np.errstate(over="ignore", under="ignore", invalid="ignore")
def compute_magnitudes(
    plan: CompiledTree, q: FloatArray, v: FloatArray | None, a: FloatArray | None, base: FloatArray
) -> Magnitudes:
    """Return upper bounds on the terms of each frame's position, velocity and acceleration.

    `q` has the shape (n, nq); `v` and `a` have the shape (n, nv) or are None. `base` (1 or n, 24) is the
    state of the moving base. Without v, only `p` and `roundings` are valid.
    """
    n, lengths = len(q), _get_lengths(plan)
    out = np.empty((6, n, len(lengths.ends)))
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    inputs = (q, base) if v is None or a is None else (q, base, v, a)
    kernel = preload.get_kernel("lengths", module=KERNELS) if n > 1 and len(inputs) > 2 else None
    if kernel is None:
        begin = time.thread_time()
        _fill_without_kernel(lengths, inputs, out)
        if n > 1:
            preload.add_time("lengths", time.thread_time() - begin)
    else:
        _fill_with_kernel(kernel, lengths, inputs, out)
    is_rotated = (base[:, :9] != _NO_ROTATION).any(axis=1)
    out[5] = joint_roundings(plan.depth + 1 + is_rotated[:, np.newaxis], plan.tilts)
    return Magnitudes(*out)


def _fill_without_kernel(lengths: _Lengths, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    q, base, *rates = (_columns(x, out.shape[1]) for x in inputs)
    states = [tuple(_norm(base[at : at + 3]) for at in _BASE_VECTOR_INDICES)]
    for link in lengths.links:
        states.append(
            (_propagate_state if rates else _propagate_position)(link, states[link.parent + 1], q, *rates)
        )
    for end in lengths.ends:
        bounds = (steps.translate_point if rates else _translate_position)(states[end.step + 1], end.length)
        for row, values in zip(out, bounds, strict=False):
            row[:, end.frame] = values


def _fill_with_kernel(kernel: Any, lengths: _Lengths, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Fill `out` with the compiled kernel; the results equal those of `_fill_without_kernel` bit for bit."""
    links = lengths.links
    # The stride is 0 if all configurations share one row.
    q, base, v, a = (x if x.strides[0] else x[:1] for x in inputs)
    free = [
        x
        for link in links
        if link.kind >= JointMotion.PLANAR
        for x in _free_lengths(link, *(x.T for x in (q, v, a)))
    ]
    kernel(
        *lengths.tables,
        *map(np.ascontiguousarray, (q, v, a)),
        _stack_columns(free),
        norm(base[:, _BASE_VECTOR_INDICES[0] :].reshape(-1, len(_BASE_VECTOR_INDICES), 3)),
        np.zeros((len(links) + 2, len(_BASE_VECTOR_INDICES), _BLOCK_LENGTH)),
        out[:5].reshape(-1),
    )


def _stack_columns(columns: Sequence[FloatArray]) -> FloatArray:
    """Return an array with the given columns; a column of length 1 fills all rows."""
    rows = np.empty((max(map(len, columns), default=1), len(columns)))
    for row, column in zip(rows.T, columns, strict=True):
        row[:] = column
    return rows


class _MovingJoint(NamedTuple):
    """A moving joint.

    `multiplier` and `offset` are the absolute values of the joint's mimic multiplier and mimic offset.
    """

    kind: int
    q: int
    v: int
    parent: int
    length: float
    multiplier: float
    offset: float


class _FrameEnd(NamedTuple):
    """A frame of a compiled tree.

    `step` is the index of the last moving joint before the frame. `length` is the length (m) of the path from
    this joint to the frame.
    """

    step: int
    frame: int
    length: float


class _Lengths(NamedTuple):
    """Moving joints and frames of a compiled tree, as Python numbers and as arrays."""

    links: list[_MovingJoint]
    ends: list[_FrameEnd]
    tables: tuple[NDArray[Any], ...]


def _get_lengths(plan: CompiledTree) -> _Lengths:
    found: _Lengths | None = plan.cache.get("lengths")
    if found is None:
        lengths, count = magnitude(plan.lengths).tolist(), len(plan.steps)
        rules = np.abs(plan.geometry[:, Geometry.MULTIPLIER :]).tolist()
        steps = zip(plan.steps.tolist(), plan.parents.tolist(), lengths[:count], rules, strict=True)
        links = [
            _MovingJoint(kind, q, v, parent, length, multiplier, float(magnitude(offset)))
            for (kind, q, v), parent, length, (multiplier, offset) in steps
        ]
        frames = zip(plan.frames.tolist(), lengths[count:], strict=True)
        ends = [_FrameEnd(step, frame, length) for (step, frame), length in frames]
        tables = (
            np.array([link[:4] for link in links], dtype=np.int64).reshape(-1, 4),
            np.array([link[4:] for link in links]).reshape(-1, 3),
            np.array([end[:2] for end in ends], dtype=np.int64).reshape(-1, 2),
            np.array([end.length for end in ends]),
        )
        found = plan.cache["lengths"] = _Lengths(links, ends, tables)
    return found


def _columns(x: FloatArray, n: int) -> Any:
    """Return the columns of an array. The array has n rows, or one row for all n configurations.

    For a single configuration (n = 1), the columns are Python numbers.
    """
    return x[0].tolist() if n == len(x) == 1 else x.T


def _norm(x: Any) -> Length:
    return norm(x.T) if isinstance(x, np.ndarray) else float(norm(np.array(x))) if any(x) else 0.0


def _translate_position(state: LinkBounds, d: Length) -> LinkBounds:
    return eq.point_position(state[0], None, d), *state[1:]


#: Number of translations and number of rotations of each joint.
_FREE_JOINT_SIZES = {int(JointMotion.PLANAR): (2, 1), int(JointMotion.FLOATING): (3, 3)}


def _displacement(link: _MovingJoint, q: Any) -> Length:
    """Return a bound on the displacement of a prismatic, planar or floating joint, m."""
    if link.kind != JointMotion.PRISMATIC:
        return _norm(q[link.q : link.q + _FREE_JOINT_SIZES[link.kind][0]])
    return product(link.multiplier, abs(q[link.q])) + link.offset


def _propagate_position(link: _MovingJoint, state: LinkBounds, q: Any) -> LinkBounds:
    turns = link.kind == JointMotion.REVOLUTE
    return _translate_position(state, link.length if turns else link.length + _displacement(link, q))


def _free_lengths(link: _MovingJoint, q: Any, v: Any, a: Any) -> tuple[Length, ...]:
    """Return the norms of a planar or floating joint's displacement, velocities and accelerations."""
    at, (slides, turns) = link.v, _FREE_JOINT_SIZES[link.kind]
    (u, o), (u_rate, o_rate) = (
        (_norm(x[at : at + slides]), _norm(x[at + slides : at + slides + turns])) for x in (v, a)
    )
    return _displacement(link, q), o, u, o_rate, u_rate


def _propagate_state(link: _MovingJoint, state: LinkBounds, q: Any, v: Any, a: Any) -> LinkBounds:
    kind, d, at = link.kind, link.length, link.v
    if kind >= JointMotion.PLANAR:
        displacement, *rates = _free_lengths(link, q, v, a)
        return steps.after_free_joint(state, d + displacement, *rates)
    rate, rate_2 = product(link.multiplier, abs(v[at])), product(link.multiplier, abs(a[at]))
    if kind == JointMotion.PRISMATIC:
        return steps.after_prismatic(state, d + _displacement(link, q), rate, rate_2)
    return steps.after_revolute(state, d, rate, rate_2)


_ALIGNED = Reference.LOCAL_WORLD_ALIGNED

#: A scale above the range of doubles becomes inf.
#: The comparison accepts no result with an infinite scale.
_allow_overflow = np.errstate(over="ignore", under="ignore", invalid="ignore")


@dataclass(frozen=True, slots=True)
class Bound:
    """The bound k * eps * scale on the difference between two computations of a quantity.

    `k` and `scale` can be broadcast to the shape of the results.

    Attributes:
        scale: Each number of a result is a sum of terms. The scale is an upper bound on the sum of the terms'
            absolute values, in the unit of the number. If the scale is 0, the results of urdfkin and of the
            oracle must be equal.
        k: Allowed difference in multiples of eps * scale.
    """

    scale: FloatArray
    k: FloatArray


def result_k(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """Return the bound's `k` for each result, as an array of shape `leading`.

    If `k` is 0, negative or infinite, the function replaces `k` by NaN. If `k` is NaN, no result is within
    the bound.
    """
    k = bound.k.reshape(bound.k.shape[: len(leading)])
    k = np.where((k > 0.0) & (k < np.inf), k, np.nan)
    return k if k.shape == leading else np.broadcast_to(k, leading)


def make_bound(
    scale: FloatArray, factors: int, magnitudes: Magnitudes, reference: Reference = _ALIGNED
) -> Bound:
    """Return the bound with k = factors * `magnitudes.roundings`.

    The reference frames LOCAL and WORLD need one factor more than `factors`.
    """
    factors += reference is not _ALIGNED
    k = factors * magnitudes.roundings
    return Bound(scale, k.reshape(*k.shape, *[1] * (scale.ndim - 2)))


@_allow_overflow
def mujoco_magnitudes(magnitudes: Magnitudes) -> Magnitudes:
    """Return the `Magnitudes` for a comparison of urdfkin's results with MuJoCo's results.

    The argument `magnitudes` is valid for a comparison with Pinocchio.

    MuJoCo computes velocities, accelerations and Jacobian columns at a centre of mass.
    `urdfkin.verify.mujoco` places the centre of mass at the root. At the end, MuJoCo converts the results to
    the frame's origin. The distance of a joint or the frame from the centre of mass is at most the length p
    of the path. Lever arms are therefore at most 2 p long. A conversion to or from the centre of mass adds a
    cross product with a lever arm. This cross product at most doubles the number of factors in a term. For
    each joint, the bound allows `MUJOCO_ROUNDINGS` = 30 instead of `PINOCCHIO_ROUNDINGS` = 24 rounding
    errors.
    """
    p = 2.0 * magnitudes.p
    shared = eq.tangential(magnitudes.w, magnitudes.vel)
    return Magnitudes(
        p=p,
        w=magnitudes.w,
        vel=eq.point_velocity(magnitudes.vel, magnitudes.w, p),
        alpha=magnitudes.alpha,
        acc=eq.point_acceleration(magnitudes.acc + shared, magnitudes.alpha, magnitudes.w, p),
        roundings=2.0 * (MUJOCO_ROUNDINGS / PINOCCHIO_ROUNDINGS) * magnitudes.roundings,
    )


class DecimalErrors(NamedTuple):
    """Errors of the conversion of a URDF's decimals to doubles.

    Attributes:
        angles: (n,) sum of the angle errors of all joints on the path, in multiples of eps rad.
        rule_count: Number of mimic rules of the joints on the path. If a joint mimics another mimic joint,
            the number includes the rules of both joints.
        lengths: (steps + 1,) additional lengths for `CompiledTree.lengths`, m. The terms of a chain of mimic
            rules may cancel, but the rounding errors of the terms do not cancel. A prismatic mimic joint with
            such a chain therefore has a positive additional length.
    """

    angles: FloatArray
    rule_count: int
    lengths: FloatArray


def true_value_magnitudes(
    plan: CompiledTree, q: FloatArray, v: FloatArray | None, a: FloatArray | None, errors: DecimalErrors
) -> Magnitudes:
    """Return the `Magnitudes` for a comparison of one program's results with the true values.

    The true values are computed from the decimals in the URDF and from the doubles q, v and a. The true
    values are rounded to 17 digits. The bound allows `PINOCCHIO_ROUNDINGS` = 24 rounding errors for each
    joint. One program makes at most 16.8 rounding errors for each joint (`urdfkin.kinematics.roundings`). The
    remaining 7.2 rounding errors cover the conversion of decimals to doubles. The offset, the axis and the
    true value have an error of half an eps each. The error of the axis counts twice, because two rotations
    use the axis. The conversion of two kinds of numbers causes larger errors:

    - The relative error of roll, pitch and yaw is half an eps. All vectors after the joint therefore rotate
      by at most eps (|roll| + |pitch| + |yaw|) / 2.
    - A mimic joint's value is m x + c. The roundings of m, of the product and of the sum cause an error of
      at most eps (3 |m x| + |c|) / 2. The rounding of c causes an error of at most eps |c| / 2. The error
      of x is multiplied by |m|.

    *Chains of mimic rules.* If a mimic joint mimics another mimic joint, r rules form a chain. Let X be the
    sum of the absolute values of all terms in the joint's value. For an independent joint, X is |q|. For a
    joint that mimics a joint with the value X', X is |m| X' + |c|. A program may combine the r rules into one
    rule M q + C. The number C is a sum of r terms, which requires r - 1 additions. No intermediate sum
    exceeds X, so each addition has an error of at most eps X / 2. The bound therefore allows an additional
    error of eps (r - 1) X / 2 for the sum C. All other rounding errors of the combined rule are the same as
    in a program that applies the r rules one after the other.

    *Revolute mimic joint.* An error of the joint's value rotates all later vectors of the path. An angle
    error of 1 eps rad changes a vector by at most eps times the length of the vector.

    *Prismatic mimic joint.* Each term of X is rounded at most 3 r times. The displacement therefore has an
    error of at most 1.5 r X eps, with separate rules and with a combined rule. If the offsets of a chain
    cancel each other, |M q| + |C| is far below X. The function therefore uses X as the length of the
    displacement. With this length, the bound allows a relative error of 1.5 eps for each rule. This bound
    also covers the joint's velocity and acceleration. Velocity and acceleration are rounded less often than
    the displacement.

    `plan` is the compiled tree of one frame. `errors` contains the conversion errors of the joints on the
    path to this frame, for q (n, nq).
    """
    magnitudes = compute_magnitudes(
        replace(plan, lengths=plan.lengths + errors.lengths), q, v, a, FIXED_BASE_STATE
    )
    more = errors.angles[:, np.newaxis] + 1.5 * errors.rule_count
    return replace(magnitudes, roundings=magnitudes.roundings + more)


def placement_scale(plan: CompiledTree, magnitudes: Magnitudes) -> FloatArray:
    """Return the scale (n, frames, 4, 4) of the bound on placements.

    The scale of a position is the length of the path. The scale of a rotation is 1, and the scale of the last
    row is 0.
    """
    scale = np.zeros((*magnitudes.p.shape, 4, 4))
    scale[..., :3, :3] = 1.0
    scale[..., :3, 3] = magnitudes.p[..., None]
    return scale


@_allow_overflow
def mjcf_placement_bound(bound: Bound, lengths: FloatArray, angles: FloatArray) -> Bound:
    """Return the bound on the difference between the tree's and MuJoCo's placements for an MJCF file.

    *Lengths.* In an MJCF file, the offset of a body is a sum of vectors. These vectors are the body's `pos`,
    the `pos` of the joints, and a vector for the `ref` of a slide joint. urdfkin adds these vectors once,
    when reading the file. MuJoCo adds the vectors for each configuration. A single vector can be longer than
    the sum. The scale of positions is therefore the larger of the length of the path and `lengths`.

    *Angles.* MuJoCo rotates a hinge by the rounded angle q - ref. urdfkin rotates the hinge by ref and by q
    separately. The rounding error of q - ref is at most (eps/2) (|q| + |ref|) rad. This angle error rotates
    all bodies after the hinge. An entry of a rotation matrix changes by at most the angle error. A coordinate
    of a position changes by at most the angle error times the length of the path. To first order, the numbers
    therefore change by at most `angles` * eps/2 * scale. The function multiplies the scale by 1 + `angles` /
    k, so the bound increases by `angles` * eps * scale. The increase of the bound is twice the first-order
    change of the numbers. The factor of two covers second-order terms.

    `bound` is the bound of the tree's placements (n, frames, 4, 4). `lengths` (n, frames) is the sum of the
    lengths (m) of the vectors `pos` and `ref` on the path to a frame. `angles` (n, frames) is the sum of |q|
    + |ref| (rad) over the hinges with a reference value.
    """
    scale = bound.scale.copy()
    scale[..., :3, 3] = np.maximum(scale[..., :3, 3], lengths[..., None])
    scale[..., :3, :] *= 1.0 + (angles / result_k(bound, angles.shape))[..., None, None]
    return Bound(scale, bound.k)


@_allow_overflow
def velocity_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on velocities [linear; angular], (n, frames, 6)."""
    linear = magnitudes.vel
    if reference.at_world:
        linear = eq.point_velocity(linear, magnitudes.w, magnitudes.p)
    return _repeat_as_six_rows(linear, magnitudes.w)


@_allow_overflow
def acceleration_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on accelerations [linear; angular], (n, frames, 6).

    Pinocchio computes the classical acceleration as the spatial acceleration plus w x vel. The scale
    therefore includes the term w x vel.

    *Breakdown.* The scale is also valid for the sum of the contributions in an `AccelerationBreakdown`. Let
    d_k be the vector from joint k to the frame. Let w_k be the sum of the absolute values of the joint
    velocities up to joint k.

    - The terms v_k z x (v_k z x d_k) and 2 w_{k-1} x (v_k z x d_k) together have a length of at most (w_k^2 -
      w_{k-1}^2) |d_k|. The sum over all joints is the sum of w_k^2 times the length of link k, as in eq.
      7.130.
    - A vector d_k is the sum of the vectors between successive joint origins, with the rounding errors of the
      sums in eq. 7.77.
    - For n joints, the breakdown has 4 n terms. The sum of these terms has n + 3 rounding errors.
    - For each joint, the bound allows 2 eps for the sums. The sums for d_k and the sum of the 4 n terms
      together have smaller rounding errors.
    """
    shared = eq.tangential(magnitudes.w, magnitudes.vel)
    linear = magnitudes.acc + shared
    if reference.at_world:
        linear = eq.point_acceleration(linear + shared, magnitudes.alpha, magnitudes.w, magnitudes.p)
    return _repeat_as_six_rows(linear, magnitudes.alpha)


@_allow_overflow
def imu_scale(magnitudes: Magnitudes, gravity: FloatArray) -> FloatArray:
    """Return the scale of the bound on IMU readings, (n, frames, 6), for a gravity vector (3,)."""
    return _repeat_as_six_rows(
        magnitudes.acc + eq.tangential(magnitudes.w, magnitudes.vel) + norm(gravity), magnitudes.w
    )


def _repeat_as_six_rows(linear: FloatArray, angular: FloatArray) -> FloatArray:
    """Return (n, frames, 6, ...) with three rows of `linear` and three rows of `angular`."""
    scale = np.empty((*linear.shape[:2], 6, *linear.shape[2:]))
    rows = scale.transpose(2, 0, 1, *range(3, scale.ndim))  # `np.moveaxis` is slower.
    rows[:3], rows[3:] = linear, angular
    return scale


@_allow_overflow
def jacobian_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on Jacobians, (n, frames, 6, nv).

    A revolute joint's column is [z x d; z]. The scale is the length of the path in the linear rows, and 1 in
    the angular rows. A prismatic joint's column is [z; 0]. The scale is 1 in the linear rows, and 0 in the
    angular rows. For a joint that is not on the path, the scale is 0. The scale of a mimic joint is
    multiplied by |multiplier|, and is added to the scale of the mimicked joint.
    """
    turning, sliding = column_weights(plan)
    linear, angular = eq.turning_column(turning, magnitudes.p[..., None])
    return _repeat_as_six_rows(linear + sliding, angular)


@_allow_overflow
def jacobian_rate_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on J-dot, (n, frames, 6, nv).

    The linear rows of a revolute joint's column are z x d. The vector d is at most as long as the path to the
    frame. The derivative of d is at most the bound on the velocity of the frame's origin. In LOCAL, J-dot is
    the derivative of components along the frame's axes, which rotate.
    """
    turning, sliding = column_weights(plan)
    w, p, vel = magnitudes.w[..., None], magnitudes.p[..., None], magnitudes.vel[..., None]
    linear, angular = eq.turning_column_rate(turning, eq.axis_rate(w, turning), p, vel)
    linear = linear + eq.axis_rate(w, sliding)
    if reference.own_axes:
        column, axis = eq.turning_column(turning, p)
        linear = eq.rate_in_turning_axes(linear, w, column + sliding)
        angular = eq.rate_in_turning_axes(angular, w, axis)
    return _repeat_as_six_rows(linear, angular)


#: Cross products in the linear rows of Pinocchio's Hessian.
#: A Hessian entry is d(Jacobian column i) / d(coordinate of joint j).
#: The joints on the path are numbered from the root.
#: First pair: j <= i. Second pair: j > i.
#: First number: products z x (z x d) of two revolute joints.
#: Second number: products z x z of a revolute and a prismatic joint.
_PAIR_TERMS: dict[Reference, tuple[tuple[float, float], tuple[float, float]]] = {
    Reference.LOCAL_WORLD_ALIGNED: ((5.0, 2.0), (2.0, 1.0)),
    Reference.WORLD: ((2.0, 1.0), (0.0, 0.0)),
    Reference.LOCAL: ((0.0, 0.0), (3.0, 1.0)),
}


@_allow_overflow
def hessian_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on Hessians, (n, frames, 6, nv, nv).

    An entry of the Hessian depends on a pair of Jacobian columns. The column of a mimic joint is added to the
    column of the mimicked joint. An entry can therefore be a sum over several pairs. The function adds the
    scales of these pairs. A lever arm d is never longer than the path.

    Pinocchio computes each entry from two Jacobian columns c = [z x d; z] at the world origin. `_PAIR_TERMS`
    contains the numbers of products that these steps add:

    - two for c_1 x c_2, whose linear rows are w_1 x v_2 + v_1 x w_2
    - one for the conversion of the result to the frame's origin p: p x (w_1 x w_2)
    - two for the conversion of a column to p before the product: (v - p x w) x w.

    In the linear rows, urdfkin computes one product z x (z x d) for LOCAL_WORLD_ALIGNED, and the two products
    of c_1 x c_2 for LOCAL and WORLD. For LOCAL, urdfkin rotates the two columns by R before the products.
    Each of the two products has the five factors R, z, R, z and d. The two products together have 10 factors.
    For LOCAL, the bound allows 12 factors: three products of four factors each.
    """
    shape = len(plan.frames), plan.nv, plan.nv
    turning, mixed, angular = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    (near, near_mixed), (far, far_mixed) = _PAIR_TERMS[reference]
    step, rate = plan.columns[:, ColumnField.STEP], plan.columns[:, ColumnField.V]
    turns, size_of = plan.columns[:, ColumnField.IS_ROTATION] == 1, np.abs(plan.multipliers)
    for f, (_, frame) in enumerate(plan.frames):
        on_path = np.flatnonzero(plan.sum_columns[f] >= 0)
        i, j = on_path[:, np.newaxis], on_path[np.newaxis, :]
        before = step[j] <= step[i]
        sizes = product(size_of[i], size_of[j])
        both, one = sizes * (turns[i] & turns[j]), sizes * (turns[i] ^ turns[j])
        pair = frame, rate[i], rate[j]
        np.add.at(turning, pair, both * np.where(before, near, far))
        np.add.at(mixed, pair, one * np.where(before, near_mixed, far_mixed))
        np.add.at(angular, pair, both * (before != reference.own_axes))
    linear = product(turning, magnitudes.p[..., np.newaxis, np.newaxis]) + mixed
    return _repeat_as_six_rows(linear, angular)


@_allow_overflow
def euler_jacobian_bound(bound: Bound, magnitudes: Magnitudes, axis_sine: FloatArray) -> Bound:
    """Return the bound of analytical Jacobians with Euler angles, (n, frames, 6, nv).

    The position rows have the same bound as the rows of the velocity Jacobian. The other three rows give the
    derivatives of the Euler angles. Let w be the angular part of one column of the velocity Jacobian. The
    rotation axes of the three angles are e_i, u and t = R e_k (`urdfkin.verify.analytical_reference`). Let s
    = |e_i x t|, which is the sine or cosine of the middle angle:

    | Row | Element | Length of the vector |
    |---|---|---|
    | middle angle | u . w | 1 |
    | first or last angle | r . w, r is the reciprocal basis vector of the axis | 1 / s |

    Let delta = k eps be the error of t, and also the relative error of w. The error of t rotates u by at most
    delta / s. Let r' be the reciprocal vector of t. The error of t changes r by the vector -(r . du) u - (r .
    dt) r'. This vector is at most 2 delta / s^2 long. The errors of the rows are:

    - first and last angle: 2 delta / s^2 + delta / s <= 3 delta / s^2
    - middle angle: delta / s + delta <= 2 delta / s

    The bound on the velocity Jacobian is 2 delta, because a Jacobian has two factors. The scale is therefore
    multiplied by 1.5 / s^2 for the first and last angle, and by 1 / s for the middle angle. The function uses
    the smallest possible value of s, which is `axis_sine` - delta. The functions arctan2 and sine add about 3
    eps, and products and quotients about 10 eps. The sum is 13 eps. `Magnitudes.roundings` counts one joint
    more than the path contains. For the additional joint, the bound allows at least `PINOCCHIO_ROUNDINGS` =
    24 eps, which is more than 13 eps.

    `bound` is the bound of the velocity Jacobian. `axis_sine` (n, frames) contains s for the rotations that
    the oracle computes.
    """
    s = axis_sine - EPS * magnitudes.roundings
    # Here s is the sine minus its rounding error. If s is not positive, the scale becomes infinite.
    # The comparison accepts no result with an infinite scale.
    s = np.where(s > 0.0, s, 0.0)
    scale = bound.scale.copy()
    with np.errstate(divide="ignore"):
        scale[..., [3, 5], :] *= (1.5 / (s * s))[..., None, None]
        scale[..., 4, :] *= (1.0 / s)[..., None]
    return Bound(scale, bound.k)


def quaternion_jacobian_bound(bound: Bound) -> Bound:
    """Return the error bound (n, frames, 7, nv) of analytical Jacobians for quaternions.

    Analytical Jacobians for quaternions are never singular. The rows of positions have the bound of the
    velocity Jacobian. Let delta be the error of R. The elements of the matrix 4 q q^T are linear functions of
    R. The longest row of this matrix has a length of at least 2. The error of this row is below 4.6 delta, so
    the error of q is below 2.3 delta. The derivative of q is half the quaternion product of w and q, with an
    error of (2.3 + 1) / 2 delta |w|. This error is below 2 delta |w|. The angular rows of the velocity
    Jacobian have the bound 2 delta |w|. Therefore, the derivative of q has the same bound.
    """
    return Bound(np.concatenate((bound.scale, bound.scale[..., 5:, :]), axis=-2), bound.k)


def sign_limit(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """Return the value of |qw| below which rounding can change the sign of a quaternion's qw.

    Let delta be the error of R, as in `quaternion_jacobian_bound`. The limit 1.5 k eps equals 3 delta. The
    error of qw is at most 2.3 delta, so the limit is larger than this error.
    """
    return 1.5 * EPS * result_k(bound, leading)


def singularity_margin(plan: CompiledTree) -> float:
    """Return four times the error of a frame's rotation, rad.

    If Euler angles are closer to a singularity than this margin, no digit of the analytical Jacobian is
    reliable.
    """
    return 4.0 * EPS * float(np.max(joint_roundings(plan.depth + 1, plan.tilts), initial=0.0))


def column_weights(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    """Return the sums (frames, nv) of |multiplier| over revolute joints and over prismatic joints.

    An independent joint has the multiplier 1.
    """
    weights: FloatArray | None = plan.cache.get("column weights")
    if weights is None:
        weights = np.zeros((2, len(plan.frames), plan.nv))
        for f, (_, frame) in enumerate(plan.frames):
            for c in np.flatnonzero(plan.sum_columns[f] >= 0):
                kind = 0 if plan.columns[c, ColumnField.IS_ROTATION] else 1
                weights[kind, frame, plan.columns[c, ColumnField.V]] += abs(plan.multipliers[c])
        weights.setflags(write=False)
        # Other threads may read the cache, so the array is complete.
        plan.cache["column weights"] = weights
    return weights[0], weights[1]


def find_active_entries(
    plan: CompiledTree, reference: Reference = _ALIGNED, *, root_at_origin: bool = True
) -> NDArray[np.bool_]:
    """Return a bool array (frames, 6, nv) that is False for Jacobian entries that are always 0.

    A Jacobian entry that is marked False is 0 for every q. In LOCAL and LOCAL_WORLD_ALIGNED, the entry is
    also 0 for every motion of the base. `root_at_origin` states whether the root link is at the world's
    origin; only WORLD uses this argument.

    The linear rows of a revolute joint's column are z x d. In WORLD, d leads from the joint to the world's
    origin. In the other reference frames, d leads from the joint to the frame. The vector d is 0 for every q
    if all lengths between the ends of d are 0, and no joint between the ends translates.
    """
    found = np.zeros((len(plan.frames), 6, plan.nv), dtype=bool)
    turns = plan.steps[:, StepField.KIND] == JointMotion.REVOLUTE
    multipliers = plan.geometry[:, Geometry.MULTIPLIER :]
    extends = (plan.lengths[: len(turns)] > 0.0) | (~turns & (multipliers != 0.0).any(axis=1))
    for f, (end, frame) in enumerate(plan.frames):
        path, step = list[int](), int(end)
        while step >= 0:
            path.append(step)
            step = int(plan.parents[step])
        if reference.at_world:
            levers = np.logical_or.accumulate([not root_at_origin, *extends[path[::-1]]])[:0:-1]
        else:
            levers = np.logical_or.accumulate([plan.lengths[len(turns) + f] > 0.0, *extends[path[:-1]]])
        has_lever = dict(zip(path, levers, strict=False))
        for c in np.flatnonzero((plan.sum_columns[f] >= 0) & (plan.multipliers != 0.0)):
            column = plan.columns[c]
            rows = found[frame, :, column[ColumnField.V]]
            rows[:3] |= not column[ColumnField.IS_ROTATION] or has_lever[column[ColumnField.STEP]]
            rows[3:] |= column[ColumnField.IS_ROTATION] == 1
    return found
