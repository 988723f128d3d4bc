"""Conventions of other programs: joint order, quaternions, row order, base velocities, units and zeros."""

from urdfkin.conventions.convention import BUILT_IN, Convention, JointRule, as_toml, find_convention
from urdfkin.conventions.conversion import Conversion, Reordering, reordering
from urdfkin.conventions.robot import ConventionRobot

__all__ = [
    "BUILT_IN",
    "Convention",
    "ConventionRobot",
    "Conversion",
    "JointRule",
    "Reordering",
    "as_toml",
    "find_convention",
    "reordering",
]
