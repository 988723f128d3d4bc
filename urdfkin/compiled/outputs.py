"""What a walk hands out: places, velocities, accelerations, Jacobians and what they change by, by reference.

Each output says what it follows of a state, and what it makes of the state of a frame. Velocities and
accelerations come in the axes that their reference asks for (`axes`); columns are made in the world's, and
LOCAL turns them to the frame's own.
"""

from __future__ import annotations

import numpy as np

from urdfkin.compiled import compiled_equations as eq
from urdfkin.compiled.compiling import compiled
from urdfkin.compiled.memory import constant, numbers_of, put, same, write_rows
from urdfkin.compiled.numbers import nothing, zero
from urdfkin.compiled.program import ONE_ROW, OUT_ROW, PAIR_WIDTH, ZERO_ROW, Head
from urdfkin.compiled.recursion import put_vector, vector

_LOCAL, _WORLD, _ALIGNED = 0, 1, 2
_FRAMES, _NV = int(Head.FRAMES), int(Head.NV)

#: The rows of a 4 by 4 pose, row by row, and those of [linear; angular].
_POSE = np.array([*range(OUT_ROW, OUT_ROW + 12), ZERO_ROW, ZERO_ROW, ZERO_ROW, ONE_ROW])
_SIX = np.arange(OUT_ROW, OUT_ROW + 6)


# -- what is followed ------------------------------------------------------------------------------------


@compiled
def _unfollowed():
    return nothing(), nothing(), nothing()


@compiled
def follow_place(state):
    """R and p."""
    return state[0], state[1], _unfollowed(), _unfollowed(), _unfollowed(), _unfollowed()


@compiled
def follow_velocity(state):
    """R, p, w and vel."""
    return state[0], state[1], state[2], state[3], _unfollowed(), _unfollowed()


@compiled
def follow_acceleration(state):
    """R, p, w, alpha and acc: 7.130 asks nobody for vel."""
    return state[0], state[1], state[2], _unfollowed(), state[4], state[5]


@compiled
def _no_vector():
    return zero(), zero(), zero()


# -- one frame's numbers ---------------------------------------------------------------------------------


@compiled
def emit_place(m, s, program, place, sources, b, reference, state, to):
    """The 4 by 4 pose."""
    R, p = state[0], state[1]
    _pose_row(s, OUT_ROW, R[0], p[0])
    _pose_row(s, OUT_ROW + 4, R[1], p[1])
    _pose_row(s, OUT_ROW + 8, R[2], p[2])
    frames = program[_FRAMES]
    write_rows(m, s, numbers_of(_POSE), 0, 16, to, (b * frames + place) * 16, frames * 16)


@compiled
def _pose_row(s, row, x, last):
    """A row of a pose."""
    put_vector(s, row, x)
    put(s, row + 3, last)


@compiled
def emit_velocity(m, s, program, place, sources, b, reference, state, to):
    """[linear; angular]: 7.127, 7.128 in a reference."""
    p, w, vel = state[1], state[2], state[3]
    if reference == _WORLD:  # the point of the body that is at the world's origin now
        vel = eq.point_velocity(vel, w, eq.minus(_no_vector(), p))
    _emit_six(m, s, program, place, b, vel, w, to)


@compiled
def emit_acceleration(m, s, program, place, sources, b, reference, state, to):
    """[linear; angular]: 7.129, 7.130 in a reference."""
    p, w, alpha, acc = state[1], state[2], state[4], state[5]
    if reference == _WORLD:
        acc = eq.point_acceleration(acc, alpha, w, eq.minus(_no_vector(), p))
    _emit_six(m, s, program, place, b, acc, alpha, to)


@compiled
def emit_imu(m, s, program, place, sources, b, reference, state, to):
    """What an accelerometer and a gyroscope read, on a base that is accelerated against gravity."""
    _emit_six(m, s, program, place, b, state[5], state[2], to)


@compiled
def _emit_six(m, s, program, place, b, linear, angular, to):
    put_vector(s, OUT_ROW, linear)
    put_vector(s, OUT_ROW + 3, angular)
    frames = program[_FRAMES]
    write_rows(m, s, numbers_of(_SIX), 0, 6, to, (b * frames + place) * 6, frames * 6)


@compiled
def emit_matrix(m, s, program, place, sources, b, reference, state, to):
    """The columns that were computed, and zeros for the rates that do not move the frame."""
    frames, size = program[_FRAMES], 6 * program[_NV]
    write_rows(m, s, program, sources, size, to, (b * frames + place) * size, frames * size)


# -- columns ---------------------------------------------------------------------------------------------


@compiled
def keep_none(s, row, axis, state):
    """Outputs without columns."""


@compiled
def column_none(s, row, to, how, g, c, reference, state):
    """Outputs without columns."""


@compiled
def keep_axis(s, row, axis, state):
    """The axis z_{i-1} and the origin O_{i-1} of a rate, in the world's axes: what 7.85 needs."""
    R, p = state[0], state[1]
    if axis == 2:
        put_vector(s, row, (R[0][2], R[1][2], R[2][2]))
    elif axis == 1:
        put_vector(s, row, (R[0][1], R[1][1], R[2][1]))
    else:
        put_vector(s, row, (R[0][0], R[1][0], R[2][0]))
    put_vector(s, row + 3, p)


@compiled
def keep_moving_axis(s, row, axis, state):
    """And how they move: the w and vel of the link that the axis rides on."""
    keep_axis(s, row, axis, state)
    put_vector(s, row + 6, state[2])
    put_vector(s, row + 9, state[3])


@compiled
def column_jacobian(s, row, to, how, g, c, reference, state):
    """[z x d_{i-1,n}; z] for a turning rate, [z; 0] for a sliding one (7.85), in a reference."""
    z, R = vector(s, row), state[0]
    if how & 1:
        d = eq.minus(_end(reference, state[1]), vector(s, row + 3))
        linear, angular = eq.turning_column(z, d)
        _put_column(s, to, how, g, c, reference, R, linear, angular)
    else:
        _put_column(s, to, how, g, c, reference, R, z, _no_vector())


@compiled
def column_rate(s, row, to, how, g, c, reference, state):
    """The rate of that column (7.126). In the frame's own axes it is the rate of the numbers there."""
    R, p, w, vel = state[0], state[1], state[2], state[3]
    z = vector(s, row)
    z_rate = eq.axis_rate(vector(s, row + 6), z)
    if how & 1:
        d = eq.minus(_end(reference, p), vector(s, row + 3))
        d_rate = eq.minus(_end(reference, vel), vector(s, row + 9))
        linear, angular = eq.turning_column(z, d)
        rate, turning = eq.turning_column_rate(z, z_rate, d, d_rate)
        if reference == _LOCAL:
            rate = eq.rate_in_turning_axes(rate, w, linear)
            turning = eq.rate_in_turning_axes(turning, w, angular)
        _put_column(s, to, how, g, c, reference, R, rate, turning)
    else:
        if reference == _LOCAL:
            z_rate = eq.rate_in_turning_axes(z_rate, w, z)
        _put_column(s, to, how, g, c, reference, R, z_rate, _no_vector())


@compiled
def _end(reference, x):
    """To where a column's moment arm reaches: the frame's origin, or the world's."""
    if reference == _WORLD:
        nil = same(0.0)
        x = nil, nil, nil
    return x


@compiled
def _put_column(s, to, how, g, c, reference, R, linear, angular):
    """Seen in the reference's axes; times a follower's multiplier, added to what its leader's rate does."""
    if reference == _LOCAL:
        back = eq.transposed(R)
        linear, angular = eq.rotate(back, linear), eq.rotate(back, angular)
    if c:
        linear = eq.times(constant(g, c), linear)
        _add_column(s, to, how, linear, eq.times(constant(g, c), angular))
    else:
        _add_column(s, to, how, linear, angular)


@compiled
def _add_column(s, to, how, linear, angular):
    if how & 2:
        _add_six(s, to, linear, angular)
    else:
        put_vector(s, to, linear)
        put_vector(s, to + 3, angular)


@compiled
def _add_six(s, to, linear, angular):
    put_vector(s, to, eq.plus(vector(s, to), linear))
    put_vector(s, to + 3, eq.plus(vector(s, to + 3), angular))


# -- pairs of columns ------------------------------------------------------------------------------------


@compiled
def emit_pairs(m, s, program, place, pairs, b, reference, state, to):
    """How each column changes with each rate, (6, nv, nv), from the columns themselves."""
    count, nv = program[pairs], program[_NV]
    first, end = pairs + 1, pairs + 1 + PAIR_WIDTH * count
    frames, size = program[_FRAMES], nv * nv
    begin = (b * frames + place) * 6 * size
    for rate in range(nv):
        for j in range(first, end, PAIR_WIDTH):
            put_vector(s, program[j + 3], _no_vector())
            put_vector(s, program[j + 3] + 3, _no_vector())
        for i in range(first, end, PAIR_WIDTH):
            if program[i + 2] == rate:  # a leader's own column, and those of its followers
                _add_changes(s, program, i, first, end, reference)
        for row in range(6):
            at = begin + row * size + rate * nv
            write_rows(m, s, program, end + row * nv, nv, to, at, frames * 6 * size)


@compiled
def _add_changes(s, program, i, first, end, reference):
    """What each rate does to column i.

    A rate before the column turns all of it; one behind it moves the end of its arm. From the world's origin
    there is no end that moves; the frame's own axes move as all that is before them does.
    """
    v_i, w_i = vector(s, program[i]), vector(s, program[i] + 3)
    for j in range(first, end, PAIR_WIDTH):
        v_j, w_j, sum_j = vector(s, program[j]), vector(s, program[j] + 3), program[j + 3]
        before = program[j + 1] <= program[i + 1]
        if reference == _ALIGNED:
            if before:
                linear, angular = eq.turned_along(w_j, v_i, w_i)
                _add_six(s, sum_j, linear, angular)
            else:
                _add_six(s, sum_j, eq.end_moved(w_i, v_j), _no_vector())
        elif reference == _WORLD and before:
            linear, angular = eq.motion_product(v_j, w_j, v_i, w_i)
            _add_six(s, sum_j, linear, angular)
        elif reference == _LOCAL and not before:
            linear, angular = eq.motion_product(v_i, w_i, v_j, w_j)
            _add_six(s, sum_j, linear, angular)
