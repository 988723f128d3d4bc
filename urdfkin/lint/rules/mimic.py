"""Check mimic joints: the mimicked joint exists, has one coordinate, and no rules form a circle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from urdfkin.lint.finding import Fix, Severity, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, NOTE, WARNING, Rule
from urdfkin.lint.rules import joints
from urdfkin.urdf.records import AXIAL, JointRecord, LimitRecord, MimicRecord, RobotRecord

if TYPE_CHECKING:
    from urdfkin.model.tree import Mimic

MIMIC_UNKNOWN = Rule("URDF520", "mimic-unknown", ERROR)
MIMIC_LOOP = Rule("URDF521", "mimic-loop", ERROR)
MIMIC_LEADER = Rule("URDF522", "mimic-leader", ERROR)
MIMIC_CONSTANT = Rule("URDF523", "mimic-constant", WARNING)
MIMIC_CONTINUOUS = Rule("URDF524", "mimic-continuous", WARNING)
MIMIC_CHAIN = Rule("URDF525", "mimic-chain", NOTE)
MIMIC_SCALE = Rule("URDF526", "mimic-scale", WARNING)
MIMIC_RANGE = Rule("URDF527", "mimic-range", WARNING)

#: Larger multipliers and offsets (rad or m) are reported as mistakes.
LARGEST = 1e6
#: Share of a joint's range that limits of its mimic joint may leave out: limits are written with few digits.
LEAST_LOST = 1e-3


def check_mimic(report: Reporter, robot: RobotRecord, *, enabled: bool) -> None:
    """Report problems of mimic joints.

    Args:
        report: The reporter, which receives the findings.
        robot: The records of the robot.
        enabled: Whether the mimic rules are used. If not, every finding is a note.
    """
    checker = _MimicChecker(report, robot.by_name, enabled)
    for joint in robot.joints:
        if joint.mimic is not None:
            checker.check(joint, joint.mimic)


class _MimicChecker:
    """Check one mimic joint after another."""

    def __init__(self, report: Reporter, joints: dict[str, JointRecord], enabled: bool) -> None:
        self.report, self.joints, self.enabled = report, joints, enabled
        self.in_loops = _joints_in_loops(joints)

    def add(
        self,
        code: Rule,
        message: str,
        mimic: MimicRecord,
        attribute: str,
        remedy: str,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        """Add a finding at an attribute of a `<mimic>`."""
        written = mimic.element.attributes.get(attribute)
        self.report.add(
            code,
            message,
            mimic.element,
            attribute=attribute,
            found=None if written is None else f"{attribute}={quoted(written)}",
            remedy=remedy,
            severity=None if self.enabled else Severity.NOTE,
            fix=fix,
        )

    def check(self, joint: JointRecord, mimic: MimicRecord) -> None:
        """Check one mimic joint."""
        if joint.kind == "fixed":
            self.add(
                joints.IGNORED,
                "a fixed joint cannot mimic; its <mimic> is ignored",
                mimic,
                "joint",
                "remove it",
                lambda: self.report.without_element(mimic.element),
            )
            return
        if joint.kind in ("planar", "floating"):
            message = f"a {joint.kind} joint cannot mimic another: it has several coordinates"
            self.add(MIMIC_LEADER, message, mimic, "joint", "remove it")
            return
        leader = self.joints.get(mimic.leader)
        if leader is None:
            self.unknown(mimic)
        elif joint.name in self.in_loops:
            itself = leader is joint
            message = "the joint mimics itself" if itself else "the joints mimic each other in a circle"
            self.add(MIMIC_LOOP, message, mimic, "joint", "name a joint that is not a mimic joint")
        elif leader.kind is not None and leader.kind not in AXIAL:
            count = "no coordinate" if leader.kind == "fixed" else "several coordinates"
            message = f"the mimicked joint is {leader.kind} and has {count}"
            self.add(MIMIC_LEADER, message, mimic, "joint", "name a joint with one coordinate")
        else:
            self.check_sound(joint, mimic, leader)

    def unknown(self, mimic: MimicRecord) -> None:
        """Report that the mimicked joint does not exist."""
        nearest = self.report.nearest(mimic.leader, self.joints)
        remedy = f"did you mean {', '.join(nearest)}?" if nearest else "name a joint of the robot"
        if self.enabled:
            remedy += " (with mimic=False, --no-mimic, the joint moves freely)"
        self.add(MIMIC_UNKNOWN, "the mimicked joint does not exist", mimic, "joint", remedy)

    def check_sound(self, joint: JointRecord, mimic: MimicRecord, leader: JointRecord) -> None:
        """Report probable mistakes in a valid mimic rule."""
        if mimic.multiplier == 0.0:
            self.add(
                MIMIC_CONSTANT,
                f"the multiplier is zero: the joint stays at {mimic.offset:g}",
                mimic,
                "multiplier",
                "write the ratio, or make the joint fixed",
            )
        for attribute, value in (("multiplier", mimic.multiplier), ("offset", mimic.offset)):
            if abs(value) > LARGEST:
                message = f"the {attribute} is far too large"
                self.add(MIMIC_SCALE, message, mimic, attribute, "check the exponent")
        if joint.kind == "continuous":
            self.add(
                MIMIC_CONTINUOUS,
                "a continuous joint mimics another: Pinocchio itself accepts this for a continuous mimicked"
                " joint only",
                mimic,
                "joint",
                'write type="revolute" for it',
            )
        if leader.mimic is not None:
            self.add(
                MIMIC_CHAIN,
                f"the mimicked joint itself mimics {leader.mimic.leader!r}",
                mimic,
                "joint",
                "name the last joint of the chain: some readers resolve one step only",
            )
        if joint.limit is not None and max(abs(mimic.multiplier), abs(mimic.offset)) <= LARGEST:
            self.check_range(joint, mimic, joint.limit)

    def check_range(self, joint: JointRecord, mimic: MimicRecord, limit: LimitRecord) -> None:
        """Check that the limits of a mimic joint allow the full range of the mimicked joint."""
        from urdfkin.model.ranges import kept_range, range_words  # noqa: PLC0415  most files need no numpy
        from urdfkin.model.tree import Limit  # noqa: PLC0415

        rule, leader = self.resolved(mimic)
        limits, moving = _range_of(joint), None if leader is None else _range_of(leader)
        if leader is None or moving is None or limits is None or joint.kind == "continuous":
            return
        low, high = kept_range(rule, Limit(*limits, math.inf, math.inf), *moving)
        if rule.multiplier == 0.0 or high - low >= (1.0 - LEAST_LOST) * (moving[1] - moving[0]):
            return
        allowed = f"only from {range_words((low, high))}" if low < high else "nowhere"
        message = f"the mimic joint leaves its limits: {leader.name!r} moves from {range_words(moving)}, "
        ends = sorted(rule.multiplier * end + rule.offset for end in moving)
        self.report.add(
            MIMIC_RANGE,
            f"{message}but may move {allowed}",
            limit.element,
            attribute="lower",
            found=f'lower="{limits[0]:g}" upper="{limits[1]:g}"',
            remedy=f'write lower="{ends[0]:.6g}" upper="{ends[1]:.6g}", the range of the rule',
            severity=None if self.enabled else Severity.NOTE,
        )

    def resolved(self, mimic: MimicRecord) -> tuple[Mimic, JointRecord | None]:
        """Return the combined rule of a chain of mimic joints, and the last joint; None if there is none."""
        from urdfkin.model.tree import Mimic  # noqa: PLC0415

        rule = Mimic(mimic.leader, mimic.multiplier, mimic.offset)
        leader = self.joints.get(rule.leader)
        while leader is not None and (next_ := leader.mimic) is not None:
            if leader.name in self.in_loops:
                return rule, None
            offset = rule.multiplier * next_.offset + rule.offset
            rule = Mimic(next_.leader, rule.multiplier * next_.multiplier, offset)
            leader = self.joints.get(rule.leader)
        return rule, leader


def _range_of(joint: JointRecord) -> tuple[float, float] | None:
    """Return the range of a joint: its limits, or one revolution; None without valid limits."""
    if joint.kind == "continuous":
        return -math.pi, math.pi
    if joint.limit is None or joint.kind not in ("revolute", "prismatic"):
        return None
    low, high = (0.0 if end is None else end for end in (joint.limit.lower, joint.limit.upper))
    return (low, high) if low < high else None


def _joints_in_loops(joints: dict[str, JointRecord]) -> set[str]:
    """Return the names of the joints in circles of mimic rules; each joint is visited once."""
    in_loops: set[str] = set()
    visited: set[str] = set()
    for start in joints:
        path: dict[str, int] = {}
        name: str | None = start
        while name is not None and name in joints and name not in visited:
            visited.add(name)
            path[name] = len(path)
            rule = joints[name].mimic
            name = None if rule is None else rule.leader
        if name is not None and name in path:
            in_loops |= {member for member, place in path.items() if place >= path[name]}
    return in_loops
