"""Interval arithmetic, and a reader of the exact decimals of a URDF text.

An interval consists of a midpoint with many digits, and a radius. The library Arb (python-flint) guarantees
that the result of each sum, product, quotient, root, sine and cosine contains the true value. Vectors are
triples of intervals.

`read_exact_joints` reads the decimals of a URDF text without rounding them. `urdfkin.urdf.lint` has already
checked the text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal, localcontext
from functools import lru_cache
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from flint import arb, ctx

from urdfkin.errors import InputError
from urdfkin.kinematics import equations as eq
from urdfkin.model.recursion import IDENTITY, ZERO, Matrix, Number, Vector
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Lock
from urdfkin.system.locks import make_fork_safe_lock
from urdfkin.system.plain_xml import parse_xml
from urdfkin.verify.bounds import DecimalErrors

#: Number of decimal digits of reference values; long paths need more (`enough_digits`). A double has about 16
#: digits, so 50 digits are enough to measure the rounding errors of doubles.
REFERENCE_DIGITS = 50
#: Number of decimal digits of intervals on a path without joints (`enough_digits`).
_BASE_DIGITS = 30
_BITS_PER_DIGIT = math.log2(10.0)
#: Additional bits for each number of digits. An interval of 15 digits has 50 + 5 = 55 bits. With 53 bits, an
#: interval could be four times as wide as the distance between neighbouring doubles.
_ADDITIONAL_BITS = 5
#: A decimal of 17 digits determines every double.
_SIGNIFICANT_DIGITS = 17
#: Number of digits in `format_decimal` before the result is rounded to 17 digits.
_INTERMEDIATE_DIGITS = 200
#: Additional bits of precision for the Newton steps in `nearest_rotation`.
_NEWTON_BITS = 30

_precision_lock = make_fork_safe_lock()


def enough_digits(joint_count: int) -> int:
    """Return the number of digits that makes an interval narrower than the last digit of a double.

    A joint with an oblique axis makes an interval about twice as wide. Each joint therefore adds one digit,
    which makes the interval ten times narrower.
    """
    return _BASE_DIGITS + joint_count


@contextmanager
def precision(digits: int) -> Iterator[None]:
    """Compute with `digits` decimal digits inside a `with` block.

    Arb has one global precision, so only one thread at a time can execute such a block.
    """
    with _precision_lock, ctx.workprec(math.ceil(digits * _BITS_PER_DIGIT) + _ADDITIONAL_BITS):
        yield


def as_interval(value: Number) -> Number:
    """Make an interval. The interval of a double or an integer has width 0."""
    return arb(value)


def interval_ends(x: Number) -> tuple[float, float]:
    """Return both ends, rounded outward to doubles."""
    # This shortcut saves time, because x is usually the integer 0.
    if isinstance(x, int):
        return float(x), float(x)
    return _round_outward(x.lower(), -math.inf), _round_outward(x.upper(), math.inf)


def _round_outward(end: arb, towards: float) -> float:
    rounded = float(end)
    is_inside = arb(rounded) > end if towards < 0.0 else arb(rounded) < end
    return math.nextafter(rounded, towards) if is_inside else rounded


def format_decimal(x: Number, negligible: float) -> str | None:
    """Return an interval's midpoint as a decimal of 17 digits, or None if the interval is too wide.

    An interval that contains 0 is too wide if its radius is above 1e-10 `negligible`. Otherwise, its decimal
    is "0". Any other interval is too wide if its radius is above 1e-20 |midpoint|. Otherwise, its decimal
    differs from the true value by at most 0.501 units of the last digit.

    >>> with precision(50):
    ...     [format_decimal(x, 1e-15) for x in (as_interval(1) / 3, as_interval(2), arb(0.0, 1e-40))]
    ['0.33333333333333333', '2', '0']
    """
    if isinstance(x, int):
        return str(x)
    middle, radius = x.mid(), x.rad()
    if x.contains(0):
        return "0" if radius <= 1e-10 * negligible else None
    if not radius <= abs(middle) * 1e-20:
        return None
    digits, power = middle.man_exp()
    with localcontext(prec=_INTERMEDIATE_DIGITS):
        number = int(digits) * Decimal(2) ** int(power)
    with localcontext(prec=_SIGNIFICANT_DIGITS, rounding=ROUND_HALF_EVEN):
        rounded = (+number).normalize()
    return f"{rounded:f}" if -7 < rounded.adjusted() < _SIGNIFICANT_DIGITS else str(rounded)


class NumberType(NamedTuple):
    """Arithmetic functions for a number type."""

    number: Callable[[str | float], Number]
    sine_cosine: Callable[[Number], tuple[Number, Number]]
    root: Callable[[Number], Number]


INTERVALS = NumberType(
    as_interval, lambda angle: as_interval(angle).sin_cos(), lambda x: as_interval(x).sqrt()
)


def normalise(x: Vector, kind: NumberType = INTERVALS) -> Vector:
    length = kind.root(eq.dot(x, x))
    return x[0] / length, x[1] / length, x[2] / length


def rotation_about(axis: Vector, angle: Number, kind: NumberType = INTERVALS) -> Matrix:
    """Return the rotation about a unit axis (eq. 7.28)."""
    s, c = kind.sine_cosine(angle)
    columns = (
        eq.plus(
            eq.plus(eq.times(c, e), eq.times((1 - c) * eq.dot(axis, e), axis)), eq.times(s, eq.cross(axis, e))
        )
        for e in IDENTITY
    )
    found: Matrix = eq.transposed(tuple(columns))
    return found


def rotation_from_rpy(rpy: Vector, kind: NumberType = INTERVALS) -> Matrix:
    x, y, z = ((*kind.sine_cosine(angle), 0, 1) for angle in rpy)
    found: Matrix = eq.product(eq.product(eq.about_z(*z), eq.about_y(*y)), eq.about_x(*x))
    return found


def rotation_from_quaternion(quaternion: Sequence[Number], kind: NumberType = INTERVALS) -> Matrix:
    """Return the rotation of a quaternion (x, y, z, w) of any length."""
    length = kind.root(sum(x * x for x in quaternion))
    found: Matrix = eq.rotation_of_quaternion(*(x / length for x in quaternion))
    return found


def nearest_rotation(M: Matrix) -> Matrix:
    """Return the rotation nearest to M.

    M must be nearly a rotation.

        M = U H: polar decomposition, U is the nearest rotation
        X - X (X^T X - I)/2: step of Newton's iteration, doubles the number of correct digits
        X = U (I + E): result, with the same orthogonal factor U as M
        E is symmetric: X^T X - I = 2 E + E^2
        eigenvalues of E > -1: |E| <= |2 E + E^2|
        |X - U| <= |X^T X - I|: added to the radius of each interval
    """
    with ctx.workprec(ctx.prec + _NEWTON_BITS):
        for _ in range(6):
            steps = eq.product(M, _compute_gram_residual(M))
            x, y, z = (eq.minus(row, eq.times(0.5, step)) for row, step in zip(M, steps, strict=True))
            M = x, y, z
        bound = arb(0, sum(abs(number) for row in _compute_gram_residual(M) for number in row).upper())
        x, y, z = ((a + bound, b + bound, c + bound) for a, b, c in M)
    return x, y, z


def _compute_gram_residual(M: Matrix) -> Matrix:
    """Return M^T M - I."""
    gram = eq.product(eq.transposed(M), M)
    x, y, z = (eq.minus(row, unit) for row, unit in zip(gram, IDENTITY, strict=True))
    return x, y, z


#: First URDF version with the attribute `quat_xyzw`; older versions ignore it.
_FIRST_QUATERNION_VERSION = (1, 1)


@dataclass(frozen=True, slots=True)
class ExactJoint:
    """The numbers of a joint, from the exact decimals of the URDF text.

    By default, the numbers are intervals.

    Attributes:
        R: Rotation in the parent link.
        p: Origin in the parent link, m.
        axis: Unit vector in the joint frame.
        multiplier: Multiplier of the mimic rule, or 1.
        offset: Offset of the mimic rule, or 0.
    """

    R: Matrix
    p: Vector
    axis: Vector
    multiplier: Number
    offset: Number


def read_exact_joints(
    text: str, tree: KinematicTree, joint_indices: Iterable[int] | None = None, kind: NumberType = INTERVALS
) -> dict[int, ExactJoint]:
    exact_text = _ExactText(text, kind)
    indices = range(len(tree.joints)) if joint_indices is None else joint_indices
    return {i: exact_text.read_joint(tree.joints[i], tree.name) for i in indices}


def conversion_errors(text: str, tree: KinematicTree, path: Sequence[int], q: FloatArray) -> DecimalErrors:
    return _ExactText(text).conversion_errors(tree, path, q)


# The last URDF is cached, because parsing a large URDF is slower than computing one sample.
@lru_cache(maxsize=1)
class _ExactText:
    def __init__(self, text: str, kind: NumberType = INTERVALS) -> None:
        self.kind = kind
        root = parse_xml(text)
        self.elements = {str(element.get("name")): element for element in root.findall("joint")}
        self.reads_quaternions = (
            tuple(map(int, root.get("version", "1.0").split("."))) >= _FIRST_QUATERNION_VERSION
        )

    def read_joint(self, joint: Joint, robot_name: str) -> ExactJoint:
        if joint.lock is not None:
            return self.apply_lock(self.read_joint(joint.lock.joint, robot_name), joint.lock)
        element = self.elements.get(joint.name)
        if element is not None:
            return self.parse_joint(element, has_axis=joint.kind.has_axis, is_mimic=joint.mimic is not None)
        if joint.kind in (JointKind.FLOATING, JointKind.PLANAR):
            return ExactJoint(IDENTITY, ZERO, IDENTITY[0], 1, 0)
        raise InputError("a joint is not in the URDF text", where=robot_name, found=joint.name)

    def apply_lock(self, free: ExactJoint, lock: Lock) -> ExactJoint:
        R, p = free.R, free.p
        value = free.multiplier * self.kind.number(lock.q) + free.offset
        if lock.joint.kind.turns:
            R = eq.product(R, rotation_about(free.axis, value, self.kind))
        else:
            p = eq.plus(p, eq.rotate(R, eq.times(value, free.axis)))
        return ExactJoint(R, p, free.axis, 1, 0)

    def parse_joint(self, element: Element, *, has_axis: bool, is_mimic: bool) -> ExactJoint:
        axis = self.parse_vector(element.find("axis"), "xyz", "1 0 0")
        multiplier, offset = self.resolve_rule(str(element.get("name"))) if is_mimic else (1, 0)
        return ExactJoint(
            R=self.parse_rotation(element.find("origin")),
            p=self.parse_vector(element.find("origin"), "xyz", "0 0 0"),
            axis=normalise(axis, self.kind) if has_axis else axis,
            multiplier=multiplier,
            offset=offset,
        )

    def parse_numbers(self, element: Element | None, name: str, default: str) -> tuple[Number, ...]:
        text = default if element is None else element.get(name, default)
        return tuple(map(self.kind.number, text.split()))

    def parse_vector(self, element: Element | None, name: str, default: str) -> Vector:
        x, y, z = self.parse_numbers(element, name, default)
        return x, y, z

    def has_quaternion(self, origin: Element | None) -> bool:
        return self.reads_quaternions and origin is not None and "quat_xyzw" in origin.attrib

    def parse_rotation(self, origin: Element | None) -> Matrix:
        if origin is not None and self.has_quaternion(origin):
            return rotation_from_quaternion(self.parse_numbers(origin, "quat_xyzw", ""), self.kind)
        return rotation_from_rpy(self.parse_vector(origin, "rpy", "0 0 0"), self.kind)

    def resolve_rule(self, name: str) -> tuple[Number, Number]:
        """Return M and C so that the joint's value is M q + C for the independent joint's q."""
        multiplier, offset = self.kind.number(1.0), self.kind.number(0.0)
        elements = self.elements
        while (rule := elements[name].find("mimic")) is not None and elements[name].get("type") != "fixed":
            (factor,), (constant,) = (
                self.parse_numbers(rule, "multiplier", "1"),
                self.parse_numbers(rule, "offset", "0"),
            )
            multiplier, offset = multiplier * factor, offset + multiplier * constant
            name = str(rule.get("joint"))
        return multiplier, offset

    def conversion_errors(self, tree: KinematicTree, path: Sequence[int], q: FloatArray) -> DecimalErrors:
        values: dict[str, Any] = {
            joint.name: q[:, i] for joint, i in zip(tree.joints, tree.q_index, strict=True) if joint.nq == 1
        }
        values |= {
            joint.name: joint.lock.q for joint in tree.joints if joint.lock and not joint.lock.joint.mimic
        }
        angles, rules, lengths, step = np.zeros(len(q)), 0, [0.0], 0
        for i in path:
            joint, unlocked = tree.joints[i], tree.joints[i].original
            if (element := self.elements.get(joint.name)) is not None:
                origin = element.find("origin")
                if not self.has_quaternion(origin):
                    angles += math.fsum(abs(float(x)) for x in self.parse_numbers(origin, "rpy", "0")) / 2.0
                if unlocked.mimic is not None:
                    value = self.bound_value(joint.name, values)
                    rules += value.rule_count
                    if unlocked.kind.turns:
                        angles += value.error + 0.5 * (value.rule_count - 1) * (
                            value.scaled_coordinate + value.offset
                        )
                    elif joint.lock is None:
                        lengths[step] += max(0.0, value.offset - abs(unlocked.mimic.offset))
                    else:
                        lengths[step] += max(
                            0.0, value.scaled_coordinate + value.offset - abs(joint.lock.value)
                        )
            if joint.kind.nv:
                lengths.append(0.0)
                step += 1
        return DecimalErrors(angles, rules, np.array(lengths))

    def bound_value(self, name: str, values: Mapping[str, Any]) -> _ValueBound:
        """Bound a joint's value, given the values of the independent joints."""
        rule = self.elements[name].find("mimic")
        if rule is None or name in values:
            return _ValueBound(abs(values[name]), 0.0, 0.0, 0)
        m, c = abs(float(rule.get("multiplier", "1"))), abs(float(rule.get("offset", "0")))
        x = self.bound_value(str(rule.get("joint")), values)
        error = m * x.error + 1.5 * m * (x.scaled_coordinate + x.offset) + c
        return _ValueBound(m * x.scaled_coordinate, m * x.offset + c, error, x.rule_count + 1)


class _ValueBound(NamedTuple):
    """Bounds on a joint's value M q + C.

    C has one term for each mimic rule.

    Attributes:
        scaled_coordinate: |M q|.
        offset: Sum of the absolute values of the terms of C.
        error: Rounding error, in eps, of a program that applies the rules one after the other.
    """

    scaled_coordinate: Any
    offset: float
    error: Any
    rule_count: int
