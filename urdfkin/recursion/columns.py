"""Columns of a matrix on their way out: written, added to a leader's, or zero.

Section 7.4.4: column i of 7.85 belongs to joint i. A follower's column is added to its leader's.
"""

from __future__ import annotations

from urdfkin.recursion.lanes import LANES, lane_function


@lane_function
def put_column(m, s, b, place, linear, angular, at, factor, adds, out):
    """Write `factor` times the column in rows `linear` and `angular`, or add it to what is there."""
    for k in range(m):
        for row in range(3):
            lin = factor * s[(linear + row) * LANES + k]
            ang = factor * s[(angular + row) * LANES + k]
            if adds:
                lin += out[b + k, place, row, at]
                ang += out[b + k, place, 3 + row, at]
            out[b + k, place, row, at] = lin
            out[b + k, place, 3 + row, at] = ang


@lane_function
def clear_idle(m, b, f, place, idle, out):
    """Zero the columns of rates that do not move frame `f`."""
    for at in range(idle.shape[1]):
        if idle[f, at]:
            for k in range(m):
                for row in range(6):
                    out[b + k, place, row, at] = 0.0
