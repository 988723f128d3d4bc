"""List the changes between two versions of a robot description, and bound how far they move the frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from urdfkin.comparison.result import Interval, angle, length, up_to
from urdfkin.comparison.verdict import same
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.errors.escape import log_line
from urdfkin.errors.numbers import parse_float
from urdfkin.model.tree import Joint, KinematicTree
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.system.plain_xml import plain_xml
from urdfkin.urdf.sources import Source
from urdfkin.urdf.writer import to_urdf

#: Attributes in a URDF that consist of several numbers, each with the names of its numbers.
_PARTS = {"xyz": ("x", "y", "z"), "rpy": ("roll", "pitch", "yaw")}
#: Default values of a joint's attributes, for attributes that the file omits.
_DEFAULTS = {f"origin {part}": 0.0 for parts in _PARTS.values() for part in parts}
_AXIS = {"axis x": 1.0, "axis y": 0.0, "axis z": 0.0}
_RULE = {"mimic multiplier": 1.0, "mimic offset": 0.0}
#: Attributes of a joint that affect the motion of links.
_MOVING = ("", "origin", "axis", "mimic", "type", "parent", "child")

Value = float | str


@dataclass(frozen=True, slots=True)
class Change:
    """One changed attribute, or an element that only one version has.

    Attributes:
        element: The element, for example "joint elbow" or "link tool".
        what: The attribute, for example "origin x" or "mass"; "" if the whole element was added or removed.
        old: The value in the old version; None if the old version has no value.
        new: The value in the new version; None if the new version has no value.
    """

    element: str
    what: str
    old: Value | None
    new: Value | None

    @property
    def moves(self) -> bool:
        """Whether the change can affect the motion of links."""
        return self.element.startswith("joint ") and self.what.split(" ")[0] in _MOVING

    def __str__(self) -> str:
        if not self.what:
            return log_line(f"{self.element}: {'new' if self.old is None else 'gone'}")
        return log_line(f"{self.element}: {self.what} {word(self.old)} -> {word(self.new)}")


def word(value: Value | None) -> str:
    """Return a value as text: the shortest decimal number that reads back exactly, or "none"."""
    if isinstance(value, float):
        return next(text for text in (f"{value:.15g}", repr(value)) if float(text) == value)
    return "none" if value is None else value


def motion_words(frame: Interval, moves: str = "move", turns: str = "turn") -> str:
    """Return text about the distance by which changes move a frame, or the angle of a pure rotation."""
    if frame.lower == 0.0:
        return f"{turns} {frame.frame} by up to {up_to(angle, frame.radians_seen, frame.radians)}"
    return f"{moves} {frame.frame} by up to {up_to(length, frame.lower, frame.upper)}"


@dataclass(frozen=True, slots=True)
class Effect:
    """The effect of one joint's changes: the frame that moves most, and the distance by which it moves."""

    element: str
    interval: Interval

    @property
    def words(self) -> str:
        """The effect as text, for example "moves tool0 by up to 38 mm"."""
        return motion_words(self.interval, "moves", "turns")

    def __str__(self) -> str:
        return log_line(f"alone {self.words}")


@dataclass(frozen=True, slots=True)
class Changes:
    """The changes between two versions of a description; the result of `urdfkin.diff`.

    Attributes:
        sources: The sources of the old and the new version, as the user gave them.
        changes: The changes of the robot's name, then of joints, then of links, in the order of the file.
        effects: For each joint with changes that move links, the effect of the changes of this joint alone.
        total: The frame that all changes together move most; None if no frame moves.
    """

    sources: tuple[str, str]
    changes: tuple[Change, ...]
    effects: tuple[Effect, ...]
    total: Interval | None

    def __bool__(self) -> bool:
        """Whether anything changed."""
        return bool(self.changes)

    @property
    def effect_of(self) -> dict[str, Effect]:
        """The effect for each changed joint, by the element's name, for example "joint elbow"."""
        return {effect.element: effect for effect in self.effects}


def diff(a: Robot | Source | DHTable, b: Robot | Source | DHTable, *, effects: bool = True) -> Changes:
    """List the changes from one version of a description to another, attribute by attribute.

    Args:
        a: The old version: a robot, or a source for `load`.
        b: The new version: a robot, or a source for `load`.
        effects: Whether to bound how far the changes of each joint move the frames between this joint and the
            tips.

    Raises:
        UrdfError: a version has errors. SourceError, UnknownNameError, InputError: as for `load`.

    Example:
        >>> import urdfkin
        >>> found = urdfkin.diff("ur5", "ur5_limited")
        >>> print(found.changes[0])
        joint shoulder_pan_joint: limit lower -6.28318530718 -> -3.14159265359
    """
    old, new = (source if isinstance(source, Robot) else load(source) for source in (a, b))
    changes = tuple(_changes(old.urdf, new.urdf))
    moving = list(dict.fromkeys(change.element for change in changes if change.moves)) if effects else []
    some = (_effect(old, new, element) for element in moving)
    total = same(old, new).worst_as_written if moving else None
    return Changes((old.source, new.source), changes, tuple(one for one in some if one is not None), total)


def _changes(old: str, new: str) -> Iterator[Change]:
    before, after = plain_xml(old), plain_xml(new)
    if before.get("name") != after.get("name"):
        yield Change("robot", "name", before.get("name"), after.get("name"))
    for tag in ("joint", "link"):
        was, now = ({str(e.get("name")): e for e in root.findall(tag)} for root in (before, after))
        for name in dict.fromkeys([*was, *now]):
            element = f"{tag} {name}"
            if name not in was or name not in now:
                yield Change(element, "", *(tag if name in there else None for there in (was, now)))
                continue
            facts, others = (_facts(e, tag) for e in (was[name], now[name]))
            for what in dict.fromkeys([*facts, *others]):
                if facts.get(what) != others.get(what):
                    yield Change(element, what, facts.get(what), others.get(what))


def _facts(element: Element, tag: str) -> dict[str, Value]:
    """Return the attribute values of an element and of the element's children, by readable names."""
    found = dict(_attributes(element, ""))
    found.pop("name", None)
    if tag == "joint":
        defaults: dict[str, Value] = dict(_DEFAULTS)
        defaults |= _AXIS if found.get("type") not in ("fixed", "floating") else {}
        defaults |= _RULE if "mimic joint" in found else {}
        found = defaults | found
    return found


def _attributes(element: Element, way: str) -> Iterator[tuple[str, Value]]:
    for name, text in element.attrib.items():
        if (parts := _PARTS.get(name)) and len(words := text.split()) == len(parts):
            yield from (
                (f"{way} {part}".strip(), _value(word)) for part, word in zip(parts, words, strict=True)
            )
        else:
            named = way if name in ("value", "link") and way else f"{way} {name}".strip()
            yield named, _value(text)
    tags = [child.tag for child in element]
    for k, child in enumerate(element):
        if isinstance(child.tag, str):
            count = f" {tags[: k + 1].count(child.tag)}" if tags.count(child.tag) > 1 else ""
            yield from _attributes(child, f"{way} {child.tag}{count}".strip())


def _value(text: str) -> Value:
    found = parse_float(text)
    return text if found is None else found


def _effect(old: Robot, new: Robot, element: str) -> Effect | None:
    """Compute the distances by which the changes of a single joint move the frames.

    The old robot is compared with a copy of the old robot in which only this joint is the new robot's.
    """
    name = element.removeprefix("joint ")
    trees = old.tree, new.tree
    if any(name not in {joint.name for joint in tree.joints} for tree in trees):
        return None
    at, there = (tree.joint_index(name) for tree in trees)
    ends = [
        (tree.links[tree.joints[i].parent], tree.links[i + 1])
        for tree, i in zip(trees, (at, there), strict=True)
    ]
    joint = trees[1].joints[there]
    if ends[0] != ends[1] or (joint.mimic and joint.mimic.leader not in {j.name for j in trees[0].joints}):
        return None
    try:
        changed = load(to_urdf(_with_joint(trees[0], at, joint)), verify=False)
        plain = load(to_urdf(trees[0]), verify=False)
    except InputError:  # this copy cannot be written as a URDF, so no effect is computed
        return None
    worst = same(plain, changed).worst_as_written
    return None if worst is None else Effect(element, worst)


def _with_joint(tree: KinematicTree, at: int, joint: Joint) -> KinematicTree:
    joints = list(tree.joints)
    joints[at] = replace(joint, parent=joints[at].parent)
    return KinematicTree(tree.name, tree.links, tuple(joints))
