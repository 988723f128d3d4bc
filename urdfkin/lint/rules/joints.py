"""What links and joints say, read once and strictly: the other checks and the reader's input use this.

A value that is None could not be read, and that has been reported; a value that was not written has the
specification's default.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from urdfkin.lint.codes import dialect as codes
from urdfkin.lint.codes import joints as joint_codes
from urdfkin.lint.codes import structure as structure_codes
from urdfkin.lint.escape import quoted
from urdfkin.lint.finding import Severity
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.document import Element
from urdfkin.lint.rules.numbers import NumberReader
from urdfkin.lint.rules.vocabulary import JOINT_TYPES, nearest

Vector = tuple[float, ...]

#: Limits that count from version 1.2 on.
FURTHER_LIMITS = ("acceleration", "deceleration", "jerk")

#: Types whose motion has an axis.
AXIAL = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class LimitRecord:
    """A `<limit>`: what is written, None for what is not."""

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
    """A `<robot>`: its links and joints in the order of the file."""

    element: Element
    version: tuple[int, int]
    links: dict[str, Element] = field(default_factory=dict)
    joints: list[JointRecord] = field(default_factory=list)

    @property
    def by_name(self) -> dict[str, JointRecord]:
        """Joints by name; the first of two that share one."""
        found: dict[str, JointRecord] = {}
        for joint in self.joints:
            found.setdefault(joint.name, joint)
        return found


def read_robot(report: Reporter, root: Element, version: tuple[int, int]) -> RobotRecord:
    """Links and joints of a document, with findings about everything that cannot be read."""
    robot = RobotRecord(root, version)
    for element in root.all("link"):
        name = _name(report, element)
        if name and name in robot.links:
            _duplicate(report, element, robot.links[name])
        elif name:
            robot.links[name] = element
    reader = JointReader(report, version)
    seen: dict[str, Element] = {}
    for element in root.all("joint"):
        joint = reader.read(element)
        if joint.name and joint.name in seen:
            _duplicate(report, element, seen[joint.name])
        seen.setdefault(joint.name, element)
        robot.joints.append(joint)
    return robot


def _name(report: Reporter, element: Element) -> str:
    name = element.attributes.get("name")
    if not name:
        what = "has no name" if name is None else "has an empty name"
        report.add(
            structure_codes.MISSING_NAME,
            f"a {element.tag} {what}",
            element,
            attribute="name",
            remedy=f'write <{element.tag} name="...">',
        )
    return name or ""


def _duplicate(report: Reporter, element: Element, first: Element) -> None:
    report.add(
        structure_codes.DUPLICATE_NAME,
        f"another {element.tag} has this name",
        element,
        attribute="name",
        remedy=f"the first is on line {first.line}; rename one",
    )


class JointReader:
    """Reads `<joint>` elements of a file of one version."""

    def __init__(self, report: Reporter, version: tuple[int, int]) -> None:
        self.report, self.version = report, version
        self.numbers = NumberReader(report)

    def read(self, element: Element) -> JointRecord:
        """One joint; what cannot be read is reported and keeps its default."""
        joint = JointRecord(element, _name(self.report, element))
        joint.kind = self._kind(element)
        joint.parent, joint.child = self._end(element, "parent"), self._end(element, "child")
        self._origin(joint)
        self._axis(joint)
        self._limit(joint)
        self._mimic(joint)
        self._others(joint)
        return joint

    def required(self, element: Element, attribute: str, example: str, *, number: bool = False) -> str | None:
        """An attribute that must be there and hold something; what is wrong with a number comes later."""
        value = element.attributes.get(attribute)
        if value is None or not (value or number):
            self.report.add(
                codes.MISSING_ATTRIBUTE,
                f"<{element.tag}> needs {attribute}" + ("" if value is None else ", and it is empty"),
                element,
                attribute=attribute,
                found=quoted(element.text) if element.text else None,
                remedy=f"write {example}",
            )
        return value or None

    def _kind(self, element: Element) -> str | None:
        written = self.required(element, "type", '<joint name="..." type="revolute">')
        if written is None or written in JOINT_TYPES:
            return written
        close = nearest(written, frozenset(JOINT_TYPES))
        self.report.add(
            joint_codes.UNKNOWN_TYPE,
            "unknown joint type",
            element,
            attribute="type",
            found=quoted(written),
            remedy=f"did you mean {close}?" if close else f"the types are {', '.join(JOINT_TYPES)}",
        )
        return None

    def _end(self, element: Element, tag: str) -> str | None:
        """The link a joint's `<parent>` or `<child>` names."""
        end = element.first(tag)
        if end is None:
            self.report.add(
                codes.MISSING_ELEMENT,
                f"the joint has no <{tag}>",
                element,
                remedy=f'write <{tag} link="..."/>',
            )
            return None
        return self.required(end, "link", f'<{tag} link="..."/>')

    def _origin(self, joint: JointRecord) -> None:
        origin = joint.origin_element = joint.element.first("origin")
        if origin is None:
            return
        joint.xyz = self.numbers.vector(origin, "xyz") or joint.xyz
        joint.rpy = self.numbers.vector(origin, "rpy") or joint.rpy
        if "quat_xyzw" in origin.attributes:
            self._quaternion(joint, origin)

    def _quaternion(self, joint: JointRecord, origin: Element) -> None:
        found = f"quat_xyzw={quoted(origin.attributes['quat_xyzw'])}"
        if self.version < (1, 1):
            self.report.add(
                joint_codes.QUATERNION_IGNORED,
                'quat_xyzw needs version="1.1" and is ignored',
                origin,
                attribute="quat_xyzw",
                found=found,
                remedy="write the rotation as rpy",
            )
            return
        quaternion = self.numbers.vector(origin, "quat_xyzw", 4)
        if quaternion is None:
            return
        both, zero = "rpy" in origin.attributes, not 1e-150 < sum(abs(x) for x in quaternion) < 1e150
        if both or zero:
            self.report.add(
                joint_codes.BAD_QUATERNION,
                "rpy and quat_xyzw are both given" if both else "the quaternion has no direction",
                origin,
                attribute="quat_xyzw",
                found=found,
                remedy="keep one of the two" if both else 'no rotation is "0 0 0 1"',
            )
            return
        joint.quaternion = quaternion
        self.report.add(
            joint_codes.QUATERNION,
            "quat_xyzw is obeyed, but most readers ignore it",
            origin,
            attribute="quat_xyzw",
            found=found,
            remedy="write the rotation as rpy for them",
        )

    def _axis(self, joint: JointRecord) -> None:
        axis = joint.axis_element = joint.element.first("axis")
        if axis is None:
            return
        if joint.kind in ("fixed", "floating"):
            # Nobody reads it: a number that is none is worth a note at most.
            numbers = NumberReader(self.report, joint_codes.IGNORED, joint_codes.IGNORED)
            numbers.vector(axis, "xyz")
            return
        if "xyz" in axis.attributes:
            joint.axis = self.numbers.vector(axis, "xyz")
            return
        if not axis.attributes and (axis.text or any(x.tag == "xyz" and x.text for x in axis.children)):
            return  # an error already: the value is written as text (URDF212)
        self.report.add(
            joint_codes.EMPTY_AXIS,
            "<axis> without xyz is 1 0 0 to some readers and 0 0 0 to urdfdom",
            axis,
            remedy='write <axis xyz="1 0 0"/>, or whichever is meant',
            # A planar joint's axis changes nothing: it moves in the XY plane (URDF505).
            severity=Severity.WARNING if joint.kind == "planar" else None,
        )

    def _limit(self, joint: JointRecord) -> None:
        limit = joint.element.first("limit")
        bounded = joint.kind in ("revolute", "prismatic")
        if limit is None:
            if bounded:
                self.report.add(
                    joint_codes.MISSING_LIMIT,
                    f"a {joint.kind} joint needs a <limit>",
                    joint.element,
                    remedy=f"write {_EXAMPLE_LIMIT}"
                    if joint.kind == "prismatic"
                    else f'write {_EXAMPLE_LIMIT}, or type="continuous" if it turns freely',
                )
            return
        required = ("effort", "velocity") if self.version < (1, 2) else ("lower", "upper") if bounded else ()
        for attribute in required:
            self.required(limit, attribute, _EXAMPLE_LIMIT, number=True)
        names = ("lower", "upper", "effort", "velocity", *(FURTHER_LIMITS if self.version >= (1, 2) else ()))
        values = {name: self.numbers.scalar(limit, name) for name in names}
        joint.limit = LimitRecord(limit, **values)

    def _mimic(self, joint: JointRecord) -> None:
        mimic = joint.element.first("mimic")
        if mimic is None:
            return
        leader = self.required(mimic, "joint", '<mimic joint="..."/>')
        multiplier = self.numbers.scalar(mimic, "multiplier", 1.0)
        offset = self.numbers.scalar(mimic, "offset", 0.0)
        if leader is not None and multiplier is not None and offset is not None:
            joint.mimic = MimicRecord(mimic, leader, multiplier, offset)

    def _others(self, joint: JointRecord) -> None:
        """Elements that kinematics does not need and urdfdom refuses the file for."""
        dynamics = joint.element.first("dynamics")
        if dynamics is not None:
            if not {"damping", "friction"} & dynamics.attributes.keys():
                self.required(dynamics, "damping", '<dynamics damping="0"/>, or remove it')
            for attribute in ("damping", "friction"):
                self.numbers.scalar(dynamics, attribute)
        safety = joint.element.first("safety_controller")
        if safety is not None:
            self.required(
                safety, "k_velocity", '<safety_controller k_velocity="0"/>, or remove it', number=True
            )
            for attribute in ("k_velocity", "k_position", "soft_lower_limit", "soft_upper_limit"):
                self.numbers.scalar(safety, attribute)
        calibration = joint.element.first("calibration")
        if calibration is not None:
            for attribute in ("rising", "falling"):
                self.numbers.scalar(calibration, attribute)


_EXAMPLE_LIMIT = '<limit lower="-1" upper="1" effort="10" velocity="1"/>'
