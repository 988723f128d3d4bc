"""Bounds on the difference between two correct computations of a quantity.

A result is accepted if each of its numbers differs from the oracle's number by at most

    k * eps * scale,      eps = 2^-52,      k = factors * ROUNDINGS * joints.

Each number is a sum of terms. *scale* is an upper bound on the sum of the absolute values of these terms
(`magnitudes`). The scale has the unit of the number. If two computations add the same terms in different
orders, the difference of the two results is proportional to the scale, not to the sum of the terms.

*k* is the number of roundings to first order in eps (`urdfkin.kinematics.roundings`). Each joint on the path
adds a fixed number of roundings. Each joint also rotates the vectors of the joints after it. A rotation does
not amplify an error, so the error grows only linearly with the number of joints.

Each term of a quantity is a product of rotated vectors. Each vector is a *factor* with its own rounding
error:

| Quantity | Factors | Vectors in a term |
|---|---|---|
| position | 1 | R d |
| velocity | 2 | w, d |
| acceleration | 3 | w, w, d, or v z, w, d |
| Jacobian, linear rows | 2 | z, d |
| J-dot, linear rows | 3 | w, z, d |
| Hessian, linear rows | 3 | z, z, d |

The references LOCAL and WORLD need one more factor: a rotation into the frame's axes (LOCAL), or a cross
product with p (WORLD).

Measured differences are a fraction of an eps for each joint, because rounding errors rarely add up in the
worst way. Reports state differences in multiples of eps * scale, because these multiples can be compared
between robots.

`magnitudes` runs the forward recursion with the lengths of vectors instead of the vectors. The function
evaluates eq. 7.58 and 7.127 to 7.130 with the number types of `urdfkin.kinematics.number_kinds`. With these
number types, no intermediate value exceeds the result. Pinocchio computes one term differently. Eq. 7.129
contains the term v_i w_{i-1} x z. Pinocchio computes v_i w_i x z instead. The difference is v_i^2 z x z,
which is 0 except for rounding errors. These rounding errors are relevant for fast joints with an oblique
axis. `magnitudes` therefore uses w_i instead of w_{i-1} in its bound on the angular acceleration alpha.
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
from urdfkin.kinematics.lengths import State
from urdfkin.kinematics.number_kinds import Length, counted, norm, product
from urdfkin.kinematics.number_kinds import length_equations as eq
from urdfkin.kinematics.roundings import EPS, MUJOCO, ROUNDINGS, of_joints
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

#: Module of the compiled functions that check results.
KERNELS = "urdfkin.verify.kernels"
_UNTURNED = np.eye(3).ravel()
#: Indices of position, velocities and accelerations in a moving base's state.
_OF_BASE = 9, 12, 15, 18, 21
#: Number of configurations that the compiled function `lengths` computes at a time.
#: The intermediate results for one block fit into the processor's first-level cache.
_BLOCK = 64


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Upper bounds on the terms of a frame's position, velocity and acceleration.

    Attributes:
        p: (n, frames) length of the path from the world origin, in m. Prismatic displacements are included.
        w: (n, frames) angular velocity, rad/s.
        vel: (n, frames) linear velocity, m/s.
        alpha: (n, frames) angular acceleration, rad/s^2.
        acc: (n, frames) linear acceleration, m/s^2.
        roundings: (n, frames) upper bound on the number of rounding errors of one factor. A factor is a
            rotated vector. The bound counts all URDF joints on the path, a rotated base, and one additional
            joint.
    """

    p: FloatArray
    w: FloatArray
    vel: FloatArray
    alpha: FloatArray
    acc: FloatArray
    roundings: FloatArray


@np.errstate(over="ignore", under="ignore", invalid="ignore")
def magnitudes(
    plan: CompiledTree, q: FloatArray, v: FloatArray | None, a: FloatArray | None, base: FloatArray
) -> Magnitudes:
    """Return upper bounds on the terms of each frame's position, velocity and acceleration.

    Args:
        plan: The compiled tree.
        q: (n, nq) rad, m.
        v: (n, nv) or None. Without v, only `p` and `roundings` are valid. Placements and Jacobians need only
            these two.
        a: (n, nv) or None.
        base: (1 or n, 24) state of the moving base.
    """
    n, lengths = len(q), _lengths(plan)
    out = np.empty((6, n, len(lengths.ends)))
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    inputs = (q, base) if v is None or a is None else (q, base, v, a)
    kernel = preload.kernel("lengths", home=KERNELS) if n > 1 and len(inputs) > 2 else None
    if kernel is None:
        begin = time.thread_time()
        _by_steps(lengths, inputs, out)
        if n > 1:
            preload.spend("lengths", time.thread_time() - begin)
    else:
        _by_kernel(kernel, lengths, inputs, out)
    turned = (base[:, :9] != _UNTURNED).any(axis=1)  # a rotated base adds as many roundings as a joint
    out[5] = of_joints(plan.depth + 1 + turned[:, np.newaxis], plan.tilts)
    return Magnitudes(*out)


def _by_steps(lengths: _Lengths, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Compute `out` with NumPy, or with Python numbers for a single configuration."""
    q, base, *rates = (_columns(x, out.shape[1]) for x in inputs)
    states = [tuple(_norm(base[at : at + 3]) for at in _OF_BASE)]
    for link in lengths.links:
        states.append((_step if rates else _place)(link, states[link.parent + 1], q, *rates))
    for end in lengths.ends:
        carried = (steps.carried if rates else _carried_place)(states[end.step + 1], end.length)
        for row, values in zip(out, carried, strict=False):
            row[:, end.place] = values  # a value for all configurations is a scalar


def _by_kernel(kernel: Any, lengths: _Lengths, inputs: Sequence[FloatArray], out: FloatArray) -> None:
    """Compute `out` with a compiled function, with the same bits as `_by_steps`."""
    links = lengths.links
    # An input that is the same for all configurations becomes a single row.
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
        _rows(free),
        norm(base[:, _OF_BASE[0] :].reshape(-1, len(_OF_BASE), 3)),
        np.zeros((len(links) + 2, len(_OF_BASE), _BLOCK)),
        out[:5].reshape(-1),
    )


def _rows(columns: Sequence[FloatArray]) -> FloatArray:
    """Return an array with the given columns; a column of length 1 is repeated in every row."""
    rows = np.empty((max(map(len, columns), default=1), len(columns)))
    for row, column in zip(rows.T, columns, strict=True):
        row[:] = column
    return rows


class _MovingJoint(NamedTuple):
    """A moving joint of a compiled tree.

    `multiplier` and `constant` are the absolute values of the joint's mimic multiplier and mimic offset.
    """

    kind: int
    q: int
    v: int
    parent: int
    length: float
    multiplier: float
    constant: float


class _End(NamedTuple):
    """A frame of a compiled tree.

    `step` is the index of the last moving joint before the frame. `length` is the length of the path from
    this joint to the frame. `place` is the frame's index in the output.
    """

    step: int
    place: int
    length: float


class _Lengths(NamedTuple):
    """The moving joints and the frames of a compiled tree, as Python numbers and as NumPy arrays."""

    links: list[_MovingJoint]
    ends: list[_End]
    tables: tuple[NDArray[Any], ...]


def _lengths(plan: CompiledTree) -> _Lengths:
    """Return the moving joints and the frames of a compiled tree, which stores the result for later calls."""
    found: _Lengths | None = plan.made.get("lengths")
    if found is None:
        lengths, count = counted(plan.lengths).tolist(), len(plan.steps)
        rules = np.abs(plan.geometry[:, Geometry.MULTIPLIER :]).tolist()
        steps = zip(plan.steps.tolist(), plan.parents.tolist(), lengths[:count], rules, strict=True)
        links = [
            _MovingJoint(kind, q, v, parent, length, multiplier, float(counted(constant)))
            for (kind, q, v), parent, length, (multiplier, constant) in steps
        ]
        frames = zip(plan.frames.tolist(), lengths[count:], strict=True)
        ends = [_End(step, place, length) for (step, place), length in frames]
        tables = (
            np.array([link[:4] for link in links], dtype=np.int64).reshape(-1, 4),
            np.array([link[4:] for link in links]).reshape(-1, 3),
            np.array([end[:2] for end in ends], dtype=np.int64).reshape(-1, 2),
            np.array([end.length for end in ends]),
        )
        found = plan.made["lengths"] = _Lengths(links, ends, tables)
    return found


def _columns(x: FloatArray, n: int) -> Any:
    """Return the columns of an array (n or 1, ...), or Python numbers for one configuration."""
    return x[0].tolist() if n == len(x) == 1 else x.T


def _norm(x: Any) -> Length:
    """Return the Euclidean length of a vector, whose components are columns or Python numbers."""
    return norm(x.T) if isinstance(x, np.ndarray) else float(norm(np.array(x))) if any(x) else 0.0


def _carried_place(state: State, d: Length) -> State:
    return eq.point_position(state[0], None, d), *state[1:]


#: Numbers of translations and of rotations of a planar joint and of a floating joint.
_FREE_PARTS = {int(JointMotion.PLANAR): (2, 1), int(JointMotion.FLOATING): (3, 3)}


def _displacement(link: _MovingJoint, q: Any) -> Length:
    """Return a bound on the displacement of a prismatic, planar or floating joint, m."""
    if link.kind != JointMotion.SLIDE:
        return _norm(q[link.q : link.q + _FREE_PARTS[link.kind][0]])
    return product(link.multiplier, abs(q[link.q])) + link.constant


def _place(link: _MovingJoint, state: State, q: Any) -> State:
    turns = link.kind == JointMotion.TURN
    return _carried_place(state, link.length if turns else link.length + _displacement(link, q))


def _free_lengths(link: _MovingJoint, q: Any, v: Any, a: Any) -> tuple[Length, ...]:
    """Return the lengths of a planar or floating joint's displacement, velocities and accelerations."""
    at, (slides, turns) = link.v, _FREE_PARTS[link.kind]
    (u, o), (u_rate, o_rate) = (
        (_norm(x[at : at + slides]), _norm(x[at + slides : at + slides + turns])) for x in (v, a)
    )
    return _displacement(link, q), o, u, o_rate, u_rate


def _step(link: _MovingJoint, state: State, q: Any, v: Any, a: Any) -> State:
    kind, d, at = link.kind, link.length, link.v
    if kind >= JointMotion.PLANAR:
        slid, *rates = _free_lengths(link, q, v, a)
        return steps.freed(state, d + slid, *rates)
    rate, rate_2 = product(link.multiplier, abs(v[at])), product(link.multiplier, abs(a[at]))
    if kind == JointMotion.SLIDE:
        return steps.slid(state, d + _displacement(link, q), rate, rate_2)
    return steps.turned(state, d, rate, rate_2)


_ALIGNED = Reference.LOCAL_WORLD_ALIGNED

#: A scale above the range of doubles is inf; `disagreement` then accepts no result.
_BEYOND = np.errstate(over="ignore", under="ignore", invalid="ignore")


@dataclass(frozen=True, slots=True)
class Bound:
    """The bound k * eps * scale of a quantity. NumPy broadcasting applies to `k`, `scale` and the results.

    Attributes:
        scale: Upper bound on the sum of the absolute values of the terms of a number, in the unit of this
            number. A scale of 0 means that the results of urdfkin and of the oracle must be equal.
        k: Allowed difference in multiples of eps * scale.
    """

    scale: FloatArray
    k: FloatArray


def result_k(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """Return the factor `k` of the bound for each result, as an array of shape `leading`.

    All numbers of a result have the same `k`. A value of k that is not finite and positive is replaced by
    NaN. Then no result is within its bound.
    """
    k = bound.k.reshape(bound.k.shape[: len(leading)])
    k = np.where((k > 0.0) & (k < np.inf), k, np.nan)
    return k if k.shape == leading else np.broadcast_to(k, leading)


def bound_of(scale: FloatArray, factors: int, size: Magnitudes, reference: Reference = _ALIGNED) -> Bound:
    """Return the bound of a quantity with the given scale (n, frames, ...).

    The factor `k` of the bound is the number of factors times the number of rounding errors of one factor.
    """
    factors += reference is not _ALIGNED
    k = factors * size.roundings
    return Bound(scale, k.reshape(*k.shape, *[1] * (scale.ndim - 2)))


@_BEYOND
def about_the_root(size: Magnitudes) -> Magnitudes:
    """Return the magnitudes for a comparison of urdfkin with MuJoCo.

    MuJoCo computes velocities, accelerations and Jacobian columns at a centre of mass. In the models of
    `urdfkin.verify.mujoco`, this centre of mass is at the root. At the end, MuJoCo converts the results to
    the frame's origin. The distance of the centre of mass from a joint or from the frame is at most the
    length of the path. Therefore, lever arms are at most 2 p. MuJoCo converts a vector to the centre of mass
    and back to the frame by a cross product with a lever arm. These cross products at most double the number
    of factors. The bound allows `MUJOCO` rounding errors for each joint instead of `ROUNDINGS`.
    """
    p = 2.0 * size.p
    shared = eq.tangential(size.w, size.vel)
    return Magnitudes(
        p=p,
        w=size.w,
        vel=eq.point_velocity(size.vel, size.w, p),
        alpha=size.alpha,
        acc=eq.point_acceleration(size.acc + shared, size.alpha, size.w, p),
        roundings=2.0 * (MUJOCO / ROUNDINGS) * size.roundings,
    )


class DecimalErrors(NamedTuple):
    """The errors of converting a URDF's decimals to doubles (`urdfkin.verify.exact.numbers.conversion`).

    Attributes:
        angles: (n,) sum of the angle errors of all joints on the path, in multiples of eps rad.
        rules: Number of mimic rules for the joints on the path. For a joint that mimics a mimic joint, both
            rules are counted.
        lengths: (steps + 1,) lengths to add to `CompiledTree.lengths`, m. A length is positive if the offsets
            of a chain of mimic rules cancel each other.
    """

    angles: FloatArray
    rules: int
    lengths: FloatArray


def against_true_values(
    plan: CompiledTree, q: FloatArray, v: FloatArray | None, a: FloatArray | None, errors: DecimalErrors
) -> Magnitudes:
    """Return the magnitudes for a comparison of one program's results with the true values.

    The true values are computed from the decimals in the URDF and from the doubles q, v and a. The true
    values are rounded to 17 digits. The bound allows `ROUNDINGS` = 24 rounding errors for each joint. One
    program makes at most 16.8 of these rounding errors (`urdfkin.kinematics.roundings`). The remaining 7.2
    are enough for the conversions of decimals to doubles. The offset, the axis and the true value each have a
    conversion error of half an eps. An axis is used in two rotations, so its error is added twice. Two kinds
    of numbers need additional roundings:

    - Roll, pitch and yaw have an error of half an eps of their size, so all vectors after the joint turn by
      at most (|roll| + |pitch| + |yaw|) / 2 eps.
    - A mimic joint's value is m x + c. The roundings of m, of the product and of the sum have an error of at
      most (3 |m x| + |c|) / 2 eps. The rounding of c has an error of at most |c| / 2 eps, and the error of x
      is multiplied by |m|.

    A mimic joint may mimic another mimic joint, so r rules can form a chain. A program may combine the rules
    of a chain to one rule M q + C. The combined rule has the same rounding errors as the separate rules,
    except for the sums. The combined rule has r - 1 sums in C, and the sum of M q and C. Let X be the value
    of the joint if all terms are replaced by their absolute values. For an independent joint, X is |q|. For a
    mimic joint, X is |m| X' + |c|, where X' is the X of the mimicked joint. No sum exceeds X. The combined
    rule can therefore increase the error by at most (r - 1) / 2 X eps.

    The error of a revolute mimic joint's value rotates all later vectors of the path. An angle error of 1 eps
    rad changes a vector by at most eps times the length of the vector.

    Each term of X is rounded at most 3 r times, so the displacement of a prismatic mimic joint has an error
    of at most 3/2 r X eps. This bound is valid for separate rules and for a combined rule. If the offsets of
    a chain cancel each other, |M q| + |C| is far below X. Therefore, the function uses X as the length of
    such a joint's displacement. Then a rounding error of 3/2 eps for each rule is enough. The same error is
    enough for the joint's velocity and acceleration, which are rounded less often.

    Args:
        plan: The compiled tree of one frame.
        q: (n, nq) rad, m.
        v: (n, nv) or None.
        a: (n, nv) or None.
        errors: The errors of the conversions, for the same path and the same q.
    """
    size = magnitudes(replace(plan, lengths=plan.lengths + errors.lengths), q, v, a, STILL_STATE)
    own = errors.angles[:, np.newaxis] + 1.5 * errors.rules
    return replace(size, roundings=size.roundings + own)


def placement_scale(plan: CompiledTree, size: Magnitudes) -> FloatArray:
    """Return the scale (n, frames, 4, 4) of the bound on placements.

    For positions, the scale is the length of the path. For rotations, the scale is 1. For the last row, the
    scale is 0.
    """
    scale = np.zeros((*size.p.shape, 4, 4))
    scale[..., :3, :3] = 1.0
    scale[..., :3, 3] = size.p[..., None]
    return scale


@_BEYOND
def mjcf_placement_bound(bound: Bound, lengths: FloatArray, angles: FloatArray) -> Bound:
    """Return the bound on the difference between the tree's and MuJoCo's placements for an MJCF file.

    In an MJCF file, the offset of a body is the sum of the body's `pos`, the `pos` of its joints, and a
    vector for the `ref` of a slide joint. urdfkin adds these vectors once, when it reads the file. MuJoCo
    adds them for each configuration. The individual vectors can be longer than their sum. The scale of
    positions is therefore the larger of the length of the path and `lengths`.

    MuJoCo rotates a hinge by the angle q - ref, which is a rounded number. urdfkin's tree rotates the hinge
    by ref and by q separately. The rounding error of the difference is at most (eps/2) (|q| + |ref|) rad. All
    bodies after the hinge are rotated by this angle error. An entry of a rotation matrix changes by at most
    the angle error. A coordinate of a position changes by at most the angle error times the length of the
    path. The bound allows twice these changes, so that it also covers terms of second order. The scale is
    therefore multiplied by 1 + `angles` / k.

    Args:
        bound: Bound of the tree's placements, (n, frames, 4, 4).
        lengths: (n, frames) sum of the lengths of the vectors `pos` and `ref` on the path to the frame, m.
        angles: (n, frames) sum of |q| + |ref| over the hinges with a reference value, rad.
    """
    scale = bound.scale.copy()
    scale[..., :3, 3] = np.maximum(scale[..., :3, 3], lengths[..., None])
    scale[..., :3, :] *= 1.0 + (angles / result_k(bound, angles.shape))[..., None, None]
    return Bound(scale, bound.k)


@_BEYOND
def velocity_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on velocities [linear; angular], (n, frames, 6)."""
    linear = size.vel
    if reference.at_world:
        linear = eq.point_velocity(linear, size.w, size.p)
    return _six(linear, size.w)


@_BEYOND
def acceleration_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on accelerations [linear; angular], (n, frames, 6).

    Pinocchio computes the classical acceleration as the spatial acceleration plus w x vel. The scale includes
    the term w x vel.

    An `AccelerationBreakdown` contains the contributions of the joints to an acceleration. The scale is also
    valid for the sum of these contributions. Let d_k be the vector from joint k to the frame, and let w_k be
    the sum of the joint velocities up to joint k. The terms v_k z x (v_k z x d_k) and 2 w_{k-1} x (v_k z x
    d_k) have the length (w_k^2 - w_{k-1}^2) d_k. The sum of these lengths over all joints is the sum of w_k^2
    times the length of link k, as in eq. 7.130. A vector d_k is the sum of the vectors between successive
    joint origins. The rounding errors of d_k are those of the sums in eq. 7.77. The breakdown of an
    acceleration for n joints has 4 n terms. Adding these terms causes n + 3 rounding errors. The bound allows
    2 eps for the sums at each joint. These 2 eps per joint exceed the rounding errors of d_k and of the sum
    of 4 n terms.
    """
    shared = eq.tangential(size.w, size.vel)
    linear = size.acc + shared
    if reference.at_world:
        linear = eq.point_acceleration(linear + shared, size.alpha, size.w, size.p)
    return _six(linear, size.alpha)


@_BEYOND
def imu_scale(size: Magnitudes, gravity: FloatArray) -> FloatArray:
    """Return the scale of the bound on IMU readings, (n, frames, 6).

    The argument `gravity` (3,) is the gravity vector.
    """
    return _six(size.acc + eq.tangential(size.w, size.vel) + norm(gravity), size.w)


def _six(linear: FloatArray, angular: FloatArray) -> FloatArray:
    scale = np.empty((*linear.shape, 6))
    scale[..., :3] = linear[..., None]
    scale[..., 3:] = angular[..., None]
    return scale


def _six_rows(linear: FloatArray, angular: FloatArray) -> FloatArray:
    scale = np.empty((*linear.shape[:-1], 6, linear.shape[-1]))
    scale[..., :3, :] = linear[..., None, :]
    scale[..., 3:, :] = angular[..., None, :]
    return scale


@_BEYOND
def jacobian_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on Jacobians, (n, frames, 6, nv).

    In the linear rows, the scale of a revolute joint's column is the length of the path. The scale of a
    prismatic joint's column is 1. For joints that are not on the path, the scale is 0.
    """
    turning, sliding = column_weights(plan)
    linear, angular = eq.turning_column(turning, size.p[..., None])
    return _six_rows(linear + sliding, angular)


@_BEYOND
def jacobian_rate_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on J-dot, (n, frames, 6, nv).

    The length of a revolute joint's column is at most the length of the path to the frame. The linear rows of
    this column are z x d. The derivative of d is at most as long as the bound on the velocity of the frame's
    origin. In LOCAL, J-dot is the derivative of components along the frame's axes, which rotate.
    """
    turning, sliding = column_weights(plan)
    w, p, vel = size.w[..., None], size.p[..., None], size.vel[..., None]
    linear, angular = eq.turning_column_rate(turning, eq.axis_rate(w, turning), p, vel)
    linear = linear + eq.axis_rate(w, sliding)
    if reference.own_axes:
        column, axis = eq.turning_column(turning, p)
        linear = eq.rate_in_turning_axes(linear, w, column + sliding)
        angular = eq.rate_in_turning_axes(angular, w, axis)
    return _six_rows(linear, angular)


#: Numbers of products in Pinocchio's derivative of Jacobian column i by joint j, linear rows.
#: The first pair is for a joint j that is joint i or is nearer to the root than joint i.
#: The second pair is for all other joints j.
#: The first number of a pair counts the products z x (z x d) of two revolute joints.
#: The second number counts the products z x z of a revolute and a prismatic joint.
_PAIR_TERMS: dict[Reference, tuple[tuple[float, float], tuple[float, float]]] = {
    Reference.LOCAL_WORLD_ALIGNED: ((5.0, 2.0), (2.0, 1.0)),
    Reference.WORLD: ((2.0, 1.0), (0.0, 0.0)),
    Reference.LOCAL: ((0.0, 0.0), (3.0, 1.0)),
}


@_BEYOND
def hessian_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """Return the scale of the bound on Hessians, (n, frames, 6, nv, nv).

    An entry of the Hessian depends on a pair of Jacobian columns. The column of a mimic joint is added to the
    column of the mimicked joint, so the scale of an entry can be a sum over several pairs. A lever arm d is
    never longer than the path. Pinocchio computes each entry from two Jacobian columns c = [z x d; z] at the
    world origin. Pinocchio adds these products:

    - two for c_1 x c_2, whose linear rows are w_1 x v_2 + v_1 x w_2
    - one more to move the result to the frame's origin p, p x (w_1 x w_2)
    - two more to move the other column there, (v - p x w) x w

    The numbers five, two and three in `_PAIR_TERMS` are sums of these counts. urdfkin needs the single
    product z x (z x d), or the two products of c_1 x c_2. In LOCAL, urdfkin first rotates the two columns by
    R. Then urdfkin computes two products. Each product has the five factors R, z, R, z and d. The bound
    allows three products of four factors, which is more than these two products need.
    """
    shape = len(plan.frames), plan.nv, plan.nv
    turning, mixed, angular = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    (near, near_mixed), (far, far_mixed) = _PAIR_TERMS[reference]
    step, rate = plan.columns[:, ColumnField.STEP], plan.columns[:, ColumnField.V]
    turns, size_of = plan.columns[:, ColumnField.TURNS] == 1, np.abs(plan.multipliers)
    for f, (_, place) in enumerate(plan.frames):
        own = np.flatnonzero(plan.leaders[f] >= 0)
        i, j = own[:, np.newaxis], own[np.newaxis, :]
        before = step[j] <= step[i]
        sizes = product(size_of[i], size_of[j])
        both, one = sizes * (turns[i] & turns[j]), sizes * (turns[i] ^ turns[j])
        pair = place, rate[i], rate[j]
        np.add.at(turning, pair, both * np.where(before, near, far))
        np.add.at(mixed, pair, one * np.where(before, near_mixed, far_mixed))
        np.add.at(angular, pair, both * (before != reference.own_axes))
    linear = product(turning, size.p[..., np.newaxis, np.newaxis]) + mixed
    scale = np.empty((*linear.shape[:2], 6, *shape[1:]))
    scale[..., :3, :, :] = linear[..., np.newaxis, :, :]
    scale[..., 3:, :, :] = angular[..., np.newaxis, :, :]
    return scale


@_BEYOND
def euler_jacobian_bound(bound: Bound, size: Magnitudes, apart: FloatArray) -> Bound:
    """Return the bound of analytical Jacobians with Euler angles, (n, frames, 6, nv).

    The rows of positions have the same bound as in the velocity Jacobian. The rotation axis of the first
    angle is e_i, that of the middle angle is u, and that of the last angle is t = R e_k
    (`analytical_reference`). Let w be the angular part of a column of the velocity Jacobian. The column's
    element for the middle angle is u . w. The element for the first or last angle is r . w. Here r is the
    reciprocal basis vector of the angle's axis. The lengths are |u| = 1 and |r| = 1 / s.
    Here s = |e_i x t| is the sine or cosine of the middle angle.

    Let the error of t be delta = k eps. This error rotates u by at most delta / s. Let r' be the reciprocal
    vector of t. Then the change of r is the vector -(r . du) u - (r . dt) r'. This vector is at most 2 delta
    / s^2 long. For s, the function uses the smallest possible value, `apart` - delta. Let delta also be the
    relative error of w. Then the errors are:

    - first and last angle: 2 delta / s^2 + delta / s <= 3 delta / s^2
    - middle angle: delta / s + delta <= 2 delta / s

    The bound on the velocity Jacobian is 2 delta, because a Jacobian has two factors. The scale of the
    velocity Jacobian is therefore multiplied by 1.5 / s^2 for the first and last angle, and by 1 / s for the
    middle angle. In urdfkin and in the reference, arctan2 and the sine of the angle add rounding errors of
    about 3 eps. Products and quotients add about 10 eps. These errors need no additional bound, because
    `Magnitudes.roundings` counts one joint more than the path contains, and a joint has more rounding errors
    than these.

    Args:
        bound: Bound of the Jacobian.
        size: Magnitudes of the frames.
        apart: (n, frames) s of Pinocchio's rotation.
    """
    s = apart - EPS * size.roundings
    s = np.where(s > 0.0, s, 0.0)  # no result is accepted if s is below its rounding error
    scale = bound.scale.copy()
    with np.errstate(divide="ignore"):
        scale[..., [3, 5], :] *= (1.5 / (s * s))[..., None, None]
        scale[..., 4, :] *= (1.0 / s)[..., None]
    return Bound(scale, bound.k)


def quaternion_jacobian_bound(bound: Bound) -> Bound:
    """Return the bound (n, frames, 7, nv) of analytical Jacobians with quaternions, which are never singular.

    The rows of positions have the same bound as in the velocity Jacobian. Let delta be the error of R. The
    elements of the matrix 4 q q^T are linear functions of R. The longest row of 4 q q^T has a length of at
    least 2. The error of this row is below 4.6 delta. Therefore, the error of q is below 2.3 delta. The
    derivative of q is half the quaternion product of w and q. Its error is (2.3 + 1) / 2 delta |w|. This
    error is below the bound 2 delta |w| on the angular velocity in the velocity Jacobian.
    """
    return Bound(np.concatenate((bound.scale, bound.scale[..., 5:, :]), axis=-2), bound.k)


def hidden_scalar(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """Return the limit of |qw| below which rounding can change the sign of qw.

    The limit is 1.5 k eps = 3 delta. The error of the quaternion q is only 2.3 delta.
    """
    return 1.5 * EPS * result_k(bound, leading)


def nearest_singularity(plan: CompiledTree) -> float:
    """Return the distance (rad) from a singularity below which results have no valid digit.

    The distance is four times the error of R.
    """
    return 4.0 * EPS * float(np.max(of_joints(plan.depth + 1, plan.tilts), initial=0.0))


def column_weights(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    """Return the sums of |multiplier| over revolute joints and over prismatic joints.

    Each sum is an array (frames, nv). An independent joint has the multiplier 1.
    """
    weights: tuple[FloatArray, FloatArray] | None = plan.made.get("column weights")
    if weights is None:
        weights = plan.made["column weights"] = _column_weights(plan)
    return weights


def _column_weights(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    weights = np.zeros((2, len(plan.frames), plan.nv))
    for f, (_, place) in enumerate(plan.frames):
        for c in np.flatnonzero(plan.leaders[f] >= 0):
            kind = 0 if plan.columns[c, ColumnField.TURNS] else 1
            weights[kind, place, plan.columns[c, ColumnField.V]] += abs(plan.multipliers[c])
    weights.setflags(write=False)
    return weights[0], weights[1]


def movable(plan: CompiledTree, reference: Reference = _ALIGNED) -> NDArray[np.bool_]:
    """Return a bool array (frames, 6, nv).

    The array is False for the entries of a Jacobian that are 0 for every q and every motion of the base. The
    linear rows of a revolute column are z x d. In WORLD, d is the vector from the joint to the root. In the
    other reference frames, d is the vector from the joint to the frame. The vector d is 0 for every q if the
    path between these points has no length and no prismatic joint.
    """
    found = np.zeros((len(plan.frames), 6, plan.nv), dtype=bool)
    turns, multipliers = (
        plan.steps[:, StepField.KIND] == JointMotion.TURN,
        plan.geometry[:, Geometry.MULTIPLIER :],
    )
    extends = (plan.lengths[: len(turns)] > 0.0) | (~turns & (multipliers != 0.0).any(axis=1))
    for f, (end, place) in enumerate(plan.frames):
        path, step = list[int](), int(end)  # the path leads from the frame to the root
        while step >= 0:
            path.append(step)
            step = int(plan.parents[step])
        if reference.at_world:
            levers = np.logical_or.accumulate(extends[path[::-1]])[::-1]
        else:
            levers = np.logical_or.accumulate([plan.lengths[len(turns) + f] > 0.0, *extends[path[:-1]]])
        has_lever = dict(zip(path, levers, strict=False))
        for c in np.flatnonzero((plan.leaders[f] >= 0) & (plan.multipliers != 0.0)):
            column = plan.columns[c]
            own = found[place, :, column[ColumnField.V]]
            own[:3] |= not column[ColumnField.TURNS] or has_lever[column[ColumnField.STEP]]
            own[3:] |= column[ColumnField.TURNS] == 1
    return found
