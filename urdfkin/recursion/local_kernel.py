"""The compiled walk for velocities and accelerations in the frame's own axes (LOCAL), computed there.

The equations are those of `steps` (7.127 to 7.130), each vector written in the axes of the link it belongs
to: z is then (0, 0, 1), the interorigin vector is a constant, and going to the next link turns the vectors
back by its rotation. Seen from the world and turned back at the end, the result would carry the rounding
of the whole product of rotations twice; the judge found that to cost more than a factor of two against
Pinocchio, which works in the links' axes, on short chains.
"""

from __future__ import annotations

from numba import types

from urdfkin.recursion.lanes import (
    LANES,
    copy_rows,
    cross,
    dot,
    entry,
    lane_function,
    load,
    plus,
    pointer_to,
    sine_cosine,
    store,
)
from urdfkin.recursion.plan import Geometry, Motion
from urdfkin.recursion.steps import (
    ALPHA,
    ANGLE,
    COSINE,
    FRAME,
    RATE,
    RATE_2,
    SINE,
    SLIDE_RATE,
    SLIDE_RATE_2,
    STATE_ROWS,
    TURN_RATE,
    TURN_RATE_2,
    A,
    D,
    P,
    R,
    V,
    W,
    carry,
    gather_free,
    gather_joint,
)
from urdfkin.recursion.walk import INT, ROWS, SCRATCH, SLOTS, WHOLE, kernel

_OFFSET = int(Geometry.OFFSET)
_TURN, _SLIDE, _PLANAR = int(Motion.TURN), int(Motion.SLIDE), int(Motion.PLANAR)


@lane_function
def _vectors(order):
    """How many vectors there are: w, vel, and for accelerations alpha and acc."""
    return 2 if order == 1 else 4


@lane_function
def _start(m, s, b, base, order):
    """The state of the base in its own axes; places are not followed."""
    fixed = base.shape[0] == 1
    for k in range(m):
        row = 0 if fixed else b + k
        store(s, P, k, (0.0, 0.0, 0.0))
        for at in range(W, W + 3 * _vectors(order), 3):
            x = (base[row, at], base[row, at + 1], base[row, at + 2])
            first = (base[row, R], base[row, R + 3], base[row, R + 6])
            second = (base[row, R + 1], base[row, R + 4], base[row, R + 7])
            third = (base[row, R + 2], base[row, R + 5], base[row, R + 8])
            store(s, at, k, (dot(first, x), dot(second, x), dot(third, x)))
    rows = P + 3 + 3 * _vectors(order)
    copy_rows(m, s, 0, SLOTS, rows)
    return rows


@lane_function
def _turn_back_by_constant(m, s, at, g, i, order):
    """Turn back: x <- G^T x for each vector, with the constant rotation G in row `i` of `g`."""
    first = (g[i, 0], g[i, 3], g[i, 6])
    second = (g[i, 1], g[i, 4], g[i, 7])
    third = (g[i, 2], g[i, 5], g[i, 8])
    for row in range(at + W, at + W + 3 * _vectors(order), 3):
        for k in range(m):
            x = load(s, row, k)
            store(s, row, k, (dot(first, x), dot(second, x), dot(third, x)))


@lane_function
def _turn_back_about_z(m, s, order):
    """Turn back: x <- Rz(angle)^T x for each vector, eq. 7.5."""
    for row in range(W, W + 3 * _vectors(order), 3):
        for k in range(m):
            x, y = s[row * LANES + k], s[(row + 1) * LANES + k]
            sine, cosine = s[SINE * LANES + k], s[COSINE * LANES + k]
            s[row * LANES + k] = x * cosine + y * sine
            s[(row + 1) * LANES + k] = y * cosine - x * sine


@lane_function
def _turn_back_by_quaternion(m, s, q, b, at, order):
    """Turn back: x <- R(quat)^T x for each vector, with (x, y, z, w) in columns `at` to `at + 3` of `q`."""
    for k in range(m):
        x, y, z, w = (
            entry(q, b + k, at),
            entry(q, b + k, at + 1),
            entry(q, b + k, at + 2),
            entry(q, b + k, at + 3),
        )
        first = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y))
        second = (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x))
        third = (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
        for row in range(W, W + 3 * _vectors(order), 3):
            u = load(s, row, k)
            store(s, row, k, (dot(first, u), dot(second, u), dot(third, u)))


@lane_function
def _place(m, s, g, i):
    """d, a constant of the link."""
    for k in range(m):
        store(s, D, k, (g[i, _OFFSET], g[i, _OFFSET + 1], g[i, _OFFSET + 2]))


@lane_function
def _move_revolute(m, s, order):
    """7.129, then 7.127, with z = (0, 0, 1) and so w x z = (w_y, -w_x, 0); then the turn."""
    if order >= 2:
        for k in range(m):
            w, v = load(s, W, k), s[RATE * LANES + k]
            gained = (v * w[1], -v * w[0], s[RATE_2 * LANES + k])
            store(s, ALPHA, k, plus(load(s, ALPHA, k), gained))
    for k in range(m):
        s[(W + 2) * LANES + k] += s[RATE * LANES + k]
    _turn_back_about_z(m, s, order)


@lane_function
def _move_prismatic(m, s, order):
    """7.130, then 7.128."""
    if order >= 2:
        for k in range(m):
            w, v = load(s, W, k), s[RATE * LANES + k]
            gained = (2.0 * v * w[1], -2.0 * v * w[0], s[RATE_2 * LANES + k])
            store(s, A, k, plus(load(s, A, k), gained))
    for k in range(m):
        s[(V + 2) * LANES + k] += s[RATE * LANES + k]


@lane_function
def _move_free(m, s, order):
    """A planar or floating joint, already turned back: its rates are in these axes (see `steps`)."""
    for k in range(m):
        w, u, o = load(s, W, k), load(s, SLIDE_RATE, k), load(s, TURN_RATE, k)
        if order >= 2:
            gained = plus(load(s, TURN_RATE_2, k), cross(w, o))
            store(s, ALPHA, k, plus(load(s, ALPHA, k), gained))
            twice_w = plus(w, plus(w, o))
            gained = plus(load(s, SLIDE_RATE_2, k), cross(twice_w, u))
            store(s, A, k, plus(load(s, A, k), gained))
        store(s, V, k, plus(load(s, V, k), u))
        store(s, W, k, plus(w, o))


@lane_function
def _step_free(m, s, b, i, steps, q, v, a, order):
    at, rate_at, planar = steps[i, 3], steps[i, 4], steps[i, 0] == _PLANAR
    for k in range(m):
        z = 0.0 if planar else entry(q, b + k, at + 2)
        store(s, D, k, plus(load(s, D, k), (entry(q, b + k, at), entry(q, b + k, at + 1), z)))
    carry(m, s, 0, order)
    if planar:
        for k in range(m):
            s[ANGLE * LANES + k] = entry(q, b + k, at + 2)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        _turn_back_about_z(m, s, order)
    else:
        _turn_back_by_quaternion(m, s, q, b, at + 3, order)
    gather_free(m, s, b, rate_at, planar, v, SLIDE_RATE, TURN_RATE)
    if order >= 2:
        gather_free(m, s, b, rate_at, planar, a, SLIDE_RATE_2, TURN_RATE_2)
    _move_free(m, s, order)


@lane_function
def _step(m, s, b, i, steps, g, q, v, a, order):
    """The state of link i-1 in its axes becomes the state of link i in its own."""
    _turn_back_by_constant(m, s, 0, g, i, order)
    _place(m, s, g, i)
    kind = steps[i, 0]
    if kind == _TURN:
        carry(m, s, 0, order)
        gather_joint(m, s, b, i, steps, g, q, v, a, order)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        _move_revolute(m, s, order)
    elif kind == _SLIDE:
        gather_joint(m, s, b, i, steps, g, q, v, a, order)
        for k in range(m):
            store(s, D, k, plus(load(s, D, k), (0.0, 0.0, s[ANGLE * LANES + k])))
        carry(m, s, 0, order)
        _move_prismatic(m, s, order)
    else:
        _step_free(m, s, b, i, steps, q, v, a, order)


@lane_function
def _write(m, s, b, place, order, out):
    linear, angular = (FRAME + V, FRAME + W) if order == 1 else (FRAME + A, FRAME + ALPHA)
    frames, to = out.shape[1], pointer_to(out)
    for k in range(m):
        lin, ang = load(s, linear, k), load(s, angular, k)
        here = ((b + k) * frames + place) * 6
        for row in range(3):
            to[here + row] = lin[row]
            to[here + 3 + row] = ang[row]


@lane_function
def _block(m, b, order, steps, g, frames, offsets, base, q, v, a, out, s):
    rows = _start(m, s, b, base, order)
    f = 0 * b
    for i in range(-1, steps.shape[0]):
        if i >= 0:
            if steps[i, 1] >= 0:
                copy_rows(m, s, SLOTS + STATE_ROWS * steps[i, 1], 0, rows)
            _step(m, s, b, i, steps, g, q, v, a, order)
            if steps[i, 2] >= 0:
                copy_rows(m, s, 0, SLOTS + STATE_ROWS * steps[i, 2], rows)
        while f < frames.shape[0] and frames[f, 0] == i:
            copy_rows(m, s, 0, FRAME, rows)
            _place(m, s, offsets, f)  # in the link's axes, as in `walk.frame_state`
            carry(m, s, FRAME, order)
            _turn_back_by_constant(m, s, FRAME, offsets, f, order)
            _write(m, s, b, frames[f, 1], order, out)
            f += 1


@kernel(INT, WHOLE, ROWS, WHOLE, ROWS, ROWS, ROWS, ROWS, ROWS, types.Array(types.float64, 3, "C"), SCRATCH)
def local_motion(order, steps, g, frames, offsets, base, q, v, a, out, s):
    """Velocities (order 1) or accelerations (2) of frames, in their own axes.

    Shapes: base (1 or n, 24), q (n, nq), v and a (n, nv), out (n, frames, 6), s (rows * LANES,).
    """
    n = q.shape[0]
    lanes = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    for b in range(0, n, LANES):
        _block(lanes, b, order, steps, g, frames, offsets, base, q, v, a, out, s)
