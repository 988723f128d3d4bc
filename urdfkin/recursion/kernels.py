"""The compiled walks: one from the base outwards for placement, velocity and acceleration, one for Jacobians.

Each works through a batch in blocks of `LANES` configurations. A whole block is compiled with the number
of lanes as a constant (that is the fast one), the rest of a batch with it as a variable. Compiled code is
kept on disk; the global interpreter lock is released.
"""

from __future__ import annotations

from typing import Any

import numba

from urdfkin.recursion.lanes import (
    LANES,
    column,
    copy_rows,
    cross,
    lane_function,
    load,
    minus,
    rotate_back,
    store,
)
from urdfkin.recursion.steps import (
    ALPHA,
    FIXED_ROWS,
    FRAME,
    STATE_ROWS,
    A,
    D,
    P,
    R,
    V,
    W,
    carry,
    interorigin,
    step,
    turn_by_constant,
)

kernel: Any = numba.njit(fastmath={"contract"}, error_model="numpy", nogil=True, cache=True)

# After the rows of `steps`: a column of the Jacobian on the way out, then slots of saved state, then the
# axis and origin of each column met so far.
_Z, _O, _LINEAR = FIXED_ROWS, FIXED_ROWS + 3, FIXED_ROWS + 6
_SLOTS = FIXED_ROWS + 9
_RESUME, _SAVE = 1, 2
_LOCAL, _WORLD = 0, 1


def scratch_rows(slots: int, columns: int) -> int:
    """Rows of scratch that a plan needs."""
    return _SLOTS + STATE_ROWS * slots + 6 * columns


@lane_function
def _start(m, s, b, base, order):  # type: ignore[no-untyped-def]
    """The initial conditions: the state of the base (the text's frame -1 to frame 0)."""
    rows = 12 if order == 0 else (18 if order == 1 else 24)
    fixed = base.shape[0] == 1
    for r in range(rows):
        for k in range(m):
            s[r * LANES + k] = base[0 if fixed else b + k, r]
    copy_rows(m, s, 0, _SLOTS, rows)
    return rows


@lane_function
def _frame_state(m, s, offsets, f, order, rows):  # type: ignore[no-untyped-def]
    """The state of a frame that is fixed to the present link."""
    copy_rows(m, s, 0, FRAME, rows)
    turn_by_constant(m, s, FRAME, offsets, f)
    interorigin(m, s, FRAME, offsets, f)
    carry(m, s, FRAME, order)


@lane_function
def _write_motion(m, s, b, place, order, reference, out):  # type: ignore[no-untyped-def]
    """Six numbers [linear; angular], or for order 0 the 4 by 4 pose row by row."""
    if order == 0:
        for k in range(m):
            for row in range(3):
                for c in range(3):
                    out[b + k, place, 4 * row + c] = s[(FRAME + R + 3 * row + c) * LANES + k]
                out[b + k, place, 4 * row + 3] = s[(FRAME + P + row) * LANES + k]
                out[b + k, place, 12 + row] = 0.0
            out[b + k, place, 15] = 1.0
        return
    angular = FRAME + (W if order == 1 else ALPHA)
    linear = FRAME + (V if order == 1 else A)
    for k in range(m):
        lin, ang = load(s, linear, k), load(s, angular, k)
        if reference == _WORLD:
            # The point of the body that is at the world's origin now.
            to_origin = minus((0.0, 0.0, 0.0), load(s, FRAME + P, k))
            shifted = cross(ang, to_origin)
            if order == 2:
                w = load(s, FRAME + W, k)
                inward = cross(w, cross(w, to_origin))
                shifted = (shifted[0] + inward[0], shifted[1] + inward[1], shifted[2] + inward[2])
            lin = (lin[0] + shifted[0], lin[1] + shifted[1], lin[2] + shifted[2])
        elif reference == _LOCAL:
            lin, ang = rotate_back(s, FRAME + R, lin, k), rotate_back(s, FRAME + R, ang, k)
        for row in range(3):
            out[b + k, place, row] = lin[row]
            out[b + k, place, 3 + row] = ang[row]


@lane_function
def _motion_block(m, b, order, reference, steps, g, frames, offsets, base, q, v, a, out, s):  # type: ignore[no-untyped-def]
    rows = _start(m, s, b, base, order)
    f = 0
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            if steps[i, _RESUME] >= 0:
                copy_rows(m, s, _SLOTS + STATE_ROWS * steps[i, _RESUME], 0, rows)
            step(m, s, b, i, steps, g, q, v, a, order)
            if steps[i, _SAVE] >= 0:
                copy_rows(m, s, 0, _SLOTS + STATE_ROWS * steps[i, _SAVE], rows)
        while f < frames.shape[0] and frames[f, 0] == i:
            _frame_state(m, s, offsets, f, order, rows)
            _write_motion(m, s, b, frames[f, 1], order, reference, out)
            f += 1


@kernel
def motion(order, reference, steps, g, frames, offsets, base, q, v, a, out, s):  # type: ignore[no-untyped-def]
    """Placements (order 0), velocities (1) or accelerations (2) of frames.

    Shapes: base (1 or n, 24), q (n, nq), v and a (n, nv), out (n, frames, 16 or 6), s (rows * LANES,).
    """
    n = q.shape[0]
    whole = n - n % LANES
    lanes, one = LANES + 0 * n, 1 + 0 * n
    for b in range(0, whole, LANES):
        _motion_block(lanes, b, order, reference, steps, g, frames, offsets, base, q, v, a, out, s)
    for b in range(whole, n):
        _motion_block(one, b, order, reference, steps, g, frames, offsets, base, q, v, a, out, s)


@lane_function
def _remember_column(m, s, at, axis):  # type: ignore[no-untyped-def]
    """Keep the axis z_{i-1} and the origin O_{i-1} of a rate: what 7.85 needs."""
    for r in range(3):
        for k in range(m):
            s[(at + r) * LANES + k] = s[(R + 3 * r + axis) * LANES + k]
    copy_rows(m, s, P, at + 3, 3)


@lane_function
def _jacobian_column(m, s, turns, reference):  # type: ignore[no-untyped-def]
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
def _write_jacobian(m, s, b, f, place, reference, first, columns, multipliers, uses, idle, out):  # type: ignore[no-untyped-def]
    for c in range(columns.shape[0]):
        if uses[f, c] == 0:
            continue
        copy_rows(m, s, first + 6 * c, _Z, 6)
        _jacobian_column(m, s, columns[c, 2] == 1, reference)
        at, factor, adds = columns[c, 3], multipliers[c], uses[f, c] == 2
        for k in range(m):
            for row in range(3):
                lin = factor * s[(_LINEAR + row) * LANES + k]
                ang = factor * s[(_Z + row) * LANES + k]
                if adds:
                    lin += out[b + k, place, row, at]
                    ang += out[b + k, place, 3 + row, at]
                out[b + k, place, row, at] = lin
                out[b + k, place, 3 + row, at] = ang
    for at in range(idle.shape[1]):
        if idle[f, at]:
            for k in range(m):
                for row in range(6):
                    out[b + k, place, row, at] = 0.0


@lane_function
def _jacobian_block(  # type: ignore[no-untyped-def]
    m, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, out, s
):
    order = 0 * b
    rows = _start(m, s, b, base, order)
    first = _SLOTS + STATE_ROWS * slots
    f, c = 0, 0
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            if steps[i, _RESUME] >= 0:
                copy_rows(m, s, _SLOTS + STATE_ROWS * steps[i, _RESUME], 0, rows)
            step(m, s, b, i, steps, g, q, q, q, order)
            if steps[i, _SAVE] >= 0:
                copy_rows(m, s, 0, _SLOTS + STATE_ROWS * steps[i, _SAVE], rows)
            while c < columns.shape[0] and columns[c, 0] == i:
                _remember_column(m, s, first + 6 * c, columns[c, 1])
                c += 1
        while f < frames.shape[0] and frames[f, 0] == i:
            _frame_state(m, s, offsets, f, order, rows)
            _write_jacobian(
                m, s, b, f, frames[f, 1], reference, first, columns, multipliers, uses, idle, out
            )
            f += 1


@kernel
def jacobian(  # type: ignore[no-untyped-def]
    reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle, base, q, out, s
):
    """Velocity Jacobians (7.85) of frames.

    Shapes: base (1 or n, 24), q (n, nq), out (n, frames, 6, nv), s (rows * LANES,).
    """
    n = q.shape[0]
    whole = n - n % LANES
    lanes, one = LANES + 0 * n, 1 + 0 * n
    for b in range(0, whole, LANES):
        _jacobian_block(
            lanes, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle,
            base, q, out, s,
        )  # fmt: skip
    for b in range(whole, n):
        _jacobian_block(
            one, b, reference, steps, g, slots, frames, offsets, columns, multipliers, uses, idle,
            base, q, out, s,
        )  # fmt: skip
