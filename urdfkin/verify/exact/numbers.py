"""Numbers of many digits, intervals, and the rotations that are made of angles; vectors are triples of them.

The kind of number is a context: `mp` of mpmath's for fifty digits, `urdfkin.verify.exact.intervals` for
intervals.


The numbers of a URDF as they are written: decimals, not the doubles nearest to them.

Names and order come from the tree that was read; the text was checked before (`urdfkin.lint`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import mpmath

from urdfkin.errors import InputError
from urdfkin.kinematics import equations as eq
from urdfkin.model.tree import Joint, JointKind, KinematicTree
from urdfkin.urdf.plain_xml import plain_xml

#: Digits of the judge's arithmetic. Doubles have 16; fifty leave no doubt about the last of them.
DIGITS = 50

#: A context of our own: mpmath's global one stays as its user set it.
mp = mpmath.mp.clone()
mp.dps = DIGITS

Context = Any
Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

# Whole numbers are numbers of every kind.
ZERO: Vector = (0, 0, 0)
IDENTITY: Matrix = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def exact(value: float, context: Context = mp) -> Number:
    """A double as it is, to its last bit."""
    return context.mpf(float(value))


def unit(x: Vector, context: Context) -> Vector:
    """`x` divided by its length."""
    length = context.sqrt(eq.dot(x, x))
    return x[0] / length, x[1] / length, x[2] / length


def about(axis: Vector, angle: Number, context: Context) -> Matrix:
    """R_k(phi), 7.28, for a unit axis."""
    c, s = context.cos_sin(angle)
    columns = (
        eq.plus(
            eq.plus(eq.times(c, e), eq.times((1 - c) * eq.dot(axis, e), axis)), eq.times(s, eq.cross(axis, e))
        )
        for e in IDENTITY
    )
    found: Matrix = eq.transposed(tuple(columns))
    return found


def from_rpy(rpy: Vector, context: Context) -> Matrix:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = ((sine, cosine, 0, 1) for cosine, sine in map(context.cos_sin, rpy))
    found: Matrix = eq.product(eq.product(eq.about_z(*z), eq.about_y(*y)), eq.about_x(*x))
    return found


def from_quaternion(quaternion: tuple[Number, ...], context: Context) -> Matrix:
    """The rotation of a quaternion (x, y, z, w), put to length one first."""
    length = context.sqrt(sum(x * x for x in quaternion))
    found: Matrix = eq.rotation_of_quaternion(*(x / length for x in quaternion))
    return found


def nearest_rotation(M: Matrix) -> Matrix:
    """The rotation that a matrix means which is one to some digits: the orthogonal factor of M = U H.

    Newton's method, X - X (X^T X - I)/2, which doubles the digits with each step.
    """
    for _ in range(6):
        x, y, z = (
            eq.minus(row, eq.times(0.5, step)) for row, step in zip(M, eq.product(M, defect(M)), strict=True)
        )
        M = x, y, z
    return M


def defect(M: Matrix) -> Matrix:
    """M^T M - I, which is nothing for a rotation."""
    gram = eq.product(eq.transposed(M), M)
    x, y, z = (eq.minus(row, unit) for row, unit in zip(gram, IDENTITY, strict=True))
    return x, y, z


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


def read_exact(
    text: str, tree: KinematicTree, context: Context = mp, among: Iterable[int] | None = None
) -> dict[int, ExactJoint]:
    """The joints of a tree, by their numbers there, from the URDF text it was read from.

    Args:
        text: The URDF.
        tree: The same, read; a joint `root_joint` that it was hung from is not in the text.
        context: The kind of number.
        among: Numbers of the joints that are wanted; None: all.

    Raises:
        InputError: the text and the tree are not of the same robot.
    """
    words = _Text(text, tree.name, context)
    return {i: words.joint_of(tree.joints[i]) for i in (range(len(tree.joints)) if among is None else among)}


class _Text:
    """The joints of a text, their numbers of one kind."""

    def __init__(self, text: str, name: str, context: Context) -> None:
        root = plain_xml(text)
        self.name, self.context = name, context
        self.elements = {str(element.get("name")): element for element in root.findall("joint")}
        self.quaternions = tuple(map(int, root.get("version", "1.0").split("."))) >= _WITH_QUATERNIONS

    def joint_of(self, joint: Joint) -> ExactJoint:
        element = self.elements.get(joint.name)
        if element is not None:
            return self.joint(element, turns_or_slides=joint.kind.has_axis, follows=joint.mimic is not None)
        if joint.kind in (JointKind.FLOATING, JointKind.PLANAR):
            return ExactJoint(IDENTITY, ZERO, IDENTITY[0], 1, 0)
        raise InputError("a joint is not in the URDF text", where=self.name, found=joint.name)

    def joint(self, element: Element, *, turns_or_slides: bool, follows: bool) -> ExactJoint:
        axis = self.vector(element.find("axis"), "xyz", "1 0 0")
        multiplier, offset = self.rule(str(element.get("name"))) if follows else (1, 0)
        return ExactJoint(
            R=self.rotation(element.find("origin")),
            p=self.vector(element.find("origin"), "xyz", "0 0 0"),
            axis=unit(axis, self.context) if turns_or_slides else axis,
            multiplier=multiplier,
            offset=offset,
        )

    def numbers(self, element: Element | None, name: str, default: str) -> tuple[Number, ...]:
        written = default if element is None else element.get(name, default)
        return tuple(self.context.mpf(word) for word in written.split())

    def vector(self, element: Element | None, name: str, default: str) -> Vector:
        x, y, z = self.numbers(element, name, default)
        return x, y, z

    def rotation(self, origin: Element | None) -> Matrix:
        """From roll, pitch and yaw, or the quaternion, of any length, that URDF 1.1 has in their place."""
        if self.quaternions and origin is not None and "quat_xyzw" in origin.attrib:
            return from_quaternion(self.numbers(origin, "quat_xyzw", ""), self.context)
        return from_rpy(self.vector(origin, "rpy", "0 0 0"), self.context)

    def rule(self, name: str) -> tuple[Number, Number]:
        """Multiplier and offset of a follower, chains followed to the joint that moves."""
        multiplier, offset = self.context.mpf(1), self.context.mpf(0)
        elements = self.elements
        while (rule := elements[name].find("mimic")) is not None and elements[name].get("type") != "fixed":
            (factor,), (constant,) = self.numbers(rule, "multiplier", "1"), self.numbers(rule, "offset", "0")
            multiplier, offset = multiplier * factor, offset + multiplier * constant
            name = str(rule.get("joint"))
        return multiplier, offset
