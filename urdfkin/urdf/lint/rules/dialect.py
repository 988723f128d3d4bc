"""Check the elements, attributes, names and comments of a URDF file."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

from urdfkin.system.lazy_import import install_command
from urdfkin.urdf import parser
from urdfkin.urdf.findings import (
    DIFFERS,
    ERROR,
    NOTE,
    WARNING,
    Comment,
    CommentIndex,
    IgnoreComment,
    Reporter,
    Rule,
    Severity,
    quote,
    shorten,
)
from urdfkin.urdf.parser import JOINT_TYPES, nearest_tag
from urdfkin.urdf.records import Element, RobotRecord

INCLUDE = Rule("URDF112", "include", ERROR)
XACRO = Rule("URDF202", "unexpanded-xacro", ERROR)
NO_LINKS = Rule("URDF205", "no-links", ERROR)
DEFAULT_NAMESPACE = Rule("URDF213", "default-namespace", WARNING)

#: Elements of SRDF files, which supplement a URDF.
_SRDF = {"group", "group_state", "end_effector", "virtual_joint", "disable_collisions", "passive_joint"}

_XACRO_NAMESPACE = re.compile(r"https?://(www\.)?(ros|wiki\.ros)\.org/(wiki/)?xacro")
_SUBSTITUTION = re.compile(r"\$\((find|arg|env|optenv|eval|anon|dirname)\b")
_XINCLUDE = "http://www.w3.org/2001/XInclude"


def check_dialect(report: Reporter, root: Element) -> None:
    """Report a missing name, missing links, unexpanded xacro, includes and a default namespace."""
    _check_namespaces(report, root)
    name = root.attributes.get("name")
    if name is None:
        report.add(parser.MISSING_NAME, "the robot has no name", root, remedy='write <robot name="...">')
    elif not name.strip():
        report.add(
            ODD_NAME, "the robot's name is empty", root, attribute="name", remedy="give the robot a name"
        )
    if not root.find_all("link"):
        srdf = any(child.tag in _SRDF for child in root.children)
        remedy = "this is an SRDF; pass the URDF of the robot" if srdf else "a robot has at least one <link>"
        report.add(NO_LINKS, "the robot has no link", root, remedy=remedy)


def _check_namespaces(report: Reporter, root: Element) -> None:
    if "xmlns" in root.attributes:
        message = "xmlns puts the elements into a namespace; readers that support namespaces find no links"
        found = quote(root.attributes["xmlns"])
        report.add(DEFAULT_NAMESPACE, message, root, attribute="xmlns", found=found, remedy="remove xmlns")
    namespaces = {
        key.removeprefix("xmlns:"): value
        for element in root.walk()
        for key, value in element.attributes.items()
        if key.startswith("xmlns:")
    }
    xacro = {prefix for prefix, uri in namespaces.items() if _XACRO_NAMESPACE.match(uri)} | {"xacro"}
    macros: list[_ElementOrAttribute] = []
    for element in root.walk():
        prefix, _, local = element.tag.rpartition(":")
        if prefix in xacro:
            macros.append((element, None))
        elif (local == "include" and namespaces.get(prefix) == _XINCLUDE) or element.tag == "xi:include":
            remedy = "insert the content of the other file here; urdfkin did not open it"
            found = quote(element.attributes.get("href", f"<{element.tag}>"))
            report.add(INCLUDE, "the file includes another file", element, found=found, remedy=remedy)
    # Only xacro elements directly inside <robot>, or anywhere inside <joint>, can change kinematics.
    if _report_xacro(
        report, "xacro", macros, lambda x: x.parent in (None, root) or x.top_level_element.tag == "joint"
    ):
        return
    expressions: list[_ElementOrAttribute] = [
        (element, key)
        for element in walk_outside_extensions(root)
        for key, value in element.attributes.items()
        if "$" in value and is_expression(value) and not key.startswith("xmlns")
    ]
    _report_xacro(report, "xacro expression", expressions, _affects_kinematics)


_EXPAND_REMEDY = (
    f"expand the file first: xacro FILE > robot.urdf, or {install_command('xacro')} and pass the .xacro file"
)

#: An element, and the name of an attribute or None for the element itself.
_ElementOrAttribute = tuple[Element, str | None]


def _report_xacro(
    report: Reporter,
    what: str,
    places: Sequence[_ElementOrAttribute],
    affects_kinematics: Callable[[Element], bool],
) -> bool:
    """Report unexpanded xacro in `places`; return whether kinematics uses any element of `places`."""
    used = [place for place in places if affects_kinematics(place[0])]
    unused = [place for place in places if not affects_kinematics(place[0])]
    for group, severity, message in (
        (used, None, f"unexpanded {what}"),
        (unused, Severity.WARNING, f"unexpanded {what}, which kinematics does not use"),
    ):
        if not group:
            continue
        element, key = group[0]
        found = f"<{shorten(element.tag)}>"
        if key is not None:
            found = f"{shorten(key)}={quote(element.attributes[key])}"
        found += _count_more(group)
        report.add(
            XACRO, message, element, attribute=key, found=found, remedy=_EXPAND_REMEDY, severity=severity
        )
    return bool(used)


def _affects_kinematics(element: Element) -> bool:
    return element.top_level_element.tag == "joint" or (
        element.top_level_element is element and element.tag == "link"
    )


def _count_more(group: Sequence[object]) -> str:
    return f" and {len(group) - 1} more" if len(group) > 1 else ""


def is_expression(value: str) -> bool:
    start = value.find("${")
    return (start >= 0 and "}" in value[start:]) or _SUBSTITUTION.search(value) is not None


MISPLACED = Rule("URDF206", "misplaced-element", ERROR)
UNKNOWN_ELEMENT = Rule("URDF207", "unknown-element", WARNING)
UNKNOWN_ATTRIBUTE = Rule("URDF208", "unknown-attribute", WARNING)
DUPLICATE_ELEMENT = Rule("URDF209", "duplicate-element", WARNING)
STRAY_TEXT = Rule("URDF212", "stray-text", WARNING)

#: These elements may contain anything, even `<joint>` and `<link>`.
EXTENSION_ELEMENTS = frozenset(
    {"gazebo", "transmission", "ros2_control", "sensor", "plugin", "mujoco", "sdf", "verbose"}
)

#: Common elements and attributes of simulators and vendors.
_VENDOR_NAMES_TEXT = (
    "contact collision_checking self_filter surface gravity kinematic drake group dont_collapse D K"
    " mu_coulomb mu_viscous current command_effort gear_velocity"
)
VENDOR_NAMES = frozenset(_VENDOR_NAMES_TEXT.split())

#: Each line has the form `element: attributes > child elements`. If a line has no colon, the attributes of
#: the element are not checked. If an element has no line, the content of the element is not checked.
_VOCABULARY = """
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
_VOCABULARY_LINES = [line.partition(">") for line in _VOCABULARY.strip().splitlines()]
CHILDREN = {head.split()[0].rstrip(":"): frozenset(inside.split()) for head, _, inside in _VOCABULARY_LINES}
ATTRIBUTES = {
    tag: frozenset(names.split())
    for tag, colon, names in (head.partition(":") for head, *_ in _VOCABULARY_LINES)
    if colon
}

#: Tags and attributes for poses in other formats. URDF readers skip these names.
_POSE_NAMES_OF_OTHER_FORMATS = {"quat_wxyz", "quat", "xyzrpy", "pose", "euler", "pos", "xyz", "rpy"}

#: Names that URDF, a simulator or another format defines. `--fix` keeps attributes with these names.
_KEPT_ATTRIBUTES = frozenset().union(*ATTRIBUTES.values()) | _POSE_NAMES_OF_OTHER_FORMATS | VENDOR_NAMES

#: Child elements that may occur only once.
_SINGLE_CHILDREN = {
    **{tag: CHILDREN[tag] for tag in ("joint", "inertial", "visual", "collision", "geometry")},
    "link": frozenset({"inertial"}),
}

#: Elements in which text between the tags is reported.
_ELEMENTS_WITHOUT_TEXT = {"origin", "axis", "limit", "mimic", "parent", "child", "robot", "joint", "link"}

#: Elements with text that probably belongs in an attribute.
_VECTOR_ELEMENTS = ("origin", "axis")


def check_vocabulary(report: Reporter, root: Element) -> None:
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
            if child.tag not in known and child.tag not in EXTENSION_ELEMENTS and ":" not in child.tag:
                _check_unknown(report, child, known)
        stack += [child for child in reversed(element.children) if child.tag in known]


def _check_unknown(report: Reporter, element: Element, known: frozenset[str]) -> None:
    parts = [part for part in walk_outside_extensions(element) if _is_link_or_joint(part)]
    for part in parts:
        meant = nearest_tag(part.tag, _LINK_OR_JOINT)
        what = f"<{part.tag}>"
        if part.tag == meant:
            what = f"a {meant} inside <{part.parent.tag if part.parent else ''}>"
        message = f"{what} is skipped, so the element is missing from the robot"
        remedy = f"write <{meant}> as a child of <robot>"
        report.add(MISPLACED, message, part, remedy=remedy, names_element=True)
    if parts:
        return
    close = None if report.is_full(UNKNOWN_ELEMENT) else nearest_tag(element.tag, known)
    parent = element.parent
    if parent is not None and parent.tag in _VECTOR_ELEMENTS and element.text and not parent.attributes:
        message, found = f"the value inside <{element.tag}> is skipped", quote(element.text)
        remedy = f"write the value as an attribute, as in {_EXAMPLES[parent.tag]}"
        report.add(STRAY_TEXT, message, element, found=found, remedy=remedy, severity=Severity.ERROR)
        return
    message = f"URDF has no <{element.tag}> in <{parent.tag if parent else ''}>; the element is skipped"
    remedy = f"did you mean <{close}>?" if close else "remove the element"
    if element.tag in _POSE_NAMES_OF_OTHER_FORMATS:
        remedy = f"write {_EXAMPLES['origin']}"
    elif element.tag in VENDOR_NAMES:
        remedy = "keep the element if another program needs it"
    severity = Severity.NOTE if element.tag in VENDOR_NAMES else None
    report.add(UNKNOWN_ELEMENT, message, element, remedy=remedy, severity=severity)


def walk_outside_extensions(element: Element) -> Iterator[Element]:
    stack = [element]
    while stack:
        element = stack.pop()
        yield element
        stack += [child for child in reversed(element.children) if child.tag not in EXTENSION_ELEMENTS]


def _is_link_or_joint(element: Element) -> bool:
    """Return whether an element is a link or joint, possibly with a misspelt tag."""
    tag = nearest_tag(element.tag, _LINK_OR_JOINT) if len(element.tag) < _MISSPELT_LENGTH_BOUND else None
    if tag == "link":
        return "name" in element.attributes
    return tag == "joint" and (
        element.attributes.get("type", "").lower() in JOINT_TYPES or element.find("parent") is not None
    )


_LINK_OR_JOINT = frozenset({"link", "joint"})

#: Only shorter tags can be a misspelt `link` or `joint`.
_MISSPELT_LENGTH_BOUND = 8


def _check_attributes(report: Reporter, element: Element) -> None:
    known = ATTRIBUTES.get(element.tag)
    if known is None:
        return
    for attribute in element.attributes:
        if attribute in known or ":" in attribute or attribute == "xmlns":
            continue
        close = None if report.is_full(UNKNOWN_ATTRIBUTE) else nearest_tag(attribute, known)
        every = f"the attributes of <{element.tag}> are: {', '.join(sorted(known))}"
        report.add(
            UNKNOWN_ATTRIBUTE,
            f"<{element.tag}> has no attribute of this name; the attribute is skipped",
            element,
            attribute=attribute,
            found=f"{attribute}={quote(element.attributes[attribute])}",
            remedy=f"did you mean {close}?" if close else every,
            severity=Severity.NOTE if attribute in VENDOR_NAMES else None,
            fix=None
            if close or attribute in _KEPT_ATTRIBUTES
            else partial(report.make_removal_fix, element, attribute),
        )


def _check_text(report: Reporter, element: Element) -> None:
    if not element.text or element.tag not in _ELEMENTS_WITHOUT_TEXT:
        return
    if element.tag in ("parent", "child") and "link" not in element.attributes:
        return  # Another finding already quotes this text.
    lost = element.tag in _VECTOR_ELEMENTS and not element.attributes
    example = _EXAMPLES.get(element.tag)
    message, found = f"text inside <{element.tag}> is skipped", quote(element.text)
    remedy = f"write the value as an attribute, as in {example}" if example else "remove the text"
    severity = Severity.ERROR if lost else None
    report.add(STRAY_TEXT, message, element, found=found, remedy=remedy, severity=severity)


_EXAMPLES = {
    "origin": '<origin xyz="0 0 1" rpy="0 0 0"/>',
    "axis": '<axis xyz="0 0 1"/>',
    "limit": '<limit lower="-1" upper="1" effort="10" velocity="1"/>',
    "mimic": '<mimic joint="knuckle" multiplier="1" offset="0"/>',
    "parent": '<parent link="base"/>',
    "child": '<child link="arm"/>',
}


def _check_repeats(report: Reporter, element: Element) -> None:
    once = _SINGLE_CHILDREN.get(element.tag)
    if once is None:
        return
    seen: dict[str, Element] = {}
    for child in element.children:
        if child.tag in seen and child.tag in once:
            message = f"a second <{child.tag}> is skipped; the first, on line {seen[child.tag].line}, is used"
            report.add(DUPLICATE_ELEMENT, message, child, remedy="remove one of these elements")
        seen.setdefault(child.tag, child)


UNDECLARED_PREFIX = Rule("URDF214", "undeclared-prefix", WARNING)

#: URDF214 skips tags with these beginnings, because URDF202 and URDF112 report them.
_PREFIXES_OF_OTHER_RULES = ("xacro:", "xi:include")


def check_prefixes(report: Reporter, root: Element) -> None:
    for prefix, places in _find_undeclared_prefixes(root).items():
        element, attribute = places[0]
        message = f"the prefix {quote(prefix)} is not declared; most XML readers refuse the file"
        remedy = f'write xmlns:{shorten(prefix)}="..." in <robot>, or remove the names with this prefix'
        found = quote(attribute or f"<{element.tag}>") + _count_more(places)
        report.add(UNDECLARED_PREFIX, message, element, attribute=attribute, found=found, remedy=remedy)


def _find_undeclared_prefixes(root: Element) -> dict[str, list[_ElementOrAttribute]]:
    found: dict[str, list[_ElementOrAttribute]] = {}
    declared = Counter(("xml", "xmlns"))  # XML itself declares the prefixes xml and xmlns.
    stack = [(root, False)]
    while stack:
        element, leaving = stack.pop()
        own = [key.removeprefix("xmlns:") for key in element.attributes if key.startswith("xmlns:")]
        if leaving:
            declared.subtract(own)
            continue
        declared.update(own)
        if own:
            stack.append((element, True))
        stack += [(child, False) for child in reversed(element.children)]
        for prefix, attribute in _find_prefix_uses(element):
            if declared[prefix] < 1:
                found.setdefault(prefix, []).append((element, attribute))
    return found


def _find_prefix_uses(element: Element) -> Iterator[tuple[str, str | None]]:
    """Yield each namespace prefix, with the name of the attribute that has it, or None for the tag."""
    if ":" in element.tag and not element.tag.startswith(_PREFIXES_OF_OTHER_RULES):
        yield element.tag.partition(":")[0], None
    for key in element.attributes:
        if ":" in key:
            yield key.partition(":")[0], key


RESERVED_NAME = Rule("URDF403", "reserved-name", WARNING)
NAME_UNIVERSE = Rule("URDF404", "name-universe", WARNING, DIFFERS)
ODD_NAME = Rule("URDF405", "odd-name", WARNING)
LINE_BREAK_IN_NAME = Rule("URDF406", "line-break-in-name", WARNING, DIFFERS)
LOOKALIKE = Rule("URDF407", "lookalike-names", WARNING)

#: URDF405 reports longer names, because they break tables and file paths.
MAX_NAME_LENGTH = 200


def check_names(report: Reporter, robot: RobotRecord, root_joint: str | None) -> None:
    links = list(robot.links.items())
    joints = [(joint.name, joint.element) for joint in robot.joints if joint.name]
    for name, element in (*links, *joints):
        _check_odd_name(report, name, element)
        _check_line_breaks_in_name(report, element)
        _check_reserved(report, name, element, root_joint)
    for kind in (links, joints):
        _check_lookalikes(report, kind)


def _check_odd_name(report: Reporter, name: str, element: Element) -> None:
    formula = f"the name begins with {name[0]}, like a spreadsheet formula"
    long = f"the name has {len(name)} characters"
    reasons = {
        "the name contains characters that cannot be printed": not name.isprintable(),
        "the name begins or ends with a space": name != name.strip(),
        "the name contains a slash, like a path": "/" in name or "\\" in name,
        formula: name[0] in "=+-@",
        long: len(name) > MAX_NAME_LENGTH,
        "the name contains a special character of shells or XML": bool(set(name) & set("\"'<>&|;`$")),
    }
    if reason := next((text for text, is_true in reasons.items() if is_true), None):
        remedies = {
            formula: "begin the name with a letter",
            long: f"use at most {MAX_NAME_LENGTH} characters",
        }
        remedy = remedies.get(reason, "use letters, digits, - and _")
        report.add(ODD_NAME, reason, element, attribute="name", found=quote(name), remedy=remedy)


def _check_line_breaks_in_name(report: Reporter, element: Element) -> None:
    raw_value = report.raw_value(element, "name") if report.has_replaced_characters else None
    if raw_value is not None and any(c in raw_value for c in "\t\r\n"):
        message = "the name contains a tab or a line end"
        remedy = "write the name on one line, without tabs"
        report.add(
            LINE_BREAK_IN_NAME, message, element, attribute="name", found=quote(raw_value), remedy=remedy
        )


def _check_reserved(report: Reporter, name: str, element: Element, root_joint: str | None) -> None:
    if name == "universe" and element.tag == "joint":
        message = "Pinocchio uses this name for the world and does not find the joint"
        report.add(NAME_UNIVERSE, message, element, attribute="name", remedy="rename the joint")
    elif (element.tag, name) in (("link", "universe"), ("joint", "root_joint")):
        what = "the world" if name == "universe" else "the joint of a free or planar base"
        remedy = (
            ", or load without root_joint" if root_joint else " before you load the robot with root_joint"
        )
        report.add(
            RESERVED_NAME,
            f"the name is reserved for {what}",
            element,
            attribute="name",
            remedy=f"rename the {element.tag}{remedy}",
            severity=Severity.ERROR if root_joint else None,
        )


def _check_lookalikes(report: Reporter, named_elements: list[tuple[str, Element]]) -> None:
    seen: dict[str, str] = {}
    for name, element in named_elements:
        if name.isascii() or len(name) > MAX_NAME_LENGTH:
            continue  # Long names are slow to compare, and URDF405 already reports long names.
        key = unicodedata.normalize("NFKC", name)
        first = seen.setdefault(key, name)
        if first != name:
            message = "another name looks the same or nearly the same, but has different characters"
            remedy = "use only one of the two spellings"
            found = ascii(name) + " and " + ascii(first)
            report.add(LOOKALIKE, message, element, attribute="name", found=found, remedy=remedy)


BAD_COMMENT = Rule("URDF120", "bad-comment", WARNING)
UNUSED_COMMENT = Rule("URDF121", "unused-comment", NOTE)

_COMMENT_PATTERN = re.compile(r"\s*urdfkin:\s*ignore\s*\[([^\]]*)\]\s*(.*)", re.DOTALL)
_CODE_SEPARATOR = re.compile(r"[,\s]+")


def apply_comments(report: Reporter, code_by_name: Mapping[str, str]) -> None:
    comment_index = CommentIndex()
    for comment in report.comments:
        if (ignore := _read_comment(report, comment, code_by_name)) is not None:
            comment_index.add(ignore)
    report.silence(comment_index)


def _read_comment(
    report: Reporter, comment: Comment, code_by_name: Mapping[str, str]
) -> IgnoreComment | None:
    match = _COMMENT_PATTERN.fullmatch(comment.text)
    words = [word for word in _CODE_SEPARATOR.split(match[1]) if word] if match else []
    unknown = next((word for word in words if word.lower() not in code_by_name), None)
    reason = " ".join(match[2].split()) if match else ""
    remedy: str | None
    if words and unknown is None and reason:
        return IgnoreComment(
            comment, tuple(dict.fromkeys(code_by_name[word.lower()] for word in words)), reason
        )
    if not words:
        what, remedy = "no code in brackets", "write <!-- urdfkin: ignore[URDF503] the reason -->"
    elif unknown is not None:
        close = report.find_nearest_names(unknown.lower(), code_by_name)
        what = f"unknown code {quote(unknown)}"
        remedy = (
            f"did you mean {', '.join(dict.fromkeys(code_by_name[word] for word in close))}?"
            if close
            else None
        )
    else:
        what, remedy = "no reason is given", "write the reason after the bracket"
    message = f"{what}, so the comment silences nothing"
    found = quote(f"<!--{comment.text}-->")
    report.add(BAD_COMMENT, message, found=found, remedy=remedy, position=(comment.line, comment.column))
    return None


def check_unused_comments(report: Reporter) -> None:
    """Report codes in comments that silence no finding. Call this function after all other rules."""
    for ignore in report.comment_index.comments:
        for code in ignore.codes:
            if code not in ignore.used_codes:
                comment = ignore.comment
                message = f"{code} is silenced, but there is no warning or note with this code here"
                remedy = f"remove {code} from the comment; a comment cannot silence an error"
                found, position = quote(f"<!--{comment.text}-->"), (comment.line, comment.column)
                report.add(UNUSED_COMMENT, message, found=found, remedy=remedy, position=position)
