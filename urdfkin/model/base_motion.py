"""The motion of the base, which is the initial condition of the forward recursion (end of section 7.7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdfkin.errors import InputError, QuestionsSection
from urdfkin.kinematics.rotation import nearest_rotation
from urdfkin.model.tree import FloatArray, freeze


@dataclass(frozen=True, slots=True, eq=False)
class BaseMotion:
    """Motion of the robot's root link relative to the world.

    In the textbook, the world frame has the number -1. Every field may have leading batch axes, which
    broadcast with the batch axes of the configuration. The fields store the given numbers unchanged, because
    a verification computes Pinocchio's input from these numbers.

    Attributes:
        placement: (..., 4, 4) T_world_base. The rotation matrix may be rounded to nine decimals. The results
            use the nearest exact rotation matrix (`urdfkin.kinematics.rotation.nearest_rotation`).
        velocity: (..., 6) velocity of the base's origin, [linear; angular], in world axes, m/s and rad/s.
        acceleration: (..., 6) classical acceleration, [linear; angular], in world axes, m/s^2 and rad/s^2.

    Raises:
        InputError: a field has a wrong shape or a non-finite number, or the placement is not a rigid motion.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> moving = urdfkin.BaseMotion(velocity=[0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    >>> arm.velocity([0.0, 0.0], [1.0, 0.0], "tip", base=moving).tolist()
    [0.1, 0.9, 0.0, 0.0, 0.0, 1.0]
    """

    placement: FloatArray = field(default_factory=lambda: np.eye(4))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(6))
    acceleration: FloatArray = field(default_factory=lambda: np.zeros(6))
    _rotation: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, shape in (("placement", (4, 4)), ("velocity", (6,)), ("acceleration", (6,))):
            array = freeze(getattr(self, name))
            if array.shape[-len(shape) :] != shape or not np.isfinite(array).all():
                raise InputError(
                    f"the base's {name} must be a finite array (..., {', '.join(map(str, shape))})",
                    found=f"shape {array.shape}" if array.shape[-len(shape) :] != shape else "nan or inf",
                    question=None if name == "placement" else QuestionsSection.ROW_ORDER,
                )
            object.__setattr__(self, name, array)
        try:
            _ = self.batch_shape
        except ValueError:
            shapes = f"{self.placement.shape}, {self.velocity.shape}, {self.acceleration.shape}"
            raise InputError(
                "the batch shapes of the base's placement, velocity and acceleration do not broadcast",
                found=shapes,
            ) from None
        if (self.placement[..., 3, :] != [0.0, 0.0, 0.0, 1.0]).any():
            raise InputError("the last row of the base's placement must be 0 0 0 1")
        R = nearest_rotation(self.placement[..., :3, :3], "the rotation of the base's placement")
        object.__setattr__(self, "_rotation", freeze(R))

    def __reduce__(self) -> tuple[type[BaseMotion], tuple[Any, ...]]:
        return type(self), (self.placement, self.velocity, self.acceleration)

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """The common batch shape of the three fields.

        >>> import numpy as np
        >>> BaseMotion(velocity=np.zeros((5, 6))).batch_shape
        (5,)
        """
        return np.broadcast_shapes(
            self.placement.shape[:-2], self.velocity.shape[:-1], self.acceleration.shape[:-1]
        )

    def state(self, batch_shape: tuple[int, ...]) -> FloatArray:
        """Return the motion as rows [R, p, w, v, alpha, a], which the kernels read.

        Returns:
            (n, 24) rows. If no field has batch axes, n is 1.

        >>> BaseMotion().state(()).shape
        (1, 24)
        """
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


#: A fixed base at the world's origin.
FIXED_BASE = BaseMotion()
FIXED_BASE_STATE = freeze(FIXED_BASE.state(()))


def subtract_gravity(state: FloatArray, gravity: FloatArray) -> FloatArray:
    """Subtract gravity from the base's linear acceleration.

    An accelerometer cannot distinguish gravity from an acceleration.

    Args:
        state: (n, 24) rows of `BaseMotion.state`.
        gravity: (3,) vector, m/s^2.
    """
    lifted = state.copy()
    lifted[:, -3:] -= gravity
    return lifted
