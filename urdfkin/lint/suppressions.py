"""Comments of a URDF that silence findings, each by its code and with a reason.

    <!-- urdfkin: ignore[URDF601] the vendor's own digits -->

Behind something on its line a comment speaks for that line; otherwise for the element that follows it, with
everything in it; before the root element for the whole file.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from urdfkin.urdf.element import Element

#: What a comment for urdfkin begins with, after blanks.
MARK = "urdfkin:"


@dataclass(slots=True)
class Comment:
    """A comment for urdfkin: what it says and where it stands.

    Attributes:
        text: Between its marks.
        line: From 1.
        column: From 1.
        behind: Whether something stands before it on its line.
        element: The element that follows it; None where none does.
    """

    text: str
    line: int
    column: int
    behind: bool
    element: Element | None = None


@dataclass(slots=True, eq=False)
class Silence:
    """What a comment silences.

    Attributes:
        comment: The comment.
        codes: Which codes.
        reason: Why.
        used: Those that there were findings of.
    """

    comment: Comment
    codes: tuple[str, ...]
    reason: str
    used: set[str] = field(default_factory=set)


#: Code -> what silences it at some place; the first comment that does.
Codes = dict[str, Silence]


@dataclass(slots=True)
class Silences:
    """The comments of a file, found by the places that they speak for: the file, a line, an element's id."""

    everywhere: Codes = field(default_factory=dict)
    lines: dict[int, Codes] = field(default_factory=dict)
    elements: dict[int, Codes] = field(default_factory=dict)
    all: list[Silence] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.all)

    def add(self, silence: Silence) -> None:
        """One more."""
        self.all.append(silence)
        place = self._place(silence.comment)
        for code in silence.codes:
            place.setdefault(code, silence)

    def _place(self, comment: Comment) -> Codes:
        if comment.behind:
            return self.lines.setdefault(comment.line, {})
        if comment.element is None:
            return {}
        if comment.element.parent is None:
            return self.everywhere
        return self.elements.setdefault(id(comment.element), {})

    def reason(self, code: str, line: int, at: Element | None) -> str | None:
        """Why a finding is silenced, by the nearest comment that speaks for its place; None: it is not.

        Args:
            code: The finding's.
            line: Its line.
            at: The element it is about.
        """
        silence = self.lines.get(line, {}).get(code)
        while silence is None and at is not None:
            silence = self.elements.get(id(at), {}).get(code)
            at = at.parent
        silence = silence or self.everywhere.get(code)
        if silence is None:
            return None
        silence.used.add(code)
        return silence.reason
