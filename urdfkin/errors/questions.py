"""Where a message leads whoever asks why: headings of docs/questions.md, which `urdfkin explain` prints."""

from __future__ import annotations

from enum import Enum


class Question(Enum):
    """A question by its heading's anchor; as text, the command that answers it.

    >>> print(Question.MIMIC_JOINTS)
    `urdfkin explain mimic-joints` says more
    """

    REFERENCE_FRAMES = "reference-frames"
    TWO_ACCELERATIONS = "two-accelerations"
    JOINT_ORDER = "joint-order"
    CONTINUOUS_JOINTS = "continuous-joints"
    MIMIC_JOINTS = "mimic-joints"
    PACKAGES_AND_MESHES = "packages-and-meshes"
    URDF_TO_DH = "urdf-to-dh"
    WHICH_DH_CONVENTION = "which-dh-convention"
    DH_AND_URDF_DISAGREE = "dh-and-urdf-disagree"
    UNKNOWN_FRAMES = "unknown-frames"
    ROW_ORDER = "row-order"
    FIXED_JOINTS = "fixed-joints"
    WRONG_PINOCCHIO = "the-wrong-pinocchio"
    AXES = "axes-that-are-not-unit-vectors"
    XACRO = "xacro-without-ros"
    GRAVITY = "gravity-in-an-acceleration"
    FLOATING_BASES = "floating-bases"

    def __str__(self) -> str:
        return f"`urdfkin explain {self.value}` says more"
