"""Integrate joint velocities, and compute the velocities that lead from one configuration to another.

For a configuration q with orientations, q + v is meaningless. Use `integrate` and `difference` instead of +
and -. The two functions agree with Pinocchio's functions of the same names. For a joint with one coordinate,
`integrate` adds and `difference` subtracts. For a continuous joint, `difference` also removes full turns,
unless a full turn moves a mimic joint. The joint velocity (w, s) of a planar or floating joint is constant in
the moving frame. Therefore, the joint makes a screw motion from the pose (R_0, p_0):

    R = R_0 exp(w)
    p = p_0 + R_0 V(w) s
    V(w) = I + (1 - cos|w|)/|w|^2 [w] + (|w| - sin|w|)/|w|^3 [w]^2

The product of the matrix [w] and a vector is the cross product of w and the vector.
"""

from __future__ import annotations

import math

import numpy as np

from urdfkin.kinematics.inputs import check_range, common_batch_shape
from urdfkin.kinematics.rotation import (
    exp_rotation,
    log_rotation,
    quaternion_of,
    rotation_from_quaternion,
    skew,
)
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

#: Largest squared angle (rad^2) for which a series replaces (|w| - sin|w|)/|w|^3, to avoid cancellation.
_SERIES_SQUARED_ANGLE = 0.25


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def integrate(tree: KinematicTree, q: FloatArray, v: FloatArray) -> FloatArray:
    """Return the configuration after one second at constant velocities."""
    shape = common_batch_shape((q.shape[:-1], v.shape[:-1]))
    out = np.array(np.broadcast_to(q, (*shape, tree.nq)))
    for joint, q_index, v_index in _coordinate_joints(tree):
        step = v[..., v_index : v_index + joint.nv]
        if joint.nq == 1:
            out[..., q_index] += step[..., 0]
            continue
        block = out[..., q_index : q_index + joint.nq]
        p, R = _pose(joint, block)
        s, w = _split_block(joint, step)
        p = p + (R @ (_V(w) @ s[..., np.newaxis]))[..., 0]
        if joint.kind is JointKind.PLANAR:
            block[...] = np.concatenate((p[..., :2], block[..., 2:] + w[..., 2:]), axis=-1)
        else:
            block[...] = np.concatenate((p, quaternion_of(check_range(R @ exp_rotation(w)))), axis=-1)
    return check_range(out)


@np.errstate(over="ignore", invalid="ignore")
def difference(tree: KinematicTree, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the velocities that lead to `end` in one second.

    Continuous, planar and floating joints rotate by at most half a turn. A continuous joint makes the full
    rotation if a full turn of this joint moves a mimic joint to another pose.
    """
    shape = common_batch_shape((start.shape[:-1], end.shape[:-1]))
    start, end = (np.broadcast_to(q, (*shape, tree.nq)) for q in (start, end))
    v = np.empty((*shape, tree.nv))
    for joint, q_index, v_index in _coordinate_joints(tree):
        q_0, q_1 = (q[..., q_index : q_index + joint.nq] for q in (start, end))
        if joint.nq == 1:
            change = q_1[..., 0] - q_0[..., 0]
            can_wrap = joint.kind is JointKind.CONTINUOUS and _full_turn_keeps_pose(tree, joint)
            v[..., v_index] = _shortest(change) if can_wrap else change
            continue
        (p_0, R_0), (p_1, R_1) = _pose(joint, q_0), _pose(joint, q_1)
        R_0_inverse = np.swapaxes(R_0, -1, -2)
        w = log_rotation(R_0_inverse @ R_1)
        if joint.kind is JointKind.PLANAR:
            w = np.zeros((*shape, 3))
            w[..., 2] = _shortest(q_1[..., 2] - q_0[..., 2])
        s = np.linalg.solve(_V(w), R_0_inverse @ (p_1 - p_0)[..., np.newaxis])[..., 0]
        parts = (s[..., :2], w[..., 2:]) if joint.kind is JointKind.PLANAR else (s, w)
        v[..., v_index : v_index + joint.nv] = np.concatenate(parts, axis=-1)
    return check_range(v)


def _coordinate_joints(tree: KinematicTree) -> list[tuple[Joint, int, int]]:
    rows = zip(tree.joints, tree.q_index, tree.v_index, strict=True)
    return [(joint, q_index, v_index) for joint, q_index, v_index in rows if joint.nv]


def _full_turn_keeps_pose(tree: KinematicTree, joint: Joint) -> bool:
    """Return whether the joint's mimic joints have the same pose after a full turn of the joint."""
    rules = [(other.kind, other.mimic) for other in tree.joints if other.mimic]
    return all(
        rule.multiplier.is_integer() if kind.turns else rule.multiplier == 0.0
        for kind, rule in rules
        if rule.mimicked_joint == joint.name
    )


def _pose(joint: Joint, block: FloatArray) -> tuple[FloatArray, FloatArray]:
    p, orientation = _split_block(joint, block)
    make_rotation = rotation_from_quaternion if joint.kind is JointKind.FLOATING else exp_rotation
    return p, check_range(make_rotation(orientation))


def _split_block(joint: Joint, block: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split the joint's numbers of q or v into a linear and an angular part."""
    if joint.kind is JointKind.FLOATING:
        return block[..., :3], block[..., 3:]
    if joint.kind is not JointKind.PLANAR:
        raise NotImplementedError(f"the motion of a {joint.kind} joint")
    linear, angular = np.zeros((2, *block.shape[:-1], 3))
    linear[..., :2], angular[..., 2] = block[..., :2], block[..., 2]
    return linear, angular


def _V(w: FloatArray) -> FloatArray:
    square = (w * w).sum(axis=-1)[..., np.newaxis, np.newaxis]
    angle, W = np.sqrt(square), skew(w)
    half = np.sinc(angle / math.tau)
    series = sum((-square) ** k / math.factorial(2 * k + 3) for k in range(7))
    coefficient = np.where(
        square < _SERIES_SQUARED_ANGLE,
        series,
        (1.0 - np.sinc(angle / math.pi)) / np.where(square > 0.0, square, 1.0),
    )
    V: FloatArray = np.eye(3) + 0.5 * half**2 * W + coefficient * (W @ W)
    return V


def _shortest(angle: FloatArray) -> FloatArray:
    return np.asarray(angle - math.tau * np.round(angle / math.tau))
