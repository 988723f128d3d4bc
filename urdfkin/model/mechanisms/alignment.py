"""The alignment of two mechanisms: base, senses and zeros are matched, and differences are kept by joint.

The matcher starts from a common body. Let G be the motion from A's zero configuration to B's. A joint of A
moves by exp(S t), the joint of B by exp(S' t'). B's coordinate may have the opposite sense and another zero;
t' and its screw are written in A's. G changes where B's axis, or the body behind it, is elsewhere. So B is A
with a rigid motion L inserted before some joints, and some axes replaced:

    T_A = exp(S_1 t_1) ... exp(S_n t_n) H,      T_B = L_1 exp(S'_1 t'_1) ... L_n exp(S'_n t'_n) L H,

with S'_i = S_i, t'_i = t_i and L_i = 1 where nothing differs. Two models move alike if and only if nothing
differs, except for rotations that screws on one line share.
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
    """A joint pair on the path from the base.

    Attributes:
        a: Joint of A (index in its tree).
        b: Joint of B (index in its tree).
        kind: "turns" (revolute), "prismatic", "planar", "floating".
        previous: Index of the step before it, -1 for none.
        sense: +1 or -1; see `offset`.
        offset: B's value is sense * A's value + offset, rad or m.
        before: (4, 4) L, inserted before the joint, in A's zero configuration.
        axis: A's screw in the zero configuration, directed away from the base.
        other: B's screw, likewise; `axis` itself if they agree.
        tilt: Angle (rad) between the axes, or between the normals of planar joints.
        shift: Distance (m) between the axes; for a planar or floating joint, between the frames.
        conversion: From A's coordinates of a planar or floating joint to B's; None if they are equal.
        unlike: "a" or "b" if the joint is fixed in that model and moves in the other, "kind" if the kinds of
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
        """Whether the axes differ."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """A link of both models.

    Attributes:
        a: Link of A (index in its tree).
        b: Link of B (index in its tree).
        previous: Index of the step that carries it, -1 for none.
        home: (4, 4) pose of A's link in the zero configuration.
        end: (4, 4) L, inserted behind the last joint, in A's zero configuration.
        tilt: Angle (rad) between the two on their body.
        shift: Distance (m) between the two on their body.
        tool: (4, 4) pose of B's link in A's, if it counts as a different tool on the same body.
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
        """Return the same pair, with B's frame as a different tool."""
        tool = inverse(self.home) @ self.end @ self.home
        return replace(self, end=IDENTITY, tilt=0.0, shift=0.0, tool=tool)

    @property
    def differs(self) -> bool:
        """Whether the link is elsewhere on its body."""
        return self.tilt > 0.0 or self.shift > 0.0


@dataclass(slots=True)
class Alignment:
    """The result of aligning two mechanisms.

    Attributes:
        a: One mechanism.
        b: The other mechanism.
        base: Links of A and of B at which the matcher began.
        X: (4, 4) pose of B's root in A's root frame.
        steps: The joint pairs; each comes after the pair before it on its path.
        frames: The links of both.
        only_a: Joints that only A has (indices).
        only_b: Joints that only B has (indices).
        matched: Number of joints and links that agree.
        worst: The largest disagreement (m); angles are multiplied by the robot's size.
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
        """Number of joints and links that differ."""
        return sum(step.differs or bool(step.unlike) for step in self.steps) + sum(
            frame.differs for frame in self.frames
        )

    @property
    def size(self) -> float:
        """Length (m) that converts angles to distances."""
        return size_of(self.a, self.b)

    @property
    def inner_off(self) -> tuple[float, float]:
        """Smallest and largest disagreement (m) of axes, and of links that carry joints.

        Only actual disagreements count; both are 0 if there is none.
        """
        carry = [{joint.parent for joint in m.tree.joints} for m in (self.a, self.b)]
        links = [one for one in self.frames if one.a in carry[0] or one.b in carry[1]]
        off = [(step.tilt, step.shift) for step in self.steps] + [(link.tilt, link.shift) for link in links]
        some = [tilt * self.size + shift for tilt, shift in off if tilt or shift]
        return min(some, default=0.0), max(some, default=0.0)

    @property
    def names(self) -> dict[str, str]:
        """Joints of A and their names in B."""
        joints = self.a.tree.joints, self.b.tree.joints
        return {joints[0][step.a].name: joints[1][step.b].name for step in self.steps}

    @property
    def gauge(self) -> Gauge:
        """The free choices as the alignment found them; the joint order is already that of `b`."""
        joints = self.a.tree.joints
        return Gauge(
            (self.a.tree.links[self.base[0]], self.b.tree.links[self.base[1]]),
            self.X,
            {joints[step.a].name: (step.sense, step.offset) for step in self.steps},
            {joints[step.a].name: step.conversion for step in self.steps if step.conversion is not None},
        )

    def exchangeable(self, given: Mapping[str, str]) -> Iterator[frozenset[tuple[int, int]]]:
        """Yield two joint pairs of one body that lead to a difference and are not paired by name."""
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
        """Return links (of A, of B) on aligned bodies as frame pairs."""
        on = {(self.a.body_of[frame.a], self.b.body_of[frame.b]): frame for frame in self.frames}
        rounding = tolerance_of(self.a, self.b)
        found = []
        for a, b in pairs:
            if (known := on.get((self.a.body_of[a], self.b.body_of[b]))) is None:
                continue
            # The motion from B's zero configuration to A's body, from any two links on it.
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
        """Return the indices of the steps from the base to one of them, including it."""
        found = []
        while previous >= 0:
            found.append(previous)
            previous = self.steps[previous].previous
        return found[::-1]

    def path(self, previous: int) -> list[Step]:
        """Return the steps from the base to one of them, including it."""
        return [self.steps[i] for i in self.indices(previous)]

    @property
    def deepest(self) -> int:
        """The most steps on a path, and one for the base."""
        return 1 + max((len(self.indices(i)) for i in range(len(self.steps))), default=0)


@dataclass(frozen=True, slots=True, eq=False)
class Gauge:
    """Prescribed free choices: the pose of B's root, and each joint's sense and zero.

    Attributes:
        base: Links of A and of B on the bodies at which the matcher begins; None: by names.
        X: (4, 4) pose of B's root in A's root frame.
        zeros: Sense and offset of joints of A, if not (1, 0.0).
        conversions: Of planar and floating joints of A with other coordinates in B.
        orders: Joints of B in another order, one for each reordered run.
    """

    base: tuple[str, str] | None = None
    X: FloatArray = field(default_factory=lambda: IDENTITY)
    zeros: Mapping[str, tuple[int, float]] = field(default_factory=dict)
    conversions: Mapping[str, JointTransform] = field(default_factory=dict)
    orders: tuple[tuple[str, ...], ...] = ()


#: No free choice: equal roots, and equal coordinates.
AS_WRITTEN = Gauge()
