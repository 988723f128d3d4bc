"""How far two correct computations may differ: the one place where tolerances come from.

A result is accepted when every number differs from Pinocchio's by at most

    k * eps * scale,      eps = 2^-52,      k = ROUNDINGS * factors * joints.

*scale* is the size of the terms that the number is summed from, in its own unit (`magnitudes`): two
computations that add the same terms in another order differ in proportion to the terms, not to their sum.

*k* counts roundings, to first order in eps, in the Euclidean norm. A joint multiplies the rotation so far
by its constant rotation and by its own turn, so that a rotated vector is off by at most, for each joint:

| | urdfkin | Pinocchio |
|---|---|---|
| the product with the constant: three terms round three times, 3 u sqrt(3) (u = eps/2) | 2.6 | 2.6 |
| the turn: two terms, 2 u sqrt(2), and its sine and cosine, 1 | 2.5 | 2.5 |
| the constant as read from roll, pitch, yaw: products of sines; through a quaternion, doubled | 2.5 | 6.0 |
| the axis: divided by its length; Rodrigues' formula where it is no coordinate axis | 0.5 | 2.0 |
| | 8.1 | 13.1 |

Pinocchio takes an axis within 1e-12 of a coordinate axis for that one. A tilt t turns a rotated vector by 2 t
at most, and Rodrigues' formula is not needed there: its 2.0 hold a tilt up to eps. A larger one is a finding
(URDF514), and such a robot is not compared.

Rotations do not stretch what was wrong before, so the error grows with the number of joints and no faster.
Adding the joint's term to the sum and its cross product cost 2 eps at most on each side; counting one joint
more than there is covers the frame's own offset and the first of these sums, and the rest is in rounding
8.1 + 13.1 = 21.2 up to ROUNDINGS = 24. The two may err in opposite directions, hence the sum.

A base that is turned counts as one joint more (`magnitudes`); one that is not rounds nothing. Both sides
bring the user's matrix M, right to nine digits, to the rotation nearest to it, each in its own way, so that
how far M is from a rotation does not enter:

| | urdfkin | Pinocchio |
|---|---|---|
| M^T M - I: nine sums of three products, 9 u in the Frobenius norm, of which the step takes half | 2.3 | |
| the difference M - M (M^T M - I)/2, u sqrt(3), and what the step leaves, u/8 | 0.9 | |
| K: sums of two or three numbers, 12 u; eigenvalues 4 apart; a quaternion's turn counts twice | | 3.0 |
| the eigenvector once more through K + I: four products, 16 u, likewise; the quotient by its norm | | 5.0 |
| the quaternion's matrix | | 3.0 |
| a base's velocity and acceleration, brought into its axes: two crosses and two sums | | 6.0 |
| | 3.2 | 17.0 |

20.2 is within ROUNDINGS. Found were 0.6 and 5.1 for the rotation (1,500 matrices, against 50 digits).

A quantity is multilinear in rotated vectors, each a *factor* that may be off by as much: a position has one
in each term (R d), a velocity two (w and d), an acceleration three (w, w, d, or v z, w, d), a Jacobian's
linear rows two (z and d), its rate's three (w, z and d); seeing it in the frame's own axes is one factor
more, seeing it from the world's origin crosses it with p and is one more.

The bound is a worst case; rounding seldom conspires. What is measured is a fraction of an eps for each
joint, and reports give the disagreement itself, in multiples of eps * scale, so that it can be compared
across robots.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from urdfkin.recursion.plan import Column, Plan
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification.magnitudes import Magnitudes

EPS = float(np.finfo(np.float64).eps)
SMALLEST = float(np.finfo(np.float64).tiny)
#: Roundings for each joint and each factor, both computations together; derived above.
ROUNDINGS = 24.0


#: A scale beyond the range of doubles is inf; `disagreement` accepts nothing there.
_BEYOND = np.errstate(over="ignore", invalid="ignore")


class Quantity(StrEnum):
    """What can be checked."""

    PLACEMENT = "placement"
    VELOCITY = "velocity"
    JACOBIAN = "jacobian"
    JACOBIAN_RATE = "jacobian rate"
    ACCELERATION = "acceleration"
    JOINT_JACOBIAN = "joint jacobian"
    JOINT_JACOBIAN_RATE = "joint jacobian rate"
    SCREWS = "screws"


#: How many rotated vectors are multiplied in each term of [linear; angular], in LOCAL_WORLD_ALIGNED.
_FACTORS = {
    Quantity.PLACEMENT: 1,
    Quantity.VELOCITY: 2,
    Quantity.JACOBIAN: 2,
    Quantity.JACOBIAN_RATE: 3,
    Quantity.ACCELERATION: 3,
    Quantity.JOINT_JACOBIAN: 2,
    Quantity.JOINT_JACOBIAN_RATE: 3,
    Quantity.SCREWS: 2,
}


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


def roundings(quantity: Quantity, reference: Reference, joints: FloatArray) -> FloatArray:
    """`k` for paths with so many joints."""
    extra = 0 if reference is Reference.LOCAL_WORLD_ALIGNED or quantity is Quantity.PLACEMENT else 1
    return ROUNDINGS * (_FACTORS[quantity] + extra) * joints


def placement_bound(size: Magnitudes) -> Bound:
    """For (n, frames, 4, 4): the path's length for positions, 1 for rotations, 0 for the last row."""
    scale = np.zeros((*size.p.shape, 4, 4))
    scale[..., :3, :3] = 1.0
    scale[..., :3, 3] = size.p[..., None]
    k = roundings(Quantity.PLACEMENT, Reference.LOCAL_WORLD_ALIGNED, size.joints)
    return Bound(scale, k[..., None, None])


@_BEYOND
def velocity_bound(size: Magnitudes, reference: Reference) -> Bound:
    """For (n, frames, 6)."""
    linear = size.vel + size.w * size.p if reference is Reference.WORLD else size.vel
    return Bound(_six(linear, size.w), roundings(Quantity.VELOCITY, reference, size.joints)[..., None])


@_BEYOND
def acceleration_bound(size: Magnitudes, reference: Reference) -> Bound:
    """For (n, frames, 6). Pinocchio goes through spatial accelerations, which differ by w x vel."""
    linear = size.acc + size.w * size.vel
    if reference is Reference.WORLD:
        linear = linear + size.w * size.vel + (size.alpha + size.w**2) * size.p
    return Bound(
        _six(linear, size.alpha), roundings(Quantity.ACCELERATION, reference, size.joints)[..., None]
    )


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
def jacobian_bound(plan: Plan, size: Magnitudes, reference: Reference) -> Bound:
    """For (n, frames, 6, nv): the path's length for turning columns, 1 for sliding ones, 0 for idle ones."""
    turning, sliding = column_weights(plan)
    linear = turning * size.p[..., None] + sliding
    scale = _six_rows(linear, turning)
    return Bound(scale, roundings(Quantity.JACOBIAN, reference, size.joints)[..., None, None])


@_BEYOND
def jacobian_rate_bound(plan: Plan, size: Magnitudes, reference: Reference) -> Bound:
    """For (n, frames, 6, nv).

    Turning columns have z-dot x d and z x d-dot, sliding ones z-dot; in the frame's own axes w x column is
    subtracted, which is as large again.
    """
    turning, sliding = column_weights(plan)
    again = 2.0 if reference is Reference.LOCAL else 1.0
    linear = turning * (again * size.w * size.p + size.vel)[..., None] + sliding * (again * size.w)[..., None]
    angular = turning * (again * size.w)[..., None]
    scale = _six_rows(linear, angular)
    return Bound(scale, roundings(Quantity.JACOBIAN_RATE, reference, size.joints)[..., None, None])


def column_weights(plan: Plan) -> tuple[FloatArray, FloatArray]:
    """(frames, nv) each: the sum of the mimic multipliers that turn, or slide, along each column."""
    weights = np.zeros((2, len(plan.frames), plan.nv))
    for f, (_, place) in enumerate(plan.frames):
        for c in np.flatnonzero(plan.leaders[f] >= 0):
            kind = 0 if plan.columns[c, Column.TURNS] else 1
            weights[kind, place, plan.columns[c, Column.V]] += abs(plan.multipliers[c])
    return weights[0], weights[1]


def disagreement(ours: FloatArray, theirs: FloatArray, bound: Bound) -> FloatArray:
    """|ours - theirs| in multiples of eps * scale; inf where the scale is 0 and they differ.

    A result that is not finite, or that a scale beyond all numbers would excuse, disagrees by inf.
    """
    # Below the smallest normal number rounding is no longer relative: products simply lose their last bits.
    unit = np.where(bound.scale > 0.0, np.maximum(EPS * bound.scale, SMALLEST), 0.0)
    with np.errstate(all="ignore"):
        difference = np.abs(ours - theirs)
        units = difference / unit
    units = np.where(difference == 0.0, 0.0, units)
    return np.where(np.isfinite(difference) & np.isfinite(bound.scale), units, np.inf)
