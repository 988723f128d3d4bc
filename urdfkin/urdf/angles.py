"""Roll, pitch and yaw of a rotation, to the last digits even where pitch is a quarter turn.

URDF's convention: R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

Angles = tuple[float, float, float]


def rpy_from_matrix(R: ArrayLike) -> Angles:
    """Angles that give back the rotation to rounding, wherever it lies.

    Near a pitch of +-pi/2 roll and yaw are each ill-defined, but together they are not: roll is read off
    first, and pitch and yaw are read off R Rx(-roll), where they stand without small divisors.

    Args:
        R: (3, 3) rotation.

    Returns:
        (roll, pitch, yaw) in rad; pitch lies within [-pi/2, pi/2].

    >>> rpy_from_matrix([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (0.0, 0.0, 1.5707963267948966)
    """
    (_, r01, r02), (_, r11, r12), (r20, r21, r22) = np.asarray(R, dtype=np.float64).tolist()
    roll = math.atan2(r21, r22)
    sine, cosine = math.sin(roll), math.cos(roll)
    pitch = math.atan2(-r20, sine * r21 + cosine * r22)
    yaw = math.atan2(sine * r02 - cosine * r01, cosine * r11 - sine * r12)
    return roll, pitch, yaw


def rpy_from_quaternion(quaternion: Sequence[float]) -> Angles:
    """Angles of a quaternion (x, y, z, w) of any length, as URDF 1.1 writes it.

    >>> rpy_from_quaternion((0.0, 0.0, 2.0, 2.0))
    (0.0, 0.0, 1.5707963267948966)
    """
    scale = max(map(abs, quaternion))
    x, y, z, w = (value / scale for value in quaternion)
    length = math.hypot(x, y, z, w)
    x, y, z, w = x / length, y / length, z / length, w / length
    return rpy_from_matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
