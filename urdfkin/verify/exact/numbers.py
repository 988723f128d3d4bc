"""Vectors and rotations of exact numbers, and the exact decimals of a URDF text.

A context determines the kind of number: `mp` of mpmath for fifty digits, `urdfkin.verify.exact.intervals` for
intervals. Vectors are triples of numbers.

`read_exact` reads the decimals of a URDF text without rounding them to doubles. Names and order of the joints
come from the tree. `urdfkin.lint` has already checked the text.
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

#: Number of digits in the accuracy study. A double has 16 digits, so fifty digits are enough to measure an
#: error in its last digit.
DIGITS = 50

#: A separate mpmath context, so that urdfkin does not change the precision of mpmath's global context.
mp = mpmath.mp.clone()
mp.dps = DIGITS

Context = Any
Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

# A vector of integers can be combined with every kind of number.
ZERO: Vector = (0, 0, 0)
IDENTITY: Matrix = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def exact(value: float, context: Context = mp) -> Number:
    """Return the exact value of a double."""
    return context.mpf(float(value))


def unit(x: Vector, context: Context) -> Vector:
    """Return `x` divided by its length."""
    length = context.sqrt(eq.dot(x, x))
    return x[0] / length, x[1] / length, x[2] / length


def about(axis: Vector, angle: Number, context: Context) -> Matrix:
    """Return the rotation about a unit axis, R_k(phi) (eq. 7.28)."""
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
    """Return Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = ((sine, cosine, 0, 1) for cosine, sine in map(context.cos_sin, rpy))
    found: Matrix = eq.product(eq.product(eq.about_z(*z), eq.about_y(*y)), eq.about_x(*x))
    return found


def from_quaternion(quaternion: tuple[Number, ...], context: Context) -> Matrix:
    """Return the rotation of a quaternion (x, y, z, w) of any length."""
    length = context.sqrt(sum(x * x for x in quaternion))
    found: Matrix = eq.rotation_of_quaternion(*(x / length for x in quaternion))
    return found


def nearest_rotation(M: Matrix) -> Matrix:
    """Return the rotation nearest to M. It is the orthogonal factor U of the polar decomposition M = U H.

    M must be close to a rotation. Each step of Newton's iteration X - X (X^T X - I)/2 doubles the number of
    correct digits.
    """
    for _ in range(6):
        x, y, z = (
            eq.minus(row, eq.times(0.5, step)) for row, step in zip(M, eq.product(M, defect(M)), strict=True)
        )
        M = x, y, z
    return M


def defect(M: Matrix) -> Matrix:
    """Return M^T M - I, which is 0 for a rotation."""
    gram = eq.product(eq.transposed(M), M)
    x, y, z = (eq.minus(row, unit) for row, unit in zip(gram, IDENTITY, strict=True))
    return x, y, z


#: First URDF version with `quat_xyzw`; in older files it is ignored.
_WITH_QUATERNIONS = (1, 1)


@dataclass(frozen=True, slots=True)
class ExactJoint:
    """The exact numbers of one joint in the text.

    Attributes:
        R: Orientation of the joint frame relative to its parent.
        p: Position of the joint frame relative to its parent, m.
        axis: Unit axis in the joint frame.
        multiplier: Multiplier of a mimic joint, else 1.
        offset: Offset of a mimic joint, else 0.
    """

    R: Matrix
    p: Vector
    axis: Vector
    multiplier: Number
    offset: Number


def read_exact(
    text: str, tree: KinematicTree, context: Context = mp, among: Iterable[int] | None = None
) -> dict[int, ExactJoint]:
    """Return the exact numbers of joints by their index in the tree, from the URDF text.

    Args:
        text: The URDF text.
        tree: The tree of the same text. Its `root_joint`, if any, is not in the text.
        context: The number context.
        among: Indices of the joints to read; None: all.

    Raises:
        InputError: a joint of the tree is not in the text.
    """
    words = _Text(text, tree.name, context)
    return {i: words.joint_of(tree.joints[i]) for i in (range(len(tree.joints)) if among is None else among)}


class _Text:
    """Reader of the joints of a URDF text in one number context."""

    def __init__(self, text: str, name: str, context: Context) -> None:
        root = plain_xml(text)
        self.name, self.context = name, context
        self.elements = {str(element.get("name")): element for element in root.findall("joint")}
        self.quaternions = tuple(map(int, root.get("version", "1.0").split("."))) >= _WITH_QUATERNIONS

    def joint_of(self, joint: Joint) -> ExactJoint:
        element = self.elements.get(joint.name)
        if element is not None:
            return self.joint(element, has_axis=joint.kind.has_axis, is_mimic=joint.mimic is not None)
        if joint.kind in (JointKind.FLOATING, JointKind.PLANAR):
            return ExactJoint(IDENTITY, ZERO, IDENTITY[0], 1, 0)
        raise InputError("a joint is not in the URDF text", where=self.name, found=joint.name)

    def joint(self, element: Element, *, has_axis: bool, is_mimic: bool) -> ExactJoint:
        axis = self.vector(element.find("axis"), "xyz", "1 0 0")
        multiplier, offset = self.rule(str(element.get("name"))) if is_mimic else (1, 0)
        return ExactJoint(
            R=self.rotation(element.find("origin")),
            p=self.vector(element.find("origin"), "xyz", "0 0 0"),
            axis=unit(axis, self.context) if has_axis else axis,
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
        """Return the rotation of rpy or, from URDF 1.1 on, of `quat_xyzw`, a quaternion of any length."""
        if self.quaternions and origin is not None and "quat_xyzw" in origin.attrib:
            return from_quaternion(self.numbers(origin, "quat_xyzw", ""), self.context)
        return from_rpy(self.vector(origin, "rpy", "0 0 0"), self.context)

    def rule(self, name: str) -> tuple[Number, Number]:
        """Return multiplier and offset of a mimic joint relative to the independent joint."""
        multiplier, offset = self.context.mpf(1), self.context.mpf(0)
        elements = self.elements
        while (rule := elements[name].find("mimic")) is not None and elements[name].get("type") != "fixed":
            (factor,), (constant,) = self.numbers(rule, "multiplier", "1"), self.numbers(rule, "offset", "0")
            multiplier, offset = multiplier * factor, offset + multiplier * constant
            name = str(rule.get("joint"))
        return multiplier, offset
