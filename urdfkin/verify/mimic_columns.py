"""Add the Jacobian columns of mimic joints to the columns of the mimicked joints.

For large batches, a compiled kernel reads all Jacobians from memory only once; NumPy would read them once for
each column. With NumPy, the addition would take longer than Pinocchio's computation of the Jacobians. The
kernel and NumPy return equal numbers.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from urdfkin.compiled import preload
from urdfkin.model.tree import FloatArray
from urdfkin.verify.comparison import KERNELS

#: An array of indices, for example the index in urdfkin's v for each of Pinocchio's joint velocities.
Places = np.ndarray[Any, np.dtype[np.int64]]


def coupled(full: FloatArray, columns: Places, index: Places, factor: FloatArray, nv: int) -> FloatArray:
    """Return the product J_full G, the Jacobian columns for urdfkin's joint velocities v.

    Args:
        full: (..., Pinocchio's nv) columns for all joints.
        columns: Indices of the columns of J_full to add, in the order of the additions.
        index: (Pinocchio's nv,) index in v for each column of J_full.
        factor: (Pinocchio's nv,) the number in G by which each column of J_full is multiplied.
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
