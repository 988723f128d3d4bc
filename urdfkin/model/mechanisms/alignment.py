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

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import TypeVar

import numpy as np

from urdfkin.model.chain import inverse
from urdfkin.model.mechanisms.conversion import Conversion, onto_plane, undoing
from urdfkin.model.mechanisms.guesses import behind, laid, zeros
from urdfkin.model.mechanisms.mechanism import Edge, Mechanism, Screw, Tolerance, tolerance_of
from urdfkin.model.mechanisms.pairing import Pairing, family
from urdfkin.model.mechanisms.rigid import along, apart, between, turn_about
from urdfkin.model.tree import FloatArray

#: Of joints whose order does not matter, so many orders are tried: all of five slides.
MOST_ORDERS = 120
#: What the next axis leaves open, so many joints ahead decide; so many steps ahead are taken in all.
AHEAD, MOST_AHEAD = 6, 600
#: What is off by so little (rad, and as a share of the size) is taken for nothing where nothing else helps.
NEARLY = (1e-11, 1e-9, 1e-7, 1e-5, 1e-3)
#: So many times joints that are called otherwise are taken for each other.
MOST_EXCHANGED = 12
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
        moves
            in another way; else "".
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
    conversion: Conversion | None = None

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
    def size(self) -> float:
        """Metres: what angles are counted with."""
        return max(self.a.size, self.b.size, 1e-9)

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


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the walk stands: two bodies, how they were reached, what moves either home there."""

    bodies: tuple[int, int]
    came: tuple[Edge | None, Edge | None]
    previous: int
    G: FloatArray
    XC: FloatArray


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
    conversions: Mapping[str, Conversion] = field(default_factory=dict)
    orders: tuple[tuple[str, ...], ...] = ()


#: What a joint is free in: an offset, or a pose.
_Free = TypeVar("_Free", float, FloatArray)
#: How many of some places agree, and the largest disagreement (m).
Score = tuple[int, float]

#: B as it is written: root on root, each coordinate the same number.
AS_WRITTEN = Gauge()


def align(a: Mechanism, b: Mechanism, given: Mapping[str, str], gauge: Gauge | None = None) -> Alignment:
    """Lay B on A.

    Args:
        a: One.
        b: The other.
        given: Joints of A and their names in B.
        gauge: What is free; None: whatever makes most agree.
    """
    if gauge is not None:
        for taken in gauge.orders:
            b = b.in_order(taken)
        return _laid(a, b, given, gauge)
    best = _laid(a, b, given, None, MOST_AHEAD)
    for orders in b.orders_of_runs(tolerance_of(a, b)):
        if best.complete:
            break
        as_it_is, run = best.b, next(orders)
        for names in islice(orders, MOST_ORDERS):
            moved = [k for k, name in enumerate(names) if name != run[k]]
            other = as_it_is.in_order(names[moved[0] : moved[-1] + 1])
            found = _laid(a, other, given, None)
            if _better((found.matched, found.worst), (best.matched, best.worst)):
                best = found
    return _nearly(_exchanged(best, given), given)


def _exchanged(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Joints on one body that share no name taken for each other: arms that mirror each other, say."""
    if best.only_a or best.only_b:  # two robots, which no exchange makes one
        return best
    tried = set[frozenset[tuple[int, int]]]()
    while (two := next((two for two in best.exchangeable(given) if two not in tried), None)) is not None:
        tried.add(two)
        if len(tried) > MOST_EXCHANGED:
            break
        joints = best.a.tree.joints, best.b.tree.joints
        (a, b), (c, d) = two
        other = {joints[0][a].name: joints[1][d].name, joints[0][c].name: joints[1][b].name}
        found = _laid(best.a, best.b, {**given, **other}, None, MOST_AHEAD, base=best.base)
        if _better((found.matched, found.worst), (best.matched, best.worst)):
            best, given = found, {**given, **other}
    return best


def _nearly(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Another way to lay them on each other, which agrees by far more; the same where none is.

    Where each axis is off by a little, none says which of two ways is meant, as one that agrees would. So
    what is little is taken for nothing, more and more of it, until all agree; with what was free set as that
    search found it, they are laid on each other once more and all that is little is told. What is off by more
    is no way chosen wrongly unless something before it is off by less.
    """
    a, b, (least, most) = best.a, best.b, best.inner_off
    for angle in NEARLY:
        if not least < angle * best.size < 0.5 * most:
            continue
        tolerance = Tolerance(angle, angle * best.size)
        rough = _laid(a, b, given, None, MOST_AHEAD, tolerance, best.base)
        if rough.inner_off[1] or (len(rough.only_a), len(rough.only_b)) != (
            len(best.only_a),
            len(best.only_b),
        ):
            continue
        exact = _laid(a, b, rough.names, rough.gauge)
        return exact if exact.inner_off[1] < 0.5 * most else best
    return best


def _laid(
    a: Mechanism,
    b: Mechanism,
    given: Mapping[str, str],
    gauge: Gauge | None,
    ahead: int = 0,
    tolerance: Tolerance | None = None,
    base: tuple[int, int] | None = None,
) -> Alignment:
    """The best of all bodies to begin at, or of the one of two links, with so many steps ahead."""
    tolerance = tolerance or tolerance_of(a, b)
    walk = _Walk(a, b, Pairing(a, b, given, tolerance), gauge, ahead, tolerance, base)
    best: Alignment | None = None
    for bodies, X in walk.beginnings():
        found = walk.run(bodies, X)
        if best is None or _better((found.matched, found.worst), (best.matched, best.worst)):
            best = found
        if not best.worst and not (best.only_a and best.only_b):
            break
    assert best is not None
    return best


class _Walk:
    def __init__(
        self,
        a: Mechanism,
        b: Mechanism,
        pairing: Pairing,
        gauge: Gauge | None,
        ahead: int,
        tolerance: Tolerance,
        base: tuple[int, int] | None,
    ) -> None:
        self.a, self.b, self.pairing, self.gauge, self.ahead = a, b, pairing, gauge, ahead
        self.tolerance, self.base = tolerance, base
        self.size = max(a.size, b.size, 1e-9)

    # -- where to begin ------------------------------------------------------------------------------

    def beginnings(self) -> Iterator[tuple[tuple[int, int], FloatArray]]:
        """Bodies that both have and where B's root may stand, the likeliest first."""
        if self.gauge is not None:
            names = self.gauge.base
            base = next(self._bases()) if names is None else self._bodies_of(*names)
            X = self.gauge.X
            yield base, IDENTITY if self.tolerance.holds(*apart(IDENTITY, X)) else X
            return
        for base in self._bases():
            tried = list[FloatArray]()
            for X in self._places(base):
                if not any(self.tolerance.holds(*apart(known, X)) for known in tried):
                    tried.append(X)
                    yield base, X

    def _places(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Where B's root may stand: where A's does, where links of one name meet, where axes do."""
        yield IDENTITY
        for link_a, link_b in self.pairing.links(*base):
            yield self.a.homes[link_a] @ inverse(self.b.homes[link_b])
        yield from self._by_axes(base)

    def _bodies_of(self, link_a: str, link_b: str) -> tuple[int, int]:
        a, b = self.a, self.b
        return a.body_of[a.tree.link_index(link_a)], b.body_of[b.tree.link_index(link_b)]

    def _bases(self) -> Iterator[tuple[int, int]]:
        """A's root body with the body of B that has most of its links, or with any of B's.

        Where those share no name, B's root body too, with the one of A: what carries A's root, a floating
        joint say, may be A's alone.
        """
        if self.base is not None:
            yield self.a.body_of[self.base[0]], self.b.body_of[self.base[1]]
            return
        theirs = _most_shared(self.a, self.b)
        if theirs is not None:
            yield 0, theirs
            return
        yield from ((0, body) for body, links in enumerate(self.b.bodies) if links)
        ours = _most_shared(self.b, self.a)
        if ours is not None:
            yield ours, 0

    def _by_axes(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Where B's first axes come to lie on A's, as well as they do."""
        scored = list[tuple[float, _Place, Score]]()
        for X in laid(self.a, self.b, base):
            place = _Place(base, (None, None), -1, IDENTITY, X)
            scored.append((0.0, place, self._score(place)))
        best = _best_of(scored)[2] if scored else (0, 0.0)
        yield from (place.XC for _, place, score in scored if not _better(best, score))

    # -- the walk ------------------------------------------------------------------------------------

    def run(self, base: tuple[int, int], X: FloatArray) -> Alignment:
        found = Alignment(self.a, self.b, (self.a.bodies[base[0]][0], self.b.bodies[base[1]][0]), X)
        stack = [_Place(base, (None, None), -1, IDENTITY, X)]
        while stack:
            place = stack.pop()
            self._frames(place, found)
            pairs, only_a, only_b = self.pairing.edges(place.bodies, place.came, place.G, place.XC)
            found.only_a += _all_beyond(self.a, place.bodies[0], only_a)
            found.only_b += _all_beyond(self.b, place.bodies[1], only_b)
            for e, f in pairs:
                step, there, _ = self._step(place, e, f, len(found.steps), AHEAD)
                stack.append(there)
                found.steps.append(step)
                if step.differs:
                    found.worst = max(found.worst, step.tilt * self.size + step.shift)
                elif not step.unlike:
                    found.matched += 1
        return found

    def _frames(self, place: _Place, found: Alignment) -> None:
        pairs = self._all_links(place)
        if (other := self._tool_on(place, pairs)) is not None:
            found.frames.append(other)
        for link_a, link_b in pairs:
            home = self.a.homes[link_a]
            at, seen = place.G @ home, place.XC @ self.b.homes[link_b]
            angle, way = apart(at, seen)
            end = IDENTITY
            if self.tolerance.holds(angle, way):
                angle = way = 0.0
                found.matched += 1
            else:
                end = inverse(place.G) @ seen @ inverse(home)
                found.worst = max(found.worst, angle * self.size + way)
            found.frames.append(FramePair(link_a, link_b, place.previous, home, end, angle, way))

    def _tool_on(self, place: _Place, taken: list[tuple[int, int]]) -> FramePair | None:
        """Where no link of two bodies is the other's: any of either, as another tool on the same body."""
        names_a, names_b = self.a.tree.links, self.b.tree.links
        ours = [i for i in self.a.bodies[place.bodies[0]] if names_a[i] not in names_b]
        theirs = [j for j in self.b.bodies[place.bodies[1]] if names_b[j] not in names_a]
        if taken or not ours or not theirs:
            return None
        home = self.a.homes[ours[0]]
        tool = inverse(place.G @ home) @ place.XC @ self.b.homes[theirs[0]]
        return FramePair(ours[0], theirs[0], place.previous, home, IDENTITY, 0.0, 0.0, tool)

    def _all_links(self, place: _Place) -> list[tuple[int, int]]:
        """Links of one name, then those that stand in one place under names that the other has not."""
        pairs = self.pairing.links(*place.bodies)
        taken = {j for _, j in pairs}
        names_a, names_b = self.a.tree.links, self.b.tree.links
        others = [j for j in self.b.bodies[place.bodies[1]] if names_b[j] not in names_a]
        for i in self.a.bodies[place.bodies[0]]:
            if names_a[i] not in names_b:
                at = place.G @ self.a.homes[i]
                for j in others:
                    if j not in taken and self.tolerance.holds(*apart(at, place.XC @ self.b.homes[j])):
                        pairs.append((i, j))
                        taken.add(j)
                        break
        return pairs

    def _step(self, place: _Place, e: Edge, f: Edge, index: int, depth: int) -> tuple[Step, _Place, Score]:
        """The step that a pair of joints makes, where it leads, and how well it fits what is behind it."""
        kinds = family(self.a.joint(e).kind), family(self.b.joint(f).kind)
        came = e, f
        backwards = e.outer == place.bodies[0], f.outer == place.bodies[1]
        bodies = e.beyond(place.bodies[0]), f.beyond(place.bodies[1])
        there = _Place(bodies, came, index, place.G, place.XC)
        if kinds[0] != kinds[1]:
            return self._unlike(place, came, kinds, backwards), there, (0, 0.0)
        if kinds[0] in ("turns", "prismatic"):
            return self._like(place, there, backwards, depth, turns=kinds[0] == "turns")
        return self._free(place, there, backwards, depth, kinds[0])

    def _unlike(
        self, place: _Place, came: tuple[Edge, Edge], kinds: tuple[str, str], backwards: tuple[bool, bool]
    ) -> Step:
        """A joint fixed in one model, or of another kind: what hangs on it shows by how much."""
        unlike = {kinds[0]: "a", kinds[1]: "b"}.get("fixed", "kind")
        if unlike == "a":
            axis = _outwards(self.b.screw(came[1]), backwards[1]).moved(inverse(place.G) @ place.XC)
        else:
            axis = _outwards(self.a.screw(came[0]), backwards[0])
        kind = kinds[1] if unlike == "a" else kinds[0]
        return Step(
            came[0].joint, came[1].joint, kind, place.previous, 1, 0.0, IDENTITY, axis, axis, 0.0, 0.0, unlike
        )

    def _free(
        self, place: _Place, there: _Place, backwards: tuple[bool, bool], depth: int, kind: str
    ) -> tuple[Step, _Place, Score]:
        """A planar or floating joint: where its frame stands, and what it counts from, is free."""
        e, f = _both(there.came)
        homes = self.a.homes[e.joint + 1], self.b.homes[f.joint + 1]
        at, seen = place.G @ homes[0], place.XC @ homes[1]
        axis, back = Screw(homes[0][:3, 2], homes[0][:3, 3]), backwards[0] != backwards[1]
        step = Step(e.joint, f.joint, kind, place.previous, 1, 0.0, IDENTITY, axis, axis, 0.0, 0.0)
        given = None if self.gauge is None else self.gauge.conversions.get(self.a.joint(e).name)
        as_written = self.gauge is not None and given is None
        if as_written:
            K, tilt, shift = seen @ inverse(at), *apart(at, seen)
        else:
            K, tilt, shift = _normals_apart(at, seen) if kind == "planar" else (IDENTITY, 0.0, 0.0)
        if not self.tolerance.holds(tilt, shift):
            step = replace(step, before=inverse(place.G) @ K @ place.G, tilt=tilt, shift=shift)
            there, at = replace(there, G=K @ place.G), K @ at
        if as_written:
            return replace(step, unlike="kind" if back else ""), there, (0, 0.0)
        M = inverse(seen) @ at
        if given is not None:
            tried: Iterable[FloatArray] = [inverse(given.before) if backwards[1] else given.behind]
        else:
            tried = self._behind(there, at, homes[1], undoing(M) if kind == "planar" else None)
        places = ((N, replace(there, XC=at @ N @ inverse(homes[1]))) for N in tried)
        N, moved, score = self._best(places, depth)
        # Outwards, P_b^(1 or -1) = M P_a^(1 or -1) N.
        pair = (inverse(N), inverse(M)) if backwards[1] else (M, N)
        before, behind = (IDENTITY if self.tolerance.holds(*apart(IDENTITY, T)) else T for T in pair)
        if before is IDENTITY and behind is IDENTITY and not back:
            return step, there, score
        return replace(step, conversion=Conversion(before, behind, back)), moved, score

    def _behind(
        self, there: _Place, at: FloatArray, home_b: FloatArray, plane: FloatArray | None
    ) -> Iterator[FloatArray]:
        """N to try: none, all as it stands at home, those with which a link or an axis behind agrees.

        Args:
            there: Behind the joint, B as it stands at home.
            at: (4, 4) the joint's frame.
            home_b: (4, 4) B's own.
            plane: (4, 4) what a planar joint's N is, but for motions in its plane.
        """
        yield IDENTITY if plane is None else plane
        wanted = [there.XC]
        wanted += [
            there.G @ self.a.homes[i] @ inverse(self.b.homes[j]) for i, j in self.pairing.links(*there.bodies)
        ]
        wanted += [there.G @ X for X in self._by_axes(there.bodies)]
        for XC in wanted:
            N = inverse(at) @ XC @ home_b
            yield N if plane is None else plane @ onto_plane(inverse(plane) @ N)

    def _like(
        self, place: _Place, there: _Place, backwards: tuple[bool, bool], depth: int, *, turns: bool
    ) -> tuple[Step, _Place, Score]:
        """A joint that turns, or slides, in both: sense, zero, and what makes its axis the other's."""
        e, f = _both(there.came)
        s = _outwards(self.a.screw(e), backwards[0])
        t = _outwards(self.b.screw(f), backwards[1])
        start, end = s.moved(place.G), t.moved(place.XC)
        sense, zero = self._given(self.a.joint(e).name)
        sense = sense or (-1 if start.direction @ end.direction < 0.0 else 1)
        if sense < 0:
            end = end.reversed()
        K, tilt, shift = between(start, end, turns=turns)
        back = inverse(place.G)
        kind, (a, b) = "turns" if turns else "prismatic", (e.joint, f.joint)
        if self.tolerance.holds(tilt, shift):
            offset, there, score = self._best_zero(there, place.G, t, turns, zero, depth)
            return Step(a, b, kind, place.previous, sense, offset, IDENTITY, s, s, 0.0, 0.0), there, score
        # What hangs on the joint has moved with its axis, or its axis alone is another.
        with_it = self._best_zero(there, K @ place.G, t, turns, zero, depth)
        if depth == AHEAD:
            alone = self._best_zero(there, place.G, t, turns, zero, depth)
            if _better(self._score(alone[1]), self._score(with_it[1])):
                other = end.moved(back)
                step = Step(a, b, kind, place.previous, sense, alone[0], IDENTITY, s, other, tilt, shift)
                return step, *alone[1:]
        before = back @ K @ place.G
        return Step(a, b, kind, place.previous, sense, with_it[0], before, s, s, tilt, shift), *with_it[1:]

    # -- a joint's zero ------------------------------------------------------------------------------

    def _given(self, joint: str) -> tuple[int, float | None]:
        """Its sense and zero; 0 and None where they are free."""
        return (0, None) if self.gauge is None else self.gauge.zeros.get(joint, (1, 0.0))

    def _best_zero(
        self, there: _Place, G: FloatArray, t: Screw, turns: bool, zero: float | None, depth: int
    ) -> tuple[float, _Place, Score]:
        """The offset of B's joint with which most of what follows agrees; 0 has the first word."""
        offsets = self._offsets(there, G, t, turns) if zero is None else (zero,)
        moved = (
            (offset, there.XC @ along(t, offset, turns=turns) if offset else there.XC) for offset in offsets
        )
        return self._best(((offset, replace(there, G=G, XC=XC)) for offset, XC in moved), depth)

    def _best(self, choices: Iterable[tuple[_Free, _Place]], depth: int) -> tuple[_Free, _Place, Score]:
        """The first choice with which most agrees; between equals, what follows decides, `depth` joints on.

        Two axes that meet at right angles, say, lie on two others in two ways; the third one tells which.
        """
        scored = list[tuple[_Free, _Place, Score]]()
        for what, place in choices:
            if any(self.tolerance.holds(*apart(known.XC, place.XC)) for _, known, _ in scored):
                continue
            score = self._score(place)
            scored.append((what, place, score))
            if not score[1] and self.pairing.links(*place.bodies):  # no other choice can agree as well
                return scored[-1]
        best = _best_of(scored)
        equal = [one for one in scored if not _better(best[2], one[2])]
        if not depth or self.ahead <= 0 or (len(equal) == 1 and depth == AHEAD):
            return best
        self.ahead -= 1
        seen = list[tuple[_Free, _Place, Score]]()
        for what, place, here in equal:
            seen.append((what, place, self._with_behind(place, here, depth)))
            if not seen[-1][2][1]:
                break
        return _best_of(seen)

    def _with_behind(self, place: _Place, here: Score, depth: int) -> Score:
        """The score of a place together with what follows."""
        pairs = self.pairing.edges(place.bodies, place.came, place.G, place.XC)[0]
        scores = [here, *(self._step(place, e, f, -1, depth - 1)[2] for e, f in pairs)]
        return sum(count for count, _ in scores), max(off for _, off in scores)

    def _score(self, place: _Place) -> Score:
        """How many of the links and axes at a place agree, and the largest disagreement (m)."""
        off = [
            apart(place.G @ self.a.homes[i], place.XC @ self.b.homes[j])
            for i, j in self.pairing.links(*place.bodies)
        ]
        pairs, _, _ = self.pairing.edges(place.bodies, place.came, place.G, place.XC)
        off += [self.pairing.mismatch(e, f, place.G, place.XC) for e, f in pairs]
        wrong = [angle * self.size + way for angle, way in off if not self.tolerance.holds(angle, way)]
        return len(off) - len(wrong), max(wrong, default=0.0)

    def _offsets(self, there: _Place, G: FloatArray, t: Screw, turns: bool) -> Iterator[float]:
        """Zeros of B's joint to try: none, and those with which one thing behind it agrees."""
        yield 0.0
        u = t.moved(there.XC)
        for i, j in self.pairing.links(*there.bodies):
            at, seen = G @ self.a.homes[i], there.XC @ self.b.homes[j]
            if turns:
                yield turn_about(u.direction, at[:3, :3] @ seen[:3, :3].T)
            else:
                yield float(u.direction @ (at[:3, 3] - seen[:3, 3]))
        for ours, theirs in behind((self.a, self.b), there.came, there.bodies, (u.moved(inverse(G)), t)):
            yield from zeros(u, ours.moved(G), theirs.moved(there.XC), turns)


def _most_shared(one: Mechanism, other: Mechanism) -> int | None:
    """The body of another mechanism that has most links of one's root body by name; None where none has."""
    names = {one.tree.links[link] for link in one.bodies[0]}
    shared = [len(names & {other.tree.links[k] for k in body}) for body in other.bodies]
    return max(range(len(shared)), key=shared.__getitem__) if any(shared) else None


def _best_of(scored: Sequence[tuple[_Free, _Place, Score]]) -> tuple[_Free, _Place, Score]:
    """The first that no other is better than by much."""
    best = scored[0]
    for one in scored[1:]:
        best = one if _better(one[2], best[2]) else best
    return best


def _better(score: Score, than: Score) -> bool:
    """Whether more agrees, or as much and the rest twice as well."""
    return score[0] > than[0] or (score[0] == than[0] and score[1] < 0.5 * than[1])


def _outwards(screw: Screw, backwards: bool) -> Screw:
    """A joint's screw as it moves what is behind it on the walk, by the joint's own value."""
    return screw.reversed() if backwards else screw


def _both(came: tuple[Edge | None, Edge | None]) -> tuple[Edge, Edge]:
    e, f = came
    assert e is not None
    assert f is not None
    return e, f


def _all_beyond(mechanism: Mechanism, body: int, edges: list[Edge]) -> list[int]:
    """Some joints at a body and all behind them."""
    found, stack = [], [(body, edge) for edge in edges]
    while stack:
        here, edge = stack.pop()
        found.append(edge.joint)
        beyond = edge.beyond(here)
        stack += [(beyond, other) for other in mechanism.edges_of[beyond] if other is not edge]
    return found


def _normals_apart(at: FloatArray, seen: FloatArray) -> tuple[FloatArray, float, float]:
    """`between` of two planes, whichever way their normals point."""
    start, end = (Screw(T[:3, 2], T[:3, 3]) for T in (at, seen))
    return between(start, end.reversed() if start.direction @ end.direction < 0.0 else end, turns=False)
