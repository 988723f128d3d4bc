"""Build a `KinematicTree` from the records of a URDF."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import coordinate_rotation, rotation_from_quaternion, rpy_of
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
from urdfkin.urdf.records import JointRecord, LimitRecord, MimicRecord, RobotRecord
from urdfkin.urdf.sources import check_root_joint


def read_tree(urdf: RobotRecord, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """Return the kinematic tree of a URDF in which `urdfkin.urdf.lint` found no errors.

    If `mimic` is False, mimic joints move independently. `root_joint` is "floating", "planar" or None;
    another value raises InputError.
    """
    name = urdf.element.attributes.get("name", "")
    tree = build_tree(
        name, find_root_link(name, urdf.links, urdf.joints), make_joint_rows(urdf.joints, mimic=mimic)
    )
    check_root_joint(root_joint)
    return tree if root_joint is None else with_root_joint(tree, JointKind(root_joint))


def make_joint_rows(joints: Sequence[JointRecord], *, mimic: bool = True) -> list[tuple[Joint, str, str]]:
    """Return each joint with the names of its parent link and child link.

    Raise InputError if mimic joints form a cycle, or if an axis has no direction. Raise UnknownNameError if a
    mimicked joint does not exist.
    """
    rules = _mimic_rules(joints) if mimic else {}
    return [(_make_joint(one, rules.get(one.name)), str(one.parent), str(one.child)) for one in joints]


def find_root_link(name: str, links: Iterable[str], joints: Sequence[JointRecord]) -> str:
    """Return the link without a parent; raise InputError unless there is exactly one."""
    roots = set(links) - {joint.child for joint in joints}
    if len(roots) != 1:
        found = ", ".join(sorted(roots)) or "none"
        raise InputError("a robot must have one root link", where=name, found=found)
    return roots.pop()


def _make_joint(joint: JointRecord, rule: Mimic | None) -> Joint:
    kind = JointKind(joint.kind)
    quaternion = joint.quaternion
    roll, pitch, yaw = np.array(joint.rpy) if quaternion is None else rpy_of_quaternion(quaternion)
    # `rotation_from_rpy` is not called, because it would check the numbers again.
    T = np.eye(4)
    T[:3, :3] = coordinate_rotation(2, yaw) @ coordinate_rotation(1, pitch) @ coordinate_rotation(0, roll)
    T[:3, 3] = joint.xyz
    return Joint(
        name=joint.name,
        kind=kind,
        parent=0,
        T_parent_joint=T,
        axis=_normalize(np.array(joint.axis), joint.name) if kind.has_axis else np.array([1.0, 0.0, 0.0]),
        limit=_make_limit(joint.limit, kind),
        mimic=rule,
    )


def rpy_of_quaternion(quaternion: Sequence[float]) -> FloatArray:
    """Return roll, pitch and yaw (rad) of a quaternion (x, y, z, w) of any length except 0."""
    scaled = np.asarray(quaternion) / np.abs(quaternion).max()
    return rpy_of(rotation_from_quaternion(scaled / np.linalg.norm(scaled)))


def _normalize(axis: FloatArray, joint: str) -> FloatArray:
    """Divide an axis by its length, as Pinocchio does."""
    length = math.hypot(*axis)
    if not 0.0 < length < math.inf:
        raise InputError("a joint's axis has no direction", where=f"joint {joint}", found=str(axis.tolist()))
    return axis if length == 1.0 else axis / length


def _make_limit(limit: LimitRecord | None, kind: JointKind) -> Limit | None:
    if limit is None or kind.nv == 0:
        return None
    # In urdfdom, the default of a position limit is zero. In the URDF specification, position limits of a
    # continuous joint have no effect.
    return Limit(
        lower=(limit.lower or 0.0) if kind.has_limits else -math.inf,
        upper=(limit.upper or 0.0) if kind.has_limits else math.inf,
        velocity=math.inf if limit.velocity is None else limit.velocity,
        effort=math.inf if limit.effort is None else limit.effort,
    )


def _mimic_rules(joints: Sequence[JointRecord]) -> dict[str, Mimic]:
    """Return a rule for each mimic joint, by joint name. The mimicked joint of each rule is independent.

    urdfkin and Pinocchio combine the rules of a chain in the same order, beginning with the independent
    joint. Therefore, the rounding errors are equal.
    """
    names = dict.fromkeys(joint.name for joint in joints)
    rules = {joint.name: joint.mimic for joint in joints if joint.mimic and joint.kind != "fixed"}
    resolved: dict[str, Mimic] = {}
    for start in rules:
        name, pending = start, dict[str, MimicRecord]()
        while name in rules and name not in resolved:
            rule = pending[name] = rules[name]
            if rule.mimicked_joint not in names:
                where = f"joint {name} (mimic=False, --no-mimic, lets the joint move freely)"
                raise UnknownNameError("mimicked joint", str(rule.mimicked_joint), names, where=where)
            if rule.mimicked_joint in pending:
                raise InputError("mimic joints follow each other in a cycle", where=f"joint {start}")
            name = rule.mimicked_joint
        end = resolved.get(name, Mimic(name, 1.0, 0.0))
        for name, rule in reversed(pending.items()):
            offset = rule.multiplier * end.offset + rule.offset
            end = resolved[name] = Mimic(end.mimicked_joint, rule.multiplier * end.multiplier, offset)
    return resolved
