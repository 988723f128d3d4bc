"""Comments in a URDF that silence findings. A comment names the codes and gives a reason.

    <!-- urdfkin: ignore[URDF601] the vendor's own digits -->

| Position of the comment | It applies to |
|---|---|
| after other text on the same line | this line |
| on its own line, before an element | this element and its content |
| before the root element | the whole file |
"""

from __future__ import annotations

from dataclasses import dataclass, field

from urdfkin.urdf.element import Element

#: The beginning of a comment for urdfkin, after spaces.
MARK = "urdfkin:"


@dataclass(slots=True)
class Comment:
    """A comment for urdfkin.

    Attributes:
        text: The text between `<!--` and `-->`.
        line: The line, from 1.
        column: The column, from 1.
        behind: Whether other text precedes it on its line.
        element: The next element, or None.
    """

    text: str
    line: int
    column: int
    behind: bool
    element: Element | None = None


@dataclass(slots=True, eq=False)
class Silence:
    """The codes that a comment silences.

    Attributes:
        comment: The comment.
        codes: The codes.
        reason: The reason.
        used: The codes that silenced at least one finding.
    """

    comment: Comment
    codes: tuple[str, ...]
    reason: str
    used: set[str] = field(default_factory=set)


#: Code -> the first comment that silences it.
Codes = dict[str, Silence]


@dataclass(slots=True)
class Silences:
    """The silencing comments of a file.

    Attributes:
        everywhere: Comments for the whole file.
        lines: Comments for a line, by line number.
        elements: Comments for an element, by the element's `id()`.
        all: All comments.
    """

    everywhere: Codes = field(default_factory=dict)
    lines: dict[int, Codes] = field(default_factory=dict)
    elements: dict[int, Codes] = field(default_factory=dict)
    all: list[Silence] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.all)

    def add(self, silence: Silence) -> None:
        """Add a comment."""
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
        """Return the reason of the nearest comment that silences a finding; None if there is none.

        Args:
            code: The code of the finding.
            line: The line of the finding.
            at: The element of the finding.
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
