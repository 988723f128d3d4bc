"""`Element`: a node of a parsed URDF, with its position in the file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

#: A start tag, matched from an element's offset. A quoted value may contain '>'.
START_TAG = re.compile(rb"""<(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
ATTRIBUTE = re.compile(rb"""([^\s=<>/"']++)\s*+=\s*+("[^"]*+"|'[^']*+')""")


@dataclass(slots=True, eq=False)
class Element:
    """An element of a URDF.

    Attributes:
        tag: The tag as written.
        attributes: The attributes as written.
        parent: The parent element; None for the root.
        line: The line of the start tag, from 1.
        column: The column of the start tag.
        offset: The position of the start tag in bytes.
        above: The child of `<robot>` that contains this element; None for the children of `<robot>`.
        children: The child elements, in file order.
        text: The beginning of the element's text.
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
        """Add a child. An element without children has no list, which halves its size."""
        if isinstance(self.children, list):
            self.children.append(child)
        else:
            self.children = [child]

    def all(self, tag: str) -> list[Element]:
        """Return the children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child with a tag, or None. Every URDF reader uses the first."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[Element]:
        """Yield this element and all elements below it, in file order, without recursion."""
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack += reversed(element.children)

    @property
    def holder(self) -> Element:
        """The child of `<robot>` that contains this element, or the element itself."""
        return self.above or self

    @property
    def owner(self) -> str:
        """The tag of the holder: `joint` for every element inside a joint."""
        return self.holder.tag

    @property
    def label(self) -> str | None:
        """The name of the link or joint that contains this element."""
        return self.holder.attributes.get("name") if self.parent is not None else None
