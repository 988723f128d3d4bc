"""A point in a moving frame: its position, its velocity and its acceleration, part by part.

Sections 7.3.1 and 7.6, equations 7.58, 7.59 and 7.123 to 7.125. `p_1`, `v_1`, `a_1` are what an observer who
moves with frame 1 measures, expressed in frame 1; results are what one in frame 0 sees, expressed in frame 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.arrays import chapter as eq
from urdfkin.kinematics.bodies.frames import MovingFrame, turned
from urdfkin.kinematics.inputs import FloatArray, vectors

_STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class VelocityParts:
    """The velocity of a point, m/s in frame 0, as 7.124 names its terms.

    Attributes:
        rotation: w x p, from the turning of the frame.
        relative: R v_1, from the point's motion in the frame.
        origin: d-dot, from the motion of the frame's origin.
    """

    rotation: FloatArray
    relative: FloatArray
    origin: FloatArray

    @property
    def total(self) -> FloatArray:
        """The sum of the parts."""
        return self.rotation + self.relative + self.origin


@dataclass(frozen=True, slots=True, eq=False)
class AccelerationParts:
    """The acceleration of a point, m/s^2 in frame 0, as 7.125 names its terms.

    Attributes:
        transverse: alpha x p.
        centripetal: w x (w x p), towards the axis of rotation.
        coriolis: 2 w x R v_1, perpendicular to both.
        relative: R a_1, from the point's acceleration in the frame.
        origin: d-dot-dot, the acceleration of the frame's origin.
    """

    transverse: FloatArray
    centripetal: FloatArray
    coriolis: FloatArray
    relative: FloatArray
    origin: FloatArray

    @property
    def total(self) -> FloatArray:
        """The sum of the parts."""
        return self.transverse + self.centripetal + self.coriolis + self.relative + self.origin


def point_position(frame: MovingFrame, p_1: ArrayLike) -> FloatArray:
    """p_0 = d_01 + R p_1 (7.58).

    Args:
        frame: Frame 1 in frame 0.
        p_1: (..., 3) the point in frame 1, metres.

    Returns:
        (..., 3) the point in frame 0, metres.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    p_0: FloatArray = eq.point_position(frame.d_0_1, frame.R_0_1, vectors(p_1, "p_1"))
    return p_0


def point_velocity(frame: MovingFrame, p_1: ArrayLike, v_1: ArrayLike = _STILL) -> VelocityParts:
    """p-dot_0 = w x R p_1 + R v_1 + d-dot_01 (7.124; 7.59 when the point is fixed in frame 1).

    Args:
        frame: Frame 1 in frame 0.
        p_1: (..., 3) the point in frame 1, metres.
        v_1: (..., 3) its velocity in frame 1, m/s; at rest unless given.

    Returns:
        The parts; `.total` is the velocity, (..., 3) m/s in frame 0.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    p_0 = turned(frame.R_0_1, vectors(p_1, "p_1"))
    rotation = eq.tangential(frame.w_0_1, p_0)
    relative = turned(frame.R_0_1, vectors(v_1, "v_1"))
    return VelocityParts(*np.broadcast_arrays(rotation, relative, frame.v_0_1))


def point_acceleration(
    frame: MovingFrame, p_1: ArrayLike, v_1: ArrayLike = _STILL, a_1: ArrayLike = _STILL
) -> AccelerationParts:
    """p-dot-dot_0 = alpha x p + w x (w x p) + 2 w x R v_1 + R a_1 + d-dot-dot (7.125; 7.123 at rest).

    Args:
        frame: Frame 1 in frame 0.
        p_1: (..., 3) the point in frame 1, metres.
        v_1: (..., 3) its velocity in frame 1, m/s; at rest unless given.
        a_1: (..., 3) its acceleration in frame 1, m/s^2; none unless given.

    Returns:
        The parts; `.total` is the acceleration, (..., 3) m/s^2 in frame 0.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    p_0 = turned(frame.R_0_1, vectors(p_1, "p_1"))
    v_0 = turned(frame.R_0_1, vectors(v_1, "v_1"))
    a_0 = turned(frame.R_0_1, vectors(a_1, "a_1"))
    transverse = eq.transverse(frame.alpha_0_1, p_0)
    centripetal, coriolis = eq.centripetal(frame.w_0_1, p_0), eq.coriolis(frame.w_0_1, v_0)
    return AccelerationParts(*np.broadcast_arrays(transverse, centripetal, coriolis, a_0, frame.a_0_1))
