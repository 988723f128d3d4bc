"""Names of frames that say whether a link or a joint is meant, whatever else in the robot is called so."""

from __future__ import annotations

from typing import ClassVar, Self


class FrameName(str):
    """`link:NAME` or `joint:NAME`, meant as that even where something is itself called `link:NAME`.

    As text it is an ordinary name, for reports and messages; a plain `str` of the same text is looked for as
    it stands first (`KinematicTree.frame_link`).

    >>> LinkFrame.of("hand"), LinkFrame.of("hand").own
    ('link:hand', 'hand')
    """

    __slots__ = ()
    prefix: ClassVar[str]

    @classmethod
    def of(cls, own: str) -> Self:
        """The frame of the link, or joint, of that name."""
        return cls(f"{cls.prefix}{own}")

    @property
    def own(self) -> str:
        """The link's or joint's own name."""
        return self[len(self.prefix) :]


class LinkFrame(FrameName):
    """`link:NAME`: the frame of a link."""

    __slots__ = ()
    prefix = "link:"


class JointFrame(FrameName):
    """`joint:NAME`: the frame of a joint, which is its child link's."""

    __slots__ = ()
    prefix = "joint:"
