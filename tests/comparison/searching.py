"""Find the largest distance of a frame by a global search, and compute this distance at fifty digits."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from urdfkin.comparison.result import Interval
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind
from urdfkin.robot import Robot
from urdfkin.verify.exact.numbers import REFERENCE_DIGITS, precision, read_exact_joints
from urdfkin.verify.exact.recursion import compute_motion
from urdfkin.verify.quantities import PLACEMENT


def placed(robot: Robot, q: FloatArray, frame: str) -> list[Any]:
    """Return a frame's position at fifty digits, from the decimals of the text."""
    tree, link = robot.tree, robot.tree.link_index(frame)
    zeros = [0.0] * tree.nv
    motion = compute_motion(tree, read_exact_joints(robot.urdf, tree, tree.path(link)), q, zeros, zeros)
    T = PLACEMENT.enclose(motion, link, Reference.LOCAL_WORLD_ALIGNED)
    return [T[i][3] for i in range(3)]


def far(a: Robot, b: Robot, q_a: FloatArray, q_b: FloatArray, interval: Interval) -> float:
    """Return the distance (m) between a frame's positions in A and B, at fifty digits."""
    with precision(REFERENCE_DIGITS):
        places = placed(a, q_a, interval.frame), placed(b, q_b, interval.frame_b)
        return math.hypot(*(float(x - y) for x, y in zip(*places, strict=True)))


def within(robot: Robot, q: FloatArray) -> NDArray[np.bool_]:
    """Return (n,) whether all joints, also mimic joints, are within their limits."""
    keeps = np.ones(len(q), dtype=bool)
    for joint, at in zip(robot.tree.joints, robot.tree.q_index, strict=True):
        if joint.kind.has_axis and joint.limit is not None and joint.kind is not JointKind.CONTINUOUS:
            rule = joint.mimic
            value = q[:, at] if rule is None else rule.multiplier * q[:, at] + rule.offset
            keeps &= (joint.limit.lower <= value) & (value <= joint.limit.upper)
    return keeps


def searched(a: Robot, b: Robot, at_b: Callable[[FloatArray], FloatArray], interval: Interval) -> float:
    """Return the largest distance (m) of a frame that a global search within the limits finds.

    `at_b` converts configurations of A to B. The distance is computed at fifty digits.
    """
    path = a.tree.path(a.tree.link_index(interval.frame))
    along = (a.tree.joints[i] for i in path)
    independent_joints = {
        joint.mimic.mimicked_joint if joint.mimic else joint.name for joint in along if joint.kind.nv
    }
    joints = [joint for joint in a.tree.joints if joint.name in independent_joints]
    places = [a.tree.q_index[a.tree.joint_index(joint.name)] for joint in joints]
    ends = [
        (j.limit.lower, j.limit.upper) if j.limit and math.isfinite(j.limit.lower) else (-math.pi, math.pi)
        for j in joints
    ]

    def full(x: FloatArray) -> FloatArray:
        q = np.tile(a.neutral(), (x.shape[1], 1))
        q[:, places] = x.T
        return q

    def off(x: FloatArray) -> FloatArray:
        q = full(x)
        T_a = a.placement(q, f"link:{interval.frame}")
        T_b = b.placement(at_b(q), f"link:{interval.frame_b}")
        metres = np.linalg.norm(T_a[:, :3, 3] - T_b[:, :3, 3], axis=-1)
        return -np.where(within(a, q) & within(b, at_b(q)), metres, 0.0)

    if not joints:  # no joint moves the frame
        return far(a, b, a.neutral(), at_b(a.neutral()), interval)
    best = differential_evolution(
        off, ends, seed=3, popsize=20, maxiter=60, vectorized=True, polish=False, updating="deferred"
    )
    q = full(best.x[:, np.newaxis])[0]
    return far(a, b, q, at_b(q), interval)
