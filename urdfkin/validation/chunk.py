"""One chunk of a validation: a robot and a run of samples that depend on the seed and their place alone.

A chunk is plain data in and plain data out, so that it can run in this process, in another or on another
machine. Samples 0, 1, 2 of a robot are the neutral configuration and the two ends of the limits.

Samples are drawn 25 at a time, each draw from its own number; a chunk holds several draws and compares them
together, so that how many it holds changes no number, only what it costs to hand it out and to keep it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.validation import memory
from urdfkin.validation.comparison import SecondWitness, tallies
from urdfkin.validation.error_stats import Key, Tally
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import RobotSummary
from urdfkin.validation.timings import Clock, total
from urdfkin.verify.oracles import PINOCCHIO
from urdfkin.verify.pinocchio import Oracle
from urdfkin.verify.sampling import Samples, draw

#: Samples that are drawn together.
DRAWN = 25
#: How many special configurations come before the random ones.
SPECIAL = 3
#: A robot has so many chunks, that several workers find work in it,
_CHUNKS = 8
#: or more, of so many draws: a second's work on a usual robot, some kilobytes of results.
_DRAWS = 40


@dataclass(frozen=True, slots=True)
class Chunk:
    """Which samples of which robot.

    Attributes:
        subject: The robot.
        seed: What samples are drawn from, with the number of the draw.
        index: The chunk's place among the robot's.
        first: Its first draw.
        samples: Random configurations.
        memory: Bytes that the robot may take where it is run; None: half of what is free there.
    """

    subject: RobotInput
    seed: int
    index: int
    first: int
    samples: int
    memory: int | None = field(default=None, compare=False)

    @property
    def configurations(self) -> int:
        """How many samples it has, the special ones included."""
        return self.samples + (SPECIAL if self.first == 0 else 0)

    @property
    def first_sample(self) -> int:
        """The number of the chunk's first sample."""
        return 0 if self.first == 0 else SPECIAL + self.first * DRAWN

    def draw(self, tree: KinematicTree) -> Samples:
        """The samples; the same for every machine, every number of workers and every cut."""
        drawn = [self._draw(tree, i) for i in range(max(1, -(-self.samples // DRAWN)))]
        return Samples(*(np.concatenate([getattr(x, name) for x in drawn]) for name in ("q", "v", "a")))

    def _draw(self, tree: KinematicTree, i: int) -> Samples:
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.first + i,)))
        samples = min(DRAWN, self.samples - i * DRAWN)
        return draw(tree, samples, rng, with_special=self.first + i == 0)


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """What was found, about whom, and how long it took; the first chunk also says what the robot is.

    Results add up: those of neighbouring chunks to that of both.
    """

    name: str
    joints: tuple[str, ...]
    frames: tuple[str, ...]
    tallies: dict[Key, Tally]
    samples: int
    seconds: float
    clock: Clock
    portrait: RobotSummary | None

    def __add__(self, other: ChunkResult) -> ChunkResult:
        return ChunkResult(
            name=self.name,
            joints=self.joints,
            frames=self.frames,
            tallies={key: tally + other.tallies[key] for key, tally in self.tallies.items()},
            samples=self.samples + other.samples,
            seconds=self.seconds + other.seconds,
            clock=total((self.clock, other.clock)),
            portrait=self.portrait or other.portrait,
        )


@dataclass(frozen=True, slots=True)
class Cut:
    """How the samples of each robot are cut into chunks: by their number alone, whoever runs them.

    >>> len(Cut(1000)), len(Cut(10_000)), len(Cut(1_000_000)), len(Cut(0))
    (8, 10, 1000, 1)
    """

    samples: int

    @property
    def _draws(self) -> int:
        """Of a chunk."""
        return min(_DRAWS, max(1, -(-self.samples // DRAWN) // _CHUNKS))

    def __len__(self) -> int:
        """Chunks of a robot; at least one, for the special configurations."""
        return max(1, -(-self.samples // (self._draws * DRAWN)))

    def chunk(self, subject: RobotInput, seed: int, index: int, most: int | None = None) -> Chunk:
        """One of them, for a robot that may take so many bytes."""
        first = index * self._draws
        samples = min(self._draws * DRAWN, self.samples - first * DRAWN)
        return Chunk(subject, seed, index, first, samples, most)

    def configurations(self, chunks: range) -> int:
        """How many samples a run of chunks has."""
        if not chunks:
            return 0
        size = self._draws * DRAWN
        random = min(self.samples, chunks.stop * size) - chunks.start * size
        return random + (SPECIAL if chunks.start == 0 else 0)


def chunks(subject: RobotInput, samples: int, seed: int, most: int | None = None) -> Iterator[Chunk]:
    """The chunks of one robot."""
    cut = Cut(samples)
    return (cut.chunk(subject, seed, index, most) for index in range(len(cut)))


#: The robot that was checked last. The chunks of a robot come one after another; a worker need not read it
#: again for each, and two large ones at a time would be too much.
_kept: dict[RobotInput, tuple[Robot, Oracle, SecondWitness | None]] = {}


def _loaded(chunk: Chunk) -> tuple[Robot, Oracle, SecondWitness | None]:
    if (found := _kept.get(chunk.subject)) is not None:
        return found
    _kept.clear()
    robot = chunk.subject.load()
    most = memory.share() if chunk.memory is None else chunk.memory
    memory.demand(robot.tree, chunk.samples + SPECIAL, most)  # no chunk of it is larger than its first
    second = None
    if (by := robot.verifier.witness) is not PINOCCHIO:
        second = SecondWitness(by, robot.verifier.oracle(by=by))
    found = robot, robot.verifier.oracle(), second
    _kept[chunk.subject] = found
    return found


def run_chunk(chunk: Chunk) -> ChunkResult:
    """Compute what is compared of every frame, in all references, and compare it."""
    begin, clock = time.perf_counter(), Clock()
    robot, oracle, second = _loaded(chunk)
    portrait = RobotSummary.of(robot, oracle) if chunk.index == 0 else None
    clock.read = time.perf_counter() - begin
    found = tallies(robot, oracle, chunk.draw(robot.tree), chunk.first_sample, clock, second)
    seconds = time.perf_counter() - begin
    clock.close(seconds)
    return ChunkResult(
        name=robot.name,
        joints=robot.joint_names,
        frames=robot.all_frames,
        tallies=found,
        samples=chunk.configurations,
        seconds=seconds,
        clock=clock,
        portrait=portrait,
    )
