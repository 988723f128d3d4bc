"""The recursion on lengths: how large the terms are that a frame's motion is summed from.

The equations of 7.58 and 7.127 to 7.130 run on `urdfkin.kinematics.number_kinds`, so that no intermediate
value can exceed what is found here.

One term is Pinocchio's alone: where 7.129 has v_i w_{i-1} x z it has v_i w_i x z. The joint's own share of
w_i is parallel to z and adds nothing but rounding, v_i^2 |z x z|, which fast joints about an axis askew do
show: the scale of alpha counts it, by giving the equation the w of the link behind the joint.


How far two correct computations may differ: the roundings that they count, times the size of their terms.

A result is accepted when every number differs from Pinocchio's by at most

    k * eps * scale,      eps = 2^-52,      k = factors * ROUNDINGS * joints.

*scale* is the size of the terms that the number is summed from, in its own unit (`magnitudes`): two
computations that add the same terms in another order differ in proportion to the terms, not to their sum.

*k* counts roundings, to first order in eps (`urdfkin.kinematics.roundings`): so many for each joint on the
path, each of which turns what is behind it. Rotations do not stretch what was wrong before, so the error
grows with the number of joints and no faster.

A quantity is multilinear in rotated vectors, each a *factor* that may be off by as much: a position has one
in each term (R d), a velocity two (w and d), an acceleration three (w, w, d, or v z, w, d), a Jacobian's
linear rows two (z and d), its rate's three (w, z and d), its Hessian's three (z, z and d); seeing it in the
frame's own axes is one factor more, seeing it from the world's origin crosses it with p and is one more.

Rounding seldom conspires as it would have to. What is measured is a fraction of an eps for each
joint, and reports give the disagreement itself, in multiples of eps * scale, so that it can be compared
across robots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled.plan import Column, CompiledTree, Geometry, Motion, Step
from urdfkin.kinematics.number_kinds import counted, norm, product
from urdfkin.kinematics.number_kinds import length_equations as eq
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT, MUJOCO, ROUNDINGS, of_joints
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

_UNTURNED = np.eye(3).ravel()
_Z = 1.0  #: A joint's axis is as long as this.


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Upper bounds on the size of everything that enters a frame's motion.

    Attributes:
        p: (n, frames) m: the length of the path from the world's origin, slides included.
        w: (n, frames) rad/s.
        vel: (n, frames) m/s.
        alpha: (n, frames) rad/s^2.
        acc: (n, frames) m/s^2.
        roundings: (n, frames) of a factor: of each URDF joint on the path, of a base that is turned, and of
            one joint more.
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
    """For flat batches q (n, nq), v and a (n, nv) or None, and a base state (1 or n, 24).

    Without v, only p and roundings are those of the frames: what depends on places alone needs no more.
    """
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    states = [[norm(base[:, at : at + 3]) for at in (9, 12, 15, 18, 21)]]
    lengths = counted(plan.lengths)
    for i in range(len(plan.steps)):
        state = states[plan.parents[i] + 1]
        moved = (
            _place(plan, i, state, lengths[i], q)
            if v is None or a is None
            else _step(plan, i, state, lengths[i], q, v, a)
        )
        states.append(moved)
    carry = _carry if v is not None else _carry_place
    out = np.empty((6, len(q), len(plan.frames)))
    for f, (step, place) in enumerate(plan.frames):
        carried = carry(states[step + 1], lengths[len(plan.steps) + f])
        for row, values in zip(out, carried, strict=False):
            row[:, place] = values  # what is the same for all configurations is one number
    turned = (base[:, :9] != _UNTURNED).any(axis=1)  # such a base rounds like a joint
    out[5] = of_joints(plan.depth + 1 + turned[:, np.newaxis], plan.tilts)
    return Magnitudes(*out)


def _carry(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    p, w, vel, alpha, acc = state
    return [
        eq.point_position(p, None, d),
        w,
        eq.point_velocity(vel, w, d),
        alpha,
        eq.point_acceleration(acc, alpha, w, d),
    ]


def _carry_place(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    return [eq.point_position(state[0], None, d), *state[1:]]


def _slid(plan: CompiledTree, i: int, q: FloatArray) -> FloatArray:
    """How far a joint slides."""
    kind, at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.Q])
    if kind != Motion.SLIDE:
        return norm(q[:, at : at + (2 if kind == Motion.PLANAR else 3)])
    multiplier, constant = np.abs(plan.geometry[i, Geometry.MULTIPLIER :])
    return product(multiplier, np.abs(q[:, at])) + counted(constant)


def _place(
    plan: CompiledTree, i: int, state: list[FloatArray], length: float, q: FloatArray
) -> list[FloatArray]:
    turns = plan.steps[i, Step.KIND] == Motion.TURN
    return _carry_place(state, length if turns else length + _slid(plan, i, q))


def _step(
    plan: CompiledTree,
    i: int,
    state: list[FloatArray],
    length: float,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
) -> list[FloatArray]:
    kind, rate_at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.V])
    d = length if kind == Motion.TURN else length + _slid(plan, i, q)
    p, w, vel, alpha, acc = _carry(state, d)
    if kind in (Motion.TURN, Motion.SLIDE):
        multiplier = abs(plan.geometry[i, Geometry.MULTIPLIER])
        rate, rate_2 = (product(multiplier, np.abs(x[:, rate_at])) for x in (v, a))
        if kind == Motion.SLIDE:
            acc = eq.sliding_acceleration(acc, w, _Z, rate, rate_2)
            return [p, w, eq.sliding_velocity(vel, _Z, rate), alpha, acc]
        w = eq.angular_velocity(w, _Z, rate)
        return [p, w, vel, eq.angular_acceleration(alpha, w, _Z, rate, rate_2), acc]
    slides, turns = (2, 1) if kind == Motion.PLANAR else (3, 3)
    (u, o), (u_rate, o_rate) = (
        (norm(x[:, rate_at : rate_at + slides]), norm(x[:, rate_at + slides : rate_at + slides + turns]))
        for x in (v, a)
    )
    alpha = eq.free_angular_acceleration(alpha, eq.plus(w, o), o, o_rate)
    acc = eq.free_acceleration(acc, w, o, u, u_rate)
    return [p, eq.plus(w, o), eq.plus(vel, u), alpha, acc]


_ALIGNED = Reference.LOCAL_WORLD_ALIGNED

#: A scale beyond the range of doubles is inf; `disagreement` accepts nothing there.
_BEYOND = np.errstate(over="ignore", under="ignore", invalid="ignore")


@dataclass(frozen=True, slots=True)
class Bound:
    """What a quantity is measured against, each array shaped to broadcast against the results.

    Attributes:
        scale: The size of the terms, in the result's units; 0 where a result must agree exactly.
        k: How many eps of it two correct computations may differ by.
    """

    scale: FloatArray
    k: FloatArray


def result_k(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """`k` for each result, the same for all its numbers; `leading` axes count results.

    A k that allows nothing, less, or anything is no number: no share of it is within the bound.
    """
    k = bound.k.reshape(bound.k.shape[: len(leading)])
    return np.broadcast_to(np.where((k > 0.0) & (k < np.inf), k, np.nan), leading)


def bound_of(scale: FloatArray, factors: int, size: Magnitudes, reference: Reference = _ALIGNED) -> Bound:
    """A scale (n, frames, ...) with `k` for each result: its factors, times what each may be off by."""
    factors += reference is not _ALIGNED
    k = factors * size.roundings
    return Bound(scale, k.reshape(*k.shape, *[1] * (scale.ndim - 2)))


@_BEYOND
def about_the_root(size: Magnitudes) -> Magnitudes:
    """The magnitudes that hold between urdfkin and MuJoCo.

    MuJoCo keeps velocities, accelerations and Jacobians' columns about a centre of mass, at the root here
    (`urdfkin.verify.mujoco`), and brings them to the frame at the end. What it adds up are the lengths of
    another point, which is no farther from a joint, nor from the frame, than the path is long: levers of 2 p.
    Both steps cross with a lever, which is a factor more: of one it makes two, of three four, never more than
    twice as many. Each joint rounds by `MUJOCO` instead of `ROUNDINGS`.
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


def placement_scale(plan: CompiledTree, size: Magnitudes) -> FloatArray:
    """For (n, frames, 4, 4): the path's length for positions, 1 for rotations, 0 for the last row."""
    scale = np.zeros((*size.p.shape, 4, 4))
    scale[..., :3, :3] = 1.0
    scale[..., :3, 3] = size.p[..., None]
    return scale


@_BEYOND
def mjcf_placement_bound(bound: Bound, lengths: FloatArray, angles: FloatArray) -> Bound:
    """For (n, frames, 4, 4), between the tree that was made of an MJCF file and MuJoCo's model of the file.

    The tree has added up already what MuJoCo adds up anew: a body's place, its joints' anchors there and
    back, a slide's reference value. So positions have the length of all that, where it exceeds the path's.

    MuJoCo turns a hinge by fl(q - ref), the tree by ref and by q. The difference is rounded once, by (eps/2)
    (|q| + |ref|) rad at most. That turns what is behind the hinge: a number of a rotation changes by the
    angle at most, one of a position by the angle times the length. Twice that is allowed, to have room for
    the second order; as a share of k eps it is angle / k.

    Args:
        bound: Of the placements, for the tree.
        lengths: (n, frames) what MuJoCo adds up: m.
        angles: (n, frames) the sum of |q| + |ref| over the hinges that have a reference value: rad.
    """
    scale = bound.scale.copy()
    scale[..., :3, 3] = np.maximum(scale[..., :3, 3], lengths[..., None])
    scale[..., :3, :] *= 1.0 + (angles / result_k(bound, angles.shape))[..., None, None]
    return Bound(scale, bound.k)


@_BEYOND
def velocity_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """For (n, frames, 6)."""
    linear = size.vel
    if reference is Reference.WORLD:
        linear = eq.point_velocity(linear, size.w, size.p)
    return _six(linear, size.w)


@_BEYOND
def acceleration_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """For (n, frames, 6). Pinocchio goes through spatial accelerations, which differ by w x vel.

    It is that of a breakdown's sum too. There the terms are gathered by joints: v_k z x (v_k z x d_k) and
    2 w_{k-1} x (v_k z x d_k) with d_k from the joint to the frame have the lengths (w_k^2 - w_{k-1}^2) d_k, w
    being the sum of the rates so far, and added over the joints they are w^2 times each link's own length, as
    in 7.130. The d_k, interorigin vectors added up from the frame, round as the sums of 7.77 do, and adding
    up the 4 n parts rounds n + 3 times: both are less than the 2 eps that each joint has for sums.
    """
    shared = eq.tangential(size.w, size.vel)
    linear = size.acc + shared
    if reference is Reference.WORLD:
        linear = eq.point_acceleration(linear + shared, size.alpha, size.w, size.p)
    return _six(linear, size.alpha)


@_BEYOND
def imu_scale(size: Magnitudes, gravity: FloatArray) -> FloatArray:
    """For (n, frames, 6): gravity (3,) is one term more, which may cancel the others."""
    return _six(size.acc + eq.tangential(size.w, size.vel) + norm(gravity), size.w)


def _six(linear: FloatArray, angular: FloatArray) -> FloatArray:
    """(..., 6) from (...): the same for each of the three linear numbers, and for each angular one."""
    scale = np.empty((*linear.shape, 6))
    scale[..., :3] = linear[..., None]
    scale[..., 3:] = angular[..., None]
    return scale


def _six_rows(linear: FloatArray, angular: FloatArray) -> FloatArray:
    """(..., 6, nv) from (..., nv), likewise."""
    scale = np.empty((*linear.shape[:-1], 6, linear.shape[-1]))
    scale[..., :3, :] = linear[..., None, :]
    scale[..., 3:, :] = angular[..., None, :]
    return scale


@_BEYOND
def jacobian_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """For (n, frames, 6, nv): the path's length for turning columns, 1 for sliding ones, 0 for idle ones."""
    turning, sliding = column_weights(plan)
    linear, angular = eq.turning_column(turning, size.p[..., None])
    return _six_rows(linear + sliding, angular)


@_BEYOND
def jacobian_rate_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """For (n, frames, 6, nv).

    A frame's turning columns are no longer than its path, and their arms change no faster than its origin
    moves. In LOCAL the rate is that of the numbers in the frame's own axes.
    """
    turning, sliding = column_weights(plan)
    w, p, vel = size.w[..., None], size.p[..., None], size.vel[..., None]
    linear, angular = eq.turning_column_rate(turning, eq.axis_rate(w, turning), p, vel)
    linear = linear + eq.axis_rate(w, sliding)
    if reference is Reference.LOCAL:
        column, axis = eq.turning_column(turning, p)
        linear = eq.rate_in_turning_axes(linear, w, column + sliding)
        angular = eq.rate_in_turning_axes(angular, w, axis)
    return _six_rows(linear, angular)


#: Of a pair of columns whose second comes before the first, or with it, and of one whose second comes behind:
#: how many products z x (z x d) Pinocchio's linear rows are summed from, and how many z x z where one slides.
_PAIR_TERMS: dict[Reference, tuple[tuple[float, float], tuple[float, float]]] = {
    Reference.LOCAL_WORLD_ALIGNED: ((5.0, 2.0), (2.0, 1.0)),
    Reference.WORLD: ((2.0, 1.0), (0.0, 0.0)),
    Reference.LOCAL: ((0.0, 0.0), (3.0, 1.0)),
}


@_BEYOND
def hessian_scale(plan: CompiledTree, size: Magnitudes, reference: Reference) -> FloatArray:
    """For (n, frames, 6, nv, nv): of pairs of columns, a follower's with its leader's.

    No d is longer than the path. Pinocchio takes all from two columns c = [z x d; z] for the world's origin,
    and is counted by the products that it adds: c_1 x c_2 has two in its linear rows, w_1 x v_2 + v_1 x w_2;
    to go to a frame's origin p is p x (w_1 x w_2), one more; to have the other column there, (v - p x w) x w,
    two. So the five, two and three of `_PAIR_TERMS`. urdfkin needs one, z x (z x d), or the two of c_1 x c_2.

    In LOCAL urdfkin pairs columns that were turned back, each by R: two products of five factors, R, z, R, z
    and d, less than the three of four that are allowed for.
    """
    shape = len(plan.frames), plan.nv, plan.nv
    turning, mixed, angular = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    (near, near_mixed), (far, far_mixed) = _PAIR_TERMS[reference]
    step, rate = plan.columns[:, Column.STEP], plan.columns[:, Column.V]
    turns, size_of = plan.columns[:, Column.TURNS] == 1, np.abs(plan.multipliers)
    for f, (_, place) in enumerate(plan.frames):
        own = np.flatnonzero(plan.leaders[f] >= 0)
        i, j = own[:, np.newaxis], own[np.newaxis, :]
        before = step[j] <= step[i]
        sizes = product(size_of[i], size_of[j])
        both, one = sizes * (turns[i] & turns[j]), sizes * (turns[i] ^ turns[j])
        pair = place, rate[i], rate[j]
        np.add.at(turning, pair, both * np.where(before, near, far))
        np.add.at(mixed, pair, one * np.where(before, near_mixed, far_mixed))
        np.add.at(angular, pair, both * (before != (reference is Reference.LOCAL)))
    linear = product(turning, size.p[..., np.newaxis, np.newaxis]) + mixed
    scale = np.empty((*linear.shape[:2], 6, *shape[1:]))
    scale[..., :3, :, :] = linear[..., np.newaxis, :, :]
    scale[..., 3:, :, :] = angular[..., np.newaxis, :, :]
    return scale


@_BEYOND
def euler_jacobian_bound(bound: Bound, size: Magnitudes, apart: FloatArray) -> Bound:
    """For (n, frames, 6, nv): the positions' rows are those of the Jacobian; it grows near the singularity.

    The rates of the outer angles are r . w, that of the middle one u . w, with the reciprocal basis of
    the axes e_i, u and t = R e_k (`line_of_nodes`): |u| = 1, |r| = 1 / s, where s = |e_i x t| is the sine or
    cosine of the middle angle. When t is off by no more than delta = k eps, u turns by delta / s, and r,
    as -(r . du) u - (r . dt) r' shows, changes by 2 delta / s^2, with the least s there is: `apart` - delta.
    With w off by delta of its size, the sums are 2 delta / s^2 + delta / s, at most 3 delta / s^2, and
    delta / s + delta, at most 2 delta / s. In scales for the two factors of the Jacobian that is 1.5 / s^2
    and 1 / s. What the angles' own arithmetic rounds (some 3 eps for arctan2 and its sine, 10 eps for
    products and quotients, on either side) is held by the joint counted more: there is no offset to add here.

    Args:
        bound: The Jacobian's.
        size: Of the frames.
        apart: (n, frames) s of Pinocchio's rotation.
    """
    s = apart - EPS * size.roundings
    s = np.where(s > 0.0, s, 0.0)  # where rounding hides the singularity nothing is accepted
    scale = bound.scale.copy()
    with np.errstate(divide="ignore"):
        scale[..., [3, 5], :] *= (1.5 / (s * s))[..., None, None]
        scale[..., 4, :] *= (1.0 / s)[..., None]
    return Bound(scale, bound.k)


def quaternion_jacobian_bound(bound: Bound) -> Bound:
    """For (n, frames, 7, nv): the positions' rows are those of the Jacobian; there is no singularity.

    A row of 4 q q^T is linear in R, off by less than 4.6 delta and at least 2 long, so that q is off by
    2.3 delta, half the product of w and q by (2.3 + 1) / 2 delta of w: less than the Jacobian's two factors.
    """
    return Bound(np.concatenate((bound.scale, bound.scale[..., 5:, :]), axis=-2), bound.k)


def hidden_scalar(bound: Bound, leading: tuple[int, ...]) -> FloatArray:
    """Below what |qw| rounding hides its sign: k eps is 2 delta, so that this is 3, and q is off by 2.3."""
    return 1.5 * EPS * result_k(bound, leading)


def nearest_singularity(plan: CompiledTree) -> float:
    """From where on (rad) rounding leaves Euler rates a digit: four times what R may be off by."""
    return 4.0 * EPS * float(np.max(of_joints(plan.depth + 1, plan.tilts), initial=0.0))


def column_weights(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    """(frames, nv) each: the sum of the mimic multipliers that turn, or slide, along each column."""
    made: tuple[FloatArray, FloatArray] | None = plan.made.get("column weights")
    if made is None:
        made = plan.made["column weights"] = _column_weights(plan)
    return made


def _column_weights(plan: CompiledTree) -> tuple[FloatArray, FloatArray]:
    weights = np.zeros((2, len(plan.frames), plan.nv))
    for f, (_, place) in enumerate(plan.frames):
        for c in np.flatnonzero(plan.leaders[f] >= 0):
            kind = 0 if plan.columns[c, Column.TURNS] else 1
            weights[kind, place, plan.columns[c, Column.V]] += abs(plan.multipliers[c])
    weights.setflags(write=False)
    return weights[0], weights[1]


def movable(plan: CompiledTree, reference: Reference = _ALIGNED) -> NDArray[np.bool_]:
    """(frames, 6, nv) which numbers of a Jacobian are not 0 for every q, the base being where it may.

    The linear rows of a turning column are z x d. There d is 0 for every q where the path has no length and
    nothing slides on it, from the joint to the frame, or in WORLD from the root to the joint.
    """
    found = np.zeros((len(plan.frames), 6, plan.nv), dtype=bool)
    turns, multipliers = plan.steps[:, Step.KIND] == Motion.TURN, plan.geometry[:, Geometry.MULTIPLIER :]
    extends = (plan.lengths[: len(turns)] > 0.0) | (~turns & (multipliers != 0.0).any(axis=1))
    for f, (end, place) in enumerate(plan.frames):
        path, step = list[int](), int(end)  # from the frame's step to the root's
        while step >= 0:
            path.append(step)
            step = int(plan.parents[step])
        if reference is Reference.WORLD:
            levers = np.logical_or.accumulate(extends[path[::-1]])[::-1]
        else:
            levers = np.logical_or.accumulate([plan.lengths[len(turns) + f] > 0.0, *extends[path[:-1]]])
        has_lever = dict(zip(path, levers, strict=False))
        for c in np.flatnonzero((plan.leaders[f] >= 0) & (plan.multipliers != 0.0)):
            column = plan.columns[c]
            own = found[place, :, column[Column.V]]
            own[:3] |= not column[Column.TURNS] or has_lever[column[Column.STEP]]
            own[3:] |= column[Column.TURNS] == 1
    return found


def disagreement(ours: FloatArray, theirs: FloatArray, bound: Bound) -> FloatArray:
    """|ours - theirs| in multiples of eps * scale; inf where the scale is 0 and they differ.

    A result that is not finite, or that a scale beyond all numbers would excuse, disagrees by inf.
    """
    unit = np.where(bound.scale > 0.0, np.maximum(EPS * bound.scale, LEAST_UNIT), 0.0)
    with np.errstate(all="ignore"):
        difference = np.abs(ours - theirs)
        units = difference / unit
    units = np.where(difference == 0.0, 0.0, units)
    return np.where(np.isfinite(difference) & np.isfinite(bound.scale), units, np.inf)
