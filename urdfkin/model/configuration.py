"""Configurations: what `q` holds for each joint, and how it reads in Pinocchio's layout.

One number for each revolute, continuous and prismatic joint; planar (x, y, angle); floating (x, y, z, qx,
qy, qz, qw). Pinocchio differs for continuous (cos, sin) and planar (x, y, cos, sin), and its default model
gives followers a coordinate of their own.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, NotFiniteError
from urdfkin.kinematics.inputs import floats
from urdfkin.kinematics.rotation.quaternion import NORM_TOLERANCE, unit_quaternions
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: How far (rad or m) a follower's coordinate, or a (cos, sin) pair's norm, may be off in `from_pinocchio`.
_FOLLOWS_TO = 1e-9


def coordinate_names(tree: KinematicTree) -> tuple[str, ...]:
    """A name for each number of `q`: the joint's, with a suffix where a joint has several."""
    suffixes = {
        JointKind.PLANAR: (".x", ".y", ".angle"),
        JointKind.FLOATING: (".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"),
    }
    return tuple(
        joint.name + suffix for joint in tree.joints if joint.nq for suffix in suffixes.get(joint.kind, ("",))
    )


def rate_names(tree: KinematicTree) -> tuple[str, ...]:
    """A name for each number of `v` and `a`; several where a joint has several, in the moving frame."""
    suffixes = {
        JointKind.PLANAR: (".vx", ".vy", ".wz"),
        JointKind.FLOATING: (".vx", ".vy", ".vz", ".wx", ".wy", ".wz"),
    }
    return tuple(
        joint.name + suffix for joint in tree.joints if joint.nv for suffix in suffixes.get(joint.kind, ("",))
    )


def neutral(tree: KinematicTree) -> FloatArray:
    """(nq,) zeros, and the identity quaternion for floating joints."""
    q = np.zeros(tree.nq)
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.kind is JointKind.FLOATING:
            q[at + 6] = 1.0
    return q


def with_unit_quaternions(tree: KinematicTree, q: FloatArray) -> FloatArray:
    """`q` with the quaternions of floating joints brought to norm 1 (a copy if there are any).

    Raises:
        InputError: a quaternion whose norm is further than 1e-6 from 1.
    """
    if not tree.floating_joints:
        return q
    q = q.copy()
    for i in tree.floating_joints:
        quaternion = q[..., tree.q_index[i] + 3 : tree.q_index[i] + 7]
        quaternion[...] = unit_quaternions(quaternion, f"the quaternion of joint {tree.joints[i].name}")
    return q


def shaped(tree: KinematicTree, value: ArrayLike, what: str) -> FloatArray:
    """q, v or a as float64 with the right last axis, quaternions of norm 1; raises InputError."""
    array, width = floats(value, what), tree.nq if what == "q" else tree.nv
    if array.shape[-1:] != (width,):
        names = ", ".join(_names(tree, what)) or "none, nothing moves"
        raise InputError(
            f"{what} needs {width} numbers for {tree.name}: {names}", found=f"shape {array.shape}"
        )
    return with_unit_quaternions(tree, array) if what == "q" else array


def checked(tree: KinematicTree, value: ArrayLike, what: str) -> FloatArray:
    """The same, and every number finite; raises NotFiniteError too."""
    array = shaped(tree, value, what)
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0]
        raise NotFiniteError(
            f"{what} must be finite", where=_names(tree, what)[where[-1]], found=str(array[tuple(where)])
        )
    return array


def _names(tree: KinematicTree, what: str) -> tuple[str, ...]:
    return coordinate_names(tree) if what == "q" else rate_names(tree)


def limit_violations(tree: KinematicTree, q: FloatArray) -> list[str]:
    """One line for each joint that leaves its bounds somewhere in a batch (..., nq); followers too."""
    lines = []
    for joint, values in zip(tree.joints, _own_values(tree, q), strict=True):
        if values is None or joint.limit is None or not values.size:
            continue
        # A bound printed in decimal is rounded: one unit in the last place is no violation.
        lower, upper = np.nextafter(joint.limit.lower, -np.inf), np.nextafter(joint.limit.upper, np.inf)
        outside = np.maximum(lower - values, values - upper)
        if outside.max() > 0.0:
            worst = float(values.flat[outside.argmax()])
            bounds = f"[{joint.limit.lower:.6g}, {joint.limit.upper:.6g}]"
            lines.append(f"joint {joint.name}: {worst:.6g} is outside {bounds}")
    return lines


def _own_values(tree: KinematicTree, q: FloatArray) -> Iterator[FloatArray | None]:
    """The coordinate of each joint with a single one, None for the others."""
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if not joint.kind.has_axis:
            yield None
        elif joint.mimic:
            yield joint.mimic.multiplier * q[..., at] + joint.mimic.offset
        else:
            yield q[..., at]


# -- Pinocchio's layout ------------------------------------------------------------------------------


def pinocchio_coordinates(joint: Joint, own: FloatArray) -> FloatArray:
    """(..., k) Pinocchio's coordinates of one joint, from urdfkin's (..., joint.kind.nq)."""
    if joint.kind is JointKind.CONTINUOUS:
        return np.concatenate((np.cos(own), np.sin(own)), axis=-1)
    if joint.kind is JointKind.PLANAR:
        return np.concatenate((own[..., :2], np.cos(own[..., 2:]), np.sin(own[..., 2:])), axis=-1)
    return own


def pinocchio_blocks(tree: KinematicTree, q: FloatArray, *, mimic: bool) -> Iterator[tuple[int, FloatArray]]:
    """For each joint that takes coordinates in Pinocchio's model: its index and they, in order.

    Args:
        tree: The robot.
        q: (..., nq).
        mimic: False for Pinocchio's default model, in which followers have coordinates too; True for one
            built with `mimic=True`.
    """
    for i, (joint, at) in enumerate(zip(tree.joints, tree.q_index, strict=True)):
        if joint.kind.nq == 0 or (mimic and joint.mimic):
            continue
        own = q[..., at : at + joint.kind.nq]
        if joint.mimic:
            own = joint.mimic.multiplier * own + joint.mimic.offset
        yield i, pinocchio_coordinates(joint, own)


def to_pinocchio(tree: KinematicTree, q: FloatArray, *, mimic: bool = False) -> FloatArray:
    """(..., nq_pinocchio) for (..., nq)."""
    blocks = [block for _, block in pinocchio_blocks(tree, q, mimic=mimic)]
    return np.concatenate(blocks, axis=-1) if blocks else np.zeros((*q.shape[:-1], 0))


def from_pinocchio(tree: KinematicTree, q: FloatArray, *, mimic: bool = False) -> FloatArray:
    """(..., nq) for (..., nq_pinocchio); angles of continuous and planar joints come back in (-pi, pi].

    Raises:
        InputError: wrong length, a (cos, sin) pair that is no unit vector, or a follower that does not
            follow its leader.
    """
    sizes = {JointKind.CONTINUOUS: 2, JointKind.PLANAR: 4}
    present = [i for i, joint in enumerate(tree.joints) if joint.kind.nq and not (mimic and joint.mimic)]
    length = sum(sizes.get(tree.joints[i].kind, tree.joints[i].kind.nq) for i in present)
    if q.shape[-1:] != (length,):
        raise InputError(
            "a Pinocchio configuration has the wrong length",
            where=tree.name,
            found=f"{q.shape}, expected (..., {length})",
        )
    own, followers, at = np.zeros((*q.shape[:-1], tree.nq)), [], 0
    for i in present:
        joint = tree.joints[i]
        size = sizes.get(joint.kind, joint.kind.nq)
        values = _angle_back(joint, q[..., at : at + size])
        at += size
        if joint.mimic:
            followers.append((joint, tree.q_index[i], values))
        else:
            own[..., tree.q_index[i] : tree.q_index[i] + joint.kind.nq] = values
    for joint, leader_at, values in followers:
        _check_follows(joint, own[..., leader_at], values[..., 0])
    return own


def _angle_back(joint: Joint, values: FloatArray) -> FloatArray:
    if joint.kind not in (JointKind.CONTINUOUS, JointKind.PLANAR):
        return values
    cosine, sine = values[..., -2], values[..., -1]
    norm = np.hypot(cosine, sine)
    if (np.abs(norm - 1.0) > NORM_TOLERANCE).any():
        raise InputError(
            "(cos, sin) must have norm 1", where=f"joint {joint.name}", found=f"{norm.max():.9g}"
        )
    return np.concatenate((values[..., :-2], np.arctan2(sine, cosine)[..., None]), axis=-1)


def _check_follows(joint: Joint, leader: FloatArray, values: FloatArray) -> None:
    rule = joint.mimic
    if rule is None or not values.size:
        return
    off = rule.multiplier * leader + rule.offset - values
    if joint.kind is JointKind.CONTINUOUS:
        off = np.arctan2(np.sin(off), np.cos(off))
    if np.abs(off).max() > _FOLLOWS_TO * max(1.0, float(np.abs(values).max())):
        raise InputError(
            f"a follower must be {rule.multiplier:g} * {rule.leader} + {rule.offset:g}",
            where=f"joint {joint.name}",
            found=f"it is off by {np.abs(off).max():.3g}",
            remedy="load with mimic=False to move it freely",
        )
