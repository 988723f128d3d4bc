"""Plain data for the elements, links and joints of a URDF, which `urdf.parser` reads. Size limits of a URDF.

If the parser cannot read a value of a link or joint, the value in the record is None. If the file omits a
value, the record contains the default of the specification.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

#: Pinocchio accepts at most this number of nested elements.
#: Pinocchio's XML parser, tinyxml2, refuses level 500 and counts the document itself as level 1.
ORACLE_DEPTH = 498


@dataclass(frozen=True, slots=True)
class Limits:
    """The size limits for a file and its parts.

    Attributes:
        bytes: Size of the file.
        depth: Number of levels of nested elements; urdfdom's parser refuses more.
        attributes: Number of attributes of one element.
        name: Number of characters in the name of an element, an attribute, a link or a joint.
        number: Number of characters of one number.
        markup: Number of bytes of one tag, comment or processing instruction, as in libxml2. urdfkin measures
            this size to within 10 %.
    """

    bytes: int = 100_000_000
    depth: int = ORACLE_DEPTH
    elements: int = 1_000_000
    attributes: int = 200
    name: int = 10_000
    number: int = 2_000
    markup: int = 10_000_000


DEFAULT_LIMITS = Limits()


#: This pattern matches a start tag at an element's offset. A quoted value may contain '>'.
START_TAG = re.compile(rb"""<(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
ATTRIBUTE = re.compile(rb"""([^\s=<>/"']++)\s*+=\s*+("[^"]*+"|'[^']*+')""")


@dataclass(slots=True, eq=False)
class Element:
    """An element of a URDF.

    Attributes:
        tag: The tag as written.
        attributes: The attributes as written.
        line: The line of the start tag, from 1.
        offset: The position of the start tag in bytes.
        above: The child of `<robot>` that contains this element; None for the children of `<robot>`.
        text: The first characters of the text between the element's tags.
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
        """Add a child. The list of children is created with the first child, which saves memory."""
        if isinstance(self.children, list):
            self.children.append(child)
        else:
            self.children = [child]

    def all(self, tag: str) -> list[Element]:
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child with a tag, or None. All URDF readers ignore later ones."""
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
        """The tag of the link or joint that contains the element; `joint` for an element inside a joint."""
        return self.holder.tag

    @property
    def label(self) -> str | None:
        return self.holder.attributes.get("name") if self.parent is not None else None


Vector = tuple[float, ...]

#: URDF defines these attributes of `<limit>` from version 1.2 on.
FURTHER_LIMITS = ("acceleration", "deceleration", "jerk")

#: Joint types with an axis.
AXIAL = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class LimitRecord:
    """A `<limit>`; None marks an attribute that is not written."""

    element: Element
    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    acceleration: float | None = None
    deceleration: float | None = None
    jerk: float | None = None


@dataclass(slots=True)
class MimicRecord:
    element: Element
    leader: str
    multiplier: float
    offset: float


@dataclass(slots=True)
class JointRecord:
    element: Element
    name: str
    kind: str | None = None
    parent: str | None = None
    child: str | None = None
    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = (0.0, 0.0, 0.0)
    quaternion: Vector | None = None
    axis: Vector | None = (1.0, 0.0, 0.0)
    axis_element: Element | None = None
    origin_element: Element | None = None
    limit: LimitRecord | None = None
    mimic: MimicRecord | None = None


@dataclass(slots=True)
class RobotRecord:
    element: Element
    version: tuple[int, int]
    links: dict[str, Element] = field(default_factory=dict)
    joints: list[JointRecord] = field(default_factory=list)

    @property
    def by_name(self) -> dict[str, JointRecord]:
        """The joints by name; of two joints with the same name, the first."""
        found: dict[str, JointRecord] = {}
        for joint in self.joints:
            found.setdefault(joint.name, joint)
        return found
