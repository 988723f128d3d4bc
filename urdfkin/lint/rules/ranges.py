"""Check the limits of joints: contradictory ones, and those that the joint type does not use."""

from __future__ import annotations

from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, REFUSES, WARNING, Rule
from urdfkin.lint.rules import joints
from urdfkin.urdf.records import AXIAL, FURTHER_LIMITS, JointRecord, LimitRecord, RobotRecord

INVERTED_LIMIT = Rule("URDF507", "inverted-limit", ERROR)
EMPTY_RANGE = Rule("URDF508", "empty-range", WARNING)
NEGATIVE_LIMIT = Rule("URDF509", "negative-limit", WARNING, REFUSES)


def check_ranges(report: Reporter, robot: RobotRecord) -> None:
    """Check the `<limit>` of each joint."""
    for joint in robot.joints:
        if joint.limit is not None:
            _check_limit(report, joint, joint.limit, robot.version)


def _check_limit(report: Reporter, joint: JointRecord, limit: LimitRecord, version: tuple[int, int]) -> None:
    strict = version >= (1, 2)  # from 1.2 on urdfdom has the same rules for all joint types
    for attribute in ("effort", "velocity", *FURTHER_LIMITS):
        value = getattr(limit, attribute)
        if value is not None and value < 0.0:
            refused = strict or joint.kind in AXIAL
            report.add(
                NEGATIVE_LIMIT if refused else joints.IGNORED,
                f"the limit of {attribute} is negative; Pinocchio {'refuses' if refused else 'ignores'} it",
                limit.element,
                attribute=attribute,
                found=quoted(limit.element.attributes[attribute]),
                remedy="write its magnitude",
            )
    if joint.kind == "continuous":
        _check_continuous(report, limit)
    bounded = joint.kind in ("revolute", "prismatic")
    written = {"lower", "upper"} & limit.element.attributes.keys()
    if not bounded and not (strict and len(written) == 2):
        return
    if any(getattr(limit, name) is None for name in written):
        return
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    found = f'lower="{lower:g}" upper="{upper:g}"' if written else "neither lower nor upper, so both are 0"
    if lower > upper:
        report.add(
            INVERTED_LIMIT,
            "the lower limit is above the upper limit",
            limit.element,
            attribute="lower",
            found=found if len(written) == 2 else f"{found} (a missing bound is 0)",
            remedy="swap the two" if len(written) == 2 else "write both limits",
        )
    elif lower == upper and bounded:
        report.add(
            EMPTY_RANGE,
            "the joint cannot move: its limits are equal",
            limit.element,
            attribute="lower",
            found=found,
            remedy="write the range, or make the joint fixed",
        )


def _check_continuous(report: Reporter, limit: LimitRecord) -> None:
    written = [name for name in ("lower", "upper") if name in limit.element.attributes]
    if any(getattr(limit, name) for name in written):
        report.add(
            joints.IGNORED,
            "a continuous joint has no position limits; they are ignored",
            limit.element,
            attribute=written[0],
            found=" ".join(f"{name}={quoted(limit.element.attributes[name])}" for name in written),
            remedy='remove them, or write type="revolute"',
            fix=lambda: report.without(limit.element, *written),
        )
