"""Check the axes of joints: without a direction, not a unit vector, not used, or changed by Pinocchio."""

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

#: Range of lengths whose square neither underflows nor overflows.
SHORTEST, LONGEST = 1e-150, 1e150

#: A smaller difference of the length from one is rounding of the last digits: a note.
ROUNDING = 2e-4

#: Tolerance of a unit vector's length, the same as in `kinematics.inputs`.
_ONE = 1e-12

#: Relative tolerance within which the axis of a planar joint is z.
_LEAN = 1e-9

#: Tolerance within which Pinocchio replaces an axis by a coordinate axis; Eigen's isApprox compares squares.
_SNAPPED = 1e-12

#: A smaller tilt (rad) is within the rounding that `verify.bounds` allows for an axis of Pinocchio.
_TILT = 2.0**-52


def check_axes(report: Reporter, robot: RobotRecord) -> None:
    """Report axes without a direction, axes that are not unit vectors, and axes that are not used."""
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
            fix=lambda: None if _snap(unit) else report.rewritten(element, "xyz", written),
            severity=Severity.NOTE if abs(length - 1.0) < ROUNDING else None,
            weight=abs(length - 1.0),
        )
    _check_snapped(report, joint, joint.axis, joint.axis_element)


def unit_vector(vector: Sequence[float]) -> tuple[float, ...]:
    """Divide a vector by its length, with one rounding per number (at most 2**-53 rad of direction).

    >>> unit_vector((0.0, -3.0, 4.0))
    (0.0, -0.6, 0.8)
    """
    with localcontext(prec=60):
        numbers = [Decimal(x) for x in vector]
        length = sum((x * x for x in numbers), Decimal(0)).sqrt()
        return tuple(float(x / length) + 0.0 for x in numbers)  # + 0.0: no minus before zero


def _check_snapped(report: Reporter, joint: JointRecord, axis: Sequence[float], element: Element) -> None:
    if snapped := _snap(axis):
        unit, tilt = snapped
        written = " ".join(f"{x:g}" for x in unit)
        report.add(
            NEARLY_COORDINATE_AXIS,
            f"the axis differs from {written} by {tilt:.2g} rad, and Pinocchio uses {written}",
            element,
            attribute="xyz",
            found=_written(joint),
            remedy=f'write xyz="{written}"; if you mean the tilt, write the vector twice as long',
            weight=tilt,
        )


def tilts(robot: RobotRecord) -> dict[str, float]:
    """Return the angle (rad) between the axis in Pinocchio and in the file, for joints with URDF514."""
    snapped = ((joint.name, _snap(joint.axis)) for joint in robot.joints if joint.kind in AXIAL)
    return {name: result[1] for name, result in snapped if result is not None}


def _snap(axis: Sequence[float] | None) -> tuple[tuple[float, ...], float] | None:
    """Return the coordinate axis that Pinocchio uses instead of an axis, and their angle (rad), or None."""
    if axis is None:
        return None
    for i in range(3):
        unit = tuple(float(i == k) for k in range(3))
        tilt = math.hypot(*(x for k, x in enumerate(axis) if k != i))
        if tilt > _TILT and _is_approx(axis, unit):
            return unit, tilt
    return None


def _is_approx(axis: Sequence[float], unit: Sequence[float]) -> bool:
    """Compute Eigen's `axis.isApprox(unit)`, with the same order of operations."""
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
        remedy='rotate the origin so that the normal is z, and write <axis xyz="0 0 1"/>',
    )
