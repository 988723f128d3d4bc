"""What both walks share: initial conditions, going on from saved state, frames fixed to a link.

Each kernel works through a batch in blocks of `LANES` configurations; what is left over goes one by one,
compiled with a single lane. Compiled code is kept on disk; the global interpreter lock is released.
"""

from __future__ import annotations

from typing import Any

import numba
from numba import types

from urdfkin.recursion.lanes import LANES, copy_rows, lane_function
from urdfkin.recursion.steps import (
    FIXED_ROWS,
    FRAME,
    STATE_ROWS,
    carry,
    interorigin,
    step,
    turn_by_constant,
)

# Inputs may be read-only; a writable array converts without a copy. One signature, compiled once.
WHOLE = types.Array(types.int64, 2, "C", readonly=True)
ROWS = types.Array(types.float64, 2, "C", readonly=True)
ROW = types.Array(types.float64, 1, "C", readonly=True)
SCRATCH = types.Array(types.float64, 1, "C")
INT = types.int64


def kernel(*arguments: Any) -> Any:
    """Decorator: compile for these argument types, keep the result on disk, release the lock."""
    signature = types.void(*arguments)
    return numba.njit([signature], fastmath={"contract"}, error_model="numpy", nogil=True, cache=True)


# After the rows of `steps`: a column of the Jacobian on its way out, then slots of saved state, then the
# axis and origin of each column met so far.
COLUMN = FIXED_ROWS
SLOTS = FIXED_ROWS + 9
_RESUME, _SAVE = 1, 2


def scratch_rows(slots: int, columns: int) -> int:
    """Rows of scratch that a plan needs."""
    return SLOTS + STATE_ROWS * slots + 6 * columns


@lane_function
def start(m, s, b, base, order):
    """The initial conditions: the state of the base (the text's frame -1 to frame 0)."""
    rows = 12 if order == 0 else (18 if order == 1 else 24)
    fixed = base.shape[0] == 1
    for r in range(rows):
        for k in range(m):
            s[r * LANES + k] = base[0 if fixed else b + k, r]
    copy_rows(m, s, 0, SLOTS, rows)
    return rows


@lane_function
def frame_state(m, s, offsets, f, order, rows):
    """The state of a frame that is fixed to the present link."""
    copy_rows(m, s, 0, FRAME, rows)
    turn_by_constant(m, s, FRAME, offsets, f)
    interorigin(m, s, FRAME, offsets, f)
    carry(m, s, FRAME, order)


@lane_function
def advance(m, s, b, i, steps, g, q, v, a, order, rows):
    """Step `i`, going on from saved state and saving its own where the plan says so."""
    if steps[i, _RESUME] >= 0:
        copy_rows(m, s, SLOTS + STATE_ROWS * steps[i, _RESUME], 0, rows)
    step(m, s, b, i, steps, g, q, v, a, order)
    if steps[i, _SAVE] >= 0:
        copy_rows(m, s, 0, SLOTS + STATE_ROWS * steps[i, _SAVE], rows)
