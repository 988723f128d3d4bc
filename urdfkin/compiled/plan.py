"""Represent a robot's tree by arrays for the recursion: a step for each moving joint, a row for each frame.

As in the textbook, every joint frame is rotated so that the joint's axis is z (`turned` returns this
rotation). Each revolute joint is then Rz, and each prismatic joint is Tz. Fixed joints are merged into the
constant offsets between moving joints. A plan contains only the joints that move one of its frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdfkin.kinematics.rotation import axis_aligning
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree

IntArray = NDArray[np.int64]


#: If all coordinates, velocities, lengths and multipliers are below this number, no result overflows. With N
#: joints, the velocity of a joint is below LARGE^2 and the length of a path is below N LARGE^2. The largest
#: product, w^2 d, is therefore below N^3 LARGE^6.
LARGE = 1e45


class Step(IntEnum):
    """Columns of `CompiledTree.steps` (integers)."""

    KIND = 0
    Q = 1
    V = 2


class Motion(IntEnum):
    """The kinds of a step: the values of column `Step.KIND`."""

    TURN = 0
    SLIDE = 1
    PLANAR = 2
    FLOATING = 3


class Geometry(IntEnum):
    """Columns of `CompiledTree.geometry`: R, the offset in the previous step's axes, and the mimic rule."""

    R = 0
    OFFSET = 9
    MULTIPLIER = 12
    CONSTANT = 13


class Column(IntEnum):
    """Columns of `CompiledTree.columns`; each row of that array describes a Jacobian column of eq. 7.85."""

    STEP = 0
    AXIS = 1
    TURNS = 2
    V = 3


_MOTION = {
    JointKind.REVOLUTE: Motion.TURN,
    JointKind.CONTINUOUS: Motion.TURN,
    JointKind.PRISMATIC: Motion.SLIDE,
    JointKind.PLANAR: Motion.PLANAR,
    JointKind.FLOATING: Motion.FLOATING,
}

#: For each joint velocity of a joint: the index of its axis in the joint's frame, and whether it is a
#: rotation.
_RATES: dict[Motion, tuple[tuple[int, bool], ...]] = {
    Motion.TURN: ((2, True),),
    Motion.SLIDE: ((2, False),),
    Motion.PLANAR: ((0, False), (1, False), (2, True)),
    Motion.FLOATING: ((0, False), (1, False), (2, False), (0, True), (1, True), (2, True)),
}


@dataclass(frozen=True, eq=False)
class CompiledTree:
    """The steps of the recursion, from the base to the ends of the tree, and the frames with results.

    Attributes:
        nq: Length of `q`.
        nv: Length of `v` and `a`.
        joints: The moving joint of each step, as an index into the tree's joints.
        steps: (steps, 3) integers, columns `Step`.
        geometry: (steps, 14), columns `Geometry`.
        frames: (frames, 2) for each frame: the step before the frame (-1: the base), and the frame's index in
            the output. The rows are sorted by step.
        offsets: (frames, 12) rotation (9) and offset (3) from the frame of the step to each frame. The offset
            is in the axes of the step.
        columns: (columns, 4) a row for every joint velocity of every step; `Column` describes its numbers.
        multipliers: (columns,) the mimic multiplier of each column.
        leaders: (frames, columns) index of the column to which a column is added: the column itself or, for a
            mimic joint, the column of the mimicked joint. The index is -1 if the column's joint does not move
            the frame.
        places_q: Indices of the coordinates that the recursion needs.
        parents: (steps,) the step before each step, -1 for the base.
        lengths: (steps + frames,) metres: sum of the lengths of all URDF offsets, including the offsets of
            fixed joints. The first numbers are the lengths from the parent step to each step. The other
            numbers are the lengths from the step to each frame (in the order of `frames`).
        depth: (frames,) number of URDF joints between the root and each frame, in output order.
        tilts: (frames,) sum (rad) of `Joint.tilt` over the joints that `depth` counts, in output order.
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
    leaders: IntArray
    places_q: tuple[int, ...]
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
    def made(self) -> dict[object, Any]:
        """Cache of objects that are computed from this tree, such as programs and weights of error bounds."""
        return {}

    @cached_property
    def is_large(self) -> bool:
        """Whether results for ordinary coordinates and velocities may overflow because of large lengths."""
        numbers = self.geometry, self.offsets, self.lengths
        return any(float(np.abs(x).max(initial=0.0)) >= LARGE for x in numbers)

    @cached_property
    def turns_only(self) -> bool:
        """Whether every step is revolute, so that all paths have the same length in every configuration."""
        return bool((self.steps[:, Step.KIND] == Motion.TURN).all())

    def __reduce__(self) -> tuple[type[CompiledTree], tuple[Any, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))


def compile_tree(tree: KinematicTree, links: Sequence[int]) -> CompiledTree:
    """Return the compiled tree with the frames of the given links.

    Args:
        tree: The robot.
        links: Indices into `tree.links`, in the order of the results.
    """
    depths = _depths(tree, links)
    tilts = {0: 0.0}
    for link in depths:
        if link:
            tilts[link] = tilts[tree.joints[link - 1].parent] + tree.joints[link - 1].tilt
    needed = [link - 1 for link in depths if link and tree.joints[link - 1].kind.nv]
    step_of_joint = {joint: step for step, joint in enumerate(needed)}
    anchors = _anchors(tree, step_of_joint, [link - 1 for link in depths if link])
    steps, geometry = _steps(tree, needed, anchors)
    parents = [anchors[tree.joints[i].parent].step for i in needed]
    columns, multipliers = _columns(steps, geometry)
    leaders = _leaders(columns, parents, [anchors[link].step for link in links])
    places = zip(steps[:, Step.Q].tolist(), needed, strict=True)
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
        offsets=np.array([(*end.T[:3, :3].ravel(), *end.T[:3, 3]) for end in ends]).reshape(-1, 12),
        columns=columns,
        multipliers=multipliers,
        leaders=leaders[order],
        places_q=tuple(at + c for at, i in places for c in range(tree.joints[i].kind.nq)),
        parents=np.array(parents, dtype=np.int64),
        lengths=np.array(
            [anchors[tree.joints[i].parent].length + tree.joints[i].length for i in needed]
            + [end.length for end in ends]
        ),
        depth=np.array([depths[link] for link in links], dtype=np.int64),
        tilts=np.array([tilts[link] for link in links]),
    )


def _depths(tree: KinematicTree, links: Iterable[int]) -> dict[int, int]:
    """Return the links on the paths to the given links, root first, each with the number of joints before it.

    Each joint is visited once. A separate path for each link would take time proportional to the tree's
    depth.
    """
    met = {0}
    for end in links:
        link = end
        while link not in met:
            met.add(link)
            link = tree.joints[link - 1].parent
    depths = {0: 0}
    for link in sorted(met - {0}):
        depths[link] = depths[tree.joints[link - 1].parent] + 1
    return depths


class _Anchor(NamedTuple):
    """The step that moves a link (-1: the base), the link's pose in the step's frame, and the path length."""

    step: int
    T: FloatArray
    length: float


def _anchors(tree: KinematicTree, step_of_joint: dict[int, int], wanted: Iterable[int]) -> dict[int, _Anchor]:
    anchors = {0: _Anchor(-1, np.eye(4), 0.0)}
    for i in wanted:
        joint = tree.joints[i]
        if i in step_of_joint:
            anchors[i + 1] = _Anchor(step_of_joint[i], turned(joint).T, 0.0)
        else:
            parent = anchors[joint.parent]
            anchors[i + 1] = _Anchor(
                parent.step, parent.T @ joint.T_parent_joint, parent.length + joint.length
            )
    return anchors


def turned(joint: Joint) -> FloatArray:
    """Return the pose (4, 4), in the joint's URDF frame, of a frame whose z axis is the joint's axis."""
    A = np.eye(4)
    if joint.kind.has_axis:
        A[:3, :3] = axis_aligning(joint.axis)
    return A


def _flat(T: FloatArray) -> FloatArray:
    """Return the twelve numbers of a pose: R row by row, then the offset in the previous frame's axes."""
    return np.concatenate((T[:3, :3].ravel(), T[:3, 3]))


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


def _columns(steps: IntArray, geometry: FloatArray) -> tuple[IntArray, FloatArray]:
    rows = [
        (row, axis, int(turns), step[Step.V] + place)
        for row, step in enumerate(steps)
        for place, (axis, turns) in enumerate(_RATES[Motion(step[Step.KIND])])
    ]
    columns = np.array(rows, dtype=np.int64).reshape(-1, len(Column))
    return columns, geometry[columns[:, Column.STEP], Geometry.MULTIPLIER].copy()


def _leaders(columns: IntArray, parents: Sequence[int], ends: Sequence[int]) -> IntArray:
    """Return `CompiledTree.leaders`; `ends` is the last step of each frame."""
    leaders = np.full((len(ends), len(columns)), -1, dtype=np.int64)
    rows = columns.tolist()
    for frame, end in enumerate(ends):
        ancestors, step = set[int](), end
        while step >= 0:
            ancestors.add(step)
            step = parents[step]
        first: dict[int, int] = {}
        for c, column in enumerate(rows):
            if column[Column.STEP] in ancestors:
                leaders[frame, c] = first.setdefault(column[Column.V], c)
    return leaders
