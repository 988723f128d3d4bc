"""The recursion on lengths: how large the terms are that a frame's motion is summed from.

The equations of 7.58 and 7.127 to 7.130 run on `urdfkin.kinematics.lengths`, so that no intermediate value
can exceed what is found here.

One term is Pinocchio's alone: where 7.129 has v_i w_{i-1} x z it has v_i w_i x z. The joint's own share of
w_i is parallel to z and adds nothing but rounding, v_i^2 |z x z|, which fast joints about an axis askew do
show: the scale of alpha counts it, by giving the equation the w of the link behind the joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.compiled.plan import Geometry, Motion, Plan, Step
from urdfkin.kinematics.lengths import chapter as eq
from urdfkin.kinematics.lengths import counted, norm, product
from urdfkin.kinematics.roundings import of_joints
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
    plan: Plan, q: FloatArray, v: FloatArray | None, a: FloatArray | None, base: FloatArray
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


def _slid(plan: Plan, i: int, q: FloatArray) -> FloatArray:
    """How far a joint slides."""
    kind, at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.Q])
    if kind != Motion.SLIDE:
        return norm(q[:, at : at + (2 if kind == Motion.PLANAR else 3)])
    multiplier, constant = np.abs(plan.geometry[i, Geometry.MULTIPLIER :])
    return product(multiplier, np.abs(q[:, at])) + counted(constant)


def _place(plan: Plan, i: int, state: list[FloatArray], length: float, q: FloatArray) -> list[FloatArray]:
    turns = plan.steps[i, Step.KIND] == Motion.TURN
    return _carry_place(state, length if turns else length + _slid(plan, i, q))


def _step(
    plan: Plan, i: int, state: list[FloatArray], length: float, q: FloatArray, v: FloatArray, a: FloatArray
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
