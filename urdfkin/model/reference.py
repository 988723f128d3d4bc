"""Reference frames: the axes and the point of a velocity, Jacobian or acceleration."""

from __future__ import annotations

from enum import IntEnum

from urdfkin.errors import QuestionsSection, UnknownNameError
from urdfkin.errors.validators import safe_repr


class Reference(IntEnum):
    """The three reference frames, with Pinocchio's names.

    The compiled kernels use the members' numbers.

    * `LOCAL`: the frame's own origin, in the frame's axes.
    * `WORLD`: the body point that is now at the world's origin, in the world's axes.
    * `LOCAL_WORLD_ALIGNED`: the frame's own origin, in the world's axes, as in the textbook (7.85).

    Every `reference` argument accepts a member or its name, in upper or lower case:

    >>> Reference.of("local_world_aligned") is Reference.LOCAL_WORLD_ALIGNED
    True
    """

    #: Whether the results are in the frame's axes instead of the world's axes.
    own_axes: bool
    #: Whether the linear part is the motion of the body point at the world's origin.
    at_world: bool

    def __new__(cls, number: int, own_axes: bool, at_world: bool) -> Reference:
        member = int.__new__(cls, number)
        member._value_, member.own_axes, member.at_world = number, own_axes, at_world
        return member

    LOCAL = 0, True, False
    WORLD = 1, False, True
    LOCAL_WORLD_ALIGNED = 2, False, False

    @classmethod
    def of(cls, value: Reference | str) -> Reference:
        """Return the reference frame with the given name.

        The name may be in upper or lower case. A member is returned unchanged. An unknown name raises
        UnknownNameError.

        >>> Reference.of("local").name
        'LOCAL'
        """
        if isinstance(value, Reference):
            return value
        name = value if isinstance(value, str) else safe_repr(value)
        if name.upper() not in cls.__members__:
            known = [member.lower() for member in cls.__members__]
            raise UnknownNameError("reference", name, known, question=QuestionsSection.REFERENCE_FRAMES)
        return cls[name.upper()]
