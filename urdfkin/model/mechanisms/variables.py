"""The joint values of both models as linear functions of shared variables, and the ranges of the variables.

A's coordinates are variables. B's coordinates follow from them by the senses and zeros of the joints. So each
joint value of either model is a constant plus a multiple of one variable. A motion that only B has is a
variable of its own: a mimic joint that is independent in B, or a joint that is fixed in A.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from urdfkin.model.mechanisms.alignment import Alignment, Step
from urdfkin.model.mechanisms.mechanism import Tolerance
from urdfkin.model.tree import FloatArray, Joint, JointKind


@dataclass(frozen=True, slots=True)
class Line:
    """constant + slope * variable; the variable has no meaning if the slope is 0."""

    variable: str
    slope: float
    constant: float

    def moved(self, slope: float, constant: float) -> Line:
        """Return the line slope * self + constant."""
        return Line(self.variable, slope * self.slope, slope * self.constant + constant)

    def at(self, values: Mapping[str, float | FloatArray]) -> float | FloatArray:
        """Return the value of the line."""
        return self.constant + (self.slope * values[self.variable] if self.slope else 0.0)


@dataclass(frozen=True, slots=True)
class Pair:
    """The values of one step's joint in both models, both as A's coordinate."""

    a: Line
    b: Line
    #: The value in B's own coordinate: sense * b + offset.
    written: Line
    #: Difference of the constants (rad or m) that counts as rounding, beyond that of one step.
    rounding: float = 0.0

    @property
    def variable(self) -> str | None:
        """The one variable that moves both; None if there are two."""
        if self.a.slope and self.b.slope and self.a.variable != self.b.variable:
            return None
        return self.a.variable if self.a.slope else self.b.variable


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """The values of all steps and the ranges of the variables.

    Attributes:
        pairs: For each step; None for planar and floating joints.
        ranges: Of each variable, rad or m; infinite without a limit.
        freer_a: Steps (indices) with a joint that is independent in A and a mimic joint in B.
        freer_b: Steps (indices) with a joint that is independent in B and a mimic joint in A.
        rules: Steps (indices) with different mimic rules in A and B.
        leaders: B's coordinates, by joint name.
    """

    pairs: tuple[Pair | None, ...]
    ranges: dict[str, tuple[float, float]]
    freer_a: tuple[int, ...]
    freer_b: tuple[int, ...]
    rules: tuple[int, ...]
    leaders: dict[str, Line]

    def range(self, line: Line) -> tuple[float, float]:
        """Return the smallest and the largest value of a line."""
        if not line.slope:
            return line.constant, line.constant
        ends = sorted(line.slope * end + line.constant for end in self.ranges[line.variable])
        return ends[0], ends[1]

    def off(self, pair: Pair) -> float:
        """Return the largest difference (rad, m) between a joint's values in A and B."""
        if (variable := pair.variable) is not None:
            low, high = self.range(
                Line(variable, pair.b.slope - pair.a.slope, pair.b.constant - pair.a.constant)
            )
        else:
            (a_low, a_high), (b_low, b_high) = self.range(pair.a), self.range(pair.b)
            low, high = b_low - a_high, b_high - a_low
        return max(abs(low), abs(high))


def variables_of(found: Alignment, tolerance: Tolerance) -> Variables:
    """Return the values of all steps of an alignment, and the ranges of their variables."""
    return _Maker(found, tolerance).make()


class _Maker:
    def __init__(self, found: Alignment, tolerance: Tolerance) -> None:
        self.found, self.tolerance = found, tolerance
        self.trees = found.a.tree, found.b.tree
        self.step_of_b = {step.b: i for i, step in enumerate(found.steps)}
        self.leaders = self._leaders()
        self.deepest = found.deepest

    def _leaders(self) -> dict[str, Line]:
        """Return each coordinate of B as a line in A's, or as its own variable.

        A's independent joints come first.
        """
        tree, used, lines = self.trees[1], set[str](), dict[str, Line]()
        own = [i for i, joint in enumerate(tree.joints) if joint.kind.nq == 1 and joint.mimic is None]
        followers_last = sorted(own, key=self._follows_in_a)
        for i in followers_last:
            name = tree.joints[i].name
            lines[name] = Line(f"b:{name}", 1.0, 0.0)
            step = self._step(i)
            if step is None or step.unlike:
                continue
            value = self._a(step)
            if value.slope and value.variable not in used:
                used.add(value.variable)
                lines[name] = value.moved(step.sense, step.offset)
        return lines

    def _step(self, joint_b: int) -> Step | None:
        at = self.step_of_b.get(joint_b)
        return None if at is None else self.found.steps[at]

    def _follows_in_a(self, joint_b: int) -> bool:
        step = self._step(joint_b)
        return step is not None and self.trees[0].joints[step.a].mimic is not None

    def _a(self, step: Step) -> Line:
        joint = self.trees[0].joints[step.a]
        if joint.kind is JointKind.FIXED:
            return Line("", 0.0, 0.0)
        if joint.mimic is None:
            return Line(f"a:{joint.name}", 1.0, 0.0)
        return Line(f"a:{joint.mimic.leader}", joint.mimic.multiplier, joint.mimic.offset)

    def _b(self, step: Step) -> Line:
        joint = self.trees[1].joints[step.b]
        if joint.kind is JointKind.FIXED:
            return Line("", 0.0, 0.0)
        if joint.mimic is None:
            return self.leaders[joint.name]
        return self.leaders[joint.mimic.leader].moved(joint.mimic.multiplier, joint.mimic.offset)

    def make(self) -> Variables:
        pairs, freer_a, freer_b, rules = list[Pair | None](), list[int](), list[int](), list[int]()
        for i, step in enumerate(self.found.steps):
            if step.kind in ("planar", "floating") or step.unlike == "kind":
                pairs.append(None)
                continue
            a, written = self._a(step), self._b(step)
            b = written.moved(step.sense, -step.sense * step.offset)
            follow = [
                tree.joints[j].mimic is not None for tree, j in zip(self.trees, (step.a, step.b), strict=True)
            ]
            beyond = 0.0
            if self._alike(a, b):
                beyond = max(0.0, abs(a.constant - b.constant) - self._one_step(a))
                b = a
            elif not step.unlike:
                (
                    freer_a if follow == [False, True] else freer_b if follow == [True, False] else rules
                ).append(i)
            pairs.append(Pair(a, b, written, beyond))
        ranges = self._ranges(pairs)
        return Variables(tuple(pairs), ranges, tuple(freer_a), tuple(freer_b), tuple(rules), self.leaders)

    def _alike(self, a: Line, b: Line) -> bool:
        """Return whether two lines differ by rounding only; a slope counts for a turn or a metre.

        A rule's constant compares the zeros of two joints. Each zero is found from poses at the end of a
        path, which are as inexact as all steps of the path together. A slope depends on no zero: the
        rounding of one step is its bound.
        """
        same = a.variable == b.variable or not (a.slope or b.slope)
        one = self._one_step(a)
        return same and abs(a.slope - b.slope) <= one and abs(a.constant - b.constant) <= self.deepest * one

    def _one_step(self, line: Line) -> float:
        return self.tolerance.angle * max(1.0, abs(line.slope), abs(line.constant))

    def _ranges(self, pairs: list[Pair | None]) -> dict[str, tuple[float, float]]:
        """Return the limits of each coordinate.

        They are the intersection of both models' limits if it moves joints of both; A's if that is empty. A
        mimic joint obeys its rule, not its limits: its limits count only for a coordinate without limits.
        """
        first: dict[str, tuple[float, float]] = {}
        own: dict[str, tuple[float, float]] = {}
        mimic: dict[str, tuple[float, float]] = {}
        for step, pair in zip(self.found.steps, pairs, strict=True):
            for k, j in enumerate((step.a, step.b)):
                joint = self.trees[k].joints[j]
                if pair is None:  # joints of two kinds, each with its own coordinate
                    if step.unlike and joint.nq == 1:
                        own[f"{'ab'[k]}:{joint.name}"] = limits(joint)
                    continue
                if not (line := (pair.a, pair.written)[k]).slope:
                    continue
                ends = sorted((end - line.constant) / line.slope for end in limits(joint))
                held = own if joint.mimic is None else mimic
                low, high = held.get(line.variable, (-math.inf, math.inf))
                held[line.variable] = max(low, ends[0]), min(high, ends[1])
                if joint.mimic is None and (k == 0 or line.variable not in first):
                    first[line.variable] = ends[0], ends[1]
        ranges = dict[str, tuple[float, float]]()
        for name in own | mimic:
            found, other = own.get(name, (-math.inf, math.inf)), mimic.get(name, (-math.inf, math.inf))
            if not found[0] < found[1]:
                found = first.get(name, found)
            without = math.isinf(found[0]) and math.isinf(found[1]) and other[0] < other[1]
            ranges[name] = other if without else found
        return ranges


def limits(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint's value; infinite without limits."""
    if joint.kind is JointKind.CONTINUOUS or joint.limit is None:
        return -math.inf, math.inf
    low, high = sorted((joint.limit.lower, joint.limit.upper))
    return low, high
