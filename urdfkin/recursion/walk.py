"""What both walks share: initial conditions, going on from saved state, frames fixed to a link.

Each kernel works through a batch in whole blocks of `LANES` configurations; `batch` cuts and fills them.

`0 * b` is 0 to the compiler but not a literal to Numba, which would compile what it is handed to once more.
"""

from __future__ import annotations

from urdfkin.recursion.compiling import INT, ROW, ROWS, SCRATCH, WHOLE, kernel
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

__all__ = [
    "COLUMN", "INT", "ROW", "ROWS", "SCRATCH", "SLOTS", "WHOLE",
    "advance", "frame_state", "kernel", "scratch_rows", "start",
]  # fmt: skip

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
def frame_state(m, s, offsets, f, order, rows, turned):
    """The state of a frame that is fixed to the present link; its rotation only where it is `turned`."""
    copy_rows(m, s, 0, FRAME, rows)
    interorigin(m, s, offsets, f)
    carry(m, s, FRAME, order)
    if turned:
        turn_by_constant(m, s, FRAME, offsets, f)


@lane_function
def advance(m, s, b, i, steps, g, q, v, a, order, rows):
    """Step `i`, going on from saved state and saving its own where the plan says so."""
    if steps[i, _RESUME] >= 0:
        copy_rows(m, s, SLOTS + STATE_ROWS * steps[i, _RESUME], 0, rows)
    step(m, s, b, i, steps, g, q, v, a, order)
    if steps[i, _SAVE] >= 0:
        copy_rows(m, s, 0, SLOTS + STATE_ROWS * steps[i, _SAVE], rows)
