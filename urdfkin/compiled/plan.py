"""Convert a robot's tree to arrays, and to a program for the kernels.

A program is a list of instructions that a kernel executes. A moving joint is called a step. As in the
textbook, every joint frame is rotated so that the joint's axis is z. A revolute joint then rotates about z,
and a prismatic joint translates along z. Fixed joints are merged into the constant offsets between moving
joints. At a branch of the tree, a program saves the state of a link to memory.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum, auto
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.compiled.python_numbers import NO_OVERFLOW_BOUND, Number
from urdfkin.kinematics.rotation import rotation_with_z_axis
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, pose

IntArray = NDArray[np.int64]


class StepField(IntEnum):
    KIND = 0
    Q = 1
    V = 2


class JointMotion(IntEnum):
    REVOLUTE = 0
    PRISMATIC = 1
    PLANAR = 2
    FLOATING = 3


class Geometry(IntEnum):
    """First column of each quantity in `CompiledTree.geometry`.

    Attributes:
        R: Rotation matrix from this joint's axes to the previous moving joint's axes, row by row.
        OFFSET: Vector from the previous moving joint to this joint, in the previous joint's axes.
        MULTIPLIER: Multiplier of the mimic rule; 1 without a rule.
        CONSTANT: Offset of the mimic rule; 0 without a rule.
    """

    R = 0
    OFFSET = 9
    MULTIPLIER = 12
    CONSTANT = 13


class ColumnField(IntEnum):
    STEP = 0
    AXIS = 1
    IS_ROTATION = 2
    V = 3


_MOTION_OF_KIND = {
    JointKind.REVOLUTE: JointMotion.REVOLUTE,
    JointKind.CONTINUOUS: JointMotion.REVOLUTE,
    JointKind.PRISMATIC: JointMotion.PRISMATIC,
    JointKind.PLANAR: JointMotion.PLANAR,
    JointKind.FLOATING: JointMotion.FLOATING,
}

#: Motions (axis, is_rotation) of each kind of joint. The axes 0, 1 and 2 are x, y and z of the joint's frame.
_AXIS_MOTIONS: dict[JointMotion, tuple[tuple[int, bool], ...]] = {
    JointMotion.REVOLUTE: ((2, True),),
    JointMotion.PRISMATIC: ((2, False),),
    JointMotion.PLANAR: ((0, False), (1, False), (2, True)),
    JointMotion.FLOATING: ((0, False), (1, False), (2, False), (0, True), (1, True), (2, True)),
}


@dataclass(frozen=True, eq=False)
class CompiledTree:
    """The moving joints and the frames that a computation needs.

    The joints are sorted from the base outwards.

    | array | shape | content |
    |---|---|---|
    | joints | | indices of the moving joints in the tree |
    | steps | (steps, 3) | integers of each moving joint; `StepField` names the columns |
    | geometry | (steps, 14) | numbers of each moving joint; see `Geometry` |
    | frames | (frames, 2) | last moving joint (row in `steps`, or -1), index in the output; sorted |
    | offsets | (frames, 12) | rotation and translation from the last moving joint, in the order of `frames` |
    | columns | (columns, 4) | integers of each Jacobian column; `ColumnField` names the columns |
    | multipliers | (columns,) | multiplier of the joint's mimic rule; 1 without a rule |
    | target_columns | (frames, columns) | column to which each column is added; -1: no effect on the frame |
    | q_indices | | indices of the coordinates that the recursion needs |
    | parents | (steps,) | row of the previous moving joint; -1 for none |
    | lengths | (steps + frames,) | path lengths (m) to each moving joint, then to each row of `frames` |
    | depth | (frames,) | number of URDF joints from the root, in output order |
    | tilts | (frames,) | sum of `Joint.pinocchio_tilt` (rad) over these URDF joints, in output order |

    In `target_columns`, joints with the same index in v share the column of the first joint on the path. An
    element of `lengths` is the sum of `Joint.length` over the joints after the previous moving joint, or
    after the base. Fixed joints count too.
    """

    nq: int
    nv: int
    joints: tuple[int, ...]
    steps: IntArray
    geometry: FloatArray
    frames: IntArray
    offsets: FloatArray
    columns: IntArray
    multipliers: FloatArray
    target_columns: IntArray
    q_indices: tuple[int, ...]
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
    def cache(self) -> dict[object, Any]:
        return {}

    @cached_property
    def may_overflow(self) -> bool:
        numbers = self.geometry, self.offsets, self.lengths
        return any(float(np.abs(x).max(initial=0.0)) >= NO_OVERFLOW_BOUND for x in numbers)

    @cached_property
    def all_revolute(self) -> bool:
        return bool((self.steps[:, StepField.KIND] == JointMotion.REVOLUTE).all())

    def __reduce__(self) -> tuple[type[CompiledTree], tuple[Any, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))


def compile_tree(tree: KinematicTree, links: Sequence[int]) -> CompiledTree:
    """Convert a tree to arrays for the given links.

    Results are in the order of `links`.
    """
    depths = _depths(tree, links)
    tilts = {0: 0.0}
    for link in depths:
        if link:
            tilts[link] = tilts[tree.joints[link - 1].parent] + tree.joints[link - 1].pinocchio_tilt
    needed = [link - 1 for link in depths if link and tree.joints[link - 1].kind.nv]
    step_of_joint = {joint: step for step, joint in enumerate(needed)}
    anchors = _anchors(tree, step_of_joint, [link - 1 for link in depths if link])
    steps, geometry = _steps(tree, needed, anchors)
    parents = [anchors[tree.joints[i].parent].step for i in needed]
    columns, multipliers = _columns(steps, geometry)
    target_columns = _find_target_columns(columns, parents, [anchors[link].step for link in links])
    places = zip(steps[:, StepField.Q].tolist(), needed, strict=True)
    order = sorted(range(len(links)), key=lambda place: anchors[links[place]].step)
    ends = [anchors[links[place]] for place in order]
    return CompiledTree(
        nq=tree.nq,
        nv=tree.nv,
        joints=tuple(needed),
        steps=steps,
        geometry=geometry,
        frames=np.array(
            [[end.step, place] for end, place in zip(ends, order, strict=True)], dtype=np.int64
        ).reshape(-1, 2),
        offsets=np.array([_flatten_pose(end.T) for end in ends]).reshape(-1, 12),
        columns=columns,
        multipliers=multipliers,
        target_columns=target_columns[order],
        q_indices=tuple(at + c for at, i in places for c in range(tree.joints[i].kind.nq)),
        parents=np.array(parents, dtype=np.int64),
        lengths=np.array(
            [anchors[tree.joints[i].parent].length + tree.joints[i].length for i in needed]
            + [end.length for end in ends]
        ),
        depth=np.array([depths[link] for link in links], dtype=np.int64),
        tilts=np.array([tilts[link] for link in links]),
    )


def _depths(tree: KinematicTree, links: Iterable[int]) -> dict[int, int]:
    """Return the depths of `links` and of their ancestors."""
    visited = {0}
    for end in links:
        link = end
        while link not in visited:
            visited.add(link)
            link = tree.joints[link - 1].parent
    depths = {0: 0}
    for link in sorted(visited - {0}):
        depths[link] = depths[tree.joints[link - 1].parent] + 1
    return depths


class _Anchor(NamedTuple):
    """A link's pose relative to the last moving joint."""

    step: int  # Row of this joint in `CompiledTree.steps`; -1 if only fixed joints lead to the link.
    T: FloatArray
    length: float


def _anchors(tree: KinematicTree, step_of_joint: dict[int, int], joints: Iterable[int]) -> dict[int, _Anchor]:
    anchors = {0: _Anchor(-1, np.eye(4), 0.0)}
    for i in joints:
        joint = tree.joints[i]
        if i in step_of_joint:
            anchors[i + 1] = _Anchor(step_of_joint[i], axis_pose(joint).T, 0.0)
        else:
            parent = anchors[joint.parent]
            anchors[i + 1] = _Anchor(
                parent.step, parent.T @ joint.T_parent_joint, parent.length + joint.length
            )
    return anchors


def axis_pose(joint: Joint) -> FloatArray:
    """Return a pose with z along the joint's axis."""
    return pose(rotation_with_z_axis(joint.axis) if joint.kind.has_axis else None)


def _flatten_pose(T: FloatArray) -> FloatArray:
    return np.concatenate((T[:3, :3].ravel(), T[:3, 3]))


def _steps(
    tree: KinematicTree, needed: Sequence[int], anchors: dict[int, _Anchor]
) -> tuple[IntArray, FloatArray]:
    steps = np.full((len(needed), len(StepField)), -1, dtype=np.int64)
    geometry = np.zeros((len(needed), Geometry.CONSTANT + 1))
    for row, i in enumerate(needed):
        joint = tree.joints[i]
        T_step_joint = anchors[joint.parent].T @ joint.T_parent_joint @ axis_pose(joint)
        steps[row, StepField.KIND] = _MOTION_OF_KIND[joint.kind]
        steps[row, StepField.Q] = tree.q_index[i]
        steps[row, StepField.V] = tree.v_index[i]
        geometry[row, : Geometry.MULTIPLIER] = _flatten_pose(T_step_joint)
        rule = joint.mimic
        geometry[row, Geometry.MULTIPLIER :] = (1.0, 0.0) if rule is None else (rule.multiplier, rule.offset)
    return steps, geometry


def _columns(steps: IntArray, geometry: FloatArray) -> tuple[IntArray, FloatArray]:
    rows = [
        (row, axis, int(turns), step[StepField.V] + place)
        for row, step in enumerate(steps)
        for place, (axis, turns) in enumerate(_AXIS_MOTIONS[JointMotion(step[StepField.KIND])])
    ]
    columns = np.array(rows, dtype=np.int64).reshape(-1, len(ColumnField))
    return columns, geometry[columns[:, ColumnField.STEP], Geometry.MULTIPLIER].copy()


def _find_target_columns(columns: IntArray, parents: Sequence[int], ends: Sequence[int]) -> IntArray:
    target_columns = np.full((len(ends), len(columns)), -1, dtype=np.int64)
    rows = columns.tolist()
    for frame, end in enumerate(ends):
        ancestors, step = set[int](), end
        while step >= 0:
            ancestors.add(step)
            step = parents[step]
        first: dict[int, int] = {}
        for c, column in enumerate(rows):
            if column[ColumnField.STEP] in ancestors:
                target_columns[frame, c] = first.setdefault(column[ColumnField.V], c)
    return target_columns


# -- the program -----------------------------------------------------------------------------------------


class Op(IntEnum):
    """Instructions of a program.

    The suffix X, Y or Z marks a faster instruction for one coordinate axis.
    """

    END = 0
    TRANSLATE_X = 1
    TRANSLATE_Y = 2
    TRANSLATE_Z = 3
    TRANSLATE = 4
    ROTATE_X = 5
    ROTATE_Y = 6
    ROTATE_Z = 7
    ROTATE = 8
    REVOLUTE = 9
    PRISMATIC = 10
    PLANAR = 11
    FLOATING = 12
    SAVE = 13
    RESTORE = 14
    STORE_AXIS = 15
    COLUMN = 16
    WRITE = 17


class ProgramHeader(IntEnum):
    """Indices of the integers at the beginning of a program.

    | index | integer |
    |---|---|
    | CODE | index of the first instruction |
    | BLOCKS_Q, BLOCKS_V | beginning of the list of blocks of q or v, eight numbers each |
    | BLOCKS_END | end of the list of blocks of v |
    | ANGLES, ANGLES_END | beginning and end of the list of joint angles |
    | Q, V, A, BASE | first scratch row of each input |
    """

    CODE = 0
    NQ = 1
    NV = 2
    FRAMES = 3
    BLOCKS_Q = 4
    BLOCKS_V = 5
    BLOCKS_END = 6
    ANGLES = 7
    ANGLES_END = 8
    Q = 9
    V = 10
    A = 11
    BASE = 12


#: Number of configurations that a kernel computes at a time. A row of scratch memory contains one double of
#: each configuration, so it fills one AVX-512 register or two AVX2 registers.
LANES = 8
#: Number of integers of an instruction: the operation, three operands, and the index of the first constant.
INSTRUCTION_WIDTH = 5
#: Number of integers that describe a joint angle in a program:
#: 0. The scratch row of the coordinate q.
#: 1. The scratch row of the angle's sine. The next row contains the cosine.
#: 2. The index of the mimic rule's constants.
#: 3. 0 if the angle is q, and 1 if the angle is multiplier * q + offset.
ANGLE_WIDTH = 4
#: Row 0 of scratch memory contains the number 0, and row 1 the number 1. Rows 2 to 17 contain a frame's
#: results, and row 18 contains a joint angle. The rows from 19 contain all other numbers.
ZERO_ROW, ONE_ROW, OUT_ROW, ANGLE_ROW, FIRST_ROW = 0, 1, 2, 18, 19
STATE_ROWS, AXIS_ROWS, COLUMN_ROWS = 24, 12, 6
#: Number of integers that describe a Jacobian column, if a program computes a Hessian:
#: 0. The first scratch row of the column.
#: 1. The joint's row in `steps`.
#: 2. The joint's index in v.
#: 3. The first of six scratch rows with sums of derivatives with respect to the joint's motion.
HESSIAN_COLUMN_WIDTH = 4

_JOINT_OPS = {
    JointMotion.REVOLUTE: Op.REVOLUTE,
    JointMotion.PRISMATIC: Op.PRISMATIC,
    JointMotion.PLANAR: Op.PLANAR,
    JointMotion.FLOATING: Op.FLOATING,
}


@dataclass(frozen=True, eq=False)
class KernelProgram:
    """A program for a kernel.

    Attributes:
        words: Header, lists and instructions.
        rows: Number of scratch rows.
    """

    words: IntArray
    constants: FloatArray
    rows: int

    @cached_property
    def addresses(self) -> tuple[int, int]:
        """Memory addresses of `words` and `constants`, valid as long as this object exists."""
        return address(self.words), address(self.constants)

    @cached_property
    def lists(self) -> tuple[list[int], list[Number]]:
        words: list[int] = self.words.tolist()
        return words, list(map(Number, self.constants.tolist()))


def compile_program(
    plan: CompiledTree, *, orientations: bool, columns: bool = False, hessian: bool = False
) -> KernelProgram:
    """Return the program for a tree's frames.

    `orientations` must be true for placements and for results in frame axes. If `hessian` is true, each mimic
    joint has a separate column.
    """
    key = orientations, columns, hessian
    program: KernelProgram | None = plan.cache.get(key)
    if program is None:
        program = plan.cache[key] = _ProgramWriter(plan, *key).program()
    return program


class _ProgramWriter:
    def __init__(self, plan: CompiledTree, orientations: bool, columns: bool, hessian: bool) -> None:
        self.plan, self.orientations, self.columns, self.hessian = plan, orientations, columns, hessian
        self.code: list[tuple[int, int, int, int, int]] = []
        self.constants: list[float] = [0.0]
        self.slots: dict[int, int] = {}
        self.q = FIRST_ROW
        self.v = self.q + plan.nq
        self.a = self.v + plan.nv
        self.base = self.a + plan.nv
        self.sines = self.base + STATE_ROWS
        self.axis_rows = self.sines + 2 * len(plan.steps)
        self.column_rows = self.axis_rows + AXIS_ROWS * len(plan.columns) * columns
        self.sums = self.column_rows + COLUMN_ROWS * len(plan.columns) * columns
        self.state_rows = self.sums + COLUMN_ROWS * len(plan.columns) * hessian
        self.rules = [self._add_mimic_rule(i) for i in range(len(plan.steps))]
        parts = (
            _needed_block_starts(plan.q_indices),
            _needed_block_starts(plan.columns[:, ColumnField.V].tolist()),
            self._program_angles(),
        )
        self.lists = [number for part in parts for number in part]
        begins = np.cumsum([len(ProgramHeader), *map(len, parts)]).tolist()
        lists = [*begins[:3], begins[2], begins[3]]
        self.head = [0, plan.nq, plan.nv, len(plan.frames), *lists, self.q, self.v, self.a, self.base]

    def program(self) -> KernelProgram:
        self._write_instructions()
        self._add_instruction(Op.END)
        rows = self.state_rows + STATE_ROWS * len(self.slots)
        self.head[ProgramHeader.CODE] = len(self.head) + len(self.lists)
        words = [*self.head, *self.lists, *(word for line in self.code for word in line)]
        return KernelProgram(np.array(words, dtype=np.int64), np.array(self.constants), rows)

    def _write_instructions(self) -> None:
        events = list(self._joints_and_frames())
        columns = self.plan.columns if self.columns else self.plan.columns[:0]
        last = {origin: k for k, (origin, _, _) in enumerate(events)}
        now, c = -1, 0
        self._save_if_reused(-1, last, 0)
        for k, (origin, step, frame) in enumerate(events):
            if now != origin:
                self._add_instruction(Op.RESTORE, self._state_row(origin))
            if step is not None:
                self._add_joint(step)
                now = step
                while c < len(columns) and columns[c, ColumnField.STEP] == step:
                    self._add_instruction(
                        Op.STORE_AXIS, self.axis_rows + AXIS_ROWS * c, int(columns[c, ColumnField.AXIS])
                    )
                    c += 1
                self._save_if_reused(step, last, k + 1)
            elif frame is not None and self._add_frame(frame):
                now = -2  # The registers contain the state of the frame, not of a joint.

    def _joints_and_frames(self) -> Iterator[tuple[int, int | None, int | None]]:
        """Yield the joints and the frames in the order of the recursion.

        A joint gives (previous moving joint, joint, None). A frame gives (last moving joint, None, frame).
        The number -1 means the base.
        """
        f = 0
        for i in range(-1, len(self.plan.steps)):
            if i >= 0:
                yield int(self.plan.parents[i]), i, None
            while f < len(self.plan.frames) and self.plan.frames[f, 0] == i:
                yield i, None, f
                f += 1

    def _save_if_reused(self, step: int, last: Mapping[int, int], following: int) -> None:
        """Save the state of `step` to memory if a later instruction needs this state.

        The next joint or frame, with the index `following`, does not need the memory, because the state is
        still in the registers.
        """
        if last.get(step, -1) > following:
            self._add_instruction(Op.SAVE, self._state_row(step))

    def _state_row(self, step: int) -> int:
        return self.state_rows + STATE_ROWS * self.slots.setdefault(step, len(self.slots))

    def _add_instruction(self, op: Op, *operands: int, at: int = 0) -> None:
        x, y, z = (*operands, 0, 0, 0)[:3]
        self.code.append((int(op), x, y, z, at))

    def _add_constants(self, *numbers: float) -> int:
        self.constants += map(float, numbers)
        return len(self.constants) - len(numbers)

    def _add_transform(self, R: FloatArray, p: FloatArray, *, orientations: bool = True) -> bool:
        """Return whether an instruction was needed."""
        before = len(self.code)
        along = np.flatnonzero(p).tolist()
        if along:
            op = Op.TRANSLATE_X + along[0] if len(along) == 1 else Op.TRANSLATE
            self._add_instruction(Op(op), at=self._add_constants(*p))
        if orientations and (np.eye(3) != R).any():
            about = [axis for axis in range(3) if _is_rotation_about(R, axis)]
            self._add_instruction(
                Op(Op.ROTATE_X + about[0]) if about else Op.ROTATE, at=self._add_constants(*R.ravel())
            )
        return len(self.code) > before

    def _add_mimic_rule(self, i: int) -> int:
        multiplier, constant = self.plan.geometry[i, Geometry.MULTIPLIER :].tolist()
        return 0 if (multiplier, constant) == (1.0, 0.0) else self._add_constants(multiplier, constant)

    def _program_angles(self) -> list[int]:
        angles = []
        for i, step in enumerate(self.plan.steps):
            kind, q = JointMotion(step[StepField.KIND]), self.q + int(step[StepField.Q])
            if kind in (JointMotion.REVOLUTE, JointMotion.PLANAR):
                angles += [
                    q + 2 * (kind is JointMotion.PLANAR),
                    self.sines + 2 * i,
                    self.rules[i],
                    int(self.rules[i] > 0),
                ]
        return angles

    def _add_joint(self, i: int) -> None:
        geometry, step = self.plan.geometry[i], self.plan.steps[i]
        self._add_transform(geometry[:9].reshape(3, 3), geometry[Geometry.OFFSET : Geometry.MULTIPLIER])
        op, rule, sine = _JOINT_OPS[JointMotion(step[StepField.KIND])], self.rules[i], self.sines + 2 * i
        first = sine if op is Op.REVOLUTE else self.q + int(step[StepField.Q])
        self._add_instruction(
            op, first, int(step[StepField.V]), sine if op is Op.PLANAR else int(rule > 0), at=rule
        )

    def _add_frame(self, f: int) -> bool:
        """Return whether the state in the registers changes."""
        plan, offsets = self.plan, self.plan.offsets[f]
        moved = self._add_transform(offsets[:9].reshape(3, 3), offsets[9:], orientations=self.orientations)
        sources = 0
        if self.columns:
            self._add_columns(f)
            sources = len(self.head) + len(self.lists)
            self.lists += self._hessian_entries(f) if self.hessian else self._result_rows(f, self.column_rows)
        self._add_instruction(Op.WRITE, int(plan.frames[f, 1]), sources)
        return moved

    def _add_columns(self, f: int) -> None:
        for c, mimicked_joint in enumerate(self.plan.target_columns[f].tolist()):
            if mimicked_joint >= 0:
                multiplier = float(self.plan.multipliers[c])
                multiplier_index = 0 if multiplier == 1.0 else self._add_constants(multiplier)
                to = c if self.hessian else mimicked_joint
                flags = int(self.plan.columns[c, ColumnField.IS_ROTATION]) + 2 * (to != c)
                rows = self.axis_rows + AXIS_ROWS * c, self.column_rows + COLUMN_ROWS * to
                self._add_instruction(Op.COLUMN, *rows, flags, at=multiplier_index)

    def _result_rows(self, f: int, row: int) -> list[int]:
        """Return the scratch row of each entry of the (6, nv) matrix, in C order."""
        plan = self.plan
        sources = np.full((6, plan.nv), ZERO_ROW, dtype=np.int64)
        for c in np.flatnonzero(plan.target_columns[f] == np.arange(len(plan.columns))):
            sources[:, plan.columns[c, ColumnField.V]] = row + COLUMN_ROWS * c + np.arange(6)
        return sources.ravel().tolist()

    def _hessian_entries(self, f: int) -> list[int]:
        columns, target_columns = self.plan.columns, self.plan.target_columns[f]
        own = np.flatnonzero(target_columns >= 0)
        rows = self.column_rows + COLUMN_ROWS * own, self.sums + COLUMN_ROWS * target_columns[own]
        pairs = np.column_stack(
            (rows[0], columns[own, ColumnField.STEP], columns[own, ColumnField.V], rows[1])
        )
        return [len(own), *pairs.ravel().tolist(), *self._result_rows(f, self.sums)]


def _is_rotation_about(R: FloatArray, axis: int) -> bool:
    one = np.eye(3)[axis]
    return bool((R[axis] == one).all() and (R[:, axis] == one).all())


def _needed_block_starts(indices: Sequence[int]) -> list[int]:
    """Return the starts of the needed blocks of eight, for example [0, 8] for the indices [3, 5, 12]."""
    return sorted({int(index) // 8 * 8 for index in indices})


#: Size (bytes) of a cache line. Access to a vector in two lines takes twice as long as in one line.
_CACHE_LINE = 64
#: The integer that represents each reference frame in a kernel.
REFERENCES = {
    known: int(known) for known in (Reference.LOCAL, Reference.WORLD, Reference.LOCAL_WORLD_ALIGNED)
}


class KernelArgs(IntEnum):
    """Indices in the array of a kernel's arguments.

    A batch uses only the members before KERNEL.
    """

    PROGRAM = 0
    CONSTANTS = auto()
    SCRATCH = auto()
    REFERENCE = auto()
    N = auto()
    Q = auto()
    V = auto()
    A = auto()
    #: Address of the base's state (rows of 24 numbers). The address is 0 for a fixed base at the world's
    #: origin.
    BASE = auto()
    #: Stride (doubles) between consecutive configurations; 0 if all configurations use the same row.
    STRIDE_Q = auto()
    STRIDE_V = auto()
    STRIDE_A = auto()
    STRIDE_BASE = auto()
    OUT = auto()
    #: Number of output numbers for one configuration.
    OUTPUT_WIDTH = auto()
    #: Address of the buffer for a block's results; 0 without a buffer.
    BUFFER = auto()

    KERNEL = auto()
    NQ = auto()
    NV = auto()
    ORDERS = auto()
    AXES = auto()
    ROWS = auto()
    COLUMNS = auto()
    BUSY = auto()
    COUNT = auto()


def address(x: NDArray[Any]) -> int:
    first: int = x.__array_interface__["data"][0]  # `x.ctypes.data` is slower, because it runs Python code.
    return first


def make_scratch(program: KernelProgram) -> FloatArray:
    return aligned_empty(program.rows * LANES)


def aligned_empty(count: int) -> FloatArray:
    """Return an uninitialized array, aligned to a cache line."""
    numbers = np.empty(count + _CACHE_LINE // 8)
    first = -address(numbers) % _CACHE_LINE // 8
    return numbers[first : first + count]
