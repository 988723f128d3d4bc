"""Rotations of rigid bodies and the rates of their representations.

Section 7.2 of the text, equations 7.11 to 7.57. Every function takes any leading batch shape.
"""

from urdfkin.rotation.aligning import axis_aligning
from urdfkin.rotation.axis_angle import (
    axis_angle_of,
    circular_velocity,
    exp_rotation,
    log_rotation,
    rotation_about,
    rotation_about_derivative,
    split_along,
)
from urdfkin.rotation.euler import SEQUENCES, euler_of, rotation_from_euler, rotation_from_rpy, rpy_of
from urdfkin.rotation.quaternion import conjugate, multiply, quaternion_of, rotation_of
from urdfkin.rotation.skew import rotate_skew, skew, unskew

__all__ = [
    "SEQUENCES",
    "axis_aligning",
    "axis_angle_of",
    "circular_velocity",
    "conjugate",
    "euler_of",
    "exp_rotation",
    "log_rotation",
    "multiply",
    "quaternion_of",
    "rotate_skew",
    "rotation_about",
    "rotation_about_derivative",
    "rotation_from_euler",
    "rotation_from_rpy",
    "rotation_of",
    "rpy_of",
    "skew",
    "split_along",
    "unskew",
]
