"""Compare every frame of a robot with Pinocchio, for a batch of samples.

Frames are compared in blocks, to limit the memory. The largest arrays are the Jacobians, with
samples * frames * 6 * nv numbers. The division into blocks changes no result of a frame, and therefore does
not change the report.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import Samples
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointFrame, KinematicTree, without_mimic_rules
from urdfkin.robot import Robot
from urdfkin.validation.error_stats import CrossCheck, Inputs, Key, Tally, cross_check, tally
from urdfkin.validation.timings import Timings
from urdfkin.verify.bounds import Bound, magnitudes
from urdfkin.verify.oracle import Oracle, QueryBatch
from urdfkin.verify.oracles import OracleLibrary
from urdfkin.verify.quantities import SCREWS, Quantity, validated

#: Maximum number of bytes of one array in a block of frames.
#: About ten arrays of this size exist at a time.
BLOCK_BYTES = 32 * 2**20


@dataclass(frozen=True, slots=True)
class SecondOracleModel:
    library: OracleLibrary
    oracle: Oracle

    def cross_check(
        self, block: _Block, row: Quantity, reference: Reference | None, ours: FloatArray, theirs: FloatArray
    ) -> CrossCheck:
        second = block.timings.timed("second", row.ask, self.oracle, block.query(row, reference))
        bounds = (
            row.bound(block.plan, size, reference) for size in (block.size, self.library.size(block.size))
        )
        if row.of == "joints":
            bounds = (block.joint_part(one) for one in bounds)
        return cross_check(self.library.name, ours, theirs, second, *bounds)


def tallies(
    robot: Robot,
    oracle: Oracle,
    x: Samples,
    first_sample: int,
    timings: Timings,
    second: SecondOracleModel | None = None,
) -> dict[Key, Tally]:
    """Return the error statistics of each quantity of a robot in each reference frame."""
    found: dict[Key, Tally] = {}
    work = robot, oracle, x, first_sample, timings
    for frames in blocks(len(robot.all_frames), frame_bytes(len(x.q), robot.nv)):
        for key, part in _Block(*work, frames).tallies(second):
            found[key] = found[key].beside(part) if key in found else part
    screws = reduce(Tally.beside, _Screws(*work).tallies())
    return found | {(SCREWS.name, Reference.WORLD.name.lower()): screws}


def frame_bytes(samples: int, nv: int) -> int:
    """Return the size in bytes of one frame's largest array.

    This array contains the Jacobians, or the placements if nv is at most 2.
    """
    return samples * 8 * max(16, 6 * nv)


def blocks(count: int, size: int) -> Iterator[slice]:
    """Divide `count` items of `size` bytes into slices of at most `BLOCK_BYTES`; yield at least one slice."""
    most = max(1, BLOCK_BYTES // size)
    for start in range(0, max(1, count), most):
        yield slice(start, min(count, start + most))


class _ComparisonBatch:
    def __init__(self, robot: Robot, oracle: Oracle, x: Samples, first_sample: int, timings: Timings) -> None:
        self.robot, self.oracle, self.x, self.first, self.timings = robot, oracle, x, first_sample, timings
        self.inputs: list[Inputs] = list(zip(x.q.tolist(), x.v.tolist(), x.a.tolist(), strict=True))

    def tally(self, ours: FloatArray, theirs: FloatArray, bound: Bound, names: tuple[str, ...]) -> Tally:
        return tally(ours, theirs, bound, names, self.first, self.inputs)


class _Block(_ComparisonBatch):
    """The comparisons for a block of frames, and for each joint whose child link is in the block."""

    def __init__(
        self, robot: Robot, oracle: Oracle, x: Samples, first_sample: int, timings: Timings, frames: slice
    ) -> None:
        super().__init__(robot, oracle, x, first_sample, timings)
        tree = robot.tree
        self.frames = robot.all_frames[frames]
        links = tuple(tree.frame_link(frame) for frame in self.frames)
        # The robot's cache keeps the compiled tree for all frames, but not a compiled tree for some frames.
        whole = len(links) == len(robot.all_frames)
        self.plan = robot.plan(links) if whole else compile_tree(tree, links)
        self.size = magnitudes(self.plan, x.q, x.v, x.a, FIXED_BASE_STATE)
        # The Jacobian of the frame at a joint is the Jacobian of the joint's child link.
        # In the list of frames, the links come first, beginning with the root.
        moving = [i + 1 for i, joint in enumerate(tree.joints) if joint.kind.nv]
        joints = slice(bisect_left(moving, frames.start), bisect_left(moving, frames.stop))
        self.joint_rows = [link - frames.start for link in moving[joints]]
        self.joint_names = robot.joint_names[joints]

    def tallies(self, second: SecondOracleModel | None) -> Iterator[tuple[Key, Tally]]:
        """Yield error statistics for the frames and the joints of the block.

        For a joint, urdfkin's result is the result for the joint's child link. Pinocchio computes the joint
        and the child link with different functions, so both results are compared.
        """
        inputs = self.x.q, self.x.v, self.x.a
        for row in validated():
            joints = [joint for joint in validated("joints") if joint.compute is row.compute]
            for reference in row.references:
                ours = self.timings.timed("urdfkin", row.ours, self.plan, inputs, reference)
                bound = row.bound(self.plan, self.size, reference)
                yield self._compare(row, reference, ours, bound, second)
                for joint in joints:
                    own, joint_bound = ours[:, self.joint_rows], self.joint_part(bound)
                    yield self._compare(joint, reference, own, joint_bound, second)

    def joint_part(self, bound: Bound) -> Bound:
        return Bound(bound.scale[:, self.joint_rows], bound.k[:, self.joint_rows])

    def query(self, row: Quantity, reference: Reference | None) -> QueryBatch:
        joints = row.of == "joints"
        frames = [JointFrame.of(name) for name in self.joint_names] if joints else self.frames
        inputs = self.x.q, self.x.v, self.x.a
        reference = Reference.LOCAL_WORLD_ALIGNED if reference is None else reference
        return QueryBatch(frames, inputs, reference, joints=joints, divided=True)

    def _compare(
        self,
        row: Quantity,
        reference: Reference | None,
        ours: FloatArray,
        bound: Bound,
        second: SecondOracleModel | None,
    ) -> tuple[Key, Tally]:
        names = self.joint_names if row.of == "joints" else self.frames
        theirs = self.timings.timed("pinocchio", row.ask, self.oracle, self.query(row, reference))
        found = self.tally(ours, theirs, bound, names)
        if second is not None:
            found = replace(found, cross_check=second.cross_check(self, row, reference, ours, theirs))
        return (row.name, reference.name.lower() if reference is not None else ""), found


class _Screws(_ComparisonBatch):
    """Comparison of Pinocchio's `data.J` with urdfkin's Jacobians.

    Each column of `data.J` equals a column of one joint's Jacobian in the reference frame WORLD.
    """

    def tallies(self) -> Iterator[Tally]:
        robot, x = self.robot, self.x
        tree = without_mimic_rules(robot.tree)
        q_free = _expand_mimic(robot.tree, tree, x.q)
        theirs = self.timings.timed("pinocchio", SCREWS.ask, self.oracle, QueryBatch((), (x.q,))).swapaxes(
            1, 2
        )
        moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
        column = 0
        for block in blocks(len(moving), frame_bytes(len(x.q), tree.nv)):
            joints = moving[block]
            width = sum(tree.joints[i].kind.nv for i in joints)
            yield self._block(tree, q_free, joints, theirs[:, column : column + width])
            column += width

    def _block(self, tree: KinematicTree, q: FloatArray, joints: Sequence[int], theirs: FloatArray) -> Tally:
        links = [i + 1 for i in joints]
        plan = compile_tree(tree, links)
        still = (np.zeros((len(q), tree.nv)),) * 2
        size = magnitudes(plan, q, *still, FIXED_BASE_STATE)
        J = self.timings.timed("urdfkin", SCREWS.ours, plan, (q,), Reference.WORLD)
        bound = SCREWS.bound(plan, size, Reference.WORLD)
        own = [(f, tree.v_index[i] + c) for f, i in enumerate(joints) for c in range(tree.joints[i].kind.nv)]
        frame, column = np.array(own, dtype=np.int64).reshape(-1, 2).T
        ours = J[:, frame, :, column].swapaxes(0, 1)
        scale = bound.scale[:, frame, :, column].swapaxes(0, 1)
        names = tuple(tree.joints[joints[f]].name for f, _ in own)
        return self.tally(ours, theirs, Bound(scale, bound.k[:, frame, 0]), names)


def _expand_mimic(tree: KinematicTree, free: KinematicTree, q: FloatArray) -> FloatArray:
    """Convert configurations of `tree` to configurations of `free`, the same tree without mimic rules."""
    expanded = np.empty((len(q), free.nq))
    for joint, at, free_at in zip(tree.joints, tree.q_index, free.q_index, strict=True):
        own = q[:, at : at + joint.kind.nq]
        if joint.mimic:
            own = joint.mimic.multiplier * own + joint.mimic.offset
        expanded[:, free_at : free_at + joint.kind.nq] = own
    return expanded
