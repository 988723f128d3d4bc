"""The compiled walk for the rate of the Jacobian: the J-dot of 7.126, column by column.

Differentiate a column of 7.85. Its axis z and origin O ride on link i, which turns with w and whose origin
moves with vel; the frame's origin moves with vel_n:

    z-dot                       = w x z
    d-dot                       = vel_n - vel          d = O_n - O
    d/dt [z x d; z]  (turning)  = [z-dot x d + z x d-dot; z-dot]
    d/dt [z; 0]      (sliding)  = [z-dot; 0]

In the frame's own axes the column is R^T times this one, and its rate R^T (rate - w_n x column). That is the
rate of the numbers in the matrix, which is what Pinocchio gives too: J a + J-dot v is the acceleration of
the text in LOCAL_WORLD_ALIGNED, and the *spatial* acceleration in the other two references.
"""

from __future__ import annotations

from numba import types

from urdfkin.recursion.columns import clear_idle, put_column
from urdfkin.recursion.lanes import (
    LANES,
    copy_rows,
    cross,
    lane_function,
    load,
    minus,
    plus,
    rotate_back,
    store,
)
from urdfkin.recursion.steps import FRAME, SLIDE, STATE_ROWS, TURN_RATE, P, R, V, W
from urdfkin.recursion.walk import (
    COLUMN,
    INT,
    ROW,
    ROWS,
    SCRATCH,
    SLOTS,
    WHOLE,
    advance,
    frame_state,
    kernel,
    start,
)

_LOCAL, _WORLD = 0, 1
_Z, _O, _LINEAR = COLUMN, COLUMN + 3, COLUMN + 6
# What is kept of each column: axis, origin, and the angular velocity and velocity they ride with.
_KEPT = 12
# On the way out the rows of the joint's own motion are free: angular velocity and velocity, then the result.
_CARRIER_W, _CARRIER_V, _ANGULAR = SLIDE, SLIDE + 3, TURN_RATE


def scratch_rows(slots: int, columns: int) -> int:
    """Rows of scratch that a plan needs."""
    return SLOTS + STATE_ROWS * slots + _KEPT * columns


@lane_function
def _remember_column(m, s, at, axis):
    """Keep z, O, and w and vel of link i; `w_i x z` and `w_{i-1} x z` are the same."""
    for r in range(3):
        copy_rows(m, s, R + 3 * r + axis, at + r, 1)
    copy_rows(m, s, P, at + 3, 3)
    copy_rows(m, s, W, at + 6, 3)
    copy_rows(m, s, V, at + 9, 3)


@lane_function
def _column_rate(m, s, turns, reference):
    """The rate of one column, in the wanted reference."""
    for k in range(m):
        z = load(s, _Z, k)
        z_rate = cross(load(s, _CARRIER_W, k), z)
        lin, lin_rate, ang, ang_rate = z, z_rate, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if turns:
            to, to_rate = load(s, FRAME + P, k), load(s, FRAME + V, k)
            if reference == _WORLD:
                to, to_rate = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            d, d_rate = minus(to, load(s, _O, k)), minus(to_rate, load(s, _CARRIER_V, k))
            lin, lin_rate = cross(z, d), plus(cross(z_rate, d), cross(z, d_rate))
            ang, ang_rate = z, z_rate
        if reference == _LOCAL:
            w = load(s, FRAME + W, k)
            lin_rate = rotate_back(s, FRAME + R, minus(lin_rate, cross(w, lin)), k)
            ang_rate = rotate_back(s, FRAME + R, minus(ang_rate, cross(w, ang)), k)
        store(s, _LINEAR, k, lin_rate)
        store(s, _ANGULAR, k, ang_rate)


@lane_function
def _write_rates(m, s, b, f, place, reference, first, columns, multipliers, uses, idle, out):
    for c in range(columns.shape[0]):
        if uses[f, c] == 0:
            continue
        copy_rows(m, s, first + _KEPT * c, _Z, 6)
        copy_rows(m, s, first + _KEPT * c + 6, _CARRIER_W, 6)
        _column_rate(m, s, columns[c, 2] == 1, reference)
        put_column(m, s, b, place, _LINEAR, _ANGULAR, columns[c, 3], multipliers[c], uses[f, c] == 2, out)
    clear_idle(m, b, f, place, idle, out)


@lane_function
def _rate_block(
    m, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, v, out, s
):
    order = 1 + 0 * b
    rows = start(m, s, b, base, order)
    first = SLOTS + STATE_ROWS * slots
    f = c = 0 * b
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            advance(m, s, b, i, steps, g, q, v, v, order, rows)
            while c < columns.shape[0] and columns[c, 0] == i:
                _remember_column(m, s, first + _KEPT * c, columns[c, 1])
                c += 1
        while f < frames.shape[0] and frames[f, 0] == i:
            frame_state(m, s, offsets, f, order, rows, reference == _LOCAL)
            _write_rates(m, s, b, f, frames[f, 1], reference, first, columns, multipliers, uses, idle, out)
            f += 1


@kernel(
    INT,
    WHOLE,
    ROWS,
    INT,
    WHOLE,
    ROWS,
    WHOLE,
    ROW,
    WHOLE,
    WHOLE,
    ROWS,
    ROWS,
    ROWS,
    types.Array(types.float64, 4, "C"),
    SCRATCH,
)
def jacobian_rate(
    reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, v, out, s
):
    """Rates of the velocity Jacobians (7.126) of frames.

    Shapes: base (1 or n, 24), q (n, nq), v (n, nv), out (n, frames, 6, nv), s (rows * LANES,).
    """
    n = q.shape[0]
    lanes = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    for b in range(0, n, LANES):
        _rate_block(
            lanes, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle,
            base, q, v, out, s,
        )  # fmt: skip
