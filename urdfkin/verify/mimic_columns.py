"""Columns of followers added to their leaders', in one pass over the numbers.

Column by column, as array expressions do it, each pass fetches the whole Jacobians anew: on robots with
mimic joints that took longer than all of Pinocchio's own work.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from urdfkin.compiled.compiling import NUMBERS, PLACES, ROWS, SCRATCH, kernel
from urdfkin.model.tree import FloatArray

#: For each of Pinocchio's rates, which of v it is.
Places = np.ndarray[Any, np.dtype[np.int64]]


def coupled(full: FloatArray, columns: Places, index: Places, factor: FloatArray, nv: int) -> FloatArray:
    """J_full G.

    Args:
        full: (..., Pinocchio's nv) numbers.
        columns: Which of Pinocchio's columns count, in the order in which they are added up.
        index: (Pinocchio's nv) which of the robot's rates each is.
        factor: (Pinocchio's nv) its factor in G.
        nv: How many rates the robot has.

    Returns:
        (..., nv) numbers.
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
    """Have it compiled, or read from disk, before it is needed."""
    _ = _coupling.compiled
