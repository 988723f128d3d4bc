"""All that can be told of one frame's motion, with Pinocchio's opinion of every number: for plots and views.

Sections 7.5 to 7.7. Unlike the methods of `Robot`, nothing is raised on a disagreement: it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled.breakdown import AccelerationBreakdown, acceleration_breakdown
from urdfkin.errors.validators import as_str
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.bounds import movable, result_k
from urdfkin.verify.call import Call
from urdfkin.verify.comparison import worst_of_each
from urdfkin.verify.quantities import ACCELERATION, JACOBIAN, PLACEMENT, VELOCITY, Quantity, validated
from urdfkin.verify.verifier import held_against


@dataclass(frozen=True, eq=False)
class Check:
    """A quantity held against Pinocchio's, sample by sample.

    Attributes:
        units: (n,) the largest disagreement of each sample, eps * scale.
        share: (n,) the same as a share of its bound; above 1 is a failure.
        bound: (n,) what rounding can do at most, eps * scale.
    """

    units: FloatArray
    share: FloatArray
    bound: FloatArray


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
        movable: (6, nv) which of the Jacobian's numbers can be anything but 0, whatever q is.
        parts: The acceleration by joint and kind.
        checks: What Pinocchio says of each quantity, by its name; empty where it cannot check the robot.
        not_verified: Why it cannot; None if it can.
    """

    frame: str
    reference: Reference
    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray
    movable: NDArray[np.bool_]
    parts: AccelerationBreakdown
    checks: dict[str, Check]
    not_verified: str | None

    @property
    def agrees(self) -> bool:
        """Whether no sample lies outside its bound."""
        return all((check.share <= 1.0).all() for check in self.checks.values())

    @property
    def singular_values(self) -> FloatArray:
        """(n, min(6, nv)) of the Jacobian, largest first; metres and radians mixed as SI units mix them."""
        return self.singular_values_of(slice(0, 6))

    def singular_values_of(self, rows: slice) -> FloatArray:
        """(n, ...) of some of the Jacobian's rows."""
        return np.asarray(np.linalg.svd(self.jacobian[:, rows], compute_uv=False), dtype=np.float64)

    def manipulability(self, rows: slice = slice(0, 6)) -> FloatArray:
        """(n,) the product of the singular values of the Jacobian's `rows`: Yoshikawa's sqrt(det J J^T).

        With fewer rates than rows J J^T has no volume; the product over the rates is what J^T J has. Columns
        that are 0 for every q are left out, as `Robot.singular_values` does.
        """
        part = self.jacobian[:, rows]
        moving = self.movable[rows].any(axis=0)
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
    call = Call(robot.tree, robot.plan, as_str(frame, "frame"), reference, None, (q, v, a))
    inputs, reference = (call.q, *call.rates), call.reference
    ours = {row: call.compute(row.ours, call.plan, inputs, reference) for row in validated()}
    reason = robot.verifier.cannot()
    placement, velocity, acceleration, jacobian = (
        ours[row][:, 0] for row in (PLACEMENT, VELOCITY, ACCELERATION, JACOBIAN)
    )
    return FrameMotion(
        frame,
        reference,
        placement,
        velocity,
        acceleration,
        jacobian,
        movable(call.plan, reference)[0],
        call.compute(acceleration_breakdown, robot.tree, call.links[0], *inputs, reference),
        {} if reason else {row.name: _check(row, robot, call, results) for row, results in ours.items()},
        reason,
    )


def _check(row: Quantity, robot: Robot, call: Call, ours: FloatArray) -> Check:
    theirs, bound = held_against(row, robot.verifier.oracle(), call.part(slice(0, call.n)), ours)
    units = worst_of_each(ours, theirs, bound.scale, 2)
    k = np.broadcast_to(result_k(bound, units.shape), units.shape)
    return Check(units[:, 0], (units / k)[:, 0], k[:, 0])
