"""Align mechanism B with mechanism A: match their joints, and find the sign and zero offset of each joint.

`MechanismMatcher` starts at a body of A and a body of B, and visits both trees joint by joint. At each joint,
the matcher chooses the sign (`sense`) and the zero offset. The best choice makes the largest number of later
links and axes of B coincide with links and axes of A. `align` compares the results for several starting
bodies and joint orders.

If no axis and no link frame follows a joint, only mimic rules can determine the joint's zero offset. The
class `_RulePair` contains the equations.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import TypeVar

from urdfkin.model.mechanisms.joint_matching import (
    EdgePair,
    JointMatcher,
    SubtreeMatcher,
    later_axes,
    motion_type,
    refine_choices,
    root_poses_by_axes,
    root_poses_by_siblings,
    zero_candidates,
)
from urdfkin.model.mechanisms.mechanism import (
    IDENTITY,
    Alignment,
    AlignmentChoices,
    Edge,
    FramePair,
    FreeJointConversion,
    MatchedJoints,
    Mechanism,
    Screw,
    Tolerance,
    angle_about,
    line_difference,
    nearest_planar_pose,
    out_of_plane_compensation,
    pose_difference,
    screw_motion,
    size_of,
    smallest_motion,
    tolerance_of,
)
from urdfkin.model.tree import FloatArray, Joint, inverse

#: Maximum depth of a tree, in joints, for the recursive search for an exact match.
MAX_EXACT_SEARCH_DEPTH = 200
#: Maximum number of later joints on each branch that decide between equally good choices at a joint.
LOOK_AHEAD_DEPTH = 6
#: Maximum number of root poses that the exact search computes from axes, for each pair of bodies.
MAX_ROOT_POSES = 48
#: Maximum number of pairs of start bodies for the exact search. The two bodies of a pair have links with
#: equal labels.
MAX_SHARED_BODIES = 8
#: Of two scores with equal counts, a score is better if its largest difference is less than BETTER_RATIO
#: times the other's.
BETTER_RATIO = 0.5

#: A zero offset (rad or m), or a pose for a planar or floating joint.
_OffsetOrPose = TypeVar("_OffsetOrPose", float, FloatArray)
#: Number of links and axes of A that agree with B, and the largest difference (m).
Score = tuple[int, float]


@dataclass(slots=True)
class LookAhead:
    """A limit on the number of later joint pairs that decide between equally good choices.

    Several matchers can share a limit.
    """

    remaining: int


@dataclass(frozen=True, slots=True, eq=False)
class BodyPair:
    """A body of A and the corresponding body of B.

    A link of A with the zero pose Z_a and a link of B with the zero pose Z_b agree if:

    `motion_a @ Z_a = motion_b @ Z_b`.

    Attributes:
        via: The joints before the bodies. None at the start of the search.
        previous: Index of the joints `via` in `Alignment.steps`, or -1.
        motion_a: (4, 4) product of the motions L at earlier joints.
        motion_b: (4, 4) product of the root pose and the motions by earlier zero offsets and conversions.
    """

    bodies: tuple[int, int]
    via: tuple[Edge | None, Edge | None]
    previous: int
    motion_a: FloatArray
    motion_b: FloatArray


class MechanismMatcher:
    """Match the joints of two mechanisms.

    `choices` prescribes B's root pose, signs, zero offsets and conversions. `base` contains the indices of
    the links of A and B where the search starts. If an argument is None, the matcher finds the values.
    """

    def __init__(
        self,
        a: Mechanism,
        b: Mechanism,
        joint_matcher: JointMatcher,
        choices: AlignmentChoices | None,
        look_ahead: LookAhead,
        tolerance: Tolerance,
        base: tuple[int, int] | None,
    ) -> None:
        self.a, self.b, self.joint_matcher, self.choices, self.look_ahead = (
            a,
            b,
            joint_matcher,
            choices,
            look_ahead,
        )
        self.tolerance, self.base = tolerance, base
        self.size = size_of(a, b)
        self.subtree_sizes = _subtree_sizes(a), _subtree_sizes(b)
        self.match_count = 0
        self.exact: SubtreeMatcher | None = None
        if choices is None and max(*a.depths, *b.depths) <= MAX_EXACT_SEARCH_DEPTH:
            self.exact = SubtreeMatcher(a, b, joint_matcher, tolerance, self._poses_after)

    # -- start of the search -----------------------------------------------------------------------

    def find_best(self) -> Alignment:
        best: Alignment | None = None
        for bodies, X in self._start_candidates():
            alignment = self._match_from(bodies, X)
            if best is None or self._is_better(alignment, best):
                best, self.match_count = alignment, alignment.match_count
            if not best.max_difference and not (best.only_a and best.only_b):
                break
        assert best is not None
        return best

    def find_best_with_names(self) -> Alignment:
        """Return the best alignment that separates no links with equal labels.

        If every alignment separates such links, return one of these alignments.
        """
        best: Alignment | None = None
        self.exact = None
        for bodies, X in self._start_candidates():
            alignment = self._match_from(bodies, X)
            if best is None or (
                alignment.has_separated_names <= best.has_separated_names
                and (best.has_separated_names or self._is_better(alignment, best))
            ):
                best = alignment
        assert best is not None
        return best

    def full_matches(self) -> Iterator[Alignment]:
        """Yield one alignment without unmatched joints for each set of joint pairs."""
        seen, self.exact = list[dict[str, str]](), None
        for bodies, X in self._start_candidates():
            if not self.joint_matcher.has_same_shape(bodies, (None, None)):
                continue
            alignment = self._match_from(bodies, X)
            if not (alignment.only_a or alignment.only_b) and alignment.names not in seen:
                seen.append(alignment.names)
                yield alignment

    def find_exact(self) -> Alignment | None:
        """Search an exact match from each body pair with links of equal labels."""
        start = None if self.exact is None else self._exact_start(self.exact, self._shared_bodies())
        return None if start is None else self._match_from(*start)

    def _start_candidates(self) -> Iterator[tuple[tuple[int, int], FloatArray]]:
        """Yield the start of each search: two bodies, and the pose (4, 4) of B's root in A's root frame."""
        if self.choices is not None:
            names = self.choices.base
            base = next(self._start_bodies())
            if names is not None:
                links = self.a.tree.link_index(names[0]), self.b.tree.link_index(names[1])
                base = self.a.body_of[links[0]], self.b.body_of[links[1]]
            X = self.choices.X
            yield base, IDENTITY if self.tolerance.holds(*pose_difference(IDENTITY, X)) else X
            return
        bases = list(self._start_bodies())
        if self.exact is not None:
            start = self._exact_start(self.exact, bases)
            if start is None and any(joint.mimic for m in (self.a, self.b) for joint in m.tree.joints):
                self.exact.ignore_mimic_rules()
                start = self._exact_start(self.exact, bases)
            if start is not None:
                yield start
        for base in bases:
            if not self.joint_matcher.name_map and self._match_count_bound(base) < self.match_count:
                continue
            tried = list[FloatArray]()
            for X in chain(self._root_poses_by_links(base), self._root_poses_by_axes(base)):
                if not any(self.tolerance.holds(*pose_difference(known, X)) for known in tried):
                    tried.append(X)
                    yield base, X

    def _is_better(self, one: Alignment, than: Alignment) -> bool:
        mapped = [
            sum(found.names.get(a) == b for a, b in self.joint_matcher.name_map.items())
            for found in (one, than)
        ]
        return mapped[0] > mapped[1] if mapped[0] != mapped[1] else _is_better_alignment(one, than)

    def _match_count_bound(self, base: tuple[int, int]) -> int:
        """Return an upper bound on `match_count` for two start bodies.

        Two branches with m and n joints have at most min(m, n) joint pairs, and the same bound holds for
        links. The sum of these bounds is largest if the branches of A and B are paired by decreasing size.
        """
        most = min(len(self.a.bodies[base[0]]), len(self.b.bodies[base[1]]))
        for k in (0, 1):
            branches = list[list[int]]()
            for m, body, sizes in zip((self.a, self.b), base, self.subtree_sizes, strict=True):
                own = [
                    sizes[edge.outer][k] if edge.inner == body else sizes[0][k] - sizes[edge.outer][k]
                    for edge in m.edges_by_body[body]
                ]
                branches.append(sorted(own, reverse=True))
            most += sum(map(min, *branches))
        return most

    def _exact_start(
        self, exact: SubtreeMatcher, bases: Sequence[tuple[int, int]]
    ) -> tuple[tuple[int, int], FloatArray] | None:
        for base in bases:
            if self.joint_matcher.has_same_shape(base, (None, None)):
                for X in self._exact_root_poses(base):
                    if exact.exact_joint_pairs(base, (None, None), X) is not None:
                        return base, X
        return None

    def _exact_root_poses(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        yield from self._root_poses_by_links(base)
        siblings = root_poses_by_siblings(
            self.a, self.b, base, lambda e, f: self.joint_matcher.have_equal_subtrees(base, e, f)
        )
        some = (
            X
            for X in chain(siblings, root_poses_by_axes(self.a, self.b, base))
            if self.joint_matcher.all_axes_coincide(base, X)
        )
        yield from islice(some, MAX_ROOT_POSES)

    def _root_poses_by_links(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        yield IDENTITY
        for link_a, link_b in self.joint_matcher.link_pairs(*base):
            yield self.a.zero_poses[link_a] @ inverse(self.b.zero_poses[link_b])

    def _start_bodies(self) -> Iterator[tuple[int, int]]:
        if self.base is not None:
            yield self.a.body_of[self.base[0]], self.b.body_of[self.base[1]]
            return
        body_b = _find_shared_body(self.a, self.b)
        if body_b is not None:
            yield 0, body_b
            return
        yield from ((0, body) for body, links in enumerate(self.b.bodies) if links)
        # B's root body can correspond to a body of A that follows a joint, such as a floating root joint.
        body_a = _find_shared_body(self.b, self.a)
        if body_a is not None:
            yield body_a, 0

    def _shared_bodies(self) -> list[tuple[int, int]]:
        """Return body pairs with equal labels; the pair with the most equal labels comes first.

        The list is empty if a root body has a label of the other mechanism.
        """
        if _find_shared_body(self.a, self.b) is not None or _find_shared_body(self.b, self.a) is not None:
            return []
        bodies_b = {self.b.labels[link]: body for body, links in enumerate(self.b.bodies) for link in links}
        shared = Counter(
            (body, bodies_b[label])
            for body, links in enumerate(self.a.bodies)
            for link in links
            if (label := self.a.labels[link]) in bodies_b
        )
        return [bodies for bodies, _ in shared.most_common(MAX_SHARED_BODIES)]

    def _root_poses_by_axes(self, base: tuple[int, int]) -> Iterator[FloatArray]:
        scored = list[tuple[float, BodyPair, Score]]()
        for X in root_poses_by_axes(self.a, self.b, base):
            bodies = BodyPair(base, (None, None), -1, IDENTITY, X)
            scored.append((0.0, bodies, self._score(bodies)))
        best = _best_of(scored)[2] if scored else (0, 0.0)
        if self.a.free_frames or self.b.free_frames:
            best = best[0], math.inf
        yield from (bodies.motion_b for _, bodies, score in scored if not is_better(best, score))

    # -- matching ------------------------------------------------------------------------------------

    def _match_from(self, base: tuple[int, int], X: FloatArray) -> Alignment:
        alignment = Alignment(self.a, self.b, (self.a.bodies[base[0]][0], self.b.bodies[base[1]][0]), X)
        stack = [BodyPair(base, (None, None), -1, IDENTITY, X)]
        while stack:
            body_pair = stack.pop()
            alignment.bodies[body_pair.bodies[0]] = body_pair.bodies[1]
            self._match_links(body_pair, alignment)
            pairs, only_a, only_b = self._joint_pairs(body_pair)
            alignment.only_a += _joints_in_subtrees(self.a, body_pair.bodies[0], only_a)
            alignment.only_b += _joints_in_subtrees(self.b, body_pair.bodies[1], only_b)
            # The pairs are sorted, because a recheck finds all pairs by name and can find them in another
            # order.
            for e, f in sorted(pairs, key=lambda pair: pair[0].joint):
                step, next_pair, _ = self._match_joints(
                    body_pair, e, f, len(alignment.steps), LOOK_AHEAD_DEPTH
                )
                stack.append(next_pair)
                alignment.steps.append(step)
                if step.differs:
                    alignment.max_difference = max(
                        alignment.max_difference, step.tilt * self.size + step.shift
                    )
                elif not step.kind_difference:
                    alignment.match_count += 1
        return alignment

    def _joint_pairs(self, body_pair: BodyPair) -> tuple[Sequence[EdgePair], Sequence[Edge], Sequence[Edge]]:
        if self.exact is not None:
            pairs = self.exact.exact_joint_pairs(
                body_pair.bodies, body_pair.via, inverse(body_pair.motion_a) @ body_pair.motion_b
            )
            if pairs is not None:
                return pairs, (), ()
        return self.joint_matcher.pair_joints(
            body_pair.bodies, body_pair.via, body_pair.motion_a, body_pair.motion_b
        )

    def _poses_after(
        self, next_bodies: tuple[int, int], via: EdgePair, X: FloatArray
    ) -> Iterator[FloatArray]:
        """Yield possible poses of B's next body; see `ProposePoses`."""
        next_pair = BodyPair(next_bodies, via, -1, IDENTITY, X)
        kind, f = motion_type(self.a.joint(via[0]).kind), via[1]
        if kind in ("turns", "prismatic"):
            t, turns = self.b.screw(f), kind == "turns"
            for offset in self._offsets(next_pair, IDENTITY, t, turns):
                yield X @ screw_motion(t, offset, turns=turns) if offset else X
            return
        zero_poses = self.a.zero_poses[via[0].joint + 1], self.b.zero_poses[f.joint + 1]
        compensation = (
            out_of_plane_compensation(inverse(X @ zero_poses[1]) @ zero_poses[0])
            if kind == "planar"
            else None
        )
        for N in self._motion_candidates(
            next_pair, zero_poses[0], zero_poses[1], compensation, self._exact_root_poses(next_bodies)
        ):
            yield zero_poses[0] @ N @ inverse(zero_poses[1])

    def _match_links(self, body_pair: BodyPair, alignment: Alignment) -> None:
        pairs = self._find_link_pairs(body_pair)
        if (other := self._pair_of_tools(body_pair, pairs)) is not None:
            alignment.frames.append(other)
        for link_a, link_b in pairs:
            zero_pose = self.a.zero_poses[link_a]
            pose_a, pose_b = body_pair.motion_a @ zero_pose, body_pair.motion_b @ self.b.zero_poses[link_b]
            angle, distance = pose_difference(pose_a, pose_b)
            end = IDENTITY
            if self.tolerance.holds(angle, distance):
                angle = distance = 0.0
                alignment.match_count += 1
            else:
                end = inverse(body_pair.motion_a) @ pose_b @ inverse(zero_pose)
                alignment.max_difference = max(alignment.max_difference, angle * self.size + distance)
            alignment.frames.append(
                FramePair(link_a, link_b, body_pair.previous, zero_pose, end, angle, distance)
            )

    def _pair_of_tools(self, body_pair: BodyPair, matched: list[tuple[int, int]]) -> FramePair | None:
        """Pair two links with unshared labels as end-effector frames, if the bodies have no matched links."""
        links_a, links_b = self._unshared_links(body_pair)
        if matched or not links_a or not links_b:
            return None
        zero_pose = self.a.zero_poses[links_a[0]]
        tool = inverse(body_pair.motion_a @ zero_pose) @ body_pair.motion_b @ self.b.zero_poses[links_b[0]]
        return FramePair(links_a[0], links_b[0], body_pair.previous, zero_pose, IDENTITY, 0.0, 0.0, tool)

    def _find_link_pairs(self, body_pair: BodyPair) -> list[tuple[int, int]]:
        pairs = list(self.joint_matcher.link_pairs(*body_pair.bodies))
        taken = {j for _, j in pairs}
        links_a, links_b = self._unshared_links(body_pair)
        for i in links_a:
            pose_a = body_pair.motion_a @ self.a.zero_poses[i]
            for j in links_b:
                if j not in taken and self.tolerance.holds(
                    *pose_difference(pose_a, body_pair.motion_b @ self.b.zero_poses[j])
                ):
                    pairs.append((i, j))
                    taken.add(j)
                    break
        return pairs

    def _unshared_links(self, body_pair: BodyPair) -> tuple[list[int], list[int]]:
        names_a, names_b = self.a.labels, self.b.labels
        links_a = [i for i in self.a.bodies[body_pair.bodies[0]] if names_a[i] not in names_b]
        return links_a, [j for j in self.b.bodies[body_pair.bodies[1]] if names_b[j] not in names_a]

    def _match_joints(
        self, body_pair: BodyPair, e: Edge, f: Edge, step_index: int, depth: int
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        kinds = motion_type(self.a.joint(e).kind), motion_type(self.b.joint(f).kind)
        via = e, f
        backwards = e.outer == body_pair.bodies[0], f.outer == body_pair.bodies[1]
        bodies = e.other_body(body_pair.bodies[0]), f.other_body(body_pair.bodies[1])
        next_pair = BodyPair(bodies, via, step_index, body_pair.motion_a, body_pair.motion_b)
        if kinds[0] != kinds[1]:
            return self._match_unlike(body_pair, via, kinds, backwards), next_pair, (0, 0.0)
        if kinds[0] in ("turns", "prismatic"):
            return self._match_joints_with_axes(
                body_pair, next_pair, backwards, depth, turns=kinds[0] == "turns"
            )
        return self._match_free_joints(body_pair, next_pair, backwards, depth, kinds[0])

    def _match_unlike(
        self,
        body_pair: BodyPair,
        via: tuple[Edge, Edge],
        kinds: tuple[str, str],
        backwards: tuple[bool, bool],
    ) -> MatchedJoints:
        kind_difference = {kinds[0]: "a", kinds[1]: "b"}.get("fixed", "kind")
        if kind_difference == "a":
            axis = _outwards(self.b.screw(via[1]), backwards[1]).transform(
                inverse(body_pair.motion_a) @ body_pair.motion_b
            )
        else:
            axis = _outwards(self.a.screw(via[0]), backwards[0])
        kind = kinds[1] if kind_difference == "a" else kinds[0]
        return MatchedJoints(
            via[0].joint,
            via[1].joint,
            kind,
            body_pair.previous,
            1,
            0.0,
            IDENTITY,
            axis,
            axis,
            0.0,
            0.0,
            kind_difference,
        )

    def _match_free_joints(
        self, body_pair: BodyPair, next_pair: BodyPair, backwards: tuple[bool, bool], depth: int, kind: str
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        e, f = _require_edges(next_pair.via)
        zero_poses = self.a.zero_poses[e.joint + 1], self.b.zero_poses[f.joint + 1]
        pose_a, pose_b = body_pair.motion_a @ zero_poses[0], body_pair.motion_b @ zero_poses[1]
        axis, back = Screw(zero_poses[0][:3, 2], zero_poses[0][:3, 3]), backwards[0] != backwards[1]
        step = MatchedJoints(
            e.joint, f.joint, kind, body_pair.previous, 1, 0.0, IDENTITY, axis, axis, 0.0, 0.0
        )
        prescribed = None if self.choices is None else self.choices.conversions.get(self.a.joint(e).name)
        as_written = self.choices is not None and prescribed is None
        if as_written:
            K, tilt, shift = pose_b @ inverse(pose_a), *pose_difference(pose_a, pose_b)
        else:
            K, tilt, shift = _align_normals(pose_a, pose_b) if kind == "planar" else (IDENTITY, 0.0, 0.0)
        if not self.tolerance.holds(tilt, shift):
            step = replace(
                step,
                constant_motion=inverse(body_pair.motion_a) @ K @ body_pair.motion_a,
                tilt=tilt,
                shift=shift,
            )
            next_pair, pose_a = replace(next_pair, motion_a=K @ body_pair.motion_a), K @ pose_a
        if as_written:
            return replace(step, kind_difference="kind" if back else ""), next_pair, (0, 0.0)
        M = inverse(pose_b) @ pose_a
        exact = self._exact_pose(body_pair, next_pair)
        if prescribed is not None:
            tried: Iterable[FloatArray] = [inverse(prescribed.before) if backwards[1] else prescribed.behind]
        elif exact is not None:
            tried = [inverse(pose_a) @ exact @ zero_poses[1]]
        else:
            compensation = out_of_plane_compensation(M) if kind == "planar" else None
            tried = self._motion_candidates(
                next_pair, pose_a, zero_poses[1], compensation, self._root_poses_by_axes(next_pair.bodies)
            )
        body_pairs = ((N, replace(next_pair, motion_b=pose_a @ N @ inverse(zero_poses[1]))) for N in tried)
        N, moved, score = self._best(body_pairs, depth)
        # The joint has the pose P_a in A and the pose P_b = M P_a N in B. If a model's path leads from the
        # joint's child to its parent, the model's pose is inverted.
        pair = (inverse(N), inverse(M)) if backwards[1] else (M, N)
        before, behind = (
            IDENTITY if self.tolerance.holds(*pose_difference(IDENTITY, T)) else T for T in pair
        )
        if before is IDENTITY and behind is IDENTITY and not back:
            return step, next_pair, score
        return replace(step, conversion=FreeJointConversion(before, behind, back)), moved, score

    def _motion_candidates(
        self,
        next_pair: BodyPair,
        pose_a: FloatArray,
        zero_pose_b: FloatArray,
        compensation: FloatArray | None,
        next_poses: Iterable[FloatArray],
    ) -> Iterator[FloatArray]:
        """Yield candidates for the rigid motion N in P_b = M P_a N.

        `compensation` is one possible N of a planar joint, or None for a floating joint. `pose_a` includes
        `motion_a`.
        """
        yield IDENTITY if compensation is None else compensation
        candidates = [next_pair.motion_b]
        candidates += [
            next_pair.motion_a @ self.a.zero_poses[i] @ inverse(self.b.zero_poses[j])
            for i, j in self.joint_matcher.link_pairs(*next_pair.bodies)
        ]
        for motion_b in chain(candidates, (next_pair.motion_a @ X for X in next_poses)):
            N = inverse(pose_a) @ motion_b @ zero_pose_b
            yield N if compensation is None else compensation @ nearest_planar_pose(inverse(compensation) @ N)

    def _match_joints_with_axes(
        self,
        body_pair: BodyPair,
        next_pair: BodyPair,
        backwards: tuple[bool, bool],
        depth: int,
        *,
        turns: bool,
    ) -> tuple[MatchedJoints, BodyPair, Score]:
        e, f = _require_edges(next_pair.via)
        screw_a = _outwards(self.a.screw(e), backwards[0])
        screw_b = _outwards(self.b.screw(f), backwards[1])
        start, end = screw_a.transform(body_pair.motion_a), screw_b.transform(body_pair.motion_b)
        sense, zero = self._zero_choice(self.a.joint(e).name)
        sense = sense or (-1 if start.direction @ end.direction < 0.0 else 1)
        if sense < 0:
            end = end.reverse()
        K, tilt, shift = smallest_motion(start, end, turns=turns)
        kind = "turns" if turns else "prismatic"
        step = MatchedJoints(
            e.joint, f.joint, kind, body_pair.previous, sense, 0.0, IDENTITY, screw_a, screw_a, 0.0, 0.0
        )
        if self.tolerance.holds(tilt, shift):
            exact = self._exact_pose(body_pair, next_pair)
            if exact is not None:
                T = inverse(body_pair.motion_b) @ exact
                zero = (
                    angle_about(screw_b.direction, T[:3, :3])
                    if turns
                    else float(screw_b.direction @ T[:3, 3])
                )
                zero = 0.0 if self.tolerance.holds(*pose_difference(body_pair.motion_b, exact)) else zero
            offset, next_pair, score = self._best_zero(
                next_pair, body_pair.motion_a, screw_b, turns, zero, depth
            )
            return replace(step, offset=offset), next_pair, score
        # The motion K moves A's axis to B's axis. The matcher compares two cases: all later bodies of B also
        # move by K, or only the axis moves.
        step, back = replace(step, tilt=tilt, shift=shift), inverse(body_pair.motion_a)
        with_bodies = self._best_zero(next_pair, K @ body_pair.motion_a, screw_b, turns, zero, depth)
        if depth == LOOK_AHEAD_DEPTH:
            alone = self._best_zero(next_pair, body_pair.motion_a, screw_b, turns, zero, depth)
            prescribed = None if self.choices is None else self.choices.alone
            if (
                is_better(self._score(alone[1]), self._score(with_bodies[1]))
                if prescribed is None
                else self.a.joint(e).name in prescribed
            ):
                return replace(step, offset=alone[0], axis_b=end.transform(back)), *alone[1:]
        return replace(
            step, offset=with_bodies[0], constant_motion=back @ K @ body_pair.motion_a
        ), *with_bodies[1:]

    def _exact_pose(self, body_pair: BodyPair, next_pair: BodyPair) -> FloatArray | None:
        if self.exact is None:
            return None
        X = self.exact.pose_after(
            *_require_edges(next_pair.via), body_pair.bodies, inverse(body_pair.motion_a) @ body_pair.motion_b
        )
        return None if X is None else body_pair.motion_a @ X

    # -- zero offsets ------------------------------------------------------------------------------

    def _zero_choice(self, joint: str) -> tuple[int, float | None]:
        """Return a joint's sign and zero offset from `choices`; (0, None) without `choices`."""
        return (0, None) if self.choices is None else self.choices.zeros.get(joint, (1, 0.0))

    def _best_zero(
        self,
        next_pair: BodyPair,
        motion_a: FloatArray,
        screw_b: Screw,
        turns: bool,
        zero: float | None,
        depth: int,
    ) -> tuple[float, BodyPair, Score]:
        offsets = self._offsets(next_pair, motion_a, screw_b, turns) if zero is None else (zero,)
        moved = (
            (
                offset,
                next_pair.motion_b @ screw_motion(screw_b, offset, turns=turns)
                if offset
                else next_pair.motion_b,
            )
            for offset in offsets
        )
        return self._best(
            (
                (offset, replace(next_pair, motion_a=motion_a, motion_b=motion_b))
                for offset, motion_b in moved
            ),
            depth,
        )

    def _best(
        self, choices: Iterable[tuple[_OffsetOrPose, BodyPair]], depth: int
    ) -> tuple[_OffsetOrPose, BodyPair, Score]:
        """Return the zero offset or the pose with the best score.

        Later joints decide between equally good choices, for example at intersecting perpendicular axes.
        """
        scored = list[tuple[_OffsetOrPose, BodyPair, Score]]()
        for choice, body_pair in choices:
            if any(
                self.tolerance.holds(*pose_difference(known.motion_b, body_pair.motion_b))
                for _, known, _ in scored
            ):
                continue
            score = self._score(body_pair)
            scored.append((choice, body_pair, score))
            # All axes and links agree, so the remaining choices cannot be better.
            if not score[1] and self.joint_matcher.link_pairs(*body_pair.bodies):
                return scored[-1]
        best = _best_of(scored)
        equal = [one for one in scored if not is_better(best[2], one[2])]
        if not depth or self.look_ahead.remaining <= 0 or (len(equal) == 1 and depth == LOOK_AHEAD_DEPTH):
            return best
        scored_ahead = list[tuple[_OffsetOrPose, BodyPair, Score]]()
        for choice, body_pair, score in equal:
            scored_ahead.append((choice, body_pair, self._score_ahead(body_pair, score, depth)))
            if not scored_ahead[-1][2][1]:
                break
        return _best_of(scored_ahead)

    def _score_ahead(self, body_pair: BodyPair, own: Score, depth: int) -> Score:
        pairs = self.joint_matcher.pair_joints(
            body_pair.bodies, body_pair.via, body_pair.motion_a, body_pair.motion_b
        )[0]
        self.look_ahead.remaining -= len(pairs)
        scores = [own, *(self._match_joints(body_pair, e, f, -1, depth - 1)[2] for e, f in pairs)]
        return sum(count for count, _ in scores), max(off for _, off in scores)

    def _score(self, body_pair: BodyPair) -> Score:
        differences = [
            pose_difference(
                body_pair.motion_a @ self.a.zero_poses[i], body_pair.motion_b @ self.b.zero_poses[j]
            )
            for i, j in self.joint_matcher.link_pairs(*body_pair.bodies)
        ]
        pairs, _, _ = self.joint_matcher.pair_joints(
            body_pair.bodies, body_pair.via, body_pair.motion_a, body_pair.motion_b
        )
        differences += [
            self.joint_matcher.mismatch(e, f, body_pair.motion_a, body_pair.motion_b) for e, f in pairs
        ]
        wrong = [
            angle * self.size + shift
            for angle, shift in differences
            if not self.tolerance.holds(angle, shift)
        ]
        return len(differences) - len(wrong), max(wrong, default=0.0)

    def _offsets(
        self, next_pair: BodyPair, motion_a: FloatArray, screw_b: Screw, turns: bool
    ) -> Iterator[float]:
        yield 0.0
        u = screw_b.transform(next_pair.motion_b)
        for i, j in self.joint_matcher.link_pairs(*next_pair.bodies):
            pose_a, pose_b = motion_a @ self.a.zero_poses[i], next_pair.motion_b @ self.b.zero_poses[j]
            if turns:
                yield angle_about(u.direction, pose_a[:3, :3] @ pose_b[:3, :3].T)
            else:
                yield float(u.direction @ (pose_a[:3, 3] - pose_b[:3, 3]))
        for axis_a, axis_b in later_axes(
            (self.a, self.b), next_pair.via, next_pair.bodies, (u.transform(inverse(motion_a)), screw_b)
        ):
            yield from zero_candidates(
                u, axis_a.transform(motion_a), axis_b.transform(next_pair.motion_b), turns
            )


def _subtree_sizes(mechanism: Mechanism) -> list[tuple[int, int]]:
    """Count the bodies and links of each body's subtree."""
    sizes = [(1, len(links)) for links in mechanism.bodies]
    for edge in reversed(mechanism.edges):
        bodies, links = sizes[edge.outer]
        sizes[edge.inner] = sizes[edge.inner][0] + bodies, sizes[edge.inner][1] + links
    return sizes


def _find_shared_body(one: Mechanism, other: Mechanism) -> int | None:
    names = {one.labels[link] for link in one.bodies[0]}
    shared = [len(names & {other.labels[k] for k in body}) for body in other.bodies]
    return max(range(len(shared)), key=shared.__getitem__) if any(shared) else None


def _best_of(
    scored: Sequence[tuple[_OffsetOrPose, BodyPair, Score]],
) -> tuple[_OffsetOrPose, BodyPair, Score]:
    best = scored[0]
    for one in scored[1:]:
        best = one if is_better(one[2], best[2]) else best
    return best


def _is_better_alignment(one: Alignment, than: Alignment) -> bool:
    # A convention chooses the link frames of a table, so the agreement of the joints comes first.
    if one.has_free_frames and one.all_joints_agree != than.all_joints_agree:
        return one.all_joints_agree
    return is_better(one.score, than.score)


def is_better(score: Score, than: Score) -> bool:
    return score[0] > than[0] or (score[0] == than[0] and score[1] < BETTER_RATIO * than[1])


def _outwards(screw: Screw, backwards: bool) -> Screw:
    return screw.reverse() if backwards else screw


def _require_edges(via: tuple[Edge | None, Edge | None]) -> tuple[Edge, Edge]:
    e, f = via
    assert e is not None
    assert f is not None
    return e, f


def _joints_in_subtrees(mechanism: Mechanism, body: int, edges: Sequence[Edge]) -> list[int]:
    joints, stack = [], [(body, edge) for edge in edges]
    while stack:
        current, edge = stack.pop()
        joints.append(edge.joint)
        next_body = edge.other_body(current)
        stack += [
            (next_body, next_edge)
            for next_edge in mechanism.edges_by_body[next_body]
            if next_edge is not edge
        ]
    return joints


def _align_normals(pose_a: FloatArray, pose_b: FloatArray) -> tuple[FloatArray, float, float]:
    """Return the smallest rotation (4, 4) that makes two planes parallel, its angle (rad) and the shift 0."""
    start, end = (Screw(T[:3, 2], T[:3, 3]) for T in (pose_a, pose_b))
    return smallest_motion(
        start, end.reverse() if start.direction @ end.direction < 0.0 else end, turns=False
    )


#: Maximum number of orders that are tried for each run of consecutive joints of B. Five prismatic joints have
#: 120 orders.
MAX_ORDERS = 120
#: Maximum number of later joint pairs that a search compares; see `LookAhead`. Without names and without an
#: exact match, the robot TALOS needs up to 500 pairs, and Baxter up to 1,000.
MAX_LOOK_AHEAD_PAIRS = 2000
#: Larger angle tolerances (rad), tried in this order if A and B differ.
LARGER_TOLERANCES = (1e-11, 1e-9, 1e-7, 1e-5, 1e-3)
#: Maximum number of zero offsets that one fit computes.
#: A fit of n zero offsets takes O(n^3) time.
MAX_REFINED_JOINTS = 100
#: Maximum number of attempts to exchange the partners of two joint pairs.
MAX_EXCHANGES = 12
#: Maximum number of alignments without unmatched joints that are fitted.
MAX_FULL_MATCHES = 12


def align(
    a: Mechanism, b: Mechanism, name_map: Mapping[str, str], choices: AlignmentChoices | None = None
) -> Alignment:
    """Align mechanism B with mechanism A."""
    if choices is not None:
        for order in choices.orders:
            b = b.reorder(order)
        return _best_alignment(a, b, name_map, choices)
    best = _best_alignment(a, b, name_map, None, LookAhead(MAX_LOOK_AHEAD_PAIRS))
    if best.has_separated_names:
        named = _best_alignment(a, b, name_map, None, LookAhead(MAX_LOOK_AHEAD_PAIRS), separates_names=False)
        named = _with_refined_axes(named, name_map)
        if named.is_complete and not named.has_separated_names:
            best = named
    first = best
    for orders in b.orders_of_runs(tolerance_of(a, b)):
        if best.is_complete:
            break
        present, run = best.b, next(orders)
        for names in _orders_to_try(a, present, name_map, run, orders):
            moved = [k for k, name in enumerate(names) if name != run[k]]
            other = present.reorder(names[moved[0] : moved[-1] + 1])
            candidate = _best_alignment(a, other, name_map, None)
            if _is_better_alignment(candidate, best):
                best = candidate
    if best is not first and not best.matches_all_common_links:
        # A new order of the joints omits links. The fit can make it unnecessary.
        refined = _with_refined_axes(first, name_map)
        best = refined if refined.is_complete else best
    best = _with_refined_axes(_with_exchanged_joints(best, name_map), name_map)
    best = _with_larger_tolerances(_with_another_start(best, b, name_map), name_map)
    return _with_zeros_by_mimic_rules(_with_all_joints(best, b, name_map))


def _orders_to_try(
    a: Mechanism, b: Mechanism, name_map: Mapping[str, str], run: Sequence[str], orders: Iterator[list[str]]
) -> Iterator[Sequence[str]]:
    called = {name_map.get(joint.name, joint.name): i for i, joint in enumerate(a.tree.joints)}
    if not all(name in called for name in run):
        yield from islice(orders, MAX_ORDERS)
        return
    named = sorted(run, key=called.__getitem__)
    if list(run) == named:
        return
    others = [order for order in (named, named[::-1]) if order != list(run)]
    yield from (order for order in others if b.allows_order(order, tolerance_of(a, b)))


def _with_zeros_by_mimic_rules(best: Alignment) -> Alignment:
    zeros = zeros_by_mimic_rules(best, tolerance_of(best.a, best.b))
    if not zeros:
        return best
    choices, X = best.choices, best.X
    for step in best.steps:
        name = best.a.tree.joints[step.a].name
        if step.previous < 0 and name in zeros and _is_compensated_by_base(best, step):
            # The pose of B's root compensates the change of the zero offset.
            edge = next(edge for edge in best.b.edges if edge.joint == step.b)
            screw = _outwards(best.b.screw(edge), edge.outer == best.b.body_of[best.base[1]])
            change = step.offset - zeros[name][1]
            X = X @ screw_motion(screw, change, turns=step.kind == "turns")
    candidate = _best_alignment(
        best.a, best.b, best.names, replace(choices, X=X, zeros={**choices.zeros, **zeros})
    )
    return (
        candidate
        if candidate.difference_count <= best.difference_count
        and candidate.max_difference <= best.max_difference
        else best
    )


def _with_exchanged_joints(best: Alignment, name_map: Mapping[str, str]) -> Alignment:
    """Exchange the partners of two joint pairs, for example of mirrored arms, if the alignment improves."""
    # An exchange cannot match joints that only one model has.
    if best.only_a or best.only_b:
        return best
    tried, look_ahead = set[frozenset[tuple[int, int]]](), LookAhead(MAX_LOOK_AHEAD_PAIRS)
    while (
        pairs := next((one for one in best.exchangeable_pairs(name_map) if one not in tried), None)
    ) is not None:
        tried.add(pairs)
        if len(tried) > MAX_EXCHANGES:
            break
        joints = best.a.tree.joints, best.b.tree.joints
        (a, b), (c, d) = pairs
        other = {joints[0][a].name: joints[1][d].name, joints[0][c].name: joints[1][b].name}
        candidate = _best_alignment(best.a, best.b, {**name_map, **other}, None, look_ahead, base=best.base)
        if _is_better_alignment(candidate, best):
            best, name_map = candidate, {**name_map, **other}
    return best


def _with_another_start(best: Alignment, b: Mechanism, name_map: Mapping[str, str]) -> Alignment:
    """If the alignment is not complete, search an exact match from other bodies with equal labels.

    The search is slow for different robots, so `find_exact` needs roots without equal labels. In the exact
    match, the joints of B have their original order.
    """
    if best.is_complete and best.matches_all_common_links:
        return best
    tolerance = tolerance_of(best.a, b)
    joint_matcher = JointMatcher(best.a, b, name_map, tolerance)
    matcher = MechanismMatcher(best.a, b, joint_matcher, None, LookAhead(0), tolerance, None)
    exact = matcher.find_exact()
    return exact if exact is not None and exact.matches_all_common_links else best


def _with_all_joints(best: Alignment, b: Mechanism, name_map: Mapping[str, str]) -> Alignment:
    """If joints of both models are unmatched, fit other alignments that match all joints.

    Before a fit, a wrong alignment can have more coincident axes than the correct alignment.
    """
    if not (best.only_a and best.only_b):
        return best
    tolerance = tolerance_of(best.a, b)
    joint_matcher = JointMatcher(best.a, b, name_map, tolerance)
    matcher = MechanismMatcher(
        best.a, b, joint_matcher, None, LookAhead(MAX_LOOK_AHEAD_PAIRS), tolerance, None
    )
    for alignment in islice(matcher.full_matches(), MAX_FULL_MATCHES):
        refined = _with_refined_axes(alignment, name_map)
        if refined.is_complete and refined.matches_all_common_links:
            return refined
    return best


def _with_larger_tolerances(best: Alignment, name_map: Mapping[str, str]) -> Alignment:
    """Align again with larger tolerances, because axes may all differ by more than the normal tolerance."""
    if best.all_joints_agree and best.has_free_frames:
        return best
    a, b, (least, most), look_ahead = (
        best.a,
        best.b,
        best.inner_difference_range,
        LookAhead(MAX_LOOK_AHEAD_PAIRS),
    )
    size = size_of(a, b)
    for angle in LARGER_TOLERANCES:
        if not least < angle * size < BETTER_RATIO * most:
            continue
        tolerance = Tolerance(angle, angle * size)
        rough = _best_alignment(a, b, name_map, None, look_ahead, tolerance, best.base)
        unmatched = [(len(one.only_a), len(one.only_b)) for one in (rough, best)]
        if rough.inner_difference_range[1] or unmatched[0] != unmatched[1]:
            continue
        exact = _best_alignment(a, b, rough.names, rough.choices)
        return exact if exact.inner_difference_range[1] < BETTER_RATIO * most else best
    return best


def _with_refined_axes(best: Alignment, name_map: Mapping[str, str]) -> Alignment:
    """If axes or links do not agree, solve for B's root pose and all zero offsets together.

    The frames of a table do not determine zero offsets. Nearly parallel axes determine the zero offsets only
    together.
    """
    agrees = best.all_joints_agree if best.has_free_frames else best.is_complete
    if agrees or best.only_a or best.only_b or not 0 < len(best.steps) <= MAX_REFINED_JOINTS:
        return best
    for start in _starts_of_refinement(best, name_map):
        if any(step.kind_difference for step in start.steps):
            continue
        # The links can lead the fit to a wrong solution.
        # Then the last fit starts where all axes coincide.
        tried = start
        for with_links in (False,) if best.has_free_frames else (True, False, True):
            if with_links and tried is not start and not tried.all_joints_agree:
                break
            refined = refine_choices(tried if with_links else start, with_links=with_links)
            tried = _best_alignment(best.a, best.b, start.names, refined)
            if tried.all_joints_agree and _is_better_alignment(tried, best):
                return tried
    return best


def _starts_of_refinement(best: Alignment, name_map: Mapping[str, str]) -> Iterator[Alignment]:
    yield best
    if best.has_free_frames:
        size, look_ahead = size_of(best.a, best.b), LookAhead(MAX_LOOK_AHEAD_PAIRS)
        for angle in LARGER_TOLERANCES:
            tolerance = Tolerance(angle, angle * size)
            rough = _best_alignment(best.a, best.b, name_map, None, look_ahead, tolerance, best.base)
            if rough.all_joints_agree:
                yield rough


def _best_alignment(
    a: Mechanism,
    b: Mechanism,
    name_map: Mapping[str, str],
    choices: AlignmentChoices | None,
    look_ahead: LookAhead | None = None,
    tolerance: Tolerance | None = None,
    base: tuple[int, int] | None = None,
    *,
    separates_names: bool = True,
) -> Alignment:
    tolerance = tolerance or tolerance_of(a, b)
    joint_matcher = JointMatcher(a, b, name_map, tolerance)
    matcher = MechanismMatcher(a, b, joint_matcher, choices, look_ahead or LookAhead(0), tolerance, base)
    return matcher.find_best() if separates_names else matcher.find_best_with_names()


#: Full turns that may be added to the zero offset of a revolute joint, so that the offset fits the mimic
#: rules.
FULL_TURNS = (0, 1, -1)
#: Allowed change of a computed zero offset by mimic rules, as a multiple of the angle tolerance. A computed
#: zero offset is inexact if the axes of the joint and of a later joint nearly coincide.
OFFSET_TOLERANCE_FACTOR = 1e4


@dataclass(frozen=True, slots=True)
class _RulePair:
    """The mimic rules of two matched joints.

    A's joint has the value `m x + c`, where x is a coordinate of A. B's joint has the value `n y + d`, where
    y is a coordinate of B. The values agree if `n y + d = s (m x + c) + o`, with the sign s (1 or -1) and the
    zero offset o. Therefore, the rules require `y = alpha x + beta`.

    Attributes:
        slope_a: The slope s m.
        constant_a: The constant s c.
        slope_b: The slope n.
        constant_b: The constant d.
        offset: The zero offset o.
        is_free: Whether o can have any value, because no later link or axis determines o.
        has_effect: Whether the joint moves matched links or later axes.
    """

    step: int
    slope_a: float
    constant_a: float
    slope_b: float
    constant_b: float
    offset: float
    turns: bool
    is_free: bool
    has_effect: bool

    def beta_with_turns(self, turn: int) -> float:
        """Return beta for the zero offset o + 2 pi `turn`."""
        return (self.constant_a + self.offset + 2.0 * math.pi * turn - self.constant_b) / self.slope_b

    def offset_from_beta(self, beta: float) -> float:
        return self.slope_b * beta + self.constant_b - self.constant_a

    def allows(self, offset: float, tolerance: Tolerance) -> bool:
        if not math.isfinite(offset):  # For a subnormal slope, beta can be inf.
            return False
        difference = offset - self.offset
        if not math.isfinite(difference):  # a tiny multiplier makes `beta` overflow
            return False
        if self.turns:
            difference = math.remainder(difference, 2.0 * math.pi)
        return self.is_free or abs(difference) <= OFFSET_TOLERANCE_FACTOR * tolerance.angle * max(
            1.0, abs(offset)
        )


def zeros_by_mimic_rules(alignment: Alignment, tolerance: Tolerance) -> Mapping[str, tuple[int, float]]:
    """Map joint names of A to signs and new zero offsets (rad or m) that fit the mimic rules."""
    zeros = dict[str, tuple[int, float]]()
    for rules in _group_rule_pairs(alignment):
        alphas = [rule.slope_a / rule.slope_b for rule in rules if rule.slope_b]
        # The rules of each joint pair require y = alpha x + beta for the coordinates x of A and y of B. Joint
        # pairs can differ in alpha, so only the pairs with the most frequent alpha get new zero offsets.
        alpha = max(
            alphas, key=lambda one: sum(_are_close(one, other, tolerance) for other in alphas), default=0.0
        )
        fit = [rule for rule in rules if _are_close(rule.slope_a, rule.slope_b * alpha, tolerance)]
        some = sorted(
            (rule for rule in fit if rule.slope_b), key=lambda rule: (rule.is_free, not rule.has_effect)
        )
        some = [rule for rule in some if rule.is_free == some[0].is_free]
        betas = [rule.beta_with_turns(turn) for rule in some for turn in (FULL_TURNS if rule.turns else (0,))]
        if not betas:
            continue
        beta = max(
            betas, key=lambda one: sum(rule.allows(rule.offset_from_beta(one), tolerance) for rule in fit)
        )
        for rule in fit:
            offset = rule.offset_from_beta(beta)
            if rule.allows(offset, tolerance) and not _are_close(offset, rule.offset, tolerance):
                step = alignment.steps[rule.step]
                zeros[alignment.a.tree.joints[step.a].name] = step.sense, offset
    return zeros


def _are_close(x: float, y: float, tolerance: Tolerance) -> bool:
    return abs(x - y) <= 0.5 * tolerance.angle * max(1.0, abs(x), abs(y))


def _group_rule_pairs(alignment: Alignment) -> Iterator[list[_RulePair]]:
    groups = dict[tuple[str, str], list[_RulePair]]()
    for i, step in enumerate(alignment.steps):
        if step.kind_difference or step.kind not in ("turns", "prismatic"):
            continue
        x, m, c = _as_rule(alignment.a.tree.joints[step.a])
        y, n, d = _as_rule(alignment.b.tree.joints[step.b])
        slope, constant = step.sense * m, step.sense * c
        determined, has_effect = _find_effects(alignment, i)
        rule = _RulePair(
            i, slope, constant, n, d, step.offset, step.kind == "turns", not determined, has_effect
        )
        groups.setdefault((x, y), []).append(rule)
    yield from (rules for rules in groups.values() if len(rules) > 1)


def _as_rule(joint: Joint) -> tuple[str, float, float]:
    rule = joint.mimic
    return (joint.name, 1.0, 0.0) if rule is None else (rule.mimicked_joint, rule.multiplier, rule.offset)


def _is_compensated_by_base(alignment: Alignment, step: MatchedJoints) -> bool:
    """Return whether the pose of B's root can compensate any zero offset of a joint pair.

    This requires that the joint pair is the only one at the base, and that no links with equal labels are at
    the base.
    """
    frames = [frame for frame in alignment.frames if frame.previous < 0]
    names = set(alignment.b.labels)
    return (
        step.previous < 0
        and len(frames) <= 1
        and not any(alignment.a.labels[frame.a] in names for frame in frames)
        and all(
            len(mechanism.edges_by_body[mechanism.body_of[link]]) == 1
            for mechanism, link in zip((alignment.a, alignment.b), alignment.base, strict=True)
        )
    )


def _find_effects(alignment: Alignment, i: int) -> tuple[bool, bool]:
    """Return whether later links or axes determine the zero offset of pair i, and `_RulePair.has_effect`."""
    if _is_compensated_by_base(alignment, alignment.steps[i]):
        return False, True
    names = set(alignment.a.labels) & set(alignment.b.labels)
    behind = {i}
    for k, step in enumerate(alignment.steps):
        if step.previous in behind:
            if (
                step.differs
                or step.kind_difference
                or step.conversion
                or not _keeps_axis_fixed(alignment.steps[i], step)
            ):
                return True, True
            behind.add(k)
    carried = [frame for frame in alignment.frames if frame.previous in behind]
    determined = any(alignment.a.labels[frame.a] in names for frame in carried)
    return determined, any(frame.tool is IDENTITY for frame in carried)


def _keeps_axis_fixed(one: MatchedJoints, other: MatchedJoints) -> bool:
    """Return whether the axis of `other` stays fixed when joint `one` moves."""
    if "turns" not in (one.kind, other.kind):
        return other.kind == "prismatic"
    if {one.kind, other.kind} - {"turns", "prismatic"}:
        return False
    with_distance = one.kind == other.kind == "turns"
    return max(line_difference(one.axis_a, other.axis_a, with_distance=with_distance)) == 0.0
