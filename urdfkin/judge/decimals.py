"""The numbers of a URDF as they are written: decimals, not the doubles nearest to them.

Names and order come from the tree that was read; the text was checked before (`urdfkin.diagnostics`).
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from urdfkin.errors import InputError
from urdfkin.judge.vectors import (
    IDENTITY,
    ZERO,
    Matrix,
    Number,
    Vector,
    from_quaternion,
    from_rpy,
    mp,
    unit,
)
from urdfkin.plain_xml import plain_xml
from urdfkin.tree import JointKind, KinematicTree

#: The version of URDF from which on `quat_xyzw` counts; in older files it is ignored.
_WITH_QUATERNIONS = (1, 1)


@dataclass(frozen=True, slots=True)
class ExactJoint:
    """What the text says about one joint.

    Attributes:
        R: Orientation of the joint frame in its parent's.
        p: Its place, metres.
        axis: Unit axis in the joint frame.
        multiplier: 1, or a follower's.
        offset: 0, or a follower's.
    """

    R: Matrix
    p: Vector
    axis: Vector
    multiplier: Number
    offset: Number


def read_exact(text: str, tree: KinematicTree) -> tuple[ExactJoint, ...]:
    """The joints of a tree, from the URDF text it was read from.

    Args:
        text: The URDF.
        tree: The same, read; a joint `root_joint` that it was hung from is not in the text.

    Raises:
        InputError: the text and the tree are not of the same robot.
    """
    root = plain_xml(text)
    elements = {str(element.get("name")): element for element in root.findall("joint")}
    quaternions = tuple(map(int, root.get("version", "1.0").split("."))) >= _WITH_QUATERNIONS
    joints = []
    for joint in tree.joints:
        element = elements.get(joint.name)
        if element is None:
            if joint.kind not in (JointKind.FLOATING, JointKind.PLANAR):
                raise InputError("a joint is not in the URDF text", where=tree.name, found=joint.name)
            joints.append(ExactJoint(IDENTITY, ZERO, IDENTITY[0], mp.mpf(1), mp.mpf(0)))
            continue
        multiplier, offset = _rule(elements, joint.name) if joint.mimic else (mp.mpf(1), mp.mpf(0))
        axis = _vector(element.find("axis"), "xyz", "1 0 0")
        joints.append(
            ExactJoint(
                R=_rotation(element.find("origin"), quaternions),
                p=_vector(element.find("origin"), "xyz", "0 0 0"),
                axis=unit(axis) if joint.kind.has_axis else axis,
                multiplier=multiplier,
                offset=offset,
            )
        )
    return tuple(joints)


def _numbers(element: Element | None, name: str, default: str) -> tuple[Number, ...]:
    written = default if element is None else element.get(name, default)
    return tuple(mp.mpf(word) for word in written.split())


def _vector(element: Element | None, name: str, default: str) -> Vector:
    x, y, z = _numbers(element, name, default)
    return x, y, z


def _rotation(origin: Element | None, quaternions: bool) -> Matrix:
    """From roll, pitch and yaw, or the quaternion, of any length, that URDF 1.1 has in their place."""
    if quaternions and origin is not None and "quat_xyzw" in origin.attrib:
        return from_quaternion(*_numbers(origin, "quat_xyzw", ""))
    return from_rpy(_vector(origin, "rpy", "0 0 0"))


def _rule(elements: dict[str, Element], name: str) -> tuple[Number, Number]:
    """Multiplier and offset of a follower, chains followed to the joint that moves."""
    multiplier, offset = mp.mpf(1), mp.mpf(0)
    while (rule := elements[name].find("mimic")) is not None and elements[name].get("type") != "fixed":
        (factor,), (constant,) = _numbers(rule, "multiplier", "1"), _numbers(rule, "offset", "0")
        multiplier, offset = multiplier * factor, offset + multiplier * constant
        name = str(rule.get("joint"))
    return multiplier, offset
