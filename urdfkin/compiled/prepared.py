"""One frame in one configuration after the other, as fast as Python can ask: for control loops and solvers.

The walk is that of `Robot`, with the configuration in every lane. The functions are bound to a program and to
scratch memory of their own, so that a call hands over nothing but its arrays. Where another thread is at
work in one, a call goes the robot's way, with the same result.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import numpy as np

from urdfkin.compiled.kernel_args import KernelArgs
from urdfkin.compiled.plan import CompiledTree
from urdfkin.model.configuration_like import Given
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.system.processes import importing

#: q, or q and v, or q, v and a, and where to write or None: the result. For what it does not take as it is it
#: returns None; the robot's way then does it all the same, or says what is wrong.
Fast = Callable[..., FloatArray | None]


class _Robot(Protocol):
    """Who is asked where a kernel does not take what it is given."""

    tree: Any
    verifier: Any

    @property
    def prepare(self) -> Callable[..., PreparedFrame]: ...
    @property
    def placement(self) -> Callable[..., FloatArray]: ...
    @property
    def velocity(self) -> Callable[..., FloatArray]: ...
    @property
    def jacobian(self) -> Callable[..., FloatArray]: ...
    @property
    def hessian(self) -> Callable[..., FloatArray]: ...
    @property
    def acceleration(self) -> Callable[..., FloatArray]: ...


class PreparedFrame:
    """One frame of a robot in one reference; make one with `Robot.prepare`.

    Results are those of `Robot` with `verify=False`, to the last bit, and the ledger counts them as not
    checked. Contiguous float64 arrays are taken as they are; anything else goes the robot's way, with the
    same result or the same error. Several threads may share one, on Python without its lock as well.

    Attributes:
        frame: The frame's name.
        reference: For velocities, Jacobians, Hessians and accelerations.

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
        "_acceleration", "_hessian", "_jacobian", "_placement", "_plan", "_robot", "_velocity", "frame",
        "reference",
    )  # fmt: skip

    def __init__(self, robot: _Robot, frame: str, reference: Reference, plan: CompiledTree) -> None:
        self.frame, self.reference = frame, reference
        self._robot, self._plan = robot, plan
        # Compiled, or read from disk, when they are first called.
        self._placement: Fast = partial(self._first, "placement")
        self._velocity: Fast = partial(self._first, "velocity")
        self._jacobian: Fast = partial(self._first, "jacobian")
        self._hessian: Fast = partial(self._first, "hessian")
        self._acceleration: Fast = partial(self._first, "acceleration")

    def __reduce__(self) -> tuple[Callable[..., PreparedFrame], tuple[str, Reference]]:
        # It holds addresses of this process: a copy prepares itself anew.
        return self._robot.prepare, (self.frame, self.reference)

    # The functions count what they hand out themselves, for the ledger.

    def placement(self, q: Given, out: FloatArray | None = None) -> FloatArray:
        """(4, 4) T_world_frame: eq. 7.77."""
        if (pose := self._placement(q, out)) is not None:
            return pose
        return self._robot.placement(q, self.frame, out=out, verify=False, threads=1)

    def velocity(self, q: Given, v: Given, out: FloatArray | None = None) -> FloatArray:
        """(6,) [linear; angular] m/s, rad/s: eq. 7.127, 7.128."""
        if (six := self._velocity(q, v, out)) is not None:
            return six
        return self._robot.velocity(q, v, self.frame, self.reference, out=out, verify=False, threads=1)

    def jacobian(self, q: Given, out: FloatArray | None = None) -> FloatArray:
        """(6, nv): eq. 7.85."""
        if (J := self._jacobian(q, out)) is not None:
            return J
        return self._robot.jacobian(q, self.frame, self.reference, out=out, verify=False, threads=1)

    def hessian(self, q: Given, out: FloatArray | None = None) -> FloatArray:
        """(6, nv, nv): the derivatives of `jacobian` by each rate."""
        if (H := self._hessian(q, out)) is not None:
            return H
        return self._robot.hessian(q, self.frame, self.reference, out=out, verify=False, threads=1)

    def acceleration(self, q: Given, v: Given, a: Given, out: FloatArray | None = None) -> FloatArray:
        """(6,) [linear; angular] m/s^2, rad/s^2, classical: eq. 7.129, 7.130."""
        if (six := self._acceleration(q, v, a, out)) is not None:
            return six
        return self._robot.acceleration(q, v, a, self.frame, self.reference, out=out, verify=False, threads=1)

    def _first(self, quantity: str, q: Given, *others: object) -> FloatArray | None:
        """Make what computes a quantity, and compute."""
        with importing:
            from urdfkin.compiled.single import arrays_are_known, single  # noqa: PLC0415  loads Numba

        # Quaternions are brought to norm 1 first, and what may overflow is looked at: the robot's business.
        robots = self._robot.tree.floating_joints or self._plan.is_large
        if robots or not (isinstance(q, np.ndarray) and q.ndim == 1 and arrays_are_known()):
            return None
        compute, task = single(quantity, self._plan, self.reference)
        self._robot.verifier.ledger.account(quantity).counters.append((task, KernelArgs.COUNT))
        setattr(self, f"_{quantity}", compute)
        return compute(q, *others)
