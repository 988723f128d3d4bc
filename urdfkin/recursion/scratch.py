"""The array that a walk works in: rows of lanes, one array a thread."""

from __future__ import annotations

import numpy as np

from urdfkin.recursion.lanes import LANES
from urdfkin.recursion.plan import Plan
from urdfkin.tree import FloatArray

#: Numbers in a cache line.
_LINE = 8


def scratch(plan: Plan) -> FloatArray:
    """Rows for a plan, at an address where no vector reaches over two cache lines: that halves the speed."""
    count = plan.areas.rows * LANES
    numbers = np.empty(count + _LINE)
    first = -(numbers.ctypes.data // numbers.itemsize) % _LINE
    return numbers[first : first + count]
