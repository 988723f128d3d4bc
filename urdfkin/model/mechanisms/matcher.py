"""The walk that lays B on A: at each joint its sense and zero are chosen so that most behind it agrees.

The search for how B is laid on A: where to begin, in which order, whose joint is whose, and how nearly.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import TypeVar

from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, FramePair, Gauge, Step
from urdfkin.model.mechanisms.congruence import Congruence
from urdfkin.model.mechanisms.free_zeros import zeros_by_rules
from urdfkin.model.mechanisms.joint_matching import (
    Came,
    Pair,
    Pairing,
    behind,
    family,
    laid,
    laid_by_siblings,
    zeros,
)
from urdfkin.model.mechanisms.mechanism import (
    Edge,
    JointTransform,
    Mechanism,
    Screw,
    Tolerance,
    along,
    apart,
    between,
    onto_plane,
    size_of,
    tolerance_of,
    turn_about,
    undoing,
)
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray

#: What the next axis leaves open, so many joints ahead decide.
AHEAD = 6
#: So many places for B's root are tried in which all axes of one body lie on axes of A's.
MOST_LAID = 48
#: What is off by less than this of what something else is fits twice as well: only that is better.
TWICE_AS_WELL = 0.5

#: What a joint is free in: an offset, or a pose.
_Free = TypeVar("_Free", float, FloatArray)
#: How many of some places agree, and the largest disagreement (m).
Score = tuple[int, float]


@dataclass(slots=True)
class Ahead:
    """How many steps ahead a search may still take; several walks share one."""

    left: int


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where the walk stands: two bodies, how they were reached, what moves either home there."""

    bodies: tuple[int, int]
    came: tuple[Edge | None, Edge | None]
    previous: int
    G: FloatArray
    XC: FloatArray


class MechanismMatcher:
    """Walks over two mechanisms, each from a body that both have to their ends.

    Args:
        a: One.
        b: The other, which is laid on it.
        pairing: Whose joint is whose.
        gauge: What is free; None: whatever makes most agree.
        ahead: How many steps ahead it may take for that.
        tolerance: Within which places and axes agree.
        base: Links of both on the bodies to begin at; None: the likeliest.
    """

    def __init__(
        self,
        a: Mechanism,
        b: Mechanism,
        pairing: Pairing,
        gauge: Gauge | None,
        ahead: Ahead,
        tolerance: Tolerance,
        base: tuple[int, int] | None,
    ) -> None:
        self.a, self.b, self.pairing, self.gauge, self.ahead = a, b, pairing, gauge, ahead
        self.tolerance, self.base = tolerance, base
        self.size = size_of(a, b)
        #: Subtrees that match exactly; None where nothing is free.
        self.exact = Congruence(a, b, pairing, tolerance, self._poses_behind) if gauge is None else None

    # -- where to begin ------------------------------------------------------------------------------

    def beginnings(self) -> Iterator[tuple[tuple[int, int], FloatArray]]:
        """Bodies that both have and where B's root may stand, the likeliest first."""
        if self.gauge is not None:
            names = self.gauge.base
            base = next(self._bases()) if names is None else self._bodies_of(*names)
            X = self.gauge.X
            yield base, IDENTITY if self.tolerance.holds(*apart(IDENTITY, X)) else X
            return
        bases = list(self._bases())
        if self.exact is not None:
            exact = self._exact_beginning(bases)
            if exact is None and self._mimics():
                self.exact.ignore_rules()
                exact = self._exact_beginning(bases)
            if exact is not None:
                yield exact
        for base in bases:
            tried = list[FloatArray]()
            for X in self._places(base):
                if not any(self.tolerance.holds(*apart(known, X)) for known in tried):
                    tried.append(X)
                    yield base, X

    def _mimics(self) -> bool:
        return any(joint.mimic is not None for m in (self.a, self.b) for joint in m.tree.joints)

    def _exact_beginning(self, bases: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], FloatArray] | None:
        """The first pair of bodies and place of B's root with which everything matches."""
        for base in bases:
            if self.pairing.same_shape(base, (None, None)):
                for X in self._exact_places(base):
                    if self._exact_pairs(base, (None, None), X) is not None:
                        return base, X
        return None

    def _exact_places(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Where B's root may stand if everything matches: all axes of the body lie on axes of the other."""
        yield from self._by_names(base)
        siblings = laid_by_siblings(self.a, self.b, base, lambda e, f: self.pairing.alike(base, e, f))
        some = (X for X in chain(siblings, laid(self.a, self.b, base)) if self.pairing.all_lie_alike(base, X))
        yield from islice(some, MOST_LAID)

    def _places(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Where B's root may stand: where A's does, where links of one name meet, where axes do."""
        yield from self._by_names(base)
        yield from self._by_axes(base)

    def _by_names(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Where A's root stands, where links of one name meet."""
        yield IDENTITY
        for link_a, link_b in self.pairing.links(*base):
            yield self.a.homes[link_a] @ inverse(self.b.homes[link_b])

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
        scored = list[tuple[float, Place, Score]]()
        for X in laid(self.a, self.b, base):
            place = Place(base, (None, None), -1, IDENTITY, X)
            scored.append((0.0, place, self._score(place)))
        best = _best_of(scored)[2] if scored else (0, 0.0)
        yield from (place.XC for _, place, score in scored if not better(best, score))

    # -- the walk ------------------------------------------------------------------------------------

    def run(self, base: tuple[int, int], X: FloatArray) -> Alignment:
        """What is found from a pair of bodies on, B's root standing at X."""
        found = Alignment(self.a, self.b, (self.a.bodies[base[0]][0], self.b.bodies[base[1]][0]), X)
        stack = [Place(base, (None, None), -1, IDENTITY, X)]
        while stack:
            place = stack.pop()
            self._frames(place, found)
            pairs, only_a, only_b = self._edges(place)
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

    def _edges(self, place: Place) -> tuple[Sequence[Pair], Sequence[Edge], Sequence[Edge]]:
        """Joints that lead on from a place: pairs, and what is left over of each."""
        pairs = self._exact_pairs(place.bodies, place.came, inverse(place.G) @ place.XC)
        if pairs is not None:
            return pairs, (), ()
        return self.pairing.edges(place.bodies, place.came, place.G, place.XC)

    def _exact_pairs(self, bodies: tuple[int, int], came: Came, X: FloatArray) -> Sequence[Pair] | None:
        """The pairs of joints at two bodies if all that they carry matches; None where nothing is free."""
        return None if self.exact is None else self.exact.at(bodies, came, X)

    def _poses_behind(self, beyond: tuple[int, int], came: Pair, X: FloatArray) -> Iterator[FloatArray]:
        """Candidates for the pose of B's body behind two joints of a kind, from its pose before them."""
        there = Place(beyond, came, -1, IDENTITY, X)
        kind, f = family(self.a.joint(came[0]).kind), came[1]
        if kind in ("turns", "prismatic"):
            t, turns = self.b.screw(f), kind == "turns"
            for offset in self._offsets(there, IDENTITY, t, turns):
                yield X @ along(t, offset, turns=turns) if offset else X
            return
        homes = self.a.homes[came[0].joint + 1], self.b.homes[f.joint + 1]
        plane = undoing(inverse(X @ homes[1]) @ homes[0]) if kind == "planar" else None
        for N in self._behind(there, homes[0], homes[1], plane, self._exact_places(beyond)):
            yield homes[0] @ N @ inverse(homes[1])

    def _frames(self, place: Place, found: Alignment) -> None:
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

    def _tool_on(self, place: Place, taken: list[tuple[int, int]]) -> FramePair | None:
        """Where no link of two bodies is the other's: any of either, as another tool on the same body."""
        ours, theirs = self._own_links(place)
        if taken or not ours or not theirs:
            return None
        home = self.a.homes[ours[0]]
        tool = inverse(place.G @ home) @ place.XC @ self.b.homes[theirs[0]]
        return FramePair(ours[0], theirs[0], place.previous, home, IDENTITY, 0.0, 0.0, tool)

    def _all_links(self, place: Place) -> list[tuple[int, int]]:
        """Links of one name, then those that stand in one place under names that the other has not."""
        pairs = list(self.pairing.links(*place.bodies))
        taken = {j for _, j in pairs}
        ours, theirs = self._own_links(place)
        for i in ours:
            at = place.G @ self.a.homes[i]
            for j in theirs:
                if j not in taken and self.tolerance.holds(*apart(at, place.XC @ self.b.homes[j])):
                    pairs.append((i, j))
                    taken.add(j)
                    break
        return pairs

    def _own_links(self, place: Place) -> tuple[list[int], list[int]]:
        """Links of two bodies under names that the other model has not."""
        names_a, names_b = self.a.tree.links, self.b.tree.links
        ours = [i for i in self.a.bodies[place.bodies[0]] if names_a[i] not in names_b]
        return ours, [j for j in self.b.bodies[place.bodies[1]] if names_b[j] not in names_a]

    def _step(self, place: Place, e: Edge, f: Edge, index: int, depth: int) -> tuple[Step, Place, Score]:
        """The step that a pair of joints makes, where it leads, and how well it fits what is behind it."""
        kinds = family(self.a.joint(e).kind), family(self.b.joint(f).kind)
        came = e, f
        backwards = e.outer == place.bodies[0], f.outer == place.bodies[1]
        bodies = e.beyond(place.bodies[0]), f.beyond(place.bodies[1])
        there = Place(bodies, came, index, place.G, place.XC)
        if kinds[0] != kinds[1]:
            return self._unlike(place, came, kinds, backwards), there, (0, 0.0)
        if kinds[0] in ("turns", "prismatic"):
            return self._like(place, there, backwards, depth, turns=kinds[0] == "turns")
        return self._free(place, there, backwards, depth, kinds[0])

    def _unlike(
        self, place: Place, came: tuple[Edge, Edge], kinds: tuple[str, str], backwards: tuple[bool, bool]
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
        self, place: Place, there: Place, backwards: tuple[bool, bool], depth: int, kind: str
    ) -> tuple[Step, Place, Score]:
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
        exact = self._exactly(place, there)
        if given is not None:
            tried: Iterable[FloatArray] = [inverse(given.before) if backwards[1] else given.behind]
        elif exact is not None:
            tried = [inverse(at) @ exact @ homes[1]]
        else:
            plane = undoing(M) if kind == "planar" else None
            tried = self._behind(there, at, homes[1], plane, self._by_axes(there.bodies))
        places = ((N, replace(there, XC=at @ N @ inverse(homes[1]))) for N in tried)
        N, moved, score = self._best(places, depth)
        # Outwards, P_b^(1 or -1) = M P_a^(1 or -1) N.
        pair = (inverse(N), inverse(M)) if backwards[1] else (M, N)
        before, behind = (IDENTITY if self.tolerance.holds(*apart(IDENTITY, T)) else T for T in pair)
        if before is IDENTITY and behind is IDENTITY and not back:
            return step, there, score
        return replace(step, conversion=JointTransform(before, behind, back)), moved, score

    def _behind(
        self,
        there: Place,
        at: FloatArray,
        home_b: FloatArray,
        plane: FloatArray | None,
        laid_behind: Iterable[FloatArray],
    ) -> Iterator[FloatArray]:
        """N to try: none, all as it stands at home, those with which a link or an axis behind agrees.

        Args:
            there: Behind the joint, B as it stands at home.
            at: (4, 4) the joint's frame.
            home_b: (4, 4) B's own.
            plane: (4, 4) what a planar joint's N is, but for motions in its plane.
            laid_behind: (4, 4) where B's axes behind the joint lie on A's.
        """
        yield IDENTITY if plane is None else plane
        wanted = [there.XC]
        wanted += [
            there.G @ self.a.homes[i] @ inverse(self.b.homes[j]) for i, j in self.pairing.links(*there.bodies)
        ]
        for XC in chain(wanted, (there.G @ X for X in laid_behind)):
            N = inverse(at) @ XC @ home_b
            yield N if plane is None else plane @ onto_plane(inverse(plane) @ N)

    def _like(
        self, place: Place, there: Place, backwards: tuple[bool, bool], depth: int, *, turns: bool
    ) -> tuple[Step, Place, Score]:
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
            exact = self._exactly(place, there)
            if exact is not None:
                zero = _value_of(t, inverse(place.XC) @ exact, turns=turns)
                zero = 0.0 if self.tolerance.holds(*apart(place.XC, exact)) else zero
            offset, there, score = self._best_zero(there, place.G, t, turns, zero, depth)
            return Step(a, b, kind, place.previous, sense, offset, IDENTITY, s, s, 0.0, 0.0), there, score
        # What hangs on the joint has moved with its axis, or its axis alone is another.
        with_it = self._best_zero(there, K @ place.G, t, turns, zero, depth)
        if depth == AHEAD:
            alone = self._best_zero(there, place.G, t, turns, zero, depth)
            if better(self._score(alone[1]), self._score(with_it[1])):
                other = end.moved(back)
                step = Step(a, b, kind, place.previous, sense, alone[0], IDENTITY, s, other, tilt, shift)
                return step, *alone[1:]
        before = back @ K @ place.G
        return Step(a, b, kind, place.previous, sense, with_it[0], before, s, s, tilt, shift), *with_it[1:]

    def _exactly(self, place: Place, there: Place) -> FloatArray | None:
        """(4, 4) the XC behind two joints with which all that they carry matches; None where none does."""
        if self.exact is None:
            return None
        X = self.exact.behind(*_both(there.came), place.bodies, inverse(place.G) @ place.XC)
        return None if X is None else place.G @ X

    # -- a joint's zero ------------------------------------------------------------------------------

    def _given(self, joint: str) -> tuple[int, float | None]:
        """Its sense and zero; 0 and None where they are free."""
        return (0, None) if self.gauge is None else self.gauge.zeros.get(joint, (1, 0.0))

    def _best_zero(
        self, there: Place, G: FloatArray, t: Screw, turns: bool, zero: float | None, depth: int
    ) -> tuple[float, Place, Score]:
        """The offset of B's joint with which most of what follows agrees; 0 has the first word."""
        offsets = self._offsets(there, G, t, turns) if zero is None else (zero,)
        moved = (
            (offset, there.XC @ along(t, offset, turns=turns) if offset else there.XC) for offset in offsets
        )
        return self._best(((offset, replace(there, G=G, XC=XC)) for offset, XC in moved), depth)

    def _best(self, choices: Iterable[tuple[_Free, Place]], depth: int) -> tuple[_Free, Place, Score]:
        """The first choice with which most agrees; between equals, what follows decides, `depth` joints on.

        Two axes that meet at right angles, say, lie on two others in two ways; the third one tells which.
        """
        scored = list[tuple[_Free, Place, Score]]()
        for what, place in choices:
            if any(self.tolerance.holds(*apart(known.XC, place.XC)) for _, known, _ in scored):
                continue
            score = self._score(place)
            scored.append((what, place, score))
            if not score[1] and self.pairing.links(*place.bodies):  # no other choice can agree as well
                return scored[-1]
        best = _best_of(scored)
        equal = [one for one in scored if not better(best[2], one[2])]
        if not depth or self.ahead.left <= 0 or (len(equal) == 1 and depth == AHEAD):
            return best
        seen = list[tuple[_Free, Place, Score]]()
        for what, place, here in equal:
            seen.append((what, place, self._with_behind(place, here, depth)))
            if not seen[-1][2][1]:
                break
        return _best_of(seen)

    def _with_behind(self, place: Place, here: Score, depth: int) -> Score:
        """The score of a place together with what follows."""
        pairs = self.pairing.edges(place.bodies, place.came, place.G, place.XC)[0]
        self.ahead.left -= len(pairs)
        scores = [here, *(self._step(place, e, f, -1, depth - 1)[2] for e, f in pairs)]
        return sum(count for count, _ in scores), max(off for _, off in scores)

    def _score(self, place: Place) -> Score:
        """How many of the links and axes at a place agree, and the largest disagreement (m)."""
        off = [
            apart(place.G @ self.a.homes[i], place.XC @ self.b.homes[j])
            for i, j in self.pairing.links(*place.bodies)
        ]
        pairs, _, _ = self.pairing.edges(place.bodies, place.came, place.G, place.XC)
        off += [self.pairing.mismatch(e, f, place.G, place.XC) for e, f in pairs]
        wrong = [angle * self.size + way for angle, way in off if not self.tolerance.holds(angle, way)]
        return len(off) - len(wrong), max(wrong, default=0.0)

    def _offsets(self, there: Place, G: FloatArray, t: Screw, turns: bool) -> Iterator[float]:
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


def _best_of(scored: Sequence[tuple[_Free, Place, Score]]) -> tuple[_Free, Place, Score]:
    """The first that no other is better than by much."""
    best = scored[0]
    for one in scored[1:]:
        best = one if better(one[2], best[2]) else best
    return best


def better(score: Score, than: Score) -> bool:
    """Whether more agrees, or as much and the rest twice as well."""
    return score[0] > than[0] or (score[0] == than[0] and score[1] < TWICE_AS_WELL * than[1])


def _value_of(screw: Screw, T: FloatArray, *, turns: bool) -> float:
    """The value of a joint that moves as a rigid motion does."""
    if turns:
        return turn_about(screw.direction, T[:3, :3])
    return float(screw.direction @ T[:3, 3])


def _outwards(screw: Screw, backwards: bool) -> Screw:
    """A joint's screw as it moves what is behind it on the walk, by the joint's own value."""
    return screw.reversed() if backwards else screw


def _both(came: tuple[Edge | None, Edge | None]) -> tuple[Edge, Edge]:
    e, f = came
    assert e is not None
    assert f is not None
    return e, f


def _all_beyond(mechanism: Mechanism, body: int, edges: Sequence[Edge]) -> list[int]:
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


#: Of joints whose order does not matter, so many orders are tried: all of five slides.
MOST_ORDERS = 120
#: So many steps ahead each search takes in all, seconds: TALOS without a name takes 500, Baxter 1,000.
MOST_AHEAD = 2000
#: What is off by so little (rad, and as a share of the size) is taken for nothing where nothing else helps.
NEARLY = (1e-11, 1e-9, 1e-7, 1e-5, 1e-3)
#: So many times joints that are called otherwise are taken for each other.
MOST_EXCHANGED = 12


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
    best = _laid(a, b, given, None, Ahead(MOST_AHEAD))
    for orders in b.orders_of_runs(tolerance_of(a, b)):
        if best.complete:
            break
        as_it_is, run = best.b, next(orders)
        for names in _orders_to_try(a, as_it_is, given, run, orders):
            moved = [k for k, name in enumerate(names) if name != run[k]]
            other = as_it_is.in_order(names[moved[0] : moved[-1] + 1])
            found = _laid(a, other, given, None)
            if better((found.matched, found.worst), (best.matched, best.worst)):
                best = found
    return _by_rules(_nearly(_exchanged(best, given), given))


def _orders_to_try(
    a: Mechanism, b: Mechanism, given: Mapping[str, str], run: Sequence[str], orders: Iterator[list[str]]
) -> Iterator[Sequence[str]]:
    """Other orders of a run of B's joints: the one of A where A has all their names, else any.

    Args:
        a: One.
        b: The other.
        given: Joints of A and their names in B.
        run: Names of B's joints, from the inner body outwards.
        orders: All other orders that their axes allow.
    """
    called = {given.get(joint.name, joint.name): i for i, joint in enumerate(a.tree.joints)}
    if not all(name in called for name in run):
        yield from islice(orders, MOST_ORDERS)
        return
    named = sorted(run, key=called.__getitem__)
    if list(run) in (named, named[::-1]):
        return
    yield from (order for order in (named, named[::-1]) if b.may_be_taken(order, tolerance_of(a, b)))


def _by_rules(best: Alignment) -> Alignment:
    """The same with zeros that mimic rules give, where all that agreed agrees still."""
    zeros = zeros_by_rules(best, tolerance_of(best.a, best.b))
    if not zeros:
        return best
    gauge = best.gauge
    found = _laid(best.a, best.b, best.names, replace(gauge, zeros={**gauge.zeros, **zeros}))
    return found if found.differing <= best.differing and found.worst <= best.worst else best


def _exchanged(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Joints on one body that share no name taken for each other: arms that mirror each other, say."""
    if best.only_a or best.only_b:  # two robots, which no exchange makes one
        return best
    tried, ahead = set[frozenset[tuple[int, int]]](), Ahead(MOST_AHEAD)
    while (two := next((two for two in best.exchangeable(given) if two not in tried), None)) is not None:
        tried.add(two)
        if len(tried) > MOST_EXCHANGED:
            break
        joints = best.a.tree.joints, best.b.tree.joints
        (a, b), (c, d) = two
        other = {joints[0][a].name: joints[1][d].name, joints[0][c].name: joints[1][b].name}
        found = _laid(best.a, best.b, {**given, **other}, None, ahead, base=best.base)
        if better((found.matched, found.worst), (best.matched, best.worst)):
            best, given = found, {**given, **other}
    return best


def _nearly(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Another way to lay them on each other, which agrees by far more; the same where none is.

    Where each axis is off by a little, none says which of two ways is meant, as one that agrees would. So
    what is little is taken for nothing, more and more of it, until all agree; with what was free set as that
    search found it, they are laid on each other once more and all that is little is told. What is off by more
    is no way chosen wrongly unless something before it is off by less.
    """
    a, b, (least, most), ahead = best.a, best.b, best.inner_off, Ahead(MOST_AHEAD)
    for angle in NEARLY:
        if not least < angle * best.size < TWICE_AS_WELL * most:
            continue
        tolerance = Tolerance(angle, angle * best.size)
        rough = _laid(a, b, given, None, ahead, tolerance, best.base)
        if rough.inner_off[1] or (len(rough.only_a), len(rough.only_b)) != (
            len(best.only_a),
            len(best.only_b),
        ):
            continue
        exact = _laid(a, b, rough.names, rough.gauge)
        return exact if exact.inner_off[1] < TWICE_AS_WELL * most else best
    return best


def _laid(
    a: Mechanism,
    b: Mechanism,
    given: Mapping[str, str],
    gauge: Gauge | None,
    ahead: Ahead | None = None,
    tolerance: Tolerance | None = None,
    base: tuple[int, int] | None = None,
) -> Alignment:
    """The best of all bodies to begin at, or of the one of two links, with some steps ahead."""
    tolerance = tolerance or tolerance_of(a, b)
    walk = MechanismMatcher(a, b, Pairing(a, b, given, tolerance), gauge, ahead or Ahead(0), tolerance, base)
    best: Alignment | None = None
    for bodies, X in walk.beginnings():
        found = walk.run(bodies, X)
        if best is None or better((found.matched, found.worst), (best.matched, best.worst)):
            best = found
        if not best.worst and not (best.only_a and best.only_b):
            break
    assert best is not None
    return best
