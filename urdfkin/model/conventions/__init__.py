"""Convert q, v, a and Jacobians between urdfkin's convention and the conventions of other programs.

A convention defines, for example, the order of the joints, the axes of the base's velocity, and the unit of
angles.
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
