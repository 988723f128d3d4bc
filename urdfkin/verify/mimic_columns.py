"""Add the columns of mimic joints to those of the mimicked joints.

For large batches a kernel does so in one pass: NumPy reads all Jacobians from memory once for each column,
which takes longer than Pinocchio's own computation on robots with mimic joints. The numbers are equal.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from urdfkin.compiled import preload
from urdfkin.model.tree import FloatArray
from urdfkin.verify.comparison import KERNELS

#: Index in v of each of Pinocchio's joint velocities.
Places = np.ndarray[Any, np.dtype[np.int64]]


def coupled(full: FloatArray, columns: Places, index: Places, factor: FloatArray, nv: int) -> FloatArray:
    """Return J_full G, the columns for the robot's own joint velocities.

    Args:
        full: (..., Pinocchio's nv) columns for all joints.
        columns: Pinocchio's columns to use, in the order of summation.
        index: (Pinocchio's nv,) index in v of each column.
        factor: (Pinocchio's nv,) factor of each column in G.
        nv: Length of v.

    Returns:
        (..., nv).
    """
    rows = np.ascontiguousarray(full).reshape(math.prod(full.shape[:-1]), full.shape[-1])
    if (kernel := preload.kernel("coupling", home=KERNELS)) is None:
        begin = time.thread_time()
        sums = _coupled(rows, columns, index, factor, nv)
        preload.spend("coupling", time.thread_time() - begin)
        return sums.reshape(*full.shape[:-1], nv)
    out = np.zeros(len(rows) * nv)
    kernel(rows, columns, index, factor, out)
    return out.reshape(*full.shape[:-1], nv)


@np.errstate(all="ignore")
def _coupled(rows: FloatArray, columns: Places, index: Places, factor: FloatArray, nv: int) -> FloatArray:
    sums = np.zeros((len(rows), nv))
    for column in columns:
        sums[:, index[column]] += rows[:, column] * factor[column]
    return sums
