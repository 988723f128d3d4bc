"""Rotations of rigid bodies and the rates of their representations.

Section 7.2 of the text, equations 7.11 to 7.57. Every function takes any leading batch shape.
"""

from urdfkin.kinematics.rotation.aligning import axis_aligning
from urdfkin.kinematics.rotation.axis_angle import (
    angular_velocity_about,
    axis_angle_of,
    circular_velocity,
    exp_rotation,
    log_rotation,
    rotation_about,
    rotation_about_derivative,
    split_along,
)
from urdfkin.kinematics.rotation.euler import (
    SEQUENCES,
    euler_of,
    rotation_from_euler,
    rotation_from_rpy,
    rpy_of,
)
from urdfkin.kinematics.rotation.euler_rates import (
    angular_velocity_from_euler_rates,
    euler_condition,
    euler_rate_inverse,
    euler_rate_matrix,
    euler_rates,
    singularity_distance,
)
from urdfkin.kinematics.rotation.integrate import integrate_orientation
from urdfkin.kinematics.rotation.nearest import nearest_rotation
from urdfkin.kinematics.rotation.quaternion import conjugate, multiply, quaternion_of, rotation_of
from urdfkin.kinematics.rotation.quaternion_rates import (
    angular_velocity_from_quaternion_rates,
    quaternion_rate_matrix,
    quaternion_rates,
)
from urdfkin.kinematics.rotation.rates import (
    add_angular_velocities,
    angular_velocity_of,
    rotation_rate,
    turning_vector_rate,
)
from urdfkin.kinematics.rotation.skew import rotate_skew, skew, unskew

__all__ = [
    "SEQUENCES",
    "add_angular_velocities",
    "angular_velocity_about",
    "angular_velocity_from_euler_rates",
    "angular_velocity_from_quaternion_rates",
    "angular_velocity_of",
    "axis_aligning",
    "axis_angle_of",
    "circular_velocity",
    "conjugate",
    "euler_condition",
    "euler_of",
    "euler_rate_inverse",
    "euler_rate_matrix",
    "euler_rates",
    "exp_rotation",
    "integrate_orientation",
    "log_rotation",
    "multiply",
    "nearest_rotation",
    "quaternion_of",
    "quaternion_rate_matrix",
    "quaternion_rates",
    "rotate_skew",
    "rotation_about",
    "rotation_about_derivative",
    "rotation_from_euler",
    "rotation_from_rpy",
    "rotation_of",
    "rotation_rate",
    "rpy_of",
    "singularity_distance",
    "skew",
    "split_along",
    "turning_vector_rate",
    "unskew",
]
