"""Check that a document is a URDF: root element, version, and no unexpanded xacro."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from urdfkin.lint.finding import Severity, quoted, shortened
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, WARNING, Rule
from urdfkin.lint.rules import names
from urdfkin.lint.rules.vocabulary import outside_extensions
from urdfkin.urdf.element import Element

INCLUDE = Rule("URDF112", "include", ERROR)
NOT_URDF = Rule("URDF201", "not-a-urdf", ERROR)
XACRO = Rule("URDF202", "unexpanded-xacro", ERROR)
VERSION = Rule("URDF203", "urdf-version", ERROR)
NEWER_VERSION = Rule("URDF204", "newer-urdf-version", WARNING)
NO_LINKS = Rule("URDF205", "no-links", ERROR)
NAMESPACE = Rule("URDF213", "default-namespace", WARNING)

_T = TypeVar("_T")

#: Root element of another format -> remedy.
_FORMATS = {
    "sdf": "this is an SDF file; convert it to a URDF first",
    "mujoco": "this is MJCF, which `load` and all other commands read; a file of it ends in .xml or .mjcf",
    "mujocoinclude": "this is a part of an MJCF file; load the file that includes it",
    "model": "this is a part of an SDF file; convert it to a URDF first",
    "world": "this is a part of an SDF file; convert it to a URDF first",
    "collada": "this is a COLLADA file",
    "html": "this is a web page, not the file it shows",
    "launch": "this is a launch file; the URDF is what it loads",
    "package": "this is a package manifest; the URDF is another file",
    "drake": "this is a Drake file; convert it to a URDF first",
}

#: Elements of an SRDF, which accompanies a URDF.
_SRDF = {"group", "group_state", "end_effector", "virtual_joint", "disable_collisions", "passive_joint"}

_VERSION = re.compile(r"\s*\+?([0-9]+)\.\+?([0-9]+)")
_XACRO_NAMESPACE = re.compile(r"https?://(www\.)?(ros|wiki\.ros)\.org/(wiki/)?xacro")
_COMMAND = re.compile(r"\$\((find|arg|env|optenv|eval|anon|dirname)\b")
_XINCLUDE = "http://www.w3.org/2001/XInclude"

#: Newest URDF version that urdfdom 6 supports.
NEWEST = (1, 2)


def check_dialect(report: Reporter, root: Element) -> tuple[int, int] | None:
    """Return the version of a URDF, or None if the document is not a URDF."""
    if root.tag != "robot":
        _other_format(report, root)
        return None
    prefixes = _prefixes(root)
    _check_namespaces(report, root, prefixes)
    _check_name(report, root)
    if not root.all("link"):
        srdf = any(child.tag in _SRDF for child in root.children)
        remedy = (
            "this is an SRDF; pass the URDF of the same robot" if srdf else "a robot has at least one <link>"
        )
        report.add(NO_LINKS, "the robot has no link", root, remedy=remedy)
    return _version(report, root)


def _other_format(report: Reporter, root: Element) -> None:
    prefix, _, local = root.tag.rpartition(":")
    if local == "robot" and prefix:
        remedy = f"write <robot> without the prefix {prefix!r}"
    elif local.lower() == "robot":
        remedy = "write it in lower case"
    else:
        remedy = _FORMATS.get(local.lower(), "a URDF begins with <robot name=...>")
    report.add(NOT_URDF, "the root element is not <robot>", root, found=f"<{root.tag}>", remedy=remedy)


def _prefixes(root: Element) -> dict[str, str]:
    """Return all namespace declarations in the document: prefix -> namespace."""
    return {
        key.removeprefix("xmlns:"): value
        for element in root.walk()
        for key, value in element.attributes.items()
        if key.startswith("xmlns:")
    }


def _check_namespaces(report: Reporter, root: Element, prefixes: dict[str, str]) -> None:
    """Report a default namespace, unexpanded xacro and includes."""
    if "xmlns" in root.attributes:
        report.add(
            NAMESPACE,
            "xmlns puts the elements into a namespace, where most readers do not find them",
            root,
            attribute="xmlns",
            found=quoted(root.attributes["xmlns"]),
            remedy="remove xmlns",
        )
    xacro = {prefix for prefix, uri in prefixes.items() if _XACRO_NAMESPACE.match(uri)} | {"xacro"}
    macros = []
    for element in root.walk():
        prefix, _, local = element.tag.rpartition(":")
        if prefix in xacro:
            macros.append(element)
        elif (local == "include" and prefixes.get(prefix) == _XINCLUDE) or element.tag == "xi:include":
            report.add(
                INCLUDE,
                "the file includes another file",
                element,
                found=quoted(element.attributes.get("href", f"<{element.tag}>")),
                remedy="insert its content here; the other file was not opened",
            )
    if not _check_macros(report, root, macros):
        _check_expressions(report, root)


_EXPAND = "expand it first: xacro FILE > robot.urdf, or install urdfkin[xacro] and pass the .xacro file"
_HARMLESS = "; kinematics does not use it"


def _check_macros(report: Reporter, root: Element, macros: list[Element]) -> bool:
    """Report unexpanded macros; return whether one may contain links or joints."""
    missed, harmless = _partition(macros, lambda m: m.parent in (None, root) or m.holder.tag == "joint")
    for group, severity in ((missed, None), (harmless, Severity.WARNING)):
        if group:
            report.add(
                XACRO,
                f"unexpanded xacro{_HARMLESS if severity else ''}",
                group[0],
                found=f"<{shortened(group[0].tag)}>{_more(group)}",
                remedy=_EXPAND,
                severity=severity,
            )
    return bool(missed)


def _check_expressions(report: Reporter, root: Element) -> None:
    """Report xacro expressions in attributes: an error where kinematics uses the attribute."""
    written = [
        (element, key)
        for element in outside_extensions(root)
        for key, value in element.attributes.items()
        if "$" in value and is_expression(value) and not key.startswith("xmlns")
    ]
    used, harmless = _partition(written, lambda place: _moves(place[0]))
    for group, severity in ((used, None), (harmless, Severity.WARNING)):
        if group:
            element, key = group[0]
            report.add(
                XACRO,
                f"unexpanded xacro expression{_HARMLESS if severity else ''}",
                element,
                attribute=key,
                found=f"{shortened(key)}={quoted(element.attributes[key])}{_more(group)}",
                remedy=_EXPAND,
                severity=severity,
            )


def _moves(element: Element) -> bool:
    """Return whether kinematics uses an element: `<link>` itself, and everything in a `<joint>`."""
    holder = element.holder
    return holder.tag == "joint" or (holder is element and element.tag == "link")


def _partition(items: Iterable[_T], predicate: Callable[[_T], bool]) -> tuple[list[_T], list[_T]]:
    """Return the items for which the predicate is true, and the others, both in their order."""
    parts: tuple[list[_T], list[_T]] = ([], [])
    for one in items:
        parts[not predicate(one)].append(one)
    return parts


def _more(group: Sequence[object]) -> str:
    return f" and {len(group) - 1} more" if len(group) > 1 else ""


def is_expression(value: str) -> bool:
    """Return whether a value contains a xacro expression.

    >>> is_expression("${h} 0 0"), is_expression("$(arg side)/hand.stl"), is_expression("5 $")
    (True, True, False)
    """
    start = value.find("${")
    return (start >= 0 and "}" in value[start:]) or _COMMAND.search(value) is not None


def _check_name(report: Reporter, root: Element) -> None:
    name = root.attributes.get("name")
    if name is None:
        report.add(names.MISSING_NAME, "the robot has no name", root, remedy='write <robot name="...">')
    elif not name.strip():
        report.add(
            names.ODD_NAME, "the robot's name is empty", root, attribute="name", remedy="give it a name"
        )


def _version(report: Reporter, root: Element) -> tuple[int, int]:
    written = root.attributes.get("version")
    if written is None:
        return (1, 0)
    match = _VERSION.fullmatch(written)
    version = (int(match[1]), int(match[2])) if match and len(written) < 20 else None
    rule, remedy = VERSION, 'write version="1.0" if the file follows it, or remove the attribute'
    if version is None:
        message = "a URDF version has the form 1.0"
    elif version > NEWEST:
        message = "the URDF version is later than 1.2, the last that urdfdom and Pinocchio read"
        remedy = "write the version that the file follows, 1.0 to 1.2"
    elif version < (1, 0):
        message = "this URDF version does not exist"
    elif version == (1, 0):
        return version
    else:
        rule, message = NEWER_VERSION, "most readers support only URDF 1.0"
        remedy = "remove the attribute unless the file uses features of the version"
    report.add(rule, message, root, attribute="version", found=quoted(written), remedy=remedy)
    return version if version is not None and rule is NEWER_VERSION else (1, 0)
