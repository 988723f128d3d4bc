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

from urdfkin.recursion.columns import AXIS_OF, STEP, TURNS, put_column, write_matrix
from urdfkin.recursion.compiling import INT, PLAN, ROWS, SCRATCH, kernel, output
from urdfkin.recursion.lanes import (
    LANES,
    copy_rows,
    cross,
    lane_function,
    load,
    minus,
    plus,
    pointer_to,
    rotate_back,
    store,
)
from urdfkin.recursion.plan import COLUMN_WIDTH
from urdfkin.recursion.rows import (
    ANGULAR,
    AXIS,
    CARRIER_V,
    CARRIER_W,
    FRAME,
    KEPT_ROWS,
    LINEAR,
    ORIGIN,
    P,
    R,
    V,
    W,
)
from urdfkin.recursion.steps import step
from urdfkin.recursion.transposing import fetch_output
from urdfkin.recursion.walk import (
    frame_state,
    ordinary,
    read_inputs,
    resume,
    rows_of,
    save,
    start,
    stride_of,
    walk_of,
)

_LOCAL, _WORLD = 0, 1


@lane_function
def _keep_column(m, s, at, axis):
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
        z = load(s, AXIS, k)
        z_rate = cross(load(s, CARRIER_W, k), z)
        lin, lin_rate, ang, ang_rate = z, z_rate, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if turns:
            to, to_rate = load(s, FRAME + P, k), load(s, FRAME + V, k)
            if reference == _WORLD:
                to, to_rate = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            d, d_rate = minus(to, load(s, ORIGIN, k)), minus(to_rate, load(s, CARRIER_V, k))
            lin, lin_rate = cross(z, d), plus(cross(z_rate, d), cross(z, d_rate))
            ang, ang_rate = z, z_rate
        if reference == _LOCAL:
            w = load(s, FRAME + W, k)
            lin_rate = rotate_back(s, FRAME + R, minus(lin_rate, cross(w, lin)), k)
            ang_rate = rotate_back(s, FRAME + R, minus(ang_rate, cross(w, ang)), k)
        store(s, LINEAR, k, lin_rate)
        store(s, ANGULAR, k, ang_rate)


@lane_function
def _frame_rates(m, s, plan, f, b, reference, to):
    for c in range(plan.column_count):
        if plan.leaders[f * plan.column_count + c] >= 0:
            copy_rows(m, s, plan.kept + KEPT_ROWS * c, AXIS, KEPT_ROWS)
            _column_rate(m, s, plan.columns[COLUMN_WIDTH * c + TURNS] == 1, reference)
            put_column(m, s, plan, f, c)
    write_matrix(m, s, plan, f, b, to)


@lane_function
def _rate_block(m, s, plan, b, reference, base, stride, q, v, to):
    order = 1 + 0 * b
    read_inputs(m, s, plan, b, q, v, v, order)
    start(m, s, plan, b, base, stride, order)
    rows = rows_of(order)
    f = c = 0 * b
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
            _frame_rates(m, s, plan, f, b, reference, to)
            f += 1
    return int(ordinary(q, b * plan.nq, m * plan.nq) and ordinary(v, b * plan.nv, m * plan.nv))


@kernel(INT, PLAN, ROWS, ROWS, ROWS, output(4), SCRATCH)
def jacobian_rates(reference, packed, base, q, v, out, scratch):
    """Rates of the velocity Jacobians (7.126) of frames: 1, or 0 for an input that is not ordinary.

    Shapes: base (1 or n, 24), q (n, nq), v (n, nv), out (n, frames, 6, nv), scratch (rows * LANES,).
    """
    n, plan, good = q.shape[0], walk_of(packed), 1
    m = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    s, state, stride = pointer_to(scratch), pointer_to(base), stride_of(base)
    x, y, to = pointer_to(q), pointer_to(v), pointer_to(out)
    for first in range(0, n, LANES):
        b = min(first, n - LANES)  # the last block reaches back into the one before
        good &= _rate_block(m, s, plan, b, reference, state, stride, x, y, to)
    return good
