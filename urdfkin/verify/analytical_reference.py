"""Analytical Jacobians from a rotation matrix and a velocity Jacobian, without computing any angle.

This is an independent computation of eq. 7.122, for the check. It shares no code with
`urdfkin.kinematics.rotation` and `urdfkin.kinematics.bodies`.

An Euler sequence rotates about i, then j, then k, so that R = R_i R_j R_k. The first axis is e_i and the
third is R e_k. The middle axis, the line of nodes, is perpendicular to both of these axes. It is +- n / |n|
with n = e_i x R e_k. The range of the middle angle b determines the sign:

- k = i: b is in [0, pi], the sign is +1, and |n| = |sin b|.
- k != i: b is in [-pi/2, pi/2], the sign is (e_j x e_i) . e_k, and |n| = |cos b|.

The angle derivatives are the products of w with the reciprocal basis of the three axes. The functions also
accept arrays of fifty-digit numbers, which the accuracy study uses.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Floats, or the fifty-digit numbers of the accuracy study.
Numbers = NDArray[Any]


def euler_jacobian(name: str, R: Numbers, J_v: Numbers) -> tuple[Numbers, Numbers]:
    """Return the derivatives of position and three Euler angles, and the distance from the singularity.

    Args:
        name: Sequence by SciPy's name. Capital letters are body axes, small letters fixed axes.
        R: (..., 3, 3) rotation from body axes to world axes.
        J_v: (..., 6, n) velocity Jacobian, [linear; angular], in world axes.

    Returns:
        (..., 6, n) and (...) |sin b| or |cos b| of the middle angle.
    """
    letters = name.lower()[::-1] if name.islower() else name.lower()
    i, j, k = ("xyz".index(letter) for letter in letters)
    first, third = np.eye(3)[i], R[..., :, k]
    across = np.cross(first, third)
    apart = np.sqrt((across * across).sum(axis=-1, keepdims=True))
    sense = 1.0 if k == i else float(np.linalg.det(np.eye(3)[[j, i, k]]))
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = sense * across / apart
        volume = -sense * apart  # first . (middle x third)
        reciprocal = [np.cross(middle, third) / volume, middle, np.cross(first, middle) / volume]
    rows = np.stack(reciprocal[::-1] if name.islower() else reciprocal, axis=-2)
    return np.concatenate((J_v[..., :3, :], rows @ J_v[..., 3:, :]), axis=-2), apart[..., 0]


def quaternion_jacobian(quat: Numbers, J_v: Numbers) -> Numbers:
    """Return the derivatives of position and unit quaternion.

    The derivative of the quaternion is half of the quaternion product (w, 0) times `quat`.

    Args:
        quat: (..., 4) unit quaternion, scalar last.
        J_v: (..., 6, n) as in `euler_jacobian`.

    Returns:
        (..., 7, n).
    """
    w = J_v[..., 3:, :].swapaxes(-1, -2)
    q, q0 = quat[..., np.newaxis, :3], quat[..., np.newaxis, 3:]
    rates = 0.5 * np.concatenate((q0 * w + np.cross(w, q), -(w * q).sum(axis=-1, keepdims=True)), axis=-1)
    return np.concatenate((J_v[..., :3, :], rates.swapaxes(-1, -2)), axis=-2)
