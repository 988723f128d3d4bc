"""Whose last digits are right: the true errors of urdfkin and of Pinocchio, in eps * scale.

The judge's values are right to fifty digits; the scale is the one that verification uses, so that the
numbers can be set beside a report's.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.exact import recursion as exact_recursion
from urdfkin.exact.decimals import ExactJoint, read_exact
from urdfkin.exact.vectors import Number, exact
from urdfkin.recursion import evaluate
from urdfkin.recursion.base import STILL_STATE
from urdfkin.reference import Reference
from urdfkin.robot import Robot
from urdfkin.tree import FloatArray
from urdfkin.verification import bounds
from urdfkin.verification.bounds import EPS, LEAST_UNIT, Quantity
from urdfkin.verification.magnitudes import magnitudes
from urdfkin.verification.sampling import Samples, draw

#: urdfkin is called the worse when its typical error is more than this many times Pinocchio's.
FACTOR = 2.0


@dataclass(frozen=True, slots=True)
class Errors:
    """True errors of one side, in eps * scale.

    Attributes:
        worst: The largest.
        typical: The root of their mean square.
    """

    worst: float
    typical: float


@dataclass(frozen=True, slots=True)
class Line:
    """One quantity in one reference.

    Attributes:
        quantity: What was judged.
        reference: Its name, empty for placements.
        numbers: How many numbers were compared.
        urdfkin: urdfkin's true errors.
        pinocchio: Pinocchio's.
    """

    quantity: Quantity
    reference: str
    numbers: int
    urdfkin: Errors
    pinocchio: Errors

    @property
    def ours_is_worse(self) -> bool:
        """Whether urdfkin's typical or worst error is more than twice Pinocchio's."""
        return (
            self.urdfkin.typical > FACTOR * self.pinocchio.typical
            or self.urdfkin.worst > FACTOR * self.pinocchio.worst
        )


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the judge found about one robot.

    Attributes:
        robot: Its name.
        samples: How many configurations were judged.
        seed: What they were drawn from.
        lines: One for each quantity and reference.
    """

    robot: str
    samples: int
    seed: int
    lines: tuple[Line, ...]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "robot": self.robot,
            "samples": self.samples,
            "seed": self.seed,
            "lines": [
                {
                    "quantity": line.quantity.value,
                    "reference": line.reference or None,
                    "numbers": line.numbers,
                    "urdfkin": {"worst": line.urdfkin.worst, "typical": line.urdfkin.typical},
                    "pinocchio": {"worst": line.pinocchio.worst, "typical": line.pinocchio.typical},
                }
                for line in self.lines
            ],
        }


def judge(robot: Robot, *, samples: int = 5, seed: int = 0) -> Judgement:
    """Evaluate every link's placement, velocity, Jacobian, its rate and acceleration at 50 digits.

    Args:
        robot: A robot that was loaded.
        samples: Configurations, drawn as `validate` draws its first; each takes a good part of a second.
        seed: The same seed gives the same numbers.

    Raises:
        OracleError: Pinocchio does not accept the robot.
    """
    work = _Work(robot, draw(robot.tree, samples, np.random.default_rng(seed), with_special=False))
    return Judgement(robot.name, samples, seed, tuple(work.lines()))


class _Work:
    """Both sides' doubles, and the judge's digits, for one batch."""

    def __init__(self, robot: Robot, x: Samples) -> None:
        self.tree, self.x = robot.tree, x
        self.links = range(len(robot.tree.links))
        self.frames = robot.tree.link_frames
        self.plan = robot.plan(self.links)
        self.oracle = robot.oracle(None)
        self.size = magnitudes(self.plan, x.q, x.v, x.a, STILL_STATE)
        self.motions = self._motions(read_exact(robot.urdf, robot.tree))

    def _motions(self, joints: Mapping[int, ExactJoint]) -> list[exact_recursion.Motion]:
        rows = zip(self.x.q, self.x.v, self.x.a, strict=True)
        return [
            exact_recursion.move(self.tree, joints, *([exact(number) for number in row] for row in triple))
            for triple in rows
        ]

    def lines(self) -> Iterator[Line]:
        """Quantity by quantity."""
        plan, oracle, x, frames = self.plan, self.oracle, self.x, self.frames
        yield self._line(
            Quantity.PLACEMENT,
            None,
            evaluate.placements(plan, x.q)[:, :, :3],
            oracle.placements(x.q, frames)[:, :, :3],
            bounds.placement_bound(self.size).scale[:, :, :3],
        )
        for reference in Reference:
            ours = evaluate.velocities(plan, x.q, x.v, reference)
            theirs = oracle.velocities(x.q, x.v, frames, [reference])[:, :, 0]
            scale = bounds.velocity_bound(self.size, reference).scale
            yield self._line(Quantity.VELOCITY, reference, ours, theirs, scale)
            ours = evaluate.jacobians(plan, x.q, reference)
            theirs = oracle.jacobians(x.q, frames, [reference])[:, :, 0]
            scale = bounds.jacobian_bound(plan, self.size, reference).scale
            yield self._line(Quantity.JACOBIAN, reference, ours, theirs, scale)
            ours = evaluate.jacobian_rates(plan, x.q, x.v, reference)
            theirs = oracle.jacobian_rates(x.q, x.v, frames, [reference])[:, :, 0]
            scale = bounds.jacobian_rate_bound(plan, self.size, reference).scale
            yield self._line(Quantity.JACOBIAN_RATE, reference, ours, theirs, scale)
            ours = evaluate.accelerations(plan, x.q, x.v, x.a, reference)
            theirs = oracle.accelerations(x.q, x.v, x.a, frames, [reference])[:, :, 0]
            scale = bounds.acceleration_bound(self.size, reference).scale
            yield self._line(Quantity.ACCELERATION, reference, ours, theirs, scale)

    def _line(
        self,
        quantity: Quantity,
        reference: Reference | None,
        ours: FloatArray,
        theirs: FloatArray,
        scale: FloatArray,
    ) -> Line:
        high, low = self._truth(quantity, reference, ours.shape)
        counted = np.broadcast_to(scale, ours.shape) > 0.0
        units = np.maximum(EPS * np.broadcast_to(scale, ours.shape)[counted], LEAST_UNIT)
        # The difference of doubles that are near each other is exact; the rest of the digits follows.
        mine, other = (np.abs((side - high) - low)[counted] / units for side in (ours, theirs))
        name = "" if reference is None else reference.name.lower()
        return Line(quantity, name, int(counted.sum()), _errors(mine), _errors(other))

    def _truth(
        self, quantity: Quantity, reference: Reference | None, shape: tuple[int, ...]
    ) -> tuple[FloatArray, FloatArray]:
        """The exact values as sums of two doubles."""
        high, low = np.zeros(shape), np.zeros(shape)
        for k, motion in enumerate(self.motions):
            for link in self.links:
                rows = _rows(motion, link, quantity, reference)
                for index, value in _entries(rows, transpose=len(shape) == 4 and shape[-2] == 6):
                    high[(k, link, *index)] = nearest = float(value)
                    low[(k, link, *index)] = float(value - exact(nearest))
        return high, low


def _rows(
    motion: exact_recursion.Motion, link: int, quantity: Quantity, reference: Reference | None
) -> Sequence[Any]:
    state = motion.states[link]
    if reference is None:
        return [(*row, place) for row, place in zip(state.R, state.p, strict=True)]
    if quantity is Quantity.VELOCITY:
        return exact_recursion.velocity(state, reference)
    if quantity is Quantity.ACCELERATION:
        return exact_recursion.acceleration(state, reference)
    if quantity is Quantity.JACOBIAN:
        return exact_recursion.jacobian(motion, link, reference)
    return exact_recursion.jacobian_rate(motion, link, reference)


def _entries(rows: Sequence[Any], *, transpose: bool) -> Iterator[tuple[tuple[int, ...], Number]]:
    for i, row in enumerate(rows):
        if isinstance(row, tuple):
            for j, value in enumerate(row):
                yield ((j, i) if transpose else (i, j)), value
        else:
            yield (i,), row


def _errors(units: FloatArray) -> Errors:
    if not units.size:
        return Errors(0.0, 0.0)
    return Errors(float(units.max()), float(np.sqrt((units * units).mean())))
