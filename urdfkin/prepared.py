"""One frame in one configuration after the other, as fast as Python can ask: for control loops and solvers.

The walk is that of `Robot`, one lane wide. The kernels are bound to a plan and to scratch memory of their
own, so that a call hands over nothing but its arrays. They keep the interpreter's lock: for a microsecond
it is not worth releasing, and so the scratch memory needs no other protection.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.recursion.compiling import NoKernelError
from urdfkin.recursion.plan import Packed, Plan
from urdfkin.recursion.scratch import scratch
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Quantity

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_empty = np.empty
#: Numba takes a masked array for a plain one, once it has seen a plain one.
_ARRAY = np.ndarray
#: What the kernels count, in the order of `Packed.COUNTS`.
_COUNTED = Quantity.PLACEMENT, Quantity.VELOCITY, Quantity.ACCELERATION, Quantity.JACOBIAN
#: What Numba raises for arguments that are no arrays of the kernel's kind; an empty list has no type at all.
_NOT_TAKEN = (TypeError, ValueError, OverflowError, NoKernelError)


class PreparedFrame:
    """One frame of a robot in one reference; make one with `Robot.prepare`.

    Results are those of `Robot` with `verify=False`, to the last bit, and the ledger counts them as not
    checked. Contiguous float64 arrays are taken as they are; anything else goes the robot's way, with the
    same result or the same error.

    Attributes:
        frame: The frame's name.
        reference: For velocities, Jacobians and accelerations.

    >>> import urdfkin
    >>> robot = urdfkin.load("panda")
    >>> fast, q = robot.prepare("panda_hand"), robot.neutral()
    >>> J = np.empty((6, robot.nv))
    >>> fast.jacobian(q, out=J) is J
    True
    >>> bool((J == robot.jacobian(q, "panda_hand")).all())
    True
    """

    __slots__ = (
        "_jacobian", "_motion", "_packed", "_placement", "_plain", "_plan", "_robot", "_scratch", "_shape",
        "frame", "reference",
    )  # fmt: skip

    def __init__(self, robot: Robot, frame: str, reference: Reference, plan: Plan) -> None:
        self.frame, self.reference = frame, reference
        self._robot, self._plan = robot, plan
        self._scratch = scratch(plan)
        self._packed = np.array([*plan.packed, self._scratch.ctypes.data, int(reference), *(4 * [0])])
        self._shape = (6, plan.nv)
        for place, quantity in enumerate(_COUNTED, Packed.COUNTS):
            robot.ledger.account(quantity).counters.append((self._packed, place))
        # Quaternions are brought to norm 1 first, and what may overflow is looked at: the robot's business.
        self._plain = not robot.tree.floating_joints and not plan.is_large
        # Compiled, or read from disk, when they are first called.
        self._placement: Callable[..., int] = self._first_placement
        self._jacobian: Callable[..., int] = self._first_jacobian
        self._motion: Callable[..., int] = self._first_motion

    def __reduce__(self) -> tuple[Callable[..., PreparedFrame], tuple[str, Reference]]:
        # It holds addresses of this process: a copy prepares itself anew.
        return self._robot.prepare, (self.frame, self.reference)

    # Where a kernel does not take what it is given, the robot's way says what is wrong, or does it all the
    # same. The kernels count what they hand out themselves, for the ledger.

    def placement(self, q: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(4, 4) T_world_frame: eq. 7.77."""
        pose = _empty((4, 4)) if out is None else out
        try:
            if type(q) is _ARRAY and self._placement(self._packed, q, pose) == 1:
                return pose
        except _NOT_TAKEN:
            pass
        return self._robot.placement(q, self.frame, out=out, verify=False, threads=1)

    def velocity(self, q: ArrayLike, v: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(6,) [linear; angular] m/s, rad/s: eq. 7.127, 7.128."""
        six = _empty(6) if out is None else out
        try:
            if type(q) is type(v) is _ARRAY and self._motion(1, self._packed, q, v, v, six) == 1:
                return six
        except _NOT_TAKEN:
            pass
        return self._robot.velocity(q, v, self.frame, self.reference, out=out, verify=False, threads=1)

    def jacobian(self, q: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(6, nv): eq. 7.85."""
        J = _empty(self._shape) if out is None else out
        try:
            if type(q) is _ARRAY and self._jacobian(self._packed, q, J) == 1:
                return J
        except _NOT_TAKEN:
            pass
        return self._robot.jacobian(q, self.frame, self.reference, out=out, verify=False, threads=1)

    def acceleration(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, out: FloatArray | None = None
    ) -> FloatArray:
        """(6,) [linear; angular] m/s^2, rad/s^2, classical: eq. 7.129, 7.130."""
        six = _empty(6) if out is None else out
        try:
            plain = type(q) is type(v) is type(a) is _ARRAY
            if plain and self._motion(2, self._packed, q, v, a, six) == 1:
                return six
        except _NOT_TAKEN:
            pass
        return self._robot.acceleration(q, v, a, self.frame, self.reference, out=out, verify=False, threads=1)

    def _first_placement(self, *arguments: object) -> int:
        from urdfkin.recursion.motion_kernel import placement  # noqa: PLC0415

        self._placement = placement.compiled if self._plain else _refused
        return self._placement(*arguments)

    def _first_jacobian(self, *arguments: object) -> int:
        from urdfkin.recursion.jacobian_kernel import jacobian  # noqa: PLC0415

        self._jacobian = jacobian.compiled if self._plain else _refused
        return self._jacobian(*arguments)

    def _first_motion(self, *arguments: object) -> int:
        from urdfkin.recursion.local_kernel import local_motion  # noqa: PLC0415
        from urdfkin.recursion.motion_kernel import motion  # noqa: PLC0415

        kernel = local_motion if self.reference is Reference.LOCAL else motion
        self._motion = kernel.compiled if self._plain else _refused
        return self._motion(*arguments)


def _refused(*_: object) -> int:
    return 0
