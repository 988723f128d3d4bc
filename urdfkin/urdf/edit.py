"""Attributes and elements put into a URDF where they belong, as edits of its text.

An element's place is the one that the parser gave it (`Element.offset`), in the bytes that follow a byte
order mark. What is new stands as the text around it does: between its quotes, with its line ends and blanks.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from urdfkin.system.edits import Edit
from urdfkin.urdf.element import ATTRIBUTE, START_TAG, Element
from urdfkin.urdf.writer import attribute

_INDENTATION = re.compile(rb"((?:\r\n|\r|\n)?[ \t]*+)\Z")


def with_attributes(data: bytes, at: Element, values: Mapping[str, str]) -> Iterator[Edit]:
    """Edits that give an element's attributes these values; those that it has not come behind the others."""
    name_end = at.offset + 1 + len(at.tag.encode())
    tag = START_TAG.match(data, at.offset)
    end = tag.end() if tag else name_end
    known = {match[1].decode(): match.span(2) for match in ATTRIBUTE.finditer(data, name_end, end)}
    added = ""
    for name, value in values.items():
        if name not in known:
            added += f' {name}="{attribute(value)}"'
        else:
            start, end = known[name]
            yield Edit(start + 1, end - 1, attribute(value))
    if added:
        last = max((end for _, end in known.values()), default=name_end)
        yield Edit(last, last, added)


def before(data: bytes, at: Element, element: str) -> Edit:
    """The edit that puts an element, as text, before another, on a line of its own if that has one."""
    indentation = _INDENTATION.search(data[max(0, at.offset - 1000) : at.offset])
    return Edit(at.offset, at.offset, element + (indentation[1].decode() if indentation else ""))
