"""A robot with methods that take and return numbers in the convention of another program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.errors import InputError
from urdfkin.errors.escape import log_line
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.conventions.conversion import Conversion
from urdfkin.model.tree import FloatArray

if TYPE_CHECKING:
    from collections.abc import Callable

    from urdfkin.verify.certificate import Certificate


class ConventionRobot:
    """A robot in the convention of a target program, from `robot.with_convention("mujoco")`.

    Each method has the name and the arguments of a method of `Robot`. The target program's order applies
    to q, v and a, to the columns of Jacobians, and to the rows of six-vectors. The target program's units
    apply to q, v and a, and to the columns of Jacobians: J v is in m/s and rad/s. Pinocchio checks each
    result before urdfkin converts the result. An array `out` receives the unconverted result.

    Attributes:
        robot: The robot.
        conversion: Names and conversions of the convention, from `robot.convention(...)`.

    >>> import urdfkin
    >>> robot = urdfkin.load("a1", root_joint="floating").with_convention("drake")
    >>> q, v = robot.neutral(), [0.0] * 5 + [1.0] + [0.0] * 12
    >>> robot.velocity(q, v, "trunk").tolist()  # angular first
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    """

    def __init__(self, robot: Any, conversion: Conversion) -> None:
        self.robot, self.conversion = robot, conversion

    def __repr__(self) -> str:
        name = self.conversion.convention.name
        return log_line(f"<Robot {self.robot.name} in the convention {name}: nq {self.nq}, nv {self.nv}>")

    @property
    def nq(self) -> int:
        """Number of elements of q in the target program."""
        return self.conversion.nq

    @property
    def nv(self) -> int:
        """Number of elements of v, and of a, in the target program."""
        return self.conversion.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints in the target program, in the target program's order."""
        return self.conversion.joint_names

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the elements of the vector q in the target program."""
        return self.conversion.coordinate_names

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """Names of the elements of the vectors v and a in the target program."""
        return self.conversion.velocity_names

    def neutral(self) -> FloatArray:
        """Return the zero configuration of the URDF, converted to the target program's q."""
        return self.conversion.to(self.robot.neutral())

    def sample(self, n: int, seed: int = 0) -> FloatArray:
        """Return the random configurations (n, nq) of `Robot.sample`, converted to the target program's q."""
        return self.conversion.to(self.robot.sample(n, seed))

    def certificate(self) -> Certificate:
        """Return the certificate of the robot's results."""
        result: Certificate = self.robot.certificate()
        return result

    def placement(self, q: ConfigurationLike, frame: Any = None, **options: Any) -> FloatArray:
        """Return T_world_frame (..., 4, 4); see `Robot.placement`."""
        return self._call(self.robot.placement, (q,), frame, **options)[1]

    def relative_placement(
        self, q: ConfigurationLike, frame: Any, relative_to: Any, **options: Any
    ) -> FloatArray:
        """Return the pose (..., 4, 4) of `frame` relative to a frame; see `Robot.relative_placement`."""
        return self._call(self.robot.relative_placement, (q,), frame, relative_to, **options)[1]

    def velocity(
        self, q: ConfigurationLike, v: ConfigurationLike, frame: Any = None, *arguments: Any, **options: Any
    ) -> FloatArray:
        """Return a frame's velocity (..., 6) with the target program's row order; see `Robot.velocity`."""
        return self.conversion.reorder_six_vector(
            self._call(self.robot.velocity, (q, v), frame, *arguments, **options)[1]
        )

    def acceleration(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: Any = None,
        *arguments: Any,
        **options: Any,
    ) -> FloatArray:
        """Return the target program's classical acceleration (..., 6); see `Robot.acceleration`."""
        return self.conversion.reorder_six_vector(
            self._call(self.robot.acceleration, (q, v, a), frame, *arguments, **options)[1]
        )

    def jacobian(
        self, q: ConfigurationLike, frame: Any = None, *arguments: Any, **options: Any
    ) -> FloatArray:
        """Return the target program's Jacobian (..., 6, nv) of a frame; see `Robot.jacobian`."""
        ours, J = self._call(self.robot.jacobian, (q,), frame, *arguments, **options)
        return self.conversion.jacobian(ours[0], J)

    def jacobian_rate(
        self, q: ConfigurationLike, v: ConfigurationLike, frame: Any = None, *arguments: Any, **options: Any
    ) -> FloatArray:
        """Return the time derivative of the target program's Jacobian; see `Robot.jacobian_rate`."""
        ours, rate = self._call(self.robot.jacobian_rate, (q, v), frame, *arguments, **options)
        # `out` already contains `rate`.
        J = self.robot.jacobian(ours[0], frame, *arguments, **{**options, "out": None})
        return self.conversion.jacobian_rate(ours[0], ours[1], J, rate)

    def hessian(self, q: ConfigurationLike, frame: Any = None, *arguments: Any, **options: Any) -> FloatArray:
        """Return the derivatives (..., 6, nv, nv) of the target program's Jacobian; see `Robot.hessian`."""
        ours, H = self._call(self.robot.hessian, (q,), frame, *arguments, **options)
        J = self.robot.jacobian(ours[0], frame, *arguments, **{**options, "out": None})
        return self.conversion.hessian(ours[0], J, H)

    def analytical_jacobian(
        self, q: ConfigurationLike, frame: Any = None, *arguments: Any, **options: Any
    ) -> FloatArray:
        """Return the target program's analytical Jacobian; see `Robot.analytical_jacobian`."""
        ours, J = self._call(self.robot.analytical_jacobian, (q,), frame, *arguments, **options)
        return self.conversion.columns(ours[0], J)

    def imu(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: Any = None,
        **options: Any,
    ) -> FloatArray:
        """Return an IMU's readings (..., 6), [accelerometer; gyroscope]; see `Robot.imu`."""
        return self._call(self.robot.imu, (q, v, a), frame, **options)[1]

    def _call(
        self, method: Callable[..., FloatArray], inputs: tuple[Any, ...], *arguments: Any, **options: Any
    ) -> tuple[tuple[FloatArray, ...], FloatArray]:
        """Return the inputs in urdfkin's convention, and the method's result for these inputs.

        The returned inputs have all batch axes of the result. The result may also have an axis of frames.
        """
        for letter, x in zip("qva", inputs, strict=False):
            if x is None:
                raise InputError(f"{letter} must be real numbers", found="None")
        converted = self.conversion.from_(*inputs)
        ours: tuple[FloatArray, ...] = converted if isinstance(converted, tuple) else (converted,)
        result = method(*ours, *arguments, **options)
        base = options.get("base")
        shapes = [*(x.shape[:-1] for x in ours), *([] if base is None else [base.batch_shape])]
        shape = np.broadcast_shapes(*shapes)
        return tuple(np.broadcast_to(x, (*shape, x.shape[-1])) for x in ours), result
