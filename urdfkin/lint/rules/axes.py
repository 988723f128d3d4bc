"""Axes of joints: those without a direction, of another length than one, and those that are not used."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext

from urdfkin.lint.finding import Severity, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, NOTE, WARNING, Rule
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import AXIAL, JointRecord, RobotRecord

NO_DIRECTION = Rule("URDF502", "axis-without-direction", ERROR)
AXIS_LENGTH = Rule("URDF503", "axis-not-unit", WARNING)
PLANAR_AXIS = Rule("URDF505", "planar-axis", WARNING)
NEARLY_COORDINATE_AXIS = Rule("URDF514", "nearly-coordinate-axis", NOTE)

#: Lengths whose square neither under- nor overflows.
SHORTEST, LONGEST = 1e-150, 1e150

#: A length that differs from one by less is rounding of the last digits and worth a note at most.
ROUNDING = 2e-4

#: A length that is one as far as normalised doubles tell, as `kinematics.inputs` has it.
_ONE = 1e-12

#: How far a planar joint's axis may lean from z, as a share of it, and be meant as z.
_LEAN = 1e-9

#: What Pinocchio takes for a coordinate axis: Eigen's isApprox compares squares with the square of this.
_SNAPPED = 1e-12

#: A tilt that turns vectors by no more than the two roundings that `verify.bounds` grants Pinocchio for
#: an axis, which it does not use for a coordinate axis.
_TILT = 2.0**-52


def check_axes(report: Reporter, robot: RobotRecord) -> None:
    """Axes that have no direction, are no unit vectors or are not used."""
    for joint in robot.joints:
        if joint.kind in AXIAL:
            _check_axis(report, joint)
        elif joint.kind == "planar":
            _check_planar(report, joint)


def _written(joint: JointRecord) -> str:
    axis = joint.axis_element
    return f"xyz={quoted(axis.attributes.get('xyz', ''))}" if axis is not None else 'the default "1 0 0"'


def _check_axis(report: Reporter, joint: JointRecord) -> None:
    if joint.axis is None or joint.axis_element is None:
        return
    length = math.hypot(*joint.axis)
    if not SHORTEST < length < LONGEST:
        what = "is zero" if length == 0.0 else f"has no usable length ({length:.3g})"
        report.add(
            NO_DIRECTION,
            f"the axis {what}",
            joint.axis_element,
            attribute="xyz",
            found=_written(joint),
            remedy='write a unit vector, such as xyz="0 0 1"',
        )
    elif abs(length - 1.0) > _ONE:
        unit = unit_vector(joint.axis)
        written = " ".join(repr(x).removesuffix(".0") for x in unit)
        element = joint.axis_element
        report.add(
            AXIS_LENGTH,
            f"the axis has length {length:.9g} and is normalised",
            element,
            attribute="xyz",
            found=_written(joint),
            remedy=f'write xyz="{written}"',
            fix=lambda: None if _snapped(unit) else report.rewritten(element, "xyz", written),
            severity=Severity.NOTE if abs(length - 1.0) < ROUNDING else None,
            weight=abs(length - 1.0),
        )
    _check_snapped(report, joint, joint.axis, joint.axis_element)


def unit_vector(vector: Sequence[float]) -> tuple[float, ...]:
    """A vector divided by its length, each number rounded once: it tilts by 2**-53 rad at most.

    >>> unit_vector((0.0, -3.0, 4.0))
    (0.0, -0.6, 0.8)
    """
    with localcontext(prec=60):
        numbers = [Decimal(x) for x in vector]
        length = sum((x * x for x in numbers), Decimal(0)).sqrt()
        return tuple(float(x / length) + 0.0 for x in numbers)  # + 0.0: no minus before zero


def _check_snapped(report: Reporter, joint: JointRecord, axis: Sequence[float], element: Element) -> None:
    if snapped := _snapped(axis):
        unit, tilt = snapped
        written = " ".join(f"{x:g}" for x in unit)
        report.add(
            NEARLY_COORDINATE_AXIS,
            f"the axis is {tilt:.2g} rad off {written}, and Pinocchio takes {written}",
            element,
            attribute="xyz",
            found=_written(joint),
            remedy=f'write xyz="{written}"; if the tilt is meant, write the vector twice as long',
            weight=tilt,
        )


def tilts(robot: RobotRecord) -> dict[str, float]:
    """By how much (rad) Pinocchio's axis is off the file's, for the joints where that is a finding."""
    snapped = ((joint.name, _snapped(joint.axis)) for joint in robot.joints if joint.kind in AXIAL)
    return {name: taken[1] for name, taken in snapped if taken is not None}


def _snapped(axis: Sequence[float] | None) -> tuple[tuple[float, ...], float] | None:
    """The coordinate axis that Pinocchio takes for another one, and how far off it is; mostly None."""
    if axis is None:
        return None
    for i in range(3):
        unit = tuple(float(i == k) for k in range(3))
        tilt = math.hypot(*(x for k, x in enumerate(axis) if k != i))
        if tilt > _TILT and _is_approx(axis, unit):
            return unit, tilt
    return None


def _is_approx(axis: Sequence[float], unit: Sequence[float]) -> bool:
    """Eigen's `axis.isApprox(unit)`, square by square in its order."""
    difference = sum((x - e) * (x - e) for x, e in zip(axis, unit, strict=True))
    return difference <= _SNAPPED * _SNAPPED * min(sum(x * x for x in axis), 1.0)


def _check_planar(report: Reporter, joint: JointRecord) -> None:
    x, y, z = joint.axis or (0.0, 0.0, 0.0)
    if z > 0.0 and math.hypot(x, y) <= _LEAN * z:
        return
    at = joint.axis_element or joint.element
    report.add(
        PLANAR_AXIS,
        "a planar joint moves in the XY plane of its frame, whatever its axis says",
        at,
        attribute="xyz",
        found=_written(joint),
        remedy='turn the origin so that the normal is z, and write <axis xyz="0 0 1"/>',
    )
