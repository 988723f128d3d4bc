"""How large a file, and what it is made of, may be before it is refused unread.

Time and memory grow with the file; where something could grow faster (a name is compared with other names, a
number is converted), it has a limit of its own. No real robot comes near any of them.
"""

from __future__ import annotations

from dataclasses import dataclass

#: urdfdom's XML parser, and with it Pinocchio, refuses deeper nesting: tinyxml2 counts to 500, with the
#: document and the level that it refuses.
ORACLE_DEPTH = 498


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of one check.

    Attributes:
        bytes: Size of the file.
        depth: How deep elements may be nested; urdfdom's parser refuses more.
        elements: How many elements there may be.
        attributes: How many attributes one element may have.
        name: Characters of the name of an element, an attribute, a link or a joint.
        number: Characters of one number.
        markup: Bytes of one tag, comment or instruction, give or take a tenth; libxml2 has the same limit.
    """

    bytes: int = 100_000_000
    depth: int = ORACLE_DEPTH
    elements: int = 1_000_000
    attributes: int = 200
    name: int = 10_000
    number: int = 2_000
    markup: int = 10_000_000


DEFAULT_LIMITS = Limits()
