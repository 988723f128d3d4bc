"""The recursion in absolute values: how large the terms are that a result is summed from.

Replacing every vector of 7.127 to 7.130 by its length and every minus by a plus gives numbers that no
intermediate value can exceed. Rounding errors are proportional to them, not to the result, which may be
small because large terms cancel.

One term is Pinocchio's alone: where 7.129 has v_i w_{i-1} x z it has v_i w_i x z. The joint's own share of
w_i is parallel to z and adds nothing but rounding, v_i^2 |z x z|, which fast joints about an axis askew do
show: the scale of alpha counts it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.recursion.plan import Geometry, Motion, Plan, Step
from urdfkin.tree import FloatArray

_UNTURNED = np.eye(3).ravel()


@dataclass(frozen=True, slots=True)
class Magnitudes:
    """Upper bounds on the size of everything that enters a frame's motion.

    Attributes:
        p: (n, frames) m: the length of the path from the world's origin, slides included.
        w: (n, frames) rad/s.
        vel: (n, frames) m/s.
        alpha: (n, frames) rad/s^2.
        acc: (n, frames) m/s^2.
        joints: (n, frames) how many joints' worth of rounding lies on the path: one for each URDF joint,
            one for a base that is turned, and for a follower its angle as well, which is itself rounded
            before its sine is taken.
    """

    p: FloatArray
    w: FloatArray
    vel: FloatArray
    alpha: FloatArray
    acc: FloatArray
    joints: FloatArray


@np.errstate(over="ignore", invalid="ignore")
def magnitudes(
    plan: Plan, q: FloatArray, v: FloatArray | None, a: FloatArray | None, base: FloatArray
) -> Magnitudes:
    """For flat batches q (n, nq), v and a (n, nv) or None, and a base state (1 or n, 24).

    Without v, only p and joints are those of the frames: what depends on places alone needs no more.
    """
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    state = [_norm(base[:, at : at + 3]) for at in (9, 12, 15, 18, 21)]
    turned = (base[:, :9] != _UNTURNED).any(axis=1)  # such a base rounds like a joint: see `bounds`
    states = [[*state, turned.astype(np.float64)]]
    for i in range(len(plan.steps)):
        state = states[plan.parents[i] + 1]
        states.append(_place(plan, i, state, q) if v is None or a is None else _step(plan, i, state, q, v, a))
    carry = _carry if v is not None else _carry_place
    out = np.empty((6, len(q), len(plan.frames)))
    for f, (step, place) in enumerate(plan.frames):
        for row, values in zip(out, carry(states[step + 1], plan.lengths[len(plan.steps) + f]), strict=True):
            row[:, place] = values  # what is the same for all configurations is one number
    out[5] += plan.depth + 1
    return Magnitudes(*out)


def _norm(x: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((x * x).sum(axis=-1)))


def _carry(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    p, w, vel, alpha, acc, angles = state
    return [p + d, w, vel + w * d, alpha, acc + (alpha + w * w) * d, angles]


def _carry_place(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    return [state[0] + d, *state[1:]]


def _own(plan: Plan, i: int, q: FloatArray) -> FloatArray:
    """The size of a single coordinate."""
    multiplier, constant = plan.geometry[i, Geometry.MULTIPLIER :]
    own: FloatArray = np.abs(multiplier * q[:, plan.steps[i, Step.Q]]) + abs(constant)
    return own


def _followed(plan: Plan, i: int, angles: FloatArray, q: FloatArray) -> FloatArray:
    """A follower's angle is itself rounded."""
    leads = plan.geometry[i, Geometry.MULTIPLIER] == 1.0 and plan.geometry[i, Geometry.CONSTANT] == 0.0
    return angles if leads else angles + _own(plan, i, q)


def _slid(plan: Plan, i: int, q: FloatArray) -> FloatArray:
    """How far a joint slides."""
    kind, at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.Q])
    return (
        _own(plan, i, q)
        if kind == Motion.SLIDE
        else _norm(q[:, at : at + (2 if kind == Motion.PLANAR else 3)])
    )


def _place(plan: Plan, i: int, state: list[FloatArray], q: FloatArray) -> list[FloatArray]:
    if plan.steps[i, Step.KIND] == Motion.TURN:
        *state, angles = _carry_place(state, plan.lengths[i])
        return [*state, _followed(plan, i, angles, q)]
    return _carry_place(state, plan.lengths[i] + _slid(plan, i, q))


def _step(
    plan: Plan, i: int, state: list[FloatArray], q: FloatArray, v: FloatArray, a: FloatArray
) -> list[FloatArray]:
    kind, rate_at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.V])
    if kind in (Motion.TURN, Motion.SLIDE):
        multiplier = plan.geometry[i, Geometry.MULTIPLIER]
        rate, rate_2 = np.abs(multiplier * v[:, rate_at]), np.abs(multiplier * a[:, rate_at])
        if kind == Motion.TURN:
            p, w, vel, alpha, acc, angles = _carry(state, plan.lengths[i])
            turned = alpha + rate_2 + rate * (w + rate)
            return [p, w + rate, vel, turned, acc, _followed(plan, i, angles, q)]
        p, w, vel, alpha, acc, angles = _carry(state, plan.lengths[i] + _slid(plan, i, q))
        return [p, w, vel + rate, alpha, acc + rate_2 + 2.0 * rate * w, angles]
    slides, turns = (2, 1) if kind == Motion.PLANAR else (3, 3)
    p, w, vel, alpha, acc, angles = _carry(state, plan.lengths[i] + _slid(plan, i, q))
    u, o = _norm(v[:, rate_at : rate_at + slides]), _norm(v[:, rate_at + slides : rate_at + slides + turns])
    u_rate = _norm(a[:, rate_at : rate_at + slides])
    o_rate = _norm(a[:, rate_at + slides : rate_at + slides + turns])
    return [p, w + o, vel + u, alpha + o_rate + (w + o) * o, acc + u_rate + (2.0 * w + o) * u, angles]
