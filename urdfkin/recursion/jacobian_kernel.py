"""The compiled walk for velocity Jacobians of frames (7.85)."""

from __future__ import annotations

from numba import types

from urdfkin.recursion.columns import clear_idle, put_column
from urdfkin.recursion.lanes import LANES, copy_rows, cross, lane_function, load, minus, rotate_back, store
from urdfkin.recursion.steps import FRAME, STATE_ROWS, P, R
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


@lane_function
def _remember_column(m, s, at, axis):
    """Keep the axis z_{i-1} and the origin O_{i-1} of a rate: what 7.85 needs."""
    for r in range(3):
        copy_rows(m, s, R + 3 * r + axis, at + r, 1)
    copy_rows(m, s, P, at + 3, 3)


@lane_function
def _jacobian_column(m, s, turns, reference):
    """[z x d_{i-1,n}; z] for a turning rate, [z; 0] for a sliding one (7.85), in the wanted reference."""
    for k in range(m):
        z = load(s, _Z, k)
        lin, ang = z, (0.0, 0.0, 0.0)
        if turns:
            if reference == _WORLD:
                d = minus((0.0, 0.0, 0.0), load(s, _O, k))
            else:
                d = minus(load(s, FRAME + P, k), load(s, _O, k))
            lin, ang = cross(z, d), z
        if reference == _LOCAL:
            lin, ang = rotate_back(s, FRAME + R, lin, k), rotate_back(s, FRAME + R, ang, k)
        store(s, _LINEAR, k, lin)
        store(s, _Z, k, ang)


@lane_function
def _write_jacobian(m, s, b, f, place, reference, first, columns, multipliers, uses, idle, out):
    for c in range(columns.shape[0]):
        if uses[f, c] == 0:
            continue
        copy_rows(m, s, first + 6 * c, _Z, 6)
        _jacobian_column(m, s, columns[c, 2] == 1, reference)
        put_column(
            m, s, b, place, _LINEAR, _Z, columns[c, 3], multipliers[c], uses[f, c] == 2, out
        )  # fmt: skip
    clear_idle(m, b, f, place, idle, out)


@lane_function
def _jacobian_block(
    m, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, out, s
):
    order = 0 * b
    rows = start(m, s, b, base, order)
    first = SLOTS + STATE_ROWS * slots
    f = c = order
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            advance(m, s, b, i, steps, g, q, q, q, order, rows)
            while c < columns.shape[0] and columns[c, 0] == i:
                _remember_column(m, s, first + 6 * c, columns[c, 1])
                c += 1
        while f < frames.shape[0] and frames[f, 0] == i:
            frame_state(m, s, offsets, f, order, rows, reference == _LOCAL)
            _write_jacobian(m, s, b, f, frames[f, 1], reference, first, columns, multipliers, uses, idle, out)
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
    types.Array(types.float64, 4, "C"),
    SCRATCH,
)
def jacobian(reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, out, s):
    """Velocity Jacobians (7.85) of frames.

    Shapes: base (1 or n, 24), q (n, nq), out (n, frames, 6, nv), s (rows * LANES,).
    """
    n = q.shape[0]
    lanes = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    for b in range(0, n, LANES):
        _jacobian_block(
            lanes, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle,
            base, q, out, s,
        )  # fmt: skip
