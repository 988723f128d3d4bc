"""What the chapter computes beyond one frame's four quantities: all frames at once, J-dot, J, and parts.

Sections 7.4.3, 7.5 and 7.7. `Robot` is a `Manipulator`; every method checks its result as `Robot` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.call import Call
from urdfkin.demands import real_number, word
from urdfkin.errors import RangeError, RepresentationSingularityError
from urdfkin.motion.representation import QUATERNION, analytical_jacobian
from urdfkin.recursion import evaluate
from urdfkin.recursion.base import BaseMotion
from urdfkin.recursion.batch import in_parts
from urdfkin.recursion.breakdown import (
    KINDS,
    AccelerationBreakdown,
    acceleration_breakdown,
    moving_joints,
)
from urdfkin.reference import Reference
from urdfkin.rotation.euler_rates import NEAREST
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Quantity, nearest_singularity
from urdfkin.verification.choosing import Verify

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED


class Manipulator:
    """The part of `Robot` that stands in this file."""

    def placements(
        self,
        q: ArrayLike,
        frames: Sequence[str] | None = None,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., frames, 4, 4) T_world_frame of several frames in one pass (7.77).

        Args:
            q: (..., nq) rad, m.
            frames: Names of links or joints; None means every link, in the order of `link_names`.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into; after an error it may hold
                anything.
            verify: As in `Robot.placement`.
            threads: As in `Robot.placement`.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes something else.
        """
        robot = _robot(self)
        call = Call(robot, frames, _ALIGNED, base, q)
        to = call.flat(out, 4, 4, every=True)
        result = call.compute(
            evaluate.placements, call.plan, call.q, base=call.state, out=to, threads=threads
        )
        handed_out = call.every(result, out)
        call.verify(Quantity.PLACEMENT, handed_out, verify)
        return handed_out

    def velocities(
        self,
        q: ArrayLike,
        v: ArrayLike,
        frames: Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., frames, 6) [linear; angular] of several frames in one pass (7.75 to 7.79 by 7.127, 7.128).

        Arguments and errors as `placements`.
        """
        robot = _robot(self)
        call = Call(robot, frames, reference, base, q, v)
        to = call.flat(out, 6, every=True)
        walk = call.plan, call.q, *call.rates, call.reference
        result = call.compute(evaluate.velocities, *walk, base=call.state, out=to, threads=threads)
        handed_out = call.every(result, out)
        call.verify(Quantity.VELOCITY, handed_out, verify)
        return handed_out

    def jacobians(
        self,
        q: ArrayLike,
        frames: Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., frames, 6, nv) velocity Jacobians of several frames in one pass (7.85).

        Arguments and errors as `placements`.
        """
        robot = _robot(self)
        call = Call(robot, frames, reference, base, q)
        to = call.flat(out, 6, robot.nv, every=True)
        result = call.compute(
            evaluate.jacobians, call.plan, call.q, call.reference, base=call.state, out=to, threads=threads
        )
        handed_out = call.every(result, out)
        call.verify(Quantity.JACOBIAN, handed_out, verify)
        return handed_out

    def accelerations(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        frames: Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., frames, 6) classical accelerations of several frames in one pass (7.129, 7.130).

        Arguments and errors as `placements`.
        """
        robot = _robot(self)
        call = Call(robot, frames, reference, base, q, v, a)
        to = call.flat(out, 6, every=True)
        result = call.compute(
            evaluate.accelerations,
            call.plan,
            call.q,
            *call.rates,
            call.reference,
            base=call.state,
            out=to,
            threads=threads,
        )
        handed_out = call.every(result, out)
        call.verify(Quantity.ACCELERATION, handed_out, verify)
        return handed_out

    def jacobian_rate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6, nv) J-dot, the time derivative of `jacobian` along the motion (7.126).

        In LOCAL_WORLD_ALIGNED, J a + J-dot v is the acceleration of the text and of `acceleration`. In LOCAL
        and WORLD it is the *spatial* acceleration, which differs by w x vel: there the point, or the axes,
        that the rows speak of move themselves. On a moving base, what the base does comes on top.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s.
            frame: A link's or joint's name.
            reference: For which point and in which axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: As in `Robot.placement`.
            threads: As in `Robot.placement`.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes something else.
        """
        robot = _robot(self)
        call = Call(robot, (frame,), reference, base, q, v)
        result = call.compute(
            evaluate.jacobian_rates,
            call.plan,
            call.q,
            *call.rates,
            call.reference,
            base=call.state,
            out=call.flat(out, 6, robot.nv),
            threads=threads,
        )
        handed_out = call.one(result, out)
        call.verify(Quantity.JACOBIAN_RATE, handed_out, verify)
        return handed_out

    def analytical_jacobian(
        self,
        q: ArrayLike,
        frame: str,
        representation: str = "ZYZ",
        *,
        nearest: float = NEAREST,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """The manipulator Jacobian J = C^-1 J_v (7.122): derivatives of position and orientation by q.

        It is checked against Pinocchio's rotation and Jacobian, with the rates of the orientation's numbers
        by a way of their own (`urdfkin.verification.line_of_nodes`). The bound grows as 1 / s^2, s being the
        sine or cosine of the middle angle: near the singularity that many digits are lost.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name.
            representation: Euler sequence by SciPy's name ("ZYZ" is the text's, "xyz" is rpy), or
                "quaternion".
            nearest: How near the representational singularity may be, radians.
            base: How the root link stands; None if at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: As in `Robot.placement`.
            threads: As in `Robot.placement`.

        Returns:
            (..., 6, nv), or (..., 7, nv) for a quaternion.

        Raises:
            RepresentationSingularityError: a sample is nearer to the singularity than `nearest`, or, when it
                is to be checked, than rounding can tell (some 1e-13 rad); the error says how near. A
                quaternion has none.
            UnknownNameError: no such frame or representation.
            InputError: as `placements`.
            VerificationError: Pinocchio computes something else.
        """
        robot = _robot(self)
        representation, nearest = word(representation, "representation"), real_number(nearest, "nearest")
        call = Call(robot, (frame,), _ALIGNED, base, q, representation=representation, nearest=nearest)
        if call.wanted(verify):
            nearest = max(nearest, nearest_singularity(call.plan))
        rows = 7 if representation == QUATERNION else 6
        to = call.flat(out, rows, robot.nv)
        J = np.empty((call.n, 1, rows, robot.nv)) if to is None else to
        walk = {"base": call.state, "threads": threads}
        Rs = call.compute(evaluate.placements, call.plan, call.q, **walk)[..., :3, :3]
        Js_v = call.compute(evaluate.jacobians, call.plan, call.q, out=J if rows == 6 else None, **walk)
        near: list[tuple[float, int]] = []

        def compute(part: slice) -> None:
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    J[part] = analytical_jacobian(representation, Rs[part], Js_v[part], nearest)
            except RepresentationSingularityError as error:
                near.append((error.distance, part.start + error.sample[0]))

        in_parts(compute, call.n, threads)
        if near:
            distance, k = min(near)
            raise RepresentationSingularityError(representation, distance, call.index(k))
        if not np.isfinite(J).all():
            raise RangeError("a result leaves the range of double precision", remedy="give smaller numbers")
        handed_out = call.one(J, out)
        call.verify(Quantity.ANALYTICAL_JACOBIAN, handed_out, verify)
        return handed_out

    def acceleration_breakdown(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> AccelerationBreakdown:
        """`acceleration`, as a sum over joints and kinds: transverse, centripetal, Coriolis, sliding.

        The sum is checked against Pinocchio's acceleration. Arguments and errors as `jacobian_rate`; `out` is
        for the terms, (..., joints, 4, 6).

        Returns:
            The parts, with the caller's batch shape in front.
        """
        robot = _robot(self)
        call = Call(robot, (frame,), reference, base, q, v, a)
        to = call.flat(out, len(moving_joints(robot.tree, call.links[0])), len(KINDS), 6)
        parts = call.compute(
            acceleration_breakdown,
            robot.tree,
            call.links[0],
            call.q,
            *call.rates,
            call.reference,
            call.state,
            out=None if to is None else to[:, 0],
            threads=threads,
        )
        breakdown = AccelerationBreakdown(parts.joints, call.every(parts.base), call.every(parts.terms, out))
        call.verify(Quantity.ACCELERATION_BREAKDOWN, breakdown.total, verify)
        return breakdown


def _robot(manipulator: Manipulator) -> Robot:
    # The only subclass is Robot, which lives below and cannot be imported here.
    return cast("Robot", manipulator)
