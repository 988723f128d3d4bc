"""Compute chunks of a validation: compare urdfkin with Pinocchio.

A chunk is a range of samples of one robot. The robot, the seed, the number of samples and the sample's index
determine a sample. Inputs and results of a chunk are plain data, so that a chunk can run in any process, also
on another machine. Samples 0, 1 and 2 of a robot are the neutral configuration, the lower limits and the
upper limits.

Each group of 25 random samples has its own seed. Therefore, the size of a chunk does not change any result.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import reduce
from typing import Any, ParamSpec, TypeVar

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import Samples, draw_samples
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointFrame, KinematicTree, without_mimic_rules
from urdfkin.robot import Robot
from urdfkin.validation import memory
from urdfkin.validation.error_stats import (
    CrossCheck,
    ErrorStats,
    Inputs,
    Key,
    compute_error_stats,
    make_cross_check,
)
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import RobotSummary
from urdfkin.verify.bounds import Bound, compute_magnitudes
from urdfkin.verify.oracle import Oracle, QueryBatch
from urdfkin.verify.oracles import PINOCCHIO, OracleLibrary
from urdfkin.verify.quantities import SCREWS, Quantity, validated_quantities

#: Maximum number of random configurations with the same seed.
DRAW_SIZE = 25
#: Number of special configurations before the random configurations.
SPECIAL_SAMPLES = 3
#: Minimum number of chunks of a robot with 200 or more samples, so that several workers can share the robot.
_MIN_CHUNKS = 8
#: Maximum number of groups of `DRAW_SIZE` random configurations in a chunk. Such a chunk has 1000
#: configurations, which take about 0.5 s for a robot with seven joints.
_MAX_DRAWS = 40

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Chunk:
    """A range of samples of one robot.

    Attributes:
        first_draw: Index of the first group of `DRAW_SIZE` random configurations.
        samples: Number of random configurations.
        memory_limit: Allowed memory, bytes; None: half of the free memory.
    """

    robot_input: RobotInput
    seed: int
    index: int
    first_draw: int
    samples: int
    memory_limit: int | None = field(default=None, compare=False)

    @property
    def configuration_count(self) -> int:
        return self.samples + (SPECIAL_SAMPLES if self.first_draw == 0 else 0)

    @property
    def first_sample(self) -> int:
        return 0 if self.first_draw == 0 else SPECIAL_SAMPLES + self.first_draw * DRAW_SIZE

    def draw(self, tree: KinematicTree) -> Samples:
        draws = [self._draw(tree, i) for i in range(max(1, -(-self.samples // DRAW_SIZE)))]
        return Samples(*(np.concatenate([getattr(x, name) for x in draws]) for name in ("q", "v", "a")))

    def _draw(self, tree: KinematicTree, i: int) -> Samples:
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.first_draw + i,)))
        samples = min(DRAW_SIZE, self.samples - i * DRAW_SIZE)
        return draw_samples(tree, samples, rng, with_zero_and_limits=self.first_draw + i == 0)


@dataclass(slots=True)
class Timings:
    """Computing times in seconds; `compare` is the total time minus all other times."""

    read: float = 0.0
    urdfkin: float = 0.0
    pinocchio: float = 0.0
    compare: float = 0.0
    second_oracle: float = 0.0

    def time_call(self, part: str, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        begin = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            setattr(self, part, getattr(self, part) + (time.perf_counter() - begin))

    def close(self, seconds: float) -> None:
        self.compare = max(0.0, seconds - self.read - self.urdfkin - self.pinocchio - self.second_oracle)

    def __add__(self, other: Timings) -> Timings:
        return Timings(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def as_dict(self) -> dict[str, Any]:
        parts = {name: round(getattr(self, name), 4) for name in ("read", "urdfkin", "pinocchio", "compare")}
        return parts | ({"second_oracle": round(self.second_oracle, 4)} if self.second_oracle else {})


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """Result of one chunk, or the sum of several results.

    `summary` is None if the robot's first chunk is not included.
    """

    name: str
    joints: tuple[str, ...]
    frames: tuple[str, ...]
    error_stats: dict[Key, ErrorStats]
    samples: int
    seconds: float
    timings: Timings
    summary: RobotSummary | None

    def __add__(self, other: ChunkResult) -> ChunkResult:
        return ChunkResult(
            name=self.name,
            joints=self.joints,
            frames=self.frames,
            error_stats={key: stats + other.error_stats[key] for key, stats in self.error_stats.items()},
            samples=self.samples + other.samples,
            seconds=self.seconds + other.seconds,
            timings=self.timings + other.timings,
            summary=self.summary or other.summary,
        )


@dataclass(frozen=True, slots=True)
class Chunking:
    """Division of each robot's samples into chunks, which depends only on the number of samples.

    >>> len(Chunking(1000)), len(Chunking(10_000)), len(Chunking(1_000_000)), len(Chunking(0))
    (8, 10, 1000, 1)
    """

    samples: int

    @property
    def _draws_per_chunk(self) -> int:
        return min(_MAX_DRAWS, max(1, -(-self.samples // DRAW_SIZE) // _MIN_CHUNKS))

    def __len__(self) -> int:
        """Number of chunks of a robot, at least one."""
        return max(1, -(-self.samples // (self._draws_per_chunk * DRAW_SIZE)))

    def make_chunk(
        self, robot_input: RobotInput, seed: int, index: int, memory_limit: int | None = None
    ) -> Chunk:
        first_draw = index * self._draws_per_chunk
        samples = min(self._draws_per_chunk * DRAW_SIZE, self.samples - first_draw * DRAW_SIZE)
        return Chunk(robot_input, seed, index, first_draw, samples, memory_limit)

    def count_configurations(self, chunks: range) -> int:
        """Return the number of configurations in the chunks, including the special configurations."""
        if not chunks:
            return 0
        size = self._draws_per_chunk * DRAW_SIZE
        random = min(self.samples, chunks.stop * size) - chunks.start * size
        return random + (SPECIAL_SAMPLES if chunks.start == 0 else 0)


@dataclass(frozen=True, slots=True)
class SecondOracleModel:
    library: OracleLibrary
    oracle: Oracle

    def cross_check(
        self,
        block: _FrameComparison,
        row: Quantity,
        reference: Reference | None,
        results: FloatArray,
        oracle_results: FloatArray,
    ) -> CrossCheck:
        second_oracle_results = block.timings.time_call(
            "second_oracle", row.ask_oracle, self.oracle, block.make_query(row, reference)
        )
        bounds = (
            row.bound(block.plan, magnitudes, reference)
            for magnitudes in (block.magnitudes, self.library.adapt_magnitudes(block.magnitudes))
        )
        if row.object_kind == "joints":
            bounds = (block.select_joint_bound(bound) for bound in bounds)
        return make_cross_check(self.library.name, results, oracle_results, second_oracle_results, *bounds)


def compare_robot(
    robot: Robot,
    oracle: Oracle,
    x: Samples,
    first_sample: int,
    timings: Timings,
    second: SecondOracleModel | None = None,
) -> dict[Key, ErrorStats]:
    error_stats: dict[Key, ErrorStats] = {}
    arguments = robot, oracle, x, first_sample, timings
    for frames in memory.blocks(len(robot.all_frames), memory.frame_array_bytes(len(x.q), robot.nv)):
        for key, part in _FrameComparison(*arguments, frames).compare(second):
            error_stats[key] = error_stats[key].join_frames(part) if key in error_stats else part
    screws = reduce(ErrorStats.join_frames, _ScrewComparison(*arguments).compare())
    return error_stats | {(SCREWS.name, Reference.WORLD.name.lower()): screws}


class _Comparison:
    def __init__(self, robot: Robot, oracle: Oracle, x: Samples, first_sample: int, timings: Timings) -> None:
        self.robot, self.oracle, self.x, self.first_sample, self.timings = (
            robot,
            oracle,
            x,
            first_sample,
            timings,
        )
        self.inputs: list[Inputs] = list(zip(x.q.tolist(), x.v.tolist(), x.a.tolist(), strict=True))

    def _compute_stats(
        self, results: FloatArray, oracle_results: FloatArray, bound: Bound, names: tuple[str, ...]
    ) -> ErrorStats:
        return compute_error_stats(results, oracle_results, bound, names, self.first_sample, self.inputs)


class _FrameComparison(_Comparison):
    """Comparison of a block of frames; a joint belongs to the block of its child link."""

    def __init__(
        self, robot: Robot, oracle: Oracle, x: Samples, first_sample: int, timings: Timings, frames: slice
    ) -> None:
        super().__init__(robot, oracle, x, first_sample, timings)
        tree = robot.tree
        self.frames = robot.all_frames[frames]
        links = tuple(tree.frame_link(frame) for frame in self.frames)
        # The robot caches only the compiled tree for all frames.
        whole = len(links) == len(robot.all_frames)
        self.plan = robot.plan(links) if whole else compile_tree(tree, links)
        self.magnitudes = compute_magnitudes(self.plan, x.q, x.v, x.a, FIXED_BASE_STATE)
        # A joint and its child link have the same Jacobian. In the list of frames, the links come first,
        # beginning with the root.
        moving = [i + 1 for i, joint in enumerate(tree.joints) if joint.kind.nv]
        joints = slice(bisect_left(moving, frames.start), bisect_left(moving, frames.stop))
        self.joint_rows = [link - frames.start for link in moving[joints]]
        self.joint_names = robot.joint_names[joints]

    def compare(self, second: SecondOracleModel | None) -> Iterator[tuple[Key, ErrorStats]]:
        """Compare each link's result with Pinocchio's results for the link and for its parent joint.

        A link and its parent joint have the same frame, but Pinocchio has different functions for links and
        joints.
        """
        inputs = self.x.q, self.x.v, self.x.a
        for row in validated_quantities():
            joints = [joint for joint in validated_quantities("joints") if joint.compute is row.compute]
            for reference in row.references:
                results = self.timings.time_call("urdfkin", row.compute_results, self.plan, inputs, reference)
                bound = row.bound(self.plan, self.magnitudes, reference)
                yield self._compare_quantity(row, reference, results, bound, second)
                for joint in joints:
                    joint_results, joint_bound = results[:, self.joint_rows], self.select_joint_bound(bound)
                    yield self._compare_quantity(joint, reference, joint_results, joint_bound, second)

    def select_joint_bound(self, bound: Bound) -> Bound:
        return Bound(bound.scale[:, self.joint_rows], bound.k[:, self.joint_rows])

    def make_query(self, row: Quantity, reference: Reference | None) -> QueryBatch:
        joints = row.object_kind == "joints"
        frames = [JointFrame.of(name) for name in self.joint_names] if joints else self.frames
        inputs = self.x.q, self.x.v, self.x.a
        reference = Reference.LOCAL_WORLD_ALIGNED if reference is None else reference
        return QueryBatch(
            frames, inputs, reference, frames_are_joints=joints, uses_multi_frame_functions=True
        )

    def _compare_quantity(
        self,
        row: Quantity,
        reference: Reference | None,
        results: FloatArray,
        bound: Bound,
        second: SecondOracleModel | None,
    ) -> tuple[Key, ErrorStats]:
        names = self.joint_names if row.object_kind == "joints" else self.frames
        oracle_results = self.timings.time_call(
            "pinocchio", row.ask_oracle, self.oracle, self.make_query(row, reference)
        )
        stats = self._compute_stats(results, oracle_results, bound, names)
        if second is not None:
            stats = replace(
                stats, cross_check=second.cross_check(self, row, reference, results, oracle_results)
            )
        return (row.name, reference.name.lower() if reference is not None else ""), stats


class _ScrewComparison(_Comparison):
    """Comparison of Pinocchio's `data.J` with urdfkin's Jacobians.

    Each column of `data.J` belongs to one joint velocity, and is in WORLD.
    """

    def compare(self) -> Iterator[ErrorStats]:
        robot, x = self.robot, self.x
        tree = without_mimic_rules(robot.tree)
        q_free = _expand_mimic(robot.tree, tree, x.q)
        oracle_results = self.timings.time_call(
            "pinocchio", SCREWS.ask_oracle, self.oracle, QueryBatch((), (x.q,))
        ).swapaxes(1, 2)
        moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
        column = 0
        for block in memory.blocks(len(moving), memory.frame_array_bytes(len(x.q), tree.nv)):
            joints = moving[block]
            width = sum(tree.joints[i].kind.nv for i in joints)
            yield self._compare_joints(tree, q_free, joints, oracle_results[:, column : column + width])
            column += width

    def _compare_joints(
        self, tree: KinematicTree, q: FloatArray, joints: Sequence[int], oracle_results: FloatArray
    ) -> ErrorStats:
        links = [i + 1 for i in joints]
        plan = compile_tree(tree, links)
        zeros = (np.zeros((len(q), tree.nv)),) * 2
        magnitudes = compute_magnitudes(plan, q, *zeros, FIXED_BASE_STATE)
        J = self.timings.time_call("urdfkin", SCREWS.compute_results, plan, (q,), Reference.WORLD)
        bound = SCREWS.bound(plan, magnitudes, Reference.WORLD)
        entries = [
            (f, tree.v_index[i] + c) for f, i in enumerate(joints) for c in range(tree.joints[i].kind.nv)
        ]
        frame, column = np.array(entries, dtype=np.int64).reshape(-1, 2).T
        results = J[:, frame, :, column].swapaxes(0, 1)
        scale = bound.scale[:, frame, :, column].swapaxes(0, 1)
        names = tuple(tree.joints[joints[f]].name for f, _ in entries)
        return self._compute_stats(results, oracle_results, Bound(scale, bound.k[:, frame, 0]), names)


def _expand_mimic(tree: KinematicTree, free_tree: KinematicTree, q: FloatArray) -> FloatArray:
    """Return q for the tree `free_tree`, in which mimic joints are independent joints."""
    expanded = np.empty((len(q), free_tree.nq))
    for joint, at, free_at in zip(tree.joints, tree.q_index, free_tree.q_index, strict=True):
        values = q[:, at : at + joint.kind.nq]
        if joint.mimic:
            values = joint.mimic.multiplier * values + joint.mimic.offset
        expanded[:, free_at : free_at + joint.kind.nq] = values
    return expanded


_Models = tuple[Robot, Oracle, SecondOracleModel | None]
#: The cache contains only the latest robot, because two large robots would need too much memory. This is
#: enough, because a worker gets the chunks of a robot one after another.
_cache: dict[RobotInput, _Models] = {}


def _load_models(chunk: Chunk) -> _Models:
    if (models := _cache.get(chunk.robot_input)) is not None:
        return models
    _cache.clear()
    robot = chunk.robot_input.load()
    memory_limit = memory.limit() if chunk.memory_limit is None else chunk.memory_limit
    memory.check(robot.tree, chunk.samples + SPECIAL_SAMPLES, memory_limit)  # The first chunk is the largest.
    second = None
    if (library := robot.verifier.library) is not PINOCCHIO:
        second = SecondOracleModel(library, robot.verifier.oracle(library=library))
    models = robot, robot.verifier.oracle(), second
    _cache[chunk.robot_input] = models
    return models


def run_chunk(chunk: Chunk) -> ChunkResult:
    begin, timings = time.perf_counter(), Timings()
    robot, oracle, second = _load_models(chunk)
    summary = RobotSummary.of(robot, oracle) if chunk.index == 0 else None
    timings.read = time.perf_counter() - begin
    error_stats = compare_robot(robot, oracle, chunk.draw(robot.tree), chunk.first_sample, timings, second)
    seconds = time.perf_counter() - begin
    timings.close(seconds)
    return ChunkResult(
        name=robot.name,
        joints=robot.joint_names,
        frames=robot.all_frames,
        error_stats=error_stats,
        samples=chunk.configuration_count,
        seconds=seconds,
        timings=timings,
        summary=summary,
    )
