"""Reference frames: the axes and the point of a velocity, Jacobian or acceleration."""

from __future__ import annotations

from enum import IntEnum

from urdfkin.errors import Question, UnknownNameError
from urdfkin.errors.validators import safe_repr


class Reference(IntEnum):
    """The three reference frames, with Pinocchio's names.

    * `LOCAL`: the frame's own origin, in the frame's axes.
    * `WORLD`: the point of the moving body that is now at the world's origin, in the world's axes.
    * `LOCAL_WORLD_ALIGNED`: the frame's own origin, in the world's axes. The textbook uses this one (7.85).

    Every `reference` argument accepts a member or its name, in upper or lower case:

    >>> Reference.of("local_world_aligned") is Reference.LOCAL_WORLD_ALIGNED
    True
    """

    LOCAL = 0
    WORLD = 1
    LOCAL_WORLD_ALIGNED = 2

    @classmethod
    def of(cls, value: Reference | str) -> Reference:
        """Return the member for a member or a name; raises UnknownNameError for an unknown name."""
        if isinstance(value, Reference):
            return value
        name = value if isinstance(value, str) else safe_repr(value)
        if name.upper() not in cls.__members__:
            known = [member.lower() for member in cls.__members__]
            raise UnknownNameError("reference", name, known, question=Question.REFERENCE_FRAMES)
        return cls[name.upper()]
