"""What Pinocchio computes for each quantity of a call, and how far two correct computations may lie apart."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from urdfkin.asked import Rows
from urdfkin.oracle import Oracle
from urdfkin.recursion.plan import Plan
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification import bounds
from urdfkin.verification.bounds import Bound, Quantity
from urdfkin.verification.magnitudes import Magnitudes, magnitudes

#: Whether Pinocchio needs v, or v and a.
_RATES = {
    Quantity.VELOCITY: 1,
    Quantity.JACOBIAN: 0,
    Quantity.JACOBIAN_RATE: 1,
    Quantity.ACCELERATION: 2,
}


class Part(NamedTuple):
    """Some configurations of a call, as urdfkin sees them and as the user asked for them.

    Attributes:
        plan: The walk.
        reference: For all but placements.
        q: (n, nq).
        rates: (n, nv) v, and a, as far as the call was given them.
        state: (n or 1, 24) how the base moves.
        asked: The same configurations in the user's own numbers and names.
    """

    plan: Plan
    reference: Reference
    q: FloatArray
    rates: tuple[FloatArray, ...]
    state: FloatArray
    asked: Rows


def axes_of(quantity: Quantity) -> int:
    """How many axes one result has: two for a matrix, one for [linear; angular]."""
    return 1 if quantity in (Quantity.VELOCITY, Quantity.ACCELERATION) else 2


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
    }
    return of[quantity](size)
