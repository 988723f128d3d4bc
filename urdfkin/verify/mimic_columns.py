"""Kernel that adds the columns of mimic joints to those of the mimicked joints, in one pass.

NumPy expressions would read all Jacobians from memory once for each column. On robots with mimic joints this
took longer than Pinocchio's computation of the Jacobians.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from urdfkin.compiled.compiling import NUMBERS, PLACES, ROWS, SCRATCH, kernel
from urdfkin.model.tree import FloatArray

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
    out = np.zeros(len(rows) * nv)
    _coupling(rows, columns, index, factor, out)
    return out.reshape(*full.shape[:-1], nv)


@kernel(ROWS, PLACES, PLACES, NUMBERS, SCRATCH)
def _coupling(full, columns, index, factor, out):
    nv = len(out) // max(1, len(full))
    for i in range(len(full)):
        for column in columns:
            out[i * nv + index[column]] += full[i, column] * factor[column]
    return 0


def load_kernel() -> None:
    """Compile the kernel or read it from disk, before its first use."""
    _ = _coupling.compiled
