"""Compute analytical Jacobians (eq. 7.122) from a rotation matrix and a velocity Jacobian, without any angle.

urdfkin compares these Jacobians with the results of `urdfkin.kinematics.rotation` and
`urdfkin.kinematics.bodies`. This module shares no code with the two modules. The functions also accept arrays
of fifty-digit numbers, for the accuracy study.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]


def euler_jacobian(name: str, R: Numbers, J_v: Numbers) -> tuple[Numbers, Numbers]:
    """Return the Jacobian (..., 6, n) of the position and three Euler angles, and |sin b| or |cos b| (...).

    An Euler sequence rotates about the coordinate axes i, j and k, in this order: R = R_i R_j R_k. The first
    rotation axis is e_i, and the third is R e_k. The middle axis is perpendicular to the first and the third
    axis. With n = e_i x R e_k, the middle axis is n / |n| or -n / |n|. The range of the middle angle b
    determines the sign:

    - k = i: b is in [0, pi], the sign is +1, and |n| = |sin b|.
    - k != i: b is in [-pi/2, pi/2], the sign is (e_j x e_i) . e_k, and |n| = |cos b|.

    The reciprocal basis of the three rotation axes has one vector for each angle. The derivative of an angle
    is the dot product of this vector and the angular velocity.

    `name` is SciPy's name of the sequence: capital letters mean body axes, small letters fixed axes. `R`
    (..., 3, 3) is the rotation from body axes to world axes. `J_v` (..., 6, n) is the velocity Jacobian
    [linear; angular] in world axes.
    """
    letters = name.lower()[::-1] if name.islower() else name.lower()
    i, j, k = ("xyz".index(letter) for letter in letters)
    first, third = np.eye(3)[i], R[..., :, k]
    n = np.cross(first, third)
    length = np.sqrt((n * n).sum(axis=-1, keepdims=True))
    sign = 1.0 if k == i else float(np.linalg.det(np.eye(3)[[j, i, k]]))
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = sign * n / length
        volume = -sign * length  # The volume is first . (middle x third).
        reciprocal = [np.cross(middle, third) / volume, middle, np.cross(first, middle) / volume]
    rows = np.stack(reciprocal[::-1] if name.islower() else reciprocal, axis=-2)
    return np.concatenate((J_v[..., :3, :], rows @ J_v[..., 3:, :]), axis=-2), length[..., 0]


def quaternion_jacobian(quat: Numbers, J_v: Numbers) -> Numbers:
    """Return the Jacobian (..., 7, n) of the position and a unit quaternion (..., 4), scalar last.

    The derivative of the quaternion is half the product of the quaternions (w, 0) and `quat`, where w is the
    angular velocity. `J_v` is the velocity Jacobian (..., 6, n), [linear; angular], in world axes.
    """
    w = J_v[..., 3:, :].swapaxes(-1, -2)
    q, q0 = quat[..., np.newaxis, :3], quat[..., np.newaxis, 3:]
    rates = 0.5 * np.concatenate((q0 * w + np.cross(w, q), -(w * q).sum(axis=-1, keepdims=True)), axis=-1)
    return np.concatenate((J_v[..., :3, :], rates.swapaxes(-1, -2)), axis=-2)
