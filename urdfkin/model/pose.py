"""Rigid transforms as (4, 4) arrays: made of their parts, and turned round."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.model.tree import FloatArray


def pose(R: ArrayLike | None = None, p: ArrayLike | None = None) -> FloatArray:
    """(4, 4) a rotation (3, 3) and an origin (3,), metres; what is not given stays as it is.

    >>> pose(p=[1.0, 2.0, 3.0])[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if p is not None:
        T[:3, 3] = p
    return T


def inverse(T: FloatArray) -> FloatArray:
    """(4, 4) the pose of the outer frame in the inner one."""
    back = T[:3, :3].T
    return pose(back, -back @ T[:3, 3])
