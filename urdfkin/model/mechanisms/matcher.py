"""Align mechanism B with mechanism A: pair their joints, and find the sign and zero offset of each joint.

`MechanismMatcher` starts at a body of A and the corresponding body of B. From these bodies it goes through
both trees, joint by joint. At each joint it chooses a sign (`sense`) and a zero offset. With this
choice, most later links and axes of B coincide with those of A. `align` calls the matcher for several first
bodies and joint orders, and returns the best result.

In most cases, the axes and link frames below a joint determine its zero offset. If no axes and no link frames
are below the joint, only a mimic rule can determine the offset. Let v = m w + c be a mimic rule of A, and let
v' = m' w' + c' be the corresponding rule of B. The two rules are equivalent if the substitution v' = s v + o,
w' = s' w + o' converts one rule to the other. If nothing is attached to the joint's link, the two mimic rules
determine o. For a revolute joint, a multiple of a full turn may always be added to o.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import TypeVar

from urdfkin.model.mechanisms.joint_matching import (
    Congruence,
    Pair,
    Pairing,
    Via,
    family,
    later_axes,
    root_poses_by_axes,
    root_poses_by_siblings,
    zero_candidates,
)
from urdfkin.model.mechanisms.mechanism import (
    IDENTITY,
    Alignment,
    Edge,
    FramePair,
    Gauge,
    JointTransform,
    MatchedJoints,
    Mechanism,
    Screw,
    Tolerance,
    angle_about,
    between_lines,
    nearest_planar_pose,
    planar_counterpart,
    pose_difference,
    screw_motion,
    size_of,
    smallest_motion,
    tolerance_of,
)
from urdfkin.model.tree import FloatArray, Joint, inverse

#: The matcher compares this number of further joints if two choices agree equally well.
AHEAD = 6
#: The search for an exact match tries at most this number of poses of B's root.
#: In each of these poses, the axes at a body of B coincide with axes at a body of A.
MOST_ROOT_POSES = 48
#: Suppose that equally many links and axes agree for two choices.
#: One choice is better if its largest difference is less than this fraction of the other's.
TWICE_AS_WELL = 0.5

#: The result for a joint is a zero offset (rad or m); for a planar or floating joint, it is a pose.
_Free = TypeVar("_Free", float, FloatArray)
#: A score is the number of links and axes of A that agree with B, and the largest difference (m).
Score = tuple[int, float]


@dataclass(slots=True)
class LookAhead:
    """The number of joint pairs ahead that several matchers together may still compare."""

    left: int


@dataclass(frozen=True, slots=True, eq=False)
class BodyPair:
    """A body of A, the corresponding body of B, and the poses that the matcher has found for them.

    Attributes:
        via: The joint of A and the joint of B before these bodies; None at the base.
        previous: Index of the step (joint pair) before these bodies; -1 at the base.
        G: (4, 4) motion that moves A's zero configuration to the current pose of B.
        XC: (4, 4) motion that moves B's zero configuration to the current pose of B.
    """

    bodies: tuple[int, int]
    via: tuple[Edge | None, Edge | None]
    previous: int
    G: FloatArray
    XC: FloatArray


class MechanismMatcher:
    """Match the joints of two mechanisms, from a common body to the ends of all branches.

    Args:
        a: One mechanism.
        b: The other mechanism, which is aligned with `a`.
        pairing: Finds the joints of `a` and `b` that may be matched.
        gauge: Prescribed choices, for example zero offsets. If this is None, the matcher finds the choices
            for which most joints and links agree.
        ahead: The number of joint pairs that the matcher may compare ahead of the current joint.
        tolerance: Tolerance for the comparison of poses and axes.
        base: A link of `a` and a link of `b`. The matcher starts at the bodies of these links. If this is
            None, the matcher starts at the bodies with most link names in common.
    """

    def __init__(
        self,
        a: Mechanism,
        b: Mechanism,
        pairing: Pairing,
        gauge: Gauge | None,
        ahead: LookAhead,
        tolerance: Tolerance,
        base: tuple[int, int] | None,
    ) -> None:
        self.a, self.b, self.pairing, self.gauge, self.ahead = a, b, pairing, gauge, ahead
        self.tolerance, self.base = tolerance, base
        self.size = size_of(a, b)
        #: The results of `_counts` for A and for B.
        self.counts = _counts(a), _counts(b)
        #: The number of joints and links that agree in the best alignment so far.
        self.matched = 0
        #: It searches for exactly matching subtrees; None means that `gauge` prescribes the alignment.
        self.exact = Congruence(a, b, pairing, tolerance, self._poses_behind) if gauge is None else None

    # -- where to begin ------------------------------------------------------------------------------

    def best(self) -> Alignment:
        """Return the best alignment over all first bodies, or the first of several that are equally good."""
        best: Alignment | None = None
        for bodies, X in self._beginnings():
            found = self._run(bodies, X)
            if best is None or better((found.matched, found.worst), (best.matched, best.worst)):
                best, self.matched = found, found.matched
            if not best.worst and not (best.only_a and best.only_b):
                break
        assert best is not None
        return best

    def _beginnings(self) -> Iterator[tuple[tuple[int, int], FloatArray]]:
        """Yield pairs of bodies at which the matcher can start, with a pose of B's root in A's root frame.

        The most likely pair comes first. A pair is omitted if fewer joints and links can agree from it than
        agree in the best alignment so far.
        """
        if self.gauge is not None:
            names = self.gauge.base
            base = next(self._bases())
            if names is not None:
                links = self.a.tree.link_index(names[0]), self.b.tree.link_index(names[1])
                base = self.a.body_of[links[0]], self.b.body_of[links[1]]
            X = self.gauge.X
            yield base, IDENTITY if self.tolerance.holds(*pose_difference(IDENTITY, X)) else X
            return
        bases = list(self._bases())
        if self.exact is not None:
            exact = self._exact_beginning(bases)
            if exact is None and any(joint.mimic for m in (self.a, self.b) for joint in m.tree.joints):
                self.exact.ignore_rules()
                exact = self._exact_beginning(bases)
            if exact is not None:
                yield exact
        for base in bases:
            if self._most(base) < self.matched:
                continue
            tried = list[FloatArray]()
            for X in self._places(base):
                if not any(self.tolerance.holds(*pose_difference(known, X)) for known in tried):
                    tried.append(X)
                    yield base, X

    def _most(self, base: tuple[int, int]) -> int:
        """Return an upper bound on the joints and links that match if the matcher starts at two bodies.

        Each branch at one body is matched with at most one branch at the other body. In two matched branches,
        at most all joints and all links of the smaller branch agree. The sum of these numbers is largest if
        the branches are matched in the order of their sizes.
        """
        most = min(len(self.a.bodies[base[0]]), len(self.b.bodies[base[1]]))
        for k in (0, 1):  # The counts of joints and of links.
            sizes = (
                sorted(
                    (
                        counts[edge.outer][k] if edge.inner == body else counts[0][k] - counts[edge.outer][k]
                        for edge in m.edges_of[body]
                    ),
                    reverse=True,
                )
                for m, body, counts in zip((self.a, self.b), base, self.counts, strict=True)
            )
            most += sum(map(min, *sizes))
        return most

    def _exact_beginning(self, bases: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], FloatArray] | None:
        """Return two bodies and a pose of B's root for which all of A matches all of B exactly, or None."""
        for base in bases:
            if self.pairing.same_shape(base, (None, None)):
                for X in self._exact_places(base):
                    if self._exact_pairs(base, (None, None), X) is not None:
                        return base, X
        return None

    def _exact_places(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Yield poses of B's root for which all axes at the first body of B coincide with axes of A."""
        yield from self._by_names(base)
        siblings = root_poses_by_siblings(self.a, self.b, base, lambda e, f: self.pairing.alike(base, e, f))
        some = (
            X
            for X in chain(siblings, root_poses_by_axes(self.a, self.b, base))
            if self.pairing.all_lie_alike(base, X)
        )
        yield from islice(some, MOST_ROOT_POSES)

    def _places(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Yield poses of B's root: that of A's root, then by links with equal names, then by axes."""
        yield from self._by_names(base)
        yield from self._by_axes(base)

    def _by_names(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        """Yield the pose of A's root, then the poses of B's root that align links of equal names."""
        yield IDENTITY
        for link_a, link_b in self.pairing.links(*base):
            yield self.a.homes[link_a] @ inverse(self.b.homes[link_b])

    def _bases(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of bodies (one of A and one of B) at which the matcher may start.

        The first pair is A's root body and the body of B that has most link names in common with it. If no
        body of B has a link name in common with A's root body, A's root body is paired with every body of B.
        Then comes one more pair: B's root body and the body of A that has most link names in common with it.
        The last pair is needed if A's root does not exist in B, for example because a floating joint follows
        A's root.
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
        """Yield poses of B's root that align the first axes of A and B. The best alignment comes first."""
        scored = list[tuple[float, BodyPair, Score]]()
        for X in root_poses_by_axes(self.a, self.b, base):
            place = BodyPair(base, (None, None), -1, IDENTITY, X)
            scored.append((0.0, place, self._score(place)))
        best = _best_of(scored)[2] if scored else (0, 0.0)
        yield from (place.XC for _, place, score in scored if not better(best, score))

    # -- matching ------------------------------------------------------------------------------------

    def _run(self, base: tuple[int, int], X: FloatArray) -> Alignment:
        """Pair all joints and links, starting at two bodies; X is the pose of B's root in A's root frame."""
        found = Alignment(self.a, self.b, (self.a.bodies[base[0]][0], self.b.bodies[base[1]][0]), X)
        stack = [BodyPair(base, (None, None), -1, IDENTITY, X)]
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

    def _edges(self, place: BodyPair) -> tuple[Sequence[Pair], Sequence[Edge], Sequence[Edge]]:
        pairs = self._exact_pairs(place.bodies, place.via, inverse(place.G) @ place.XC)
        if pairs is not None:
            return pairs, (), ()
        return self.pairing.edges(place.bodies, place.via, place.G, place.XC)

    def _exact_pairs(self, bodies: tuple[int, int], via: Via, X: FloatArray) -> Sequence[Pair] | None:
        return None if self.exact is None else self.exact.joint_pairs(bodies, via, X)

    def _poses_behind(self, beyond: tuple[int, int], via: Pair, X: FloatArray) -> Iterator[FloatArray]:
        """Yield poses of the body of B after a joint, for the pose X of the body before it."""
        there = BodyPair(beyond, via, -1, IDENTITY, X)
        kind, f = family(self.a.joint(via[0]).kind), via[1]
        if kind in ("turns", "prismatic"):
            t, turns = self.b.screw(f), kind == "turns"
            for offset in self._offsets(there, IDENTITY, t, turns):
                yield X @ screw_motion(t, offset, turns=turns) if offset else X
            return
        homes = self.a.homes[via[0].joint + 1], self.b.homes[f.joint + 1]
        plane = planar_counterpart(inverse(X @ homes[1]) @ homes[0]) if kind == "planar" else None
        for N in self._behind(there, homes[0], homes[1], plane, self._exact_places(beyond)):
            yield homes[0] @ N @ inverse(homes[1])

    def _frames(self, place: BodyPair, found: Alignment) -> None:
        pairs = self._all_links(place)
        if (other := self._as_tools(place, pairs)) is not None:
            found.frames.append(other)
        for link_a, link_b in pairs:
            home = self.a.homes[link_a]
            at, seen = place.G @ home, place.XC @ self.b.homes[link_b]
            angle, way = pose_difference(at, seen)
            end = IDENTITY
            if self.tolerance.holds(angle, way):
                angle = way = 0.0
                found.matched += 1
            else:
                end = inverse(place.G) @ seen @ inverse(home)
                found.worst = max(found.worst, angle * self.size + way)
            found.frames.append(FramePair(link_a, link_b, place.previous, home, end, angle, way))

    def _as_tools(self, place: BodyPair, taken: list[tuple[int, int]]) -> FramePair | None:
        """Return two links, one of each body, that can be different end-effector frames; or None.

        The result is None if links of the two bodies match, or if a body has no link of its own.
        """
        ours, theirs = self._own_links(place)
        if taken or not ours or not theirs:
            return None
        home = self.a.homes[ours[0]]
        tool = inverse(place.G @ home) @ place.XC @ self.b.homes[theirs[0]]
        return FramePair(ours[0], theirs[0], place.previous, home, IDENTITY, 0.0, 0.0, tool)

    def _all_links(self, place: BodyPair) -> list[tuple[int, int]]:
        """Return pairs of links with equal names, then pairs of links with equal poses.

        A link is paired by its pose only if its name does not exist in the other model.
        """
        pairs = list(self.pairing.links(*place.bodies))
        taken = {j for _, j in pairs}
        ours, theirs = self._own_links(place)
        for i in ours:
            at = place.G @ self.a.homes[i]
            for j in theirs:
                if j not in taken and self.tolerance.holds(*pose_difference(at, place.XC @ self.b.homes[j])):
                    pairs.append((i, j))
                    taken.add(j)
                    break
        return pairs

    def _own_links(self, place: BodyPair) -> tuple[list[int], list[int]]:
        """Return the links of two matched bodies whose names do not occur in the other model."""
        names_a, names_b = self.a.labels, self.b.labels
        ours = [i for i in self.a.bodies[place.bodies[0]] if names_a[i] not in names_b]
        return ours, [j for j in self.b.bodies[place.bodies[1]] if names_b[j] not in names_a]

    def _step(
        self, place: BodyPair, e: Edge, f: Edge, index: int, depth: int
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        """Match two joints. Return their step, the bodies after them (`BodyPair`), and the score."""
        kinds = family(self.a.joint(e).kind), family(self.b.joint(f).kind)
        via = e, f
        backwards = e.outer == place.bodies[0], f.outer == place.bodies[1]
        bodies = e.other_body(place.bodies[0]), f.other_body(place.bodies[1])
        there = BodyPair(bodies, via, index, place.G, place.XC)
        if kinds[0] != kinds[1]:
            return self._unlike(place, via, kinds, backwards), there, (0, 0.0)
        if kinds[0] in ("turns", "prismatic"):
            return self._like(place, there, backwards, depth, turns=kinds[0] == "turns")
        return self._free(place, there, backwards, depth, kinds[0])

    def _unlike(
        self, place: BodyPair, via: tuple[Edge, Edge], kinds: tuple[str, str], backwards: tuple[bool, bool]
    ) -> MatchedJoints:
        """Return the step for two joints of different kinds. One of the joints may be fixed."""
        unlike = {kinds[0]: "a", kinds[1]: "b"}.get("fixed", "kind")
        if unlike == "a":
            axis = _outwards(self.b.screw(via[1]), backwards[1]).moved(inverse(place.G) @ place.XC)
        else:
            axis = _outwards(self.a.screw(via[0]), backwards[0])
        kind = kinds[1] if unlike == "a" else kinds[0]
        return MatchedJoints(
            via[0].joint, via[1].joint, kind, place.previous, 1, 0.0, IDENTITY, axis, axis, 0.0, 0.0, unlike
        )

    def _free(
        self, place: BodyPair, there: BodyPair, backwards: tuple[bool, bool], depth: int, kind: str
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        """Match two planar or two floating joints, whose frames and zeros may differ."""
        e, f = _both(there.via)
        homes = self.a.homes[e.joint + 1], self.b.homes[f.joint + 1]
        at, seen = place.G @ homes[0], place.XC @ homes[1]
        axis, back = Screw(homes[0][:3, 2], homes[0][:3, 3]), backwards[0] != backwards[1]
        step = MatchedJoints(e.joint, f.joint, kind, place.previous, 1, 0.0, IDENTITY, axis, axis, 0.0, 0.0)
        given = None if self.gauge is None else self.gauge.conversions.get(self.a.joint(e).name)
        as_written = self.gauge is not None and given is None
        if as_written:
            K, tilt, shift = seen @ inverse(at), *pose_difference(at, seen)
        else:
            K, tilt, shift = _normals_apart(at, seen) if kind == "planar" else (IDENTITY, 0.0, 0.0)
        if not self.tolerance.holds(tilt, shift):
            step = replace(step, before=inverse(place.G) @ K @ place.G, tilt=tilt, shift=shift)
            there, at = replace(there, G=K @ place.G), K @ at
        if as_written:
            return replace(step, unlike="kind" if back else ""), there, (0, 0.0)
        M = inverse(seen) @ at
        exact = self._exact_pose(place, there)
        if given is not None:
            tried: Iterable[FloatArray] = [inverse(given.before) if backwards[1] else given.behind]
        elif exact is not None:
            tried = [inverse(at) @ exact @ homes[1]]
        else:
            plane = planar_counterpart(M) if kind == "planar" else None
            tried = self._behind(there, at, homes[1], plane, self._by_axes(there.bodies))
        places = ((N, replace(there, XC=at @ N @ inverse(homes[1]))) for N in tried)
        N, moved, score = self._best(places, depth)
        # Let P_a and P_b be the joint's poses in A and B, so P_b = M P_a N.
        # If the path leads from the joint's child to its parent, P_a and P_b are the inverse poses.
        pair = (inverse(N), inverse(M)) if backwards[1] else (M, N)
        before, behind = (
            IDENTITY if self.tolerance.holds(*pose_difference(IDENTITY, T)) else T for T in pair
        )
        if before is IDENTITY and behind is IDENTITY and not back:
            return step, there, score
        return replace(step, conversion=JointTransform(before, behind, back)), moved, score

    def _behind(
        self,
        there: BodyPair,
        at: FloatArray,
        home_b: FloatArray,
        plane: FloatArray | None,
        poses_behind: Iterable[FloatArray],
    ) -> Iterator[FloatArray]:
        """Yield candidates for the rigid motion N of a planar or floating joint (P_b = M P_a N).

        First comes the identity (or `plane`), then the N of the zero configuration. Then come those N for
        which a link or an axis of B coincides with one of A.

        Args:
            there: The bodies after the joint, with B in its zero configuration.
            at: (4, 4) the joint's frame.
            home_b: (4, 4) the frame of B's joint in the zero configuration.
            plane: (4, 4) one possible N of a planar joint. Every other possible N is the product of this N
                and a planar pose. None for a floating joint.
            poses_behind: (4, 4) poses of B's body after the joint for which axes of A and B coincide.
        """
        yield IDENTITY if plane is None else plane
        wanted = [there.XC]
        wanted += [
            there.G @ self.a.homes[i] @ inverse(self.b.homes[j]) for i, j in self.pairing.links(*there.bodies)
        ]
        for XC in chain(wanted, (there.G @ X for X in poses_behind)):
            N = inverse(at) @ XC @ home_b
            yield N if plane is None else plane @ nearest_planar_pose(inverse(plane) @ N)

    def _like(
        self, place: BodyPair, there: BodyPair, backwards: tuple[bool, bool], depth: int, *, turns: bool
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        """Match two revolute joints or two prismatic joints.

        The method chooses the sign and the zero offset of B's joint, and decides whether the two axes differ.
        """
        e, f = _both(there.via)
        s = _outwards(self.a.screw(e), backwards[0])
        t = _outwards(self.b.screw(f), backwards[1])
        start, end = s.moved(place.G), t.moved(place.XC)
        sense, zero = self._prescribed(self.a.joint(e).name)
        sense = sense or (-1 if start.direction @ end.direction < 0.0 else 1)
        if sense < 0:
            end = end.reversed()
        K, tilt, shift = smallest_motion(start, end, turns=turns)
        back = inverse(place.G)
        kind, (a, b) = "turns" if turns else "prismatic", (e.joint, f.joint)
        if self.tolerance.holds(tilt, shift):
            exact = self._exact_pose(place, there)
            if exact is not None:
                T = inverse(place.XC) @ exact
                zero = angle_about(t.direction, T[:3, :3]) if turns else float(t.direction @ T[:3, 3])
                zero = 0.0 if self.tolerance.holds(*pose_difference(place.XC, exact)) else zero
            offset, there, score = self._best_zero(there, place.G, t, turns, zero, depth)
            return (
                MatchedJoints(a, b, kind, place.previous, sense, offset, IDENTITY, s, s, 0.0, 0.0),
                there,
                score,
            )
        # Either the joint and all bodies after it have another pose in B, or only the joint's axis differs.
        with_it = self._best_zero(there, K @ place.G, t, turns, zero, depth)
        if depth == AHEAD:
            alone = self._best_zero(there, place.G, t, turns, zero, depth)
            if better(self._score(alone[1]), self._score(with_it[1])):
                other = end.moved(back)
                step = MatchedJoints(
                    a, b, kind, place.previous, sense, alone[0], IDENTITY, s, other, tilt, shift
                )
                return step, *alone[1:]
        before = back @ K @ place.G
        return MatchedJoints(
            a, b, kind, place.previous, sense, with_it[0], before, s, s, tilt, shift
        ), *with_it[1:]

    def _exact_pose(self, place: BodyPair, there: BodyPair) -> FloatArray | None:
        """Return `XC` of the bodies after two joints if the subtrees below them match exactly, else None."""
        if self.exact is None:
            return None
        X = self.exact.pose_after(*_both(there.via), place.bodies, inverse(place.G) @ place.XC)
        return None if X is None else place.G @ X

    # -- a joint's zero ------------------------------------------------------------------------------

    def _prescribed(self, joint: str) -> tuple[int, float | None]:
        """Return the sign and the zero offset that `gauge` prescribes; (0, None) without a `gauge`."""
        return (0, None) if self.gauge is None else self.gauge.zeros.get(joint, (1, 0.0))

    def _best_zero(
        self, there: BodyPair, G: FloatArray, t: Screw, turns: bool, zero: float | None, depth: int
    ) -> tuple[float, BodyPair, Score]:
        """Return the zero offset of B's joint for which most links and axes agree; 0 is tried first."""
        offsets = self._offsets(there, G, t, turns) if zero is None else (zero,)
        moved = (
            (offset, there.XC @ screw_motion(t, offset, turns=turns) if offset else there.XC)
            for offset in offsets
        )
        return self._best(((offset, replace(there, G=G, XC=XC)) for offset, XC in moved), depth)

    def _best(self, choices: Iterable[tuple[_Free, BodyPair]], depth: int) -> tuple[_Free, BodyPair, Score]:
        """Return the choice for which most links and axes agree.

        If several choices are equally good, the method compares the next `depth` joints too. Example: two
        axes of B intersect at right angles, and so do two axes of A. Two different poses of B make these axes
        coincide, so a third axis must decide.
        """
        scored = list[tuple[_Free, BodyPair, Score]]()
        for what, place in choices:
            if any(self.tolerance.holds(*pose_difference(known.XC, place.XC)) for _, known, _ in scored):
                continue
            score = self._score(place)
            scored.append((what, place, score))
            if not score[1] and self.pairing.links(*place.bodies):  # No other choice can agree better.
                return scored[-1]
        best = _best_of(scored)
        equal = [one for one in scored if not better(best[2], one[2])]
        if not depth or self.ahead.left <= 0 or (len(equal) == 1 and depth == AHEAD):
            return best
        seen = list[tuple[_Free, BodyPair, Score]]()
        for what, place, here in equal:
            seen.append((what, place, self._with_behind(place, here, depth)))
            if not seen[-1][2][1]:
                break
        return _best_of(seen)

    def _with_behind(self, place: BodyPair, here: Score, depth: int) -> Score:
        """Return the score for the bodies of `place` and for the next `depth` joints after them."""
        pairs = self.pairing.edges(place.bodies, place.via, place.G, place.XC)[0]
        self.ahead.left -= len(pairs)
        scores = [here, *(self._step(place, e, f, -1, depth - 1)[2] for e, f in pairs)]
        return sum(count for count, _ in scores), max(off for _, off in scores)

    def _score(self, place: BodyPair) -> Score:
        """Return the number of matching links and axes of two bodies, and the largest difference (m)."""
        off = [
            pose_difference(place.G @ self.a.homes[i], place.XC @ self.b.homes[j])
            for i, j in self.pairing.links(*place.bodies)
        ]
        pairs, _, _ = self.pairing.edges(place.bodies, place.via, place.G, place.XC)
        off += [self.pairing.mismatch(e, f, place.G, place.XC) for e, f in pairs]
        wrong = [angle * self.size + way for angle, way in off if not self.tolerance.holds(angle, way)]
        return len(off) - len(wrong), max(wrong, default=0.0)

    def _offsets(self, there: BodyPair, G: FloatArray, t: Screw, turns: bool) -> Iterator[float]:
        """Yield zero offsets of B's joint: 0, then those for which links or axes after the joint coincide."""
        yield 0.0
        u = t.moved(there.XC)
        for i, j in self.pairing.links(*there.bodies):
            at, seen = G @ self.a.homes[i], there.XC @ self.b.homes[j]
            if turns:
                yield angle_about(u.direction, at[:3, :3] @ seen[:3, :3].T)
            else:
                yield float(u.direction @ (at[:3, 3] - seen[:3, 3]))
        for ours, theirs in later_axes((self.a, self.b), there.via, there.bodies, (u.moved(inverse(G)), t)):
            yield from zero_candidates(u, ours.moved(G), theirs.moved(there.XC), turns)


def _counts(mechanism: Mechanism) -> list[tuple[int, int]]:
    """Return the numbers of joints and links in each body's subtree, with the joint before the body.

    The root body has no joint before it, but is counted as if it had one.
    """
    found = [(1, len(links)) for links in mechanism.bodies]
    for edge in reversed(mechanism.edges):  # The edges go from the root to the tips.
        joints, links = found[edge.outer]
        found[edge.inner] = found[edge.inner][0] + joints, found[edge.inner][1] + links
    return found


def _most_shared(one: Mechanism, other: Mechanism) -> int | None:
    """Return the body of `other` with most link names in common with the root body of `one`, or None."""
    names = {one.labels[link] for link in one.bodies[0]}
    shared = [len(names & {other.labels[k] for k in body}) for body in other.bodies]
    return max(range(len(shared)), key=shared.__getitem__) if any(shared) else None


def _best_of(scored: Sequence[tuple[_Free, BodyPair, Score]]) -> tuple[_Free, BodyPair, Score]:
    best = scored[0]
    for one in scored[1:]:
        best = one if better(one[2], best[2]) else best
    return best


def better(score: Score, than: Score) -> bool:
    """Return whether `score` is better than `than`.

    The score with more agreeing links and axes is better. If both numbers are equal, `score` is better if its
    largest difference is less than half of the largest difference of `than`.
    """
    return score[0] > than[0] or (score[0] == than[0] and score[1] < TWICE_AS_WELL * than[1])


def _outwards(screw: Screw, backwards: bool) -> Screw:
    """Return a screw whose sign describes the motion of the body farther from the base."""
    return screw.reversed() if backwards else screw


def _both(via: tuple[Edge | None, Edge | None]) -> tuple[Edge, Edge]:
    e, f = via
    assert e is not None
    assert f is not None
    return e, f


def _all_beyond(mechanism: Mechanism, body: int, edges: Sequence[Edge]) -> list[int]:
    """Return the indices of the joints `edges` at a body, and of all joints behind them."""
    found, stack = [], [(body, edge) for edge in edges]
    while stack:
        here, edge = stack.pop()
        found.append(edge.joint)
        beyond = edge.other_body(here)
        stack += [(beyond, other) for other in mechanism.edges_of[beyond] if other is not edge]
    return found


def _normals_apart(at: FloatArray, seen: FloatArray) -> tuple[FloatArray, float, float]:
    """Return the angle (rad) and the distance (m) between two planes; opposite normals count as equal."""
    start, end = (Screw(T[:3, 2], T[:3, 3]) for T in (at, seen))
    return smallest_motion(
        start, end.reversed() if start.direction @ end.direction < 0.0 else end, turns=False
    )


#: At most this number of joint orders is tried; five prismatic joints have 120 possible orders.
MOST_ORDERS = 120
#: One search compares at most this number of joint pairs ahead of the current joint, in some seconds.
#: Without names, the robot TALOS needs 500 pairs, and Baxter needs 1,000.
MOST_AHEAD = 2000
#: Larger tolerances that are tried if A and B differ: rad, and distances divided by the robot's size.
NEARLY = (1e-11, 1e-9, 1e-7, 1e-5, 1e-3)
#: At most this number of exchanges is tried: (a, d) and (c, b) instead of the pairs (a, b) and (c, d).
#: Only joints with different names are exchanged.
MOST_EXCHANGED = 12


def align(a: Mechanism, b: Mechanism, given: Mapping[str, str], gauge: Gauge | None = None) -> Alignment:
    """Align B with A.

    `given` contains names of joints of A, each with the name of the matched joint in B. `gauge` prescribes
    choices, for example zero offsets; without it, the function finds the choices for which most joints and
    links agree.
    """
    if gauge is not None:
        for taken in gauge.orders:
            b = b.reordered(taken)
        return _best_alignment(a, b, given, gauge)
    best = _best_alignment(a, b, given, None, LookAhead(MOST_AHEAD))
    for orders in b.orders_of_runs(tolerance_of(a, b)):
        if best.complete:
            break
        as_it_is, run = best.b, next(orders)
        for names in _orders_to_try(a, as_it_is, given, run, orders):
            moved = [k for k, name in enumerate(names) if name != run[k]]
            other = as_it_is.reordered(names[moved[0] : moved[-1] + 1])
            found = _best_alignment(a, other, given, None)
            if better((found.matched, found.worst), (best.matched, best.worst)):
                best = found
    return _by_rules(_nearly(_exchanged(best, given), given))


def _orders_to_try(
    a: Mechanism, b: Mechanism, given: Mapping[str, str], run: Sequence[str], orders: Iterator[list[str]]
) -> Iterator[Sequence[str]]:
    """Yield other orders of consecutive joints of B that give the same motion.

    If A has joints with all these names, the only two orders are the order in A and the reverse order.
    Otherwise all `orders` are tried, up to `MOST_ORDERS`. `run` is the present order, from base to tip.
    """
    called = {given.get(joint.name, joint.name): i for i, joint in enumerate(a.tree.joints)}
    if not all(name in called for name in run):
        yield from islice(orders, MOST_ORDERS)
        return
    named = sorted(run, key=called.__getitem__)
    if list(run) in (named, named[::-1]):
        return
    yield from (order for order in (named, named[::-1]) if b.allows_order(order, tolerance_of(a, b)))


def _by_rules(best: Alignment) -> Alignment:
    """Return the alignment with the zero offsets that fit the mimic rules, or `best` if it is better."""
    zeros = zeros_by_rules(best, tolerance_of(best.a, best.b))
    if not zeros:
        return best
    gauge = best.gauge
    found = _best_alignment(best.a, best.b, best.names, replace(gauge, zeros={**gauge.zeros, **zeros}))
    return found if found.differing <= best.differing and found.worst <= best.worst else best


def _exchanged(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Try (a, d) and (c, b) instead of the joint pairs (a, b) and (c, d), for example in two mirrored arms.

    The four joints are attached to the same body of A or B, and the joints of a pair have different names.
    """
    if best.only_a or best.only_b:  # Some joints have no partner, so no exchange can make A and B equal.
        return best
    tried, ahead = set[frozenset[tuple[int, int]]](), LookAhead(MOST_AHEAD)
    while (two := next((two for two in best.exchangeable(given) if two not in tried), None)) is not None:
        tried.add(two)
        if len(tried) > MOST_EXCHANGED:
            break
        joints = best.a.tree.joints, best.b.tree.joints
        (a, b), (c, d) = two
        other = {joints[0][a].name: joints[1][d].name, joints[0][c].name: joints[1][b].name}
        found = _best_alignment(best.a, best.b, {**given, **other}, None, ahead, base=best.base)
        if better((found.matched, found.worst), (best.matched, best.worst)):
            best, given = found, {**given, **other}
    return best


def _nearly(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Search with larger tolerances for an alignment whose largest difference is less than half as large.

    If there is no such alignment, return `best`. If all axes differ slightly, no axes agree exactly, and the
    normal search cannot find the right choices. Therefore, this function repeats the search with larger and
    larger tolerances, until all axes agree. Finally it aligns the mechanisms with the choices of this search,
    but with the normal tolerance, so that the result contains the small differences. The function tries only
    tolerances between the smallest difference and half of the largest difference.
    """
    a, b, (least, most), ahead = best.a, best.b, best.inner_differences, LookAhead(MOST_AHEAD)
    for angle in NEARLY:
        if not least < angle * best.size < TWICE_AS_WELL * most:
            continue
        tolerance = Tolerance(angle, angle * best.size)
        rough = _best_alignment(a, b, given, None, ahead, tolerance, best.base)
        if rough.inner_differences[1] or (len(rough.only_a), len(rough.only_b)) != (
            len(best.only_a),
            len(best.only_b),
        ):
            continue
        exact = _best_alignment(a, b, rough.names, rough.gauge)
        return exact if exact.inner_differences[1] < TWICE_AS_WELL * most else best
    return best


def _best_alignment(
    a: Mechanism,
    b: Mechanism,
    given: Mapping[str, str],
    gauge: Gauge | None,
    ahead: LookAhead | None = None,
    tolerance: Tolerance | None = None,
    base: tuple[int, int] | None = None,
) -> Alignment:
    """Return the best alignment over all first bodies; if `base` is given, only its bodies are tried."""
    tolerance = tolerance or tolerance_of(a, b)
    pairing = Pairing(a, b, given, tolerance)
    return MechanismMatcher(a, b, pairing, gauge, ahead or LookAhead(0), tolerance, base).best()


#: These full turns are added to the zero offset of a revolute joint with a mimic rule.
TURNS = (0, 1, -1)
#: The tolerance of a zero offset is the angle tolerance times this factor.
#: The factor is large, because an offset computed from the positions of two close axes is inexact.
LEVER = 1e4


@dataclass(frozen=True, slots=True)
class _Rule:
    """The mimic rules of two matched joints.

    A's joint has the value m x + c, with a coordinate x of A. B's joint has the value n y + d, with a
    coordinate y of B. In the alignment, B's value is s times A's value plus o, with the sign s and the zero
    offset o.

    Attributes:
        step: Index of the step.
        slope: s m, the multiplier of A's mimic rule with the sign s.
        constant: s c, the offset of A's mimic rule with the sign s.
        n: Multiplier of B's rule.
        d: Offset of B's rule.
        offset: The zero offset o of B's joint in the alignment.
        turns: Whether the joint is revolute.
        free: Whether any value of o is possible, because no axis and no link with the same name is below the
            joint.
        meets: Whether links of A and of B coincide on the body after the joint.
    """

    step: int
    slope: float
    constant: float
    n: float
    d: float
    offset: float
    turns: bool
    free: bool
    meets: bool

    def beta(self, turn: int) -> float:
        """Return beta of the resulting relation y = alpha x + beta, if `turn` full turns are added to o."""
        return (self.constant + self.offset + 2.0 * math.pi * turn - self.d) / self.n

    def wanted(self, beta: float) -> float:
        """Return the zero offset o for which the mimic rules give y = alpha x + beta."""
        return self.n * beta + self.d - self.constant

    def allows(self, offset: float, tolerance: Tolerance) -> bool:
        """Return whether the joint can have this zero offset, up to rounding and (if revolute) full turns."""
        off = offset - self.offset
        if self.turns:
            off = math.remainder(off, 2.0 * math.pi)
        return self.free or abs(off) <= LEVER * tolerance.angle * max(1.0, abs(offset))


def zeros_by_rules(found: Alignment, tolerance: Tolerance) -> Mapping[str, tuple[int, float]]:
    """Return {name in A: (sign, zero offset)} for joints whose zero offset the mimic rules determine."""
    zeros = dict[str, tuple[int, float]]()
    for rules in _groups(found):
        alphas = [rule.slope / rule.n for rule in rules if rule.n]
        # Only joints with the most frequent slope get a new zero offset.
        alpha = max(
            alphas, key=lambda one: sum(_near(one, other, tolerance) for other in alphas), default=0.0
        )
        fit = [rule for rule in rules if _near(rule.slope, rule.n * alpha, tolerance)]
        some = sorted((rule for rule in fit if rule.n), key=lambda rule: (rule.free, not rule.meets))
        some = [rule for rule in some if rule.free == some[0].free]
        betas = [rule.beta(turn) for rule in some for turn in (TURNS if rule.turns else (0,))]
        if not betas:
            continue
        beta = max(betas, key=lambda one: sum(rule.allows(rule.wanted(one), tolerance) for rule in fit))
        for rule in fit:
            wanted = rule.wanted(beta)
            if rule.allows(wanted, tolerance) and not _near(wanted, rule.offset, tolerance):
                step = found.steps[rule.step]
                zeros[found.a.tree.joints[step.a].name] = step.sense, wanted
    return zeros


def _near(x: float, y: float, tolerance: Tolerance) -> bool:
    return abs(x - y) <= 0.5 * tolerance.angle * max(1.0, abs(x), abs(y))


def _groups(found: Alignment) -> Iterator[list[_Rule]]:
    """Yield groups of steps whose joints depend on the same coordinate of A and the same one of B."""
    groups = dict[tuple[str, str], list[_Rule]]()
    for i, step in enumerate(found.steps):
        if step.unlike or step.kind not in ("turns", "prismatic"):
            continue
        x, m, c = _as_rule(found.a.tree.joints[step.a])
        y, n, d = _as_rule(found.b.tree.joints[step.b])
        slope, constant = step.sense * m, step.sense * c
        determined, meets = _is_determined(found, i)
        rule = _Rule(i, slope, constant, n, d, step.offset, step.kind == "turns", not determined, meets)
        groups.setdefault((x, y), []).append(rule)
    yield from (rules for rules in groups.values() if len(rules) > 1)


def _as_rule(joint: Joint) -> tuple[str, float, float]:
    """Return the coordinate that moves a joint, and the multiplier and offset of its mimic rule."""
    rule = joint.mimic
    return (joint.name, 1.0, 0.0) if rule is None else (rule.leader, rule.multiplier, rule.offset)


def _is_determined(found: Alignment, i: int) -> tuple[bool, bool]:
    """Return (determined, meets).

    `determined` is True if axes, or links with equal names, determine the joint's zero offset. `meets` is
    True if a link of A and a link of B below the joint coincide; their names may differ.
    """
    names = set(found.a.labels) & set(found.b.labels)
    behind = {i}
    for k, step in enumerate(found.steps):
        if step.previous in behind:
            if step.differs or step.unlike or step.conversion or not _keeps_axis(found.steps[i], step):
                return True, True
            behind.add(k)
    carried = [frame for frame in found.frames if frame.previous in behind]
    determined = any(found.a.labels[frame.a] in names for frame in carried)
    return determined, any(frame.tool is IDENTITY for frame in carried)


def _keeps_axis(one: MatchedJoints, other: MatchedJoints) -> bool:
    """Return whether the axis of the second joint stays fixed when the first joint moves."""
    if "turns" not in (one.kind, other.kind):
        return other.kind == "prismatic"
    if {one.kind, other.kind} - {"turns", "prismatic"}:
        return False
    placed = one.kind == other.kind == "turns"
    return max(between_lines(one.axis, other.axis, placed=placed)) == 0.0
