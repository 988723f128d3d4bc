"""Compute analytical Jacobians (eq. 7.122) from a rotation matrix and a velocity Jacobian.

urdfkin compares these Jacobians with the results of `urdfkin.kinematics.rotation` and
`urdfkin.kinematics.bodies`. This module shares no code with `rotation` or `bodies`. The functions also accept
arrays of fifty-digit numbers, for the accuracy study.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

AnyArray = NDArray[Any]


def euler_jacobian(axes: str, R: AnyArray, J_v: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Return the Jacobian of position and Euler angles.

    R = R_i R_j R_k is a product of three rotations about coordinate axes. The rotation axes in the world are:

        first axis = e_i
        third axis = R e_k
        n = e_i x R e_k
        middle axis = sign n / |n|, perpendicular to both
        k = i:  middle angle b in [0, pi],  sign +1,  |n| = |sin b|
        k != i:  middle angle b in [-pi/2, pi/2],  sign (e_j x e_i) . e_k,  |n| = |cos b|
        derivative of an angle = (reciprocal basis vector of its axis) . (angular velocity)

    Args:
        axes: Axes as in SciPy, for example "ZYX" for body axes or "xyz" for fixed axes.
        R: (..., 3, 3) rotation from body axes to world axes.
        J_v: (..., 6, n) velocity Jacobian [linear; angular] in world axes.

    Returns:
        The Jacobian (..., 6, n), and |sin b| or |cos b| (...).
    """
    letters = axes.lower()[::-1] if axes.islower() else axes.lower()
    i, j, k = ("xyz".index(letter) for letter in letters)
    first, third = np.eye(3)[i], R[..., :, k]
    n = np.cross(first, third)
    length = np.sqrt((n * n).sum(axis=-1, keepdims=True))
    sign = 1.0 if k == i else float(np.linalg.det(np.eye(3)[[j, i, k]]))
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = sign * n / length
        volume = -sign * length  # The volume is first . (middle x third).
        reciprocal = [np.cross(middle, third) / volume, middle, np.cross(first, middle) / volume]
    rows = np.stack(reciprocal[::-1] if axes.islower() else reciprocal, axis=-2)
    return np.concatenate((J_v[..., :3, :], rows @ J_v[..., 3:, :]), axis=-2), length[..., 0]


def quaternion_jacobian(quat: AnyArray, J_v: AnyArray) -> AnyArray:
    """Return the Jacobian of position and quaternion.

    With the angular velocity w, the derivative of `quat` is half a quaternion product:

        quat' = (w, 0) quat / 2

    Args:
        quat: (..., 4) unit quaternions, scalar last.
        J_v: (..., 6, n) velocity Jacobian [linear; angular] in world axes.

    Returns:
        The Jacobian (..., 7, n).
    """
    w = J_v[..., 3:, :].swapaxes(-1, -2)
    q, q0 = quat[..., np.newaxis, :3], quat[..., np.newaxis, 3:]
    rates = 0.5 * np.concatenate((q0 * w + np.cross(w, q), -(w * q).sum(axis=-1, keepdims=True)), axis=-1)
    return np.concatenate((J_v[..., :3, :], rates.swapaxes(-1, -2)), axis=-2)
