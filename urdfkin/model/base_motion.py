"""The motion of the base: the initial conditions that start the recursion (end of section 7.7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdfkin.errors import InputError, Question
from urdfkin.kinematics.rotation.matrix import nearest_rotation
from urdfkin.model.tree import FloatArray, frozen


@dataclass(frozen=True, slots=True, eq=False)
class BaseMotion:
    """How the robot's root link moves in the text's frame -1, which then is the world.

    Every field may carry leading batch axes, which broadcast against the configuration's. The fields keep
    the numbers as they were given: Pinocchio is asked about those.

    Attributes:
        placement: (..., 4, 4) T_world_base. Its rotation may be one to nine digits; what is meant is the
            rotation nearest to it (`urdfkin.kinematics.rotation.nearest_rotation`).
        velocity: (..., 6) [linear; angular] of the base's origin, world axes, m/s and rad/s.
        acceleration: (..., 6) [linear; angular], classical, world axes, m/s^2 and rad/s^2.

    Raises:
        InputError: a wrong shape, a number that is not finite, or a placement that is no rigid motion.
    """

    placement: FloatArray = field(default_factory=lambda: np.eye(4))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(6))
    acceleration: FloatArray = field(default_factory=lambda: np.zeros(6))
    _rotation: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, shape in (("placement", (4, 4)), ("velocity", (6,)), ("acceleration", (6,))):
            array = frozen(getattr(self, name))
            if array.shape[-len(shape) :] != shape or not np.isfinite(array).all():
                raise InputError(
                    f"the base's {name} is an array (..., {', '.join(map(str, shape))}) of finite numbers",
                    found=f"shape {array.shape}" if array.shape[-len(shape) :] != shape else "nan or inf",
                    question=None if name == "placement" else Question.ROW_ORDER,
                )
            object.__setattr__(self, name, array)
        try:
            _ = self.batch_shape
        except ValueError:
            shapes = f"{self.placement.shape}, {self.velocity.shape}, {self.acceleration.shape}"
            raise InputError("the batch shapes of the base's fields do not fit", found=shapes) from None
        if (self.placement[..., 3, :] != [0.0, 0.0, 0.0, 1.0]).any():
            raise InputError("the last row of the base's placement is 0 0 0 1")
        R = nearest_rotation(self.placement[..., :3, :3], "the rotation of the base's placement")
        object.__setattr__(self, "_rotation", frozen(R))

    def __reduce__(self) -> tuple[type[BaseMotion], tuple[Any, ...]]:
        return type(self), (self.placement, self.velocity, self.acceleration)

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """The leading axes of the three fields together."""
        return np.broadcast_shapes(
            self.placement.shape[:-2], self.velocity.shape[:-1], self.acceleration.shape[:-1]
        )

    def state(self, batch_shape: tuple[int, ...]) -> FloatArray:
        """(n, 24) rows [R, p, w, v, alpha, a] for the kernels, one row if the base is the same for all."""
        shape = batch_shape if self.batch_shape else ()
        parts = (
            self._rotation.reshape(*self.placement.shape[:-2], 9),
            self.placement[..., :3, 3],
            self.velocity[..., 3:],
            self.velocity[..., :3],
            self.acceleration[..., 3:],
            self.acceleration[..., :3],
        )
        rows = np.concatenate([np.broadcast_to(part, (*shape, part.shape[-1])) for part in parts], axis=-1)
        return np.ascontiguousarray(rows.reshape(-1, 24))


#: A base that stands still at the world's origin.
STILL = BaseMotion()
STILL_STATE = frozen(STILL.state(()))


def against_gravity(state: FloatArray, gravity: FloatArray) -> FloatArray:
    """The state (1 or n, 24) of the same base in a world that is accelerated by -gravity (3,).

    No accelerometer can tell it from one that stands still where there is gravity.
    """
    lifted = state.copy()
    lifted[:, -3:] -= gravity
    return lifted
