"""Columns of a matrix on their way out: kept, added to a leader's, written.

Section 7.4.4: column i of 7.85 belongs to joint i. A follower's column is added to its leader's.
"""

from __future__ import annotations

from urdfkin.recursion.lanes import LANES, copy_rows, lane_function
from urdfkin.recursion.plan import Column
from urdfkin.recursion.rows import COLUMN_ROWS, LEADER, LINEAR
from urdfkin.recursion.transposing import write_rows

STEP, AXIS_OF, TURNS = int(Column.STEP), int(Column.AXIS), int(Column.TURNS)


@lane_function
def put_column(m, s, plan, f, c):
    """Column `c` of frame `f`, times its multiplier, to where its leader's is put together."""
    leader = plan.leaders[f * plan.column_count + c]
    multiplier, at = plan.multipliers[c], plan.results + COLUMN_ROWS * leader
    if multiplier != 1.0:
        for row in range(COLUMN_ROWS):
            for k in range(m):
                s[(LINEAR + row) * LANES + k] *= multiplier
    if leader != c:
        copy_rows(m, s, at, LEADER, COLUMN_ROWS)
        for row in range(COLUMN_ROWS):
            for k in range(m):
                s[(LINEAR + row) * LANES + k] += s[(LEADER + row) * LANES + k]
    copy_rows(m, s, LINEAR, at, COLUMN_ROWS)


@lane_function
def write_matrix(m, s, plan, f, b, to):
    """The whole matrix of frame `f`: its columns, and zeros for the rates that do not move it."""
    frames, size = plan.frame_count, 6 * plan.nv
    at, rows = (b * frames + plan.frames[2 * f + 1]) * size, plan.sources
    write_rows(m, s, rows, f * size, size, to, at, frames * size)
