"""What a URDF says to `KinematicTree`, through yourdfpy; the only module that imports it.

yourdfpy is given the links and joints alone (`urdfkin.urdf.skeleton`): shapes, colours, odd encodings, loose
ends that its parser would repair, and quaternions that it does not know never reach it. What the URDF
specification says beyond it is done here: axes are normalised, chains of mimic joints are resolved, joints
are put in Pinocchio's order. Meshes are never opened.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.errors import InputError, UnknownNameError, UrdfkinError
from urdfkin.model.tree import (
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
    with_root_joint,
)
from urdfkin.urdf.records import RobotRecord
from urdfkin.urdf.skeleton import skeleton
from urdfkin.urdf.writer import to_urdf

if TYPE_CHECKING:
    from yourdfpy import urdf as yourdf


def read_tree(urdf: RobotRecord, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """The kinematic tree of a URDF.

    Args:
        urdf: What was read of the text, found free of errors by `urdfkin.lint`.
        mimic: Whether mimic joints follow their leaders (the URDF's meaning) or move freely.
        root_joint: `"floating"` or `"planar"` hangs the root link from a moving joint `root_joint`.

    Raises:
        InputError: the joints make no tree, a mimic joint cannot follow, or `root_joint` is no such kind.
        UnknownNameError: a mimic joint names a leader that does not exist.
    """
    robot = _parse(urdf)
    rules = _rules(robot.joints) if mimic else {}
    rows = [(_joint(joint, rules.get(joint.name)), joint.parent, joint.child) for joint in robot.joints]
    tree = build_tree(robot.name, _root(robot), rows)
    return tree if root_joint is None else with_root_joint(tree, _root_kind(root_joint))


def urdf_of(robot: yourdf.Robot) -> str:
    """The URDF of a robot that yourdfpy holds; its own writer (0.0.60) leaves mimic rules out.

    Axes are written as they are, so that the checks see their lengths.

    Raises:
        InputError: the joints make no tree, a mimic joint cannot follow, limits that a URDF needs are
            missing, or something stands where a name or a number should.
        UnknownNameError: a mimic joint names a leader that does not exist.
    """
    try:
        rules = _rules(robot.joints)
        rows = [
            (replace(_joint(joint, rules.get(joint.name)), axis=_written(joint)), joint.parent, joint.child)
            for joint in robot.joints
        ]
        return to_urdf(build_tree(robot.name, _root(robot), rows))
    except UrdfkinError:
        raise
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError("yourdfpy's robot cannot be written as a URDF", found=str(error)) from error


def _written(joint: yourdf.Joint) -> FloatArray:
    return np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.array(joint.axis, dtype=np.float64)


def _parse(urdf: RobotRecord) -> yourdf.Robot:
    # Imported on first use: the meshing library under yourdfpy takes half a second.
    from yourdfpy import URDF  # noqa: PLC0415

    text = io.BytesIO(skeleton(urdf))
    return URDF.load(text, build_scene_graph=False, load_meshes=False).robot


def _root(robot: yourdf.Robot) -> str:
    roots = {link.name for link in robot.links} - {joint.child for joint in robot.joints}
    if len(roots) != 1:
        raise InputError(
            "a robot has one root link", where=robot.name, found=", ".join(sorted(roots)) or "none"
        )
    return str(roots.pop())


def _root_kind(word: str) -> JointKind:
    if word not in ("floating", "planar"):
        raise InputError("root_joint is 'floating', 'planar' or None", found=repr(word))
    return JointKind(word)


def _joint(joint: yourdf.Joint, rule: Mimic | None) -> Joint:
    kind = JointKind(joint.type)
    return Joint(
        name=joint.name,
        kind=kind,
        parent=0,
        T_parent_joint=np.eye(4) if joint.origin is None else joint.origin,
        axis=_unit(joint.axis, joint.name) if kind.has_axis else np.array([1.0, 0.0, 0.0]),
        limit=_limit(joint.limit, kind),
        mimic=rule,
    )


def _unit(axis: FloatArray, joint: str) -> FloatArray:
    """The axis divided by its length, as Pinocchio does; an axis that is a unit vector stays as it is."""
    length = math.hypot(*axis)
    if not 0.0 < length < math.inf:
        raise InputError("a joint's axis has no direction", where=f"joint {joint}", found=str(axis.tolist()))
    return axis if length == 1.0 else axis / length


def _limit(limit: Any, kind: JointKind) -> Limit | None:
    if limit is None or kind.nv == 0:
        return None
    bounded = kind in (JointKind.REVOLUTE, JointKind.PRISMATIC)
    # A bound that is not written is zero, as in urdfdom; the specification ignores a continuous joint's.
    return Limit(
        lower=(limit.lower or 0.0) if bounded else -math.inf,
        upper=(limit.upper or 0.0) if bounded else math.inf,
        velocity=math.inf if limit.velocity is None else limit.velocity,
        effort=math.inf if limit.effort is None else limit.effort,
    )


def _rules(joints: Sequence[yourdf.Joint]) -> dict[str, Mimic]:
    """Whom each follower follows in the end: along a chain multipliers multiply and offsets add up.

    A chain is resolved from the joint that moves outwards: so each joint is looked at once, and the doubles
    are those that the oracle has, which resolves them for itself.
    """
    named = {joint.name: joint for joint in joints}
    resolved: dict[str, Mimic] = {}
    for start in joints:
        joint, waiting = start, {}
        while _follows(joint) and joint.name not in resolved:
            waiting[joint.name] = rule = joint.mimic
            if rule.joint not in named:
                raise UnknownNameError(
                    "mimic leader",
                    rule.joint,
                    named,
                    where=f"joint {joint.name} (mimic=False, --no-mimic, lets it move freely)",
                )
            if rule.joint in waiting:
                raise InputError("mimic joints follow each other in a circle", where=f"joint {start.name}")
            joint = named[rule.joint]
        end = resolved.get(joint.name, Mimic(joint.name, 1.0, 0.0))
        for follower, rule in reversed(waiting.items()):
            offset = rule.multiplier * end.offset + rule.offset
            end = resolved[follower] = Mimic(end.leader, rule.multiplier * end.multiplier, offset)
    return resolved


def _follows(joint: yourdf.Joint) -> bool:
    return joint.mimic is not None and JointKind(joint.type) is not JointKind.FIXED
