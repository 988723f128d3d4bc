"""The recursion in absolute values: how large the terms are that a result is summed from.

Replacing every vector of 7.127 to 7.130 by its length and every minus by a plus gives numbers that no
intermediate value can exceed. Rounding errors are proportional to them, not to the result, which may be
small because large terms cancel.

One term is Pinocchio's alone: where 7.129 has v_i w_{i-1} x z it has v_i w_i x z. The joint's own share of
w_i is parallel to z and adds nothing but rounding, v_i^2 |z x z|, which fast joints about an axis askew do
show: the scale of alpha counts it.

Nothing but zero counts as smaller than `SMALLEST`, the smallest normal number. Below it a product is off by
half the smallest subnormal number, not by half an eps of itself, and so as much as `SMALLEST` would be; and a
product that is zero because two small numbers were multiplied may still meet a large one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.recursion.plan import Geometry, Motion, Plan, Step
from urdfkin.tree import FloatArray

SMALLEST = float(np.finfo(np.float64).tiny)
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
        joints: (n, frames) how many joints' worth of rounding lies on the path: one for each URDF joint, one
            for a base that is turned, and one more.
        tilt: (n, frames) rad: by how much Pinocchio's axes on the path are off the file's, added up.
    """

    p: FloatArray
    w: FloatArray
    vel: FloatArray
    alpha: FloatArray
    acc: FloatArray
    joints: FloatArray
    tilt: FloatArray


@np.errstate(over="ignore", under="ignore", invalid="ignore")
def magnitudes(
    plan: Plan, q: FloatArray, v: FloatArray | None, a: FloatArray | None, base: FloatArray
) -> Magnitudes:
    """For flat batches q (n, nq), v and a (n, nv) or None, and a base state (1 or n, 24).

    Without v, only p and joints are those of the frames: what depends on places alone needs no more.
    """
    if v is not None and a is None:
        a = np.zeros((1, plan.nv))
    states = [[_norm(base[:, at : at + 3]) for at in (9, 12, 15, 18, 21)]]
    lengths = _counted(plan.lengths)
    for i in range(len(plan.steps)):
        state = states[plan.parents[i] + 1]
        moved = (
            _place(plan, i, state, lengths[i], q)
            if v is None or a is None
            else _step(plan, i, state, lengths[i], q, v, a)
        )
        states.append(moved)
    carry = _carry if v is not None else _carry_place
    out = np.empty((7, len(q), len(plan.frames)))
    for f, (step, place) in enumerate(plan.frames):
        carried = carry(states[step + 1], lengths[len(plan.steps) + f])
        for row, values in zip(out, carried, strict=False):
            row[:, place] = values  # what is the same for all configurations is one number
    turned = (base[:, :9] != _UNTURNED).any(axis=1)  # such a base rounds like a joint: see `bounds`
    out[5], out[6] = plan.depth + 1 + turned[:, np.newaxis], plan.tilts
    return Magnitudes(*out)


def product(x: FloatArray | float, y: FloatArray | float) -> FloatArray:
    """`x y` for numbers that are not negative, and no less than `SMALLEST` unless one of them is zero."""
    xy = np.asarray(np.multiply(x, y))
    small = xy < SMALLEST
    if not small.any():
        return xy
    return np.where(small & (np.not_equal(x, 0.0) & np.not_equal(y, 0.0)), SMALLEST, xy)


def _counted(x: FloatArray) -> FloatArray:
    """What is not zero counts as `SMALLEST` at least."""
    return np.where(x == 0.0, 0.0, np.maximum(x, SMALLEST))


def _norm(x: FloatArray) -> FloatArray:
    # hypot neither under- nor overflows where squares would.
    return _counted(np.hypot.reduce(x, axis=-1))


def _carry(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    p, w, vel, alpha, acc = state
    turning = product(w, d)
    return [p + d, w, vel + turning, alpha, acc + product(alpha, d) + product(w, turning)]


def _carry_place(state: list[FloatArray], d: FloatArray | float) -> list[FloatArray]:
    return [state[0] + d, *state[1:]]


def _slid(plan: Plan, i: int, q: FloatArray) -> FloatArray:
    """How far a joint slides."""
    kind, at = int(plan.steps[i, Step.KIND]), int(plan.steps[i, Step.Q])
    if kind != Motion.SLIDE:
        return _norm(q[:, at : at + (2 if kind == Motion.PLANAR else 3)])
    multiplier, constant = np.abs(plan.geometry[i, Geometry.MULTIPLIER :])
    return product(multiplier, np.abs(q[:, at])) + _counted(constant)


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
        if kind == Motion.TURN:
            return [p, w + rate, vel, alpha + rate_2 + product(rate, w + rate), acc]
        return [p, w, vel + rate, alpha, acc + rate_2 + 2.0 * product(rate, w)]
    slides, turns = (2, 1) if kind == Motion.PLANAR else (3, 3)
    (u, o), (u_rate, o_rate) = (
        (_norm(x[:, rate_at : rate_at + slides]), _norm(x[:, rate_at + slides : rate_at + slides + turns]))
        for x in (v, a)
    )
    turned = alpha + o_rate + product(w + o, o)
    return [p, w + o, vel + u, turned, acc + u_rate + product(2.0 * w + o, u)]
