"""Read links and joints into records, once and strictly. The other rules and the reader use the records."""

from __future__ import annotations

from collections.abc import Sequence

from urdfkin.lint.finding import Finding, Severity, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, WARNING, Rule
from urdfkin.lint.rules.axes import LONGEST, SHORTEST
from urdfkin.lint.rules.names import named, report_duplicate
from urdfkin.lint.rules.numbers import NumberReader
from urdfkin.lint.rules.vocabulary import JOINT_TYPES, nearest
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import FURTHER_LIMITS, JointRecord, LimitRecord, MimicRecord, RobotRecord

MISSING_ELEMENT = Rule("URDF210", "missing-element", ERROR)
MISSING_ATTRIBUTE = Rule("URDF211", "missing-attribute", ERROR)
UNKNOWN_TYPE = Rule("URDF501", "unknown-joint-type", ERROR)
EMPTY_AXIS = Rule("URDF504", "axis-without-xyz", ERROR)
MISSING_LIMIT = Rule("URDF506", "missing-limit", ERROR)
IGNORED = Rule("URDF510", "ignored-value", WARNING)
QUATERNION_IGNORED = Rule("URDF511", "quat-xyzw-ignored", WARNING)
QUATERNION = Rule("URDF512", "quat-xyzw", WARNING)
BAD_QUATERNION = Rule("URDF513", "bad-quaternion", ERROR)
#: Largest number of names in one finding.
_NAMED = 5


def read_robot(report: Reporter, root: Element, version: tuple[int, int]) -> RobotRecord:
    """Read the links and joints of a document; add findings for everything that cannot be read."""
    robot = RobotRecord(root, version)
    for element in root.all("link"):
        name = named(report, element)
        if name and name in robot.links:
            report_duplicate(report, element, robot.links[name])
        elif name:
            robot.links[name] = element
    reader = JointReader(report, version)
    seen: dict[str, Element] = {}
    for element in root.all("joint"):
        joint = reader.read(element)
        if joint.name and joint.name in seen:
            report_duplicate(report, element, seen[joint.name])
        seen.setdefault(joint.name, element)
        robot.joints.append(joint)
    return robot


def lost_quaternions(joints: Sequence[str], file: str) -> tuple[Finding, ...]:
    """Return a finding for a yourdfpy robot whose rotations may be lost: yourdfpy ignores quat_xyzw.

    Args:
        joints: The joints whose origin has no rotation.
        file: The name of the robot in messages.
    """
    if not joints:
        return ()
    more = f" and {len(joints) - _NAMED} more" if len(joints) > _NAMED else ""
    message = (
        f"yourdfpy ignores quat_xyzw: if the file has one at {', '.join(joints[:_NAMED])}{more}, its rotation"
        " is missing here"
    )
    remedy = "load the file itself if it contains quat_xyzw"
    return (Finding(QUATERNION.id, Severity.NOTE, message, remedy=remedy, file=file),)


class JointReader:
    """Reader of the `<joint>` elements of a file.

    Args:
        report: The reporter of the file.
        version: The URDF version of the file.
    """

    def __init__(self, report: Reporter, version: tuple[int, int]) -> None:
        self.report, self.version = report, version
        self.numbers = NumberReader(report)

    def read(self, element: Element) -> JointRecord:
        """Read one joint; a value that cannot be read is reported and has its default in the record."""
        joint = JointRecord(element, named(self.report, element))
        joint.kind = self._kind(element)
        joint.parent, joint.child = self._end(element, "parent"), self._end(element, "child")
        self._origin(joint)
        self._axis(joint)
        self._limit(joint)
        self._mimic(joint)
        self._others(joint)
        return joint

    def required(self, element: Element, attribute: str, example: str, *, number: bool = False) -> str | None:
        """Return a required attribute, or None after a finding that it is missing or empty.

        Args:
            element: The element.
            attribute: The name of the attribute.
            example: An example for the remedy.
            number: Whether the attribute is a number. `NumberReader` reports an empty number.
        """
        value = element.attributes.get(attribute)
        if value is None or not (value or number):
            self.report.add(
                MISSING_ATTRIBUTE,
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
            UNKNOWN_TYPE,
            "unknown joint type",
            element,
            attribute="type",
            found=quoted(written),
            remedy=f"did you mean {close}?" if close else f"the types are {', '.join(JOINT_TYPES)}",
        )
        return None

    def _end(self, element: Element, tag: str) -> str | None:
        """Return the link that a joint's `<parent>` or `<child>` names."""
        end = element.first(tag)
        if end is None:
            self.report.add(
                MISSING_ELEMENT, f"the joint has no <{tag}>", element, remedy=f'write <{tag} link="..."/>'
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

        def add(rule: Rule, message: str, remedy: str) -> None:
            self.report.add(rule, message, origin, attribute="quat_xyzw", found=found, remedy=remedy)

        if self.version < (1, 1):
            message = 'quat_xyzw needs version="1.1" and is ignored'
            add(QUATERNION_IGNORED, message, "write the rotation as rpy")
            return
        quaternion = self.numbers.vector(origin, "quat_xyzw", 4)
        if quaternion is None:
            return
        both, zero = "rpy" in origin.attributes, not SHORTEST < sum(map(abs, quaternion)) < LONGEST
        if both:
            add(BAD_QUATERNION, "rpy and quat_xyzw are both given", "remove one of the two")
        elif zero:
            add(BAD_QUATERNION, "the quaternion has no direction", 'the identity is "0 0 0 1"')
        else:
            joint.quaternion = quaternion
            message = "quat_xyzw is used, but most readers ignore it"
            add(QUATERNION, message, "write the rotation as rpy for these readers")

    def _axis(self, joint: JointRecord) -> None:
        axis = joint.axis_element = joint.element.first("axis")
        if axis is None:
            return
        if joint.kind in ("fixed", "floating"):
            # No reader uses this axis, so a bad number in it is only URDF510.
            numbers = NumberReader(self.report, IGNORED, IGNORED)
            numbers.vector(axis, "xyz")
            return
        if "xyz" in axis.attributes:
            joint.axis = self.numbers.vector(axis, "xyz")
            return
        if not axis.attributes and (axis.text or any(x.tag == "xyz" and x.text for x in axis.children)):
            return  # an error already: the value is written as text (URDF212)
        self.report.add(
            EMPTY_AXIS,
            "<axis> without xyz is 1 0 0 to some readers and 0 0 0 to urdfdom",
            axis,
            remedy='write the axis, for example <axis xyz="1 0 0"/>',
            # A planar joint moves in the XY plane, whatever its axis (URDF505).
            severity=Severity.WARNING if joint.kind == "planar" else None,
        )

    def _limit(self, joint: JointRecord) -> None:
        limit = joint.element.first("limit")
        bounded = joint.kind in ("revolute", "prismatic")
        if limit is None:
            if bounded:
                self.report.add(
                    MISSING_LIMIT,
                    f"a {joint.kind} joint needs a <limit>",
                    joint.element,
                    remedy=f"write {_EXAMPLE_LIMIT}"
                    if joint.kind == "prismatic"
                    else f'write {_EXAMPLE_LIMIT}, or type="continuous" if it rotates without limits',
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
        """Check the elements that kinematics does not use, but for which urdfdom refuses a file."""
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
