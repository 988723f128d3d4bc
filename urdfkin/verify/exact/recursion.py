"""The recursion of section 7.7 on numbers of many digits or on intervals: slow, short, and no doubt about it.

The equations are those of `urdfkin.kinematics.equations`; that they are the right ones is Pinocchio's to say.
What this adds is the true value of every digit, from the URDF's decimals and the exact values of q, v and
a. It goes in the world's axes, as the text does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics import equations
from urdfkin.model.recursion import IDENTITY, Column, Matrix, Number, Recursion, State, Vector
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree
from urdfkin.verify.exact.numbers import (
    Context,
    ExactJoint,
    about,
    exact,
    from_quaternion,
    mp,
    nearest_rotation,
)
from urdfkin.verify.pinocchio_inputs import BaseNumbers

_WALK = Recursion(equations)


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
        placed = _WALK.turned(_WALK.carried(states[joint.parent], own.p), own.R)
        kind, axes = joint.kind, tuple[tuple[int, bool], ...]()
        if kind.has_axis:
            coordinate = own.multiplier * q[at] + own.offset
            rates = own.multiplier * v[rate_at], own.multiplier * a[rate_at]
            z = _WALK.seen(placed, own.axis)
            if kind.turns:
                moved = _WALK.revolute(placed, own.axis, about(own.axis, coordinate, context), *rates)
            else:
                moved = _WALK.prismatic(placed, own.axis, coordinate, *rates)
            new: tuple[Column, ...] = (Column(z, kind.turns, moved, i, rate_at, own.multiplier),)
        elif kind is JointKind.FIXED:
            moved, new = placed, ()
        else:
            moved, axes = _moved_freely(placed, kind, (q[at:], v[rate_at:], a[rate_at:]), context)
            z_of = equations.transposed(moved.R)
            new = tuple(Column(z_of[k], turns, moved, i, rate_at + c, 1) for c, (k, turns) in enumerate(axes))
        states[i + 1], columns[i + 1] = moved, (*columns[joint.parent], *new)
    return Motion(states, columns, tree.nv)


def _moved_freely(
    placed: State, kind: JointKind, numbers: tuple[Sequence[Number], ...], context: Context
) -> tuple[State, tuple[tuple[int, bool], ...]]:
    """The state behind a planar or floating joint, and along or about which of its axes each rate acts."""
    q, v, a = numbers
    if kind is JointKind.PLANAR:
        slide, S = (q[0], q[1], 0), about(IDENTITY[2], q[2], context)
        rates: list[Vector] = [x for y in (v, a) for x in ((y[0], y[1], 0), (0, 0, y[2]))]
        return _WALK.free(placed, slide, S, rates), ((0, False), (1, False), (2, True))
    slide, S = (q[0], q[1], q[2]), from_quaternion((q[3], q[4], q[5], q[6]), context)
    rates = [x for y in (v, a) for x in ((y[0], y[1], y[2]), (y[3], y[4], y[5]))]
    moved = _WALK.free(placed, slide, S, rates)
    return moved, tuple((k, turns) for turns in (False, True) for k in range(3))


# -- what is asked of a frame, as `Robot` hands it out -------------------------------------------------


def placement_values(motion: Motion, link: int) -> NDArray[np.object_]:
    """(4, 4) T_world_link."""
    s = motion.states[link]
    return _array([*((*row, place) for row, place in zip(s.R, s.p, strict=True)), (0, 0, 0, 1)])


def velocity_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6,)."""
    s = motion.states[link]
    return _array(_WALK.in_reference(s, reference, *_WALK.velocity(s, reference)))


def acceleration_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6,)."""
    s = motion.states[link]
    return _array(_WALK.in_reference(s, reference, *_WALK.acceleration(s, reference)))


def jacobian_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv)."""
    found = _WALK.jacobian(motion.states[link], motion.columns[link], motion.nv, reference)
    return _array(found).reshape(motion.nv, 6).T


def jacobian_rate_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv)."""
    found = _WALK.jacobian_rate(motion.states[link], motion.columns[link], motion.nv, reference)
    return _array(found).reshape(motion.nv, 6).T


def hessian_values(motion: Motion, link: int, reference: Reference) -> NDArray[np.object_]:
    """(6, nv, nv)."""
    out = np.zeros((motion.nv, motion.nv, 6), dtype=object)
    for of, by, factor, six in _WALK.hessian(motion.states[link], motion.columns[link], reference):
        out[of, by] += _array([factor * x for x in six])  # an interval multiplies numbers, not arrays
    return out.transpose(2, 0, 1)


def _array(numbers: Sequence[Any]) -> NDArray[np.object_]:
    return np.array(numbers, dtype=object)
