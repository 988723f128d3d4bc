"""Moving bodies: one link in the plane, and points and frames that move in moving frames.

Sections 7.1, 7.3 and 7.6 of the text. Every function takes any leading batch shape.
"""

from urdfkin.motion.frames import MovingFrame, compose, compose_all
from urdfkin.motion.planar import (
    link_endpoint,
    link_endpoint_velocity,
    planar_rotation,
    planar_rotation_derivative,
)
from urdfkin.motion.points import (
    AccelerationParts,
    VelocityParts,
    point_acceleration,
    point_position,
    point_velocity,
)

__all__ = [
    "AccelerationParts",
    "MovingFrame",
    "VelocityParts",
    "compose",
    "compose_all",
    "link_endpoint",
    "link_endpoint_velocity",
    "planar_rotation",
    "planar_rotation_derivative",
    "point_acceleration",
    "point_position",
    "point_velocity",
]
