"""What each side computes for a quantity of a call, and how far two correct computations may lie apart."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from urdfkin.asked import Rows
from urdfkin.oracle import Oracle
from urdfkin.recursion import evaluate
from urdfkin.recursion.plan import Plan
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification import bounds
from urdfkin.verification.bounds import Bound, Quantity
from urdfkin.verification.line_of_nodes import euler_jacobian, quaternion_jacobian
from urdfkin.verification.magnitudes import Magnitudes, magnitudes

#: Whether Pinocchio needs v, or v and a.
_RATES = {
    Quantity.VELOCITY: 1,
    Quantity.JACOBIAN: 0,
    Quantity.JACOBIAN_RATE: 1,
    Quantity.ACCELERATION: 2,
    Quantity.ACCELERATION_BREAKDOWN: 2,
}
_ALIGNED = Reference.LOCAL_WORLD_ALIGNED


class Part(NamedTuple):
    """Some configurations of a call, as urdfkin sees them and as the user asked for them.

    Attributes:
        plan: The walk.
        reference: For all but placements.
        q: (n, nq).
        rates: (n, nv) v, and a, as far as the call was given them.
        state: (n or 1, 24) how the base moves.
        asked: The same configurations in the user's own numbers and names.
        representation: Of an analytical Jacobian's orientation.
    """

    plan: Plan
    reference: Reference
    q: FloatArray
    rates: tuple[FloatArray, ...]
    state: FloatArray
    asked: Rows
    representation: str = ""


def axes_of(quantity: Quantity) -> int:
    """How many axes one result has: two for a matrix, one for [linear; angular]."""
    sixes = Quantity.VELOCITY, Quantity.ACCELERATION, Quantity.ACCELERATION_BREAKDOWN
    return 1 if quantity in sixes else 2


def held_against(quantity: Quantity, oracle: Oracle, x: Part, ours: FloatArray) -> tuple[FloatArray, Bound]:
    """The same results computed by Pinocchio, and what the two are measured against."""
    if quantity is Quantity.ANALYTICAL_JACOBIAN:
        return _analytical(oracle, x, ours)
    return pinocchios(quantity, oracle, x.asked), bound_of(quantity, x)


def _analytical(oracle: Oracle, x: Part, ours: FloatArray) -> tuple[FloatArray, Bound]:
    """From Pinocchio's rotation and Jacobian, by `line_of_nodes`."""
    q, frames, base = x.asked.inputs[0], x.asked.frames, x.asked.base
    J_v = oracle.jacobians(q, frames, [_ALIGNED], base)[:, :, 0]
    size = magnitudes(x.plan, x.q, None, None, x.state)
    if x.representation == "quaternion":
        quat = oracle.quaternions(q, frames, base)
        bound = bounds.quaternion_jacobian_bound(x.plan, size)
        theirs, hidden = quaternion_jacobian(quat, J_v), bounds.hidden_scalar(bound, quat.shape[:-1])
        # Of q and -q the one with qw >= 0 counts; where rounding hides the sign of qw, either does.
        with_other = (ours * theirs)[..., 3:, :].sum(axis=(-2, -1)) < 0.0
        turned = with_other & (np.abs(quat[..., 3]) <= hidden)
        theirs[..., 3:, :] *= np.where(turned, -1.0, 1.0)[..., np.newaxis, np.newaxis]
        return theirs, bound
    R = oracle.placements(q, frames, base)[..., :3, :3]
    theirs, apart = euler_jacobian(x.representation, R, J_v)
    return theirs, bounds.euler_jacobian_bound(x.plan, size, apart)


def urdfkins(quantity: Quantity, x: Part) -> FloatArray:
    """(n, frames, ...) results as the recursion computes them."""
    if quantity is Quantity.PLACEMENT:
        return evaluate.placements(x.plan, x.q, base=x.state)
    in_references: dict[Quantity, Callable[..., FloatArray]] = {
        Quantity.VELOCITY: evaluate.velocities,
        Quantity.JACOBIAN: evaluate.jacobians,
        Quantity.JACOBIAN_RATE: evaluate.jacobian_rates,
        Quantity.ACCELERATION: evaluate.accelerations,
    }
    return in_references[quantity](x.plan, x.q, *x.rates[: _RATES[quantity]], x.reference, base=x.state)


@np.errstate(over="ignore", under="ignore", invalid="ignore")  # what is not finite disagrees
def pinocchios(quantity: Quantity, oracle: Oracle, asked: Rows) -> FloatArray:
    """(n, frames, ...) the same results, computed by Pinocchio for what the user asked."""
    q, *given = asked.inputs
    if quantity is Quantity.PLACEMENT:
        return oracle.placements(q, asked.frames, asked.base)
    in_references: dict[Quantity, Callable[..., FloatArray]] = {
        Quantity.VELOCITY: oracle.velocities,
        Quantity.JACOBIAN: oracle.jacobians,
        Quantity.JACOBIAN_RATE: oracle.jacobian_rates,
        Quantity.ACCELERATION: oracle.accelerations,
        Quantity.ACCELERATION_BREAKDOWN: oracle.accelerations,
    }
    rates, compute = given[: _RATES[quantity]], in_references[quantity]
    return compute(q, *rates, asked.frames, [asked.reference], asked.base)[:, :, 0]


def bound_of(quantity: Quantity, x: Part) -> Bound:
    """What the two are measured against: see `verification.bounds`."""
    v, a = (*x.rates, None, None)[:2]
    size = magnitudes(x.plan, x.q, v, a, x.state)
    of: dict[Quantity, Callable[[Magnitudes], Bound]] = {
        Quantity.PLACEMENT: bounds.placement_bound,
        Quantity.VELOCITY: lambda size: bounds.velocity_bound(size, x.reference),
        Quantity.JACOBIAN: lambda size: bounds.jacobian_bound(x.plan, size, x.reference),
        Quantity.JACOBIAN_RATE: lambda size: bounds.jacobian_rate_bound(x.plan, size, x.reference),
        Quantity.ACCELERATION: lambda size: bounds.acceleration_bound(size, x.reference),
        Quantity.ACCELERATION_BREAKDOWN: lambda size: bounds.acceleration_bound(size, x.reference),
    }
    return of[quantity](size)
