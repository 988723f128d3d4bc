"""One frame in one configuration after the other, as fast as Python can ask: for control loops and solvers.

The walk is that of `Robot`, with the configuration in every lane. The kernels are bound to a program and to
scratch memory of their own, so that a call hands over nothing but its arrays. Where another thread is at
work in them, a call goes the robot's way, with the same result.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.recursion.compiling import NoKernelError
from urdfkin.recursion.plan import IntArray, Plan
from urdfkin.recursion.task import Task
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray
from urdfkin.verification.bounds import Quantity

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_empty = np.empty
#: Numba takes a masked array for a plain one, once it has seen a plain one.
_ARRAY = np.ndarray
_NO_TASK = np.zeros(0, dtype=np.int64)
_Kernel = Callable[..., int]
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
        "_acceleration", "_acceleration_task", "_jacobian", "_jacobian_task", "_kept", "_placement",
        "_placement_task", "_plan", "_robot", "_shape", "_velocity", "_velocity_task", "frame", "reference",
    )  # fmt: skip

    def __init__(self, robot: Robot, frame: str, reference: Reference, plan: Plan) -> None:
        self.frame, self.reference = frame, reference
        self._robot, self._plan = robot, plan
        self._shape = (6, plan.nv)
        self._kept: list[object] = []
        # Compiled, or read from disk, when they are first called.
        self._placement: _Kernel = partial(self._first, Quantity.PLACEMENT)
        self._velocity: _Kernel = partial(self._first, Quantity.VELOCITY)
        self._jacobian: _Kernel = partial(self._first, Quantity.JACOBIAN)
        self._acceleration: _Kernel = partial(self._first, Quantity.ACCELERATION)
        self._placement_task = self._velocity_task = self._jacobian_task = self._acceleration_task = _NO_TASK

    def __reduce__(self) -> tuple[Callable[..., PreparedFrame], tuple[str, Reference]]:
        # It holds addresses of this process: a copy prepares itself anew.
        return self._robot.prepare, (self.frame, self.reference)

    # Where a kernel does not take what it is given, the robot's way says what is wrong, or does it all the
    # same. The kernels count what they hand out themselves, for the ledger.

    def placement(self, q: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(4, 4) T_world_frame: eq. 7.77."""
        pose = _empty((4, 4)) if out is None else out
        try:
            if type(q) is _ARRAY and self._placement(self._placement_task, q, pose) == 1:
                return pose
        except _NOT_TAKEN:
            pass
        return self._robot.placement(q, self.frame, out=out, verify=False, threads=1)

    def velocity(self, q: ArrayLike, v: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(6,) [linear; angular] m/s, rad/s: eq. 7.127, 7.128."""
        six = _empty(6) if out is None else out
        try:
            plain = type(q) is type(v) is _ARRAY
            if plain and self._velocity(self._velocity_task, q, v, v, six) == 1:
                return six
        except _NOT_TAKEN:
            pass
        return self._robot.velocity(q, v, self.frame, self.reference, out=out, verify=False, threads=1)

    def jacobian(self, q: ArrayLike, out: FloatArray | None = None) -> FloatArray:
        """(6, nv): eq. 7.85."""
        J = _empty(self._shape) if out is None else out
        try:
            if type(q) is _ARRAY and self._jacobian(self._jacobian_task, q, J) == 1:
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
            if plain and self._acceleration(self._acceleration_task, q, v, a, six) == 1:
                return six
        except _NOT_TAKEN:
            pass
        return self._robot.acceleration(q, v, a, self.frame, self.reference, out=out, verify=False, threads=1)

    def _first(self, quantity: Quantity, _: IntArray, *arrays: object) -> int:
        """Make what computes a quantity, and compute."""
        # Quaternions are brought to norm 1 first, and what may overflow is looked at: the robot's business.
        if self._robot.tree.floating_joints or self._plan.is_large:
            return 0
        from urdfkin.recursion.single import single  # noqa: PLC0415  compiles

        made = single(quantity, self._plan, self.reference)
        self._kept.append(made.kept)
        self._robot.ledger.account(quantity).counters.append((made.task, Task.COUNT))
        setattr(self, f"_{quantity}_task", made.task)
        setattr(self, f"_{quantity}", made.kernel)
        return int(made.kernel(made.task, *arrays))
