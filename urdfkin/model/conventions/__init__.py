"""Conventions of other programs: orders of joints and rows, quaternions, base velocities, units and zeros."""

from urdfkin.model.conventions.convention import BUILT_IN, Convention, JointRule, as_toml, find_convention
from urdfkin.model.conventions.conversion import Conversion, Reordering, find_reordering

__all__ = [
    "BUILT_IN",
    "Convention",
    "Conversion",
    "JointRule",
    "Reordering",
    "as_toml",
    "find_convention",
    "find_reordering",
]
