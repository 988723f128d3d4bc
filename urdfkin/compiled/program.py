"""A plan as a program: the few instructions that a kernel carries out for every block of configurations.

What is known of the robot is told apart here, once: an offset along one axis and a turn about one axis have
instructions of their own, which cost a third of the general ones; what is zero costs nothing. The walk goes
on from one link to the next in registers; where the tree branches, the state is saved and resumed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from urdfkin.compiled.plan import Column, CompiledTree, Geometry, IntArray, Motion, Step
from urdfkin.model.tree import FloatArray


class Op(IntEnum):
    """The instructions; those with an axis have it in their order: along or about x, y, z, or any."""

    END = 0
    CARRY_X = 1  # along a rigid link
    CARRY_Y = 2
    CARRY_Z = 3
    CARRY = 4
    TURN_X = 5  # by a constant rotation
    TURN_Y = 6
    TURN_Z = 7
    TURN = 8
    REVOLUTE = 9
    PRISMATIC = 10
    PLANAR = 11
    FLOATING = 12
    SAVE = 13
    RESUME = 14
    KEEP = 15  # what a column of the Jacobian needs of its joint
    COLUMN = 16
    EMIT = 17


class Head(IntEnum):
    """What stands before the instructions, one number each."""

    CODE = 0  # where the first instruction stands
    NQ = 1
    NV = 2
    FRAMES = 3
    BLOCKS_Q = 4  # where the list of blocks of eight coordinates begins of which some are needed
    BLOCKS_V = 5
    BLOCKS_END = 6
    ANGLES = 7  # where the list of angles begins
    ANGLES_END = 8
    Q = 9  # rows of scratch where the coordinates begin, and so on
    V = 10
    A = 11
    BASE = 12


#: Numbers in an instruction: what, three operands, and where its constants begin.
WIDTH = 5
#: Numbers of an angle: its row, that of its sine, where a follower's rule begins, and whether there is one.
ANGLE_WIDTH = 4
#: Rows of scratch with a place of their own: 0, 1, a result on its way out, an angle.
ZERO_ROW, ONE_ROW, OUT_ROW, ANGLE_ROW, FIRST_ROW = 0, 1, 2, 18, 19
STATE_ROWS, KEPT_ROWS, COLUMN_ROWS = 24, 12, 6
#: Numbers of a column that is paired with others: its row, its step, its rate, the row of the rate's sums.
PAIR_WIDTH = 4

_JOINTS = {
    Motion.TURN: Op.REVOLUTE,
    Motion.SLIDE: Op.PRISMATIC,
    Motion.PLANAR: Op.PLANAR,
    Motion.FLOATING: Op.FLOATING,
}


@dataclass(frozen=True, eq=False)
class Program:
    """What a kernel is handed.

    Attributes:
        words: Head, lists and instructions.
        constants: What the instructions refer to.
        rows: How many rows of scratch a run needs.
    """

    words: IntArray
    constants: FloatArray
    rows: int

    @cached_property
    def addresses(self) -> tuple[int, int]:
        """Of words and constants; good while the program lives."""
        return self.words.ctypes.data, self.constants.ctypes.data


def program_of(plan: CompiledTree, *, turned: bool, columns: bool = False, pairs: bool = False) -> Program:
    """The program that meets a plan's frames, made once.

    Args:
        plan: The walk.
        turned: Whether frames are turned to their own axes: for places, and for what is seen in these axes.
        columns: Whether Jacobians are wanted.
        pairs: Whether their columns are wanted one by one, followers' too, to be paired with each other.
    """
    key = turned, columns, pairs
    made: Program | None = plan.made.get(key)
    if made is None:
        made = plan.made[key] = _Writer(plan, *key).program()
    return made


class _Writer:
    def __init__(self, plan: CompiledTree, turned: bool, columns: bool, pairs: bool) -> None:
        self.plan, self.turned, self.columns, self.pairs = plan, turned, columns, pairs
        self.code: list[tuple[int, int, int, int, int]] = []
        self.constants: list[float] = [0.0]
        self.slots: dict[int, int] = {}
        self.q = FIRST_ROW
        self.v = self.q + plan.nq
        self.a = self.v + plan.nv
        self.base = self.a + plan.nv
        self.sines = self.base + STATE_ROWS
        self.kept = self.sines + 2 * len(plan.steps)
        self.results = self.kept + KEPT_ROWS * len(plan.columns) * columns
        self.sums = self.results + COLUMN_ROWS * len(plan.columns) * columns
        self.saved = self.sums + COLUMN_ROWS * len(plan.columns) * pairs
        self.rules = [self._rule(i) for i in range(len(plan.steps))]
        parts = _blocks(plan.places_q), _blocks(plan.columns[:, Column.V].tolist()), self._angles()
        self.lists = [number for part in parts for number in part]
        begins = np.cumsum([len(Head), *map(len, parts)]).tolist()
        lists = [*begins[:3], begins[2], begins[3]]
        self.head = [0, plan.nq, plan.nv, len(plan.frames), *lists, self.q, self.v, self.a, self.base]

    def program(self) -> Program:
        self._write()
        self._put(Op.END)
        rows = self.saved + STATE_ROWS * len(self.slots)
        self.head[Head.CODE] = len(self.head) + len(self.lists)
        words = [*self.head, *self.lists, *(word for line in self.code for word in line)]
        return Program(np.array(words, dtype=np.int64), np.array(self.constants), rows)

    def _write(self) -> None:
        """Steps and frames in the order in which they are met."""
        events = list(self._events())
        last = {origin: k for k, (origin, _, _) in enumerate(events)}
        now, c = -1, 0
        self._save(-1, last, 0)
        for k, (origin, step, frame) in enumerate(events):
            if now != origin:
                self._put(Op.RESUME, self._slot(origin))
            if step is not None:
                self._step(step)
                now = step
                while (
                    self.columns and c < len(self.plan.columns) and self.plan.columns[c, Column.STEP] == step
                ):
                    self._put(Op.KEEP, self.kept + KEPT_ROWS * c, int(self.plan.columns[c, Column.AXIS]))
                    c += 1
                self._save(step, last, k + 1)
            elif frame is not None and self._frame(frame):
                now = -2  # the state is the frame's now

    def _events(self) -> Iterator[tuple[int, int | None, int | None]]:
        """(the step it goes on from, the step or None, the frame or None)."""
        f = 0
        for i in range(-1, len(self.plan.steps)):
            if i >= 0:
                yield int(self.plan.parents[i]), i, None
            while f < len(self.plan.frames) and self.plan.frames[f, 0] == i:
                yield i, None, f
                f += 1

    def _save(self, step: int, last: Mapping[int, int], following: int) -> None:
        """Save the state that was just reached, if something goes on from it after the following event."""
        if last.get(step, -1) > following:
            self._put(Op.SAVE, self._slot(step))

    def _slot(self, step: int) -> int:
        return self.saved + STATE_ROWS * self.slots.setdefault(step, len(self.slots))

    def _put(self, op: Op, *operands: int, at: int = 0) -> None:
        x, y, z = (*operands, 0, 0, 0)[:3]
        self.code.append((int(op), x, y, z, at))

    def _constants(self, *numbers: float) -> int:
        self.constants += map(float, numbers)
        return len(self.constants) - len(numbers)

    def _rigid(self, R: FloatArray, p: FloatArray, *, turned: bool = True) -> bool:
        """Along a rigid link by p, then turned by R; whether that is anything."""
        before = len(self.code)
        along = np.flatnonzero(p).tolist()
        if along:
            op = Op.CARRY_X + along[0] if len(along) == 1 else Op.CARRY
            self._put(Op(op), at=self._constants(*p))
        if turned and (np.eye(3) != R).any():
            about = [axis for axis in range(3) if _leaves_alone(R, axis)]
            self._put(Op(Op.TURN_X + about[0]) if about else Op.TURN, at=self._constants(*R.ravel()))
        return len(self.code) > before

    def _rule(self, i: int) -> int:
        """Where a follower's multiplier and offset stand; 0 for a joint that leads."""
        multiplier, constant = self.plan.geometry[i, Geometry.MULTIPLIER :].tolist()
        return 0 if (multiplier, constant) == (1.0, 0.0) else self._constants(multiplier, constant)

    def _angles(self) -> list[int]:
        """The angles that steps turn by."""
        angles = []
        for i, step in enumerate(self.plan.steps):
            kind, q = Motion(step[Step.KIND]), self.q + int(step[Step.Q])
            if kind in (Motion.TURN, Motion.PLANAR):
                angles += [
                    q + 2 * (kind is Motion.PLANAR),
                    self.sines + 2 * i,
                    self.rules[i],
                    int(self.rules[i] > 0),
                ]
        return angles

    def _step(self, i: int) -> None:
        geometry, step = self.plan.geometry[i], self.plan.steps[i]
        self._rigid(geometry[:9].reshape(3, 3), geometry[Geometry.OFFSET : Geometry.MULTIPLIER])
        op, rule, sine = _JOINTS[Motion(step[Step.KIND])], self.rules[i], self.sines + 2 * i
        first = sine if op is Op.REVOLUTE else self.q + int(step[Step.Q])
        self._put(op, first, int(step[Step.V]), sine if op is Op.PLANAR else int(rule > 0), at=rule)

    def _frame(self, f: int) -> bool:
        """Go to a frame, hand out its results, and whether the state is now another."""
        plan, offsets = self.plan, self.plan.offsets[f]
        moved = self._rigid(offsets[:9].reshape(3, 3), offsets[9:], turned=self.turned)
        sources = 0
        if self.columns:
            self._columns(f)
            sources = len(self.head) + len(self.lists)
            self.lists += self._paired(f) if self.pairs else self._sources(f, self.results)
        self._put(Op.EMIT, int(plan.frames[f, 1]), sources)
        return moved

    def _columns(self, f: int) -> None:
        for c, leader in enumerate(self.plan.leaders[f].tolist()):
            if leader >= 0:
                multiplier = float(self.plan.multipliers[c])
                follows = 0 if multiplier == 1.0 else self._constants(multiplier)
                to = c if self.pairs else leader
                how = int(self.plan.columns[c, Column.TURNS]) + 2 * (to != c)
                rows = self.kept + KEPT_ROWS * c, self.results + COLUMN_ROWS * to
                self._put(Op.COLUMN, *rows, how, at=follows)

    def _sources(self, f: int, row: int) -> list[int]:
        """For each number of the frame's (6, nv), the row of scratch that holds it; `row` is the first."""
        plan = self.plan
        sources = np.full((6, plan.nv), ZERO_ROW, dtype=np.int64)
        for c in np.flatnonzero(plan.leaders[f] == np.arange(len(plan.columns))):
            sources[:, plan.columns[c, Column.V]] = row + COLUMN_ROWS * c + np.arange(6)
        found: list[int] = sources.ravel().tolist()
        return found

    def _paired(self, f: int) -> list[int]:
        """How many columns the frame has, each of them (`PAIR_WIDTH`), and where its sums stand."""
        columns, leaders = self.plan.columns, self.plan.leaders[f]
        own = np.flatnonzero(leaders >= 0)
        rows = self.results + COLUMN_ROWS * own, self.sums + COLUMN_ROWS * leaders[own]
        pairs = np.column_stack((rows[0], columns[own, Column.STEP], columns[own, Column.V], rows[1]))
        return [len(own), *pairs.ravel().tolist(), *self._sources(f, self.sums)]


def _leaves_alone(R: FloatArray, axis: int) -> bool:
    """Whether it is a turn about this axis, to the last bit."""
    one = np.eye(3)[axis]
    return bool((R[axis] == one).all() and (R[:, axis] == one).all())


def _blocks(places: Sequence[int]) -> list[int]:
    """Where the blocks of eight begin that hold any of the places."""
    return sorted({int(place) // 8 * 8 for place in places})
