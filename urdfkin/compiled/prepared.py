"""Fast results of one frame for one configuration, for control loops and solvers.

Each fast function has scratch memory for one thread. If two threads call the function at the same time, the
methods of `Robot` compute the result of the second call.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import numpy as np

from urdfkin.compiled import preload
from urdfkin.compiled.kernel_cache import compile_lock
from urdfkin.compiled.plan import CompiledTree, KernelArgs
from urdfkin.model.configuration import warn_of_degrees
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.system.locks import import_lock

#: A function f(q, out), f(q, v, out) or f(q, v, a, out). The function returns None for unsupported arguments.
FastFunction = Callable[..., FloatArray | None]


class _PreparedRobot(Protocol):
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
    """Fast computation of one frame's quantities, such as the Jacobian.

    `Robot.prepare` creates the object. Results are exactly the same numbers as those of `Robot`. With
    `verify=True`, urdfkin compares each result with Pinocchio's result and uses the tolerance of `Robot`.
    With `verify=False`, `Robot.certificate` reports the results as unchecked. Contiguous float64 arrays are
    used directly. For other arguments, `Robot` computes the result or raises the error. Several threads may
    share one object, also on free-threaded Python.

    Attributes:
        frame: The frame's name.
        reference: The reference frame of velocities, Jacobians, Hessians and accelerations.
        verify: Whether each result is checked.

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
        "_acceleration",
        "_hessian",
        "_jacobian",
        "_placement",
        "_plan",
        "_robot",
        "_velocity",
        "always_load",
        "frame",
        "reference",
        "verify",
    )  # fmt: skip

    def __init__(
        self,
        robot: _PreparedRobot,
        frame: str,
        reference: Reference,
        plan: CompiledTree,
        *,
        verify: bool = False,
    ) -> None:
        self.frame, self.reference, self.verify = frame, reference, verify
        self._robot, self._plan = robot, plan
        #: Whether the first call loads or compiles machine code; `Robot.prepare` sets True.
        self.always_load = False
        # `_compute_first` replaces the attribute of its quantity by the fast function.
        self._placement: FastFunction = partial(self._compute_first, "placement")
        self._velocity: FastFunction = partial(self._compute_first, "velocity")
        self._jacobian: FastFunction = partial(self._compute_first, "jacobian")
        self._hessian: FastFunction = partial(self._compute_first, "hessian")
        self._acceleration: FastFunction = partial(self._compute_first, "acceleration")

    def __reduce__(self) -> tuple[Callable[..., PreparedFrame], tuple[str, Reference]]:
        # The fast functions contain memory addresses that are valid only in this process. Unpickling
        # therefore makes a new object with `Robot.prepare`.
        return partial(self._robot.prepare, verify=self.verify), (self.frame, self.reference)

    def placement(self, q: ConfigurationLike, out: FloatArray | None = None) -> FloatArray:
        """Return T_world_frame (4, 4) by eq. 7.77.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.placement([0.0, 0.0])[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        if (pose := self._placement(q, out)) is not None:
            return pose
        return self._robot.placement(q, self.frame, out=out, verify=self.verify, threads=1)

    def velocity(
        self, q: ConfigurationLike, v: ConfigurationLike, out: FloatArray | None = None
    ) -> FloatArray:
        """Return the velocity (6,), [linear; angular], m/s and rad/s, by eq. 7.127 and 7.128.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.velocity([0.0, 0.0], [1.0, 0.0]).tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        if (six := self._velocity(q, v, out)) is not None:
            return six
        return self._robot.velocity(q, v, self.frame, self.reference, out=out, verify=self.verify, threads=1)

    def jacobian(self, q: ConfigurationLike, out: FloatArray | None = None) -> FloatArray:
        """Return the Jacobian (6, nv) by eq. 7.85.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.jacobian([0.0, 0.0])[1].tolist()
        [0.9, 0.4]
        """
        if (J := self._jacobian(q, out)) is not None:
            return J
        return self._robot.jacobian(q, self.frame, self.reference, out=out, verify=self.verify, threads=1)

    def hessian(self, q: ConfigurationLike, out: FloatArray | None = None) -> FloatArray:
        """Return the Hessian (6, nv, nv).

        The Hessian is the derivative of the Jacobian with respect to each joint's motion.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.hessian([0.0, 0.0])[0].tolist()
        [[-0.9, -0.4], [-0.4, -0.4]]
        """
        if (H := self._hessian(q, out)) is not None:
            return H
        return self._robot.hessian(q, self.frame, self.reference, out=out, verify=self.verify, threads=1)

    def acceleration(
        self, q: ConfigurationLike, v: ConfigurationLike, a: ConfigurationLike, out: FloatArray | None = None
    ) -> FloatArray:
        """Return the classical acceleration (6,), m/s^2 and rad/s^2, by eq. 7.129 and 7.130.

        The six numbers are [linear; angular].

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.acceleration([0.0, 0.0], [1.0, 0.0], [0.0, 0.0])[0].item()
        -0.9
        """
        if (six := self._acceleration(q, v, a, out)) is not None:
            return six
        return self._robot.acceleration(
            q, v, a, self.frame, self.reference, out=out, verify=self.verify, threads=1
        )

    def _compute_first(self, quantity: str, q: ConfigurationLike, *others: object) -> FloatArray | None:
        """Create a fast function and compute the first result.

        Return None if `Robot` must compute the result.
        """
        # Only `Robot` normalises quaternions and checks for overflow.
        needs_robot = self._robot.tree.floating_joints or self._plan.may_overflow
        if needs_robot or not (isinstance(q, np.ndarray) and q.ndim == 1):
            return None
        if not self.always_load and not preload.should_load_single_evaluator(f"{quantity}s"):
            return None
        with compile_lock, import_lock:
            from urdfkin.compiled.machine.single import array_layout_is_known, make_single_evaluator

        if not array_layout_is_known():
            return None
        compute, args = make_single_evaluator(quantity, self._plan, self.reference)
        verifier = self._robot.verifier
        if self.verify:
            compute = verifier.make_checked_function(
                quantity, compute, self._plan, self.frame, self.reference
            )
        else:
            verifier.ledger.account(quantity).counters.append((args, KernelArgs.COUNT))
        setattr(self, f"_{quantity}", compute)
        if (result := compute(q, *others)) is not None and not self.verify:
            warn_of_degrees(self._robot.tree, q)  # Later calls skip this check.
        return result
