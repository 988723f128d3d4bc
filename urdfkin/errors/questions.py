"""Where a message leads whoever asks why: headings of docs/questions.md, which `urdfkin explain` prints."""

from __future__ import annotations

from enum import Enum


class Question(Enum):
    """A question by its heading's anchor; as text, the command that answers it.

    >>> print(Question.MIMIC_JOINTS)
    `urdfkin explain mimic-joints` says more
    """

    CONTINUOUS_JOINTS = "continuous-joints"
    MIMIC_JOINTS = "mimic-joints"
    REFERENCE_FRAMES = "reference-frames"
    WHICH_DH_CONVENTION = "which-dh-convention"
    WRONG_PINOCCHIO = "the-wrong-pinocchio"
    XACRO = "xacro-without-ros"

    def __str__(self) -> str:
        return f"`urdfkin explain {self.value}` says more"
