"""Outputs of the forward recursion: placements, velocities, accelerations, Jacobians and their derivatives.

The state of a link consists of vectors. A function `mask_...` marks the vectors that an output does not need.
Jacobian columns are computed in world axes. For LOCAL, the columns are rotated to the axes of the frame.
"""

from __future__ import annotations

import numpy as np

from urdfkin.compiled.plan import HESSIAN_COLUMN_WIDTH, ONE_ROW, OUT_ROW, REFERENCES, ZERO_ROW, ProgramHeader
from urdfkin.compiled.python_numbers import (
    array_data,
    broadcast,
    load_constant,
    store_number,
    unused,
    write_rows,
    zero,
)
from urdfkin.compiled.recursion import load_vector, store_vector
from urdfkin.kinematics import equations as eq

_LOCAL, _WORLD, _ALIGNED = REFERENCES.values()
_FRAMES, _NV = int(ProgramHeader.FRAMES), int(ProgramHeader.NV)

#: `_POSE_ROWS` are the scratch rows with the 16 elements of a pose.
#: `_SIX_ROWS` are the scratch rows with the six numbers of a velocity or an acceleration.
_POSE_ROWS = np.array([*range(OUT_ROW, OUT_ROW + 12), ZERO_ROW, ZERO_ROW, ZERO_ROW, ONE_ROW])
_SIX_ROWS = np.arange(OUT_ROW, OUT_ROW + 6)


# -- needed parts of the state ---------------------------------------------------------------------------


def _unused_vector():
    return unused(), unused(), unused()


def mask_for_placement(state):
    return state[0], state[1], _unused_vector(), _unused_vector(), _unused_vector(), _unused_vector()


def mask_for_velocity(state):
    return state[0], state[1], state[2], state[3], _unused_vector(), _unused_vector()


def mask_for_acceleration(state):
    """Mark the linear velocity as unused: the acceleration (7.130) does not need it."""
    return state[0], state[1], state[2], _unused_vector(), state[4], state[5]


def _zero_vector():
    return zero(), zero(), zero()


# -- the result of one frame -----------------------------------------------------------------------------


def write_placement(m, s, program, place, sources, b, reference, state, to):
    R, p = state[0], state[1]
    _store_pose_row(s, OUT_ROW, R[0], p[0])
    _store_pose_row(s, OUT_ROW + 4, R[1], p[1])
    _store_pose_row(s, OUT_ROW + 8, R[2], p[2])
    frames = program[_FRAMES]
    write_rows(m, s, array_data(_POSE_ROWS), 0, 16, to, (b * frames + place) * 16, frames * 16)


def _store_pose_row(s, row, x, last):
    store_vector(s, row, x)
    store_number(s, row + 3, last)


def write_velocity(m, s, program, place, sources, b, reference, state, to):
    p, w, vel = state[1], state[2], state[3]
    if reference == _WORLD:
        # The result is the velocity of the body point that is now at the world's origin.
        vel = eq.point_velocity(vel, w, eq.minus(_zero_vector(), p))
    _write_six_vector(m, s, program, place, b, vel, w, to)


def write_acceleration(m, s, program, place, sources, b, reference, state, to):
    p, w, alpha, acc = state[1], state[2], state[4], state[5]
    if reference == _WORLD:
        acc = eq.point_acceleration(acc, alpha, w, eq.minus(_zero_vector(), p))
    _write_six_vector(m, s, program, place, b, acc, alpha, to)


def write_imu(m, s, program, place, sources, b, reference, state, to):
    """Write accelerometer and gyroscope readings.

    The caller must subtract gravity from the base's acceleration.
    """
    _write_six_vector(m, s, program, place, b, state[5], state[2], to)


def _write_six_vector(m, s, program, place, b, linear, angular, to):
    store_vector(s, OUT_ROW, linear)
    store_vector(s, OUT_ROW + 3, angular)
    frames = program[_FRAMES]
    write_rows(m, s, array_data(_SIX_ROWS), 0, 6, to, (b * frames + place) * 6, frames * 6)


def write_matrix(m, s, program, place, sources, b, reference, state, to):
    frames, size = program[_FRAMES], 6 * program[_NV]
    write_rows(m, s, program, sources, size, to, (b * frames + place) * size, frames * size)


# -- columns ---------------------------------------------------------------------------------------------


def store_no_axis(s, row, axis, state):
    """Do nothing: this output has no Jacobian columns."""


def write_no_column(s, row, to, flags, g, c, reference, state): ...


def store_axis(s, row, axis, state):
    """Store a joint's axis and origin in world axes (7.85)."""
    R, p = state[0], state[1]
    if axis == 2:
        store_vector(s, row, (R[0][2], R[1][2], R[2][2]))
    elif axis == 1:
        store_vector(s, row, (R[0][1], R[1][1], R[2][1]))
    else:
        store_vector(s, row, (R[0][0], R[1][0], R[2][0]))
    store_vector(s, row + 3, p)


def store_moving_axis(s, row, axis, state):
    store_axis(s, row, axis, state)
    store_vector(s, row + 6, state[2])
    store_vector(s, row + 9, state[3])


def write_jacobian_column(s, row, to, flags, g, c, reference, state):
    """Compute a Jacobian column (7.85)."""
    z, R = load_vector(s, row), state[0]
    if flags & 1:
        d = eq.minus(_reference_point(reference, state[1]), load_vector(s, row + 3))
        linear, angular = eq.turning_column(z, d)
        _write_column(s, to, flags, g, c, reference, R, linear, angular)
    else:
        _write_column(s, to, flags, g, c, reference, R, z, _zero_vector())


def write_jacobian_rate_column(s, row, to, flags, g, c, reference, state):
    """Compute the time derivative of a Jacobian column (7.126).

    For LOCAL, differentiate the components in the frame's moving axes.
    """
    R, p, w, vel = state[0], state[1], state[2], state[3]
    z = load_vector(s, row)
    z_rate = eq.axis_rate(load_vector(s, row + 6), z)
    if flags & 1:
        d = eq.minus(_reference_point(reference, p), load_vector(s, row + 3))
        d_rate = eq.minus(_reference_point(reference, vel), load_vector(s, row + 9))
        linear, angular = eq.turning_column(z, d)
        rate, turning = eq.turning_column_rate(z, z_rate, d, d_rate)
        if reference == _LOCAL:
            rate = eq.rate_in_turning_axes(rate, w, linear)
            turning = eq.rate_in_turning_axes(turning, w, angular)
        _write_column(s, to, flags, g, c, reference, R, rate, turning)
    else:
        if reference == _LOCAL:
            z_rate = eq.rate_in_turning_axes(z_rate, w, z)
        _write_column(s, to, flags, g, c, reference, R, z_rate, _zero_vector())


def _reference_point(reference, x):
    """Return the position or velocity of the Jacobian's reference point.

    `x` is the position or velocity of the frame's origin.
    """
    if reference == _WORLD:
        nil = broadcast(0.0)
        x = nil, nil, nil
    return x


def _write_column(s, to, flags, g, c, reference, R, linear, angular):
    if reference == _LOCAL:
        back = eq.transposed(R)
        linear, angular = eq.rotate(back, linear), eq.rotate(back, angular)
    if c:
        linear = eq.times(load_constant(g, c), linear)
        _add_column(s, to, flags, linear, eq.times(load_constant(g, c), angular))
    else:
        _add_column(s, to, flags, linear, angular)


def _add_column(s, to, flags, linear, angular):
    if flags & 2:
        _add_six_vector(s, to, linear, angular)
    else:
        store_vector(s, to, linear)
        store_vector(s, to + 3, angular)


def _add_six_vector(s, to, linear, angular):
    store_vector(s, to, eq.plus(load_vector(s, to), linear))
    store_vector(s, to + 3, eq.plus(load_vector(s, to + 3), angular))


# -- pairs of columns ------------------------------------------------------------------------------------


def write_hessian(m, s, program, place, pairs, b, reference, state, to):
    count, nv = program[pairs], program[_NV]
    first, end = pairs + 1, pairs + 1 + HESSIAN_COLUMN_WIDTH * count
    frames, size = program[_FRAMES], nv * nv
    begin = (b * frames + place) * 6 * size
    for rate in range(nv):
        for j in range(first, end, HESSIAN_COLUMN_WIDTH):
            store_vector(s, program[j + 3], _zero_vector())
            store_vector(s, program[j + 3] + 3, _zero_vector())
        for i in range(first, end, HESSIAN_COLUMN_WIDTH):
            if program[i + 2] == rate:  # Mimic joints have the velocity index of the mimicked joint.
                _add_column_derivatives(s, program, i, first, end, reference)
        for row in range(6):
            at = begin + row * size + rate * nv
            write_rows(m, s, program, end + row * nv, nv, to, at, frames * 6 * size)


def _add_column_derivatives(s, program, i, first, end, reference):
    """Add the derivatives of column i with respect to each joint's motion.

    The joint of column i counts as an earlier joint.

    | reference frame | an earlier joint moves | a later joint moves |
    |---|---|---|
    | LOCAL_WORLD_ALIGNED | column i turns | the frame's origin moves |
    | WORLD | column i moves, the world's origin does not | no change |
    | LOCAL | no change: column i and the frame move as one rigid body | the frame moves |
    """
    v_i, w_i = load_vector(s, program[i]), load_vector(s, program[i] + 3)
    for j in range(first, end, HESSIAN_COLUMN_WIDTH):
        v_j, w_j, sum_j = load_vector(s, program[j]), load_vector(s, program[j] + 3), program[j + 3]
        before = program[j + 1] <= program[i + 1]
        if reference == _ALIGNED:
            if before:
                linear, angular = eq.turned_along(w_j, v_i, w_i)
                _add_six_vector(s, sum_j, linear, angular)
            else:
                _add_six_vector(s, sum_j, eq.end_moved(w_i, v_j), _zero_vector())
        elif reference == _WORLD and before:
            linear, angular = eq.motion_product(v_j, w_j, v_i, w_i)
            _add_six_vector(s, sum_j, linear, angular)
        elif reference == _LOCAL and not before:
            linear, angular = eq.motion_product(v_i, w_i, v_j, w_j)
            _add_six_vector(s, sum_j, linear, angular)
