"""Frame names with a prefix, `link:` or `joint:`, which makes an ambiguous name unique."""

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
        """Return the frame name of a link or joint, given its own name."""
        return cls(f"{cls.prefix}{own}")

    @property
    def own(self) -> str:
        """The link's or joint's own name, without the prefix."""
        return self[len(self.prefix) :]


class LinkFrame(FrameName):
    """`link:NAME`: the frame of a link."""

    __slots__ = ()
    prefix = "link:"


class JointFrame(FrameName):
    """`joint:NAME`: the frame of a joint, which is the frame of its child link."""

    __slots__ = ()
    prefix = "joint:"
