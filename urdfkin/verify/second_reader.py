"""Read a robot's URDF a second time with yourdfpy, and compare yourdfpy's tree with urdfkin's tree.

Pinocchio checks the computed results. This module checks the data of the robot: links, joint kinds, origins,
axes, limits and mimic rules. The readers of yourdfpy and urdfkin share no code.

yourdfpy 0.0.60 has two known faults: it ignores the attribute `quat_xyzw` of an origin, and does not
normalise axes. The report separates these faults from other differences. If the URDF omits a number, yourdfpy
returns None, and the comparison uses urdfkin's default value.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors.escape import escape_unprintable
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Mimic
from urdfkin.system.lazy_import import installed_version
from urdfkin.system.plain_xml import parse_xml
from urdfkin.verify.oracle import resolve_rules

if TYPE_CHECKING:
    from yourdfpy import urdf as yourdf

#: Bound on the difference of an entry if two programs compute a rotation matrix from the same angles. An
#: entry is a b c + d e with sines and cosines a to e, and |a b c| + |d e| <= 1. Each sine and cosine has a
#: relative error of at most one eps, which changes the entry by at most 3 eps. Rounding the products and the
#: sum changes the entry by at most 1.5 eps. Two programs therefore differ by at most 2 (3 + 1.5) eps = 9 eps.
_ROTATION_TOLERANCE = 9.0 * EPS
#: Bound on the difference of a component if two programs normalise an axis. In each program, the relative
#: error of the axis's length is at most 2 eps, and the quotient adds at most 0.5 eps. Two programs therefore
#: differ by at most 2 (2 + 0.5) eps = 5 eps.
_AXIS_TOLERANCE = 5.0 * EPS
#: Largest accepted difference between 1 and the length of yourdfpy's axis.
_UNIT_TOLERANCE = 1e-6
_MAX_DIFFERENCES = 8
_MAX_QUOTE_LENGTH = 200
#: Kinds of joints that have position limits in the URDF specification.
_BOUNDED_KINDS = ("revolute", "prismatic")
_LOWER_UPPER = ("lower", "upper")
_VELOCITY_EFFORT = ("velocity", "effort")


@dataclass(frozen=True, slots=True)
class SecondReading:
    """The comparison with yourdfpy's tree.

    Attributes:
        differences: Differences without a known cause.
        known: Known faults, with joint names.
        unread: Reason why there is no comparison.
    """

    by: str
    joints: int = 0
    differences: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    unread: str | None = None


def compare_with_yourdfpy(
    text: str, tree: KinematicTree, *, mimic: bool = True, root_joint: bool = False
) -> SecondReading:
    """Compare yourdfpy's tree with urdfkin's tree.

    If `root_joint` is True, the tree's first link and first joint are not compared.
    """
    by = f"yourdfpy {installed_version('yourdfpy') or 'not installed'}"
    # A document type declaration can make yourdfpy read other files.
    if "<!DOCTYPE" in text:
        return SecondReading(by, unread="the file has a document type declaration")
    try:
        robot = read_with_yourdfpy(text)
    except Exception as error:  # lxml and yourdfpy raise many kinds of exceptions.
        message = " ".join(str(error).split()) or "no message"
        return SecondReading(
            by, unread=escape_unprintable(f"{type(error).__name__}: {message}")[:_MAX_QUOTE_LENGTH]
        )
    ours = {
        joint.name: (joint.original, tree.links[joint.parent], tree.links[i + 1])
        for i, joint in enumerate(tree.joints)
        if i >= root_joint
    }
    theirs = {joint.name: joint for joint in robot.joints}
    differences = [
        *_compare_names("link", tree.links[int(root_joint) :], [link.name for link in robot.links]),
        *_compare_names("joint", ours, [joint.name for joint in robot.joints]),
    ]
    rules = _read_mimic_rules(theirs, ours) if mimic else {}
    quaternions, faults = _find_quaternion_joints(text), dict[str, list[str]]()
    for name in ours.keys() & theirs.keys():
        for what, fault in _compare_joints(ours[name], theirs[name], rules.get(name), mimic=mimic):
            if what == "rotation" and name in quaternions:
                faults.setdefault("ignores quat_xyzw", []).append(name)
            elif fault:
                faults.setdefault(fault, []).append(name)
            else:
                differences.append(f"joint {name}: {what}")
    known = [f"{fault}: {', '.join(_shorten(sorted(names)))}" for fault, names in sorted(faults.items())]
    return SecondReading(by, len(ours), tuple(_shorten(sorted(differences))), tuple(known))


def read_with_yourdfpy(text: str) -> yourdf.Robot:
    """Read a URDF text without meshes. yourdfpy may raise any exception."""
    import yourdfpy  # yourdfpy imports trimesh, which is slow.

    # The text is encoded as UTF-8, so an XML declaration with another encoding must be removed.
    plain = re.sub(r"\A\s*<\?xml[^>]*\?>", "", text)
    logger = logging.getLogger("yourdfpy.urdf")
    before, logger.disabled = logger.disabled, True
    try:
        model = yourdfpy.URDF.load(io.BytesIO(plain.encode()), build_scene_graph=False, load_meshes=False)
    finally:
        logger.disabled = before
    return model.robot


def _compare_joints(
    ours: tuple[Joint, str, str], theirs: yourdf.Joint, rule: Mimic | None, *, mimic: bool
) -> Iterator[tuple[str, str]]:
    """Yield pairs (difference, known fault). The fault is "" if the difference is not a known fault."""
    joint, parent, child = ours
    if theirs.type != joint.kind.value:
        yield f"type {theirs.type}, not {joint.kind.value}", ""
    if (theirs.parent, theirs.child) != (parent, child):
        yield f"from {theirs.parent} to {theirs.child}, not from {parent} to {child}", ""
    T = np.eye(4) if theirs.origin is None else np.asarray(theirs.origin, dtype=np.float64)
    if not (T[:3, 3] == joint.T_parent_joint[:3, 3]).all():
        yield f"origin at {T[:3, 3].tolist()}, not {joint.T_parent_joint[:3, 3].tolist()}", ""
    if not (np.abs(T - joint.T_parent_joint)[:3, :3] <= _ROTATION_TOLERANCE).all():
        yield "rotation", ""
    if joint.kind.has_axis:
        length = math.hypot(*theirs.axis)
        if not (np.abs(theirs.axis / length - joint.axis) <= _AXIS_TOLERANCE).all():
            yield f"axis {theirs.axis.tolist()}, not {joint.axis.tolist()}", ""
        elif abs(length - 1.0) > _UNIT_TOLERANCE:
            yield "axis", "does not normalise an axis"
    if joint.kind is not JointKind.FIXED:
        limit = joint.limit and {x: getattr(joint.limit, x) for x in (*_LOWER_UPPER, *_VELOCITY_EFFORT)}
        if (their_limit := _read_limit(theirs)) != limit:
            yield f"limit {their_limit}, not {limit}", ""
    if mimic and rule != joint.mimic:
        yield f"mimic rule {rule}, not {joint.mimic}", ""


def _read_limit(joint: yourdf.Joint) -> dict[str, float] | None:
    """Return yourdfpy's limit, with urdfkin's default values for missing numbers."""
    if joint.limit is None:
        return None
    bounded = joint.type in _BOUNDED_KINDS
    bounds = {x: (getattr(joint.limit, x) or 0.0) if bounded else None for x in _LOWER_UPPER}
    others = {x: getattr(joint.limit, x) for x in _VELOCITY_EFFORT}
    unlimited = {"lower": -math.inf, "upper": math.inf, "velocity": math.inf, "effort": math.inf}
    return {x: unlimited[x] if value is None else value for x, value in {**bounds, **others}.items()}


def _read_mimic_rules(theirs: Mapping[str, yourdf.Joint], ours: Mapping[str, object]) -> dict[str, Mimic]:
    return resolve_rules(
        {
            name: Mimic(joint.mimic.joint, joint.mimic.multiplier, joint.mimic.offset)
            for name, joint in theirs.items()
            if joint.mimic is not None and joint.type != "fixed" and name in ours
        }
    )


def _find_quaternion_joints(text: str) -> set[str]:
    if "quat_xyzw" not in text:
        return set()
    return {
        joint.get("name", "")
        for joint in parse_xml(text).iterfind("joint")
        if (origin := joint.find("origin")) is not None and origin.get("quat_xyzw") is not None
    }


def _compare_names(what: str, ours: Iterable[str], theirs: Iterable[str]) -> Iterator[str]:
    their_counts, our_counts = Counter(iter(theirs)), Counter(iter(ours))
    for name in their_counts.keys() | our_counts.keys():
        if their_counts[name] != our_counts[name]:
            yield f"{what} {name}: yourdfpy finds {their_counts[name]}, urdfkin finds {our_counts[name]}"


def _shorten(differences: list[str]) -> list[str]:
    more = len(differences) - _MAX_DIFFERENCES
    return differences if more <= 0 else [*differences[:_MAX_DIFFERENCES], f"{more} more"]
