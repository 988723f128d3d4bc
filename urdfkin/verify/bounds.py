"""Bounds on the difference between two correct computations of a quantity.

A result is accepted if no number differs from the oracle's number by more than this bound:

    k * eps * scale
    eps = 2^-52
    k = factors * (PINOCCHIO_ROUNDINGS * joints + 2 tilt / eps)
    joints = number of URDF joints on the path + 1, or + 2 for a rotated base
    tilt = sum of the tilts of these joints, rad (`urdfkin.kinematics.roundings`)

*Scale.* Each number is a sum of terms. The scale is an upper bound on the sum of their absolute values, and
has the unit of the number. Rounding errors are proportional to the scale, even if large terms cancel. The
scale can be broadcast to the shape of the results.

*Number k.* The number k is the allowed number of rounding errors, to first order in eps
(`urdfkin.kinematics.roundings`). Each joint on the path adds a fixed number of rounding errors. Rotations do
not amplify errors, so the error of a number grows linearly with the number of joints. Pinocchio replaces an
axis near a coordinate axis by the coordinate axis. The tilt is the angle between these two axes.

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

| Reference frame | Additional factor |
|---|---|
| LOCAL | rotation into the frame's axes |
| WORLD | cross product with the frame's position p |

In measurements, each joint adds less than eps * scale to a difference, because rounding errors rarely all
have the same sign. Reports state each difference as a multiple of eps * scale.

*Magnitudes.* `compute_magnitudes` evaluates the equations 7.58 and 7.127 to 7.130 with lengths instead of
vectors (`urdfkin.kinematics.number_kinds`). No length is negative, so no intermediate value exceeds the
result.

*Angular acceleration.* The bound on alpha contains w_i instead of w_{i-1}:

    eq. 7.129:   v_i w_{i-1} x z
    Pinocchio:   v_i w_i x z
    difference:  v_i^2 z x z = 0, except for rounding errors

For a fast joint with an oblique axis, the rounding errors of v_i^2 z x z are large.
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

VERIFY_KERNELS_MODULE = "urdfkin.verify.kernels"
_NO_ROTATION = np.eye(3).ravel()
#: First indices of position, velocities and accelerations in the state of a moving base.
_BASE_VECTOR_STARTS = 9, 12, 15, 18, 21
#: Number of configurations per block of the kernel `lengths`. The five bounds of one link need 2.5 kB, so the
#: bounds of several links fit into the L1 cache.
_BLOCK_LENGTH = 64


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Upper bounds on the lengths of a frame's position, velocities and accelerations.

    Attributes:
        p: (n, frames) path length from the world's origin to the frame, with joint displacements, m.
        w: (n, frames) angular velocity, rad/s.
        vel: (n, frames) linear velocity, m/s.
        alpha: (n, frames) angular acceleration, rad/s^2.
        acc: (n, frames) linear acceleration, m/s^2.
        roundings: (n, frames) allowed relative error of one vector in a product, in eps.
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
    """Return upper bounds for all frames.

    `base` is the result of `BaseMotion.state`, with one row or n rows. Without `v`, only `p` and `roundings`
    are valid. Without `a`, the joint accelerations are 0.
    """
    n, lengths = len(q), _get_lengths(plan)
    out = np.empty((6, n, len(lengths.ends)))
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    inputs = (q, base) if v is None or a is None else (q, base, v, a)
    kernel = (
        preload.get_kernel("lengths", module=VERIFY_KERNELS_MODULE) if n > 1 and len(inputs) > 2 else None
    )
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
    q, base, *rates = (_as_columns(x, out.shape[1]) for x in inputs)
    states = [tuple(_norm_of_columns(base[at : at + 3]) for at in _BASE_VECTOR_STARTS)]
    for joint in lengths.joints:
        states.append(
            (_propagate_state if rates else _propagate_position)(joint, states[joint.parent + 1], q, *rates)
        )
    for end in lengths.ends:
        bounds = (steps.translate_point if rates else _translate_position)(states[end.step + 1], end.length)
        for row, values in zip(out, bounds, strict=False):
            row[:, end.frame] = values


def _fill_with_kernel(kernel: Any, lengths: _Lengths, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Write exactly the same doubles as `_fill_without_kernel`, with the kernel `lengths`."""
    joints = lengths.joints
    # If the stride is 0, all configurations share one row, and the kernel receives only this row.
    q, base, v, a = (x if x.strides[0] else x[:1] for x in inputs)
    free = [
        x
        for joint in joints
        if joint.kind >= JointMotion.PLANAR
        for x in _free_lengths(joint, *(x.T for x in (q, v, a)))
    ]
    kernel(
        *lengths.tables,
        *map(np.ascontiguousarray, (q, v, a)),
        _stack_columns(free),
        norm(base[:, _BASE_VECTOR_STARTS[0] :].reshape(-1, len(_BASE_VECTOR_STARTS), 3)),
        np.zeros((len(joints) + 2, len(_BASE_VECTOR_STARTS), _BLOCK_LENGTH)),
        out[:5].reshape(-1),
    )


def _stack_columns(columns: Sequence[FloatArray]) -> FloatArray:
    """Return an array of columns, each of which has length 1 or n."""
    rows = np.empty((max(map(len, columns), default=1), len(columns)))
    for row, column in zip(rows.T, columns, strict=True):
        row[:] = column
    return rows


class _MovingJoint(NamedTuple):
    kind: int
    q: int
    v: int
    parent: int  # Index in `_Lengths.joints`, or -1 for the base.
    length: float  # Path length from the previous moving joint, m.
    multiplier: float  # Absolute mimic multiplier.
    offset: float  # Absolute mimic offset, rad or m.


class _FrameEnd(NamedTuple):
    """The part of a frame's path after the last moving joint."""

    step: int  # Index of the last moving joint in `_Lengths.joints`, or -1 if there is none.
    frame: int
    length: float  # Length of this part of the path, m.


class _Lengths(NamedTuple):
    joints: list[_MovingJoint]
    ends: list[_FrameEnd]
    tables: tuple[NDArray[Any], ...]  # `joints` and `ends` as arrays, for the kernel.


def _get_lengths(plan: CompiledTree) -> _Lengths:
    found: _Lengths | None = plan.cache.get("lengths")
    if found is None:
        lengths, count = magnitude(plan.lengths).tolist(), len(plan.steps)
        rules = np.abs(plan.geometry[:, Geometry.MULTIPLIER :]).tolist()
        steps = zip(plan.steps.tolist(), plan.parents.tolist(), lengths[:count], rules, strict=True)
        joints = [
            _MovingJoint(kind, q, v, parent, length, multiplier, float(magnitude(offset)))
            for (kind, q, v), parent, length, (multiplier, offset) in steps
        ]
        frames = zip(plan.frames.tolist(), lengths[count:], strict=True)
        ends = [_FrameEnd(step, frame, length) for (step, frame), length in frames]
        tables = (
            np.array([joint[:4] for joint in joints], dtype=np.int64).reshape(-1, 4),
            np.array([joint[4:] for joint in joints]).reshape(-1, 3),
            np.array([end[:2] for end in ends], dtype=np.int64).reshape(-1, 2),
            np.array([end.length for end in ends]),
        )
        found = plan.cache["lengths"] = _Lengths(joints, ends, tables)
    return found


def _as_columns(x: FloatArray, n: int) -> Any:
    """Return the columns of x; for n = 1, return Python numbers, which are faster than arrays."""
    return x[0].tolist() if n == len(x) == 1 else x.T


def _norm_of_columns(x: Any) -> Length:
    return norm(x.T) if isinstance(x, np.ndarray) else float(norm(np.array(x))) if any(x) else 0.0


def _translate_position(state: LinkBounds, d: Length) -> LinkBounds:
    return eq.point_position(state[0], None, d), *state[1:]


#: Number of translations and number of rotations of a planar joint and of a floating joint.
_TRANSLATION_ROTATION_COUNTS = {int(JointMotion.PLANAR): (2, 1), int(JointMotion.FLOATING): (3, 3)}


def _bound_displacement(joint: _MovingJoint, q: Any) -> Length:
    if joint.kind != JointMotion.PRISMATIC:
        return _norm_of_columns(q[joint.q : joint.q + _TRANSLATION_ROTATION_COUNTS[joint.kind][0]])
    return product(joint.multiplier, abs(q[joint.q])) + joint.offset


def _propagate_position(joint: _MovingJoint, state: LinkBounds, q: Any) -> LinkBounds:
    is_revolute = joint.kind == JointMotion.REVOLUTE
    return _translate_position(
        state, joint.length if is_revolute else joint.length + _bound_displacement(joint, q)
    )


def _free_lengths(joint: _MovingJoint, q: Any, v: Any, a: Any) -> tuple[Length, ...]:
    """Return the norms of displacement, angular and linear velocity, angular and linear acceleration."""
    at, (translations, rotations) = joint.v, _TRANSLATION_ROTATION_COUNTS[joint.kind]
    (u, o), (u_rate, o_rate) = (
        (
            _norm_of_columns(x[at : at + translations]),
            _norm_of_columns(x[at + translations : at + translations + rotations]),
        )
        for x in (v, a)
    )
    return _bound_displacement(joint, q), o, u, o_rate, u_rate


def _propagate_state(joint: _MovingJoint, state: LinkBounds, q: Any, v: Any, a: Any) -> LinkBounds:
    kind, d, at = joint.kind, joint.length, joint.v
    if kind >= JointMotion.PLANAR:
        displacement, *rates = _free_lengths(joint, q, v, a)
        return steps.after_free_joint(state, d + displacement, *rates)
    velocity, acceleration = product(joint.multiplier, abs(v[at])), product(joint.multiplier, abs(a[at]))
    if kind == JointMotion.PRISMATIC:
        return steps.after_prismatic(state, d + _bound_displacement(joint, q), velocity, acceleration)
    return steps.after_revolute(state, d, velocity, acceleration)


_LOCAL_WORLD_ALIGNED = Reference.LOCAL_WORLD_ALIGNED

#: NumPy need not warn of overflow, because a comparison accepts no result with an infinite scale.
_allow_overflow = np.errstate(over="ignore", under="ignore", invalid="ignore")


@dataclass(frozen=True, slots=True)
class Bound:
    """The bound k * eps * scale on a difference.

    If the scale of a number is 0, both results must be equal.

    Attributes:
        scale: Bound on the sum of absolute terms, in the unit of the result.
        k: Allowed difference, in eps * scale.
    """

    scale: FloatArray
    k: FloatArray


def broadcast_k(bound: Bound, shape: tuple[int, ...]) -> FloatArray:
    """Broadcast `bound.k` to a batch shape.

    If k <= 0 or k = inf, k becomes NaN, so that no result is accepted.
    """
    k = bound.k.reshape(bound.k.shape[: len(shape)])
    k = np.where((k > 0.0) & (k < np.inf), k, np.nan)
    return k if k.shape == shape else np.broadcast_to(k, shape)


def make_bound(
    scale: FloatArray, factors: int, magnitudes: Magnitudes, reference: Reference = _LOCAL_WORLD_ALIGNED
) -> Bound:
    """Return the bound of a quantity, with k = factors * roundings.

    The reference frames LOCAL and WORLD have one additional factor.
    """
    factors += reference is not _LOCAL_WORLD_ALIGNED
    k = factors * magnitudes.roundings
    return Bound(scale, k.reshape(*k.shape, *[1] * (scale.ndim - 2)))


@_allow_overflow
def mujoco_magnitudes(magnitudes: Magnitudes) -> Magnitudes:
    """Convert magnitudes for Pinocchio to magnitudes for MuJoCo.

    MuJoCo computes velocities, accelerations and Jacobian columns at a centre of mass:

    | Property | Value |
    |---|---|
    | centre of mass | the root, by `urdfkin.verify.mujoco` |
    | distance of a joint or the frame from the centre of mass | at most p |
    | lever arm | at most 2 p |
    | conversion to the centre of mass, and back to the frame | a cross product with a lever arm |
    | factors in a term, with this cross product | at most twice as many |
    | rounding errors for each joint | `MUJOCO_ROUNDINGS` = 30, not `PINOCCHIO_ROUNDINGS` = 24 |
    """
    p = 2.0 * magnitudes.p
    w_cross_vel = eq.tangential(magnitudes.w, magnitudes.vel)
    return Magnitudes(
        p=p,
        w=magnitudes.w,
        vel=eq.point_velocity(magnitudes.vel, magnitudes.w, p),
        alpha=magnitudes.alpha,
        acc=eq.point_acceleration(magnitudes.acc + w_cross_vel, magnitudes.alpha, magnitudes.w, p),
        roundings=2.0 * (MUJOCO_ROUNDINGS / PINOCCHIO_ROUNDINGS) * magnitudes.roundings,
    )


class DecimalErrors(NamedTuple):
    """Errors from converting a URDF's decimals to doubles.

    Attributes:
        angles: (n,) sum of the angle errors, in multiples of eps rad.
        rule_count: Number of rules of all mimic joints on the path. For example, joint c has two rules if
            c mimics b and b mimics a.
        lengths: (steps + 1,) lengths that are added to `CompiledTree.lengths`, m.
    """

    angles: FloatArray
    rule_count: int
    lengths: FloatArray


def true_value_magnitudes(
    plan: CompiledTree,
    q: FloatArray,
    v: FloatArray | None,
    a: FloatArray | None,
    errors: DecimalErrors,
    base: FloatArray = FIXED_BASE_STATE,
) -> Magnitudes:
    """Return `Magnitudes` for a comparison with true values.

    True values follow from the URDF's decimals and from the doubles q, v and a. `plan` has a single frame.

    *Each joint.*

    | Rounding errors | eps |
    |---|---|
    | allowed: `PINOCCHIO_ROUNDINGS` | 24 |
    | one program, at most (`urdfkin.kinematics.roundings`) | 16.8 |
    | remainder, for the conversion of decimals to doubles | 7.2 |
    | offset | 0.5 |
    | axis, used by two rotations | 2 * 0.5 |
    | true value, rounded to 17 digits | 0.5 |

    *Angles and mimic rules.* The errors of angles and mimic rules can exceed this remainder, so they are
    added:

        relative error of roll, pitch and yaw = eps / 2
        rotation of all vectors after the joint <= eps (|roll| + |pitch| + |yaw|) / 2
        rule m x + c: roundings of m, of the product and of the sum <= eps (3 |m x| + |c|) / 2
        rule m x + c: rounding of c <= eps |c| / 2
        rule m x + c: error of x is multiplied by |m|
        revolute mimic joint: an error of 1 eps rad changes each later vector by at most eps |vector|

    *Chain of r mimic rules.* Some programs combine the rules into one rule M q + C:

        X = sum of the absolute values of all terms in the joint's value
        X = |q| for an independent joint
        X = |m| X' + |c| for a rule m x + c, with X' of the mimicked joint
        number of additions in C = r - 1
        each intermediate sum <= X
        additional error of C <= eps (r - 1) X / 2
        other roundings: those of r separate rules

    | Prismatic mimic joint with r rules | |
    |---|---|
    | roundings of each term of X | at most 3 r |
    | error of the displacement, for separate and combined rules | at most 1.5 r X eps |
    | abs(M q) + abs(C), if the offsets of a chain cancel | far below X |
    | length of the displacement in the bound, with `errors.lengths` | X |
    | allowed relative error | 1.5 eps for each rule |
    | roundings of the joint velocity and acceleration | fewer than of the displacement |
    """
    magnitudes = compute_magnitudes(replace(plan, lengths=plan.lengths + errors.lengths), q, v, a, base)
    additional = errors.angles[:, np.newaxis] + 1.5 * errors.rule_count
    return replace(magnitudes, roundings=magnitudes.roundings + additional)


def placement_scale(plan: CompiledTree, magnitudes: Magnitudes) -> FloatArray:
    scale = np.zeros((*magnitudes.p.shape, 4, 4))
    scale[..., :3, :3] = 1.0
    scale[..., :3, 3] = magnitudes.p[..., None]
    return scale


@_allow_overflow
def mjcf_placement_bound(bound: Bound, lengths: FloatArray, angles: FloatArray) -> Bound:
    """Bound the errors of placements from an MJCF file.

    | Lengths | |
    |---|---|
    | offset of a body | sum of its `pos`, the `pos` of joints, and a vector for the `ref` of a slide joint |
    | urdfkin | adds these vectors once, when reading the file |
    | MuJoCo | adds these vectors for each configuration |
    | a single vector | can be longer than the sum |
    | scale of positions | max(length of the path, `lengths`) |

    *Angles.* urdfkin rotates a hinge by ref and by q. MuJoCo rotates the hinge by the rounded angle q - ref:

        error of the angle <= (eps/2) (|q| + |ref|) rad, for all bodies after the hinge
        error of an entry of a rotation <= error of the angle
        error of a coordinate <= (error of the angle) * (length of the path)
        first-order error <= angles * eps/2 * scale
        factor of the scale = 1 + angles / k
        increase of the bound = angles * eps * scale
        increase / first-order error = 2, for second-order terms

    Args:
        bound: Bound on the tree's placements.
        lengths: (n, frames) sums of |pos| and |ref|, m.
        angles: (n, frames) sums of |q| + |ref|, rad.
    """
    scale = bound.scale.copy()
    scale[..., :3, 3] = np.maximum(scale[..., :3, 3], lengths[..., None])
    scale[..., :3, :] *= 1.0 + (angles / broadcast_k(bound, angles.shape))[..., None, None]
    return Bound(scale, bound.k)


@_allow_overflow
def velocity_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    linear = magnitudes.vel
    if reference.at_world:
        linear = eq.point_velocity(linear, magnitudes.w, magnitudes.p)
    return _repeat_as_six_rows(linear, magnitudes.w)


@_allow_overflow
def acceleration_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of accelerations.

        Pinocchio: classical acceleration = spatial acceleration + w x vel
        scale: contains |w| |vel|

    *Breakdown.* The scale also bounds the sum of an `AccelerationBreakdown`:

        d_k: vector from joint k to the frame
        w_k: sum of |v_i| up to joint k
        |v_k z x (v_k z x d_k)| + |2 w_{k-1} x (v_k z x d_k)| <= (w_k^2 - w_{k-1}^2) |d_k|
        sum over all joints <= sum of w_k^2 * (length of link k), as in eq. 7.130

    | Sum | Rounding errors |
    |---|---|
    | d_k, of the vectors between successive joint origins | as in eq. 7.77 |
    | 4 n terms of a breakdown with n joints | n + 3 |
    | allowed for the sums of each joint, in eps | 2, more than both sums need |
    """
    w_cross_vel = eq.tangential(magnitudes.w, magnitudes.vel)
    linear = magnitudes.acc + w_cross_vel
    if reference.at_world:
        linear = eq.point_acceleration(linear + w_cross_vel, magnitudes.alpha, magnitudes.w, magnitudes.p)
    return _repeat_as_six_rows(linear, magnitudes.alpha)


@_allow_overflow
def imu_scale(magnitudes: Magnitudes, gravity: FloatArray) -> FloatArray:
    return _repeat_as_six_rows(
        magnitudes.acc + eq.tangential(magnitudes.w, magnitudes.vel) + norm(gravity), magnitudes.w
    )


def _repeat_as_six_rows(linear: FloatArray, angular: FloatArray) -> FloatArray:
    scale = np.empty((*linear.shape[:2], 6, *linear.shape[2:]))
    rows = scale.transpose(2, 0, 1, *range(3, scale.ndim))  # `np.moveaxis` is slower.
    rows[:3], rows[3:] = linear, angular
    return scale


@_allow_overflow
def jacobian_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of Jacobians.

    | Column | Linear rows | Angular rows |
    |---|---|---|
    | revolute joint: [z x d; z] | length of the path | 1 |
    | prismatic joint: [z; 0] | 1 | 0 |
    | joint that is not on the path | 0 | 0 |

    A mimicked joint's scale also contains |multiplier| * (scale of the mimic joint).
    """
    turning, sliding = sum_multipliers(plan)
    linear, angular = eq.turning_column(turning, magnitudes.p[..., None])
    return _repeat_as_six_rows(linear + sliding, angular)


@_allow_overflow
def jacobian_rate_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of Jacobian rates.

    The path to the frame limits the lever arm d:

        linear rows of a revolute joint: z x d
        |d| <= length of the path
        |d'| <= bound on the velocity of the frame's origin
        LOCAL: derivative of components along rotating axes
    """
    turning, sliding = sum_multipliers(plan)
    w, p, vel = magnitudes.w[..., None], magnitudes.p[..., None], magnitudes.vel[..., None]
    linear, angular = eq.turning_column_rate(turning, eq.axis_rate(w, turning), p, vel)
    linear = linear + eq.axis_rate(w, sliding)
    if reference.own_axes:
        column, axis = eq.turning_column(turning, p)
        linear = eq.rate_in_turning_axes(linear, w, column + sliding)
        angular = eq.rate_in_turning_axes(angular, w, axis)
    return _repeat_as_six_rows(linear, angular)


#: Number of cross products with which Pinocchio computes the linear rows of dJ_i/dq_j.
#: The joints on the path are numbered from the root.
#:
#: | | Two revolute joints, z x (z x d) | A revolute and a prismatic joint, z x z |
#: |---|---|---|
#: | j <= i | first pair, first number | first pair, second number |
#: | j > i | second pair, first number | second pair, second number |
_CROSS_PRODUCT_COUNTS: dict[Reference, tuple[tuple[float, float], tuple[float, float]]] = {
    Reference.LOCAL_WORLD_ALIGNED: ((5.0, 2.0), (2.0, 1.0)),
    Reference.WORLD: ((2.0, 1.0), (0.0, 0.0)),
    Reference.LOCAL: ((0.0, 0.0), (3.0, 1.0)),
}


@_allow_overflow
def hessian_scale(plan: CompiledTree, magnitudes: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of Hessians.

    | | |
    |---|---|
    | entry | depends on a pair of Jacobian columns |
    | column of a mimic joint | is added to the column of the mimicked joint |
    | entry with mimic joints | sum over several pairs; the scales are added |
    | lever arm d | at most as long as the path |

    Pinocchio computes an entry from two columns c = [z x d; z] at the world origin. `_CROSS_PRODUCT_COUNTS`
    counts the products:

    | Step of Pinocchio | Products |
    |---|---|
    | c_1 x c_2, with linear rows w_1 x v_2 + v_1 x w_2 | 2 |
    | conversion of the result to the frame's origin p: p x (w_1 x w_2) | 1 |
    | conversion of a column to p before the product: (v - p x w) x w | 2 |

    | Reference frame | Linear rows of urdfkin | Factors |
    |---|---|---|
    | LOCAL_WORLD_ALIGNED | one product z x (z x d) | |
    | WORLD | two products of c_1 x c_2 | |
    | LOCAL | two products of c_1 x c_2, with columns rotated by R | 2 * (R, z, R, z, d) = 10 |
    | LOCAL, allowed | three products of four factors | 3 * 4 = 12 |
    """
    shape = len(plan.frames), plan.nv, plan.nv
    turning, mixed, angular = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    (near, near_mixed), (far, far_mixed) = _CROSS_PRODUCT_COUNTS[reference]
    step, v_index = plan.columns[:, ColumnField.STEP], plan.columns[:, ColumnField.V]
    # A subnormal multiplier has a large relative error, so its scale is `SMALLEST_NORMAL`.
    is_rotation, multipliers = plan.columns[:, ColumnField.IS_ROTATION] == 1, magnitude(plan.multipliers)
    for f, (_, frame) in enumerate(plan.frames):
        columns = np.flatnonzero(plan.target_columns[f] >= 0)
        i, j = columns[:, np.newaxis], columns[np.newaxis, :]
        before = step[j] <= step[i]
        sizes = product(multipliers[i], multipliers[j])
        # The product of two multipliers may be inf, and inf * 0 is NaN, so `np.where` selects the products.
        both = np.where(is_rotation[i] & is_rotation[j], sizes, 0.0)
        one = np.where(is_rotation[i] ^ is_rotation[j], sizes, 0.0)
        entry = frame, v_index[i], v_index[j]
        np.add.at(turning, entry, both * np.where(before, near, far))
        np.add.at(mixed, entry, one * np.where(before, near_mixed, far_mixed))
        np.add.at(angular, entry, both * (before != reference.own_axes))
    linear = product(turning, magnitudes.p[..., np.newaxis, np.newaxis]) + mixed
    return _repeat_as_six_rows(linear, angular)


@_allow_overflow
def euler_jacobian_bound(bound: Bound, magnitudes: Magnitudes, axis_sine: FloatArray) -> Bound:
    """Return the bound on Jacobians with Euler angles.

    The position rows have the same bound as the velocity Jacobian. The other rows are u . w for the middle
    angle, and r . w for the first and last angle:

        w: angular part of a column of the velocity Jacobian
        e_i, u, t = R e_k: first, middle and last axis (`urdfkin.verify.analytical_reference`)
        s = |e_i x t|: |sine| or |cosine| of the middle angle, in `axis_sine`
        r: reciprocal basis vector of the first or last axis
        r': reciprocal basis vector of t
        delta = k eps: error of t, relative error of w
        |u| = 1
        |r| = 1 / s

        |du| <= delta / s
        dr = -(r . du) u - (r . dt) r'
        |dr| <= 2 delta / s^2
        first and last angle: 2 delta / s^2 + delta / s <= 3 delta / s^2
        middle angle: delta / s + delta <= 2 delta / s

        bound on the velocity Jacobian: 2 delta, from two factors
        scale of the first and last angle: multiplied by 1.5 / s^2
        scale of the middle angle: multiplied by 1 / s
        smallest possible s: axis_sine - delta

        arctan2 and sine: about 3 eps
        products and quotients: about 10 eps
        sum: 13 eps
        additional joint in k: at least 24 eps (`PINOCCHIO_ROUNDINGS`) > 13 eps
    """
    s = axis_sine - EPS * magnitudes.roundings
    # Now, s is a lower bound on |e_i x t|. For s = 0, the scale is infinite, and the comparison accepts no
    # result.
    s = np.where(s > 0.0, s, 0.0)
    scale = bound.scale.copy()
    with np.errstate(divide="ignore"):
        scale[..., [3, 5], :] *= (1.5 / (s * s))[..., None, None]
        scale[..., 4, :] *= (1.0 / s)[..., None]
    return Bound(scale, bound.k)


def quaternion_jacobian_bound(bound: Bound) -> Bound:
    """Return the bound on Jacobians with quaternions.

    The position rows have the same bound as the velocity Jacobian, and q' has the same bound as w:

        delta: error of R
        elements of 4 q q^T: linear functions of R
        longest row of 4 q q^T: length >= 2, error < 4.6 delta
        error of q < 2.3 delta
        q' = (quaternion product of w and q) / 2
        error of q' <= (2.3 + 1) / 2 delta |w| < 2 delta |w|
        bound on the angular rows of the velocity Jacobian: 2 delta |w|

    Jacobians with quaternions are never singular.
    """
    return Bound(np.concatenate((bound.scale, bound.scale[..., 5:, :]), axis=-2), bound.k)


def sign_limit(bound: Bound, shape: tuple[int, ...]) -> FloatArray:
    """Return the limit of |qw| below which rounding can change the sign of qw.

    | | |
    |---|---|
    | error of R, as in `quaternion_jacobian_bound` | delta |
    | limit, 1.5 k eps | 3 delta |
    | error of qw | at most 2.3 delta, below the limit |
    """
    return 1.5 * EPS * broadcast_k(bound, shape)


def singularity_margin(plan: CompiledTree) -> float:
    """Return the smallest allowed angle to a singularity of Euler angles, rad.

    If the base has no rotation, the margin is four times the error of a frame's rotation. Below the margin,
    no digit of the Euler angles is reliable.
    """
    return 4.0 * EPS * float(np.max(joint_roundings(plan.depth + 1, plan.tilts), initial=0.0))


def sum_multipliers(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    """Sum |multiplier| over the joints of a path that share a joint velocity.

    For example, a joint (multiplier 1) and its mimic joint (multiplier -2) have the sum 3.

    Returns:
        Sums (frames, nv) for rotations, and sums (frames, nv) for translations.
    """
    weights: FloatArray | None = plan.cache.get("column weights")
    if weights is None:
        weights, multipliers = np.zeros((2, len(plan.frames), plan.nv)), magnitude(plan.multipliers)
        for f, (_, frame) in enumerate(plan.frames):
            for c in np.flatnonzero(plan.target_columns[f] >= 0):
                kind = 0 if plan.columns[c, ColumnField.IS_ROTATION] else 1
                weights[kind, frame, plan.columns[c, ColumnField.V]] += multipliers[c]
        weights.setflags(write=False)
        # The array is stored only when it is complete, because other threads may read the cache.
        plan.cache["column weights"] = weights
    return weights[0], weights[1]


def find_active_entries(
    plan: CompiledTree, reference: Reference = _LOCAL_WORLD_ALIGNED, *, root_at_origin: bool = True
) -> NDArray[np.bool_]:
    """Find the Jacobian entries that can be nonzero.

    All other entries are 0 for every q. For WORLD with `root_at_origin=True`, a base motion can make these
    entries nonzero. The other references ignore `root_at_origin`.

        linear rows of a revolute joint: z x d
        WORLD: d leads from the joint to the world's origin
        LOCAL, LOCAL_WORLD_ALIGNED: d leads from the joint to the frame
        d = 0 for every q: all lengths between the ends are 0, and no joint between the ends translates

    Returns:
        (frames, 6, nv) bool array.
    """
    is_active = np.zeros((len(plan.frames), 6, plan.nv), dtype=bool)
    is_revolute = plan.steps[:, StepField.KIND] == JointMotion.REVOLUTE
    multipliers = plan.geometry[:, Geometry.MULTIPLIER :]
    extends = (plan.lengths[: len(is_revolute)] > 0.0) | (~is_revolute & (multipliers != 0.0).any(axis=1))
    for f, (end, frame) in enumerate(plan.frames):
        path, step = list[int](), int(end)
        while step >= 0:
            path.append(step)
            step = int(plan.parents[step])
        if reference.at_world:
            levers = np.logical_or.accumulate([not root_at_origin, *extends[path[::-1]]])[:0:-1]
        else:
            levers = np.logical_or.accumulate([plan.lengths[len(is_revolute) + f] > 0.0, *extends[path[:-1]]])
        has_lever = dict(zip(path, levers, strict=False))
        for c in np.flatnonzero((plan.target_columns[f] >= 0) & (plan.multipliers != 0.0)):
            column = plan.columns[c]
            rows = is_active[frame, :, column[ColumnField.V]]
            rows[:3] |= not column[ColumnField.IS_ROTATION] or has_lever[column[ColumnField.STEP]]
            rows[3:] |= column[ColumnField.IS_ROTATION] == 1
    return is_active
