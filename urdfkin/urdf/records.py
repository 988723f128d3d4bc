"""Elements, links and joints of a URDF as plain data, their limits on size, and the tree built of them.

In the records of links and joints, None marks a value that could not be read; a finding reports it. A value
that the file does not write has the default of the specification.

`urdfkin.urdf.parser` fills the records, and `urdfkin.lint` checks them. `read_tree` builds the
`KinematicTree`: it normalises the axes, resolves chains of mimic joints, and sorts the joints in Pinocchio's
order.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import coordinate_rotation, rotation_of, rpy_of
from urdfkin.model.tree import (
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
    with_root_joint,
)

#: Largest number of nested elements that Pinocchio accepts. Its XML parser, tinyxml2, stops at level 500.
#: That count includes the document itself and the level that the parser refuses.
ORACLE_DEPTH = 498


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits on the size of a file and its parts in one check.

    Attributes:
        bytes: Size of the file.
        depth: Levels of nested elements; urdfdom's parser refuses more.
        elements: Number of elements.
        attributes: Number of attributes of one element.
        name: Characters in the name of an element, an attribute, a link or a joint.
        number: Characters in one number.
        markup: Bytes of one tag, comment or processing instruction; the size is measured to within 10 %.
            libxml2 has the same limit.
    """

    bytes: int = 100_000_000
    depth: int = ORACLE_DEPTH
    elements: int = 1_000_000
    attributes: int = 200
    name: int = 10_000
    number: int = 2_000
    markup: int = 10_000_000


DEFAULT_LIMITS = Limits()


#: Pattern of a start tag, to be matched at an element's offset. A quoted value may contain '>'.
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
        """Add a child. An element gets its list of children with the first child, which saves memory."""
        if isinstance(self.children, list):
            self.children.append(child)
        else:
            self.children = [child]

    def all(self, tag: str) -> list[Element]:
        """Return the children with a tag."""
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
        """The tag of the holder. For example, it is `joint` for every element inside a joint."""
        return self.holder.tag

    @property
    def label(self) -> str | None:
        """The name of the link or joint that contains this element."""
        return self.holder.attributes.get("name") if self.parent is not None else None


Vector = tuple[float, ...]

#: Attributes of `<limit>` that URDF defines from version 1.2 on.
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
    """A `<mimic>`."""

    element: Element
    leader: str
    multiplier: float
    offset: float


@dataclass(slots=True)
class JointRecord:
    """A `<joint>`."""

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
    """A `<robot>`: its links and joints, in file order."""

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


def read_tree(urdf: RobotRecord, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """Return the kinematic tree of a URDF.

    Args:
        urdf: The records of the URDF, without errors (see `urdfkin.lint`).
        mimic: True: mimic joints follow their mimicked joints, as URDF defines. False: they move freely.
        root_joint: `"floating"` or `"planar"` adds a joint `root_joint` of this kind above the root link.

    Raises:
        InputError: the joints form no tree, mimic joints form a circle, or `root_joint` has another value.
        UnknownNameError: the mimicked joint of a mimic joint does not exist.
    """
    name = urdf.element.attributes.get("name", "")
    tree = build_tree(name, root_link(name, urdf.links, urdf.joints), joint_rows(urdf.joints, mimic=mimic))
    return tree if root_joint is None else with_root_joint(tree, _root_kind(root_joint))


def joint_rows(joints: Sequence[JointRecord], *, mimic: bool = True) -> list[tuple[Joint, str, str]]:
    """Return each joint with its mimic rule, its parent link and its child link.

    Raises:
        InputError: mimic joints form a circle.
        UnknownNameError: the mimicked joint of a mimic joint does not exist.
    """
    rules = _rules(joints) if mimic else {}
    return [(_joint(one, rules.get(one.name)), str(one.parent), str(one.child)) for one in joints]


def root_link(name: str, links: Iterable[str], joints: Sequence[JointRecord]) -> str:
    """Return the link without a parent.

    Raises:
        InputError: there is none, or more than one.
    """
    roots = set(links) - {joint.child for joint in joints}
    if len(roots) != 1:
        raise InputError(
            "a robot must have one root link", where=name, found=", ".join(sorted(roots)) or "none"
        )
    return roots.pop()


def _root_kind(word: str) -> JointKind:
    if word not in ("floating", "planar"):
        raise InputError("root_joint must be 'floating', 'planar' or None", found=repr(word))
    return JointKind(word)


def _joint(joint: JointRecord, rule: Mimic | None) -> Joint:
    kind = JointKind(joint.kind)
    quaternion = joint.quaternion
    roll, pitch, yaw = np.array(joint.rpy) if quaternion is None else rpy_of_quaternion(quaternion)
    # The parser has already checked the numbers. `rotation_from_rpy` would check them again for each joint.
    T = np.eye(4)
    T[:3, :3] = coordinate_rotation(2, yaw) @ coordinate_rotation(1, pitch) @ coordinate_rotation(0, roll)
    T[:3, 3] = joint.xyz
    return Joint(
        name=joint.name,
        kind=kind,
        parent=0,
        T_parent_joint=T,
        axis=_unit(np.array(joint.axis), joint.name) if kind.has_axis else np.array([1.0, 0.0, 0.0]),
        limit=_limit(joint.limit, kind),
        mimic=rule,
    )


def rpy_of_quaternion(quaternion: Sequence[float]) -> FloatArray:
    """Return roll, pitch and yaw (rad) of a quaternion (x, y, z, w) of any length, as in URDF 1.1."""
    scaled = np.asarray(quaternion) / np.abs(quaternion).max()
    return rpy_of(rotation_of(scaled / np.linalg.norm(scaled)))


def _unit(axis: FloatArray, joint: str) -> FloatArray:
    """Divide an axis by its length, as Pinocchio does; return a unit vector unchanged."""
    length = math.hypot(*axis)
    if not 0.0 < length < math.inf:
        raise InputError("a joint's axis has no direction", where=f"joint {joint}", found=str(axis.tolist()))
    return axis if length == 1.0 else axis / length


def _limit(limit: LimitRecord | None, kind: JointKind) -> Limit | None:
    if limit is None or kind.nv == 0:
        return None
    # A missing position limit is zero, as in urdfdom. By the specification, the position limits of a
    # continuous joint have no effect.
    return Limit(
        lower=(limit.lower or 0.0) if kind.bounded else -math.inf,
        upper=(limit.upper or 0.0) if kind.bounded else math.inf,
        velocity=math.inf if limit.velocity is None else limit.velocity,
        effort=math.inf if limit.effort is None else limit.effort,
    )


def _rules(joints: Sequence[JointRecord]) -> dict[str, Mimic]:
    """Return the mimic rule of each mimic joint, in terms of a joint that is not a mimic joint.

    A chain of rules is composed into one: y = m2 (m1 x + b1) + b2. The composition begins at the joint that
    is not a mimic joint. Each joint is visited once. The operations have the same order as in the oracle, so
    that urdfkin and the oracle have equal rounding errors.
    """
    named = {joint.name: joint for joint in joints}
    resolved: dict[str, Mimic] = {}
    for start in joints:
        joint, pending = start, dict[str, MimicRecord]()
        while (rule := _rule(joint)) is not None and joint.name not in resolved:
            pending[joint.name] = rule
            if rule.leader not in named:
                raise UnknownNameError(
                    "mimicked joint",
                    str(rule.leader),
                    named,
                    where=f"joint {joint.name} (mimic=False, --no-mimic, lets it move freely)",
                )
            if rule.leader in pending:
                raise InputError("mimic joints follow each other in a circle", where=f"joint {start.name}")
            joint = named[rule.leader]
        end = resolved.get(joint.name, Mimic(joint.name, 1.0, 0.0))
        for name, rule in reversed(pending.items()):
            offset = rule.multiplier * end.offset + rule.offset
            end = resolved[name] = Mimic(end.leader, rule.multiplier * end.multiplier, offset)
    return resolved


def _rule(joint: JointRecord) -> MimicRecord | None:
    return None if JointKind(joint.kind) is JointKind.FIXED else joint.mimic
