"""One chunk of a validation: a robot and a run of samples that depend on the seed and the chunk alone.

A chunk is plain data in and plain data out, so that it can run in this process, in another or on another
machine. Samples 0, 1, 2 of a robot are the neutral configuration and the two ends of the limits.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from urdfkin.catalogue import catalogue
from urdfkin.diagnostics import UrdfWarning
from urdfkin.loading import load
from urdfkin.oracle import Oracle, OracleError
from urdfkin.origin import Origin
from urdfkin.recursion import evaluate
from urdfkin.recursion.base import STILL_STATE
from urdfkin.recursion.plan import Plan, make_plan
from urdfkin.reference import Reference
from urdfkin.robot import Robot
from urdfkin.tree import FloatArray, KinematicTree, freed
from urdfkin.validation.clock import Clock
from urdfkin.validation.portrait import Portrait
from urdfkin.validation.tally import Key, Tally, tally
from urdfkin.verification import bounds
from urdfkin.verification.bounds import Bound, Quantity
from urdfkin.verification.magnitudes import magnitudes
from urdfkin.verification.sampling import Samples, draw

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
            robot = load(self.source, mimic=self.origin.mimic, root_joint=self.origin.root_joint)
        robot.origin = self.origin  # what was read here may be the text of a file
        return robot

    def load(self) -> Robot:
        """The robot, to be checked.

        Raises:
            OracleError: a finding says that Pinocchio refuses it or reads another robot.
        """
        robot = self.read()
        if robot.unverifiable is not None:
            raise OracleError(robot.unverifiable, where=self.label)
        return robot


@dataclass(frozen=True, slots=True)
class Chunk:
    """Which samples of which robot."""

    subject: Subject
    seed: int
    index: int
    samples: int

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


def chunks(subject: Subject, samples: int, seed: int) -> Iterator[Chunk]:
    """The chunks of one robot; at least one, for the special configurations."""
    for index in range(max(1, -(-samples // CHUNK_SAMPLES))):
        yield Chunk(subject, seed, index, min(CHUNK_SAMPLES, samples - index * CHUNK_SAMPLES))


@lru_cache(maxsize=2)
def _loaded(subject: Subject) -> tuple[Robot, Oracle, Plan]:
    # The chunks of a robot come one after another; a worker need not read it again for each.
    robot = subject.load()
    links = tuple(robot.tree.frame_link(frame) for frame in robot.all_frames)
    return robot, robot.oracle(None), robot.plan(links)


def run_chunk(chunk: Chunk) -> ChunkResult:
    """Compute every quantity of every frame in all references, and compare."""
    begin, clock = time.perf_counter(), Clock()
    robot, oracle, plan = _loaded(chunk.subject)
    portrait = Portrait.of(robot, oracle) if chunk.index == 0 else None
    clock.read = time.perf_counter() - begin
    work = _Work(robot, oracle, plan, chunk.draw(robot.tree), chunk.first_sample, clock)
    tallies = dict(work.tallies())
    seconds = time.perf_counter() - begin
    clock.close(seconds)
    return ChunkResult(
        name=robot.name,
        joints=robot.joint_names,
        frames=robot.all_frames,
        tallies=tallies,
        seconds=seconds,
        clock=clock,
        portrait=portrait,
    )


class _Work:
    """The comparisons of one chunk."""

    def __init__(
        self, robot: Robot, oracle: Oracle, plan: Plan, x: Samples, first_sample: int, clock: Clock
    ) -> None:
        self.robot, self.oracle, self.plan, self.x, self.first = robot, oracle, plan, x, first_sample
        self.clock = clock
        self.size = magnitudes(plan, x.q, x.v, x.a, STILL_STATE)

    def tallies(self) -> Iterator[tuple[Key, Tally]]:
        x, oracle, plan, frames = self.x, self.oracle, self.plan, self.robot.all_frames
        theirs = self.clock.theirs(oracle.placements, x.q, frames)
        ours = self.clock.ours(evaluate.placements, plan, x.q)
        yield self._tally(Quantity.PLACEMENT, None, ours, theirs, bounds.placement_bound(self.size), frames)
        for reference in Reference:
            velocity = self.clock.ours(evaluate.velocities, plan, x.q, x.v, reference)
            theirs = self.clock.theirs(oracle.velocities, x.q, x.v, frames, [reference])[:, :, 0]
            bound = bounds.velocity_bound(self.size, reference)
            yield self._tally(Quantity.VELOCITY, reference, velocity, theirs, bound, frames)
            acceleration = self.clock.ours(evaluate.accelerations, plan, x.q, x.v, x.a, reference)
            theirs = self.clock.theirs(oracle.accelerations, x.q, x.v, x.a, frames, [reference])[:, :, 0]
            bound = bounds.acceleration_bound(self.size, reference)
            yield self._tally(Quantity.ACCELERATION, reference, acceleration, theirs, bound, frames)
            yield from self._jacobians(reference)
            yield from self._jacobian_rates(reference)
        yield self._screws()

    def _jacobians(self, reference: Reference) -> Iterator[tuple[Key, Tally]]:
        q, frames, tree = self.x.q, self.robot.all_frames, self.robot.tree
        ours = self.clock.ours(evaluate.jacobians, self.plan, q, reference)
        theirs = self.clock.theirs(self.oracle.jacobians, q, frames, [reference])[:, :, 0]
        bound = bounds.jacobian_bound(self.plan, self.size, reference)
        yield self._tally(Quantity.JACOBIAN, reference, ours, theirs, bound, frames)
        moving = [i + 1 for i, joint in enumerate(tree.joints) if joint.kind.nv]
        part = Bound(bound.scale[:, moving], bound.k[:, moving])
        theirs = self.clock.theirs(self.oracle.joint_jacobians, q, [reference])[:, :, 0]
        yield self._tally(
            Quantity.JOINT_JACOBIAN, reference, ours[:, moving], theirs, part, self.robot.joint_names
        )

    def _jacobian_rates(self, reference: Reference) -> Iterator[tuple[Key, Tally]]:
        q, v, frames, tree = self.x.q, self.x.v, self.robot.all_frames, self.robot.tree
        ours = self.clock.ours(evaluate.jacobian_rates, self.plan, q, v, reference)
        theirs, of_joints = self.clock.theirs(self.oracle.jacobian_rates_of_all, q, v, frames, reference)
        bound = bounds.jacobian_rate_bound(self.plan, self.size, reference)
        yield self._tally(Quantity.JACOBIAN_RATE, reference, ours, theirs, bound, frames)
        moving = [i + 1 for i, joint in enumerate(tree.joints) if joint.kind.nv]
        part = Bound(bound.scale[:, moving], bound.k[:, moving])
        yield self._tally(
            Quantity.JOINT_JACOBIAN_RATE,
            reference,
            ours[:, moving],
            of_joints,
            part,
            self.robot.joint_names,
        )

    def _screws(self) -> tuple[Key, Tally]:
        """The whole `data.J`: each rate's column is its own joint's Jacobian column, seen from WORLD."""
        tree = freed(self.robot.tree)
        q_free = _leaders_spread(self.robot.tree, tree, self.x.q)
        moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
        plan = make_plan(tree, [i + 1 for i in moving])
        size = magnitudes(plan, q_free, *(np.zeros((len(q_free), tree.nv)),) * 2, STILL_STATE)
        J = self.clock.ours(evaluate.jacobians, plan, q_free, Reference.WORLD)
        bound = bounds.jacobian_bound(plan, size, Reference.WORLD)
        own = [(f, tree.v_index[i] + c) for f, i in enumerate(moving) for c in range(tree.joints[i].kind.nv)]
        frame, column = np.array(own, dtype=np.int64).reshape(-1, 2).T
        ours = J[:, frame, :, column].swapaxes(0, 1)
        scale = bound.scale[:, frame, :, column].swapaxes(0, 1)
        theirs = self.clock.theirs(self.oracle.screws, self.x.q).swapaxes(1, 2)
        names = tuple(tree.joints[moving[f]].name for f, _ in own)
        return self._tally(
            Quantity.SCREWS, Reference.WORLD, ours, theirs, Bound(scale, bound.k[:, frame, 0]), names
        )

    def _tally(
        self,
        quantity: Quantity,
        reference: Reference | None,
        ours: FloatArray,
        theirs: FloatArray,
        bound: Bound,
        names: tuple[str, ...],
    ) -> tuple[Key, Tally]:
        inputs = [(row_q.tolist(), row_v.tolist(), row_a.tolist()) for row_q, row_v, row_a in self._rows()]
        key = quantity, reference.name.lower() if reference is not None else ""
        return key, tally(ours, theirs, bound, names, self.first, inputs)

    def _rows(self) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        return zip(self.x.q, self.x.v, self.x.a, strict=True)


def _leaders_spread(tree: KinematicTree, free: KinematicTree, q: FloatArray) -> FloatArray:
    """The configuration of the freed tree in which every follower stands where its leader puts it."""
    spread = np.empty((len(q), free.nq))
    for joint, at, free_at in zip(tree.joints, tree.q_index, free.q_index, strict=True):
        own = q[:, at : at + joint.kind.nq]
        if joint.mimic:
            own = joint.mimic.multiplier * own + joint.mimic.offset
        spread[:, free_at : free_at + joint.kind.nq] = own
    return spread
