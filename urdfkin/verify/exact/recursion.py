"""The forward recursion of section 7.7, computed with intervals that contain the true values.

The inputs are the URDF's decimals and the exact values of q, v and a. The equations come from
`urdfkin.kinematics.equations`, in world axes as in the textbook. The intervals measure only rounding errors;
the comparison with Pinocchio checks the equations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics import equations
from urdfkin.model.recursion import IDENTITY, Column, LinkState, Number, Recursion, Vector
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree
from urdfkin.verify.exact.numbers import (
    ExactJoint,
    as_interval,
    nearest_rotation,
    rotation_about,
    rotation_from_quaternion,
)
from urdfkin.verify.oracle import BaseMotionLike

_RECURSION = Recursion(equations)

#: Axis and type of each velocity of a planar or floating joint. A pair contains the index of an axis of the
#: child link (0, 1 or 2 for x, y or z), and True for an angular velocity.
_VELOCITY_AXES = {
    JointKind.PLANAR: ((0, False), (1, False), (2, True)),
    JointKind.FLOATING: tuple((k, turns) for turns in (False, True) for k in range(3)),
}


def make_base_state(base: BaseMotionLike) -> LinkState:
    def as_interval_vector(x: FloatArray) -> Vector:
        return as_interval(x[0]), as_interval(x[1]), as_interval(x[2])

    T, six, six_2 = base.placement, base.velocity, base.acceleration
    R = nearest_rotation((as_interval_vector(T[0]), as_interval_vector(T[1]), as_interval_vector(T[2])))
    return LinkState(R, *map(as_interval_vector, (T[:3, 3], six[3:], six[:3], six_2[3:], six_2[:3])))


@dataclass(frozen=True, slots=True)
class ExactMotion:
    """The motion of links, and Jacobian columns, as intervals. The keys are link indices."""

    states: Mapping[int, LinkState]
    columns: Mapping[int, tuple[Column, ...]]
    nv: int


def compute_motion(
    tree: KinematicTree,
    joints: Mapping[int, ExactJoint],
    q: Iterable[Number],
    v: Iterable[Number],
    a: Iterable[Number],
    *,
    base: LinkState | None = None,
) -> ExactMotion:
    """Compute the motion for one sample. In `joints`, each joint comes after its parent joint."""
    q, v, a = (list(map(as_interval, numbers)) for numbers in (q, v, a))
    states = {0: base or LinkState()}
    columns: dict[int, tuple[Column, ...]] = {0: ()}
    for i, exact_joint in joints.items():
        joint, q_at, v_at = tree.joints[i], tree.q_index[i], tree.v_index[i]
        placed = _RECURSION.rotate_frame(
            _RECURSION.translate_frame(states[joint.parent], exact_joint.p), exact_joint.R
        )
        kind, new_columns = joint.kind, tuple[Column, ...]()
        if kind.has_axis:
            axis, multiplier = exact_joint.axis, exact_joint.multiplier
            coordinate = multiplier * q[q_at] + exact_joint.offset
            rates = multiplier * v[v_at], multiplier * a[v_at]
            z = _RECURSION.express(placed, axis)
            if kind.turns:
                moved = _RECURSION.after_revolute(placed, axis, rotation_about(axis, coordinate), *rates)
            else:
                moved = _RECURSION.after_prismatic(placed, axis, coordinate, *rates)
            new_columns = (Column(z, kind.turns, moved, i, v_at, multiplier),)
        elif kind is JointKind.FIXED:
            moved = placed
        elif kind is JointKind.PLANAR:
            S = rotation_about(IDENTITY[2], q[q_at + 2])
            moved = _RECURSION.after_planar(placed, q[q_at:], S, v[v_at:], a[v_at:])
        elif kind is JointKind.FLOATING:
            S = rotation_from_quaternion(q[q_at + 3 : q_at + 7])
            moved = _RECURSION.after_floating(placed, q[q_at:], S, v[v_at:], a[v_at:])
        else:
            raise NotImplementedError(f"the motion of a {kind} joint")
        if kind in _VELOCITY_AXES:
            axes = equations.transposed(moved.R)
            new_columns = tuple(
                Column(axes[k], turns, moved, i, v_at + c, 1)
                for c, (k, turns) in enumerate(_VELOCITY_AXES[kind])
            )
        states[i + 1], columns[i + 1] = moved, (*columns[joint.parent], *new_columns)
    return ExactMotion(states, columns, tree.nv)


# -- quantities of a frame, in the shapes that `Robot` returns -----------------------------------------


def placement_values(motion: ExactMotion, link: int) -> NDArray[np.object_]:
    s = motion.states[link]
    return _as_array([*((*row, place) for row, place in zip(s.R, s.p, strict=True)), (0, 0, 0, 1)])


def velocity_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    s = motion.states[link]
    return _as_array(_RECURSION.in_reference(s, reference, *_RECURSION.velocity(s, reference)))


def acceleration_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    """Return the classical acceleration of a link."""
    s = motion.states[link]
    return _as_array(_RECURSION.in_reference(s, reference, *_RECURSION.acceleration(s, reference)))


def spatial_acceleration_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    """Return the spatial acceleration.

    The linear part is acc - w x vel, or acc - w x vel - alpha x p for WORLD.
    """
    s = motion.states[link]
    linear = equations.minus(s.acc, equations.cross(s.w, s.vel))
    if reference.at_world:
        linear = equations.point_velocity(linear, s.alpha, equations.minus((0, 0, 0), s.p))
    return _as_array(_RECURSION.in_reference(s, reference, linear, s.alpha))


def jacobian_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    found = _RECURSION.jacobian(motion.states[link], motion.columns[link], motion.nv, reference)
    return _as_array(found).reshape(motion.nv, 6).T


def jacobian_rate_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    found = _RECURSION.jacobian_rate(motion.states[link], motion.columns[link], motion.nv, reference)
    return _as_array(found).reshape(motion.nv, 6).T


def hessian_values(motion: ExactMotion, link: int, reference: Reference) -> NDArray[np.object_]:
    out = np.zeros((motion.nv, motion.nv, 6), dtype=object)
    for of, by, factor, six in _RECURSION.hessian(motion.states[link], motion.columns[link], reference):
        # NumPy cannot multiply an interval by an array.
        out[of, by] += _as_array([factor * x for x in six])
    return out.transpose(2, 0, 1)


def _as_array(numbers: Sequence[Any]) -> NDArray[np.object_]:
    return np.array(numbers, dtype=object)
