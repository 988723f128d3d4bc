"""Write a `KinematicTree` as URDF text, and insert attributes and elements into an existing text.

Each number has enough digits to restore the same double. A rotation is written as roll, pitch and yaw. URDF
readers restore the rotation up to rounding errors. In an existing text, byte 0 is the first byte after a byte
order mark.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit
from urdfkin.system.files import Edit
from urdfkin.urdf.records import ATTRIBUTE, START_TAG, Element


def to_urdf(tree: KinematicTree, joint_names: Sequence[str] | None = None) -> str:
    """Write the links and joints of a tree as URDF, without shapes and masses.

    `joint_names` is the order of all joints, and of their child links, in the text. None: the tree's order.

    URDF 1.0 requires finite limits of effort and velocity in a <limit> element. Infinite limits are omitted.
    If a <limit> element lacks a limit of effort or velocity, the file declares version 1.2.

    Raise InputError if a revolute or prismatic joint has no finite position limits, or if a name contains a
    character that XML does not allow.
    """
    version = ' version="1.2"' if any(_needs_version_1_2(joint) for joint in tree.joints) else ""
    lines = [f'<robot name="{escape_attribute(tree.name)}"{version}>']
    order = range(len(tree.joints)) if joint_names is None else list(map(tree.joint_index, joint_names))
    links = [tree.links[0], *(tree.links[i + 1] for i in order)]
    lines += [f'  <link name="{escape_attribute(link)}"/>' for link in links]
    for i in order:
        joint = tree.joints[i]
        lines += _write_joint(joint, tree.links[joint.parent], tree.links[i + 1])
    lines.append("</robot>")
    return "\n".join(lines) + "\n"


def _needs_version_1_2(joint: Joint) -> bool:
    if (limit := joint.limit) is None:
        return False
    infinite = [math.isinf(limit.effort), math.isinf(limit.velocity)]
    # If effort and velocity are infinite, a joint without position limits needs no <limit> element.
    return any(infinite) and (joint.kind.has_limits or not all(infinite))


def _write_joint(joint: Joint, parent: str, child: str) -> Iterable[str]:
    T = joint.T_parent_joint
    yield f'  <joint name="{escape_attribute(joint.name)}" type="{joint.kind.value}">'
    yield f'    <parent link="{escape_attribute(parent)}"/>'
    yield f'    <child link="{escape_attribute(child)}"/>'
    yield f'    <origin xyz="{format_numbers(T[:3, 3])}" rpy="{format_numbers(rpy_of(T[:3, :3]))}"/>'
    if joint.kind.has_axis:
        yield f'    <axis xyz="{format_numbers(joint.axis)}"/>'
    elif joint.kind is JointKind.PLANAR:
        yield '    <axis xyz="0 0 1"/>'
    yield from _write_limit(joint, joint.limit)
    if (rule := joint.mimic) is not None:
        name = escape_attribute(rule.mimicked_joint)
        yield f'    <mimic joint="{name}" multiplier="{rule.multiplier!r}" offset="{rule.offset!r}"/>'
    yield "  </joint>"


def _write_limit(joint: Joint, limit: Limit | None) -> Iterable[str]:
    has_limits = joint.kind.has_limits
    if has_limits and (limit is None or math.isinf(limit.lower) or math.isinf(limit.upper)):
        message = "a URDF needs finite position limits for a revolute or prismatic joint"
        remedy = "give the joint limits, or make it continuous if it rotates without limits"
        found = "none" if limit is None else f"{limit.lower} to {limit.upper}"
        raise InputError(message, where=f"joint {joint.name}", found=found, remedy=remedy)
    if limit is None:
        return
    named = [("effort", limit.effort), ("velocity", limit.velocity)]
    if has_limits:
        named = [("lower", limit.lower), ("upper", limit.upper), *named]
    # A NaN is written, so that `check` reports it.
    written = [f'{name}="{float(value)!r}"' for name, value in named if not math.isinf(value)]
    if written:
        yield f"    <limit {' '.join(written)}/>"


def format_numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}


def escape_attribute(text: str) -> str:
    """Escape the value of an attribute; raise InputError for a character that XML does not allow."""
    if bad := _INVALID_CHARACTER.search(text):
        found = f"U+{ord(bad[0]):04X}"
        raise InputError("XML does not allow this character", where=repr(text), found=found)
    return "".join(_ESCAPES.get(character, character) for character in text)


#: Characters that XML 1.0 does not allow (production Char).
_INVALID_CHARACTER = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


_INDENTATION_PATTERN = re.compile(rb"((?:\r\n|\r|\n)?[ \t]*+)\Z")


def make_attribute_edits(data: bytes, target: Element, values: Mapping[str, str]) -> Iterator[Edit]:
    """Yield the edits that set attributes of an element; new attributes come last."""
    name_end = target.offset + 1 + len(target.tag.encode())
    tag = START_TAG.match(data, target.offset)
    end = tag.end() if tag else name_end
    known = {match[1].decode(): match.span(2) for match in ATTRIBUTE.finditer(data, name_end, end)}
    added = ""
    for name, value in values.items():
        if name not in known:
            added += f' {name}="{escape_attribute(value)}"'
        else:
            start, end = known[name]
            yield Edit(start + 1, end - 1, escape_attribute(value))
    if added:
        last = max((end for _, end in known.values()), default=name_end)
        yield Edit(last, last, added)


def make_insertion_before_element(data: bytes, target: Element, element: str) -> Edit:
    """Return the edit that inserts the text `element` before `target`, with the same indentation."""
    indentation = _INDENTATION_PATTERN.search(data[max(0, target.offset - 1000) : target.offset])
    return Edit(target.offset, target.offset, element + (indentation[1].decode() if indentation else ""))
