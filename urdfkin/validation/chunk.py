"""Chunks of a validation; a chunk is a range of samples of one robot.

A sample depends only on the seed and on the index of the sample. Inputs and results of a chunk are plain
data. Therefore, a chunk can run in this process, in another process or on another machine. Samples 0, 1 and 2
of a robot are the neutral configuration, the lower limits and the upper limits.

Random samples are drawn 25 at a time, each draw with its own seed. Therefore, the number of draws in a chunk
does not change any result.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from urdfkin.model.configuration import Samples, draw_samples
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.validation import memory
from urdfkin.validation.comparison import SecondOracleModel, tallies
from urdfkin.validation.error_stats import Key, Tally
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import RobotSummary
from urdfkin.validation.timings import Timings
from urdfkin.verify.oracle import Oracle
from urdfkin.verify.oracles import PINOCCHIO

#: Number of samples in one draw.
DRAWN = 25
#: Number of special configurations before the random configurations.
SPECIAL = 3
#: A robot with at least 200 samples has at least this number of chunks, so that several workers can share it.
_MIN_CHUNKS = 8
#: Maximum number of draws in a chunk.
#: For a typical robot, 40 draws take one second and give a few kilobytes of results.
_MAX_DRAWS = 40


@dataclass(frozen=True, slots=True)
class Chunk:
    """A range of samples of one robot.

    `first` is the index of the chunk's first draw, and `samples` is the number of random configurations. The
    check of the robot may use `memory` bytes; None means half of the machine's free memory.
    """

    subject: RobotInput
    seed: int
    index: int
    first: int
    samples: int
    memory: int | None = field(default=None, compare=False)

    @property
    def configurations(self) -> int:
        return self.samples + (SPECIAL if self.first == 0 else 0)

    @property
    def first_sample(self) -> int:
        return 0 if self.first == 0 else SPECIAL + self.first * DRAWN

    def draw(self, tree: KinematicTree) -> Samples:
        drawn = [self._draw(tree, i) for i in range(max(1, -(-self.samples // DRAWN)))]
        return Samples(*(np.concatenate([getattr(x, name) for x in drawn]) for name in ("q", "v", "a")))

    def _draw(self, tree: KinematicTree, i: int) -> Samples:
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.first + i,)))
        samples = min(DRAWN, self.samples - i * DRAWN)
        return draw_samples(tree, samples, rng, with_special=self.first + i == 0)


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """Result of a chunk, or the sum of the results of adjacent chunks of one robot.

    `summary` is None if the first chunk is not included.
    """

    name: str
    joints: tuple[str, ...]
    frames: tuple[str, ...]
    tallies: dict[Key, Tally]
    samples: int
    seconds: float
    timings: Timings
    summary: RobotSummary | None

    def __add__(self, other: ChunkResult) -> ChunkResult:
        return ChunkResult(
            name=self.name,
            joints=self.joints,
            frames=self.frames,
            tallies={key: tally + other.tallies[key] for key, tally in self.tallies.items()},
            samples=self.samples + other.samples,
            seconds=self.seconds + other.seconds,
            timings=self.timings + other.timings,
            summary=self.summary or other.summary,
        )


@dataclass(frozen=True, slots=True)
class Cut:
    """Division of each robot's samples into chunks, which depends only on the number of samples.

    >>> len(Cut(1000)), len(Cut(10_000)), len(Cut(1_000_000)), len(Cut(0))
    (8, 10, 1000, 1)
    """

    samples: int

    @property
    def _draws(self) -> int:
        return min(_MAX_DRAWS, max(1, -(-self.samples // DRAWN) // _MIN_CHUNKS))

    def __len__(self) -> int:
        """Number of chunks of a robot: at least one, because the special configurations need a chunk."""
        return max(1, -(-self.samples // (self._draws * DRAWN)))

    def chunk(self, subject: RobotInput, seed: int, index: int, most: int | None = None) -> Chunk:
        first = index * self._draws
        samples = min(self._draws * DRAWN, self.samples - first * DRAWN)
        return Chunk(subject, seed, index, first, samples, most)

    def configurations(self, chunks: range) -> int:
        """Return the number of samples in a range of chunks, including the special configurations."""
        if not chunks:
            return 0
        size = self._draws * DRAWN
        random = min(self.samples, chunks.stop * size) - chunks.start * size
        return random + (SPECIAL if chunks.start == 0 else 0)


def chunks(subject: RobotInput, samples: int, seed: int) -> Iterator[Chunk]:
    cut = Cut(samples)
    return (cut.chunk(subject, seed, index) for index in range(len(cut)))


_Models = tuple[Robot, Oracle, SecondOracleModel | None]
#: Cache of the latest robot, because a worker gets the chunks of a robot one after another.
#: Two large robots at a time would need too much memory.
_cache: dict[RobotInput, _Models] = {}


def _load(chunk: Chunk) -> _Models:
    if (found := _cache.get(chunk.subject)) is not None:
        return found
    _cache.clear()
    robot = chunk.subject.load()
    most = memory.limit() if chunk.memory is None else chunk.memory
    memory.check(robot.tree, chunk.samples + SPECIAL, most)  # The first chunk is the largest.
    second = None
    if (by := robot.verifier.library) is not PINOCCHIO:
        second = SecondOracleModel(by, robot.verifier.oracle(by=by))
    found = robot, robot.verifier.oracle(), second
    _cache[chunk.subject] = found
    return found


def run_chunk(chunk: Chunk) -> ChunkResult:
    begin, timings = time.perf_counter(), Timings()
    robot, oracle, second = _load(chunk)
    summary = RobotSummary.of(robot, oracle) if chunk.index == 0 else None
    timings.read = time.perf_counter() - begin
    found = tallies(robot, oracle, chunk.draw(robot.tree), chunk.first_sample, timings, second)
    seconds = time.perf_counter() - begin
    timings.close(seconds)
    return ChunkResult(
        name=robot.name,
        joints=robot.joint_names,
        frames=robot.all_frames,
        tallies=found,
        samples=chunk.configurations,
        seconds=seconds,
        timings=timings,
        summary=summary,
    )
