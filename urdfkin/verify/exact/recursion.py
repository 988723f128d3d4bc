"""The recursion of section 7.7 on numbers of many digits or on intervals: slow, short, and no doubt about it.

The equations are those of `urdfkin.kinematics.equations`; that they are the right ones is Pinocchio's to say.
What this adds is the true value of every digit, from the URDF's decimals and the exact values of q, v and
a. It goes in the world's axes, as the text does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics import equations as eq
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree
from urdfkin.verify.exact.decimals import ExactJoint
from urdfkin.verify.exact.vectors import (
    IDENTITY,
    ZERO,
    Context,
    Matrix,
    Number,
    Vector,
    about,
    exact,
    from_quaternion,
    mp,
    nearest_rotation,
)
from urdfkin.verify.pinocchio_base import BaseNumbers


@dataclass(frozen=True, slots=True)
class State:
    """A link's frame, in the world's axes: orientation, place, and their first and second rates."""

    R: Matrix = IDENTITY
    p: Vector = ZERO
    w: Vector = ZERO
    vel: Vector = ZERO
    alpha: Vector = ZERO
    acc: Vector = ZERO


def on_base(
    base: BaseNumbers, context: Context = mp, nearest: Callable[[Matrix], Matrix] = nearest_rotation
) -> State:
    """A root link that moves, from the numbers that its motion was given by.

    Args:
        base: (4, 4) placement, (6,) velocity and acceleration.
        context: The kind of number.
        nearest: What brings the placement's matrix, right to nine digits, to the rotation nearest to it.
    """

    def vector(x: FloatArray) -> Vector:
        return exact(x[0], context), exact(x[1], context), exact(x[2], context)

    T, six, six_2 = base.placement, base.velocity, base.acceleration
    R = nearest((vector(T[0]), vector(T[1]), vector(T[2])))
    return State(R, *map(vector, (T[:3, 3], six[3:], six[:3], six_2[3:], six_2[:3])))


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
    """The robot at one instant.

    Attributes:
        states: By link.
        columns: By link, the columns of its Jacobian.
        nv: Length of v.
    """

    states: Mapping[int, State]
    columns: Mapping[int, tuple[Column, ...]]
    nv: int


def move(
    tree: KinematicTree,
    joints: Mapping[int, ExactJoint],
    q: Sequence[Number],
    v: Sequence[Number],
    a: Sequence[Number],
    *,
    base: State | None = None,
    context: Context = mp,
) -> Motion:
    """The motion of the root, and of the link behind each joint, for one configuration and its rates.

    Args:
        tree: The robot.
        joints: What the text says of the joints that are wanted, with all before them, in the context's
            numbers.
        q: Coordinates, likewise.
        v: Rates.
        a: Rates of the rates.
        base: How the root link moves; None where it stands at the world's origin.
        context: The kind of number.
    """
    states = {0: base or State()}
    columns: dict[int, tuple[Column, ...]] = {0: ()}
    for i, own in joints.items():
        joint, at, rate_at = tree.joints[i], tree.q_index[i], tree.v_index[i]
        parent = states[joint.parent]
        placed = replace(_carried(parent, eq.rotate(parent.R, own.p)), R=eq.product(parent.R, own.R))
        kind = joint.kind
        if kind.has_axis:
            coordinate = own.multiplier * q[at] + own.offset
            rate, rate_2 = own.multiplier * v[rate_at], own.multiplier * a[rate_at]
            z = eq.rotate(placed.R, own.axis)
            if kind.turns:
                turn = about(own.axis, coordinate, context)
                moved = _turned(placed, z, rate, rate_2, eq.product(placed.R, turn))
            else:
                moved = _slid(_carried(placed, eq.times(coordinate, z)), z, rate, rate_2)
            new: tuple[Column, ...] = (Column(z, kind.turns, moved, rate_at, own.multiplier),)
        elif kind is JointKind.FIXED:
            moved, new = placed, ()
        else:
            moved = _moved_freely(placed, kind, (q[at:], v[rate_at:], a[rate_at:]), context)
            new = _free_columns(moved, kind, rate_at)
        states[i + 1], columns[i + 1] = moved, (*columns[joint.parent], *new)
    return Motion(states, columns, tree.nv)


def _carried(s: State, d: Vector) -> State:
    return replace(
        s,
        p=eq.plus(s.p, d),
        vel=eq.point_velocity(s.vel, s.w, d),
        acc=eq.point_acceleration(s.acc, s.alpha, s.w, d),
    )


def _turned(s: State, z: Vector, v: Number, a: Number, R: Matrix) -> State:
    w, alpha = eq.angular_velocity(s.w, z, v), eq.angular_acceleration(s.alpha, s.w, z, v, a)
    return replace(s, R=R, w=w, alpha=alpha)


def _slid(s: State, z: Vector, v: Number, a: Number) -> State:
    vel, acc = eq.sliding_velocity(s.vel, z, v), eq.sliding_acceleration(s.acc, s.w, z, v, a)
    return replace(s, vel=vel, acc=acc)


def _moved_freely(
    placed: State, kind: JointKind, numbers: tuple[Sequence[Number], ...], context: Context
) -> State:
    q, v, a = numbers
    if kind is JointKind.PLANAR:
        slide, turn = (q[0], q[1], 0), about(IDENTITY[2], q[2], context)
        rates = [((x[0], x[1], 0), (0, 0, x[2])) for x in (v, a)]
    else:
        slide, turn = (q[0], q[1], q[2]), from_quaternion((q[3], q[4], q[5], q[6]), context)
        rates = [((x[0], x[1], x[2]), (x[3], x[4], x[5])) for x in (v, a)]
    s = _carried(placed, eq.rotate(placed.R, slide))
    R = eq.product(s.R, turn)
    (u, o), (u_rate, o_rate) = ((eq.rotate(R, x), eq.rotate(R, y)) for x, y in rates)
    return State(
        R,
        s.p,
        eq.plus(s.w, o),
        eq.plus(s.vel, u),
        eq.free_angular_acceleration(s.alpha, s.w, o, o_rate),
        eq.free_acceleration(s.acc, s.w, o, u, u_rate),
    )


def _free_columns(moved: State, kind: JointKind, at: int) -> tuple[Column, ...]:
    axes = eq.transposed(moved.R)
    sliding = (0, 1) if kind is JointKind.PLANAR else (0, 1, 2)
    turning = (2,) if kind is JointKind.PLANAR else (0, 1, 2)
    order = [(i, False) for i in sliding] + [(i, True) for i in turning]
    return tuple(Column(axes[i], turns, moved, at + c, 1) for c, (i, turns) in enumerate(order))


# -- what is asked of a frame ------------------------------------------------------------------------

Six = tuple[Number, ...]


def placement_values(motion: Motion, link: int) -> NDArray[np.object_]:
    """(4, 4) T_world_link, as `Robot` hands it out."""
    s = motion.states[link]
    return _array([*((*row, place) for row, place in zip(s.R, s.p, strict=True)), (0, 0, 0, 1)])


def velocity_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6,), likewise."""
    return _array(velocity(motion.states[link], reference))


def acceleration_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6,), likewise."""
    return _array(acceleration(motion.states[link], reference))


def jacobian_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv), likewise."""
    return _array(jacobian(motion, link, reference)).reshape(motion.nv, 6).T


def jacobian_rate_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv), likewise."""
    return _array(jacobian_rate(motion, link, reference)).reshape(motion.nv, 6).T


def hessian_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv, nv), likewise."""
    out = np.zeros((motion.nv, motion.nv, 6), dtype=object)
    columns, s = motion.columns[link], motion.states[link]
    # Columns of one joint ride on one link.
    order = {id(column.carrier): place for place, column in enumerate(columns)}
    ends = [_column(column, s, reference) for column in columns]
    for i, column in enumerate(columns):
        for j, by in enumerate(columns):
            before = order[id(by.carrier)] <= order[id(column.carrier)]
            change = _seen(s, reference, *_change(ends[i], ends[j], reference, before=before))
            factor = column.factor * by.factor  # an interval multiplies numbers, no arrays
            out[column.place, by.place] += _array([factor * number for number in change])
    return out.transpose(2, 0, 1)


def _column(column: Column, s: State, reference: Reference) -> tuple[Vector, Vector]:
    """[linear; angular] of a rate, in the world's axes."""
    if not column.turns:
        return column.z, ZERO
    end = ZERO if reference is Reference.WORLD else s.p
    six: tuple[Vector, Vector] = eq.turning_column(column.z, eq.minus(end, column.carrier.p))
    return six


def _change(
    column: tuple[Vector, Vector], by: tuple[Vector, Vector], reference: Reference, *, before: bool
) -> tuple[Vector, Vector]:
    """How a column changes with a rate that comes before it, or with it, or behind it."""
    change: tuple[Vector, Vector] = ZERO, ZERO
    if reference is Reference.WORLD:
        change = eq.motion_product(*by, *column) if before else change
    elif reference is Reference.LOCAL:
        change = change if before else eq.motion_product(*column, *by)
    else:
        change = eq.turned_along(by[1], *column) if before else (eq.end_moved(column[1], by[0]), ZERO)
    return change


def _array(numbers: Sequence[Any]) -> NDArray[np.object_]:
    return np.array(numbers, dtype=object)


def velocity(s: State, reference: Reference) -> Six:
    """[linear; angular] in a reference."""
    linear = s.vel
    if reference is Reference.WORLD:
        linear = eq.point_velocity(linear, s.w, eq.minus(ZERO, s.p))
    return _seen(s, reference, linear, s.w)


def acceleration(s: State, reference: Reference) -> Six:
    """Classical [linear; angular] in a reference."""
    linear = s.acc
    if reference is Reference.WORLD:
        linear = eq.point_acceleration(linear, s.alpha, s.w, eq.minus(ZERO, s.p))
    return _seen(s, reference, linear, s.alpha)


def jacobian(motion: Motion, link: int, reference: Reference) -> list[Six]:
    """The columns of the velocity Jacobian (7.85), one for each rate."""
    s, out = motion.states[link], _no_columns(motion.nv)
    for column in motion.columns[link]:
        _add(out, column, _seen(s, reference, *_column(column, s, reference)))
    return out


def jacobian_rate(motion: Motion, link: int, reference: Reference) -> list[Six]:
    """The columns of its rate (7.126)."""
    s, out = motion.states[link], _no_columns(motion.nv)
    end, end_rate = (ZERO, ZERO) if reference is Reference.WORLD else (s.p, s.vel)
    for column in motion.columns[link]:
        z, carrier = column.z, column.carrier
        linear, angular = z, ZERO
        rate, turning = eq.axis_rate(carrier.w, z), ZERO
        if column.turns:
            d, d_rate = eq.minus(end, carrier.p), eq.minus(end_rate, carrier.vel)
            linear, angular = eq.turning_column(z, d)
            rate, turning = eq.turning_column_rate(z, rate, d, d_rate)
        if reference is Reference.LOCAL:
            rate = eq.rate_in_turning_axes(rate, s.w, linear)
            turning = eq.rate_in_turning_axes(turning, s.w, angular)
        _add(out, column, _seen(s, reference, rate, turning))
    return out


def _seen(s: State, reference: Reference, linear: Vector, angular: Vector) -> Six:
    if reference is Reference.LOCAL:
        back = eq.transposed(s.R)
        linear, angular = eq.rotate(back, linear), eq.rotate(back, angular)
    return (*linear, *angular)


def _no_columns(nv: int) -> list[Six]:
    return [(0,) * 6 for _ in range(nv)]


def _add(out: list[Six], column: Column, six: Six) -> None:
    here = out[column.place]
    out[column.place] = tuple(x + column.factor * y for x, y in zip(here, six, strict=True))
