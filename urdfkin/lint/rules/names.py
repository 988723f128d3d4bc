"""Check the names of links and joints: missing, duplicate, reserved, and troublesome for other programs."""

from __future__ import annotations

import unicodedata

from urdfkin.lint.finding import Severity, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import DIFFERS, ERROR, WARNING, Rule
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import RobotRecord

MISSING_NAME = Rule("URDF401", "missing-name", ERROR)
DUPLICATE_NAME = Rule("URDF402", "duplicate-name", ERROR)
RESERVED_NAME = Rule("URDF403", "reserved-name", WARNING)
UNIVERSE = Rule("URDF404", "name-universe", WARNING, DIFFERS)
ODD_NAME = Rule("URDF405", "odd-name", WARNING)
NAME_BLANKS = Rule("URDF406", "line-break-in-name", WARNING, DIFFERS)
LOOKALIKE = Rule("URDF407", "lookalike-names", WARNING)

#: Longer names break tables and file paths.
LONGEST = 200


def check_names(report: Reporter, robot: RobotRecord, root_joint: str | None) -> None:
    """Report names that are reserved, easily confused, or troublesome for other programs.

    Args:
        report: The reporter, which receives the findings.
        robot: The records of the robot.
        root_joint: Set if the robot gets a joint `root_joint` below a link `universe`.
    """
    links = list(robot.links.items())
    joints = [(joint.name, joint.element) for joint in robot.joints if joint.name]
    for name, element in (*links, *joints):
        _check_odd(report, name, element)
        _check_blanks(report, element)
        _check_reserved(report, name, element, root_joint)
    for kind in (links, joints):
        _check_lookalikes(report, kind)


def named(report: Reporter, element: Element) -> str:
    """Return the name of a link or joint; an empty string after a finding that it has none."""
    name = element.attributes.get("name")
    if not name:
        what = "has no name" if name is None else "has an empty name"
        report.add(
            MISSING_NAME,
            f"a {element.tag} {what}",
            element,
            attribute="name",
            remedy=f'write <{element.tag} name="...">',
        )
    return name or ""


def report_duplicate(report: Reporter, element: Element, first: Element) -> None:
    """Report a second link or joint with the same name."""
    report.add(
        DUPLICATE_NAME,
        f"another {element.tag} has this name",
        element,
        attribute="name",
        remedy=f"the first is on line {first.line}; rename one",
    )


def _check_odd(report: Reporter, name: str, element: Element) -> None:
    reason = None
    if not name.isprintable():
        reason = "the name contains characters that cannot be printed"
    elif name != name.strip():
        reason = "the name begins or ends with a space"
    elif "/" in name or "\\" in name:
        reason = "the name contains a slash, like a path"
    elif name[0] in "=+-@":
        reason = "the name begins like a spreadsheet formula"
    elif len(name) > LONGEST:
        reason = f"the name has {len(name)} characters"
    elif any(c in "\"'<>&|;`$" for c in name):
        reason = "the name contains a special character of shells or XML"
    if reason:
        report.add(
            ODD_NAME,
            reason,
            element,
            attribute="name",
            found=quoted(name),
            remedy="use letters, digits, - and _",
        )


def _check_blanks(report: Reporter, element: Element) -> None:
    raw = report.raw(element, "name") if report.has_raw_blanks else None
    if raw is not None and any(c in raw for c in "\t\r\n"):
        report.add(
            NAME_BLANKS,
            "the name contains a tab or a line end",
            element,
            attribute="name",
            found=quoted(raw),
            remedy="write the name on one line, without tabs",
        )


def _check_reserved(report: Reporter, name: str, element: Element, root_joint: str | None) -> None:
    if name == "universe" and element.tag == "joint":
        report.add(
            UNIVERSE,
            "Pinocchio uses this name for the world and does not find the joint",
            element,
            attribute="name",
            remedy="rename it",
        )
    elif (element.tag, name) in (("link", "universe"), ("joint", "root_joint")):
        what = "the world" if name == "universe" else "the joint of a free or planar base"
        report.add(
            RESERVED_NAME,
            f"the name is reserved for {what}",
            element,
            attribute="name",
            remedy="rename it" if root_joint else "rename it, or load without root_joint",
            severity=Severity.ERROR if root_joint else None,
        )


def _check_lookalikes(report: Reporter, named: list[tuple[str, Element]]) -> None:
    seen: dict[str, str] = {}
    for name, element in named:
        if name.isascii() or len(name) > LONGEST:
            continue  # a longer name is reported anyway; normalising its marks takes quadratic time
        key = unicodedata.normalize("NFKC", name)
        first = seen.setdefault(key, name)
        if first != name:
            report.add(
                LOOKALIKE,
                "another name looks the same, but has different characters",
                element,
                attribute="name",
                found=ascii(name) + " and " + ascii(first),
                remedy="use one of the two",
            )
