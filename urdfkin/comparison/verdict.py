"""Decide whether two models are the same robot, and whether single precision explains their differences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import takewhile

import numpy as np

from urdfkin.comparison.bounds import MAX_BOXES, DistanceSearch, pinocchio_poses, tighten
from urdfkin.comparison.result import (
    BOUNDED_DIFFERENCE_KINDS,
    EQUIVALENCE_KINDS,
    Confirmation,
    Interval,
    JointDifference,
    JointMap,
    Sameness,
    Tool,
    Verdict,
    angle,
    base_as_written,
    changes_of_b,
    check_joint_names,
    differences,
    length,
    remarks,
    size_words,
)
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_finite_float, as_int
from urdfkin.kinematics.roundings import EPS, SINGLE_ROUNDOFF
from urdfkin.model.configuration import ASSUMED_LIMIT, range_reductions
from urdfkin.model.conventions.convention import spellings
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import (
    AS_WRITTEN,
    IDENTITY,
    Alignment,
    AlignmentChoices,
    FramePair,
    MatchedJoints,
    Mechanism,
    Screw,
    Tolerance,
    Variables,
    pose_difference,
    smallest_motion,
    tolerance_of,
    variables_of,
)
from urdfkin.model.mechanisms.upper_bound import FINE_GRID, upper_bounds
from urdfkin.model.tree import FloatArray, Joint, KinematicTree, Lock, inverse
from urdfkin.robot import Robot
from urdfkin.robot.loading import as_robot
from urdfkin.urdf.sources import Source, is_usd
from urdfkin.verify.oracles import PINOCCHIO
from urdfkin.verify.verifier import as_verify

#: Number of random configurations at which Pinocchio checks the distances between matching frames.
CONFIRMATION_SAMPLES = 8
#: Maximum number of frames with an upper bound on the finer grid `FINE_GRID`. The search for the
#: largest distance between the unchanged models uses at most this number of frames.
MAX_REFINED_FRAMES = 4
#: Maximum length (m) of a path from the root to a link. The squares of lengths above 1.3e154 m overflow.
MAX_PATH_METRES = 1e150
#: Branch and bound ends if the upper bound is at most this factor times the largest distance that was found.
SHARP_FACTOR = 1.05


def same(
    a: Robot | Source | DHTable,
    b: Robot | Source | DHTable,
    *,
    map: Mapping[str, str] | None = None,
    bounds: bool = True,
    boxes: int = MAX_BOXES,
    within: float | None = None,
) -> Sameness:
    """Decide and prove whether two models move alike in every configuration.

    The pose of a link is a product of exponentials:

        T(q) = exp(S_1 q_1) ... exp(S_n q_n) H

    S_i is the screw of joint i. H is the pose of the link in the zero configuration. Two models with equal
    screws and equal poses H move alike for all q. The models may still differ in names, coordinate order,
    fixed links and base pose. Joint zeros, joint directions and tool frames may also differ.

    Args:
        a: A robot, or a source for `load`.
        b: The other robot, or a source for `load`.
        map: Joint names of `a`, each with the name of the matching joint of `b`. Only joints that urdfkin
            cannot match by names and axes need an entry.
        bounds: Whether to bound the largest distances between frames. If the models differ, these bounds take
            most of the time.
        boxes: Maximum number of boxes of configurations in memory during branch and bound. Boxes give sharper
            bounds if the models differ in many places. The value 0 turns off branch and bound.
        within: Limit (m and rad) for `Sameness.within`. If `Sameness.after` is not empty, branch and bound
            tries to prove that the distances are within this limit.

    Returns:
        The verdict, the matched joints and links, and the differences. Each pair of matched links has an
        interval that contains the largest distance of the two links within the joint limits.

    Raises:
        UrdfError: a model has errors.
        SourceError, UnknownNameError, InputError: as for `load`.
        UnknownNameError: `map` names a joint that the model does not have.
        InputError: joints in `map` cannot be matched, or an argument is wrong. Also if a path is longer than
            1e150 m. With `within`, also if no frame of the other model has the name of a table's tip.
        UrdfkinError: Pinocchio finds a distance above a proven bound.

    Example:
        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur5_limited")
        >>> found.verdict.value, len(found.remarks)
        ('same', 5)
        >>> found = urdfkin.same("talos", "talos_reduced_corrected")
        >>> bool(found)
        False
    """
    robots = (as_robot(a), as_robot(b))
    joint_map = _as_joint_map(map)
    as_int(boxes, "boxes", 0)
    as_bool(bounds, "bounds")
    if within is not None:
        within = as_finite_float(within, "within")
    for which, robot, names in zip("AB", robots, (joint_map, joint_map.values()), strict=True):
        check_joint_names(robot.tree, list(names), which)
    # The comparison stores compiled trees in the robots, so `same` passes copies of the user's robots.
    return Comparator((copy(robots[0]), copy(robots[1])), joint_map, bounds, boxes, within).compare()


def _as_joint_map(joint_map: Mapping[str, str] | None) -> dict[str, str]:
    if joint_map is None:
        return {}
    if not isinstance(joint_map, Mapping) or any(
        not isinstance(name, str) for pair in joint_map.items() for name in pair
    ):
        raise InputError(
            "`map` is not a mapping of joint names",
            where="map",
            found=repr(joint_map),
            remedy="give a dict from each joint name of A to a joint name of B",
        )
    return dict(joint_map)


class Comparator:
    def __init__(
        self,
        robots: tuple[Robot, Robot],
        joint_map: dict[str, str],
        bounds: bool,
        boxes: int = MAX_BOXES,
        within: float | None = None,
    ) -> None:
        self.robots, self.joint_map, self.bounds, self.boxes = robots, joint_map, bounds, boxes
        self.within = within
        self.trees = a, b = robots[0].tree, robots[1].tree
        labels, self.spellings = _match_usd_spellings(robots)
        swapped = labels[1], labels[0]
        names = {**self.spellings, **joint_map}
        trees = (
            _fix_idle_mimic_joints(a, b, names, labels),
            _fix_idle_mimic_joints(b, a, _swap_pairs(names), swapped),
        )
        separating_joints = (
            _joints_fixed_in_one(*trees, names, labels),
            _joints_fixed_in_one(*trees[::-1], _swap_pairs(names), swapped),
        )
        is_table = [bool(robot.origin.table) for robot in robots]
        self.mechanisms = (
            Mechanism(trees[0], separating_joints[0], labels[0], free_frames=is_table[0]),
            Mechanism(trees[1], separating_joints[1], labels[1], free_frames=is_table[1]),
        )
        for which, mechanism, robot in zip("AB", self.mechanisms, robots, strict=True):
            if not mechanism.size <= MAX_PATH_METRES:
                raise InputError(
                    f"a path from the root to a link is longer than {MAX_PATH_METRES:g} m:"
                    " its square overflows",
                    where=f"model {which}, {robot.name}",
                    found=f"{mechanism.size:.6g} m",
                    remedy="write origins in metres",
                )
        self.tolerance: Tolerance = tolerance_of(*self.mechanisms)

    def compare(self) -> Sameness:
        alignment = self.alignment()
        self._check_map(alignment)
        variables = variables_of(alignment, self.tolerance)
        result = self.result_without_bounds(alignment, variables)
        if not self.bounds:
            return replace(
                result, confirmation=self._confirm(alignment, variables, _bound_of_verdict(result))
            )
        frames = self._intervals(alignment, variables)
        farthest, bound = None, _largest([(frame.upper, frame.radians) for frame in frames])
        if result.after:
            written = self.align_as_written(alignment)
            moving = variables_of(written, self.tolerance)
            farthest = self._farthest_as_written(written, moving)
            bound = self._bound_as_written(written, moving, farthest)
            pairs = self._comparable_links(alignment)
            tip = self._find_uncompared_tip(pairs)
            if tip is not None and self.within is not None and not self._is_common(tip):
                raise InputError(
                    "no frame of the other model has the name of the table's tip, so the tip is not compared",
                    where="--within",
                    found=repr(tip),
                    remedy="write the name of the other model's frame as the table's tip",
                )
            if len(written.frames) < len(pairs) or tip is not None:
                bound = math.inf, math.inf
        checked = self._confirm(alignment, variables, [frame.upper for frame in frames])
        return replace(
            result, frames=frames, as_written=farthest, bound_as_written=bound, confirmation=checked
        )

    def alignment(self) -> Alignment:
        return self.align({**self.spellings, **self.joint_map})

    def align(self, names: Mapping[str, str], choices: AlignmentChoices | None = None) -> Alignment:
        """Align the models. `names` maps joint names of A to joint names of B.

        A fixed joint without a matching moving joint does not separate bodies. Otherwise, the links after
        this joint would not be compared. The method merges these bodies in `mechanisms`, and aligns again.
        """
        while True:
            a, b = self.mechanisms
            found = align(a, b, names, choices)
            pairs: list[tuple[int | None, int | None]] = [(step.a, step.b) for step in found.steps]
            pairs += [(i, None) for i in found.only_a] + [(None, j) for j in found.only_b]
            fixed = [
                (i, j)
                for i, j in pairs
                if (i is None or not a.tree.joints[i].kind.nv) and (j is None or not b.tree.joints[j].kind.nv)
            ]
            if not fixed:
                return found
            self.mechanisms = a.merge({i for i, _ in fixed}), b.merge({j for _, j in fixed})

    def merge_fixed_joints_except(self, names: Mapping[str, str]) -> None:
        """Separate bodies only at moving joints, and at the fixed joints in `names`."""
        a, b = self.mechanisms
        theirs = set(names.values())
        self.mechanisms = (
            a.merge({edge.joint for edge in a.edges if a.joint(edge).name not in names}),
            b.merge({edge.joint for edge in b.edges if b.joint(edge).name not in theirs}),
        )

    def result_without_bounds(self, alignment: Alignment, variables: Variables) -> Sameness:
        """Return the verdict and the differences, and store the tool frames in `alignment`."""
        names = tuple([joint.name for joint in tree.joints] for tree in self.trees)
        links = self.trees[0].links, self.trees[1].links
        changes = changes_of_b(alignment, self.tolerance)
        kinds = {kind for kind, _ in changes}
        different = differences(alignment, variables)
        single = self._single_precision_bound(alignment, variables)
        verdict = Verdict.DIFFERS if different else Verdict.SAME_AFTER if changes else Verdict.SAME
        unexplained = () if verdict is Verdict.SAME else self._unexplained_differences(alignment)
        if single is not None and verdict is not Verdict.SAME and not unexplained:
            verdict = (
                Verdict.UP_TO_SINGLE
                if {one.what for one in different} <= BOUNDED_DIFFERENCE_KINDS
                else verdict
            )
        return Sameness(
            names=(self.robots[0].name, self.robots[1].name),
            sources=(self.robots[0].source, self.robots[1].source),
            digests=(self.robots[0].sha256, self.robots[1].sha256),
            verdict=verdict,
            after=tuple(dict.fromkeys(words for _, words in changes)),
            up_to=tuple(kind for kind in EQUIVALENCE_KINDS if kind in kinds),
            differences=different,
            remarks=remarks(
                alignment,
                variables,
                self.tolerance,
                SINGLE_ROUNDOFF if single else 0.0,
                as_written=verdict is Verdict.UP_TO_SINGLE,
            ),
            joints=tuple(
                JointMap(names[0][s.a], names[1][s.b], s.sense, s.offset, s.conversion)
                for s in alignment.steps
            ),
            links=tuple((links[0][f.a], links[1][f.b]) for f in alignment.frames),
            tools=tuple(
                Tool(links[0][f.a], links[1][f.b], f.tool) for f in alignment.frames if f.tool is not IDENTITY
            ),
            orders=alignment.b.orders,
            base=alignment.X,
            base_links=(links[0][alignment.base[0]], links[1][alignment.base[1]]),
            rounding=self.rounding(alignment, variables),
            unlimited=tuple(
                names[0][step.a]
                for step, travel in _iterate_travels(alignment, variables)
                if math.isinf(travel)
            ),
            single=single,
            unexplained=unexplained,
            frames=(),
            as_written=None,
            bound_as_written=(math.inf, math.inf),
            narrowed=tuple(
                f"{which}: {words}"
                for which, tree in zip("AB", self.trees, strict=True)
                for words in range_reductions(tree)
            ),
            confirmation=Confirmation("not asked", reason="the bounds are not computed yet"),
            trees=self.trees,
        )

    def _single_precision_bound(
        self, alignment: Alignment, variables: Variables
    ) -> tuple[float, float] | None:
        """Bound the frame displacements (m, rad) that single precision and rounding cause."""
        if all(robot.single is None for robot in self.robots):
            return None
        pairs = [(frame.a, frame.b) for frame in alignment.frames]
        errors = np.zeros((len(pairs), 2))
        for which, robot in enumerate(self.robots):
            if robot.single is not None and pairs:
                errors += robot.single.links[[pair[which] for pair in pairs]]
        rounding = np.array(self.rounding(alignment, variables))
        metres, radians = (rounding + errors.max(axis=0, initial=0.0)).tolist()
        return metres, radians

    def _unexplained_differences(self, alignment: Alignment) -> tuple[JointDifference, ...]:
        errors = [
            np.zeros((len(tree.joints), 3)) if robot.single is None else robot.single.joints
            for tree, robot in zip(self.trees, self.robots, strict=True)
        ]
        a, b = self.mechanisms
        found = tuple(
            JointComparison(
                alignment, (errors[0], errors[1]), base_as_written(a, b), self.tolerance
            ).differences()
        )
        if found or not (errors[0].any() or errors[1].any()):
            return found
        back = align(b, a, _swap_pairs(alignment.names))
        other = JointComparison(back, (errors[1], errors[0]), base_as_written(b, a), self.tolerance)
        places = other.places_in_second_model()
        return tuple(
            replace(one, place=places.get(one.place, one.place))
            if one.a is None
            else replace(one, place=places.get(one.place, one.place), a=one.b, b=one.a)
            for one in other.differences()
        )

    def align_as_written(self, alignment: Alignment) -> Alignment:
        """Align the unchanged models with the joint pairs, joint orders and links of `alignment`."""
        a, b = self.mechanisms
        choices = replace(AS_WRITTEN, X=base_as_written(a, b), orders=alignment.b.orders)
        written = align(a, b, alignment.names, choices)
        written.frames = written.frames_of(self._comparable_links(alignment))
        return written

    def _comparable_links(self, alignment: Alignment) -> list[tuple[int, int]]:
        links = self.trees[0].links, self.trees[1].links
        pairs = ((frame.a, frame.b) for frame in alignment.frames)
        if not alignment.has_free_frames:
            return list(pairs)
        # The convention determines the frames of a Denavit-Hartenberg table. Therefore, only the table's base
        # and tip are compared.
        tips = alignment.a.table_tip, alignment.b.table_tip
        return [
            (a, b)
            for a, b in pairs
            if (links[0][a] == links[1][b] or (a, b) == tips)
            and all(tip is None or link in (0, tip) for link, tip in zip((a, b), tips, strict=True))
        ]

    def _is_common(self, link: str) -> bool:
        return all(link in tree.links for tree in self.trees)

    def _find_uncompared_tip(self, pairs: Sequence[tuple[int, int]]) -> str | None:
        """Return the name of a table's tip that is in no pair."""
        for k, mechanism in enumerate(self.mechanisms):
            tip = mechanism.table_tip
            if tip is not None and all(pair[k] != tip for pair in pairs):
                return self.trees[k].links[tip]
        return None

    def _check_map(self, alignment: Alignment) -> None:
        names = alignment.names
        for ours, theirs in self.joint_map.items():
            if names.get(ours) != theirs:
                raise InputError(
                    "these joints cannot be matched: their parent links are not matched",
                    where="map",
                    found=f"{ours!r} of A, {theirs!r} of B",
                    remedy="also map the parent joints of these two joints, or remove this pair of joints",
                )

    def search(
        self, alignment: Alignment, variables: Variables, *, as_written: bool = False
    ) -> DistanceSearch:
        return DistanceSearch(self.robots, alignment, variables, as_written=as_written)

    def rounding(self, alignment: Alignment, variables: Variables) -> tuple[float, float]:
        """Bound the displacement (m) and the rotation (rad) of frames that rounding can cause.

        `same` ignores a small difference at each joint:

            d, e             ignored distance (m) and angle (rad) at one joint
            depth            largest number of joints on a path, plus 1
            slides, turns    sums of the rounding errors of joint values (m, rad)
            reach            largest lever arm: longest path, plus the travels of all joints (m)

            angle <= depth e + turns
            distance <= depth d + slides + angle * reach

        Each joint in `Sameness.unlimited` is assumed to travel at most `ASSUMED_LIMIT`.
        """
        pairs = [
            (step.kind, pair)
            for step, pair in zip(alignment.steps, variables.pairs, strict=True)
            if pair is not None
        ]
        travels = [
            ASSUMED_LIMIT if math.isinf(travel) else travel
            for _, travel in _iterate_travels(alignment, variables)
        ]
        reach = max(self.mechanisms[0].size, self.mechanisms[1].size) + sum(travels)
        slides = sum(pair.rounding for kind, pair in pairs if kind == "prismatic")
        turns = sum(pair.rounding for kind, pair in pairs if kind != "prismatic")
        metres = alignment.depth * self.tolerance.distance
        radians = alignment.depth * self.tolerance.angle + turns
        return metres + slides + radians * reach, radians

    def _intervals(self, alignment: Alignment, variables: Variables) -> tuple[Interval, ...]:
        frames = alignment.frames
        metres, radians = self.rounding(alignment, variables)
        uppers = self._frame_upper_bounds(alignment, variables)
        different = [k for k, upper in enumerate(uppers) if max(upper) > 0.0]
        search = self.search(alignment, variables)
        largest = search.largest_distances([frames[k] for k in different])
        worst = dict(zip(different, largest, strict=True))
        self._sharpen(
            uppers, frames, search, SHARP_FACTOR * max((metres for metres, _ in largest), default=0.0)
        )
        return tuple(
            self._interval(
                alignment, frame, search, worst.get(k), (uppers[k][0] + metres, uppers[k][1] + radians)
            )
            for k, frame in enumerate(frames)
        )

    def _bound_as_written(
        self, written: Alignment, variables: Variables, farthest: Interval | None
    ) -> tuple[float, float]:
        """Return bounds (m, rad) on the differences between frames of the unchanged models."""
        search = self.search(written, variables, as_written=True)
        if search.unbounded:
            return math.inf, math.inf
        metres, radians = self.rounding(written, variables)
        uppers = self._frame_upper_bounds(written, variables)
        target = 0.0 if self.within is None else self.within - metres
        if farthest is not None and farthest.lower <= target:
            self._sharpen(uppers, written.frames, search, target)
        largest = _largest(uppers)
        return largest[0] + metres, largest[1] + radians

    def _frame_upper_bounds(self, alignment: Alignment, variables: Variables) -> list[tuple[float, float]]:
        frames = alignment.frames
        uppers = [upper_bounds(alignment, variables, frame) for frame in frames]
        different = [k for k, upper in enumerate(uppers) if max(upper) > 0.0]
        fine = set[int]()
        while len(fine) < min(MAX_REFINED_FRAMES, len(different)):
            widest = max(different, key=lambda k: uppers[k])
            if widest in fine:
                break
            uppers[widest] = upper_bounds(alignment, variables, frames[widest], FINE_GRID)
            fine.add(widest)
        return uppers

    def _sharpen(
        self,
        uppers: list[tuple[float, float]],
        frames: Sequence[FramePair],
        search: DistanceSearch,
        target: float,
    ) -> None:
        """Sharpen the bounds above `target` (m) by branch and bound, the largest bound first.

        The method stops at the first bound that stays above `target`.
        """
        for _ in uppers:
            widest = max(range(len(uppers)), key=lambda k: uppers[k])
            if uppers[widest][0] <= target:
                break
            sharper = tighten(search, frames[widest], target, uppers[widest][0], self.boxes)
            uppers[widest] = sharper, uppers[widest][1]
            if sharper > target:
                break

    def _farthest_as_written(self, written: Alignment, variables: Variables) -> Interval | None:
        if not written.frames:
            return None
        metres, radians = self.rounding(written, variables)
        search = self.search(written, variables, as_written=True)
        distances = search.sample_distances(written.frames)[0].max(axis=0)
        far = [written.frames[k] for k in np.argsort(-distances, kind="stable")[:MAX_REFINED_FRAMES]]
        # If all distances are within rounding, the frame with the largest bound on the angle is used.
        if distances.max() <= metres:
            far = [max(written.frames, key=lambda frame: upper_bounds(written, variables, frame)[1])]
        worst = zip(search.largest_distances(far), far, strict=True)
        attained, frame = max(worst, key=lambda pair: pair[0][0])
        upper = (
            (math.inf, math.inf) if search.unbounded else upper_bounds(written, variables, frame, FINE_GRID)
        )
        return self._interval(written, frame, search, attained, (upper[0] + metres, upper[1] + radians))

    def _interval(
        self,
        alignment: Alignment,
        frame: FramePair,
        search: DistanceSearch,
        attained: tuple[float, FloatArray] | None,
        upper: tuple[float, float],
    ) -> Interval:
        """Return a frame's interval.

        `attained` contains the largest distance found (m), and the values of the variables at this distance.
        """
        names = self.trees[0].links[frame.a], self.trees[1].links[frame.b]
        if attained is None:
            return Interval(*names, 0.0, *upper, 0.0, (), ())
        metres, z = attained
        rounding = self.rounding(alignment, search.variables)
        if metres <= rounding[0] and upper[1] > rounding[1]:
            z = search.values_of_largest_rotation(frame)
        poses = search.poses(z[np.newaxis], [frame])
        radians = pose_difference(poses[0][0, 0], poses[1][0, 0])[0]
        q_a, q_b = search.configurations(z[np.newaxis])
        lower = max(0.0, metres - rounding[0])
        return Interval(*names, lower, *upper, radians, tuple(q_a[0].tolist()), tuple(q_b[0].tolist()))

    def _confirm(
        self, alignment: Alignment, variables: Variables, bounds: Sequence[float] | float | None
    ) -> Confirmation:
        """Check bounds (m) on frame distances against Pinocchio's distances.

        `bounds` has one number for each frame, or one for all frames.
        """
        if bounds is None:
            return Confirmation("not asked", reason="bounds=False, so there is no bound to check")
        if not all(as_verify(robot.verifier.policy) for robot in self.robots):
            return Confirmation("not asked", reason="loaded with verify=False")
        for robot in self.robots:
            if (reason := robot.verifier.find_refusal()) is not None:
                return Confirmation("not verified", reason=reason)
        distances = self.pinocchio_distances(alignment, variables)
        links = self.trees[0].links
        for frame, metres, bound in zip(
            alignment.frames, distances, np.broadcast_to(bounds, distances.shape), strict=True
        ):
            if not metres <= bound * (1.0 + EPS):
                raise UrdfkinError(
                    "Pinocchio finds a distance above the proven bound",
                    where=f"frame {links[frame.a]}",
                    found=f"{metres:.6g} m, bound {bound:.6g} m",
                    remedy="please report this as an error of urdfkin, with both robots",
                )
        return Confirmation(
            "confirmed", PINOCCHIO.name_and_version, CONFIRMATION_SAMPLES, float(distances.max(initial=0.0))
        )

    def pinocchio_distances(self, alignment: Alignment, variables: Variables) -> FloatArray:
        """Return the largest distance (frames,), m, that Pinocchio computes at random configurations."""
        search = self.search(alignment, variables)
        q_a, q_b = search.configurations(search.random_values(CONFIRMATION_SAMPLES), random_free_joints=True)
        distances = search.distances_at(q_a, q_b, alignment.frames, pinocchio_poses)
        return np.asarray(distances.max(axis=0, initial=0.0))


def _bound_of_verdict(result: Sameness) -> float | None:
    """Return the verdict's bound (m) on all distances; None if the models differ."""
    if result.verdict is Verdict.DIFFERS:
        return None
    if result.verdict is Verdict.UP_TO_SINGLE and result.single is not None:
        return result.single[0]
    return result.rounding[0]


def _largest(bounds: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return max((m for m, _ in bounds), default=0.0), max((r for _, r in bounds), default=0.0)


def _swap_pairs(names: Mapping[str, str]) -> dict[str, str]:
    return {theirs: ours for ours, theirs in names.items()}


def _iterate_travels(alignment: Alignment, variables: Variables) -> Iterator[tuple[MatchedJoints, float]]:
    """Yield each joint pair that can translate, and its travel (m), which is infinite without limits."""
    for step, pair in zip(alignment.steps, variables.pairs, strict=True):
        if step.kind in ("planar", "floating"):
            yield step, math.inf
        elif step.kind == "prismatic" and pair is not None:
            yield step, max(map(abs, variables.range(pair.a)))


def _joints_fixed_in_one(
    tree: KinematicTree,
    other_tree: KinematicTree,
    names: Mapping[str, str],
    labels: tuple[Sequence[str], Sequence[str]],
) -> set[int]:
    """Return the indices of the fixed joints of `tree` that move in `other_tree`.

    `names` maps joint names of `tree` to names of `other_tree`.
    """
    moves = tuple([joint.kind.nv > 0 for joint in one.joints] for one in (tree, other_tree))
    matching = _joints_with_moving_match((tree, other_tree), moves, names, labels)
    return {i for i in matching if not tree.joints[i].kind.nv}


def _fix_idle_mimic_joints(
    tree: KinematicTree,
    other_tree: KinematicTree,
    names: Mapping[str, str],
    labels: tuple[Sequence[str], Sequence[str]],
) -> KinematicTree:
    """Fix mimic joints with multiplier 0 at their offsets, unless the matching joint moves."""
    moves = tuple(
        [joint.kind.nv > 0 and not _is_idle_mimic_joint(joint) for joint in one.joints]
        for one in (tree, other_tree)
    )
    matching = _joints_with_moving_match((tree, other_tree), moves, names, labels)
    joints = tuple(
        Lock(joint, 0.0).make_fixed_joint() if _is_idle_mimic_joint(joint) and i not in matching else joint
        for i, joint in enumerate(tree.joints)
    )
    return tree if joints == tree.joints else replace(tree, joints=joints)


def _joints_with_moving_match(
    trees: tuple[KinematicTree, KinematicTree],
    moves: tuple[Sequence[bool], ...],
    names: Mapping[str, str],
    labels: tuple[Sequence[str], Sequence[str]],
) -> set[int]:
    """Return the indices of the joints of the first tree that match a moving joint of the second tree.

    Joints match by their names or by their child links. Moving joints with equal names do not match other
    joints by their child links.
    """
    own, other = ([joint.name for joint in tree.joints] for tree in trees)
    own = [names.get(name, name) for name in own]
    moving = tuple(
        {name for name, moved in zip(one, flags, strict=True) if moved}
        for one, flags in zip((own, other), moves, strict=True)
    )
    children = {
        labels[1][i + 1]: i for i, moved in enumerate(moves[1]) if moved and other[i] not in moving[0]
    }
    links_of_other = {label: link for link, label in enumerate(labels[1])}
    as_many = len(moving[0] - moving[1]) >= len(moving[1] - moving[0])

    def follows_match(i: int, match: int) -> bool:
        """Return whether a moving joint before joint `i` can match the joint `match`.

        Joint `i` is then an additional joint after this moving joint.
        """
        link = trees[0].joints[i].parent
        while True:
            same = links_of_other.get(labels[0][link])
            if same is not None and match not in trees[1].path(same):
                return False
            if not link:
                return False
            if moves[0][link - 1]:
                return as_many and own[link - 1] not in moving[1]
            link = trees[0].joints[link - 1].parent

    return {
        i
        for i, name in enumerate(own)
        if name in moving[1]
        or ((match := children.get(labels[0][i + 1])) is not None and not follows_match(i, match))
    }


def _is_idle_mimic_joint(joint: Joint) -> bool:
    return joint.mimic is not None and joint.mimic.multiplier == 0.0


def _match_usd_spellings(
    robots: tuple[Robot, Robot],
) -> tuple[tuple[Sequence[str], Sequence[str]], dict[str, str]]:
    """Match the names of a USD model and of another model, because USD changes the spelling of names.

    Returns:
        The link names of A and B in the original spelling, and a dict from joint names of A to those of B.
    """
    labels, joints = [list(robot.tree.links) for robot in robots], dict[str, str]()
    for k, own in enumerate(robots):
        other = robots[1 - k]
        if not is_usd(own.source) or is_usd(other.source):
            continue
        for link, name in _original_names(other.tree.links, own.tree.links).items():
            labels[k][own.tree.link_index(link)] = name
        names = [[joint.name for joint in robot.tree.joints] for robot in (other, own)]
        for joint, name in _original_names(*names).items():
            joints |= {name: joint} if k else {joint: name}
    return (labels[0], labels[1]), joints


def _original_names(names: Sequence[str], usd_names: Sequence[str]) -> dict[str, str]:
    """Map unambiguous USD spellings to original names."""
    known, originals = set(usd_names), dict[str, set[str]]()
    for name in names:
        if name not in known:
            for word in spellings(name) & known - set(names):
                originals.setdefault(word, set()).add(name)
    return {word: own.pop() for word, own in originals.items() if len(own) == 1}


def parse_joint_pairs(words: tuple[str, ...]) -> dict[str, str]:
    pairs = dict[str, str]()
    for word in words:
        ours, _, theirs = word.partition("=")
        if not ours or not theirs:
            raise InputError("a pair of joints is JOINT_OF_A=JOINT_OF_B", where="--map", found=repr(word))
        pairs[ours] = theirs
    return pairs


class JointComparison:
    """Prove joint by joint that single precision causes every difference.

    The rounding errors of all joints add up in a frame's pose. A comparison of frame poses can therefore miss
    a small wrong number. `JointComparison` allows each joint only the rounding errors of its own numbers.

    **Compared quantities.** Two files can describe the same joint by different frames, and can have different
    fixed links. The compared quantities do not depend on these choices:

        common link  a link of A with a matching link of B
        P            nearest ancestor of a common link in A that is also a common link

        for each common link, in the zero configuration, in the frame of P:
            pose of the link
            direction and line of the axis of each joint between P and the link
        multiplier and offset of each mimic rule

    By the product of exponentials, these quantities determine the poses of all common links in every
    configuration. `base_as_written` gives the pose of B's root. No joint direction, joint zero or tool frame
    is changed.

    **Bound.** Exact values have an asterisk.

        1 ... n      joints on the path from P to the link
        R_i, p_i     constant rotation and origin of joint i
        w_i, e_i     largest shift (m) and rotation (rad) of the frame after joint i, if the numbers of
                     joint i are rounded (`urdfkin.verify.usd_check.bound_single_precision_errors`)
        R            rotation of the frame before joint i
        W, E         position error (m) and rotation error (rad) of this frame

        angle of a product of rotations <= sum of their angles
        angle between R_1 ... R_n and R*_1 ... R*_n <= e_1 + ... + e_n

        R p_i - R* p*_i = (R - R*) p_i + R* (p_i - p*_i)
        position error of the frame after joint i <= W + E |p_i| + w_i

        axis of joint i: fixed in the frame after the joint, through the origin of this frame
        position error of the axis <= position error of this frame
        direction error of the axis <= rotation error of this frame

        relative error of a mimic multiplier or offset <= 2^-24

    *Branches.* In B, P may be on another branch than the link.

        C            last common ancestor of P and the link
        W, E         position and rotation error of the link relative to C
        V, F         position and rotation error of P relative to C
        d            distance between the link and P

        position error of the link relative to P <= W + V + F d
        rotation error of the link relative to P <= E + F

    *Sum.* `same` ignores the rounding errors of double precision.

        allowed difference = bound of A + bound of B + errors of double precision

    **Both orders.** The bound for a joint can contain the rounding of additional joints in B. Therefore,
    `same` compares A with B, and then B with A. If the first model is rounded, two conditions must hold:

    - The path from P to the link has at most one moving joint.
    - In the second model, the joints from C to P have no rounded numbers.

    **Limits of the proof.** A difference above the bound of its joint has another cause than rounding. A
    wrong number can also cause a difference below the bound. The proof has three conditions:

    - In A and in B, the same moving joints lead from P to the link, in the same order.
    - A planar or floating joint is attached to the root body, and is the only joint from P to the link.
    - The frames of a planar or floating joint agree in A and B up to double precision.

    If a link violates one of these conditions, `same` reports the link as not explained.

    Args:
        errors: Two (joints, 3) arrays, for A and for B. The columns are error bounds of position (m),
            rotation (rad) and mimic rule (relative). The bounds are 0 for double precision.
        base: (4, 4) pose of B's root in A's root frame.
    """

    def __init__(
        self,
        alignment: Alignment,
        errors: tuple[FloatArray, FloatArray],
        base: FloatArray,
        tolerance: Tolerance,
    ) -> None:
        self.alignment, self.errors, self.base, self.tolerance = alignment, errors, base, tolerance
        self.mechanisms = alignment.a, alignment.b
        self.trees = alignment.a.tree, alignment.b.tree
        self.pairs = {frame.a: frame.b for frame in alignment.frames}
        self.steps = {step.a: step for step in alignment.steps}
        root_of_b = next((a for a, b in self.pairs.items() if b == 0), 0)
        #: First links of the compared paths in A and B.
        self.start = (0, self.pairs[0]) if 0 in self.pairs else (root_of_b, 0)
        self.pairs[self.start[0]] = self.start[1]

    def differences(self) -> Iterator[JointDifference]:
        joints, links = self.trees[0].joints, self.trees[0].links
        starts = [m.zero_poses[link] for m, link in zip(self.mechanisms, self.start, strict=True)]
        if not all(self.tolerance.holds(*pose_difference(IDENTITY, T)) for T in (self.base, *starts)):
            yield JointDifference(f"link {links[self.start[0]]}", "base", None, "at another place")
        compared = set[int]()
        for link, other in sorted(self.pairs.items()):
            if (link, other) == self.start:
                continue
            reference, path = self._nearest_common_link(link)
            paths = self._paths(0, reference, link), self._paths(1, self.pairs[reference], other)
            yield from self._path_differences(link, paths)
            compared.update(path)
        for step in self.alignment.steps:
            yield from self._rule_differences(step)
            if step.a not in compared:
                why = "no link after this joint has a matching link in the other model"
                yield JointDifference(f"joint {joints[step.a].name}", "", None, why)

    def places_in_second_model(self) -> dict[str, str]:
        """Map each matched link and joint of the first model, for example "joint j", to its match.

        Fixed joints match if their child links match.
        """
        a, b = self.trees
        places = {f"link {a.links[link]}": f"link {b.links[other]}" for link, other in self.pairs.items()}
        for link, other in self.pairs.items():
            if link and other:
                places[f"joint {a.joints[link - 1].name}"] = f"joint {b.joints[other - 1].name}"
        for step in self.alignment.steps:
            places[f"joint {a.joints[step.a].name}"] = f"joint {b.joints[step.b].name}"
        return places

    def _nearest_common_link(self, link: int) -> tuple[int, list[int]]:
        """Return P and the joints from P to a link.

        If the link has no common ancestor link, P is `start[0]`.
        """
        joints, path = self.trees[0].joints, list[int]()
        while link:
            path.insert(0, link - 1)
            link = joints[link - 1].parent
            if link in self.pairs:
                return link, path
        return self.start[0], path

    def _paths(self, which: int, start: int, end: int) -> tuple[list[int], list[int]]:
        """Return the joints from the last common ancestor to `start`, and those to `end`."""
        paths = self.trees[which].path(start), self.trees[which].path(end)
        n = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(*paths, strict=False)))
        return list(paths[0][n:]), list(paths[1][n:])

    def _path_differences(
        self, link: int, paths: Sequence[tuple[list[int], list[int]]]
    ) -> Iterator[JointDifference]:
        trees = self.trees
        moving = [
            [[i for i in path if tree.joints[i].kind.nv] for path in paths_of_model]
            for tree, paths_of_model in zip(trees, paths, strict=True)
        ]
        steps = [self.steps.get(i) for i in moving[0][1]]
        name = f"link {trees[0].links[link]}"
        partners = [None if step is None or step.kind_difference else step.b for step in steps]
        if moving[0][0] or moving[1][0] or partners != moving[1][1]:
            yield JointDifference(name, "", None, "different joints carry this link in A and B")
            return
        # `paths[1][0]` contains the joints from C to P in B.
        if self.errors[0].any() and (len(steps) > 1 or self.errors[1][paths[1][0]].any()):
            yield JointDifference(
                name, "", None, "the joints between this link and the nearest common link cannot be compared"
            )
            return
        if any(step is not None and step.kind in ("planar", "floating") for step in steps):
            yield from self._free_joint_differences(name, [path for _, path in paths])
            return
        screws, poses, bounds = zip(
            *(self._screws_and_pose(k, *paths_of_model) for k, paths_of_model in enumerate(paths)),
            strict=True,
        )
        if not paths[0][0] and len(paths[0][1]) == 1:
            name = f"joint {trees[0].joints[link - 1].name}"
        origin = list(self._beyond_bound(name, "origin", *pose_difference(*poses), bounds[0] + bounds[1]))
        yield from origin
        for step in filter(None, steps):
            joint = f"joint {trees[0].joints[step.a].name}"
            pair, bound = zip(*(screws[k][i] for k, i in enumerate((step.a, step.b))), strict=True)
            axis = list(
                self._beyond_bound(joint, "axis", *self._axis_difference(step, *pair), bound[0] + bound[1])
            )
            # A wrong link origin also shifts the joint axis in the frame of P, but not in the link's frame.
            if axis and origin:
                pair = tuple(screw.transform(inverse(T)) for screw, T in zip(pair, poses, strict=True))
                axis = list(
                    self._beyond_bound(
                        joint, "axis", *self._axis_difference(step, *pair), sum(bound) + sum(bounds)
                    )
                )
            yield from axis

    def _axis_difference(self, step: MatchedJoints, axis_a: Screw, axis_b: Screw) -> tuple[float, float]:
        """Return the angle (rad) and the distance (m) between two axes.

        The distance is from the origin of one axis to the other axis.
        """
        ends = (axis_a, axis_b) if self.errors[0].any() else (axis_b, axis_a)
        return smallest_motion(*ends, turns=step.kind == "turns")[1:]

    def _screws_and_pose(
        self, which: int, back: Sequence[int], path: Sequence[int]
    ) -> tuple[Mapping[int, tuple[Screw, FloatArray]], FloatArray, FloatArray]:
        """Return the joint screws and the link pose in the frame of P.

        Args:
            which: 0 for A, 1 for B.
            back: Joints from C to P.
            path: Joints from C to the link.

        Returns:
            The screw and the error bounds (m, rad) of each joint of `path`; the link pose; and the error
            bounds (m, rad) of this pose.
        """
        joints = self.trees[which].joints
        T_common_P, P_errors = np.eye(4), np.zeros(2)
        for i in back:
            P_errors = self._errors_after(which, i, P_errors)
            T_common_P = T_common_P @ joints[i].T_parent_joint
        T, errors, T_P_common = np.eye(4), np.zeros(2), inverse(T_common_P)
        screws: dict[int, tuple[Screw, FloatArray]] = {}

        def errors_relative_to_P() -> FloatArray:
            lever = float(np.linalg.norm((T_P_common @ T)[:3, 3])) if back else 0.0
            return np.asarray(errors + P_errors + np.array([P_errors[1] * lever, 0.0]))

        for i in path:
            errors, T = self._errors_after(which, i, errors), T @ joints[i].T_parent_joint
            T_P_joint = T_P_common @ T
            screws[i] = Screw(T_P_joint[:3, :3] @ joints[i].axis, T_P_joint[:3, 3]), errors_relative_to_P()
        return screws, T_P_common @ T, errors_relative_to_P()

    def _errors_after(self, which: int, joint: int, errors: FloatArray) -> FloatArray:
        """Return (W + E |p_i| + w_i, E + e_i) in m and rad; `errors` is (W, E)."""
        metres, radians = self.errors[which][joint, :2]
        lever = self.trees[which].joints[joint].length
        return np.array([errors[0] + errors[1] * lever + metres, errors[1] + radians])

    def _beyond_bound(
        self, place: str, what: str, tilt: float, shift: float, bound: FloatArray
    ) -> Iterator[JointDifference]:
        metres, radians = bound.tolist()
        far, turned = shift > metres + self.tolerance.distance, tilt > radians + self.tolerance.angle
        if far or turned:
            sizes = size_words(shift if far else 0.0, tilt if turned else 0.0)
            explained = [length(metres)] * far + [angle(radians)] * turned if bound.any() else []
            yield JointDifference(place, what, None, sizes, " and ".join(explained))

    def _free_joint_differences(self, name: str, paths: Sequence[list[int]]) -> Iterator[JointDifference]:
        ends = list(zip(self.mechanisms, paths, strict=True))
        parents = [mechanism.tree.joints[path[0]].parent for mechanism, path in ends]
        bodies = [m.body_of[parent] for m, parent in zip(self.mechanisms, parents, strict=True)]
        if any(bodies) or not all(len(path) == 1 for path in paths):
            why = "urdfkin cannot compare the planar or floating joint that carries this link"
            yield JointDifference(name, "", None, why)
            return
        for T_a, T_b in (
            [mechanism.zero_poses[link] for (mechanism, _), link in zip(ends, parents, strict=True)],
            [mechanism.zero_poses[path[0] + 1] for mechanism, path in ends],
        ):
            if not self.tolerance.holds(*pose_difference(T_a, self.base @ T_b)):
                why = "the planar or floating joint that carries this link has different frames in A and B"
                yield JointDifference(name, "", None, why)

    def _rule_differences(self, step: MatchedJoints) -> Iterator[JointDifference]:
        a, b = self.trees[0].joints[step.a].mimic, self.trees[1].joints[step.b].mimic
        place = f"joint {self.trees[0].joints[step.a].name}"
        if a is None and b is None:
            return
        if a is None or b is None or self.alignment.names.get(a.mimicked_joint) != b.mimicked_joint:
            yield JointDifference(
                place, "mimic joint", *(rule.mimicked_joint if rule else "none" for rule in (a, b))
            )
            return
        relative_error = float(self.errors[0][step.a, 2] + self.errors[1][step.b, 2])
        for what in ("multiplier", "offset"):
            x, y = getattr(a, what), getattr(b, what)
            size = max(abs(x), abs(y))
            if abs(x - y) > relative_error * size + self.tolerance.angle * max(1.0, size):
                explained = f"{relative_error * size:.2g}" if relative_error else ""
                yield JointDifference(place, f"mimic {what}", x, y, explained)
