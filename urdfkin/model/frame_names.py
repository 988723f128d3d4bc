"""Frame names with the prefix `link:` or `joint:`.

The prefix is needed if a link and a joint have equal names.
"""

from __future__ import annotations

from typing import ClassVar, Self


class FrameName(str):
    """`link:NAME` or `joint:NAME`: the link or joint NAME, even if another frame is named `link:NAME`.

    Reports and messages print a `FrameName` like an ordinary name. A plain `str` with the same text has a
    different meaning: `KinematicTree.frame_link` first looks for a link or joint whose own name is exactly
    that text.

    >>> LinkFrame.of("hand"), LinkFrame.of("hand").own
    ('link:hand', 'hand')
    """

    __slots__ = ()
    prefix: ClassVar[str]

    @classmethod
    def of(cls, own: str) -> Self:
        """Return the frame name, with the prefix, of the link or joint with the name `own`."""
        return cls(f"{cls.prefix}{own}")

    @property
    def own(self) -> str:
        """The link's or joint's own name, without the prefix."""
        return self[len(self.prefix) :]


class LinkFrame(FrameName):
    """The name `link:NAME` of a link's frame."""

    __slots__ = ()
    prefix = "link:"


class JointFrame(FrameName):
    """The name `joint:NAME` of a joint's frame, which is the frame of the joint's child link."""

    __slots__ = ()
    prefix = "joint:"
