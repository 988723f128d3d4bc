"""The compiled walk for placements, velocities and accelerations of frames (7.77, 7.127 to 7.130)."""

from __future__ import annotations

import numpy as np

from urdfkin.recursion.compiling import BOUND, INT, NUMBERS, PLAN, ROWS, SCRATCH, kernel, output
from urdfkin.recursion.lanes import (
    LANES,
    apart,
    cross,
    lane_function,
    load,
    minus,
    plus,
    pointer_to,
    rotate_back,
    store,
)
from urdfkin.recursion.rows import ALPHA, FRAME, ONE, ZERO, A, P, R, V, W
from urdfkin.recursion.steps import step
from urdfkin.recursion.transposing import write_rows
from urdfkin.recursion.walk import (
    REFERENCE,
    counted,
    frame_state,
    ordinary,
    read_inputs,
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

#: The rows that hold the 4 by 4 pose, row by row, and those of [linear; angular] for velocity, acceleration.
_POSE = np.array(
    [FRAME + row for i in range(3) for row in (R + 3 * i, R + 3 * i + 1, R + 3 * i + 2, P + i)]
    + [ZERO, ZERO, ZERO, ONE]
)
_SIX = np.array([[FRAME + first + i for first in pair for i in range(3)] for pair in ((V, W), (A, ALPHA))])


@lane_function
def _refer(m, s, order, reference):
    """[linear; angular] of the frame in the wanted reference."""
    linear, angular = FRAME + (V if order == 1 else A), FRAME + (W if order == 1 else ALPHA)
    for k in range(m):
        lin, ang = load(s, linear, k), load(s, angular, k)
        if reference == _WORLD:
            # The point of the body that is at the world's origin now.
            to_origin = minus((0.0, 0.0, 0.0), load(s, FRAME + P, k))
            shifted = cross(ang, to_origin)
            if order == 2:
                w = load(s, FRAME + W, k)
                inward = cross(w, cross(w, to_origin))
                shifted = plus(shifted, inward)
            store(s, linear, k, plus(lin, shifted))
        elif reference == _LOCAL:
            store(s, linear, k, rotate_back(s, FRAME + R, lin, k))
            store(s, angular, k, rotate_back(s, FRAME + R, ang, k))


@lane_function
def write_motion(m, s, plan, f, b, order, to):
    """The 4 by 4 pose of a frame (order 0), or its [linear; angular] velocity (1) or acceleration (2)."""
    frames = plan.frame_count
    at = b * frames + plan.frames[2 * f + 1]
    if order == 0:
        write_rows(m, s, pointer_to(_POSE), 0, 16, to, at * 16, frames * 16)
    else:
        write_rows(m, s, pointer_to(_SIX), 6 * (order - 1), 6, to, at * 6, frames * 6)


@lane_function
def inputs_ordinary(m, plan, b, order, q, v, a):
    """Whether all coordinates and rates are that motion of this order takes: see `walk.ordinary`."""
    good = ordinary(q, b * plan.nq, m * plan.nq)
    if order >= 1:
        good &= ordinary(v, b * plan.nv, m * plan.nv)
    if order >= 2:
        good &= ordinary(a, b * plan.nv, m * plan.nv)
    return int(good)


@lane_function
def shapes_fit(plan, order, q, v, a, out):
    """Whether arrays for one configuration are as long as they must be, and the output lies apart."""
    good = q.shape[0] == plan.nq and v.shape[0] == plan.nv and out.shape[0] == 6
    good = good and apart(q, out) and apart(v, out)
    return good and (order < 2 or (a.shape[0] == plan.nv and apart(a, out)))


@lane_function
def _motion_block(m, s, plan, b, order, reference, base, stride, q, v, a, to):
    read_inputs(m, s, plan, b, q, v, a, order)
    start(m, s, plan, b, base, stride, order)
    rows = rows_of(order)
    f = 0 * b
    for i in range(-1, plan.step_count):
        if i >= 0:
            resume(m, s, plan, i, rows)
            step(m, s, plan, i, order)
            save(m, s, plan, i, rows)
        while f < plan.frame_count and plan.frames[2 * f] == i:
            frame_state(m, s, plan, f, order, order == 0 or reference == _LOCAL)
            if order > 0:
                _refer(m, s, order, reference)
            write_motion(m, s, plan, f, b, order, to)
            f += 1
    return inputs_ordinary(m, plan, b, order, q, v, a)


@kernel(INT, INT, PLAN, ROWS, ROWS, ROWS, ROWS, output(3), SCRATCH)
def motions(order, reference, packed, base, q, v, a, out, scratch):
    """Placements (order 0), velocities (1) or accelerations (2) of frames: 1, or 0 for an input not ordinary.

    Shapes: base (1 or n, 24), q (n, nq), v and a (n, nv), out (n, frames, 16 or 6), scratch (rows * LANES,).
    """
    n, plan, good = q.shape[0], walk_of(packed), 1
    m = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    s, state, stride = pointer_to(scratch), pointer_to(base), stride_of(base)
    x, y, z, to = pointer_to(q), pointer_to(v), pointer_to(a), pointer_to(out)
    for first in range(0, n, LANES):
        b = min(first, n - LANES)  # the last block reaches back into the one before
        good &= _motion_block(m, s, plan, b, order, reference, state, stride, x, y, z, to)
    return good


@kernel(BOUND, NUMBERS, output(2), nogil=False)
def placement(packed, q, out):
    """The placement of one frame in one configuration; -1 for other arrays.

    Shapes: q (nq,), out (4, 4), memory of its own.
    """
    plan = walk_of(packed)
    if q.shape[0] != plan.nq or out.shape[0] != 4 or out.shape[1] != 4 or not apart(q, out):
        return -1
    one, order = 1 + 0 * plan.nq, 0 * plan.nq
    s, x, to = scratch_of(packed), pointer_to(q), pointer_to(out)
    good = _motion_block(one, s, plan, order, order, order, still_base(), order, x, x, x, to)
    return counted(packed, 0, good)


@kernel(INT, BOUND, NUMBERS, NUMBERS, NUMBERS, output(1), nogil=False)
def motion(order, packed, q, v, a, out):
    """The velocity (order 1) or acceleration (2) of one frame in one configuration; -1 for other arrays.

    Shapes: q (nq,), v and a (nv,), out (6,), memory of its own.
    """
    plan = walk_of(packed)
    if not shapes_fit(plan, order, q, v, a, out):
        return -1
    one, reference = 1 + 0 * plan.nq, packed[REFERENCE]
    s, x, y, z, to = scratch_of(packed), pointer_to(q), pointer_to(v), pointer_to(a), pointer_to(out)
    good = _motion_block(one, s, plan, 0 * one, order, reference, still_base(), 0 * one, x, y, z, to)
    return counted(packed, order, good)
