"""Two mechanisms laid on each other: what is free is used up, what is left is a difference, joint by joint.

One walk from a body that both have. With G what moves A's home to where B's lies, a joint of A leads to
exp(S t), the joint of B to exp(S' t'); B's coordinate may count the other way and from another zero (t' and
its screw are then written in A's), and G changes where B's axis, or what hangs on it, lies elsewhere. So B
becomes A with a rigid motion L put in before some joints, and some axes exchanged:

    T_A = exp(S_1 t_1) ... exp(S_n t_n) H,      T_B = L_1 exp(S'_1 t'_1) ... L_n exp(S'_n t'_n) L H,

with all S'_i = S_i, t'_i = t_i and L_i = 1 where nothing differs. Two models move alike if and only if
nothing does, but for turns that screws on one line share.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from urdfkin.model.mechanisms.mechanism import JointTransform, Mechanism, Screw, apart, size_of, tolerance_of
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray

IDENTITY = np.eye(4)
IDENTITY.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A joint of both models on the way from the base.

    Attributes:
        a: Joint of A (index in its tree).
        b: Joint of B.
        kind: "turns", "prismatic", "planar", "floating".
        previous: The step before it, -1 for none.
        sense: +1 or -1, and
        offset: rad or m: B's value is sense * A's + offset.
        before: (4, 4) L, put in before the joint, at A's home.
        axis: A's screw at home, pointing away from the base.
        other: B's, likewise; `axis` itself where they agree.
        tilt: Radians by which B's axis is tilted, or a planar joint's normal.
        shift: Metres by which it is off, or, of a planar or floating joint, its frame.
        conversion: B's coordinates of a planar or floating joint; None where they are A's.
        unlike: "a" or "b" where the joint is fixed in that model and moves in the other, "kind" where it
            moves in another way; else "".
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
        """Whether its axis does."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """A link of both models.

    Attributes:
        a: Link of A.
        b: Link of B.
        previous: The step that carries it, -1 for none.
        home: (4, 4) A's at home.
        end: (4, 4) L, put in behind the last joint, at A's home.
        tilt: Radians by which B's is turned on its body.
        shift: Metres by which it is moved on it.
        tool: (4, 4) B's in A's frame, where it is taken for another tool on the same body.
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
        """The same, B's frame seen as another tool."""
        tool = inverse(self.home) @ self.end @ self.home
        return replace(self, end=IDENTITY, tilt=0.0, shift=0.0, tool=tool)

    @property
    def differs(self) -> bool:
        """Whether it lies elsewhere on its body."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(slots=True)
class Alignment:
    """What laying them on each other found.

    Attributes:
        a: One mechanism.
        b: The other.
        base: Links that the walk began at, of A and of B.
        X: (4, 4) what brings B's root to where it must stand in A's.
        steps: Joints, each behind the one before it.
        frames: Links that both have.
        only_a: Joints that only A has (indices).
        only_b: Likewise.
        matched: How many places agree.
        worst: Metres: the largest disagreement, an angle counted with the robot's size.
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
        """Whether every joint and link agrees."""
        alike = not any(step.unlike for step in self.steps)
        return alike and not (self.worst or self.only_a or self.only_b)

    @property
    def differing(self) -> int:
        """How many joints and links differ."""
        return sum(step.differs or bool(step.unlike) for step in self.steps) + sum(
            frame.differs for frame in self.frames
        )

    @property
    def size(self) -> float:
        """Metres: what angles are counted with."""
        return size_of(self.a, self.b)

    @property
    def inner_off(self) -> tuple[float, float]:
        """Metres: the least and the largest that two axes are off, or two links that are no tools.

        Of those that are off; 0 where none is.
        """
        carry = [{joint.parent for joint in m.tree.joints} for m in (self.a, self.b)]
        links = [one for one in self.frames if one.a in carry[0] or one.b in carry[1]]
        off = [(step.tilt, step.shift) for step in self.steps] + [(link.tilt, link.shift) for link in links]
        some = [tilt * self.size + shift for tilt, shift in off if tilt or shift]
        return min(some, default=0.0), max(some, default=0.0)

    @property
    def names(self) -> dict[str, str]:
        """Joints of A and what they are in B."""
        joints = self.a.tree.joints, self.b.tree.joints
        return {joints[0][step.a].name: joints[1][step.b].name for step in self.steps}

    @property
    def gauge(self) -> Gauge:
        """What was free, as it was found; the order of joints is that of `b` already."""
        joints = self.a.tree.joints
        return Gauge(
            (self.a.tree.links[self.base[0]], self.b.tree.links[self.base[1]]),
            self.X,
            {joints[step.a].name: (step.sense, step.offset) for step in self.steps},
            {joints[step.a].name: step.conversion for step in self.steps if step.conversion is not None},
        )

    def exchangeable(self, given: Mapping[str, str]) -> Iterator[frozenset[tuple[int, int]]]:
        """Two joints of A on one body, with B's, that lead to what differs and whose names say nothing."""
        told = {joint.name for joint in self.b.tree.joints} | set(given)
        ends = [i for i, step in enumerate(self.steps) if step.differs]
        ends += [frame.previous for frame in self.frames if frame.differs]
        lead = sorted({i for end in ends for i in self.indices(end)})
        some = [self.steps[i] for i in lead if self.a.tree.joints[self.steps[i].a].name not in told]
        for k, one in enumerate(some):
            for other in some[k + 1 :]:
                if other.previous == one.previous and other.kind == one.kind:
                    yield frozenset(((one.a, one.b), (other.a, other.b)))

    def frames_of(self, pairs: Sequence[tuple[int, int]]) -> list[FramePair]:
        """Links (of A, of B) on bodies that are laid on each other, as frames."""
        on = {(self.a.body_of[frame.a], self.b.body_of[frame.b]): frame for frame in self.frames}
        rounding = tolerance_of(self.a, self.b)
        found = []
        for a, b in pairs:
            if (known := on.get((self.a.body_of[a], self.b.body_of[b]))) is None:
                continue
            # What moves B's home to where it lies on A's body, from any two links there.
            laid = known.end @ known.home @ known.tool @ inverse(self.b.homes[known.b])
            home, at = self.a.homes[a], laid @ self.b.homes[b]
            tilt, shift = apart(home, at)
            if rounding.holds(tilt, shift):
                found.append(FramePair(a, b, known.previous, home, IDENTITY, 0.0, 0.0))
            else:
                end = at @ inverse(home)
                found.append(FramePair(a, b, known.previous, home, end, tilt, shift))
        return found

    def indices(self, previous: int) -> list[int]:
        """The steps from the base to one of them, itself too."""
        found = []
        while previous >= 0:
            found.append(previous)
            previous = self.steps[previous].previous
        return found[::-1]

    def path(self, previous: int) -> list[Step]:
        """The same as steps."""
        return [self.steps[i] for i in self.indices(previous)]

    @property
    def deepest(self) -> int:
        """The most steps on a path, and one for the base."""
        return 1 + max((len(self.indices(i)) for i in range(len(self.steps))), default=0)


@dataclass(frozen=True, slots=True, eq=False)
class Gauge:
    """What is free, taken as given: where B's root stands, each joint's sense and zero.

    Attributes:
        base: Links of A and of B on the bodies where the walk begins; None: by names.
        X: (4, 4) B's root in A's.
        zeros: Of joints of A that are not (1, 0.0).
        conversions: Of planar and floating joints of A that count otherwise in B.
        orders: Joints of B that are taken in another order, run by run.
    """

    base: tuple[str, str] | None = None
    X: FloatArray = field(default_factory=lambda: IDENTITY)
    zeros: Mapping[str, tuple[int, float]] = field(default_factory=dict)
    conversions: Mapping[str, JointTransform] = field(default_factory=dict)
    orders: tuple[tuple[str, ...], ...] = ()


#: B as it is written: root on root, each coordinate the same number.
AS_WRITTEN = Gauge()
