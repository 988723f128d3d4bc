"""Rigid motions along and between screws: what a joint does, and what makes one axis another."""

from __future__ import annotations

import math

import numpy as np

from urdfkin.kinematics.rotation.aligning import axis_aligning
from urdfkin.kinematics.rotation.axis_angle import exp_rotation, rotation_about
from urdfkin.model.mechanisms.mechanism import Screw
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray

#: What lies across an axis by less, a unit vector or metres, lies along it, and has no direction there.
ALONG = 1e-12


def along(screw: Screw, value: float, *, turns: bool) -> FloatArray:
    """(4, 4) exp(S t): a turn about a screw by radians, or a slide along it by metres."""
    if not turns:
        return pose(p=screw.direction * value)
    R = rotation_about(screw.direction, value)
    return pose(R, screw.point - R @ screw.point)


def between(start: Screw, end: Screw, *, turns: bool) -> tuple[FloatArray, float, float]:
    """The least motion that makes one joint's axis another's, its tilt (rad) and its way (m).

    The axis is tilted about the first joint's origin and moved across itself: what is left, a turn about the
    axis and a way along it, is a joint's zero or nobody's business. A slide's axis has no place.
    """
    R, tilt = shortest_turn(start.direction, end.direction)
    across = np.zeros(3)
    if turns:
        way = end.point - start.point
        across = way - end.direction * (end.direction @ way)
    return pose(R, start.point - R @ start.point + across), tilt, float(np.linalg.norm(across))


def shortest_turn(u: FloatArray, v: FloatArray) -> tuple[FloatArray, float]:
    """The rotation by the least angle that turns one unit vector to another, and the angle."""
    cross = np.cross(u, v)
    sine, cosine = float(np.linalg.norm(cross)), float(u @ v)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:  # opposite: about any axis across
        axis = np.zeros(3) if cosine > 0.0 else axis_aligning(u)[:, 0] * math.pi
        return exp_rotation(axis), angle
    return exp_rotation(cross * (angle / sine)), angle


def apart(T: FloatArray, other: FloatArray) -> tuple[float, float]:
    """By what angle (rad) and way (m) two poses differ."""
    R = (other[:3, :3] @ T[:3, :3].T).tolist()  # a walk asks this thousands of times: plain numbers
    sine = math.hypot(R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    angle = math.atan2(sine, R[0][0] + R[1][1] + R[2][2] - 1.0)
    return angle, math.dist(other[:3, 3].tolist(), T[:3, 3].tolist())


def turn_about(u: FloatArray, R: FloatArray) -> float:
    """The angle about an axis that comes nearest to a rotation."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(u @ vector), float(np.trace(R) - u @ R @ u))


def angle_from_to(u: FloatArray, x: FloatArray, y: FloatArray) -> float | None:
    """The angle about u from x to y, seen along u; None where one of them is along u."""
    x, y = x - u * (u @ x), y - u * (u @ y)
    if min(np.linalg.norm(x), np.linalg.norm(y)) < ALONG:
        return None
    return math.atan2(float(u @ np.cross(x, y)), float(x @ y))
