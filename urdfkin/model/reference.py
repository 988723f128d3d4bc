"""In which axes, and for which point, a velocity, Jacobian or acceleration is given."""

from __future__ import annotations

from enum import IntEnum

from urdfkin.errors import Question, UnknownNameError
from urdfkin.errors.validators import safe_repr


class Reference(IntEnum):
    """Pinocchio's three reference frames, by its names.

    * `LOCAL`: the frame's own origin, in the frame's axes.
    * `WORLD`: the point of the moving body that is at the world's origin now, in the world's axes.
    * `LOCAL_WORLD_ALIGNED`: the frame's own origin, in the world's axes: the text's choice (7.85).

    Wherever a reference is taken, a member or its name in either case will do:

    >>> Reference.of("local_world_aligned") is Reference.LOCAL_WORLD_ALIGNED
    True
    """

    LOCAL = 0
    WORLD = 1
    LOCAL_WORLD_ALIGNED = 2

    @classmethod
    def of(cls, value: Reference | str) -> Reference:
        """The member that a user means; raises UnknownNameError for another name."""
        if isinstance(value, Reference):
            return value
        name = value if isinstance(value, str) else safe_repr(value)
        if name.upper() not in cls.__members__:
            known = [member.lower() for member in cls.__members__]
            raise UnknownNameError("reference", name, known, question=Question.REFERENCE_FRAMES)
        return cls[name.upper()]
