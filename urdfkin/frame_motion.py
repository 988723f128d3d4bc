"""All that can be told of one frame's motion, with Pinocchio's opinion of every number: for plots and views.

Sections 7.5 to 7.7. Unlike the methods of `Robot`, nothing is raised on a disagreement: it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.call import Call
from urdfkin.checks import bound_of, pinocchios
from urdfkin.recursion import evaluate
from urdfkin.recursion.breakdown import AccelerationBreakdown, acceleration_breakdown
from urdfkin.reference import Reference
from urdfkin.robot import Robot
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Bound, Quantity, result_k
from urdfkin.verification.worst import worst_of_each


@dataclass(frozen=True, eq=False)
class Check:
    """A quantity held against Pinocchio's, sample by sample.

    Attributes:
        units: (n,) the largest disagreement of each sample, eps * scale.
        share: (n,) the same as a share of its bound; above 1 is a failure.
    """

    units: FloatArray
    share: FloatArray


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """One frame along n samples, six-vectors [linear; angular].

    Attributes:
        frame: Its name.
        reference: In which velocity, acceleration and Jacobian are given.
        placement: (n, 4, 4) T_world_frame.
        velocity: (n, 6) m/s, rad/s.
        acceleration: (n, 6) classical, m/s^2, rad/s^2.
        jacobian: (n, 6, nv).
        parts: The acceleration by joint and kind.
        checks: What Pinocchio says of each quantity; empty where it cannot check the robot.
        not_verified: Why it cannot; None if it can.
    """

    frame: str
    reference: Reference
    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray
    parts: AccelerationBreakdown
    checks: dict[Quantity, Check]
    not_verified: str | None

    @property
    def agrees(self) -> bool:
        """Whether no sample lies outside its bound."""
        return all((check.share <= 1.0).all() for check in self.checks.values())

    @property
    def singular_values(self) -> FloatArray:
        """(n, min(6, nv)) of the Jacobian, largest first; metres and radians mixed as SI units mix them."""
        return np.asarray(np.linalg.svd(self.jacobian, compute_uv=False), dtype=np.float64)

    def manipulability(self, rows: slice = slice(0, 6)) -> FloatArray:
        """(n,) the product of the singular values of the Jacobian's `rows`: Yoshikawa's sqrt(det J J^T).

        With fewer rates than rows J J^T has no volume; the product over the rates is what J^T J has.
        """
        part = self.jacobian[:, rows]
        moving = np.abs(part).max(axis=(0, 1), initial=0.0) > 0.0
        if not moving.any():
            return np.zeros(len(part))
        values = np.linalg.svd(part[:, :, moving], compute_uv=False)
        return np.asarray(values.prod(axis=-1), dtype=np.float64)


def frame_motion(
    robot: Robot,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    frame: str,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
) -> FrameMotion:
    """Compute a frame's motion and hold it against Pinocchio's.

    Args:
        robot: The robot.
        q: (n, nq) rad, m.
        v: (n, nv) rad/s, m/s.
        a: (n, nv) rad/s^2, m/s^2.
        frame: A link's or joint's name.
        reference: For which point and in which axes.

    Raises:
        InputError: wrong lengths, numbers that are not finite.
        UnknownNameError: no such frame.
    """
    call = Call(robot, (frame,), reference, None, q, v, a)
    plan, reference = call.plan, call.reference
    ours = {
        Quantity.PLACEMENT: call.compute(evaluate.placements, plan, call.q),
        Quantity.VELOCITY: call.compute(evaluate.velocities, plan, call.q, call.rates[0], reference),
        Quantity.ACCELERATION: call.compute(evaluate.accelerations, plan, call.q, *call.rates, reference),
        Quantity.JACOBIAN: call.compute(evaluate.jacobians, plan, call.q, reference),
    }
    reason = robot.cannot_verify()
    return FrameMotion(
        frame,
        reference,
        ours[Quantity.PLACEMENT][:, 0],
        ours[Quantity.VELOCITY][:, 0],
        ours[Quantity.ACCELERATION][:, 0],
        ours[Quantity.JACOBIAN][:, 0],
        call.compute(acceleration_breakdown, robot.tree, call.links[0], call.q, *call.rates, reference),
        {} if reason else _checks(call, ours),
        reason,
    )


def _checks(call: Call, ours: dict[Quantity, FloatArray]) -> dict[Quantity, Check]:
    oracle, x = call.robot.oracle(None), call.part(slice(0, call.n))
    return {
        quantity: _check(results, pinocchios(quantity, oracle, x.asked), bound_of(quantity, x))
        for quantity, results in ours.items()
    }


def _check(ours: FloatArray, theirs: FloatArray, bound: Bound) -> Check:
    units = worst_of_each(ours, theirs, bound.scale, 2)
    return Check(units[:, 0], (units / result_k(bound, units.shape))[:, 0])
