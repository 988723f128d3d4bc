"""The forward recursion of section 7.7 for a block of configurations: link by link, from the base outwards.

The state of a link consists of:

| symbol | quantity | axes |
|---|---|---|
| R, p | rotation and origin of the link's frame | world axes |
| w, vel | angular velocity, velocity of the origin | world or link axes, as `axes` selects |
| alpha, acc | angular acceleration, acceleration of the origin | world or link axes, as `axes` selects |

The textbook uses world axes. The rotation R of a link converts components in the link's axes to components in
world axes. The joint axis and the interorigin vector have constant components in the link's axes.

| `axes` | joint axis and interorigin vector | velocities and accelerations of the previous link |
|---|---|---|
| `world_axes` | rotated by R | unchanged |
| `link_axes` | constant; the joint axis is (0, 0, 1) | rotated to the next link's axes |

The recursion uses the axes in which the result is requested. A conversion of the result to other axes would
add the rounding errors of another rotation.

A vector that a result does not need is `nothing()` and costs no time. `urdfkin.compiled.machine.kernels`
compiles copies of these functions with Numba's number types.
"""

from __future__ import annotations

from urdfkin.compiled.plan import (
    ANGLE_ROW,
    ANGLE_WIDTH,
    LANES,
    ONE_ROW,
    STATE_ROWS,
    WIDTH,
    ZERO_ROW,
    Head,
    KernelArgs,
    Op,
)
from urdfkin.compiled.python_numbers import (
    add_squares,
    all_written,
    constant,
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
_SAVE, _RESUME, _STORE, _COLUMN = map(int, (Op.SAVE, Op.RESUME, Op.STORE, Op.COLUMN))

# -- axes -------------------------------------------------------------------------------------------


def link_axes(own, world):
    return own


def world_axes(own, world):
    return world


def seen(axes, R, x):
    """Convert a vector x from link axes to the axes that `axes` selects: link axes or world axes."""
    return axes(x, eq.rotate(R, x))


def seen_after(axes, S, x):
    """Return the components of a vector x after the link's frame is rotated by S; x itself stays the same."""
    return axes(eq.rotate(eq.transposed(S), x), x)


# -- from one link to the next ------------------------------------------------------------------------


def carried(axes, state, d):
    """Return the state of the link's point at `d` in link axes (7.58, 7.128, 7.130)."""
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
    """Return a link's state after the link's frame is rotated by S, so that R becomes R S.

    The motion of the link stays the same; only its components in link axes change.
    """
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
    """Rotate the frame about z (7.5); `row` and `row + 1` store the sine and the cosine."""
    return turned(axes, state, eq.about_z(number(s, row), number(s, row + 1), zero(), one()))


def revolute(axes, state, s, row, v, a):
    """Compute the state after a revolute joint (7.127, 7.129)."""
    R, p, w, vel, alpha, acc = state
    z = seen(axes, R, (zero(), zero(), one()))
    alpha = eq.angular_acceleration(alpha, w, z, v, a)
    return _turned_about_z(axes, (R, p, eq.angular_velocity(w, z, v), vel, alpha, acc), s, row)


def prismatic(axes, state, slide, v, a):
    """Compute the state after a prismatic joint (7.64, 7.128, 7.130)."""
    R, p, w, vel, alpha, acc = carried(axes, state, (zero(), zero(), slide))
    z = seen(axes, R, (zero(), zero(), one()))
    return R, p, w, eq.sliding_velocity(vel, z, v), alpha, eq.sliding_acceleration(acc, w, z, v, a)


def free(axes, state, o, u, o_rate, u_rate):
    """Add the velocity and the acceleration of a planar or floating joint to the state.

    The velocity and the acceleration are in the child link's axes. The state already contains the joint's
    translation and rotation.
    """
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
    """Return a joint's value; a mimic rule's product and sum are rounded separately, as in Pinocchio."""
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
    return number_if(wanted[0], s, row), number_if(wanted[1], s, row + 1), number_if(wanted[2], s, row + 2)


def _planar(axes, state, s, q, row, v, a):
    state = carried(axes, state, (number(s, q), number(s, q + 1), zero()))
    state = _turned_about_z(axes, state, s, row)
    w, alpha = state[2][0], state[4][0]
    o, u = (zero(), zero(), number_if(w, s, v + 2)), (number_if(w, s, v), number_if(w, s, v + 1), zero())
    o_rate = zero(), zero(), number_if(alpha, s, a + 2)
    return free(axes, state, o, u, o_rate, (number_if(alpha, s, a), number_if(alpha, s, a + 1), zero()))


def _floating(axes, state, s, q, v, a):
    state = carried(axes, state, (number(s, q), number(s, q + 1), number(s, q + 2)))
    x, y, z, w = number(s, q + 3), number(s, q + 4), number(s, q + 5), number(s, q + 6)
    state = turned(axes, state, eq.rotation_of_quaternion(x, y, z, w))
    w, alpha = state[2], state[4]
    u, o = _vector_if(w, s, v), _vector_if(w, s, v + 3)
    return free(axes, state, o, u, _vector_if(alpha, s, a + 3), _vector_if(alpha, s, a))


def _shifted(state, d):
    R, p, w, vel, alpha, acc = state
    return R, eq.plus(p, d), w, vel, alpha, acc


# -- constants -----------------------------------------------------------------------------------------


def _vector(g, i):
    return constant(g, i), constant(g, i + 1), constant(g, i + 2)


def _rotation(g, i):
    return _vector(g, i), _vector(g, i + 3), _vector(g, i + 6)


# -- states in scratch memory --------------------------------------------------------------------------


def put_vector(s, row, x):
    put(s, row, x[0])
    put(s, row + 1, x[1])
    put(s, row + 2, x[2])


def vector(s, row):
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


def _read(m, x, n, b, width, stride, blocks, begin, end, s, row):
    """Read the listed blocks of eight numbers of `m` configurations into scratch memory.

    A whole block is read faster than a part of a block. The last block of a configuration may therefore
    contain surplus numbers of the next configuration. Inputs that are read later may overwrite the surplus
    numbers. No instruction uses the other surplus numbers.
    """
    for i in range(begin, end):
        at = blocks[i]
        first, wide = b * stride + at, width - at
        if wide > 8 or first + (m - 1) * stride + 8 <= n * stride:
            wide = 8
        read_rows(m if stride else 1, x, first, stride, wide, s, row + at)


def _start(axes, m, s, task, row, b):
    """Return the motion of the base in the world, as the state of a link."""
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
    """Compute the sines and cosines of all joint angles before the recursion, which needs all registers."""
    for i in range(program[_ANGLES], program[_ANGLES_END], ANGLE_WIDTH):
        angle = _coordinate(s, program[i], g, program[i + 2], program[i + 3])
        sine, cosine = sine_cosine(s, ANGLE_ROW, angle)
        put(s, program[i + 1], sine)
        put(s, program[i + 1] + 1, cosine)


# -- the recursion -------------------------------------------------------------------------------------


def _along_link(axes, op, state, g, c):
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
    """Execute a joint's instruction.

    The scratch rows of the joint's velocity and acceleration are `v` and `a`. For a revolute joint, `x` is
    the scratch row of the sine; for other joints, `x` is the row of the first coordinate. For a planar joint,
    `z` is the scratch row of the sine. For a revolute or prismatic joint, `z` is 1 if a mimic rule changes
    the coordinate, else 0. The constants of the mimic rule begin at `g[c]`.
    """
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
    q, n, nq, nv = numbers_at(task[_Q]), task[_N], program[_NQ], program[_NV]
    edge, end = program[_BLOCKS_V], program[_BLOCKS_END]
    _read(m, q, n, b, nq, task[_STRIDE_Q], program, program[_BLOCKS_Q], edge, s, program[_ROW_Q])
    if orders > 1:
        v = numbers_at(task[_V])
        _read(m, v, n, b, nv, task[_STRIDE_V], program, edge, end, s, program[_ROW_V])
    if orders > 2:
        a = numbers_at(task[_A])
        _read(m, a, n, b, nv, task[_STRIDE_A], program, edge, end, s, program[_ROW_A])


def _squares(total, m, task, program, b, orders):
    total = _added(total, m, numbers_at(task[_Q]), b, program[_NQ], task[_STRIDE_Q])
    if orders > 1:
        total = _added(total, m, numbers_at(task[_V]), b, program[_NV], task[_STRIDE_V])
    if orders > 2:
        total = _added(total, m, numbers_at(task[_A]), b, program[_NV], task[_STRIDE_A])
    return total


def _added(total, m, x, b, width, stride):
    return add_squares(total, x, b * stride, (m if stride else 1) * width)


def _block(axes, m, task, program, g, s, b, reference, orders, mask, store, column, emit):
    _read_inputs(m, task, program, s, b, orders)
    _sines_and_cosines(s, program, g)
    state = mask(_start(axes, m, s, task, program[_ROW_BASE], b))
    at, stage = program[_CODE], task[_STAGE]
    to, first = (numbers_at(stage), 0) if stage else (numbers_at(task[_OUT]), b)
    if task[_BASE] == 0 and _CARRY_X <= program[at] <= _CARRY:
        # The base is at rest, so a translation as the first instruction changes only the position.
        state = _shifted(state, _vector(g, program[at + 4]))
        at += WIDTH
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
        elif op == _STORE:
            store(s, x, y, state)
        elif op == _COLUMN:
            column(s, x, y, z, g, c, reference, state)
        else:
            emit(m, s, program, x, y, first, reference, state, to)
    if stage:
        width = task[_WIDTH]
        stream(to, m * width, numbers_at(task[_OUT]), b * width, task[_OUT])


def forward_recursion(address, axes, orders, mask, store, column, emit):
    """Execute a program for every block; return 1 if an input is nan, infinite or too large, else 0.

    The address is that of the kernel's arguments (`KernelArgs`). The number `orders` is 1 for q, 2 for q and
    v, and 3 for q, v and a. `mask`, `store`, `column` and `emit` are functions of `urdfkin.compiled.outputs`.
    """
    task = whole_numbers_at(address)
    program, g, s = whole_numbers_at(task[_PROGRAM]), numbers_at(task[_CONSTANTS]), numbers_at(task[_SCRATCH])
    put(s, ZERO_ROW, zero())
    put(s, ONE_ROW, one())
    n = task[_N]
    m = LANES if n >= LANES else 1
    total = same(0.0)
    for first in range(0, n, m):
        b = min(first, n - m)  # The last block may overlap the block before it.
        total = _squares(total, m, task, program, b, orders)
        _block(axes, m, task, program, g, s, b, task[_REFERENCE], orders, mask, store, column, emit)
    if task[_STAGE]:
        all_written()
    return 0 if ordinary(total) else 1
