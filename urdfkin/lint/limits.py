"""Limits on the size of a file and its parts; a larger file is refused.

Time and memory grow linearly with the file. A part with a faster growth has its own limit: names are compared
with each other, and long numbers are slow to convert. No known robot is near a limit.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Deepest nesting that Pinocchio accepts. Its XML parser, tinyxml2, has a limit of 500, in which it counts
#: the document and the refused level.
ORACLE_DEPTH = 498


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of one check.

    Attributes:
        bytes: Size of the file.
        depth: Levels of nested elements; urdfdom's parser refuses more.
        elements: Number of elements.
        attributes: Number of attributes of one element.
        name: Characters in the name of an element, an attribute, a link or a joint.
        number: Characters in one number.
        markup: Bytes of one tag, comment or processing instruction, within 10 %; libxml2 has the same limit.
    """

    bytes: int = 100_000_000
    depth: int = ORACLE_DEPTH
    elements: int = 1_000_000
    attributes: int = 200
    name: int = 10_000
    number: int = 2_000
    markup: int = 10_000_000


DEFAULT_LIMITS = Limits()
