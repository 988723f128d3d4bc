"""The alignment of two mechanisms A and B: the matched joints and frames, and the differences between them.

The matcher starts from a body of A that corresponds to a body of B. Let G be the rigid motion that moves a
body of A, in A's zero configuration, to the corresponding body of B in B's zero configuration. A joint of A
moves by exp(S t), and the matched joint of B by exp(S' t'). B's coordinate may have the opposite sense and a
different zero. Therefore t' and S' are expressed with A's sense and zero. G changes at a joint if B's axis,
or the body after the joint, has a different pose than in A. B is therefore the same as A, except that a rigid
motion L is inserted before some joints and some axes are different:

    T_A = exp(S_1 t_1) ... exp(S_n t_n) H,      T_B = L_1 exp(S'_1 t'_1) ... L_n exp(S'_n t'_n) L H,

with S'_i = S_i, t'_i = t_i and L_i = 1 for each joint at which A and B agree. The two models have the same
motion if and only if nothing differs. There is one exception: two revolute joints on a common line can divide
the sum of their rotations differently.

**Variables.** The joint values of A and of B are linear functions of shared variables. Each coordinate of A
is a variable. The coordinates of B are computed from these variables, with the senses and zeros of the
joints. Each joint value of A or B is therefore a constant plus a multiple of one variable. A motion that only
B has is a separate variable. Examples are a joint of B that is a mimic joint in A, and a joint of B that is
fixed in A.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from urdfkin.model.mechanisms.mechanism import (
    JointTransform,
    Mechanism,
    Screw,
    Tolerance,
    apart,
    size_of,
    tolerance_of,
)
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray, Joint, JointKind

IDENTITY = np.eye(4)
IDENTITY.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A joint of A and the matched joint of B.

    Attributes:
        a: Joint of A (index in its tree).
        b: Joint of B (index in its tree).
        kind: Kind of motion: "turns" (revolute), "prismatic", "planar" or "floating".
        previous: Index of the step for the joint pair before this one on the path; -1 if there is none.
        sense: +1 if the values of the two joints increase together, -1 if one value decreases while the other
            increases.
        offset: B's value is sense * A's value + offset, rad or m.
        before: (4, 4) the rigid motion L that is inserted before B's joint, in A's zero configuration.
        axis: Screw of A's joint in the zero configuration. The sign of the screw describes the motion of the
            body that is farther from the base.
        other: Screw of B's joint, with the same rule for its sign. If the two screws agree, `other` is the
            same Python object as `axis`.
        tilt: Angle (rad) between the axes of the two joints, or between the normals of two planar joints.
        shift: Distance (m) between the axes of the two joints; for planar or floating joints, between the
            origins of their frames.
        conversion: Converts the coordinates of A's planar or floating joint to those of B's joint; None if
            the coordinates are equal.
        unlike: "a" if the joint is fixed only in A, "b" if it is fixed only in B, "kind" if the kinds of
            motion differ; else "".
    """

    a: int
    b: int
    kind: str
    previous: int
    sense: int
    offset: float
    before: FloatArray
    axis: Screw
    other: Screw
    tilt: float
    shift: float
    unlike: str = ""
    conversion: JointTransform | None = None

    @property
    def differs(self) -> bool:
        """Whether the axes of the two joints differ."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """A link of A and the matched link of B.

    Attributes:
        a: Link of A (index in its tree).
        b: Link of B (index in its tree).
        previous: Index of the step whose joints move the links; -1 if no joint moves them.
        home: (4, 4) pose of A's link in the zero configuration.
        end: (4, 4) the rigid motion L that is inserted behind the last joint, in A's zero configuration.
        tilt: Angle (rad) between the frames of A's link and B's link on the matched body.
        shift: Distance (m) between the origins of these two frames on the matched body.
        tool: (4, 4) pose of B's link in the frame of A's link, if B's link counts as a different end-effector
            frame on the same body.
    """

    a: int
    b: int
    previous: int
    home: FloatArray
    end: FloatArray
    tilt: float
    shift: float
    tool: FloatArray = field(default_factory=lambda: IDENTITY)

    def put_right(self) -> FramePair:
        """Return the same pair, but count B's frame as a different end-effector frame on the same body."""
        tool = inverse(self.home) @ self.end @ self.home
        return replace(self, end=IDENTITY, tilt=0.0, shift=0.0, tool=tool)

    @property
    def differs(self) -> bool:
        """Whether the pose of the link frame on its body is different in B and in A."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(slots=True)
class Alignment:
    """The result of aligning two mechanisms.

    Attributes:
        a: One mechanism.
        b: The other mechanism.
        base: The link of A and the link of B at which the matcher began.
        X: (4, 4) pose of B's root in A's root frame.
        steps: The joint pairs, in an order in which each pair comes after all pairs before it on its path.
        frames: The pairs of matched links.
        only_a: Indices of the joints that only A has.
        only_b: Indices of the joints that only B has.
        matched: Number of joint pairs and link pairs that agree.
        worst: The largest difference between a joint or link of A and the matched one of B, m. Differences of
            angles are multiplied by the robot's size.
    """

    a: Mechanism
    b: Mechanism
    base: tuple[int, int]
    X: FloatArray
    steps: list[Step] = field(default_factory=list)
    frames: list[FramePair] = field(default_factory=list)
    only_a: list[int] = field(default_factory=list)
    only_b: list[int] = field(default_factory=list)
    matched: int = 0
    worst: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether every joint and link of A agrees with a joint or link of B, and the reverse."""
        alike = not any(step.unlike for step in self.steps)
        return alike and not (self.worst or self.only_a or self.only_b)

    @property
    def differing(self) -> int:
        """Number of joint pairs and link pairs that differ."""
        return sum(step.differs or bool(step.unlike) for step in self.steps) + sum(
            frame.differs for frame in self.frames
        )

    @property
    def size(self) -> float:
        """The robot's size: the length (m) by which angles are multiplied to compare them with distances."""
        return size_of(self.a, self.b)

    @property
    def inner_off(self) -> tuple[float, float]:
        """Smallest and largest difference (m) of matched joint axes, and of matched links that carry joints.

        Pairs that agree are not counted. If all pairs agree, the two results are 0.
        """
        carry = [{joint.parent for joint in m.tree.joints} for m in (self.a, self.b)]
        links = [one for one in self.frames if one.a in carry[0] or one.b in carry[1]]
        off = [(step.tilt, step.shift) for step in self.steps] + [(link.tilt, link.shift) for link in links]
        some = [tilt * self.size + shift for tilt, shift in off if tilt or shift]
        return min(some, default=0.0), max(some, default=0.0)

    @property
    def names(self) -> dict[str, str]:
        """The name of each joint of A, with the name of the matched joint of B."""
        joints = self.a.tree.joints, self.b.tree.joints
        return {joints[0][step.a].name: joints[1][step.b].name for step in self.steps}

    @property
    def gauge(self) -> Gauge:
        """The free choices of this alignment.

        The free choices contain no joint orders, because the joints of `b` are already in the chosen order.
        """
        joints = self.a.tree.joints
        return Gauge(
            (self.a.tree.links[self.base[0]], self.b.tree.links[self.base[1]]),
            self.X,
            {joints[step.a].name: (step.sense, step.offset) for step in self.steps},
            {joints[step.a].name: step.conversion for step in self.steps if step.conversion is not None},
        )

    def exchangeable(self, given: Mapping[str, str]) -> Iterator[frozenset[tuple[int, int]]]:
        """Yield joint pairs of the same body, two at a time, that could exchange their partners in B.

        The user named no partner for the joints of A in these pairs, and B has no joints with the same names.
        Each of the pairs is on the path to a joint or link that differs.
        """
        known_names = {joint.name for joint in self.b.tree.joints} | set(given)
        ends = [i for i, step in enumerate(self.steps) if step.differs]
        ends += [frame.previous for frame in self.frames if frame.differs]
        lead = sorted({i for end in ends for i in self.indices(end)})
        some = [self.steps[i] for i in lead if self.a.tree.joints[self.steps[i].a].name not in known_names]
        for k, one in enumerate(some):
            for other in some[k + 1 :]:
                if other.previous == one.previous and other.kind == one.kind:
                    yield frozenset(((one.a, one.b), (other.a, other.b)))

    def frames_of(self, pairs: Sequence[tuple[int, int]]) -> list[FramePair]:
        """Return pairs of links, one of A and one of B on aligned bodies, as frame pairs."""
        on = {(self.a.body_of[frame.a], self.b.body_of[frame.b]): frame for frame in self.frames}
        rounding = tolerance_of(self.a, self.b)
        found = []
        for a, b in pairs:
            if (known := on.get((self.a.body_of[a], self.b.body_of[b]))) is None:
                continue
            # Any known frame pair on the body gives the motion from B's body in B's zero configuration to A's
            # body.
            T_a_b = known.end @ known.home @ known.tool @ inverse(self.b.homes[known.b])
            home, at = self.a.homes[a], T_a_b @ self.b.homes[b]
            tilt, shift = apart(home, at)
            if rounding.holds(tilt, shift):
                found.append(FramePair(a, b, known.previous, home, IDENTITY, 0.0, 0.0))
            else:
                end = at @ inverse(home)
                found.append(FramePair(a, b, known.previous, home, end, tilt, shift))
        return found

    def indices(self, previous: int) -> list[int]:
        """Return the indices of the steps from the base to the step `previous`, including that step."""
        found = []
        while previous >= 0:
            found.append(previous)
            previous = self.steps[previous].previous
        return found[::-1]

    def path(self, previous: int) -> list[Step]:
        """Return the steps from the base to the step `previous`, including that step."""
        return [self.steps[i] for i in self.indices(previous)]

    @property
    def deepest(self) -> int:
        """The largest number of steps on any path, plus one for the base."""
        return 1 + max((len(self.indices(i)) for i in range(len(self.steps))), default=0)


@dataclass(frozen=True, slots=True, eq=False)
class Gauge:
    """Prescribed values of the free choices: the pose of B's root, and the sense and zero of each joint.

    Attributes:
        base: A link of A and a link of B. The matcher begins at the bodies of these links; None: it chooses
            the bodies by names.
        X: (4, 4) pose of B's root in A's root frame.
        zeros: Sense and offset of each joint of A whose sense and offset differ from (1, 0.0).
        conversions: For each planar or floating joint whose coordinates in A and B differ: the conversion
            from A's coordinates to B's coordinates.
        orders: New orders of consecutive joints of B. Each entry lists some consecutive joints in their new
            order.
    """

    base: tuple[str, str] | None = None
    X: FloatArray = field(default_factory=lambda: IDENTITY)
    zeros: Mapping[str, tuple[int, float]] = field(default_factory=dict)
    conversions: Mapping[str, JointTransform] = field(default_factory=dict)
    orders: tuple[tuple[str, ...], ...] = ()


#: The gauge without any change: the roots of A and B have the same pose, and the coordinates of A and B are
#: equal.
AS_WRITTEN = Gauge()


@dataclass(frozen=True, slots=True)
class Line:
    """The linear function constant + slope * variable. If the slope is 0, `variable` has no meaning."""

    variable: str
    slope: float
    constant: float

    def moved(self, slope: float, constant: float) -> Line:
        """Return this linear function, multiplied by `slope` and then increased by `constant`."""
        return Line(self.variable, slope * self.slope, slope * self.constant + constant)

    def at(self, values: Mapping[str, float | FloatArray]) -> float | FloatArray:
        """Return the function's value for given values of the variables."""
        return self.constant + (self.slope * values[self.variable] if self.slope else 0.0)


@dataclass(frozen=True, slots=True)
class Pair:
    """The joint values of one step in models A and B, expressed with the sense and zero of A's joint."""

    a: Line
    b: Line
    #: Sense and offset for the value of B's joint in B's own coordinates, which is sense * b + offset.
    written: Line
    #: Difference of the two constants (rad or m) that counts as rounding, in addition to the rounding of one
    #: step.
    rounding: float = 0.0

    @property
    def variable(self) -> str | None:
        """The variable that moves the joint in A and in B; None if A and B have different variables."""
        if self.a.slope and self.b.slope and self.a.variable != self.b.variable:
            return None
        return self.a.variable if self.a.slope else self.b.variable


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """The joint values of all steps as functions of shared variables, and the ranges of these variables.

    Attributes:
        pairs: The joint values of each step; None for planar and floating joints.
        ranges: Range of each variable, rad or m; infinite without a limit.
        freer_a: Indices of the steps whose joint is independent in A and a mimic joint in B.
        freer_b: Indices of the steps whose joint is independent in B and a mimic joint in A.
        rules: Indices of the steps with different mimic rules in A and B.
        leaders: For each coordinate of B, by joint name: the linear function that computes the coordinate
            from a variable.
    """

    pairs: tuple[Pair | None, ...]
    ranges: dict[str, tuple[float, float]]
    freer_a: tuple[int, ...]
    freer_b: tuple[int, ...]
    rules: tuple[int, ...]
    leaders: dict[str, Line]

    def range(self, line: Line) -> tuple[float, float]:
        """Return the smallest and the largest value of a linear function over the ranges of the variables."""
        if not line.slope:
            return line.constant, line.constant
        ends = sorted(line.slope * end + line.constant for end in self.ranges[line.variable])
        return ends[0], ends[1]

    def off(self, pair: Pair) -> float:
        """Return the largest difference (rad or m) between a joint's values in A and in B."""
        if (variable := pair.variable) is not None:
            low, high = self.range(
                Line(variable, pair.b.slope - pair.a.slope, pair.b.constant - pair.a.constant)
            )
        else:
            (a_low, a_high), (b_low, b_high) = self.range(pair.a), self.range(pair.b)
            low, high = b_low - a_high, b_high - a_low
        return max(abs(low), abs(high))


def variables_of(found: Alignment, tolerance: Tolerance) -> Variables:
    """Return the joint values of all steps of an alignment, and the ranges of their variables."""
    return _Maker(found, tolerance).make()


class _Maker:
    def __init__(self, found: Alignment, tolerance: Tolerance) -> None:
        self.found, self.tolerance = found, tolerance
        self.trees = found.a.tree, found.b.tree
        self.step_of_b = {step.b: i for i, step in enumerate(found.steps)}
        self.leaders = self._leaders()
        self.deepest = found.deepest

    def _leaders(self) -> dict[str, Line]:
        """Return each coordinate of B as a linear function of a coordinate of A, or as a separate variable.

        Steps whose joint is independent in A are used first.
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
        """Return whether two linear functions differ by rounding only.

        The constant of a mimic rule depends on the zeros of two joints. Each joint zero is computed from
        poses at the end of a path. The tolerance for the constants is therefore the sum of the rounding
        errors of all steps of the path. A slope does not depend on a zero, so its tolerance is the rounding
        error of one step.
        """
        same = a.variable == b.variable or not (a.slope or b.slope)
        one = self._one_step(a)
        return same and abs(a.slope - b.slope) <= one and abs(a.constant - b.constant) <= self.deepest * one

    def _one_step(self, line: Line) -> float:
        return self.tolerance.angle * max(1.0, abs(line.slope), abs(line.constant))

    def _ranges(self, pairs: list[Pair | None]) -> dict[str, tuple[float, float]]:
        """Return the range of each coordinate, computed from the limits of all joints that it moves.

        If a coordinate moves a joint of A and a joint of B, its range is the intersection of their limits. If
        this intersection is empty, the range consists of A's limits. The limits of a mimic joint are used
        only for a coordinate that has no limits of its own, because a mimic joint follows its rule even
        beyond its limits.
        """
        first: dict[str, tuple[float, float]] = {}
        own: dict[str, tuple[float, float]] = {}
        mimic: dict[str, tuple[float, float]] = {}
        for step, pair in zip(self.found.steps, pairs, strict=True):
            for k, j in enumerate((step.a, step.b)):
                joint = self.trees[k].joints[j]
                if pair is None:  # the two joints are of different kinds, and each has its own coordinate
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
    """Return the lower and the upper limit of a joint's value; infinite without limits."""
    if joint.kind is JointKind.CONTINUOUS or joint.limit is None:
        return -math.inf, math.inf
    low, high = sorted((joint.limit.lower, joint.limit.upper))
    return low, high
