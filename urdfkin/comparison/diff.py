"""List the changes between two versions of a robot description, and bound the displacements of frames.

Two files of the same format are compared attribute by attribute. Two MJCF files or two USD files are first
converted to URDF. For files of different formats, `diff` lists the differences that `same` finds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from urdfkin.comparison.result import (
    BOUNDED_DIFFERENCE_KINDS,
    Difference,
    Interval,
    Sameness,
    angle,
    interval_text,
    length,
    limit_differences,
    size_words,
)
from urdfkin.comparison.verdict import same
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.errors.escape import log_line
from urdfkin.errors.numbers import parse_float
from urdfkin.errors.validators import as_bool
from urdfkin.kinematics.roundings import SINGLE_ROUNDOFF
from urdfkin.model.conventions.convention import spellings
from urdfkin.model.tree import Joint, KinematicTree, Mimic
from urdfkin.robot import Robot
from urdfkin.robot.loading import as_robot, make_robot
from urdfkin.system.plain_xml import parse_xml
from urdfkin.urdf.sources import Source, UrdfText, is_usd
from urdfkin.urdf.writer import to_urdf

_VECTOR_COMPONENTS = {"xyz": ("x", "y", "z"), "rpy": ("roll", "pitch", "yaw")}
#: Default values of a joint's optional attributes.
_ORIGIN_DEFAULTS = {f"origin {part}": 0.0 for parts in _VECTOR_COMPONENTS.values() for part in parts}
_AXIS_DEFAULTS = {"axis x": 1.0, "axis y": 0.0, "axis z": 0.0}
_MIMIC_DEFAULTS = {"mimic multiplier": 1.0, "mimic offset": 0.0}
_LIMIT_DEFAULTS = {"limit lower": 0.0, "limit upper": 0.0}
_DYNAMICS_DEFAULTS = {"dynamics damping": 0.0, "dynamics friction": 0.0}
#: Joint attributes that affect the motion of links.
_MOTION_ATTRIBUTES = ("", "origin", "axis", "mimic", "type", "parent", "child", "fixed", "kind")
#: Values of `ModelChange.what` for changes that move a link.
#: The values occur only if the files have different formats.
_MOTION_LINK_ATTRIBUTES = ("origin", "place", "base", "carried by")

Value = float | str


@dataclass(frozen=True, slots=True)
class ModelChange:
    """A changed attribute, or an element that only one version has.

    Attributes:
        what: Name of the attribute, for example "origin x". Empty for a new or removed element.
        size: Size of the change, for example "38.14 mm off". Empty for most changes. Only changes between
            different formats can have a size, for example changes of an axis.
    """

    element: str
    what: str
    old: Value | None
    new: Value | None
    size: str = ""

    @property
    def moves(self) -> bool:
        if self.element.startswith("link "):
            return self.what in _MOTION_LINK_ATTRIBUTES
        if self.element == "robot":
            return self.what == "as a whole"
        return self.element.startswith("joint ") and self.what.split(" ")[0] in _MOTION_ATTRIBUTES

    def __str__(self) -> str:
        if not self.what:
            return log_line(f"{self.element}: {'new' if self.old is None else 'gone'}")
        if self.size:
            return log_line(f"{self.element}: {self.what} {self.size}")
        return log_line(f"{self.element}: {self.what} {format_value(self.old)} -> {format_value(self.new)}")


def format_value(value: Value | None) -> str:
    """Return a value as text from which a number can be read back exactly."""
    if isinstance(value, float):
        return next(text for text in (f"{value:.15g}", repr(value)) if float(text) == value)
    return "none" if value is None else value


def displacement_text(frame: Interval, moves: str = "move", turns: str = "turn") -> str:
    if frame.lower == frame.radians_seen == 0.0 and math.isinf(frame.upper):
        return f"{moves} {frame.frame} without a proven bound"
    if frame.lower == 0.0:
        return f"{turns} {frame.frame} by up to {interval_text(angle, frame.radians_seen, frame.radians)}"
    return f"{moves} {frame.frame} by up to {interval_text(length, frame.lower, frame.upper)}"


@dataclass(frozen=True, slots=True)
class Effect:
    """Effect of one changed joint or link, while all others are unchanged.

    Attributes:
        element: The changed element, for example "joint elbow".
        interval: The frame with the largest displacement, with bounds on this displacement.
    """

    element: str
    interval: Interval

    @property
    def words(self) -> str:
        return displacement_text(self.interval, "moves", "turns")

    def __str__(self) -> str:
        return log_line(f"alone {self.words}")


@dataclass(frozen=True, slots=True)
class Changes:
    """The changes between two versions; the result of `urdfkin.diff`.

    Attributes:
        sources: Sources of the old and the new version.
        changes: The changes. For versions of the same format, a change of the robot's name comes first, then
            changes of joints, then changes of links.
        effects: Effect of each changed joint or link that moves frames, while all others are unchanged. An
            effect that cannot be computed is missing, for example the effect of a new joint, or of a joint
            with another parent link. Empty if the argument `effects` is False.
        total: The matching frame with the largest displacement by all changes. None if no listed change moves
            a matching frame, or if the argument `effects` is False.
        rounding: Proven bounds on the distance (m) and the angle (rad) between matching frames, if single
            precision explains every difference in motion. `changes` does not list these differences. Infinite
            if no bounds were proven, for example if the argument `effects` is False. None if the formats are
            equal, or if the verdict of `same` is not `UP_TO_SINGLE`.
    """

    sources: tuple[str, str]
    changes: tuple[ModelChange, ...]
    effects: tuple[Effect, ...]
    total: Interval | None
    rounding: tuple[float, float] | None = None

    def __bool__(self) -> bool:
        return bool(self.changes)

    @property
    def effect_of(self) -> dict[str, Effect]:
        """Map the name of each element, for example "joint elbow", to its effect."""
        return {effect.element: effect for effect in self.effects}


def diff(a: Robot | Source | DHTable, b: Robot | Source | DHTable, *, effects: bool = True) -> Changes:
    """List the changes between two versions of a robot description.

    Versions of the same format are compared attribute by attribute. If the formats differ, for example URDF
    and MJCF, `diff` lists the differences that `same` finds. For matched joints and links, `diff` then uses
    the names of the old version.

    Args:
        a: The old version: a robot, or a source for `load`.
        b: The new version: a robot, or a source for `load`.
        effects: Whether to bound the displacements that each changed joint causes.

    Raises:
        UrdfError: a version has errors. SourceError, UnknownNameError, InputError: as for `load`.

    Example:
        >>> import urdfkin
        >>> found = urdfkin.diff("ur5", "ur5_limited")
        >>> print(found.changes[0])
        joint shoulder_pan_joint: limit lower -6.28318530718 -> -3.14159265359
    """
    old, new, effects = as_robot(a), as_robot(b), as_bool(effects, "effects")
    if _format(old) != _format(new):
        return _diff_across_formats(old, new, effects=effects)
    changes = tuple(_changes(old.urdf, new.urdf))
    moving = list(dict.fromkeys(change.element for change in changes if change.moves)) if effects else []
    found = [_effect(old.tree, new.tree, element, element.removeprefix("joint ")) for element in moving]
    total = same(old, new).worst_as_written if moving else None
    return Changes((old.source, new.source), changes, tuple(filter(None, found)), total)


def _format(robot: Robot) -> str:
    if is_usd(robot.source):
        return "USD"
    return "MJCF" if robot.origin.sha256 else "URDF"


def _diff_across_formats(old: Robot, new: Robot, *, effects: bool) -> Changes:
    result = same(old, new, bounds=effects)
    changes = tuple(_changes_of(result, (_format(old), _format(new))))
    found = list[Effect | None]()
    if effects:
        tree = _rename_like_a(result)
        moving = [one.element for one in changes if one.moves and one.element != "robot"]
        for element in dict.fromkeys(moving):
            kind, _, name = element.partition(" ")
            if kind == "link" and (link := old.tree.link_index(name)):
                name = old.tree.joints[link - 1].name
            found.append(_effect(old.tree, tree, element, name))
    total = result.worst_as_written if any(change.moves for change in changes) else None
    rounding = result.bound_as_written if result.up_to_single else None
    return Changes((old.source, new.source), changes, tuple(filter(None, found)), total, rounding)


def _changes_of(result: Sameness, formats: tuple[str, str]) -> Iterator[ModelChange]:
    for joint_difference in result.unexplained:
        if joint_difference.what and joint_difference.a is None:
            yield ModelChange(
                joint_difference.place, joint_difference.what, None, None, str(joint_difference.b)
            )
        elif joint_difference.what:
            yield ModelChange(
                joint_difference.place, joint_difference.what, joint_difference.a, joint_difference.b
            )
    yield from _changes_with_size(result)
    for one in result.differences:
        if one.what not in BOUNDED_DIFFERENCE_KINDS or one.what == "fixed":
            yield from _change_of(one)
    for pair in result.joints:
        if pair.b not in spellings(pair.a) and pair.a not in spellings(pair.b):
            yield ModelChange(f"joint {pair.a}", "name", pair.a, pair.b)
        a, b = (
            tree.joints[tree.joint_index(name)]
            for tree, name in zip(result.trees, (pair.a, pair.b), strict=True)
        )
        if a.kind.nv == b.kind.nv and a.kind.turns == b.kind.turns:
            single_roundoff = SINGLE_ROUNDOFF if result.single else 0.0
            for one in limit_differences(a, b, result.rounding[1], single_roundoff):
                yield from _change_of(one)
    # Readers of MJCF and USD add the root link "world".
    roots = [tree.links[0] for tree, name in zip(result.trees, formats, strict=True) if name != "URDF"]
    for one in result.remarks:
        if one.what in ("idle", "only in A", "only in B"):
            yield from (
                change for change in _change_of(one) if change.element != "link world" or "world" not in roots
            )


def _changes_with_size(result: Sameness) -> Iterator[ModelChange]:
    """Yield the differences that `same` finds, if the joints cannot be compared one by one."""
    if result.up_to_single or (result.unexplained and all(one.what for one in result.unexplained)):
        return
    listed = {one.place for one in result.unexplained if one.what}
    for words in result.after:
        yield ModelChange("robot", "as a whole", None, None, words)
    for one in result.differences:
        if one.what in BOUNDED_DIFFERENCE_KINDS - {"fixed"} and one.place not in listed:
            yield ModelChange(one.place, one.what, *one.values, size_words(one.metres, one.radians))


def _change_of(difference: Difference) -> Iterator[ModelChange]:
    if difference.what not in ("only in A", "only in B"):
        yield ModelChange(difference.place, difference.what, *difference.values)
        return
    names = [difference.place]
    if difference.place.startswith("links "):
        links = difference.a if difference.what == "only in A" else difference.b
        names = [f"link {name}" for name in links] if isinstance(links, tuple) else []
    for name in names:
        tag = name.partition(" ")[0]
        old, new = (tag, None) if difference.what == "only in A" else (None, tag)
        yield ModelChange(name, "", old, new)


def _rename_like_a(result: Sameness) -> KinematicTree:
    """Return B's tree with A's names for matched joints and links.

    An unmatched joint also takes A's name if its child link is matched.
    """
    old, tree = result.trees
    links = {theirs: ours for ours, theirs in result.links}
    names = {one.b: one.a for one in result.joints}
    for i, joint in enumerate(tree.joints):
        link = links.get(tree.links[i + 1])
        if joint.name not in names and link in old.links[1:]:
            names[joint.name] = old.joints[old.link_index(link) - 1].name

    def rule(joint: Joint) -> Mimic | None:
        return joint.mimic and replace(
            joint.mimic, mimicked_joint=names.get(joint.mimic.mimicked_joint, joint.mimic.mimicked_joint)
        )

    joints = tuple(
        replace(joint, name=names.get(joint.name, joint.name), mimic=rule(joint)) for joint in tree.joints
    )
    return KinematicTree(tree.name, tuple(links.get(link, link) for link in tree.links), joints)


def _changes(old: str, new: str) -> Iterator[ModelChange]:
    roots = parse_xml(old), parse_xml(new)
    names = roots[0].get("name"), roots[1].get("name")
    if names[0] != names[1]:
        yield ModelChange("robot", "name", *names)
    for tag in ("joint", "link"):
        before, after = ({str(e.get("name")): e for e in root.findall(tag)} for root in roots)
        for name in dict.fromkeys([*before, *after]):
            element = f"{tag} {name}"
            if name not in before or name not in after:
                old_tag, new_tag = (tag if name in there else None for there in (before, after))
                yield ModelChange(element, "", old_tag, new_tag)
                continue
            a, b = (_all_attributes(e, tag) for e in (before[name], after[name]))
            for what in dict.fromkeys([*a, *b]):
                if a.get(what) != b.get(what):
                    yield ModelChange(element, what, a.get(what), b.get(what))


def _all_attributes(element: Element, tag: str) -> dict[str, Value]:
    """Map attribute names such as "origin x" to values. A joint's default values are added."""
    found = dict(_attributes(element, ""))
    found.pop("name", None)
    if tag == "joint":
        defaults: dict[str, Value] = dict(_ORIGIN_DEFAULTS)
        defaults |= _AXIS_DEFAULTS if found.get("type") not in ("fixed", "floating") else {}
        defaults |= _MIMIC_DEFAULTS if "mimic joint" in found else {}
        has_ends = element.find("limit") is not None and found.get("type") in ("revolute", "prismatic")
        defaults |= _LIMIT_DEFAULTS if has_ends else {}
        defaults |= _DYNAMICS_DEFAULTS if element.find("dynamics") is not None else {}
        found = defaults | found
    return found


def _attributes(element: Element, path: str) -> Iterator[tuple[str, Value]]:
    for name, text in element.attrib.items():
        if (parts := _VECTOR_COMPONENTS.get(name)) and len(words := text.split()) == len(parts):
            for part, number in zip(parts, words, strict=True):
                yield f"{path} {part}".strip(), _value(number)
        else:
            what = path if name in ("value", "link") and path else f"{path} {name}".strip()
            yield what, _value(text)
    tags = [child.tag for child in element]
    for k, child in enumerate(element):
        if isinstance(child.tag, str):
            count = f" {tags[: k + 1].count(child.tag)}" if tags.count(child.tag) > 1 else ""
            yield from _attributes(child, f"{path} {child.tag}{count}".strip())


def _value(text: str) -> Value:
    number = parse_float(text)
    return text if number is None else number


def _effect(old: KinematicTree, new: KinematicTree, element: str, name: str) -> Effect | None:
    """Return the effect of one changed joint, or None if the effect is zero or cannot be computed."""
    names, new_names = ({joint.name for joint in tree.joints} for tree in (old, new))
    if name not in names & new_names:
        return None
    i, k = old.joint_index(name), new.joint_index(name)
    joint = new.joints[k]
    ends = [(tree.links[tree.joints[j].parent], tree.links[j + 1]) for tree, j in ((old, i), (new, k))]
    if ends[0] != ends[1] or (joint.mimic and joint.mimic.mimicked_joint not in names):
        return None
    joints = list(old.joints)
    joints[i] = replace(joint, parent=joints[i].parent)
    try:
        changed, unchanged = (
            _make_unverified_robot(tree) for tree in (replace(old, joints=tuple(joints)), old)
        )
    except InputError:  # A URDF cannot describe the changed tree.
        return None
    worst = same(unchanged, changed).worst_as_written
    return None if worst is None else Effect(element, worst)


def _make_unverified_robot(tree: KinematicTree) -> Robot:
    text = UrdfText(to_urdf(tree).encode(), tree.name, tree.name)
    return make_robot(text, verify=False, is_generated=True, quiet=True)
