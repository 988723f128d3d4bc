"""Check elements and attributes: unknown, misplaced and repeated ones, and text between tags."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from functools import lru_cache, partial

from urdfkin.lint.finding import Severity, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, WARNING, Rule
from urdfkin.urdf.element import Element

MISPLACED = Rule("URDF206", "misplaced-element", ERROR)
UNKNOWN_ELEMENT = Rule("URDF207", "unknown-element", WARNING)
UNKNOWN_ATTRIBUTE = Rule("URDF208", "unknown-attribute", WARNING)
DUPLICATE_ELEMENT = Rule("URDF209", "duplicate-element", WARNING)
STRAY_TEXT = Rule("URDF212", "stray-text", WARNING)

#: Extension elements with any content, even `<joint>` and `<link>`.
OPAQUE = frozenset({"gazebo", "transmission", "ros2_control", "sensor", "plugin", "mujoco", "sdf", "verbose"})

#: Elements and attributes that simulators and vendors add in widely used robots.
_ADDED = (
    "contact collision_checking self_filter surface gravity kinematic drake group dont_collapse D K"
    " mu_coulomb mu_viscous current command_effort gear_velocity"
)
EXTENSIONS = frozenset(_ADDED.split())

#: Element: attributes > child elements. Without a colon, the attributes are not checked. An element without
#: a line is not checked.
_TABLE = """
robot: name version > link joint material
link: name type > inertial visual collision
joint: name type > origin parent child axis limit mimic dynamics safety_controller calibration
inertial > origin mass inertia
visual > origin geometry material
collision > origin geometry material
geometry > box cylinder sphere mesh capsule
material > color texture
origin: xyz rpy quat_xyzw >
parent: link >
child: link >
axis: xyz >
limit: lower upper effort velocity acceleration deceleration jerk >
mimic: joint multiplier offset >
dynamics: damping friction >
safety_controller: k_velocity k_position soft_lower_limit soft_upper_limit >
"""
_LINES = [line.partition(">") for line in _TABLE.strip().splitlines()]
CHILDREN = {head.split()[0].rstrip(":"): frozenset(inside.split()) for head, _, inside in _LINES}
ATTRIBUTES = {
    tag: frozenset(names.split())
    for tag, colon, names in (head.partition(":") for head, *_ in _LINES)
    if colon
}

#: Elements and attributes of other formats for poses, which URDF readers skip.
_FOREIGN = {"quat_wxyz", "quat", "xyzrpy", "pose", "euler", "pos", "xyz", "rpy"}

#: Attributes with a meaning elsewhere: `--fix` does not remove them.
_MEANT = frozenset().union(*ATTRIBUTES.values()) | _FOREIGN | EXTENSIONS

#: Children that may occur only once.
_ONCE = {
    **{tag: CHILDREN[tag] for tag in ("joint", "inertial", "visual", "collision", "geometry")},
    "link": frozenset({"inertial"}),
}

#: Elements whose value belongs into attributes; text between their tags is lost.
_VALUES = {"origin", "axis", "limit", "mimic", "parent", "child"}

#: Elements whose text can only be a misplaced value.
_VECTORS = ("origin", "axis")


def check_vocabulary(report: Reporter, root: Element) -> None:
    """Report unknown, misplaced and repeated elements, unknown attributes, and text between tags."""
    stack = [root]
    while stack:
        element = stack.pop()
        known = CHILDREN.get(element.tag)
        if known is None:
            continue
        _check_attributes(report, element)
        _check_text(report, element)
        _check_repeats(report, element)
        for child in element.children:
            if child.tag not in known and child.tag not in OPAQUE and ":" not in child.tag:
                _check_unknown(report, child, known)
        stack += [child for child in reversed(element.children) if child.tag in known]


def _check_unknown(report: Reporter, element: Element, known: frozenset[str]) -> None:
    parts = [part for part in outside_extensions(element) if _is_part(part)]
    for part in parts:
        inside = part.parent.tag if part.parent else ""
        meant = nearest(part.tag, _PARTS)
        what = f"a {meant} inside <{inside}>" if part.tag == meant else f"<{part.tag}>"
        report.add(
            MISPLACED,
            f"{what} is skipped, so it is missing from the robot",
            part,
            remedy=f"write <{meant}> as a child of <robot>",
            owner=part.tag,
        )
    if parts:
        return
    close = None if report.is_full(UNKNOWN_ELEMENT) else nearest(element.tag, known)
    parent = element.parent
    if parent is not None and parent.tag in _VECTORS and element.text and not parent.attributes:
        report.add(
            STRAY_TEXT,
            f"the value inside <{element.tag}> is skipped",
            element,
            found=quoted(element.text),
            remedy=f"write it as an attribute, as in {_EXAMPLES[parent.tag]}",
            severity=Severity.ERROR,
        )
        return
    foreign = element.tag in _FOREIGN
    remedy = (
        f"write {_EXAMPLES['origin']}" if foreign else f"did you mean <{close}>?" if close else "remove it"
    )
    report.add(
        UNKNOWN_ELEMENT,
        f"URDF has no <{element.tag}> in <{parent.tag if parent else ''}>; it is skipped",
        element,
        remedy=remedy,
        severity=Severity.NOTE if element.tag in EXTENSIONS else None,
    )


def outside_extensions(element: Element) -> Iterator[Element]:
    """Yield an element and all elements below it, except those in extensions."""
    stack = [element]
    while stack:
        element = stack.pop()
        yield element
        stack += [child for child in reversed(element.children) if child.tag not in OPAQUE]


def _is_part(element: Element) -> bool:
    """Return whether an element is a link or joint, by its tag and its content."""
    tag = nearest(element.tag, _PARTS) if len(element.tag) < _LONGEST_PART else None
    if tag == "link":
        return "name" in element.attributes
    return tag == "joint" and (
        element.attributes.get("type", "").lower() in JOINT_TYPES or element.first("parent") is not None
    )


_PARTS = frozenset({"link", "joint"})

#: Longer tags are similar to neither: difflib's ratio with five common letters of eight is no match.
_LONGEST_PART = 8

#: The joint types of the specification.
JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")


def _check_attributes(report: Reporter, element: Element) -> None:
    known = ATTRIBUTES.get(element.tag)
    if known is None:
        return
    for attribute in element.attributes:
        if attribute in known or ":" in attribute or attribute == "xmlns":
            continue
        close = None if report.is_full(UNKNOWN_ATTRIBUTE) else nearest(attribute, known)
        report.add(
            UNKNOWN_ATTRIBUTE,
            f"<{element.tag}> has no attribute of this name; it is skipped",
            element,
            attribute=attribute,
            found=f"{attribute}={quoted(element.attributes[attribute])}",
            remedy=f"did you mean {close}?" if close else f"its attributes are {', '.join(sorted(known))}",
            severity=Severity.NOTE if attribute in EXTENSIONS else None,
            fix=None if close or attribute in _MEANT else partial(report.without, element, attribute),
        )


def _check_text(report: Reporter, element: Element) -> None:
    if not element.text or element.tag not in _VALUES | {"robot", "joint", "link"}:
        return
    if element.tag in ("parent", "child") and "link" not in element.attributes:
        return  # the finding about the missing attribute quotes this text
    lost = element.tag in _VECTORS and not element.attributes
    example = _EXAMPLES.get(element.tag)
    report.add(
        STRAY_TEXT,
        f"text inside <{element.tag}> is skipped",
        element,
        found=quoted(element.text),
        remedy=f"write it as an attribute, as in {example}" if example else "remove it",
        severity=Severity.ERROR if lost else None,
    )


_EXAMPLES = {
    "origin": '<origin xyz="0 0 1" rpy="0 0 0"/>',
    "axis": '<axis xyz="0 0 1"/>',
    "limit": '<limit lower="-1" upper="1" effort="10" velocity="1"/>',
    "mimic": '<mimic joint="leader" multiplier="1" offset="0"/>',
    "parent": '<parent link="base"/>',
    "child": '<child link="arm"/>',
}


def _check_repeats(report: Reporter, element: Element) -> None:
    once = _ONCE.get(element.tag)
    if once is None:
        return
    seen: dict[str, Element] = {}
    for child in element.children:
        if child.tag in seen and child.tag in once:
            report.add(
                DUPLICATE_ELEMENT,
                f"a second <{child.tag}> is skipped; the first, on line {seen[child.tag].line}, is used",
                child,
                remedy="remove one of the two",
            )
        seen.setdefault(child.tag, child)


def nearest(word: str, known: frozenset[str]) -> str | None:
    """Return the known word most similar to `word`, or None."""
    return _nearest(word, known) if len(word) <= _LONGEST else None


#: Longer words are not similar to any word of URDF.
_LONGEST = 32


@lru_cache(1024)
def _nearest(word: str, known: frozenset[str]) -> str | None:
    folded = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), folded, n=1, cutoff=0.8)
    if close:
        return folded[close[0]]
    letters = sorted(word.lower())
    return next((name for name in sorted(known) if sorted(name.lower()) == letters), None)
