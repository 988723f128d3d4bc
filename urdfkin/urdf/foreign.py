"""Convert objects of other libraries.

Objects of ElementTree, lxml and yourdfpy become URDF text. A Model of Pinocchio becomes a kinematic tree.

urdfkin recognizes an object by the module names of its class and base classes. An XML element is recognized
by its attributes `tag`, `attrib` and `iter`. Therefore, urdfkin does not import a library to recognize its
objects.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard
from xml.etree import ElementTree

import numpy as np

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, build_tree, inverse
from urdfkin.urdf.findings import Finding, Severity
from urdfkin.urdf.mjcf import make_fixed_joint, make_unique, replace_missing_limits
from urdfkin.urdf.parser import QUAT_XYZW
from urdfkin.urdf.reader import find_root_link, make_joint_rows
from urdfkin.urdf.records import Element, JointRecord, LimitRecord, MimicRecord
from urdfkin.urdf.writer import to_urdf

if TYPE_CHECKING:
    from yourdfpy import urdf as yourdf

#: Maximum number of joint names in a finding.
_MAX_NAMES = 5

#: Placeholder for the XML element in records that do not come from a file.
_NO_ELEMENT = Element("", {}, None, 0, 0, 0)


class XmlElement(Protocol):
    @property
    def tag(self) -> Any: ...

    @property
    def attrib(self) -> Any: ...


class XmlTree(Protocol):
    def getroot(self) -> Any: ...


def convert_to_urdf(source: Any) -> tuple[str, str] | None:
    """Return the URDF text of an object and a name for messages; None for an object of another library.

    Raise InputError if the object cannot be written.
    """
    if any(kind.__module__.partition(".")[0] == "yourdfpy" for kind in type(source).__mro__):
        return convert_yourdfpy_robot(getattr(source, "robot", source)), "<yourdfpy>"
    root = source.getroot() if hasattr(source, "getroot") else source
    if hasattr(root, "tag") and hasattr(root, "attrib") and hasattr(root, "iter"):
        return _serialize(root), "<ElementTree>"
    return None


def find_lost_quaternions(source: Any, file: str) -> tuple[Finding, ...]:
    """Return a note about the joints of a yourdfpy robot that have an origin without rotation.

    yourdfpy (0.0.60) ignores quat_xyzw, so such a joint may have lost the rotation in the file.
    """
    robot = getattr(source, "robot", source)
    if not type(robot).__module__.startswith("yourdfpy"):
        return ()
    joints = [
        str(joint.name)
        for joint in robot.joints
        if joint.origin is not None and (joint.origin[:3, :3] == np.eye(3)).all()
    ]
    if not joints:
        return ()
    more = f" and {len(joints) - _MAX_NAMES} more" if len(joints) > _MAX_NAMES else ""
    names = f"{', '.join(joints[:_MAX_NAMES])}{more}"
    message = (
        f"yourdfpy ignores quat_xyzw, so the rotation of joint {names} is lost if"
        " the file gives the rotation by quat_xyzw"
    )
    remedy = "if the file contains quat_xyzw, load the file instead of the yourdfpy robot"
    return (Finding(QUAT_XYZW.id, Severity.NOTE, message, remedy=remedy, file=file),)


def convert_yourdfpy_robot(robot: yourdf.Robot) -> str:
    """Return the URDF of a yourdfpy robot.

    The writer of yourdfpy (0.0.60) is not used, because it omits mimic rules. The axes are not normalised, so
    that `check` can report their lengths. Raise InputError if a value is missing or invalid.
    """
    try:
        records = [_make_joint_record(joint) for joint in robot.joints]
        axes = {record.name: np.array(record.axis) for record in records}
        rows = [(replace(one, axis=axes[one.name]), up, down) for one, up, down in make_joint_rows(records)]
        root = find_root_link(robot.name, [link.name for link in robot.links], records)
        return to_urdf(build_tree(robot.name, root, rows), [record.name for record in records])
    except UrdfkinError:
        raise
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError("yourdfpy's robot cannot be written as a URDF", found=str(error)) from error


def _make_joint_record(joint: yourdf.Joint) -> JointRecord:
    T = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=np.float64)
    axis = (1.0, 0.0, 0.0) if joint.axis is None else tuple(map(float, joint.axis))
    limit, rule = joint.limit, joint.mimic
    xyz, rpy = tuple(T[:3, 3]), tuple(rpy_of(T[:3, :3]))
    return JointRecord(
        _NO_ELEMENT, joint.name, joint.type, joint.parent, joint.child, xyz, rpy,
        axis=axis,
        limit=limit and LimitRecord(_NO_ELEMENT, limit.lower, limit.upper, limit.effort, limit.velocity),
        mimic=rule and MimicRecord(_NO_ELEMENT, rule.joint, rule.multiplier, rule.offset),
    )  # fmt: skip


def _serialize(root: Any) -> str:
    if not isinstance(root.tag, str):
        raise InputError("the root of this ElementTree is not an element", found=safe_repr(root.tag))
    try:
        copy = ElementTree.Element(root.tag, dict(root.attrib))
        open_ = [(root, copy)]
        while open_:
            element, duplicate = open_.pop()
            duplicate.text = element.text
            for child in element:
                # The copy omits comments and processing instructions, because their tags are functions.
                if isinstance(child.tag, str):
                    open_.append((child, ElementTree.SubElement(duplicate, child.tag, dict(child.attrib))))
        return ElementTree.tostring(copy, encoding="unicode")
    except (TypeError, AttributeError, RecursionError) as error:
        raise InputError("this ElementTree cannot be written as XML", found=str(error)) from None


#: Names of Pinocchio's joint classes with the axis x, y or z. R is a revolute joint, and P is a prismatic
#: joint. RUB is a revolute joint without limits.
_ALIGNED_CLASS = re.compile(r"JointModel(R|RUB|P)([XYZ])")
_KIND_BY_CLASS = {
    "R": JointKind.REVOLUTE,
    "RUB": JointKind.CONTINUOUS,
    "P": JointKind.PRISMATIC,
    "JointModelRevoluteUnaligned": JointKind.REVOLUTE,
    "JointModelRevoluteUnboundedUnaligned": JointKind.CONTINUOUS,
    "JointModelPrismaticUnaligned": JointKind.PRISMATIC,
    "JointModelFreeFlyer": JointKind.FLOATING,
    "JointModelPlanar": JointKind.PLANAR,
}
#: Larger limits are treated as infinite, because Pinocchio stores a missing limit as the largest double.
_INFINITE_LIMIT = 1e300


@dataclass(frozen=True, slots=True)
class ConvertedModel:
    """The kinematic tree of a Pinocchio model.

    Attributes:
        joints: Index of the Pinocchio joint that has the same frame, by link name.
        frames: Index of the Pinocchio frame, by link name, for the links that are not in `joints`.
    """

    tree: KinematicTree
    joints: dict[str, int]
    frames: dict[str, int]


def is_pinocchio_model(source: object) -> TypeGuard[Any]:
    kinds = [(kind.__module__.partition(".")[0], kind.__name__) for kind in type(source).__mro__]
    return ("pinocchio", "Model") in kinds or ("pinocchio", "RobotWrapper") in kinds


def convert_pinocchio_model(source: Any) -> ConvertedModel:
    """Convert a `Model` or `RobotWrapper`.

    A revolute joint without finite limits becomes continuous. `replace_missing_limits`
    replaces each missing limit of a prismatic joint. Raise InputError for a mimic joint, and for a joint
    type that URDF lacks.
    """
    model = getattr(source, "model", source)
    return _ModelReader(model).convert()


class _ModelReader:
    def __init__(self, model: Any) -> None:
        self.model = model
        self.frames = list(model.frames)
        self.kinds = [str(frame.type) for frame in self.frames]
        self.used_link_names, self.used_joint_names = set[str](), set(map(str, model.names))
        self.placements = [np.array(frame.placement.homogeneous) for frame in self.frames]
        self.bodies = dict(self._find_bodies_at_joint_frames())
        joints = range(int(model.njoints))
        bodies = self.bodies
        default = {j: f"{model.names[j]}_link" if j else "universe" for j in joints}
        names = {j: self.frames[bodies[j]].name if j in bodies else default[j] for j in joints}
        #: Name of the link that a joint moves, by the index of the joint.
        self.links_of_joints = {j: make_unique(name, self.used_link_names) for j, name in names.items()}
        #: Name of the link that represents a frame, by the index of the frame.
        self.links: dict[int, str] = {}
        self.rows: list[tuple[Joint, str, str]] = []

    def _find_bodies_at_joint_frames(self) -> Iterator[tuple[int, int]]:
        """Yield (joint, body) as indices, for each body that has the same frame as its joint.

        The pairs are in reverse order, so that `dict` keeps the first body of each joint.
        """
        for i in reversed(range(len(self.frames))):
            if self.kinds[i] == "BODY" and (self.placements[i] == np.eye(4)).all():
                yield int(self.frames[i].parentJoint), i

    def convert(self) -> ConvertedModel:
        # In Pinocchio, the index of a parent frame is lower than the indices of its child frames.
        for i in range(len(self.frames)):
            self._convert_frame(i)
        frames = zip(self.frames, self.kinds, strict=True)
        own = {int(frame.parentJoint): frame for frame, kind in frames if kind == "JOINT"}
        for j in range(1, int(self.model.njoints)):
            T = np.array(self.model.jointPlacements[j].homogeneous)
            link, T = self._attachment(own.get(j), int(self.model.parents[j]), T)
            self.rows.append((self._make_joint(j, T), link, self.links_of_joints[j]))
        tree = build_tree(str(self.model.name) or "robot", self.links_of_joints[0], self.rows)
        joints = {link: j for j, link in self.links_of_joints.items()}
        return ConvertedModel(tree, joints, {link: i for i, link in self.links.items() if link not in joints})

    def _attachment(self, frame: Any, joint: int, T: FloatArray) -> tuple[str, FloatArray]:
        """Return the parent link of a frame, and the pose of the frame relative to this link.

        T is the pose of the frame relative to the frame of `joint`.
        """
        i = -1 if frame is None else int(frame.parentFrame)
        if i < 0 or i not in self.links or int(self.frames[i].parentJoint) != joint:
            return self.links_of_joints[joint], T
        return self.links[i], inverse(self.placements[i]) @ T

    def _convert_frame(self, i: int) -> None:
        frame, kind = self.frames[i], self.kinds[i]
        joint, above = int(frame.parentJoint), int(frame.parentFrame)
        if i == 0 or kind == "JOINT" or self.bodies.get(joint) == i:
            self.links[i] = self.links_of_joints[joint]
            return
        fixed = self.kinds[above] == "FIXED_JOINT" and above > 0
        if (
            kind == "BODY"
            and fixed
            and (self.placements[i] == self.placements[above]).all()
            and above in self.links
        ):
            self.links[i] = self.links[above]
            return
        link, T = self._attachment(frame, joint, self.placements[i])
        if kind == "FIXED_JOINT":
            body = next((f for f in self.frames[i + 1 :] if int(f.parentFrame) == i), None)
            child = make_unique(frame.name if body is None else body.name, self.used_link_names)
            name = frame.name
        else:
            child, name = make_unique(frame.name, self.used_link_names), f"{frame.name}_fixed"
        self.rows.append((make_fixed_joint(make_unique(name, self.used_joint_names), T), link, child))
        self.links[i] = child

    def _make_joint(self, j: int, T: FloatArray) -> Joint:
        model = self.model
        joint, name = model.joints[j], str(model.names[j])
        class_name = str(joint.shortname())
        aligned = _ALIGNED_CLASS.fullmatch(class_name)
        kind = _KIND_BY_CLASS.get(aligned[1] if aligned else class_name)
        if kind is None:
            mimics = class_name.endswith("Mimic")
            raise InputError(
                "Pinocchio's Python interface does not show the axis of a mimic joint"
                if mimics
                else "URDF has no equivalent of this joint of a pinocchio.Model",
                where=f"joint {name}",
                found=class_name,
                remedy="build the model with mimic=False" if mimics else "give the robot as a URDF",
            )
        axis = np.eye(3)["XYZ".index(aligned[2])] if aligned else np.array([1.0, 0.0, 0.0])
        if class_name.endswith("Unaligned"):
            # Some joint classes of Pinocchio 4.1 lack the attribute `axis`, so the axis is read from the
            # joint's motion subspace S, a vector [linear; angular].
            linear, angular = np.split(np.ravel(joint.createData().S), 2)
            axis = linear + angular
        if not kind.has_axis:
            return Joint(name, kind, 0, T, axis)
        q, v = int(joint.idx_q), int(joint.idx_v)
        speed, effort = (_convert_limit(x[v]) for x in (model.upperVelocityLimit, model.upperEffortLimit))
        lower, upper = -math.inf, math.inf
        if kind is not JointKind.CONTINUOUS:
            lower, upper = (
                _convert_limit(model.lowerPositionLimit[q]),
                _convert_limit(model.upperPositionLimit[q]),
            )
        if math.isinf(lower) or math.isinf(upper):
            if kind.turns:
                kind = JointKind.CONTINUOUS
            else:
                lower, upper = replace_missing_limits(lower, upper)
        return Joint(name, kind, 0, T, axis, Limit(lower, upper, speed, effort))


def _convert_limit(value: float) -> float:
    return math.copysign(math.inf, value) if abs(value) > _INFINITE_LIMIT else float(value)
