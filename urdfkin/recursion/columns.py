"""Columns of a matrix on their way out: written, added to a leader's, or zero.

Section 7.4.4: column i of 7.85 belongs to joint i. A follower's column is added to its leader's.
"""

from __future__ import annotations

from urdfkin.recursion.lanes import LANES, lane_function, pointer_to


@lane_function
def put_column(m, s, b, place, linear, angular, at, factor, adds, out):
    """Write `factor` times the column in rows `linear` and `angular`, or add it to what is there."""
    frames, nv = out.shape[1], out.shape[3]
    to, here = pointer_to(out), (b * frames + place) * 6 * nv + at
    if adds:
        for k in range(m):
            for row in range(3):
                to[here + row * nv] += factor * s[(linear + row) * LANES + k]
                to[here + (row + 3) * nv] += factor * s[(angular + row) * LANES + k]
            here += frames * 6 * nv
    else:
        # Written out: a loop over the rows would be unrolled too late to become a run of plain stores.
        for k in range(m):
            to[here] = factor * s[linear * LANES + k]
            to[here + nv] = factor * s[(linear + 1) * LANES + k]
            to[here + 2 * nv] = factor * s[(linear + 2) * LANES + k]
            to[here + 3 * nv] = factor * s[angular * LANES + k]
            to[here + 4 * nv] = factor * s[(angular + 1) * LANES + k]
            to[here + 5 * nv] = factor * s[(angular + 2) * LANES + k]
            here += frames * 6 * nv


@lane_function
def clear_idle(m, b, f, place, idle, out):
    """Zero the columns of rates that do not move frame `f`."""
    frames, nv = out.shape[1], out.shape[3]
    to = pointer_to(out)
    for at in range(nv):
        if idle[f, at]:
            here = (b * frames + place) * 6 * nv + at
            for _ in range(m):
                for row in range(6):
                    to[here + row * nv] = 0.0
                here += frames * 6 * nv
