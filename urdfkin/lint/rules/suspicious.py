"""Check for legal values that are probably mistakes: rounded pi, degrees, millimetres, equal joints."""

from __future__ import annotations

import math
import re
from fractions import Fraction

from urdfkin.urdf.findings import ERROR, NOTE, WARNING, Reporter, Rule, Severity, quoted
from urdfkin.urdf.records import AXIAL, JointRecord, RobotRecord

ROUNDED_PI = Rule("URDF601", "rounded-pi", NOTE)
DEGREES = Rule("URDF602", "degrees", WARNING)
MILLIMETRES = Rule("URDF603", "huge-length", WARNING)
TINY_ROBOT = Rule("URDF604", "tiny-robot", WARNING)
SAME_PLACE = Rule("URDF605", "same-place", NOTE)
OVERFLOW = Rule("URDF606", "overflow", ERROR)
NEUTRAL = Rule("URDF608", "neutral-outside", NOTE)

#: A joint origin longer than this (m) is probably in millimetres.
FAR = 100.0

#: A robot whose lengths have a smaller sum (m) was probably scaled twice.
TINY = 1e-4

#: A whole number of radians from `MANY` on is probably an angle in degrees. From `ENDLESS` on it means
#: "no limit" in some exporters.
MANY, ENDLESS = 30.0, 1000.0

#: A rounded pi is a warning if it moves a tip by more than this (m).
NOTICEABLE = 1e-3

#: A smaller difference (rad) from a multiple of pi is not reported.
ROUNDING = 1e-10

#: Multiples of pi, each with the smallest number of decimals from which it is recognized.
_MULTIPLES = [(Fraction(k, 2), 2) for k in range(1, 5)] + [
    (Fraction(k, d), 4) for d in (3, 4, 6, 12) for k in range(1, 2 * d) if Fraction(k, d).denominator == d
]


def check_suspicious(report: Reporter, robot: RobotRecord, *, sound: bool) -> None:
    """Report legal values that are probably mistakes.

    Args:
        report: The reporter, which receives the findings.
        robot: The records of the robot.
        sound: Whether the joints form a tree, so that lengths along chains are defined.
    """
    reach = _reach(robot) if sound else {}
    for joint in robot.joints:
        _check_angles(report, joint, reach)
        _check_lengths(report, joint)
        _check_neutral(report, joint)
    _check_places(report, robot)
    if sound:
        _check_sums(report, robot, reach)


def _check_angles(report: Reporter, joint: JointRecord, reach: dict[str, float]) -> None:
    origin = joint.origin_element
    if origin is not None and joint.quaternion is None:
        written = origin.attributes.get("rpy", "").split(maxsplit=3)
        if any(abs(angle) >= 10.0 for angle in joint.rpy):
            _degrees(report, joint, "rpy", quoted(" ".join(written)))
        elif len(written) == 3:
            _check_rounded(report, joint, written, reach.get(joint.child or "", 0.0))
    limit = joint.limit
    if limit is not None and joint.kind == "revolute":
        bounds = [bound for bound in (limit.lower, limit.upper) if bound is not None]
        if any(MANY <= abs(bound) < ENDLESS and bound == round(bound) for bound in bounds):
            at = " ".join(
                f"{name}={quoted(limit.element.attributes[name])}"
                for name in ("lower", "upper")
                if name in limit.element.attributes
            )
            _degrees(report, joint, "limit", at)


def _degrees(report: Reporter, joint: JointRecord, what: str, found: str) -> None:
    rpy = what == "rpy"
    report.add(
        DEGREES,
        "the angles of the origin look like degrees" if rpy else "the limits look like degrees",
        joint.origin_element if rpy else joint.limit.element if joint.limit else joint.element,
        attribute="rpy" if rpy else "lower",
        found=found,
        remedy="write radians",
    )


def _check_rounded(report: Reporter, joint: JointRecord, written: list[str], reach: float) -> None:
    """Report the angle of an origin with the largest difference from a multiple of pi."""
    off, text, multiple, meant, turns = 0.0, "", Fraction(0), 0.0, 0.0
    whole = list(written)
    for k, (word, angle) in enumerate(zip(written, joint.rpy, strict=True)):
        found = rounded_pi(word, angle)
        if found is None:
            continue
        whole[k], turns = repr(found[1]), turns + abs(angle - found[1])
        if abs(angle - found[1]) > off:
            off, text, (multiple, meant) = abs(angle - found[1]), word, found
    if not off or joint.origin_element is None:
        return
    origin = joint.origin_element
    moves = f", which moves the links below it by up to {_metres(off * reach)}" if reach > 0.0 else ""
    report.add(
        ROUNDED_PI,
        f"rpy contains a rounded {_as_pi(multiple)}, off by {off:.1e} rad{moves}",
        origin,
        attribute="rpy",
        found=quoted(text),
        remedy=f"write {meant!r} if you mean {_as_pi(multiple)}; the written value is used",
        severity=Severity.WARNING if off * reach > NOTICEABLE else None,
        weight=off * reach,
        fix=lambda: report.rewritten(origin, "rpy", _replace_words(report.raw(origin, "rpy"), whole), turns),
    )


def _replace_words(raw: str | None, words: list[str]) -> str:
    """Replace the words of a raw value, without changes of the white space between them."""
    blanks = re.split(r"[^ \t\r\n]+", raw or "")
    if len(blanks) != len(words) + 1:  # white space is written as character references
        return " ".join(words)
    return "".join(blank + word for blank, word in zip(blanks, [*words, ""], strict=True))


def rounded_pi(text: str, angle: float) -> tuple[Fraction, float] | None:
    """Return the multiple of pi that a decimal is probably rounded from, and its value; otherwise None.

    >>> rounded_pi("1.5708", 1.5708)
    (Fraction(1, 2), 1.5707963267948966)
    >>> rounded_pi("1.5707963267948966", 1.5707963267948966) is None
    True
    """
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    if exponent or not 2 <= decimals <= 14:
        return None
    for multiple, least in _MULTIPLES:
        value = math.copysign(float(multiple) * math.pi, angle)
        if decimals >= least and ROUNDING < abs(angle - value) < 10.0**-decimals:
            return multiple, value
    return None


def _as_pi(multiple: Fraction) -> str:
    top = "pi" if multiple.numerator == 1 else f"{multiple.numerator} pi"
    return top if multiple.denominator == 1 else f"{top}/{multiple.denominator}"


def _metres(length: float) -> str:
    units = ((1.0, "m"), (1e3, "mm"), (1e6, "um"))
    factor, unit = next((pair for pair in units if length * pair[0] >= 1.0), (1e9, "nm"))
    # Two digits, without an exponent.
    return f"{float(f'{length * factor:.1e}'):g} {unit}"


def _check_lengths(report: Reporter, joint: JointRecord) -> None:
    if joint.origin_element is not None and max(abs(x) for x in joint.xyz) >= FAR:
        report.add(
            MILLIMETRES,
            "the joint is very far from its parent link",
            joint.origin_element,
            attribute="xyz",
            found=f"xyz={quoted(joint.origin_element.attributes.get('xyz', ''))}",
            remedy="write metres",
            weight=max(abs(x) for x in joint.xyz),
        )
    limit = joint.limit
    if limit is not None and joint.kind == "prismatic":
        far = [bound for bound in (limit.lower, limit.upper) if bound and FAR <= abs(bound) < ENDLESS]
        if far:
            report.add(
                MILLIMETRES,
                "a prismatic joint moves very far",
                limit.element,
                attribute="lower" if far[0] == limit.lower else "upper",
                found=f"{far[0]:g}",
                remedy="write metres",
                weight=abs(far[0]),
            )


def _check_neutral(report: Reporter, joint: JointRecord) -> None:
    """Report a joint whose limits exclude zero, the neutral configuration. Mimic joints are not checked."""
    limit = joint.limit
    if limit is None or joint.kind not in ("revolute", "prismatic") or joint.mimic is not None:
        return
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    if lower <= upper and not lower <= 0.0 <= upper:
        report.add(
            NEUTRAL,
            "the neutral configuration, zero, is outside the limits",
            limit.element,
            attribute="lower" if lower > 0.0 else "upper",
            found=f'lower="{lower:g}" upper="{upper:g}"',
            remedy="give this joint a value within its limits: --q ready",
            weight=max(lower, -upper),
        )


def _check_places(report: Reporter, robot: RobotRecord) -> None:
    """Report joints with the same parent, kind, origin and axis."""
    places: dict[tuple[object, ...], JointRecord] = {}
    for joint in robot.joints:
        if joint.kind not in AXIAL:
            continue
        place = (joint.parent, joint.kind, joint.xyz, joint.rpy, joint.quaternion, joint.axis)
        first = places.setdefault(place, joint)
        if first is not joint:
            report.add(
                SAME_PLACE,
                f"the joint has the same origin and axis as joint {quoted(first.name)}",
                joint.element,
                remedy="ignore this if it is intended",
            )


def _reach(robot: RobotRecord) -> dict[str, float]:
    """Return a bound (m) on the distance from each link to all links below it: the sum of lengths."""
    below: dict[str, list[JointRecord]] = {}
    for joint in robot.joints:
        below.setdefault(joint.parent or "", []).append(joint)
    roots = set(robot.links) - {joint.child for joint in robot.joints}
    order, stack = [], list(roots)
    while stack:
        link = stack.pop()
        order.append(link)
        stack += [joint.child or "" for joint in below.get(link, [])]
    reach = dict.fromkeys(order, 0.0)
    for link in reversed(order):
        for joint in below.get(link, []):
            reach[link] = max(reach[link], math.hypot(*joint.xyz) + reach[joint.child or ""])
    return reach


def _check_sums(report: Reporter, robot: RobotRecord, reach: dict[str, float]) -> None:
    whole = max(reach.values(), default=0.0)
    if math.isinf(whole):
        far = max(robot.joints, key=lambda joint: max(abs(x) for x in joint.xyz))
        report.add(
            OVERFLOW,
            "the sum of the lengths along the chain is too large for a double",
            far.origin_element or far.element,
            attribute="xyz",
            found=quoted((far.origin_element or far.element).attributes.get("xyz", "")),
            remedy="check the exponent",
        )
    elif 0.0 < whole < TINY:
        report.add(
            TINY_ROBOT,
            f"the sum of all lengths of the robot is {_metres(whole)}",
            robot.element,
            found=None,
            remedy="write metres",
        )
