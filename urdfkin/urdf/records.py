"""Records of the XML elements and joints of a URDF, and limits on the size of a URDF.

In the record of a joint, `kind`, `parent`, `child` and `axis` are None if the parser cannot read the value. A
missing origin or axis has the default value of the URDF specification.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields

from urdfkin.errors.validators import as_int

#: Maximum depth of nested elements in a URDF that Pinocchio reads. Pinocchio's parser tinyxml2 counts the
#: document as level 1, and refuses level 500.
ORACLE_DEPTH = 498


@dataclass(frozen=True, slots=True)
class SizeLimits:
    """Limits on the size of a URDF file and its content.

    Attributes:
        depth: Maximum number of levels of nested elements. The default is Pinocchio's limit.
        attributes: Maximum number of attributes of one element.
        name: Maximum number of characters in the name of an element, an attribute, a link or a joint.
        number: Maximum number of characters of one number.
        markup: Maximum number of bytes of one tag, comment or processing instruction. The default is the
            limit of libxml2. urdfkin may accept up to 1 MB more, because it reads the file in pieces.
    """

    bytes: int = 100_000_000
    depth: int = ORACLE_DEPTH
    elements: int = 1_000_000
    attributes: int = 200
    name: int = 10_000
    number: int = 2_000
    markup: int = 10_000_000

    def __post_init__(self) -> None:
        for limit in fields(self):
            as_int(getattr(self, limit.name), limit.name, int(limit.name == "markup"))


DEFAULT_SIZE_LIMITS = SizeLimits()


#: A quoted value in a start tag may contain '>'.
START_TAG = re.compile(rb"""<(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
ATTRIBUTE = re.compile(rb"""([^\s=<>/"']++)\s*+=\s*+("[^"]*+"|'[^']*+')""")


@dataclass(slots=True, eq=False)
class Element:
    """An XML element of a URDF.

    Attributes:
        offset: Index of the start tag's first byte. A byte order mark is not counted.
        top_level_ancestor: The child of `<robot>` that contains this element. None for `<robot>` and its
            children.
        text: The first characters of the text between the element's tags.
    """

    tag: str
    attributes: dict[str, str]
    parent: Element | None
    line: int
    column: int
    offset: int
    top_level_ancestor: Element | None = None
    children: Sequence[Element] = ()
    text: str = ""

    def append(self, child: Element) -> None:
        # To save memory, an element without children has no list of children.
        if isinstance(self.children, list):
            self.children.append(child)
        else:
            self.children = [child]

    def find_all(self, tag: str) -> list[Element]:
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """Return the first child with a tag.

        URDF readers ignore further children with this tag.
        """
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[Element]:
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack += reversed(element.children)

    @property
    def top_level_element(self) -> Element:
        """The child of `<robot>` that contains this element; this element if it is `<robot>` or a child."""
        return self.top_level_ancestor or self


Vector = tuple[float, ...]

#: Attributes of `<limit>` that URDF 1.2 introduced.
FURTHER_LIMITS = ("acceleration", "deceleration", "jerk")

AXIAL_TYPES = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class LimitRecord:
    """A `<limit>` element; the value of a missing or invalid attribute is None."""

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
    mimicked_joint: str
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
    def joints_by_name(self) -> dict[str, JointRecord]:
        first: dict[str, JointRecord] = {}
        for joint in self.joints:
            first.setdefault(joint.name, joint)
        return first
