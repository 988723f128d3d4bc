"""The compiled walk for velocities and accelerations in the frame's own axes (LOCAL), computed there.

The equations are those of `steps` (7.127 to 7.130), each vector written in the axes of the link it belongs
to: z is then (0, 0, 1), the interorigin vector is a constant, and going to the next link turns the vectors
back by its rotation. Seen from the world and turned back at the end, the result would carry the rounding
of the whole product of rotations twice; the judge found that to cost more than a factor of two against
Pinocchio, which works in the links' axes, on short chains.
"""

from __future__ import annotations

from urdfkin.recursion.compiling import BOUND, INT, NUMBERS, PLAN, ROWS, SCRATCH, kernel, output
from urdfkin.recursion.lanes import (
    LANES,
    copy_rows,
    cross,
    dot,
    lane_function,
    load,
    plus,
    pointer_to,
    sine_cosine,
    store,
)
from urdfkin.recursion.motion_kernel import inputs_ordinary, shapes_fit, write_motion
from urdfkin.recursion.plan import GEOMETRY_WIDTH, OFFSET_WIDTH, STEP_WIDTH, Geometry, Motion, Step
from urdfkin.recursion.rows import (
    ALPHA,
    ANGLE,
    COSINE,
    FRAME,
    QUATERNION,
    RATE,
    RATE_2,
    SINE,
    SLIDE,
    SLIDE_RATE,
    SLIDE_RATE_2,
    TURN_RATE,
    TURN_RATE_2,
    A,
    D,
    P,
    R,
    V,
    W,
)
from urdfkin.recursion.steps import carry, gather_joint, gather_place, gather_rates
from urdfkin.recursion.walk import (
    counted,
    read_inputs,
    resume,
    save,
    scratch_of,
    still_base,
    stride_of,
    walk_of,
)

_KIND = int(Step.KIND)
_OFFSET = int(Geometry.OFFSET)
_TURN, _SLIDE, _PLANAR = int(Motion.TURN), int(Motion.SLIDE), int(Motion.PLANAR)


@lane_function
def _vectors(order):
    """How many vectors there are: w, vel, and for accelerations alpha and acc."""
    return 2 if order == 1 else 4


@lane_function
def _rows_of(order):
    """How much of the state there is: the places and rotations of `steps` are not followed."""
    return P + 3 + 3 * _vectors(order)


@lane_function
def _turned_back(m, s, b, base, stride, order):
    """The vectors of the base's state, in its own axes."""
    for k in range(m):
        row = (b + k) * stride
        store(s, P, k, (0.0, 0.0, 0.0))
        for at in range(W, W + 3 * _vectors(order), 3):
            x = (base[row + at], base[row + at + 1], base[row + at + 2])
            first = (base[row + R], base[row + R + 3], base[row + R + 6])
            second = (base[row + R + 1], base[row + R + 4], base[row + R + 7])
            third = (base[row + R + 2], base[row + R + 5], base[row + R + 8])
            store(s, at, k, (dot(first, x), dot(second, x), dot(third, x)))


@lane_function
def _start(m, s, plan, b, base, stride, order):
    """The state of the base in its own axes; places are not followed."""
    if stride == 0:  # the same for all lanes, which the compiler then sees
        _turned_back(m, s, 0 * b, base, 0 * b, order)
    else:
        _turned_back(m, s, b, base, stride, order)
    copy_rows(m, s, 0, plan.slots, _rows_of(order))


@lane_function
def _turn_back_by_constant(m, s, at, g, i, order):
    """Turn back: x <- G^T x for each vector, with the constant rotation G in `g[i]`."""
    first = (g[i], g[i + 3], g[i + 6])
    second = (g[i + 1], g[i + 4], g[i + 7])
    third = (g[i + 2], g[i + 5], g[i + 8])
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
def _turn_back_by_quaternion(m, s, order):
    """Turn back: x <- R(quat)^T x for each vector, with the unit quaternion (x, y, z, w)."""
    for k in range(m):
        x, y, z = load(s, QUATERNION, k)
        w = s[(QUATERNION + 3) * LANES + k]
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
        store(s, D, k, (g[i + _OFFSET], g[i + _OFFSET + 1], g[i + _OFFSET + 2]))


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
def _step_free(m, s, plan, i, order):
    gather_place(m, s, plan, i)
    for k in range(m):
        store(s, D, k, plus(load(s, D, k), load(s, SLIDE, k)))
    carry(m, s, 0, order)
    if plan.steps[STEP_WIDTH * i + _KIND] == _PLANAR:
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        _turn_back_about_z(m, s, order)
    else:
        _turn_back_by_quaternion(m, s, order)
    gather_rates(m, s, plan, i, order)
    _move_free(m, s, order)


@lane_function
def _step(m, s, plan, i, order):
    """The state of link i-1 in its axes becomes the state of link i in its own."""
    _turn_back_by_constant(m, s, 0, plan.geometry, GEOMETRY_WIDTH * i, order)
    _place(m, s, plan.geometry, GEOMETRY_WIDTH * i)
    kind = plan.steps[STEP_WIDTH * i + _KIND]
    if kind == _TURN:
        carry(m, s, 0, order)
        gather_joint(m, s, plan, i, order)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        _move_revolute(m, s, order)
    elif kind == _SLIDE:
        gather_joint(m, s, plan, i, order)
        for k in range(m):
            store(s, D, k, plus(load(s, D, k), (0.0, 0.0, s[ANGLE * LANES + k])))
        carry(m, s, 0, order)
        _move_prismatic(m, s, order)
    else:
        _step_free(m, s, plan, i, order)


@lane_function
def _local_block(m, s, plan, b, order, base, stride, q, v, a, to):
    read_inputs(m, s, plan, b, q, v, a, order)
    _start(m, s, plan, b, base, stride, order)
    rows = _rows_of(order)
    f = 0 * b
    for i in range(-1, plan.step_count):
        if i >= 0:
            resume(m, s, plan, i, rows)
            _step(m, s, plan, i, order)
            save(m, s, plan, i, rows)
        while f < plan.frame_count and plan.frames[2 * f] == i:
            copy_rows(m, s, 0, FRAME, rows)
            _place(m, s, plan.offsets, OFFSET_WIDTH * f)  # in the link's axes, as in `walk.frame_state`
            carry(m, s, FRAME, order)
            _turn_back_by_constant(m, s, FRAME, plan.offsets, OFFSET_WIDTH * f, order)
            write_motion(m, s, plan, f, b, order, to)
            f += 1
    return inputs_ordinary(m, plan, b, order, q, v, a)


@kernel(INT, PLAN, ROWS, ROWS, ROWS, ROWS, output(3), SCRATCH)
def local_motions(order, packed, base, q, v, a, out, scratch):
    """Velocities (order 1) or accelerations (2) of frames, in their own axes; 0 for an input not ordinary.

    Shapes: base (1 or n, 24), q (n, nq), v and a (n, nv), out (n, frames, 6), scratch (rows * LANES,).
    """
    n, plan, good = q.shape[0], walk_of(packed), 1
    m = LANES + 0 * n  # a constant to the compiler, a number like any other to Numba
    s, state, stride = pointer_to(scratch), pointer_to(base), stride_of(base)
    x, y, z, to = pointer_to(q), pointer_to(v), pointer_to(a), pointer_to(out)
    for first in range(0, n, LANES):
        b = min(first, n - LANES)  # the last block reaches back into the one before
        good &= _local_block(m, s, plan, b, order, state, stride, x, y, z, to)
    return good


@kernel(INT, BOUND, NUMBERS, NUMBERS, NUMBERS, output(1), nogil=False)
def local_motion(order, packed, q, v, a, out):
    """The same of one frame in one configuration, always LOCAL; -1 where the arrays cannot be taken.

    Shapes: q (nq,), v and a (nv,), out (6,), memory of its own.
    """
    plan = walk_of(packed)
    if not shapes_fit(plan, order, q, v, a, out):
        return -1
    one = 1 + 0 * plan.nq
    s, x, y, z, to = scratch_of(packed), pointer_to(q), pointer_to(v), pointer_to(a), pointer_to(out)
    good = _local_block(one, s, plan, 0 * one, order, still_base(), 0 * one, x, y, z, to)
    return counted(packed, order, good)
