"""What every walk shares: its inputs, initial conditions, going on from saved state, frames fixed to a link.

Each kernel works through a batch in whole blocks of `LANES` configurations; `batch` cuts and fills them. The
same walk takes a single configuration, one lane wide: the number of lanes `m` is a constant in both.

`0 * b` is 0 to the compiler but not a literal to Numba, which would compile what it is handed to once more.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from urdfkin.recursion.base import STILL_STATE
from urdfkin.recursion.lanes import (
    LANES,
    copy_rows,
    jitted,
    lane_function,
    numbers_at,
    pointer_to,
    whole_numbers_at,
)
from urdfkin.recursion.plan import LARGE, OFFSET_WIDTH, STEP_WIDTH, Packed, Step
from urdfkin.recursion.rows import FRAME, ONE, STATE_ROWS, ZERO
from urdfkin.recursion.steps import carry, interorigin, turn_by_constant
from urdfkin.recursion.transposing import fetch_inputs, read_rows

# Enumerations are Python's; compiled code takes plain numbers.
_STEPS, _GEOMETRY, _FRAMES = int(Packed.STEPS), int(Packed.GEOMETRY), int(Packed.FRAMES)
_OFFSETS, _COLUMNS, _MULTIPLIERS = int(Packed.OFFSETS), int(Packed.COLUMNS), int(Packed.MULTIPLIERS)
_LEADERS, _SOURCES = int(Packed.LEADERS), int(Packed.SOURCES)
_BLOCKS_Q, _BLOCKS_V = int(Packed.BLOCKS_Q), int(Packed.BLOCKS_V)
_SIZES, _AREAS = int(Packed.STEP_COUNT), int(Packed.AREAS)
_SCRATCH, _COUNTS = int(Packed.SCRATCH), int(Packed.COUNTS)
REFERENCE = int(Packed.REFERENCE)
_RESUME, _SAVE = int(Step.RESUME), int(Step.SAVE)

_STILL = STILL_STATE[0].copy()


class Walk(NamedTuple):
    """A plan in a kernel: where its arrays lie, their sizes, and the first row of each area of scratch."""

    steps: Any
    geometry: Any
    frames: Any
    offsets: Any
    columns: Any
    multipliers: Any
    leaders: Any
    sources: Any
    blocks_q: Any
    blocks_v: Any
    step_count: int
    frame_count: int
    column_count: int
    block_count_q: int
    block_count_v: int
    nq: int
    nv: int
    q: int
    v: int
    a: int
    slots: int
    kept: int
    results: int


@lane_function
def walk_of(packed):
    """The plan that `Plan.packed` was made from."""
    return Walk(
        whole_numbers_at(packed[_STEPS]),
        numbers_at(packed[_GEOMETRY]),
        whole_numbers_at(packed[_FRAMES]),
        numbers_at(packed[_OFFSETS]),
        whole_numbers_at(packed[_COLUMNS]),
        numbers_at(packed[_MULTIPLIERS]),
        whole_numbers_at(packed[_LEADERS]),
        whole_numbers_at(packed[_SOURCES]),
        whole_numbers_at(packed[_BLOCKS_Q]),
        whole_numbers_at(packed[_BLOCKS_V]),
        packed[_SIZES],
        packed[_SIZES + 1],
        packed[_SIZES + 2],
        packed[_SIZES + 3],
        packed[_SIZES + 4],
        packed[_SIZES + 5],
        packed[_SIZES + 6],
        packed[_AREAS],
        packed[_AREAS + 1],
        packed[_AREAS + 2],
        packed[_AREAS + 3],
        packed[_AREAS + 4],
        packed[_AREAS + 5],
    )


@lane_function
def read_input(m, s, x, b, width, blocks, count, row):
    """The numbers that the walk needs of `m` rows of x (n, width), from row `b` on, into rows of lanes."""
    for block in range(count):
        at = blocks[block]
        wide = width - at
        read_rows(m, x, b * width + at, width, 8 if wide > 8 else wide, s, row + at)
    fetch_inputs(m, x, (b + m) * width, m * width)


@lane_function
def read_inputs(m, s, plan, b, q, v, a, order):
    """Coordinates, and the rates that motion of this order takes."""
    read_input(m, s, q, b, plan.nq, plan.blocks_q, plan.block_count_q, plan.q)
    if order >= 1:
        read_input(m, s, v, b, plan.nv, plan.blocks_v, plan.block_count_v, plan.v)
    if order >= 2:
        read_input(m, s, a, b, plan.nv, plan.blocks_v, plan.block_count_v, plan.a)


@lane_function
def rows_of(order):
    """How much of the state motion of this order has."""
    return 12 if order == 0 else (18 if order == 1 else 24)


@lane_function
def start(m, s, plan, b, base, stride, order):
    """The initial conditions: the state of the base (the text's frame -1 to frame 0), rows `stride` apart."""
    rows = rows_of(order)
    for r in range(rows):
        if stride == 0:  # one number for all lanes
            number = base[r]
            for k in range(m):
                s[r * LANES + k] = number
        else:
            for k in range(m):
                s[r * LANES + k] = base[(b + k) * stride + r]
    for k in range(m):
        s[ZERO * LANES + k] = 0.0
        s[ONE * LANES + k] = 1.0
    copy_rows(m, s, 0, plan.slots, rows)


@lane_function
def scratch_of(packed):
    """The scratch array of a kernel for one configuration."""
    return numbers_at(packed[_SCRATCH])


@lane_function
def counted(packed, which, good):
    """What a kernel for one configuration answers; it counts what it has computed."""
    packed[_COUNTS + which] += good
    return good


@lane_function
def still_base():
    """The state of a base that stands still at the world's origin."""
    return pointer_to(_STILL)


@lane_function
def stride_of(base):
    """From the base's state in one configuration to that in the next; 0 where it is the same for all."""
    return 0 if base.shape[0] == 1 else base.shape[1]


@lane_function
def resume(m, s, plan, i, rows):
    """Go on from saved state where the plan says so."""
    if plan.steps[STEP_WIDTH * i + _RESUME] >= 0:
        copy_rows(m, s, plan.slots + STATE_ROWS * plan.steps[STEP_WIDTH * i + _RESUME], 0, rows)


@lane_function
def save(m, s, plan, i, rows):
    """Save the state where a later step goes on from it."""
    if plan.steps[STEP_WIDTH * i + _SAVE] >= 0:
        copy_rows(m, s, 0, plan.slots + STATE_ROWS * plan.steps[STEP_WIDTH * i + _SAVE], rows)


@lane_function
def frame_state(m, s, plan, f, order, turned):
    """The state of a frame that is fixed to the present link; its rotation only where it is `turned`."""
    copy_rows(m, s, 0, FRAME, rows_of(order))
    at = OFFSET_WIDTH * f
    interorigin(m, s, plan.offsets, at)
    carry(m, s, FRAME, order)
    if turned:
        turn_by_constant(m, s, FRAME, plan.offsets, at)


@jitted(forceinline=True, fastmath={"reassoc"})
def ordinary(x, at, count):
    """Whether `count` numbers are: none that is no number or infinite, and their sizes no more than `LARGE`.

    The order of this sum is left to the compiler.
    """
    total = 0.0
    for i in range(count):
        total += abs(x[at + i])
    return total < LARGE
