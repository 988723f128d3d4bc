"""An element of a URDF as the file has it, and its place: the tree that the parsed document is."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

#: From an element's offset on, a start tag: '<', then quoted values, in which '>' may stand, and all else.
START_TAG = re.compile(rb"""<(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
ATTRIBUTE = re.compile(rb"""([^\s=<>/"']++)\s*+=\s*+("[^"]*+"|'[^']*+')""")


@dataclass(slots=True, eq=False)
class Element:
    """One element: tag and attributes as written, children in order, the beginning of its text, its place.

    Attributes:
        above: The link, joint or other child of `<robot>` around it; None for those themselves.
    """

    tag: str
    attributes: dict[str, str]
    parent: Element | None
    line: int
    column: int
    offset: int
    above: Element | None = None
    children: Sequence[Element] = ()
    text: str = ""

    def append(self, child: Element) -> None:
        """Add a child; most elements have none, and a list for each would double their size."""
        if isinstance(self.children, list):
            self.children.append(child)
        else:
            self.children = [child]

    def all(self, tag: str) -> list[Element]:
        """Children of one tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """The first child of a tag, which is the one every reader takes."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[Element]:
        """This element and everything below it, in the order of the file, without recursion."""
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack += reversed(element.children)

    @property
    def holder(self) -> Element:
        """The link, joint or other child of `<robot>` this element belongs to; itself at the top."""
        return self.above or self

    @property
    def owner(self) -> str:
        """The tag a person would name: `joint` for everything inside a joint."""
        return self.holder.tag

    @property
    def label(self) -> str | None:
        """The name of the link or joint this element belongs to."""
        return self.holder.attributes.get("name") if self.parent is not None else None
