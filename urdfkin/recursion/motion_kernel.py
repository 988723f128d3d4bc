"""The compiled walk for placements, velocities and accelerations of frames (7.77, 7.127 to 7.130)."""

from __future__ import annotations

from numba import types

from urdfkin.recursion.lanes import LANES, cross, lane_function, load, minus, plus, pointer_to, rotate_back
from urdfkin.recursion.steps import ALPHA, FRAME, A, P, R, V, W
from urdfkin.recursion.walk import INT, ROWS, SCRATCH, WHOLE, advance, frame_state, kernel, start

_LOCAL, _WORLD = 0, 1


@lane_function
def _write_motion(m, s, b, place, order, reference, out):
    """Six numbers [linear; angular], or for order 0 the 4 by 4 pose row by row."""
    frames, to = out.shape[1], pointer_to(out)
    if order == 0:
        for k in range(m):
            here = ((b + k) * frames + place) * 16
            for row in range(3):
                for c in range(3):
                    to[here + 4 * row + c] = s[(FRAME + R + 3 * row + c) * LANES + k]
                to[here + 4 * row + 3] = s[(FRAME + P + row) * LANES + k]
                to[here + 12 + row] = 0.0
            to[here + 15] = 1.0
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
                shifted = plus(shifted, inward)
            lin = plus(lin, shifted)
        elif reference == _LOCAL:
            lin, ang = rotate_back(s, FRAME + R, lin, k), rotate_back(s, FRAME + R, ang, k)
        here = ((b + k) * frames + place) * 6
        for row in range(3):
            to[here + row] = lin[row]
            to[here + 3 + row] = ang[row]


@lane_function
def _motion_block(m, b, order, reference, steps, g, frames, offsets, base, q, v, a, out, s):
    rows = start(m, s, b, base, order)
    f = 0 * b
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            advance(m, s, b, i, steps, g, q, v, a, order, rows)
        while f < frames.shape[0] and frames[f, 0] == i:
            frame_state(m, s, offsets, f, order, rows, order == 0 or reference == _LOCAL)
            _write_motion(m, s, b, frames[f, 1], order, reference, out)
            f += 1


@kernel(
    INT, INT, WHOLE, ROWS, WHOLE, ROWS, ROWS, ROWS, ROWS, ROWS, types.Array(types.float64, 3, "C"), SCRATCH
)
def motion(order, reference, steps, g, frames, offsets, base, q, v, a, out, s):
    """Placements (order 0), velocities (1) or accelerations (2) of frames.

    Shapes: base (1 or n, 24), q (n, nq), v and a (n, nv), out (n, frames, 16 or 6), s (rows * LANES,).
    """
    n = q.shape[0]
    lanes = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    for b in range(0, n, LANES):
        _motion_block(lanes, b, order, reference, steps, g, frames, offsets, base, q, v, a, out, s)
