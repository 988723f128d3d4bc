"""What the recursion does for a tree, as plain arrays: one step a moving joint, one row a frame.

Every joint frame is turned so that its axis is z (`A` below), as in the text: then each revolute joint is
Rz and each prismatic one Tz. Fixed joints are folded into the offsets. A plan for one frame holds the
frame's ancestors alone; a plan for several frames holds every joint one of them needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.recursion import rows
from urdfkin.rotation.aligning import axis_aligning
from urdfkin.tree import FloatArray, Joint, JointKind, KinematicTree

IntArray = NDArray[np.int64]


#: Where coordinates, rates, lengths and multipliers are smaller than this, no result overflows: with N joints
#: a rate is less than LARGE^2, the path N LARGE^2, and so w^2 d, the largest product, N^3 LARGE^6.
LARGE = 1e45


class Step(IntEnum):
    """Columns of `Plan.steps` (whole numbers)."""

    KIND = 0
    RESUME = 1
    SAVE = 2
    Q = 3
    V = 4


class Packed(IntEnum):
    """Entries of `Plan.packed`: addresses of the plan's arrays, then their sizes, then rows of scratch.

    Kernels for one configuration find more behind them: the address of their scratch array, the reference,
    and how often they have computed a placement, velocity, acceleration and Jacobian.
    """

    STEPS = 0
    GEOMETRY = 1
    FRAMES = 2
    OFFSETS = 3
    COLUMNS = 4
    MULTIPLIERS = 5
    LEADERS = 6
    SOURCES = 7
    BLOCKS_Q = 8
    BLOCKS_V = 9
    STEP_COUNT = 10
    FRAME_COUNT = 11
    COLUMN_COUNT = 12
    BLOCK_COUNT_Q = 13
    BLOCK_COUNT_V = 14
    NQ = 15
    NV = 16
    AREAS = 17
    SCRATCH = 24
    REFERENCE = 25
    COUNTS = 26


class Motion(IntEnum):
    """What a step does; the value in column `Step.KIND`."""

    TURN = 0
    SLIDE = 1
    PLANAR = 2
    FLOATING = 3


class Geometry(IntEnum):
    """Columns of `Plan.geometry`: R (9), the offset in the new axes (3), then the mimic rule."""

    R = 0
    OFFSET = 9
    MULTIPLIER = 12
    CONSTANT = 13


class Column(IntEnum):
    """Columns of `Plan.columns`: a column of eq. 7.85 each row."""

    STEP = 0
    AXIS = 1
    TURNS = 2
    V = 3


#: Numbers in a row of `Plan.steps`, `geometry`, `offsets` and `columns`.
STEP_WIDTH, GEOMETRY_WIDTH, OFFSET_WIDTH = len(Step), int(Geometry.CONSTANT) + 1, 12
COLUMN_WIDTH = len(Column)


_MOTION = {
    JointKind.REVOLUTE: Motion.TURN,
    JointKind.CONTINUOUS: Motion.TURN,
    JointKind.PRISMATIC: Motion.SLIDE,
    JointKind.PLANAR: Motion.PLANAR,
    JointKind.FLOATING: Motion.FLOATING,
}

#: Which axis of the moved frame each rate of a joint acts along, and whether it turns about it.
_RATES: dict[Motion, tuple[tuple[int, bool], ...]] = {
    Motion.TURN: ((2, True),),
    Motion.SLIDE: ((2, False),),
    Motion.PLANAR: ((0, False), (1, False), (2, True)),
    Motion.FLOATING: ((0, False), (1, False), (2, False), (0, True), (1, True), (2, True)),
}


@dataclass(frozen=True, eq=False)
class Plan:
    """The steps of a walk from the base outwards, and the frames met on the way.

    Attributes:
        nq: Length of `q`.
        nv: Length of `v` and `a`.
        joints: The moving joint of each step, as an index into the tree's joints.
        steps: (steps, 5) whole numbers, columns `Step`. RESUME is -1 to go on from the step before, else
            the slot of saved state to go on from; SAVE is the slot to save this step's state in, or -1.
        geometry: (steps, 14), columns `Geometry`.
        slots: How many slots of saved state the walk needs; slot 0 holds the base.
        frames: (frames, 2): the step after which a frame is met (-1: the base), and its place in the
            output; ordered by step.
        offsets: (frames, 12): rotation (9) and offset (3) from the step's frame to the frame, the offset
            in the axes of the step.
        columns: (columns, 4), columns `Column`: every rate of every step.
        multipliers: (columns,) the mimic multiplier of each column.
        leaders: (frames, columns): -1 where the column is not the frame's ancestor, else the column that
            it is added to: itself, but for followers.
        sources: (frames, 6 * nv): for each number of a frame's Jacobian, the row of scratch that holds it.
        blocks_q: Where the blocks of eight coordinates begin of which the walk needs at least one.
        blocks_v: The same for rates.
        parents: (steps,) the step that each step goes on from, -1 for the base.
        lengths: (steps + frames,) metres: the sum of the lengths of all URDF offsets, fixed joints' too,
            from a step's parent to it, then from a frame's step to the frame (in the order of `frames`).
        depth: (frames,) in output order, how many URDF joints lie between a frame and the root.
        tilts: (frames,) likewise, rad: their `Joint.tilt` added up.
    """

    nq: int
    nv: int
    joints: tuple[int, ...]
    steps: IntArray
    geometry: FloatArray
    slots: int
    frames: IntArray
    offsets: FloatArray
    columns: IntArray
    multipliers: FloatArray
    leaders: IntArray
    sources: IntArray
    blocks_q: IntArray
    blocks_v: IntArray
    parents: IntArray
    lengths: FloatArray
    depth: IntArray
    tilts: FloatArray

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value = np.ascontiguousarray(value)
                object.__setattr__(self, field.name, value)
                value.setflags(write=False)

    @cached_property
    def areas(self) -> rows.Areas:
        """Where the rows of scratch begin that depend on the plan."""
        return rows.areas(self.nq, self.nv, self.slots, len(self.columns))

    @cached_property
    def is_large(self) -> bool:
        """Whether results may overflow although coordinates and rates are ordinary."""
        numbers = self.geometry, self.offsets, self.lengths
        return any(float(np.abs(x).max(initial=0.0)) >= LARGE for x in numbers)

    @cached_property
    def packed(self) -> IntArray:
        """Everything a kernel needs, as one array: handing over each array by itself costs more than a step.

        It holds addresses, and is good while the plan lives.
        """
        arrays = (
            self.steps, self.geometry, self.frames, self.offsets, self.columns, self.multipliers,
            self.leaders, self.sources, self.blocks_q, self.blocks_v,
        )  # fmt: skip
        sizes = (
            len(self.steps), len(self.frames), len(self.columns), len(self.blocks_q), len(self.blocks_v),
            self.nq, self.nv,
        )  # fmt: skip
        return np.array([*(array.ctypes.data for array in arrays), *sizes, *self.areas], dtype=np.int64)

    def __reduce__(self) -> tuple[type[Plan], tuple[Any, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))


def make_plan(tree: KinematicTree, links: Sequence[int]) -> Plan:
    """The walk that meets the frames of the given links.

    Args:
        tree: The robot.
        links: Indices into `tree.links`, in the order in which results are wanted.
    """
    paths = [tree.path(link) for link in links]
    needed = sorted({i for path in paths for i in path if tree.joints[i].kind.nv})
    step_of_joint = {joint: step for step, joint in enumerate(needed)}
    anchors = _anchors(tree, step_of_joint, {i for path in paths for i in path})
    steps, geometry = _steps(tree, needed, anchors)
    parents = [anchors[tree.joints[i].parent].step for i in needed]
    slots = _slots(steps, parents)
    columns, multipliers = _columns(steps, geometry)
    ancestors = [{step_of_joint[i] for i in path if i in step_of_joint} for path in paths]
    leaders = _leaders(columns, ancestors)
    places = zip(steps[:, Step.Q].tolist(), needed, strict=True)
    layout = rows.areas(tree.nq, tree.nv, slots, len(columns))
    order = sorted(range(len(links)), key=lambda place: anchors[links[place]].step)
    ends = [anchors[links[place]] for place in order]
    return Plan(
        nq=tree.nq,
        nv=tree.nv,
        joints=tuple(needed),
        steps=steps,
        geometry=geometry,
        slots=slots,
        frames=np.array(
            [[end.step, place] for end, place in zip(ends, order, strict=True)], dtype=np.int64
        ).reshape(-1, 2),
        offsets=np.array([(*end.T[:3, :3].ravel(), *end.T[:3, 3]) for end in ends]).reshape(-1, 12),
        columns=columns,
        multipliers=multipliers,
        leaders=leaders[order],
        sources=_sources(columns, leaders[order], layout.results, tree.nv),
        blocks_q=_blocks(at + c for at, i in places for c in range(tree.joints[i].kind.nq)),
        blocks_v=_blocks(columns[:, Column.V]),
        parents=np.array(parents, dtype=np.int64),
        lengths=np.array(
            [anchors[tree.joints[i].parent].length + _length(tree.joints[i]) for i in needed]
            + [end.length for end in ends]
        ),
        depth=np.array([len(path) for path in paths], dtype=np.int64),
        tilts=np.array([math.fsum(tree.joints[i].tilt for i in path) for path in paths]),
    )


class _Anchor(NamedTuple):
    """Where a link hangs: its step (-1: the base), its pose in that step's turned frame, and how far off."""

    step: int
    T: FloatArray
    length: float


def _anchors(tree: KinematicTree, step_of_joint: dict[int, int], wanted: set[int]) -> dict[int, _Anchor]:
    anchors = {0: _Anchor(-1, np.eye(4), 0.0)}
    for i in sorted(wanted):
        joint = tree.joints[i]
        if i in step_of_joint:
            anchors[i + 1] = _Anchor(step_of_joint[i], turned(joint).T, 0.0)
        else:
            parent = anchors[joint.parent]
            anchors[i + 1] = _Anchor(
                parent.step, parent.T @ joint.T_parent_joint, parent.length + _length(joint)
            )
    return anchors


def _length(joint: Joint) -> float:
    # hypot neither under- nor overflows where squares would: a URDF may hold 1e-200 or 1e200.
    return math.hypot(*joint.T_parent_joint[:3, 3].tolist())


def turned(joint: Joint) -> FloatArray:
    """(4, 4) `A`: the pose, in the joint's URDF frame, of the frame whose z is the joint's axis."""
    A = np.eye(4)
    if joint.kind.has_axis:
        A[:3, :3] = axis_aligning(joint.axis)
    return A


def _flat(T: FloatArray) -> FloatArray:
    """R row by row, then R^T p: the offset seen in the new axes."""
    return np.concatenate((T[:3, :3].ravel(), T[:3, :3].T @ T[:3, 3]))


def _steps(
    tree: KinematicTree, needed: Sequence[int], anchors: dict[int, _Anchor]
) -> tuple[IntArray, FloatArray]:
    steps = np.full((len(needed), len(Step)), -1, dtype=np.int64)
    geometry = np.zeros((len(needed), Geometry.CONSTANT + 1))
    for row, i in enumerate(needed):
        joint = tree.joints[i]
        T_step_joint = anchors[joint.parent].T @ joint.T_parent_joint @ turned(joint)
        steps[row, Step.KIND] = _MOTION[joint.kind]
        steps[row, Step.Q] = tree.q_index[i]
        steps[row, Step.V] = tree.v_index[i]
        geometry[row, : Geometry.MULTIPLIER] = _flat(T_step_joint)
        rule = joint.mimic
        geometry[row, Geometry.MULTIPLIER :] = (1.0, 0.0) if rule is None else (rule.multiplier, rule.offset)
    return steps, geometry


def _slots(steps: IntArray, parents: Sequence[int]) -> int:
    """Fill RESUME and SAVE: a step whose parent is not the step before goes on from saved state."""
    slot_of = {-1: 0}
    for row, parent in enumerate(parents):
        if parent != row - 1:
            slot = slot_of.setdefault(parent, len(slot_of))
            steps[row, Step.RESUME] = slot
            if parent >= 0:
                steps[parent, Step.SAVE] = slot
    return len(slot_of)


def _columns(steps: IntArray, geometry: FloatArray) -> tuple[IntArray, FloatArray]:
    rows = [
        (row, axis, int(turns), step[Step.V] + place)
        for row, step in enumerate(steps)
        for place, (axis, turns) in enumerate(_RATES[Motion(step[Step.KIND])])
    ]
    columns = np.array(rows, dtype=np.int64).reshape(-1, len(Column))
    return columns, geometry[columns[:, Column.STEP], Geometry.MULTIPLIER].copy()


def _leaders(columns: IntArray, ancestors: Sequence[set[int]]) -> IntArray:
    leaders = np.full((len(ancestors), len(columns)), -1, dtype=np.int64)
    for frame, steps in enumerate(ancestors):
        first: dict[int, int] = {}
        for c, column in enumerate(columns.tolist()):
            if column[Column.STEP] in steps:
                leaders[frame, c] = first.setdefault(column[Column.V], c)
    return leaders


def _sources(columns: IntArray, leaders: IntArray, first: int, nv: int) -> IntArray:
    sources = np.full((len(leaders), 6, nv), rows.ZERO, dtype=np.int64)
    for frame, c in zip(*np.nonzero(leaders == np.arange(len(columns))), strict=True):
        sources[frame, :, columns[c, Column.V]] = first + rows.COLUMN_ROWS * c + np.arange(6)
    return sources.reshape(len(leaders), 6 * nv)


def _blocks(places: Iterable[int]) -> IntArray:
    """Where the blocks of eight begin that hold any of the places."""
    return np.array(sorted({int(place) // 8 * 8 for place in places}), dtype=np.int64)
