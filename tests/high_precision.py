"""Velocities and accelerations from independent formulas: differences of positions at 60 digits.

The step is 1e-18. The differences of smooth functions are correct to more than 20 digits; a double has 16.
"""

from collections.abc import Callable, Sequence
from typing import Any
from unittest.mock import patch

import mpmath
import numpy as np

from urdfkin.kinematics.inputs import FloatArray
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.recursion import LinkState
from urdfkin.robot import Robot
from urdfkin.verify.exact import numbers
from urdfkin.verify.exact.recursion import ExactMotion, compute_motion

#: Number of digits of all computations with `mp`.
mp = mpmath.mp.clone()
mp.dps = 60
mp.mpf.sin_cos = lambda angle: (mp.sin(angle), mp.cos(angle))  # as in an interval of Arb

Matrix = Any
_STEP = mp.mpf(10) ** -18


def array(matrix: Matrix) -> FloatArray:
    """Return the nearest doubles of an mpmath matrix; a column becomes a vector."""
    values = np.array([[float(matrix[i, j]) for j in range(matrix.cols)] for i in range(matrix.rows)])
    return values[:, 0] if matrix.cols == 1 else values


def rate(function: Callable[[Any], Matrix], t: float) -> Matrix:
    """Return the first derivative at t."""
    t = mp.mpf(t)
    return (function(t + _STEP) - function(t - _STEP)) / (2 * _STEP)


def second_rate(function: Callable[[Any], Matrix], t: float) -> Matrix:
    """Return the second derivative at t."""
    t = mp.mpf(t)
    return (function(t + _STEP) - 2 * function(t) + function(t - _STEP)) / _STEP**2


def column(*entries: Any) -> Matrix:
    """Return a column of mpmath numbers."""
    return mp.matrix([[entry] for entry in entries])


def cross_matrix(w: Matrix) -> Matrix:
    """Return the matrix S(w) of the cross product with w."""
    return mp.matrix([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def unskewed(S: Matrix) -> Matrix:
    """Return the vector w of the matrix S(w)."""
    return column(S[2, 1], S[0, 2], S[1, 0])


def turn(axis: str, angle: Any) -> Matrix:
    """Return the rotation Rx, Ry or Rz."""
    return about(column(*(1 if letter == axis else 0 for letter in "xyz")), angle)


def about(axis: Matrix, angle: Any) -> Matrix:
    """Return I + sin(angle) S + (1 - cos(angle)) S^2, with S = S(k) and the unit vector k along `axis`."""
    S = cross_matrix(axis / mp.norm(axis))
    return mp.eye(3) + mp.sin(angle) * S + (1 - mp.cos(angle)) * S * S


def angular_velocity(R: Callable[[Any], Matrix], t: float) -> Matrix:
    """Return the angular velocity w from S(w) = R-dot R^T."""
    return unskewed(rate(R, t) * R(mp.mpf(t)).T)


def angular_acceleration(R: Callable[[Any], Matrix], t: float) -> Matrix:
    """Return the angular acceleration from S(alpha) = R-dot-dot R^T + R-dot R-dot^T."""
    first = rate(R, t)
    return unskewed(second_rate(R, t) * R(mp.mpf(t)).T + first * first.T)


# -- the true motion of a robot, without Arb ------------------------------------------------------------


def true_motion(robot: Robot, x: Sequence[FloatArray], base: BaseMotion | None = None) -> ExactMotion:
    """Return the motion of one sample by `urdfkin.verify.exact`, with mpmath's numbers for intervals."""
    with patch.object(numbers, "arb", mp.mpf):
        joints, on = (
            numbers.read_exact_joints(robot.urdf, robot.tree),
            None if base is None else root_state(base),
        )
        return compute_motion(robot.tree, joints, *x, base=on)


def root_state(base: BaseMotion) -> LinkState:
    """Return the state of the root link; its rotation is the orthogonal factor of `base.placement`."""
    T, six, six_2 = base.placement, base.velocity, base.acceleration
    first, second, third = map(tuple, orthogonal_factor(T[:3, :3]).tolist())
    vectors: Any = (T[:3, 3], six[3:], six[:3], six_2[3:], six_2[:3])
    return LinkState((first, second, third), *(tuple(map(mp.mpf, vector)) for vector in vectors))


def orthogonal_factor(M: FloatArray) -> Matrix:
    """Return the orthogonal factor U of M = U H by Higham's iteration, (X + X^-T) / 2."""
    X = mp.matrix(M.tolist())
    for _ in range(12):
        X = (X + (X**-1).T) / 2
    return X
