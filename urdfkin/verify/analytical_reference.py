"""Rates of an orientation's numbers from a rotation matrix and angular velocities, without any angle.

The second opinion on 7.122, for the check: nothing here is shared with `urdfkin.kinematics.rotation` or
`urdfkin.kinematics.bodies`. A sequence turns about i, then j, then k; in R = R_i R_j R_k the first axis is
e_i, the third R e_k, and the middle one, the line of nodes, is perpendicular to both. Which of its two senses
counts is said by the range of the middle angle b: [0, pi] where k is i again, [-pi/2, pi/2] where it is not.
With n = e_i x R e_k, the middle axis is n / |n| in the first case, and in the second that times e_j x e_i .
e_k;
|n| is |sin b|, or |cos b|. The rates are products of w with the reciprocal basis of the three axes. The judge
puts arrays of fifty digits into the same lines.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Floats, or numbers of the judge's.
Numbers = NDArray[Any]


def euler_jacobian(name: str, R: Numbers, J_v: Numbers) -> tuple[Numbers, Numbers]:
    """Rates of position and of three angles, and how far the representation is from its singularity.

    Args:
        name: Sequence, SciPy's name: capitals turn with the body, small letters stay fixed.
        R: (..., 3, 3) rotation.
        J_v: (..., 6, n) [linear; angular], in the axes that R turns to.

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
    """Rates of position and of a unit quaternion: half the product of (w, 0) and the quaternion.

    Args:
        quat: (..., 4) scalar last.
        J_v: (..., 6, n) as for `euler_jacobian`.

    Returns:
        (..., 7, n).
    """
    w = J_v[..., 3:, :].swapaxes(-1, -2)
    q, q0 = quat[..., np.newaxis, :3], quat[..., np.newaxis, 3:]
    rates = 0.5 * np.concatenate((q0 * w + np.cross(w, q), -(w * q).sum(axis=-1, keepdims=True)), axis=-1)
    return np.concatenate((J_v[..., :3, :], rates.swapaxes(-1, -2)), axis=-2)
