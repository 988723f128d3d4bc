"""Rigid transforms as (4, 4) arrays: construction and inverse."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import rotation_defect
from urdfkin.model.tree import FloatArray


def pose(R: ArrayLike | None = None, p: ArrayLike | None = None) -> FloatArray:
    """Return the pose (4, 4) with a rotation (3, 3) and an origin (3,), m.

    By default the rotation is the identity and the origin is zero.

    >>> pose(p=[1.0, 2.0, 3.0])[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if p is not None:
        T[:3, 3] = p
    return T


def is_rigid(T: FloatArray, tolerance: float) -> bool:
    """Return whether a matrix (4, 4) is a rigid transform.

    The upper left block of the matrix must be a rotation matrix within `tolerance`.
    """
    return bool(rotation_defect(T[:3, :3]) <= tolerance) and T[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def inverse(T: FloatArray) -> FloatArray:
    """Return the inverse (4, 4) of a pose."""
    back = T[:3, :3].T
    return pose(back, -back @ T[:3, 3])
