"""Which row of the scratch array holds what: fixed rows first, then those whose number depends on the plan.

A row holds one number for each configuration of a block (`lanes`). The fixed rows have constant numbers: so
the compiler sees that they do not overlap. Rows of the other kind are copied to fixed ones first.
"""

from __future__ import annotations

from typing import NamedTuple

# The state of the present link: rotation, origin, w, velocity, alpha, acceleration. In one piece, so that
# it can be saved and restored.
R, P, W, V, ALPHA, A = 0, 9, 12, 15, 18, 21
STATE_ROWS = 24
# The state of a frame on the way out.
FRAME = 24
# The interorigin vector; a joint's coordinate and its rates; those of a planar or floating joint.
D, ANGLE, SINE, COSINE, RATE, RATE_2 = 48, 51, 52, 53, 54, 55
SLIDE, QUATERNION = 56, 59
SLIDE_RATE, TURN_RATE, SLIDE_RATE_2, TURN_RATE_2 = 63, 66, 69, 72
# The last row of a pose.
ZERO, ONE = 75, 76
# A column of 7.85 on its way out: what was kept of it, the column itself, and a leader's that it is added to.
AXIS, ORIGIN, CARRIER_W, CARRIER_V = 77, 80, 83, 86
KEPT_ROWS = 12
LINEAR, ANGULAR, LEADER = 89, 92, 95
COLUMN_ROWS = 6
FIXED_ROWS = 101


class Areas(NamedTuple):
    """The first row of each area after the fixed rows, and how many rows there are in all.

    Attributes:
        q: A row for each coordinate.
        v: A row for each rate.
        a: A row for each second rate.
        slots: `STATE_ROWS` for each saved state.
        kept: `KEPT_ROWS` for each column of a Jacobian, kept at its joint.
        results: `COLUMN_ROWS` for each column of the frame that is written.
        rows: How many there are.
    """

    q: int
    v: int
    a: int
    slots: int
    kept: int
    results: int
    rows: int


def areas(nq: int, nv: int, slots: int, columns: int) -> Areas:
    """Lay out the rows for a plan of that size."""
    sizes = nq, nv, nv, STATE_ROWS * slots, KEPT_ROWS * columns, COLUMN_ROWS * columns
    edges = [FIXED_ROWS]
    for size in sizes:
        edges.append(edges[-1] + size)
    return Areas(*edges)
