"""Moving bodies: one link in the plane, points and frames in moving frames, and what a joint does.

Sections 7.1, 7.3 and 7.6 of the text, and of 7.4 and 7.5 what needs no robot. Every
function takes any leading batch shape.
"""

from urdfkin.kinematics.bodies.frames import MovingFrame, compose, compose_all
from urdfkin.kinematics.bodies.joints import (
    interorigin_vector,
    interorigin_velocity,
    jacobian_column,
    joint_angular_velocity,
)
from urdfkin.kinematics.bodies.planar import (
    link_endpoint,
    link_endpoint_velocity,
    planar_rotation,
    planar_rotation_derivative,
)
from urdfkin.kinematics.bodies.points import (
    AccelerationParts,
    VelocityParts,
    point_acceleration,
    point_position,
    point_velocity,
)
from urdfkin.kinematics.bodies.referral import frame_velocity, tool_velocity
from urdfkin.kinematics.bodies.representation import (
    analytical_jacobian,
    orientation_of,
    pose_rates,
    representation_inverse,
    representation_matrix,
    velocity_jacobian,
    velocity_of_pose_rates,
)

__all__ = [
    "AccelerationParts",
    "MovingFrame",
    "VelocityParts",
    "analytical_jacobian",
    "compose",
    "compose_all",
    "frame_velocity",
    "interorigin_vector",
    "interorigin_velocity",
    "jacobian_column",
    "joint_angular_velocity",
    "link_endpoint",
    "link_endpoint_velocity",
    "orientation_of",
    "planar_rotation",
    "planar_rotation_derivative",
    "point_acceleration",
    "point_position",
    "point_velocity",
    "pose_rates",
    "representation_inverse",
    "representation_matrix",
    "tool_velocity",
    "velocity_jacobian",
    "velocity_of_pose_rates",
]
