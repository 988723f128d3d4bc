"""The recursion of section 7.7 at 50 digits: slow, short and right to far more digits than a double has.

The formulas are those of `urdfkin.recursion.steps`; that they are the right ones is Pinocchio's to say. What
this adds is the true value of every digit, from the URDF's decimals and the exact values of q, v and a.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from urdfkin.judge.decimals import ExactJoint
from urdfkin.judge.vectors import (
    IDENTITY,
    ZERO,
    Matrix,
    Number,
    Vector,
    about,
    cross,
    from_quaternion,
    minus,
    mp,
    plus,
    product,
    rotate,
    times,
    transposed,
)
from urdfkin.reference import Reference
from urdfkin.tree import JointKind, KinematicTree


@dataclass(frozen=True, slots=True)
class State:
    """A link's frame, in the world's axes: orientation, place, and their first and second rates."""

    R: Matrix = IDENTITY
    p: Vector = ZERO
    w: Vector = ZERO
    vel: Vector = ZERO
    alpha: Vector = ZERO
    acc: Vector = ZERO


@dataclass(frozen=True, slots=True)
class Column:
    """A rate: its axis, whether it turns, the link it moves, its place in v, and a follower's factor."""

    z: Vector
    turns: bool
    carrier: State
    place: int
    factor: Number


@dataclass(frozen=True, slots=True)
class Motion:
    """The whole robot at one instant.

    Attributes:
        states: One for each link.
        columns: For each link, the columns of its Jacobian.
        nv: Length of v.
    """

    states: tuple[State, ...]
    columns: tuple[tuple[Column, ...], ...]
    nv: int


def move(
    tree: KinematicTree,
    joints: Sequence[ExactJoint],
    q: Sequence[Number],
    v: Sequence[Number],
    a: Sequence[Number],
) -> Motion:
    """The motion of every link for one configuration and its rates."""
    states: list[State] = [State()]
    columns: list[tuple[Column, ...]] = [()]
    for i, joint in enumerate(tree.joints):
        own, at, rate_at = joints[i], tree.q_index[i], tree.v_index[i]
        placed = _carried(states[joint.parent], rotate(states[joint.parent].R, own.p))
        placed = replace(placed, R=product(placed.R, own.R))
        kind = joint.kind
        if kind.has_axis:
            angle = own.multiplier * q[at] + own.offset
            rate, rate_2 = own.multiplier * v[rate_at], own.multiplier * a[rate_at]
            moved = _moved_along_axis(placed, own.axis, kind.turns, angle, rate, rate_2)
            z = rotate(moved.R, own.axis)
            new: tuple[Column, ...] = (Column(z, kind.turns, moved, rate_at, own.multiplier),)
        elif kind is JointKind.FIXED:
            moved, new = placed, ()
        else:
            moved = _moved_freely(placed, kind, q[at:], v[rate_at:], a[rate_at:])
            new = _free_columns(moved, kind, rate_at)
        states.append(moved)
        columns.append((*columns[joint.parent], *new))
    return Motion(tuple(states), tuple(columns), tree.nv)


def _carried(state: State, d: Vector) -> State:
    """Along a rigid link: 7.128, 7.130."""
    turning = cross(state.w, d)
    return replace(
        state,
        p=plus(state.p, d),
        vel=plus(state.vel, turning),
        acc=plus(state.acc, cross(state.alpha, d), cross(state.w, turning)),
    )


def _moved(state: State, o: Vector, s: Vector, o_rate: Vector, s_rate: Vector) -> State:
    """By a turning o and a sliding s along axes that turn with the moved frame: 7.127 to 7.130."""
    w, twice = state.w, plus(state.w, state.w, o)
    return replace(
        state,
        w=plus(w, o),
        vel=plus(state.vel, s),
        alpha=plus(state.alpha, o_rate, cross(w, o)),
        acc=plus(state.acc, s_rate, cross(twice, s)),
    )


def _moved_along_axis(
    placed: State, axis: Vector, turns: bool, coordinate: Number, rate: Number, rate_2: Number
) -> State:
    z = rotate(placed.R, axis)
    if turns:
        moved = _moved(placed, times(rate, z), ZERO, times(rate_2, z), ZERO)
        return replace(moved, R=product(placed.R, about(axis, coordinate)))
    slid = _carried(placed, times(coordinate, z))
    return _moved(slid, ZERO, times(rate, z), ZERO, times(rate_2, z))


def _moved_freely(
    placed: State, kind: JointKind, q: Sequence[Number], v: Sequence[Number], a: Sequence[Number]
) -> State:
    zero = mp.mpf(0)
    if kind is JointKind.PLANAR:
        slide, turn = (q[0], q[1], zero), about(IDENTITY[2], q[2])
        rates = [((x[0], x[1], zero), (zero, zero, x[2])) for x in (v, a)]
    else:
        slide, turn = (q[0], q[1], q[2]), from_quaternion(q[3], q[4], q[5], q[6])
        rates = [((x[0], x[1], x[2]), (x[3], x[4], x[5])) for x in (v, a)]
    slid = _carried(placed, rotate(placed.R, slide))
    R = product(slid.R, turn)
    (s, o), (s_rate, o_rate) = ((rotate(R, x), rotate(R, y)) for x, y in rates)
    return replace(_moved(slid, o, s, o_rate, s_rate), R=R)


def _free_columns(moved: State, kind: JointKind, at: int) -> tuple[Column, ...]:
    axes = transposed(moved.R)
    sliding = (0, 1) if kind is JointKind.PLANAR else (0, 1, 2)
    turning = (2,) if kind is JointKind.PLANAR else (0, 1, 2)
    order = [(i, False) for i in sliding] + [(i, True) for i in turning]
    return tuple(Column(axes[i], turns, moved, at + c, mp.mpf(1)) for c, (i, turns) in enumerate(order))


# -- what is asked of a frame ------------------------------------------------------------------------

Six = tuple[Number, ...]


def velocity(state: State, reference: Reference) -> Six:
    """[linear; angular] in a reference."""
    linear = state.vel
    if reference is Reference.WORLD:
        linear = plus(linear, cross(state.w, times(mp.mpf(-1), state.p)))
    return _seen(state, reference, linear, state.w)


def acceleration(state: State, reference: Reference) -> Six:
    """Classical [linear; angular] in a reference."""
    linear = state.acc
    if reference is Reference.WORLD:
        d = times(mp.mpf(-1), state.p)
        linear = plus(linear, cross(state.alpha, d), cross(state.w, cross(state.w, d)))
    return _seen(state, reference, linear, state.alpha)


def jacobian(motion: Motion, link: int, reference: Reference) -> list[Six]:
    """The columns of the velocity Jacobian (7.85), one for each rate."""
    state, out = motion.states[link], _no_columns(motion.nv)
    to = ZERO if reference is Reference.WORLD else state.p
    for column in motion.columns[link]:
        linear, angular = column.z, ZERO
        if column.turns:
            linear, angular = cross(column.z, minus(to, column.carrier.p)), column.z
        _add(out, column, _seen(state, reference, linear, angular))
    return out


def jacobian_rate(motion: Motion, link: int, reference: Reference) -> list[Six]:
    """The columns of its rate (7.126)."""
    state, out = motion.states[link], _no_columns(motion.nv)
    world = reference is Reference.WORLD
    to, to_rate = (ZERO, ZERO) if world else (state.p, state.vel)
    for column in motion.columns[link]:
        z = column.z
        z_rate = cross(column.carrier.w, z)
        linear, linear_rate, angular, angular_rate = z, z_rate, ZERO, ZERO
        if column.turns:
            d, d_rate = minus(to, column.carrier.p), minus(to_rate, column.carrier.vel)
            linear, linear_rate = cross(z, d), plus(cross(z_rate, d), cross(z, d_rate))
            angular, angular_rate = z, z_rate
        if reference is Reference.LOCAL:
            linear_rate = minus(linear_rate, cross(state.w, linear))
            angular_rate = minus(angular_rate, cross(state.w, angular))
        _add(out, column, _seen(state, reference, linear_rate, angular_rate))
    return out


def _seen(state: State, reference: Reference, linear: Vector, angular: Vector) -> Six:
    if reference is Reference.LOCAL:
        back = transposed(state.R)
        linear, angular = rotate(back, linear), rotate(back, angular)
    return (*linear, *angular)


def _no_columns(nv: int) -> list[Six]:
    return [(mp.mpf(0),) * 6 for _ in range(nv)]


def _add(out: list[Six], column: Column, six: Six) -> None:
    here = out[column.place]
    out[column.place] = tuple(x + column.factor * y for x, y in zip(here, six, strict=True))
