"""Compute the motion of one frame along a trajectory, and compare the motion with Pinocchio.

Plots and viewers show this motion. The equations are in sections 7.5 to 7.7 of the textbook. If urdfkin and
Pinocchio disagree, the methods of `Robot` raise an error, but `frame_motion` returns the disagreement.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled.breakdown import AccelerationBreakdown, acceleration_breakdown
from urdfkin.errors import InputError, RangeError
from urdfkin.errors.validators import as_instance, as_str, safe_repr
from urdfkin.kinematics.inputs import as_rows
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.trajectory import Trajectory
from urdfkin.verify.bounds import broadcast_k, find_active_entries
from urdfkin.verify.call import Call
from urdfkin.verify.comparison import bound_ratios, worst_disagreements
from urdfkin.verify.quantities import (
    ACCELERATION,
    ACCELERATION_BREAKDOWN,
    JACOBIAN,
    PLACEMENT,
    VELOCITY,
    Quantity,
    validated_quantities,
)
from urdfkin.verify.singular_values import multiply_values
from urdfkin.verify.verifier import compute_oracle_results_with_bound


@dataclass(frozen=True, eq=False)
class MotionCheck:
    """Comparison of a quantity from urdfkin with the same quantity from Pinocchio, for each sample.

    Attributes:
        units: (n,) largest difference between urdfkin and Pinocchio in each sample, divided by eps * scale.
            Here eps is the machine epsilon. Each number of the quantity is a sum of terms. The scale is an
            upper bound on the sum of the terms' absolute values (`urdfkin.verify.bounds`).
        bound_ratio: (n,) `units` divided by `bound`. A value above 1 is a disagreement.
        bound: (n,) largest difference that rounding errors can cause in each sample, divided by eps * scale.
    """

    units: FloatArray
    bound_ratio: FloatArray
    bound: FloatArray


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """The motion of one frame in n samples, from `urdfkin.frame_motion`; six-vectors are [linear; angular].

    Attributes:
        frame: Name of the frame.
        reference: Reference frame of velocity, acceleration and Jacobian.
        placement: (n, 4, 4) T_world_frame.
        velocity: (n, 6) m/s, rad/s.
        acceleration: (n, 6) classical, m/s^2, rad/s^2.
        jacobian: (n, 6, nv).
        active_entries: (6, nv) booleans; False for an entry of the Jacobian that is 0 in every configuration.
        breakdown: Contributions of each joint to the acceleration, separately for each term.
        checks: Comparison with Pinocchio for each quantity, by name; empty if Pinocchio cannot check the
            robot. The sum of the breakdown is compared with Pinocchio's acceleration.
        unverified_reason: Reason why Pinocchio cannot check the robot, or None.

    >>> import urdfkin
    >>> urdfkin.frame_motion(urdfkin.load("planar_two_link"), ([[0, 0]], [[1, 0]], [[0, 0]]), "tip")
    <FrameMotion of tip: 1 samples, verified by Pinocchio>
    """

    frame: str
    reference: Reference
    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jacobian: FloatArray
    active_entries: NDArray[np.bool_]
    breakdown: AccelerationBreakdown
    checks: dict[str, MotionCheck]
    unverified_reason: str | None

    def __repr__(self) -> str:
        verdict = "verified by" if self.agrees else "DISAGREES with"
        words = f"{verdict} Pinocchio" if self.unverified_reason is None else "not verified"
        return f"<FrameMotion of {self.frame}: {len(self.placement)} samples, {words}>"

    @property
    def agrees(self) -> bool:
        """Whether all differences from Pinocchio are within the bounds; also True if nothing was compared.

        >>> import urdfkin
        >>> urdfkin.frame_motion(urdfkin.load("ur5"), [np.zeros((3, 6))] * 3, "tool0").agrees
        True
        """
        return all((check.bound_ratio <= 1.0).all() for check in self.checks.values())

    @property
    def singular_values(self) -> FloatArray:
        """(n, min(6, nv)) singular values of the Jacobian, largest first.

        The rows of the Jacobian have different units (metres and radians), so the values depend on the unit
        of length.

        >>> import urdfkin
        >>> urdfkin.frame_motion(urdfkin.load("ur5"), [np.zeros((3, 6))] * 3, "tool0").singular_values.shape
        (3, 6)
        """
        return self.singular_values_of(slice(0, 6))

    def singular_values_of(self, rows: slice) -> FloatArray:
        """Return the singular values (n, ...) of the given rows of the Jacobian, largest first.

        If `rows` is not a slice, the method raises InputError.

        >>> import urdfkin
        >>> tip = urdfkin.frame_motion(urdfkin.load("planar_two_link"), [[[0.3, 1.0]]] * 3, "tip")
        >>> tip.singular_values_of(slice(0, 2)).round(4).tolist()
        [[0.865, 0.1946]]
        """
        return np.asarray(np.linalg.svd(self.jacobian[:, as_rows(rows)], compute_uv=False), dtype=np.float64)

    def manipulability(self, rows: slice = slice(0, 6)) -> FloatArray:
        """Return Yoshikawa's manipulability, the product of the singular values of the Jacobian J.

        The product equals sqrt(det J J^T). If J has more rows than columns, det J J^T is 0, and the product
        is sqrt(det J^T J) instead. Columns that are 0 for every q are left out, as in
        `Robot.singular_values`.

        Args:
            rows: The rows of the Jacobian to use.

        Returns:
            (n,) one value for each sample.

        Raises:
            InputError: `rows` is not a slice.

        >>> import urdfkin
        >>> tip = urdfkin.frame_motion(urdfkin.load("planar_two_link"), [[[0.3, 1.0]]] * 3, "tip")
        >>> tip.manipulability(slice(0, 2)).round(4).tolist()  # 0.5 * 0.4 * sin(1)
        [0.1683]
        """
        part = self.jacobian[:, as_rows(rows)]
        moving = self.active_entries[rows].any(axis=0)
        if not moving.any():
            return np.zeros(len(part))
        values = np.linalg.svd(part[:, :, moving], compute_uv=False)
        return multiply_values(np.asarray(values, dtype=np.float64))


def frame_motion(
    robot: Robot,
    motion: Trajectory | Sequence[ConfigurationLike],
    frame: str,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
) -> FrameMotion:
    """Compute the motion of a frame along a trajectory, and compare every sample with Pinocchio.

    A disagreement does not raise an error; the attributes `agrees` and `checks` of the result report it.

    Args:
        robot: The robot.
        motion: A trajectory, for example from `urdfkin.read_trajectory`, or the arrays q (n, nq), v (n, nv)
            and a (n, nv) in rad, m and s.
        frame: Name of a link or joint.
        reference: Reference frame of velocity, acceleration and Jacobian.

    Raises:
        InputError: an array is missing, has a wrong length, or contains a number that is not finite.
        UnknownNameError: the frame or reference does not exist.
        RangeError: a result or a bound leaves the range of doubles.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> q, v, a = [[0.0, 0.0], [0.1, 0.0]], [[1.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]
    >>> tip = urdfkin.frame_motion(arm, (q, v, a), "tip")
    >>> tip.velocity[0].tolist(), tip.agrees
    ([0.0, 0.9, 0.0, 0.0, 0.0, 1.0], True)
    """
    as_instance(robot, Robot, "robot", "call urdfkin.load")
    base = motion.base if isinstance(motion, Trajectory) else None
    # An array without axes is an instance of Iterable.
    if not isinstance(motion, Trajectory | Iterable) or getattr(motion, "ndim", 1) == 0:
        raise InputError("motion must be a trajectory, or q, v and a", found=safe_repr(motion))
    given = (motion.q, motion.v, motion.a) if isinstance(motion, Trajectory) else tuple(motion)
    if len(given) != len("qva"):
        raise InputError("motion must be a trajectory, or q, v and a", found=f"{len(given)} arrays")
    call = Call(robot.tree, robot.plan, as_str(frame, "frame"), reference, base, given)
    inputs, reference, state = (call.q, *call.rates), call.reference, call.state
    ours = {
        row: call.run_and_locate_error(row.compute_results, call.plan, inputs, reference, base=state)
        for row in validated_quantities()
    }
    breakdown = call.run_and_locate_error(
        acceleration_breakdown, robot.tree, call.links[0], *inputs, reference, state
    )
    checked = {**ours, ACCELERATION_BREAKDOWN: breakdown.total[:, np.newaxis]}
    at_origin = base is None or not base.placement[..., :3, 3].any()
    reason = robot.verifier.find_refusal(call.base)
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
        find_active_entries(call.plan, reference, root_at_origin=at_origin)[0],
        breakdown,
        {} if reason else {row.name: _check(row, robot, call, results) for row, results in checked.items()},
        reason,
    )


def _check(row: Quantity, robot: Robot, call: Call, ours: FloatArray) -> MotionCheck:
    theirs, bound = compute_oracle_results_with_bound(
        row, robot.verifier.oracle(call.base), call.select(slice(0, call.n)), ours
    )
    is_finite = np.isfinite(theirs) & np.isfinite(np.broadcast_to(bound.scale, ours.shape))
    if not is_finite.all():
        raise RangeError(
            f"the {row.name} of {call.frames[0]} leaves the range of double precision",
            where=f"sample [{int(np.argwhere(~is_finite)[0, 0])}]",
            remedy="give smaller numbers",
        )
    units = worst_disagreements(ours, theirs, bound.scale, 2)
    k = np.broadcast_to(broadcast_k(bound, units.shape), units.shape)
    return MotionCheck(units[:, 0], bound_ratios(units, k)[:, 0], k[:, 0])
