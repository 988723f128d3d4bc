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
| `select_world_axes` | rotated by R | unchanged |
| `select_link_axes` | constant; the joint axis is (0, 0, 1) | rotated to the next link's axes |

For velocities and accelerations, the recursion uses the axes of the requested reference frame. A rotation of
the final result would add rounding errors. For Jacobians, the recursion uses world axes.

The placeholder `unused()` replaces each vector that a result does not need. Kernels contain no code for
operations with the placeholder. `urdfkin.compiled.machine.kernels` compiles copies of these functions with
the number types of `urdfkin.compiled.machine.numbers`.
"""

from __future__ import annotations

from urdfkin.compiled.plan import (
    ANGLE_ROW,
    ANGLE_WIDTH,
    INSTRUCTION_WIDTH,
    LANES,
    ONE_ROW,
    STATE_ROWS,
    ZERO_ROW,
    KernelArgs,
    Op,
    ProgramHeader,
)
from urdfkin.compiled.python_numbers import (
    add_squares,
    broadcast,
    doubles_at,
    integers_at,
    is_in_range,
    load_constant,
    load_number,
    load_number_if,
    one,
    read_rows,
    round_product,
    sine_cosine,
    store_number,
    stream,
    wait_for_writes,
    zero,
)
from urdfkin.kinematics import equations as eq

# Compiled code needs plain integers, not enumerations.
_PROGRAM, _CONSTANTS, _SCRATCH, _OUT = map(
    int, (KernelArgs.PROGRAM, KernelArgs.CONSTANTS, KernelArgs.SCRATCH, KernelArgs.OUT)
)
_N, _Q, _V, _A, _BASE = map(int, (KernelArgs.N, KernelArgs.Q, KernelArgs.V, KernelArgs.A, KernelArgs.BASE))
_STRIDE_Q, _STRIDE_V, _STRIDE_A, _STRIDE_BASE = map(
    int, (KernelArgs.STRIDE_Q, KernelArgs.STRIDE_V, KernelArgs.STRIDE_A, KernelArgs.STRIDE_BASE)
)
_REFERENCE, _OUTPUT_WIDTH, _BUFFER = map(
    int, (KernelArgs.REFERENCE, KernelArgs.OUTPUT_WIDTH, KernelArgs.BUFFER)
)
_CODE, _NQ, _NV, _ROW_Q, _ROW_V, _ROW_A, _ROW_BASE = map(
    int,
    (
        ProgramHeader.CODE,
        ProgramHeader.NQ,
        ProgramHeader.NV,
        ProgramHeader.Q,
        ProgramHeader.V,
        ProgramHeader.A,
        ProgramHeader.BASE,
    ),
)
_BLOCKS_Q, _BLOCKS_V, _BLOCKS_END = (
    int(ProgramHeader.BLOCKS_Q),
    int(ProgramHeader.BLOCKS_V),
    int(ProgramHeader.BLOCKS_END),
)
_ANGLES, _ANGLES_END = int(ProgramHeader.ANGLES), int(ProgramHeader.ANGLES_END)
_END, _TRANSLATE_X, _TRANSLATE_Y, _TRANSLATE_Z, _TRANSLATE = map(
    int, (Op.END, Op.TRANSLATE_X, Op.TRANSLATE_Y, Op.TRANSLATE_Z, Op.TRANSLATE)
)
_ROTATE_X, _ROTATE_Y, _ROTATE_Z, _ROTATE = map(int, (Op.ROTATE_X, Op.ROTATE_Y, Op.ROTATE_Z, Op.ROTATE))
_REVOLUTE, _PRISMATIC, _PLANAR, _FLOATING = map(int, (Op.REVOLUTE, Op.PRISMATIC, Op.PLANAR, Op.FLOATING))
_SAVE, _RESTORE, _STORE_AXIS, _COLUMN = map(int, (Op.SAVE, Op.RESTORE, Op.STORE_AXIS, Op.COLUMN))

# -- axes -------------------------------------------------------------------------------------------


def select_link_axes(in_link_axes, in_world_axes):
    return in_link_axes


def select_world_axes(in_link_axes, in_world_axes):
    return in_world_axes


def express(axes, R, x):
    """Convert x from link axes to the selected axes."""
    return axes(x, eq.rotate(R, x))


def express_after_rotation(axes, S, x):
    """Return S^T x in link axes, or x in world axes."""
    return axes(eq.rotate(eq.transposed(S), x), x)


# -- from one link to the next ------------------------------------------------------------------------


def translate_frame(axes, state, d):
    """Move the frame's origin by d, in link axes (7.58, 7.128, 7.130)."""
    R, p, w, vel, alpha, acc = state
    lever = express(axes, R, d)
    return (
        R,
        eq.point_position(p, R, d),
        w,
        eq.point_velocity(vel, w, lever),
        alpha,
        eq.point_acceleration(acc, alpha, w, lever),
    )


def rotate_frame(axes, state, S):
    """Rotate the frame by S: R becomes R S."""
    R, p, w, vel, alpha, acc = state
    return (
        eq.product(R, S),
        p,
        express_after_rotation(axes, S, w),
        express_after_rotation(axes, S, vel),
        express_after_rotation(axes, S, alpha),
        express_after_rotation(axes, S, acc),
    )


def _rotate_about_z(axes, state, scratch, row):
    """Rotate about z (7.5).

    Scratch row `row` contains the sine, and the next row contains the cosine.
    """
    return rotate_frame(
        axes, state, eq.about_z(load_number(scratch, row), load_number(scratch, row + 1), zero(), one())
    )


def after_revolute(axes, state, scratch, row, v, a):
    """Compute the state after a revolute joint (7.127, 7.129)."""
    R, p, w, vel, alpha, acc = state
    z = express(axes, R, (zero(), zero(), one()))
    alpha = eq.angular_acceleration(alpha, w, z, v, a)
    return _rotate_about_z(axes, (R, p, eq.angular_velocity(w, z, v), vel, alpha, acc), scratch, row)


def after_prismatic(axes, state, slide, v, a):
    """Compute the state after a prismatic joint (7.64, 7.128, 7.130)."""
    R, p, w, vel, alpha, acc = translate_frame(axes, state, (zero(), zero(), slide))
    z = express(axes, R, (zero(), zero(), one()))
    return R, p, w, eq.sliding_velocity(vel, z, v), alpha, eq.sliding_acceleration(acc, w, z, v, a)


def add_free_motion(axes, state, o, u, o_rate, u_rate):
    """Add the velocity and acceleration of a planar or floating joint.

    The vectors are in the child link's axes. The state must already contain the joint's displacement.
    """
    R, p, w, vel, alpha, acc = state
    o, u, o_rate, u_rate = (
        express(axes, R, o),
        express(axes, R, u),
        express(axes, R, o_rate),
        express(axes, R, u_rate),
    )
    return (
        R,
        p,
        eq.plus(w, o),
        eq.plus(vel, u),
        eq.free_angular_acceleration(alpha, w, o, o_rate),
        eq.free_acceleration(acc, w, o, u, u_rate),
    )


def _joint_coordinate(scratch, row, constants, rule, is_mimic):
    """Round the product and the sum of a mimic rule separately, as Pinocchio does."""
    x = load_number(scratch, row)
    if is_mimic:
        x = round_product(load_constant(constants, rule) * x) + load_constant(constants, rule + 1)
    return x


def _joint_rate(marker, scratch, row, constants, rule, is_mimic):
    x = load_number_if(marker, scratch, row)
    if is_mimic:
        x = round_product(load_constant(constants, rule) * x)
    return x


def _load_vector_if(marker, scratch, row):
    return (
        load_number_if(marker[0], scratch, row),
        load_number_if(marker[1], scratch, row + 1),
        load_number_if(marker[2], scratch, row + 2),
    )


def _after_planar(axes, state, scratch, q, row, v, a):
    state = translate_frame(axes, state, (load_number(scratch, q), load_number(scratch, q + 1), zero()))
    state = _rotate_about_z(axes, state, scratch, row)
    w, alpha = state[2][0], state[4][0]
    o, u = (
        (zero(), zero(), load_number_if(w, scratch, v + 2)),
        (load_number_if(w, scratch, v), load_number_if(w, scratch, v + 1), zero()),
    )
    o_rate = zero(), zero(), load_number_if(alpha, scratch, a + 2)
    return add_free_motion(
        axes,
        state,
        o,
        u,
        o_rate,
        (load_number_if(alpha, scratch, a), load_number_if(alpha, scratch, a + 1), zero()),
    )


def _after_floating(axes, state, scratch, q, v, a):
    state = translate_frame(
        axes, state, (load_number(scratch, q), load_number(scratch, q + 1), load_number(scratch, q + 2))
    )
    x, y, z, w = (
        load_number(scratch, q + 3),
        load_number(scratch, q + 4),
        load_number(scratch, q + 5),
        load_number(scratch, q + 6),
    )
    state = rotate_frame(axes, state, eq.rotation_of_quaternion(x, y, z, w))
    w, alpha = state[2], state[4]
    u, o = _load_vector_if(w, scratch, v), _load_vector_if(w, scratch, v + 3)
    return add_free_motion(
        axes, state, o, u, _load_vector_if(alpha, scratch, a + 3), _load_vector_if(alpha, scratch, a)
    )


def _shift_position(state, d):
    R, p, w, vel, alpha, acc = state
    return R, eq.plus(p, d), w, vel, alpha, acc


# -- constants -----------------------------------------------------------------------------------------


def _constant_vector(constants, i):
    return load_constant(constants, i), load_constant(constants, i + 1), load_constant(constants, i + 2)


def _constant_rotation(constants, i):
    return (
        _constant_vector(constants, i),
        _constant_vector(constants, i + 3),
        _constant_vector(constants, i + 6),
    )


# -- states in scratch memory --------------------------------------------------------------------------


def store_vector(scratch, row, x):
    store_number(scratch, row, x[0])
    store_number(scratch, row + 1, x[1])
    store_number(scratch, row + 2, x[2])


def load_vector(scratch, row):
    return load_number(scratch, row), load_number(scratch, row + 1), load_number(scratch, row + 2)


def _save_state(scratch, row, state):
    R, p, w, vel, alpha, acc = state
    store_vector(scratch, row, R[0])
    store_vector(scratch, row + 3, R[1])
    store_vector(scratch, row + 6, R[2])
    store_vector(scratch, row + 9, p)
    store_vector(scratch, row + 12, w)
    store_vector(scratch, row + 15, vel)
    store_vector(scratch, row + 18, alpha)
    store_vector(scratch, row + 21, acc)


def _restore_state(scratch, row, state):
    R, p, w, vel, alpha, acc = state
    return (
        (
            _load_vector_if(R[0], scratch, row),
            _load_vector_if(R[1], scratch, row + 3),
            _load_vector_if(R[2], scratch, row + 6),
        ),
        _load_vector_if(p, scratch, row + 9),
        _load_vector_if(w, scratch, row + 12),
        _load_vector_if(vel, scratch, row + 15),
        _load_vector_if(alpha, scratch, row + 18),
        _load_vector_if(acc, scratch, row + 21),
    )


# -- inputs --------------------------------------------------------------------------------------------


def _read_blocks(m, x, n, start, width, stride, blocks, begin, end, scratch, row):
    """Read whole blocks of eight numbers, because this is faster than reading single numbers.

    Surplus numbers are written to the scratch rows of the next input. If the next input is needed, it is read
    later and replaces the surplus numbers.
    """
    for i in range(begin, end):
        at = blocks[i]
        first, wide = start * stride + at, width - at
        if wide > 8 or first + (m - 1) * stride + 8 <= n * stride:
            wide = 8
        read_rows(m if stride else 1, x, first, stride, wide, scratch, row + at)


def _base_state(axes, m, scratch, args, row, start):
    nil, unit = broadcast(0.0), broadcast(1.0)
    R = (unit, nil, nil), (nil, unit, nil), (nil, nil, unit)
    p = w = vel = alpha = acc = nil, nil, nil
    if args[_BASE] != 0:
        base, stride = doubles_at(args[_BASE]), args[_STRIDE_BASE]
        read_rows(m if stride else 1, base, start * stride, stride, STATE_ROWS, scratch, row)
        R, p = (
            (load_vector(scratch, row), load_vector(scratch, row + 3), load_vector(scratch, row + 6)),
            load_vector(scratch, row + 9),
        )
        w, vel = (
            express_after_rotation(axes, R, load_vector(scratch, row + 12)),
            express_after_rotation(axes, R, load_vector(scratch, row + 15)),
        )
        alpha, acc = (
            express_after_rotation(axes, R, load_vector(scratch, row + 18)),
            express_after_rotation(axes, R, load_vector(scratch, row + 21)),
        )
    return R, p, w, vel, alpha, acc


def _sines_and_cosines(scratch, program, constants):
    """Compute all sines and cosines first, because the recursion needs all registers."""
    for i in range(program[_ANGLES], program[_ANGLES_END], ANGLE_WIDTH):
        angle = _joint_coordinate(scratch, program[i], constants, program[i + 2], program[i + 3])
        sine, cosine = sine_cosine(scratch, ANGLE_ROW, angle)
        store_number(scratch, program[i + 1], sine)
        store_number(scratch, program[i + 1] + 1, cosine)


# -- the recursion -------------------------------------------------------------------------------------


def _execute_transform(axes, op, state, constants, index):
    if op == _TRANSLATE_X:
        state = translate_frame(axes, state, (load_constant(constants, index), zero(), zero()))
    elif op == _TRANSLATE_Y:
        state = translate_frame(axes, state, (zero(), load_constant(constants, index + 1), zero()))
    elif op == _TRANSLATE_Z:
        state = translate_frame(axes, state, (zero(), zero(), load_constant(constants, index + 2)))
    elif op == _TRANSLATE:
        state = translate_frame(axes, state, _constant_vector(constants, index))
    elif op == _ROTATE_X:
        state = rotate_frame(
            axes,
            state,
            eq.about_x(
                load_constant(constants, index + 7), load_constant(constants, index + 4), zero(), one()
            ),
        )
    elif op == _ROTATE_Y:
        state = rotate_frame(
            axes,
            state,
            eq.about_y(load_constant(constants, index + 2), load_constant(constants, index), zero(), one()),
        )
    elif op == _ROTATE_Z:
        state = rotate_frame(
            axes,
            state,
            eq.about_z(load_constant(constants, index + 3), load_constant(constants, index), zero(), one()),
        )
    else:
        state = rotate_frame(axes, state, _constant_rotation(constants, index))
    return state


def _execute_joint(axes, op, state, scratch, x, v, a, z, constants, rule):
    """Return the state after a joint.

    | operand | content |
    |---|---|
    | x | scratch row of the sine (revolute) or of the first coordinate |
    | v, a | scratch rows of the joint's velocity and acceleration |
    | z | planar: scratch row of the sine; revolute, prismatic: 1 with a mimic rule, else 0 |
    | rule | index of the mimic rule's constants in `constants` |
    """
    if op == _REVOLUTE:
        rate, rate_2 = (
            _joint_rate(state[2][0], scratch, v, constants, rule, z),
            _joint_rate(state[4][0], scratch, a, constants, rule, z),
        )
        state = after_revolute(axes, state, scratch, x, rate, rate_2)
    elif op == _PRISMATIC:
        rate, rate_2 = (
            _joint_rate(state[2][0], scratch, v, constants, rule, z),
            _joint_rate(state[4][0], scratch, a, constants, rule, z),
        )
        state = after_prismatic(axes, state, _joint_coordinate(scratch, x, constants, rule, z), rate, rate_2)
    elif op == _PLANAR:
        state = _after_planar(axes, state, scratch, x, z, v, a)
    else:
        state = _after_floating(axes, state, scratch, x, v, a)
    return state


def _read_inputs(m, args, program, scratch, start, orders):
    q, n, nq, nv = doubles_at(args[_Q]), args[_N], program[_NQ], program[_NV]
    edge, end = program[_BLOCKS_V], program[_BLOCKS_END]
    _read_blocks(
        m, q, n, start, nq, args[_STRIDE_Q], program, program[_BLOCKS_Q], edge, scratch, program[_ROW_Q]
    )
    if orders > 1:
        v = doubles_at(args[_V])
        _read_blocks(m, v, n, start, nv, args[_STRIDE_V], program, edge, end, scratch, program[_ROW_V])
    if orders > 2:
        a = doubles_at(args[_A])
        _read_blocks(m, a, n, start, nv, args[_STRIDE_A], program, edge, end, scratch, program[_ROW_A])


def _add_input_squares(total, m, args, program, start, orders):
    total = _add_block_squares(total, m, doubles_at(args[_Q]), start, program[_NQ], args[_STRIDE_Q])
    if orders > 1:
        total = _add_block_squares(total, m, doubles_at(args[_V]), start, program[_NV], args[_STRIDE_V])
    if orders > 2:
        total = _add_block_squares(total, m, doubles_at(args[_A]), start, program[_NV], args[_STRIDE_A])
    return total


def _add_block_squares(total, m, x, start, width, stride):
    return add_squares(total, x, start * stride, (m if stride else 1) * width)


def _compute_block(
    axes,
    m,
    args,
    program,
    constants,
    scratch,
    start,
    reference,
    orders,
    state_for_output,
    store_axis,
    write_column,
    write_frame,
):
    _read_inputs(m, args, program, scratch, start, orders)
    _sines_and_cosines(scratch, program, constants)
    state = state_for_output(_base_state(axes, m, scratch, args, program[_ROW_BASE], start))
    at, buffer = program[_CODE], args[_BUFFER]
    to, first = (doubles_at(buffer), 0) if buffer else (doubles_at(args[_OUT]), start)
    if args[_BASE] == 0 and _TRANSLATE_X <= program[at] <= _TRANSLATE:
        # The base is at rest, so a translation from the base changes only the position.
        state = _shift_position(state, _constant_vector(constants, program[at + 4]))
        at += INSTRUCTION_WIDTH
    while program[at] != _END:
        op, x, y, z, index = program[at], program[at + 1], program[at + 2], program[at + 3], program[at + 4]
        at += INSTRUCTION_WIDTH
        if op <= _ROTATE:
            state = _execute_transform(axes, op, state, constants, index)
        elif op <= _FLOATING:
            state = _execute_joint(
                axes, op, state, scratch, x, program[_ROW_V] + y, program[_ROW_A] + y, z, constants, index
            )
        elif op == _SAVE:
            _save_state(scratch, x, state)
        elif op == _RESTORE:
            state = _restore_state(scratch, x, state)
        elif op == _STORE_AXIS:
            store_axis(scratch, x, y, state)
        elif op == _COLUMN:
            write_column(scratch, x, y, z, constants, index, reference, state)
        else:
            write_frame(m, scratch, program, x, y, first, reference, state, to)
    if buffer:
        width = args[_OUTPUT_WIDTH]
        stream(to, m * width, doubles_at(args[_OUT]), start * width, args[_OUT])


def forward_recursion(address, axes, orders, state_for_output, store_axis, write_column, write_frame):
    """Execute a program for every block of configurations.

    `orders` is the number of inputs: 1 (q), 2 (q, v) or 3 (q, v, a). Return 1 if an input is nan, inf or too
    large, else 0.
    """
    args = integers_at(address)
    program, constants, scratch = (
        integers_at(args[_PROGRAM]),
        doubles_at(args[_CONSTANTS]),
        doubles_at(args[_SCRATCH]),
    )
    store_number(scratch, ZERO_ROW, zero())
    store_number(scratch, ONE_ROW, one())
    n = args[_N]
    m = LANES if n >= LANES else 1
    total = broadcast(0.0)
    for first in range(0, n, m):
        start = min(first, n - m)  # The last two blocks may overlap.
        total = _add_input_squares(total, m, args, program, start, orders)
        _compute_block(
            axes,
            m,
            args,
            program,
            constants,
            scratch,
            start,
            args[_REFERENCE],
            orders,
            state_for_output,
            store_axis,
            write_column,
            write_frame,
        )
    if args[_BUFFER]:
        wait_for_writes()
    return 0 if is_in_range(total) else 1
