"""The compiled walk for velocity Jacobians of frames (7.85)."""

from __future__ import annotations

from urdfkin.recursion.columns import AXIS_OF, STEP, TURNS, put_column, write_matrix
from urdfkin.recursion.compiling import BOUND, INT, NUMBERS, PLAN, ROWS, SCRATCH, kernel, output
from urdfkin.recursion.lanes import (
    LANES,
    apart,
    copy_rows,
    cross,
    lane_function,
    load,
    minus,
    pointer_to,
    rotate_back,
    store,
)
from urdfkin.recursion.plan import COLUMN_WIDTH
from urdfkin.recursion.rows import ANGULAR, AXIS, FRAME, KEPT_ROWS, LINEAR, ORIGIN, P, R
from urdfkin.recursion.steps import step
from urdfkin.recursion.transposing import fetch_output
from urdfkin.recursion.walk import (
    REFERENCE,
    counted,
    frame_state,
    ordinary,
    read_input,
    resume,
    rows_of,
    save,
    scratch_of,
    start,
    still_base,
    stride_of,
    walk_of,
)

_LOCAL, _WORLD = 0, 1


@lane_function
def _keep_column(m, s, at, axis):
    """Keep the axis z_{i-1} and the origin O_{i-1} of a rate: what 7.85 needs."""
    for r in range(3):
        copy_rows(m, s, R + 3 * r + axis, at + r, 1)
    copy_rows(m, s, P, at + 3, 3)


@lane_function
def _jacobian_column(m, s, turns, reference):
    """[z x d_{i-1,n}; z] for a turning rate, [z; 0] for a sliding one (7.85), in the wanted reference."""
    for k in range(m):
        z = load(s, AXIS, k)
        lin, ang = z, (0.0, 0.0, 0.0)
        if turns:
            if reference == _WORLD:
                d = minus((0.0, 0.0, 0.0), load(s, ORIGIN, k))
            else:
                d = minus(load(s, FRAME + P, k), load(s, ORIGIN, k))
            lin, ang = cross(z, d), z
        if reference == _LOCAL:
            lin, ang = rotate_back(s, FRAME + R, lin, k), rotate_back(s, FRAME + R, ang, k)
        store(s, LINEAR, k, lin)
        store(s, ANGULAR, k, ang)


@lane_function
def _frame_jacobian(m, s, plan, f, b, reference, to):
    for c in range(plan.column_count):
        if plan.leaders[f * plan.column_count + c] >= 0:
            copy_rows(m, s, plan.kept + KEPT_ROWS * c, AXIS, 6)
            _jacobian_column(m, s, plan.columns[COLUMN_WIDTH * c + TURNS] == 1, reference)
            put_column(m, s, plan, f, c)
    write_matrix(m, s, plan, f, b, to)


@lane_function
def _jacobian_block(m, s, plan, b, reference, base, stride, q, to):
    order = 0 * b
    read_input(m, s, q, b, plan.nq, plan.blocks_q, plan.block_count_q, plan.q)
    start(m, s, plan, b, base, stride, order)
    rows = rows_of(order)
    f = c = order
    size = plan.frame_count * 6 * plan.nv
    for i in range(-1, plan.step_count):
        if i >= 0:
            fetch_output(m, i, plan.step_count, to, b * size, m * size)
            resume(m, s, plan, i, rows)
            step(m, s, plan, i, order)
            save(m, s, plan, i, rows)
            while c < plan.column_count and plan.columns[COLUMN_WIDTH * c + STEP] == i:
                _keep_column(m, s, plan.kept + KEPT_ROWS * c, plan.columns[COLUMN_WIDTH * c + AXIS_OF])
                c += 1
        while f < plan.frame_count and plan.frames[2 * f] == i:
            frame_state(m, s, plan, f, order, reference == _LOCAL)
            _frame_jacobian(m, s, plan, f, b, reference, to)
            f += 1
    return int(ordinary(q, b * plan.nq, m * plan.nq))


@kernel(INT, PLAN, ROWS, ROWS, output(4), SCRATCH)
def jacobians(reference, packed, base, q, out, scratch):
    """Velocity Jacobians (7.85) of frames: 1, or 0 where a coordinate is not ordinary.

    Shapes: base (1 or n, 24), q (n, nq), out (n, frames, 6, nv), scratch (rows * LANES,).
    """
    n, plan, good = q.shape[0], walk_of(packed), 1
    m = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    s, state, x, to, stride = (
        pointer_to(scratch),
        pointer_to(base),
        pointer_to(q),
        pointer_to(out),
        stride_of(base),
    )
    for first in range(0, n, LANES):
        b = min(first, n - LANES)  # the last block reaches back into the one before
        good &= _jacobian_block(m, s, plan, b, reference, state, stride, x, to)
    return good


@kernel(BOUND, NUMBERS, output(2), nogil=False)
def jacobian(packed, q, out):
    """The velocity Jacobian (7.85) of one frame in one configuration; -1 for other arrays.

    Shapes: q (nq,), out (6, nv), memory of its own.
    """
    plan = walk_of(packed)
    if q.shape[0] != plan.nq or out.shape[0] != 6 or out.shape[1] != plan.nv or not apart(q, out):
        return -1
    one, s, x, to = 1 + 0 * plan.nq, scratch_of(packed), pointer_to(q), pointer_to(out)
    good = _jacobian_block(one, s, plan, 0 * one, packed[REFERENCE], still_base(), 0 * one, x, to)
    return counted(packed, 3, good)
