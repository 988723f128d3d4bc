"""One chunk of a validation: a robot and a run of samples that depend on the seed and the chunk alone.

A chunk is plain data in and plain data out, so that it can run in this process, in another or on another
machine. Samples 0, 1, 2 of a robot are the neutral configuration and the two ends of the limits.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from urdfkin.lint import UrdfWarning
from urdfkin.loading import load
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.origin import Origin
from urdfkin.validation import memory
from urdfkin.validation.clock import Clock
from urdfkin.validation.comparing import SecondWitness, tallies
from urdfkin.validation.portrait import Portrait
from urdfkin.validation.tally import Key, Tally
from urdfkin.verify.pinocchio import Oracle, OracleError
from urdfkin.verify.sampling import Samples, draw
from urdfkin.verify.witnesses import PINOCCHIO

#: Samples in a chunk: small enough to spread a single robot over many workers.
CHUNK_SAMPLES = 25
#: How many special configurations come before the random ones.
SPECIAL = 3


@dataclass(frozen=True, slots=True)
class Subject:
    """A robot to validate, as plain data.

    Attributes:
        source: What `load` takes: a path, a catalogue name or the URDF itself.
        origin: Where it comes from, also where `source` is the URDF itself, and how it was asked for.
        stamp: Differs between two states of the same file.
    """

    source: str | bytes
    origin: Origin
    stamp: str = ""

    @classmethod
    def of(cls, robot: Robot) -> Subject:
        """A robot that was loaded already."""
        source = robot.source if robot.source in catalogue() else robot.urdf.encode()
        return cls(source, robot.origin)

    @property
    def label(self) -> str:
        """How to call it while it is not loaded."""
        return self.origin.source

    def read(self) -> Robot:
        """The robot; its warnings are in its portrait."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            robot = load(
                self.source,
                mimic=self.origin.mimic,
                root_joint=self.origin.root_joint,
                oracle=self.origin.oracle or PINOCCHIO.name,
            )
        robot.verifier.origin = self.origin  # what was read here may be the text of a file
        return robot

    def load(self) -> Robot:
        """The robot, to be checked.

        Raises:
            OracleError: a finding says that Pinocchio refuses it or reads another robot.
        """
        robot = self.read()
        if robot.verifier.unverifiable is not None:
            raise OracleError(robot.verifier.unverifiable, where=self.label)
        return robot


@dataclass(frozen=True, slots=True)
class Chunk:
    """Which samples of which robot.

    Attributes:
        subject: The robot.
        seed: What samples are drawn from, with the index.
        index: The chunk's place among the robot's.
        samples: Random configurations.
        memory: Bytes that the robot may take where it is run; None: half of what is free there.
    """

    subject: Subject
    seed: int
    index: int
    samples: int
    memory: int | None = field(default=None, compare=False)

    @property
    def configurations(self) -> int:
        """How many samples it has, the special ones included."""
        return self.samples + (SPECIAL if self.index == 0 else 0)

    @property
    def first_sample(self) -> int:
        """The number of the chunk's first sample."""
        return 0 if self.index == 0 else SPECIAL + self.index * CHUNK_SAMPLES

    def draw(self, tree: KinematicTree) -> Samples:
        """The samples; the same for every machine and every number of workers."""
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.index,)))
        return draw(tree, self.samples, rng, with_special=self.index == 0)


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """What a chunk found, about whom, and how long it took; the first chunk also says what it is."""

    name: str
    joints: tuple[str, ...]
    frames: tuple[str, ...]
    tallies: dict[Key, Tally]
    seconds: float
    clock: Clock
    portrait: Portrait | None


def chunks(subject: Subject, samples: int, seed: int, most: int | None = None) -> Iterator[Chunk]:
    """The chunks of one robot; at least one, for the special configurations."""
    for index in range(max(1, -(-samples // CHUNK_SAMPLES))):
        yield Chunk(subject, seed, index, min(CHUNK_SAMPLES, samples - index * CHUNK_SAMPLES), most)


#: The robot that was checked last. The chunks of a robot come one after another; a worker need not read it
#: again for each, and two large ones at a time would be too much.
_kept: dict[Subject, tuple[Robot, Oracle, SecondWitness | None]] = {}


def _loaded(chunk: Chunk) -> tuple[Robot, Oracle, SecondWitness | None]:
    if (found := _kept.get(chunk.subject)) is not None:
        return found
    _kept.clear()
    robot = chunk.subject.load()
    most = memory.share() if chunk.memory is None else chunk.memory
    memory.demand(robot.tree, CHUNK_SAMPLES + SPECIAL, most)
    second = None
    if (by := robot.verifier.witness) is not PINOCCHIO:
        second = SecondWitness(by, robot.verifier.oracle(by=by))
    found = robot, robot.verifier.oracle(), second
    _kept[chunk.subject] = found
    return found


def run_chunk(chunk: Chunk) -> ChunkResult:
    """Compute every quantity of every frame in all references, and compare."""
    begin, clock = time.perf_counter(), Clock()
    robot, oracle, second = _loaded(chunk)
    portrait = Portrait.of(robot, oracle) if chunk.index == 0 else None
    clock.read = time.perf_counter() - begin
    found = tallies(robot, oracle, chunk.draw(robot.tree), chunk.first_sample, clock, second)
    seconds = time.perf_counter() - begin
    clock.close(seconds)
    return ChunkResult(
        name=robot.name,
        joints=robot.joint_names,
        frames=robot.all_frames,
        tallies=found,
        seconds=seconds,
        clock=clock,
        portrait=portrait,
    )
