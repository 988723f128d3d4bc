"""The forward recursion of section 7.7 from the base outwards, link by link, for a block of configurations.

The state of a link consists of:

| symbol | quantity | axes |
|---|---|---|
| R, p | rotation and origin of the link's frame | world axes |
| w, vel | angular velocity, velocity of the origin | world or link axes, as `axes` selects |
| alpha, acc | angular acceleration, acceleration of the origin | world or link axes, as `axes` selects |

The axes of the recursion are those of the requested result, the world's or the link's own. A rotation at the
end would add the rounding of a second rotation. The equations are those of `urdfkin.kinematics.equations`;
they are the same in both axes.

A part of the state that an output does not need is `nothing`; it costs no time.

This module, `axes`, `outputs` and `recursions` are plain functions of Python's numbers. The kernels are
copies of them that use Numba's numbers (`urdfkin.compiled.machine.kernels`).
"""

from __future__ import annotations

from urdfkin.compiled.axes import seen, seen_after
from urdfkin.compiled.kernel_args import KernelArgs
from urdfkin.compiled.program import (
    ANGLE_ROW,
    ANGLE_WIDTH,
    LANES,
    ONE_ROW,
    STATE_ROWS,
    WIDTH,
    ZERO_ROW,
    Head,
    Op,
)
from urdfkin.compiled.python_numbers import (
    all_written,
    constant,
    fetch,
    number,
    number_if,
    numbers_at,
    one,
    ordinary,
    put,
    read_rows,
    rounded,
    same,
    sine_cosine,
    stream,
    whole_numbers_at,
    zero,
)
from urdfkin.kinematics import equations as eq

# Compiled code takes plain integers, not Python's enumerations.
_PROGRAM, _CONSTANTS, _SCRATCH, _OUT = map(
    int, (KernelArgs.PROGRAM, KernelArgs.CONSTANTS, KernelArgs.SCRATCH, KernelArgs.OUT)
)
_N, _Q, _V, _A, _BASE = map(int, (KernelArgs.N, KernelArgs.Q, KernelArgs.V, KernelArgs.A, KernelArgs.BASE))
_STRIDE_Q, _STRIDE_V, _STRIDE_A, _STRIDE_BASE = map(
    int, (KernelArgs.STRIDE_Q, KernelArgs.STRIDE_V, KernelArgs.STRIDE_A, KernelArgs.STRIDE_BASE)
)
_REFERENCE, _WIDTH, _STAGE = map(int, (KernelArgs.REFERENCE, KernelArgs.WIDTH, KernelArgs.STAGE))
_CODE, _NQ, _NV, _ROW_Q, _ROW_V, _ROW_A, _ROW_BASE = map(
    int, (Head.CODE, Head.NQ, Head.NV, Head.Q, Head.V, Head.A, Head.BASE)
)
_BLOCKS_Q, _BLOCKS_V, _BLOCKS_END = int(Head.BLOCKS_Q), int(Head.BLOCKS_V), int(Head.BLOCKS_END)
_ANGLES, _ANGLES_END = int(Head.ANGLES), int(Head.ANGLES_END)
_END, _CARRY_X, _CARRY_Y, _CARRY_Z, _CARRY = map(int, (Op.END, Op.CARRY_X, Op.CARRY_Y, Op.CARRY_Z, Op.CARRY))
_TURN_X, _TURN_Y, _TURN_Z, _TURN = map(int, (Op.TURN_X, Op.TURN_Y, Op.TURN_Z, Op.TURN))
_REVOLUTE, _PRISMATIC, _PLANAR, _FLOATING = map(int, (Op.REVOLUTE, Op.PRISMATIC, Op.PLANAR, Op.FLOATING))
_SAVE, _RESUME, _KEEP, _COLUMN = map(int, (Op.SAVE, Op.RESUME, Op.KEEP, Op.COLUMN))

# -- from one link to the next ------------------------------------------------------------------------


def carried(axes, state, d):
    """Move the state along the rigid link by d; d is given in the link's axes (7.58, 7.128, 7.130)."""
    R, p, w, vel, alpha, acc = state
    lever = seen(axes, R, d)
    return (
        R,
        eq.point_position(p, R, d),
        w,
        eq.point_velocity(vel, w, lever),
        alpha,
        eq.point_acceleration(acc, alpha, w, lever),
    )


def turned(axes, state, S):
    """Return the state of the same body with its frame rotated by S."""
    R, p, w, vel, alpha, acc = state
    return (
        eq.product(R, S),
        p,
        seen_after(axes, S, w),
        seen_after(axes, S, vel),
        seen_after(axes, S, alpha),
        seen_after(axes, S, acc),
    )


def _turned_about_z(axes, state, s, row):
    """Rotate the frame by a joint's angle (7.5); its sine and cosine are in `row` and the row after it."""
    return turned(axes, state, eq.about_z(number(s, row), number(s, row + 1), zero(), one()))


def revolute(axes, state, s, row, v, a):
    """Compute the state after a revolute joint: 7.129, then 7.127, then the rotation itself."""
    R, p, w, vel, alpha, acc = state
    z = seen(axes, R, (zero(), zero(), one()))
    alpha = eq.angular_acceleration(alpha, w, z, v, a)
    return _turned_about_z(axes, (R, p, eq.angular_velocity(w, z, v), vel, alpha, acc), s, row)


def prismatic(axes, state, slide, v, a):
    """Compute the state after a prismatic joint: 7.64 for its displacement, then 7.130 and 7.128."""
    R, p, w, vel, alpha, acc = carried(axes, state, (zero(), zero(), slide))
    z = seen(axes, R, (zero(), zero(), one()))
    return R, p, w, eq.sliding_velocity(vel, z, v), alpha, eq.sliding_acceleration(acc, w, z, v, a)


def free(axes, state, o, u, o_rate, u_rate):
    """Add the velocity of a planar or floating joint, in the child link's axes, after its displacement."""
    R, p, w, vel, alpha, acc = state
    o, u, o_rate, u_rate = seen(axes, R, o), seen(axes, R, u), seen(axes, R, o_rate), seen(axes, R, u_rate)
    return (
        R,
        p,
        eq.plus(w, o),
        eq.plus(vel, u),
        eq.free_angular_acceleration(alpha, w, o, o_rate),
        eq.free_acceleration(acc, w, o, u, u_rate),
    )


def _coordinate(s, row, g, c, follows):
    """Return a joint's coordinate; for a mimic joint, product and sum are each rounded, as in Pinocchio."""
    x = number(s, row)
    if follows:
        x = rounded(constant(g, c) * x) + constant(g, c + 1)
    return x


def _rate(wanted, s, row, g, c, follows):
    x = number_if(wanted, s, row)
    if follows:
        x = rounded(constant(g, c) * x)
    return x


def _vector_if(wanted, s, row):
    """Return the numbers of three consecutive rows; return `nothing()` if `wanted` is `nothing()`."""
    return number_if(wanted[0], s, row), number_if(wanted[1], s, row + 1), number_if(wanted[2], s, row + 2)


def _planar(axes, state, s, q, row, v, a):
    """Compute the state after a planar joint: translation along x and y, rotation about z."""
    state = carried(axes, state, (number(s, q), number(s, q + 1), zero()))
    state = _turned_about_z(axes, state, s, row)
    w, alpha = state[2][0], state[4][0]
    o, u = (zero(), zero(), number_if(w, s, v + 2)), (number_if(w, s, v), number_if(w, s, v + 1), zero())
    o_rate = zero(), zero(), number_if(alpha, s, a + 2)
    return free(axes, state, o, u, o_rate, (number_if(alpha, s, a), number_if(alpha, s, a + 1), zero()))


def _floating(axes, state, s, q, v, a):
    """Compute the state after a floating joint: translation along, and rotation about, all three axes."""
    state = carried(axes, state, (number(s, q), number(s, q + 1), number(s, q + 2)))
    x, y, z, w = number(s, q + 3), number(s, q + 4), number(s, q + 5), number(s, q + 6)
    state = turned(axes, state, eq.rotation_of_quaternion(x, y, z, w))
    w, alpha = state[2], state[4]
    u, o = _vector_if(w, s, v), _vector_if(w, s, v + 3)
    return free(axes, state, o, u, _vector_if(alpha, s, a + 3), _vector_if(alpha, s, a))


# -- constants -----------------------------------------------------------------------------------------


def _vector(g, i):
    return constant(g, i), constant(g, i + 1), constant(g, i + 2)


def _rotation(g, i):
    return _vector(g, i), _vector(g, i + 3), _vector(g, i + 6)


# -- states in scratch memory --------------------------------------------------------------------------


def put_vector(s, row, x):
    """Write a vector to three rows."""
    put(s, row, x[0])
    put(s, row + 1, x[1])
    put(s, row + 2, x[2])


def vector(s, row):
    """Return the vector in three rows."""
    return number(s, row), number(s, row + 1), number(s, row + 2)


def _save(s, row, state):
    R, p, w, vel, alpha, acc = state
    put_vector(s, row, R[0])
    put_vector(s, row + 3, R[1])
    put_vector(s, row + 6, R[2])
    put_vector(s, row + 9, p)
    put_vector(s, row + 12, w)
    put_vector(s, row + 15, vel)
    put_vector(s, row + 18, alpha)
    put_vector(s, row + 21, acc)


def _resume(s, row, state):
    """Return the saved state, without the parts that this recursion does not need."""
    R, p, w, vel, alpha, acc = state
    return (
        (_vector_if(R[0], s, row), _vector_if(R[1], s, row + 3), _vector_if(R[2], s, row + 6)),
        _vector_if(p, s, row + 9),
        _vector_if(w, s, row + 12),
        _vector_if(vel, s, row + 15),
        _vector_if(alpha, s, row + 18),
        _vector_if(acc, s, row + 21),
    )


# -- inputs --------------------------------------------------------------------------------------------


def _read(m, x, b, width, stride, blocks, begin, end, s, row):
    """Read the needed blocks of eight numbers from rows `b` to `b + m - 1` of x, or from its only row."""
    for i in range(begin, end):
        at = blocks[i]
        wide = width - at
        read_rows(m if stride else 1, x, b * stride + at, stride, 8 if wide > 8 else wide, s, row + at)
    fetch(x, (b + m) * stride, m * stride)


def _start(axes, m, s, task, row, b):
    """Return the initial conditions: the state of the base (motion of the textbook's frame 0 in -1)."""
    nil, unit = same(0.0), same(1.0)
    R = (unit, nil, nil), (nil, unit, nil), (nil, nil, unit)
    p = w = vel = alpha = acc = nil, nil, nil
    if task[_BASE] != 0:
        base, stride = numbers_at(task[_BASE]), task[_STRIDE_BASE]
        read_rows(m if stride else 1, base, b * stride, stride, STATE_ROWS, s, row)
        R, p = (vector(s, row), vector(s, row + 3), vector(s, row + 6)), vector(s, row + 9)
        w, vel = seen_after(axes, R, vector(s, row + 12)), seen_after(axes, R, vector(s, row + 15))
        alpha, acc = seen_after(axes, R, vector(s, row + 18)), seen_after(axes, R, vector(s, row + 21))
    return R, p, w, vel, alpha, acc


def _sines_and_cosines(s, program, g):
    """Compute sine and cosine of all joint angles in advance, because the recursion needs all registers."""
    for i in range(program[_ANGLES], program[_ANGLES_END], ANGLE_WIDTH):
        angle = _coordinate(s, program[i], g, program[i + 2], program[i + 3])
        sine, cosine = sine_cosine(s, ANGLE_ROW, angle)
        put(s, program[i + 1], sine)
        put(s, program[i + 1] + 1, cosine)


# -- the recursion -------------------------------------------------------------------------------------


def _along_link(axes, op, state, g, c):
    """Execute an instruction with a constant translation or rotation."""
    if op == _CARRY_X:
        state = carried(axes, state, (constant(g, c), zero(), zero()))
    elif op == _CARRY_Y:
        state = carried(axes, state, (zero(), constant(g, c + 1), zero()))
    elif op == _CARRY_Z:
        state = carried(axes, state, (zero(), zero(), constant(g, c + 2)))
    elif op == _CARRY:
        state = carried(axes, state, _vector(g, c))
    elif op == _TURN_X:
        state = turned(axes, state, eq.about_x(constant(g, c + 7), constant(g, c + 4), zero(), one()))
    elif op == _TURN_Y:
        state = turned(axes, state, eq.about_y(constant(g, c + 2), constant(g, c), zero(), one()))
    elif op == _TURN_Z:
        state = turned(axes, state, eq.about_z(constant(g, c + 3), constant(g, c), zero(), one()))
    else:
        state = turned(axes, state, _rotation(g, c))
    return state


def _over_joint(axes, op, state, s, x, v, a, z, g, c):
    """Execute a joint's instruction; x, z, c are operands, v and a are the rows of velocity, acceleration."""
    if op == _REVOLUTE:
        rate, rate_2 = _rate(state[2][0], s, v, g, c, z), _rate(state[4][0], s, a, g, c, z)
        state = revolute(axes, state, s, x, rate, rate_2)
    elif op == _PRISMATIC:
        rate, rate_2 = _rate(state[2][0], s, v, g, c, z), _rate(state[4][0], s, a, g, c, z)
        state = prismatic(axes, state, _coordinate(s, x, g, c, z), rate, rate_2)
    elif op == _PLANAR:
        state = _planar(axes, state, s, x, z, v, a)
    else:
        state = _floating(axes, state, s, x, v, a)
    return state


def _read_inputs(m, task, program, s, b, orders):
    """Read the coordinates and, if needed, the joint velocities and accelerations."""
    q, nq, nv = numbers_at(task[_Q]), program[_NQ], program[_NV]
    edge, end = program[_BLOCKS_V], program[_BLOCKS_END]
    _read(m, q, b, nq, task[_STRIDE_Q], program, program[_BLOCKS_Q], edge, s, program[_ROW_Q])
    if orders > 1:
        v = numbers_at(task[_V])
        _read(m, v, b, nv, task[_STRIDE_V], program, edge, end, s, program[_ROW_V])
    if orders > 2:
        a = numbers_at(task[_A])
        _read(m, a, b, nv, task[_STRIDE_A], program, edge, end, s, program[_ROW_A])


def _ordinary(m, task, program, b, orders):
    """Return whether all inputs of a block are ordinary, also those that the recursion does not need."""
    good = _rows_are_ordinary(m, numbers_at(task[_Q]), b, program[_NQ], task[_STRIDE_Q])
    if orders > 1:
        good = good and _rows_are_ordinary(m, numbers_at(task[_V]), b, program[_NV], task[_STRIDE_V])
    if orders > 2:
        good = good and _rows_are_ordinary(m, numbers_at(task[_A]), b, program[_NV], task[_STRIDE_A])
    return good


def _rows_are_ordinary(m, x, b, width, stride):
    return ordinary(x, b * stride, (m if stride else 1) * width)


def _block(axes, m, task, program, g, s, b, reference, orders, follow, keep, column, emit):
    """Run the recursion for `m` configurations, starting at `b`."""
    _read_inputs(m, task, program, s, b, orders)
    _sines_and_cosines(s, program, g)
    state = follow(_start(axes, m, s, task, program[_ROW_BASE], b))
    at, stage = program[_CODE], task[_STAGE]
    to, first = (numbers_at(stage), 0) if stage else (numbers_at(task[_OUT]), b)
    while program[at] != _END:
        op, x, y, z, c = program[at], program[at + 1], program[at + 2], program[at + 3], program[at + 4]
        at += WIDTH
        if op <= _TURN:
            state = _along_link(axes, op, state, g, c)
        elif op <= _FLOATING:
            state = _over_joint(axes, op, state, s, x, program[_ROW_V] + y, program[_ROW_A] + y, z, g, c)
        elif op == _SAVE:
            _save(s, x, state)
        elif op == _RESUME:
            state = _resume(s, x, state)
        elif op == _KEEP:
            keep(s, x, y, state)
        elif op == _COLUMN:
            column(s, x, y, z, g, c, reference, state)
        else:
            emit(m, s, program, x, y, first, reference, state, to)
    if stage:
        width = task[_WIDTH]
        stream(to, m * width, numbers_at(task[_OUT]), b * width, task[_OUT])


def forward_recursion(address, axes, orders, follow, keep, column, emit):
    """Execute a program for every block of configurations; return 0, or 1 if an input is not ordinary.

    Args:
        address: Address of the kernel's arguments (`kernel_args`).
        axes: `link_axes` or `world_axes`: the axes in which vectors are expressed.
        orders: Number of inputs that are read: 1 for q, 2 for q and v, 3 for q, v and a.
        follow: Replaces the parts of a state that the output does not need by `nothing()`.
        keep: Stores the data of a joint that are needed to compute the joint's column.
        column: Computes a column of the Jacobian, or of its derivative.
        emit: Writes the result of a frame.
    """
    task = whole_numbers_at(address)
    program, g, s = whole_numbers_at(task[_PROGRAM]), numbers_at(task[_CONSTANTS]), numbers_at(task[_SCRATCH])
    put(s, ZERO_ROW, zero())
    put(s, ONE_ROW, one())
    n = task[_N]
    m = LANES if n >= LANES else 1
    good = True
    for first in range(0, n, m):
        b = min(first, n - m)  # the last block may overlap the block before it
        _block(axes, m, task, program, g, s, b, task[_REFERENCE], orders, follow, keep, column, emit)
        good &= _ordinary(m, task, program, b, orders)
    if task[_STAGE]:
        all_written()
    return 0 if good else 1
