"""Outputs of the forward recursion: placements, velocities, accelerations, Jacobians and their derivatives.

The functions `state_for_...` replace unneeded vectors of a link's state by `unused()`. Jacobian columns are
computed in world axes. For LOCAL, the columns are then rotated to the frame's axes.
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

#: Scratch row of each element of a pose (16), and of each number of a velocity or acceleration (6).
_POSE_ROWS = np.array([*range(OUT_ROW, OUT_ROW + 12), ZERO_ROW, ZERO_ROW, ZERO_ROW, ONE_ROW])
_SIX_ROWS = np.arange(OUT_ROW, OUT_ROW + 6)


# -- needed parts of the state ---------------------------------------------------------------------------


def _unused_vector():
    return unused(), unused(), unused()


def state_for_placement(state):
    return state[0], state[1], _unused_vector(), _unused_vector(), _unused_vector(), _unused_vector()


def state_for_velocity(state):
    return state[0], state[1], state[2], state[3], _unused_vector(), _unused_vector()


def state_for_acceleration(state):
    """Mark the linear velocity as unused, because no acceleration depends on it (7.129, 7.130)."""
    return state[0], state[1], state[2], _unused_vector(), state[4], state[5]


def _zero_vector():
    return zero(), zero(), zero()


# -- the result of one frame -----------------------------------------------------------------------------


def write_placement(m, scratch, program, frame, sources, start, reference, state, to):
    R, p = state[0], state[1]
    _store_pose_row(scratch, OUT_ROW, R[0], p[0])
    _store_pose_row(scratch, OUT_ROW + 4, R[1], p[1])
    _store_pose_row(scratch, OUT_ROW + 8, R[2], p[2])
    frames = program[_FRAMES]
    write_rows(m, scratch, array_data(_POSE_ROWS), 0, 16, to, (start * frames + frame) * 16, frames * 16)


def _store_pose_row(scratch, row, x, last):
    store_vector(scratch, row, x)
    store_number(scratch, row + 3, last)


def write_velocity(m, scratch, program, frame, sources, start, reference, state, to):
    p, w, vel = state[1], state[2], state[3]
    if reference == _WORLD:
        # The result is the velocity of the body point that is now at the world's origin.
        vel = eq.point_velocity(vel, w, eq.minus(_zero_vector(), p))
    _write_six_vector(m, scratch, program, frame, start, vel, w, to)


def write_acceleration(m, scratch, program, frame, sources, start, reference, state, to):
    p, w, alpha, acc = state[1], state[2], state[4], state[5]
    if reference == _WORLD:
        acc = eq.point_acceleration(acc, alpha, w, eq.minus(_zero_vector(), p))
    _write_six_vector(m, scratch, program, frame, start, acc, alpha, to)


def write_imu(m, scratch, program, frame, sources, start, reference, state, to):
    """Write accelerometer and gyroscope readings.

    The caller must subtract gravity from the base's acceleration.
    """
    _write_six_vector(m, scratch, program, frame, start, state[5], state[2], to)


def _write_six_vector(m, scratch, program, frame, start, linear, angular, to):
    store_vector(scratch, OUT_ROW, linear)
    store_vector(scratch, OUT_ROW + 3, angular)
    frames = program[_FRAMES]
    write_rows(m, scratch, array_data(_SIX_ROWS), 0, 6, to, (start * frames + frame) * 6, frames * 6)


def write_matrix(m, scratch, program, frame, sources, start, reference, state, to):
    frames, size = program[_FRAMES], 6 * program[_NV]
    write_rows(m, scratch, program, sources, size, to, (start * frames + frame) * size, frames * size)


# -- columns ---------------------------------------------------------------------------------------------


def store_no_axis(scratch, row, axis, state):
    """Do nothing, for outputs without Jacobian columns."""


def write_no_column(scratch, row, to, flags, constants, multiplier_index, reference, state): ...


def store_axis(scratch, row, axis, state):
    """Store a joint's axis and origin in world axes (7.85)."""
    R, p = state[0], state[1]
    if axis == 2:
        store_vector(scratch, row, (R[0][2], R[1][2], R[2][2]))
    elif axis == 1:
        store_vector(scratch, row, (R[0][1], R[1][1], R[2][1]))
    else:
        store_vector(scratch, row, (R[0][0], R[1][0], R[2][0]))
    store_vector(scratch, row + 3, p)


def store_moving_axis(scratch, row, axis, state):
    store_axis(scratch, row, axis, state)
    store_vector(scratch, row + 6, state[2])
    store_vector(scratch, row + 9, state[3])


def write_jacobian_column(scratch, row, to, flags, constants, multiplier_index, reference, state):
    """Compute a Jacobian column (7.85)."""
    z, R = load_vector(scratch, row), state[0]
    if flags & 1:
        d = eq.minus(_reference_point(reference, state[1]), load_vector(scratch, row + 3))
        linear, angular = eq.turning_column(z, d)
        _write_column(scratch, to, flags, constants, multiplier_index, reference, R, linear, angular)
    else:
        _write_column(scratch, to, flags, constants, multiplier_index, reference, R, z, _zero_vector())


def write_jacobian_rate_column(scratch, row, to, flags, constants, multiplier_index, reference, state):
    """Compute the time derivative of a Jacobian column (7.126).

    For LOCAL, differentiate the components in the frame's moving axes.
    """
    R, p, w, vel = state[0], state[1], state[2], state[3]
    z = load_vector(scratch, row)
    z_rate = eq.axis_rate(load_vector(scratch, row + 6), z)
    if flags & 1:
        d = eq.minus(_reference_point(reference, p), load_vector(scratch, row + 3))
        d_rate = eq.minus(_reference_point(reference, vel), load_vector(scratch, row + 9))
        linear, angular = eq.turning_column(z, d)
        rate, turning = eq.turning_column_rate(z, z_rate, d, d_rate)
        if reference == _LOCAL:
            rate = eq.rate_in_turning_axes(rate, w, linear)
            turning = eq.rate_in_turning_axes(turning, w, angular)
        _write_column(scratch, to, flags, constants, multiplier_index, reference, R, rate, turning)
    else:
        if reference == _LOCAL:
            z_rate = eq.rate_in_turning_axes(z_rate, w, z)
        _write_column(scratch, to, flags, constants, multiplier_index, reference, R, z_rate, _zero_vector())


def _reference_point(reference, x):
    """For WORLD, return 0 instead of `x`, because the world's origin is fixed at 0.

    `x` is the frame's origin or its velocity.
    """
    if reference == _WORLD:
        nil = broadcast(0.0)
        x = nil, nil, nil
    return x


def _write_column(scratch, to, flags, constants, multiplier_index, reference, R, linear, angular):
    if reference == _LOCAL:
        back = eq.transposed(R)
        linear, angular = eq.rotate(back, linear), eq.rotate(back, angular)
    if multiplier_index:
        linear = eq.times(load_constant(constants, multiplier_index), linear)
        _add_column(scratch, to, flags, linear, eq.times(load_constant(constants, multiplier_index), angular))
    else:
        _add_column(scratch, to, flags, linear, angular)


def _add_column(scratch, to, flags, linear, angular):
    if flags & 2:
        _add_six_vector(scratch, to, linear, angular)
    else:
        store_vector(scratch, to, linear)
        store_vector(scratch, to + 3, angular)


def _add_six_vector(scratch, to, linear, angular):
    store_vector(scratch, to, eq.plus(load_vector(scratch, to), linear))
    store_vector(scratch, to + 3, eq.plus(load_vector(scratch, to + 3), angular))


# -- pairs of columns ------------------------------------------------------------------------------------


def write_hessian(m, scratch, program, frame, sources, start, reference, state, to):
    count, nv = program[sources], program[_NV]
    first, end = sources + 1, sources + 1 + HESSIAN_COLUMN_WIDTH * count
    frames, size = program[_FRAMES], nv * nv
    begin = (start * frames + frame) * 6 * size
    for rate in range(nv):
        for j in range(first, end, HESSIAN_COLUMN_WIDTH):
            store_vector(scratch, program[j + 3], _zero_vector())
            store_vector(scratch, program[j + 3] + 3, _zero_vector())
        for i in range(first, end, HESSIAN_COLUMN_WIDTH):
            if program[i + 2] == rate:  # Mimic joints have the velocity index of the mimicked joint.
                _add_column_derivatives(scratch, program, i, first, end, reference)
        for row in range(6):
            at = begin + row * size + rate * nv
            write_rows(m, scratch, program, end + row * nv, nv, to, at, frames * 6 * size)


def _add_column_derivatives(scratch, program, i, first, end, reference):
    """Add the derivatives of column i with respect to each joint's motion.

    The joint of column i counts as an earlier joint.

    | reference frame | an earlier joint moves | a later joint moves |
    |---|---|---|
    | LOCAL_WORLD_ALIGNED | column i turns | the frame's origin moves |
    | WORLD | column i moves, the world's origin does not | no change |
    | LOCAL | no change: column i and the frame move as one rigid body | the frame moves |
    """
    v_i, w_i = load_vector(scratch, program[i]), load_vector(scratch, program[i] + 3)
    for j in range(first, end, HESSIAN_COLUMN_WIDTH):
        v_j, w_j, sum_j = (
            load_vector(scratch, program[j]),
            load_vector(scratch, program[j] + 3),
            program[j + 3],
        )
        before = program[j + 1] <= program[i + 1]
        if reference == _ALIGNED:
            if before:
                linear, angular = eq.derivative_by_earlier_joint(w_j, v_i, w_i)
                _add_six_vector(scratch, sum_j, linear, angular)
            else:
                _add_six_vector(scratch, sum_j, eq.derivative_by_later_joint(w_i, v_j), _zero_vector())
        elif reference == _WORLD and before:
            linear, angular = eq.motion_product(v_j, w_j, v_i, w_i)
            _add_six_vector(scratch, sum_j, linear, angular)
        elif reference == _LOCAL and not before:
            linear, angular = eq.motion_product(v_i, w_i, v_j, w_j)
            _add_six_vector(scratch, sum_j, linear, angular)
