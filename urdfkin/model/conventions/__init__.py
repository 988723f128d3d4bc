"""Convert q, v, a and Jacobians between conventions of urdfkin and other programs.

A convention defines, for example, joint order, base velocity axes, and angle unit.
"""

from urdfkin.model.conventions.convention import (
    BUILT_IN_NAMES,
    Convention,
    JointRule,
    as_toml,
    find_convention,
)
from urdfkin.model.conventions.conversion import Conversion, Reordering, find_reordering

__all__ = [
    "BUILT_IN_NAMES",
    "Convention",
    "Conversion",
    "JointRule",
    "Reordering",
    "as_toml",
    "find_convention",
    "find_reordering",
]
