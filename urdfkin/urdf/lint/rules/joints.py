"""Check that joints connect all links in one tree, and have usable axes, limits and mimic rules.

Legal values that are probably mistakes are also reported: rounded pi, degrees, millimetres, equal joints. No
function is recursive, because a chain of 50,000 links would exceed Python's recursion limit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

from urdfkin.urdf import parser
from urdfkin.urdf.findings import ERROR, NOTE, REFUSES, WARNING, Fix, Reporter, Rule, Severity, quote
from urdfkin.urdf.parser import MAX_VECTOR_LENGTH, MIN_VECTOR_LENGTH
from urdfkin.urdf.records import (
    AXIAL_TYPES,
    FURTHER_LIMITS,
    Element,
    JointRecord,
    LimitRecord,
    MimicRecord,
    RobotRecord,
)

if TYPE_CHECKING:
    from urdfkin.model.tree import Mimic


UNKNOWN_LINK = Rule("URDF408", "unknown-link", ERROR)
SELF_PARENT = Rule("URDF409", "self-parent", ERROR)
SEVERAL_PARENTS = Rule("URDF410", "several-parents", ERROR)
SEVERAL_ROOTS = Rule("URDF411", "several-roots", ERROR)
CYCLE = Rule("URDF412", "cycle", ERROR)


def check_structure(report: Reporter, robot: RobotRecord) -> bool:
    """Return whether the joints connect all links in one tree."""
    edges = [joint for joint in robot.joints if _check_ends(report, robot, joint)]
    is_tree = len(edges) == len(robot.joints) and _check_loops_and_parents(report, robot, edges)
    return _check_root(report, robot) and is_tree and bool(robot.links)


def _check_ends(report: Reporter, robot: RobotRecord, joint: JointRecord) -> bool:
    for tag, link in (("parent", joint.parent), ("child", joint.child)):
        if link is not None and link not in robot.links:
            nearest = ", ".join(report.find_nearest_names(link, robot.links))
            message, at = f"the {tag} link does not exist", joint.element.find(tag)
            remedy = f"did you mean {nearest}?" if nearest else f"add <link name={quote(link)}/>"
            report.add(UNKNOWN_LINK, message, at, attribute="link", found=quote(link), remedy=remedy)
    if joint.parent is not None and joint.parent == joint.child:
        message, at = "the joint connects a link with itself", joint.element.find("child")
        remedy, found = "name another parent link or child link", quote(joint.parent)
        report.add(SELF_PARENT, message, at, attribute="link", found=found, remedy=remedy)
        return False
    return joint.parent in robot.links and joint.child in robot.links


def _check_loops_and_parents(report: Reporter, robot: RobotRecord, edges: list[JointRecord]) -> bool:
    """Report loops and links with several parents. Return True if there are none."""
    below = _joints_by_parent(edges)
    children = {joint.child for joint in edges}
    first: dict[str, JointRecord] = {}
    visited: set[str] = set()
    is_tree = True
    for start in [link for link in robot.links if link not in children] + list(robot.links):
        if start in visited:
            continue
        visited.add(start)
        path, stack = {start}, [(start, iter(below.get(start, ())))]
        while stack:
            link, pending = stack[-1]
            joint = next(pending, None)
            if joint is None:
                stack.pop()
                path.discard(link)
                continue
            child = joint.child or ""
            if child in visited:
                _report_repeat(report, joint, first.get(child), loop=child in path)
                is_tree = False
                continue
            visited.add(child)
            first[child] = joint
            path.add(child)
            stack.append((child, iter(below.get(child, ()))))
    return is_tree


def _joints_by_parent(joints: Iterable[JointRecord]) -> dict[str, list[JointRecord]]:
    below: dict[str, list[JointRecord]] = {}
    for joint in joints:
        below.setdefault(joint.parent or "", []).append(joint)
    return below


def _report_repeat(report: Reporter, joint: JointRecord, first: JointRecord | None, *, loop: bool) -> None:
    if loop:
        rule, remedy = CYCLE, "remove a joint of the loop; a URDF is a tree"
        parent = quote(joint.parent or "")
        message = f"the joint closes a loop: its child is an ancestor of its parent {parent}"
    else:
        other = f"joint {quote(first.name)} on line {first.element.line}" if first else "another joint"
        rule, remedy = SEVERAL_PARENTS, "a link has one parent; remove one of the joints"
        message = f"the child link is already the child of {other}"
    at, found = joint.element.find("child"), quote(joint.child or "")
    report.add(rule, message, at, attribute="link", found=found, remedy=remedy)


def _check_root(report: Reporter, robot: RobotRecord) -> bool:
    """Return whether exactly one link has no parent; report any further links without a parent."""
    children = {joint.child for joint in robot.joints}
    roots = [link for link in robot.links if link not in children]
    if not roots and robot.links and not report.has_errors:
        report.add(CYCLE, "no link is a root: every link is the child of a joint", robot.element)
    if len(roots) < 2:
        return len(roots) == 1
    # If the child link of a joint does not exist, a link without a parent may be the intended child, so it is
    # not reported.
    if not children <= robot.links.keys():
        return False
    parents = {joint.parent for joint in robot.joints}
    main = next((root for root in roots if root in parents), roots[0])
    for root in roots:
        if root != main:
            message = f"the link has no parent, and neither has {quote(main)}"
            remedy = "connect this link with a joint, or remove it"
            report.add(SEVERAL_ROOTS, message, robot.links[root], attribute="name", remedy=remedy)
    return False


NO_DIRECTION = Rule("URDF502", "axis-without-direction", ERROR)
AXIS_LENGTH = Rule("URDF503", "axis-not-unit", WARNING)
PLANAR_AXIS = Rule("URDF505", "planar-axis", WARNING)
NEARLY_COORDINATE_AXIS = Rule("URDF514", "nearly-coordinate-axis", NOTE)

#: If the length of an axis differs from 1 by less than this number, the finding is only a note, because the
#: axis is probably rounded to few digits.
NOTE_LENGTH_ERROR = 2e-4

#: Tolerance of a unit vector's length, as in `kinematics.inputs`.
_UNIT_LENGTH_TOLERANCE = 1e-12

#: An axis (x, y, z) counts as the z axis if z > 0 and |(x, y)| is at most this fraction of z.
_Z_AXIS_TOLERANCE = 1e-9

#: Pinocchio replaces an axis by a coordinate axis if their relative difference is at most this number. The
#: number is the default tolerance of Eigen's function `isApprox`.
_EIGEN_TOLERANCE = 1e-12

#: Largest angle (rad) between an axis and a coordinate axis that is not reported. The error bounds in
#: `verify.bounds` cover this angle.
_NEGLIGIBLE_TILT = 2.0**-52


def check_axes(report: Reporter, robot: RobotRecord) -> None:
    for joint in robot.joints:
        if joint.kind in AXIAL_TYPES:
            _check_axis(report, joint)
        elif joint.kind == "planar":
            _check_planar(report, joint)


def _axis_text(joint: JointRecord) -> str:
    axis = joint.axis_element
    if axis is None:
        return 'the default "1 0 0"'
    return f"xyz={quote(axis.attributes['xyz'])}" if "xyz" in axis.attributes else "<axis> without xyz"


def _check_axis(report: Reporter, joint: JointRecord) -> None:
    if joint.axis is None or joint.axis_element is None:
        return
    length = math.hypot(*joint.axis)
    if not MIN_VECTOR_LENGTH < length < MAX_VECTOR_LENGTH:
        what = "is zero" if length == 0.0 else f"has no usable length ({length:.3g})"
        message = f"the axis {what}"
        remedy = 'write a unit vector, such as xyz="0 0 1"'
        found = _axis_text(joint)
        report.add(NO_DIRECTION, message, joint.axis_element, attribute="xyz", found=found, remedy=remedy)
    elif abs(length - 1.0) > _UNIT_LENGTH_TOLERANCE:
        unit = unit_vector(joint.axis)
        written = " ".join(repr(x).removesuffix(".0") for x in unit)
        element = joint.axis_element
        report.add(
            AXIS_LENGTH,
            f"the axis has length {length:.9g} and is normalised",
            element,
            attribute="xyz",
            found=_axis_text(joint),
            remedy=f'write xyz="{written}"',
            fix=lambda: None if _find_snapped_axis(unit) else report.make_value_fix(element, "xyz", written),
            severity=Severity.NOTE if abs(length - 1.0) < NOTE_LENGTH_ERROR else None,
            weight=abs(length - 1.0),
        )
    _check_snapped_axis(report, joint, joint.axis, joint.axis_element)


def unit_vector(vector: Sequence[float]) -> tuple[float, ...]:
    """Divide a vector by its length; rounding rotates the result by at most 2**-53 rad."""
    with localcontext(prec=60):
        numbers = [Decimal(x) for x in vector]
        length = sum((x * x for x in numbers), Decimal(0)).sqrt()
        return tuple(float(x / length) + 0.0 for x in numbers)  # Adding 0.0 turns -0.0 into 0.0.


def _check_snapped_axis(
    report: Reporter, joint: JointRecord, axis: Sequence[float], element: Element
) -> None:
    if snapped := _find_snapped_axis(axis):
        unit, tilt = snapped
        written = " ".join(f"{x:g}" for x in unit)
        message = f"the axis differs from {written} by {tilt:.2g} rad, and Pinocchio uses {written}"
        remedy = f'write xyz="{written}", or double all three numbers: Pinocchio then keeps the tilt'
        report.add(
            NEARLY_COORDINATE_AXIS, message, element,
            attribute="xyz", found=_axis_text(joint), remedy=remedy, weight=tilt,
        )  # fmt: skip


def find_axis_tilts(robot: RobotRecord) -> dict[str, float]:
    """Return the angle (rad) between the axis in the file and Pinocchio's axis, by joint name.

    Joints with an angle of at most 2^-52 rad have no entry.
    """
    axial = (joint for joint in robot.joints if joint.kind in AXIAL_TYPES)
    return {joint.name: snapped[1] for joint in axial if (snapped := _find_snapped_axis(joint.axis))}


def _find_snapped_axis(axis: Sequence[float] | None) -> tuple[tuple[float, ...], float] | None:
    """Return the coordinate axis that Pinocchio uses instead of `axis`, and the angle (rad) between them.

    Return None if Pinocchio uses `axis` itself, or if the angle is at most `_NEGLIGIBLE_TILT`.
    """
    if axis is None:
        return None
    for i in range(3):
        unit = tuple(float(i == k) for k in range(3))
        tilt = math.hypot(*(x for k, x in enumerate(axis) if k != i))
        if tilt > _NEGLIGIBLE_TILT and _is_approx(axis, unit):
            return unit, tilt
    return None


def _is_approx(axis: Sequence[float], unit: Sequence[float]) -> bool:
    """Compute Eigen's `axis.isApprox(unit)`, with the same order of operations."""
    difference = sum((x - e) * (x - e) for x, e in zip(axis, unit, strict=True))
    return difference <= _EIGEN_TOLERANCE * _EIGEN_TOLERANCE * min(sum(x * x for x in axis), 1.0)


def _check_planar(report: Reporter, joint: JointRecord) -> None:
    x, y, z = joint.axis or (0.0, 0.0, 0.0)
    if z > 0.0 and math.hypot(x, y) <= _Z_AXIS_TOLERANCE * z:
        return
    at = joint.axis_element or joint.element
    message = "a planar joint moves in the XY plane of its frame, independent of <axis>"
    remedy = 'rotate the origin until its z axis is the normal of the plane, and write <axis xyz="0 0 1"/>'
    report.add(PLANAR_AXIS, message, at, attribute="xyz", found=_axis_text(joint), remedy=remedy)


INVERTED_LIMIT = Rule("URDF507", "inverted-limit", ERROR)
EMPTY_RANGE = Rule("URDF508", "empty-range", WARNING)
NEGATIVE_LIMIT = Rule("URDF509", "negative-limit", WARNING, REFUSES)


def check_ranges(report: Reporter, robot: RobotRecord) -> None:
    for joint in robot.joints:
        if joint.limit is not None:
            _check_limit(report, joint, joint.limit, robot.version)


def _check_limit(report: Reporter, joint: JointRecord, limit: LimitRecord, version: tuple[int, int]) -> None:
    strict = version >= (1, 2)  # From URDF 1.2, urdfdom checks the limits of all joint types.
    for attribute in ("effort", "velocity", *FURTHER_LIMITS):
        value = getattr(limit, attribute)
        if value is not None and value < 0.0:
            refused = strict or joint.kind in AXIAL_TYPES
            rule, effect = parser.IGNORED_VALUE, "ignores the limit"
            if refused:
                rule, effect = NEGATIVE_LIMIT, "refuses the file"
            message = f"the limit of {attribute} is negative; Pinocchio {effect}"
            remedy = "write the limit without its sign"
            found = quote(limit.element.attributes[attribute])
            report.add(rule, message, limit.element, attribute=attribute, found=found, remedy=remedy)
    if joint.kind == "continuous":
        _check_continuous(report, limit)
    bounded = joint.kind in ("revolute", "prismatic")
    written = {"lower", "upper"} & limit.element.attributes.keys()
    if not bounded and not (strict and len(written) == 2):
        return
    if any(getattr(limit, name) is None for name in written):
        return
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    found = f'lower="{lower:g}" upper="{upper:g}"' if written else "no limits, so both limits are 0"
    if lower > upper:
        message, remedy = "the lower limit is above the upper limit", "swap the limits"
        if len(written) < 2:
            found, remedy = f"{found} (the default of a limit is 0)", "write both limits"
        report.add(INVERTED_LIMIT, message, limit.element, attribute="lower", found=found, remedy=remedy)
    elif lower == upper and bounded:
        message = "the joint cannot move: its limits are equal"
        remedy = "write two different limits, or make the joint fixed"
        report.add(EMPTY_RANGE, message, limit.element, attribute="lower", found=found, remedy=remedy)


def _check_continuous(report: Reporter, limit: LimitRecord) -> None:
    written = [name for name in ("lower", "upper") if name in limit.element.attributes]
    if any(getattr(limit, name) for name in written):
        report.add(
            parser.IGNORED_VALUE,
            "a continuous joint has no position limits; the limits are ignored",
            limit.element,
            attribute=written[0],
            found=_bounds_text(limit),
            remedy='remove the limits, or write type="revolute"',
            fix=lambda: report.make_removal_fix(limit.element, *written),
        )


MIMIC_UNKNOWN = Rule("URDF520", "mimic-unknown", ERROR)
MIMIC_LOOP = Rule("URDF521", "mimic-loop", ERROR)
MIMICKED_JOINT = Rule("URDF522", "mimicked-joint", ERROR)
MIMIC_CONSTANT = Rule("URDF523", "mimic-constant", WARNING)
MIMIC_CONTINUOUS = Rule("URDF524", "mimic-continuous", WARNING)
MIMIC_CHAIN = Rule("URDF525", "mimic-chain", NOTE)
MIMIC_SCALE = Rule("URDF526", "mimic-scale", WARNING)
MIMIC_RANGE = Rule("URDF527", "mimic-range", WARNING)

#: Largest plausible multiplier or offset (rad or m) of a mimic joint.
MAX_MIMIC_NUMBER = 1e6
#: URDF527 reports limits that exclude more than this fraction of the mimicked joint's range. Limits with few
#: digits often exclude a smaller part.
NEGLIGIBLE_RANGE_LOSS = 1e-3


def check_mimic(report: Reporter, robot: RobotRecord, *, enabled: bool) -> None:
    checker = _MimicChecker(report, robot.joints_by_name, enabled)
    for joint in robot.joints:
        if joint.mimic is not None:
            checker.check(joint, joint.mimic)


class _MimicChecker:
    def __init__(self, report: Reporter, joints: dict[str, JointRecord], enabled: bool) -> None:
        self.report, self.joints, self.enabled = report, joints, enabled
        self.joints_in_loops = _joints_in_mimic_loops(joints)

    def add(
        self,
        code: Rule,
        message: str,
        mimic: MimicRecord,
        attribute: str,
        remedy: str,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        written = mimic.element.attributes.get(attribute)
        self.report.add(
            code,
            message,
            mimic.element,
            attribute=attribute,
            found=None if written is None else f"{attribute}={quote(written)}",
            remedy=remedy,
            severity=None if self.enabled else Severity.NOTE,
            fix=fix,
        )

    def check(self, joint: JointRecord, mimic: MimicRecord) -> None:
        if joint.kind == "fixed":
            message, remedy = "a fixed joint cannot mimic; <mimic> is ignored", "remove <mimic>"
            fix = partial(self.report.make_element_removal_fix, mimic.element)
            self.add(parser.IGNORED_VALUE, message, mimic, "joint", remedy, fix)
            return
        if joint.kind in ("planar", "floating"):
            message = f"a {joint.kind} joint has several coordinates and cannot mimic another joint"
            self.add(MIMICKED_JOINT, message, mimic, "joint", "remove <mimic>")
            return
        mimicked_joint = self.joints.get(mimic.mimicked_joint)
        if mimicked_joint is None:
            self.report_unknown(joint, mimic)
        elif joint.name in self.joints_in_loops:
            itself = mimicked_joint is joint
            message = "the joint mimics itself" if itself else "the joints mimic each other in a cycle"
            self.add(MIMIC_LOOP, message, mimic, "joint", "name a joint that is not a mimic joint")
        elif mimicked_joint.kind is not None and mimicked_joint.kind not in AXIAL_TYPES:
            count = "no coordinate" if mimicked_joint.kind == "fixed" else "several coordinates"
            message = f"the mimicked joint is {mimicked_joint.kind} and has {count}"
            self.add(MIMICKED_JOINT, message, mimic, "joint", "name a joint with one coordinate")
        else:
            self.check_rule(joint, mimic, mimicked_joint)

    def report_unknown(self, joint: JointRecord, mimic: MimicRecord) -> None:
        others = (name for name in self.joints if name != joint.name)
        nearest = self.report.find_nearest_names(mimic.mimicked_joint, others)
        remedy = f"did you mean {', '.join(nearest)}?" if nearest else "name a joint of the robot"
        if self.enabled:
            remedy += " (with mimic=False, --no-mimic, the joint moves freely)"
        self.add(MIMIC_UNKNOWN, "the mimicked joint does not exist", mimic, "joint", remedy)

    def check_rule(self, joint: JointRecord, mimic: MimicRecord, mimicked_joint: JointRecord) -> None:
        if mimic.multiplier == 0.0:
            message = f"the multiplier is zero: the joint stays at {mimic.offset:g}"
            remedy = "write a multiplier other than zero, or make the joint fixed"
            self.add(MIMIC_CONSTANT, message, mimic, "multiplier", remedy)
        for attribute, value in (("multiplier", mimic.multiplier), ("offset", mimic.offset)):
            if abs(value) > MAX_MIMIC_NUMBER:
                message = f"the {attribute} is far too large"
                self.add(MIMIC_SCALE, message, mimic, attribute, "check the exponent")
        if (joint.kind == "continuous") != (mimicked_joint.kind == "continuous"):
            name = "mimic" if joint.kind == "continuous" else "mimicked"
            message = f"Pinocchio with mimic=True refuses this rule: only the {name} joint is continuous"
            remedy = f'write type="revolute" for the {name} joint'
            self.add(MIMIC_CONTINUOUS, message, mimic, "joint", remedy)
        if mimicked_joint.mimic is not None:
            message = f"the mimicked joint itself mimics {mimicked_joint.mimic.mimicked_joint!r}"
            remedy = "name a joint that is not a mimic joint; some readers apply only one rule of a chain"
            self.add(MIMIC_CHAIN, message, mimic, "joint", remedy)
        if joint.limit is not None and max(abs(mimic.multiplier), abs(mimic.offset)) <= MAX_MIMIC_NUMBER:
            self.check_range(joint, mimic, joint.limit)

    def check_range(self, joint: JointRecord, mimic: MimicRecord, limit: LimitRecord) -> None:
        from urdfkin.model.configuration import format_range, restrict_range
        from urdfkin.model.tree import Limit

        rule, mimicked_joint = self.resolve_chain(mimic)
        limits, moving = _joint_range(joint), None if mimicked_joint is None else _joint_range(mimicked_joint)
        if mimicked_joint is None or moving is None or limits is None or joint.kind == "continuous":
            return
        bounds = Limit(*limits, math.inf, math.inf)
        least = 0.0 if rule.multiplier == 0.0 else (1.0 - NEGLIGIBLE_RANGE_LOSS) * (moving[1] - moving[0])

        def is_allowed(bounds: Limit) -> bool:
            low, high = restrict_range(rule, bounds, *moving)
            return low <= high and high - low >= least

        if is_allowed(bounds):
            return
        low, high = restrict_range(rule, bounds, *moving)
        # `restrict_range` subtracts a rounding error at both ends, so a range of one value becomes empty.
        # Therefore, each end of `moving` is tested alone.
        single = [f"only {end:.6g}" for end in moving if restrict_range(rule, bounds, end, end) == (end, end)]
        allowed = f"only {format_range((low, high))}" if low < high else (*single, "no value")[0]
        message = (
            f"the mimic joint leaves its limits: {mimicked_joint.name!r} moves from {format_range(moving)}, "
        )
        ends = sorted(rule.multiplier * end + rule.offset for end in moving)
        for digits in (6, 12, 17):  # With 17 digits, each number is exact.
            lower, upper = (f"{end:.{digits}g}" for end in ends)
            if is_allowed(Limit(float(lower), float(upper), math.inf, math.inf)):
                break
        self.report.add(
            MIMIC_RANGE,
            f"{message}but the limits of the mimic joint allow {allowed}",
            limit.element,
            attribute="lower",
            found=f'lower="{limits[0]:g}" upper="{limits[1]:g}"',
            remedy=f'write lower="{lower}" upper="{upper}", as the mimic rule demands',
            severity=None if self.enabled else Severity.NOTE,
        )

    def resolve_chain(self, mimic: MimicRecord) -> tuple[Mimic, JointRecord | None]:
        """Return the combined rule of a mimic chain, and the last joint.

        The last joint is None if it is missing or in a cycle.
        """
        from urdfkin.model.tree import Mimic

        rule = Mimic(mimic.mimicked_joint, mimic.multiplier, mimic.offset)
        mimicked_joint = self.joints.get(rule.mimicked_joint)
        while mimicked_joint is not None and (next_ := mimicked_joint.mimic) is not None:
            if mimicked_joint.name in self.joints_in_loops:
                return rule, None
            offset = rule.multiplier * next_.offset + rule.offset
            rule = Mimic(next_.mimicked_joint, rule.multiplier * next_.multiplier, offset)
            mimicked_joint = self.joints.get(rule.mimicked_joint)
        return rule, mimicked_joint


def _joint_range(joint: JointRecord) -> tuple[float, float] | None:
    """Return the limits of a revolute or prismatic joint, or +- pi for a continuous joint; otherwise None."""
    if joint.kind == "continuous":
        return -math.pi, math.pi
    if joint.limit is None or joint.kind not in ("revolute", "prismatic"):
        return None
    low, high = (0.0 if end is None else end for end in (joint.limit.lower, joint.limit.upper))
    return (low, high) if low < high else None


def _joints_in_mimic_loops(joints: dict[str, JointRecord]) -> set[str]:
    joints_in_loops: set[str] = set()
    visited: set[str] = set()
    for start in joints:
        path: dict[str, int] = {}
        name: str | None = start
        while name is not None and name in joints and name not in visited:
            visited.add(name)
            path[name] = len(path)
            rule = joints[name].mimic
            name = None if rule is None else rule.mimicked_joint
        if name is not None and name in path:
            joints_in_loops |= {member for member, place in path.items() if place >= path[name]}
    return joints_in_loops


ROUNDED_PI = Rule("URDF601", "rounded-pi", NOTE)
DEGREES = Rule("URDF602", "degrees", WARNING)
MILLIMETRES = Rule("URDF603", "huge-length", WARNING)
TINY_ROBOT = Rule("URDF604", "tiny-robot", WARNING)
SAME_PLACE = Rule("URDF605", "same-place", NOTE)
LENGTH_OVERFLOW = Rule("URDF606", "overflow", ERROR)
NEUTRAL_OUTSIDE_LIMITS = Rule("URDF608", "neutral-outside", NOTE)

#: A coordinate of a joint origin, or a limit of a prismatic joint, is probably in millimetres if it is at
#: least this number (m).
SUSPICIOUS_LENGTH = 100.0

#: If the longest chain of a robot is shorter than this length (m), the lengths were probably scaled twice.
MIN_PLAUSIBLE_ROBOT_SIZE = 1e-4

#: A whole-number limit is probably in degrees if `SUSPICIOUS_LIMIT` <= |limit| < `PLACEHOLDER_LIMIT`. For a
#: joint without limits, some exporters write limits of at least `PLACEHOLDER_LIMIT`.
SUSPICIOUS_LIMIT, PLACEHOLDER_LIMIT = 30.0, 1000.0

#: A rounded angle is a warning if the rounding can move the links below the joint by more than this length
#: (m).
NOTICEABLE_DISPLACEMENT = 1e-3

#: An angle that differs from k * pi by at most this number (rad) counts as exact.
NEGLIGIBLE_ANGLE = 1e-10

#: Pairs (k, n): a number counts as a rounded k * pi only if it has at least n decimals in the file.
_PI_MULTIPLES = [(Fraction(k, 2), 2) for k in range(1, 5)] + [
    (Fraction(k, d), 4) for d in (3, 4, 6, 12) for k in range(1, 2 * d) if Fraction(k, d).denominator == d
]


def check_suspicious(report: Reporter, robot: RobotRecord, *, is_tree: bool, mimic: bool) -> None:
    """Report legal values that are probably mistakes."""
    reach = _reach(robot) if is_tree else {}
    slides = any(joint.kind in ("prismatic", "planar", "floating") for joint in robot.joints)
    condition = " if all translations are 0" if slides else ""
    for joint in robot.joints:
        _check_angles(report, joint, reach, condition)
        _check_lengths(report, joint)
        if joint.mimic is None or not mimic:
            _check_neutral(report, joint)
    _check_equal_joints(report, robot)
    if is_tree:
        _check_total_length(report, robot, reach)


def _check_angles(report: Reporter, joint: JointRecord, reach: dict[str, float], condition: str) -> None:
    origin = joint.origin_element
    if origin is not None and joint.quaternion is None:
        written = origin.attributes.get("rpy", "").split(maxsplit=3)
        if any(abs(angle) >= 10.0 for angle in joint.rpy):
            message, found = "the angles of the origin look like degrees", quote(" ".join(written))
            _report_degrees(report, message, origin, "rpy", found)
        elif len(written) == 3:
            _check_rounded(report, joint, written, reach.get(joint.child or "", 0.0), condition)
    limit = joint.limit
    if limit is not None and joint.kind == "revolute":
        bounds = [bound for bound in (limit.lower, limit.upper) if bound is not None]
        if any(
            SUSPICIOUS_LIMIT <= abs(bound) < PLACEHOLDER_LIMIT and bound == round(bound) for bound in bounds
        ):
            found = _bounds_text(limit)
            _report_degrees(report, "the limits look like degrees", limit.element, "lower", found)


def _report_degrees(report: Reporter, message: str, at: Element, attribute: str, found: str) -> None:
    report.add(DEGREES, message, at, attribute=attribute, found=found, remedy="write angles in radians")


def _bounds_text(limit: LimitRecord) -> str:
    written = limit.element.attributes
    return " ".join(f"{name}={quote(written[name])}" for name in ("lower", "upper") if name in written)


def _check_rounded(
    report: Reporter, joint: JointRecord, written: list[str], reach: float, condition: str
) -> None:
    """Report angles of a joint origin that are rounded multiples of pi.

    `reach` (m) bounds the distance to the links below; `condition` is the condition of this bound as text.
    """
    off, text, multiple, meant, turns = 0.0, "", Fraction(0), 0.0, 0.0
    exact = list(written)
    for k, (word, angle) in enumerate(zip(written, joint.rpy, strict=True)):
        found = find_rounded_pi(word, angle)
        if found is None:
            continue
        exact[k], turns = repr(found[1]), turns + abs(angle - found[1])
        if abs(angle - found[1]) > off:
            off, text, (multiple, meant) = abs(angle - found[1]), word, found
    if not off or joint.origin_element is None:
        return
    origin = joint.origin_element
    named = f"-{_pi_text(multiple)}" if meant < 0.0 else _pi_text(multiple)
    moves = ""
    if reach > 0.0:
        moves = f", which moves the links below by up to {_length_text(off * reach)}{condition}"
    report.add(
        ROUNDED_PI,
        f"rpy contains a rounded {named}, off by {off:.1e} rad{moves}",
        origin,
        attribute="rpy",
        found=quote(text),
        remedy=f"write {meant!r} if you mean {named}; urdfkin uses the value in the file",
        severity=Severity.WARNING if off * reach > NOTICEABLE_DISPLACEMENT else None,
        weight=off * reach,
        fix=lambda: report.make_value_fix(
            origin, "rpy", _replace_words(report.raw_value(origin, "rpy"), exact), turns
        ),
    )


def _replace_words(raw_value: str | None, words: list[str]) -> str:
    blanks = re.split(r"[^ \t\r\n]+", raw_value or "")
    if len(blanks) != len(words) + 1:  # The text contains references such as `&#32;`.
        return " ".join(words)
    return "".join(blank + word for blank, word in zip(blanks, [*words, ""], strict=True))


def find_rounded_pi(text: str, angle: float) -> tuple[Fraction, float] | None:
    """Return k > 0 and the exact angle if `angle` is a rounded multiple of pi, otherwise None.

    The exact angle is k * pi or -k * pi. `text` is the angle as written in the file, and `angle` is the
    number (rad).

    >>> find_rounded_pi("1.5708", 1.5708)
    (Fraction(1, 2), 1.5707963267948966)
    >>> find_rounded_pi("1.5707963267948966", 1.5707963267948966) is None
    True
    """
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    if exponent or not 2 <= decimals <= 14:
        return None
    for multiple, least in _PI_MULTIPLES:
        value = math.copysign(float(multiple) * math.pi, angle)
        if decimals >= least and NEGLIGIBLE_ANGLE < abs(angle - value) < 10.0**-decimals:
            return multiple, value
    return None


def _pi_text(multiple: Fraction) -> str:
    top = "pi" if multiple.numerator == 1 else f"{multiple.numerator} pi"
    return top if multiple.denominator == 1 else f"{top}/{multiple.denominator}"


def _length_text(length: float) -> str:
    units = ((1.0, "m"), (1e3, "mm"), (1e6, "um"))
    factor, unit = next((pair for pair in units if length * pair[0] >= 1.0), (1e9, "nm"))
    # The format `:.2g` would write 120 as 1.2e+02.
    return f"{float(f'{length * factor:.1e}'):g} {unit}"


def _check_lengths(report: Reporter, joint: JointRecord) -> None:
    largest = max(abs(x) for x in joint.xyz)
    add = partial(report.add, MILLIMETRES, remedy="write lengths in metres")
    if joint.origin_element is not None and largest >= SUSPICIOUS_LENGTH:
        message = "the joint is very far from its parent link"
        found = f"xyz={quote(joint.origin_element.attributes.get('xyz', ''))}"
        add(message, joint.origin_element, attribute="xyz", found=found, weight=largest)
    limit = joint.limit
    if limit is not None and joint.kind == "prismatic":
        far = [
            bound
            for bound in (limit.lower, limit.upper)
            if bound and SUSPICIOUS_LENGTH <= abs(bound) < PLACEHOLDER_LIMIT
        ]
        if far:
            message, found = "a prismatic joint moves very far", f"{far[0]:g}"
            attribute = "lower" if far[0] == limit.lower else "upper"
            add(message, limit.element, attribute=attribute, found=found, weight=abs(far[0]))


def _check_neutral(report: Reporter, joint: JointRecord) -> None:
    limit = joint.limit
    if limit is None or joint.kind not in ("revolute", "prismatic"):
        return
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    if lower <= upper and not lower <= 0.0 <= upper:
        report.add(
            NEUTRAL_OUTSIDE_LIMITS,
            "the limits exclude 0, the value of the joint in the neutral configuration",
            limit.element,
            attribute="lower" if lower > 0.0 else "upper",
            found=f'lower="{lower:g}" upper="{upper:g}"',
            remedy="use a configuration within the limits, such as --q ready",
            weight=max(lower, -upper),
        )


def _check_equal_joints(report: Reporter, robot: RobotRecord) -> None:
    places: dict[tuple[object, ...], JointRecord] = {}
    for joint in robot.joints:
        if joint.kind not in AXIAL_TYPES:
            continue
        place = (joint.parent, joint.kind, joint.xyz, joint.rpy, joint.quaternion, joint.axis)
        first = places.setdefault(place, joint)
        if first is not joint:
            message = f"the joint has the same origin and axis as joint {quote(first.name)}"
            remedy = "correct one of the two joints, or ignore this note if both joints are intended"
            report.add(SAME_PLACE, message, joint.element, remedy=remedy)


def _reach(robot: RobotRecord) -> dict[str, float]:
    """Return an upper bound (m) on each link's distance to its descendants, by link name.

    The bounds assume that all translations of joints are 0.
    """
    below = _joints_by_parent(robot.joints)
    order = list(robot.links.keys() - {joint.child for joint in robot.joints})
    for link in order:
        order += [joint.child or "" for joint in below.get(link, ())]
    reach = dict.fromkeys(order, 0.0)
    for link in reversed(order):
        for joint in below.get(link, ()):
            reach[link] = max(reach[link], math.hypot(*joint.xyz) + reach[joint.child or ""])
    return reach


def _check_total_length(report: Reporter, robot: RobotRecord, reach: dict[str, float]) -> None:
    whole = max(reach.values(), default=0.0)
    if math.isinf(whole):
        far = max(robot.joints, key=lambda joint: max(abs(x) for x in joint.xyz))
        element = far.origin_element or far.element
        message = "the sum of the lengths along the chain is too large for a double"
        found = quote(element.attributes.get("xyz", ""))
        report.add(
            LENGTH_OVERFLOW, message, element, attribute="xyz", found=found, remedy="check the exponent"
        )
    elif 0.0 < whole < MIN_PLAUSIBLE_ROBOT_SIZE:
        message = f"the joint origins along the longest chain of the robot add up to {_length_text(whole)}"
        report.add(TINY_ROBOT, message, robot.element, remedy="write lengths in metres")
