"""Decide whether two models are the same robot; the module contains the function `same` and its steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from urdfkin.comparison.bounds import MOST, DistanceSearch, pinocchios, tightened
from urdfkin.comparison.result import (
    BOUNDED,
    FREE,
    Confirmation,
    Interval,
    JointDifference,
    JointMap,
    Sameness,
    Tool,
    Verdict,
    demand_joint_names,
    differences,
    put_right,
    remarks,
)
from urdfkin.comparison.single import JointComparison
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import real_number, whole_number
from urdfkin.kinematics.roundings import EPS, SINGLE
from urdfkin.model.configuration import WIDEST, narrowed_ranges
from urdfkin.model.conventions.convention import spellings
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import (
    AS_WRITTEN,
    IDENTITY,
    Alignment,
    FramePair,
    Mechanism,
    Tolerance,
    Variables,
    apart,
    tolerance_of,
    variables_of,
)
from urdfkin.model.mechanisms.upper_bound import FINE, upper_bounds
from urdfkin.model.tree import FloatArray, Joint, KinematicTree, Lock, inverse
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.urdf.sources import Source, is_usd
from urdfkin.verify.oracles import PINOCCHIO
from urdfkin.verify.verifier import as_verify

#: Number of configurations at which Pinocchio checks the distances between matching frames.
CONFIRMED = 8
#: Number of frames among which the frame with the largest distance is searched.
#: These frames have the largest distances at random configurations.
FARTHEST = 4
#: Longest allowed path, metres; the squares of longer lengths would overflow.
LONGEST = 1e150
#: An upper bound of at most NEAR times the largest distance found needs no improvement.
NEAR = 1.05


def same(
    a: Robot | Source | DHTable,
    b: Robot | Source | DHTable,
    *,
    map: Mapping[str, str] | None = None,
    bounds: bool = True,
    boxes: int = MOST,
    within: float | None = None,
) -> Sameness:
    """Decide and prove whether two models move alike in every configuration.

    By the product of exponentials T(q) = exp(S_1 q_1) ... exp(S_n q_n) H, the motion of a link depends on the
    screws S_i of the joints and on the link's pose H in the zero configuration. If the screws and poses of
    two models agree, the models move alike for all q. The models may still have different base poses, fixed
    links, joint zeros, joint directions, names, coordinate orders and tool frames.

    Args:
        a: A robot, or a source for `load`.
        b: The other robot, or a source for `load`.
        map: For each joint name of `a`, the name of the matching joint in `b`. Give the pairs of joints that
            names and axes do not determine.
        bounds: Whether to bound the largest distances between frames. If the models differ, these bounds take
            most of the computing time.
        boxes: Largest number of boxes of configurations that exist at the same time in branch and bound.
            Boxes give sharper bounds if the models differ in many places. With 0, no boxes are used.
        within: Distance (metres and radians) that you will pass to `Sameness.within`. The boxes are then used
            to prove that all frames are within this distance.

    Returns:
        The verdict, the map of joints and links, the differences, and for every frame an interval that
        contains its largest distance over all configurations within limits.

    Raises:
        UrdfError: a model has errors.
        SourceError, UnknownNameError, InputError: as for `load`.

    Example:
        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur5_limited")
        >>> found.verdict.value, len(found.remarks)
        ('same', 5)
        >>> found = urdfkin.same("talos", "talos_reduced_corrected")
        >>> bool(found)
        False
    """
    robots = _robot(a), _robot(b)
    given = _parse_given_map(map)
    whole_number(boxes, "boxes", 0)
    if within is not None:
        within = real_number(within, "within")
    for which, robot, names in (("A", robots[0], list(given)), ("B", robots[1], list(given.values()))):
        demand_joint_names(robot.tree, names, which)
    # The copies protect the user's robots: a comparison stores many compiled trees in its robots.
    return Comparator((copy(robots[0]), copy(robots[1])), given, bounds, boxes, within).judged()


def _parse_given_map(given: Mapping[str, str] | None) -> dict[str, str]:
    """Return the user's map of joints; raise InputError if it does not map names to names."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or any(
        not isinstance(name, str) for pair in given.items() for name in pair
    ):
        raise InputError(
            "`map` is not a mapping of joint names",
            where="map",
            found=repr(given),
            remedy="give a dict from each joint name of A to a joint name of B",
        )
    return dict(given)


def _robot(source: Robot | Source | DHTable) -> Robot:
    return source if isinstance(source, Robot) else load(source)


class Comparator:
    """The comparison of two robots, step by step; `same` explains the arguments."""

    def __init__(
        self,
        robots: tuple[Robot, Robot],
        given: dict[str, str],
        bounds: bool,
        boxes: int = MOST,
        within: float | None = None,
    ) -> None:
        self.robots, self.given, self.bounds, self.boxes = robots, given, bounds, boxes
        self.within = within
        self.trees = a, b = robots[0].tree, robots[1].tree
        labels, self.spelled = _spelled_alike(robots)
        swapped = labels[1], labels[0]
        names = {**self.spelled, **given}
        trees = (
            _with_idle_joints_fixed(a, b, names, labels),
            _with_idle_joints_fixed(b, a, _reversed(names), swapped),
        )
        parting = (
            _fixed_here(*trees, self.spelled, labels),
            _fixed_here(trees[1], trees[0], _reversed(self.spelled), swapped),
        )
        self.mechanisms = (
            Mechanism(trees[0], parting[0], labels[0]),
            Mechanism(trees[1], parting[1], labels[1]),
        )
        for which, mechanism, robot in zip("AB", self.mechanisms, robots, strict=True):
            if not mechanism.size <= LONGEST:
                raise InputError(
                    f"a path from the root to a link is longer than {LONGEST:g} m: its square overflows",
                    where=f"model {which}, {robot.name}",
                    found=f"{mechanism.size:.6g} m",
                    remedy="write origins in metres",
                )
        self.tolerance: Tolerance = tolerance_of(*self.mechanisms)

    def judged(self) -> Sameness:
        """Return the complete result, with intervals and Pinocchio's confirmation."""
        found = self.alignment()
        self._check_map(found)
        variables = variables_of(found, self.tolerance)
        said = self.said(found, variables)
        frames = self._intervals(found, variables)
        as_written, most = None, said.written
        if self.bounds:
            most = _largest([(frame.upper, frame.radians) for frame in frames])
        if said.after and self.bounds:
            written = self.as_written(found)
            moving = variables_of(written, self.tolerance)
            as_written = self._farthest(written, moving)
            most = self._most(written, moving, as_written)
            if len(written.frames) < len(self._compared_links(found)):
                most = (math.inf, math.inf)
        checked = self._confirm(found, variables, frames)
        return replace(said, frames=frames, as_written=as_written, written=most, checked=checked)

    def alignment(self) -> Alignment:
        """Search for the alignment of B with A for which most joints and links agree."""
        return align(*self.mechanisms, {**self.spelled, **self.given})

    def said(self, found: Alignment, variables: Variables) -> Sameness:
        """Return the result without intervals and confirmation; set the tool frames in `found`."""
        names = tuple([joint.name for joint in tree.joints] for tree in self.trees)
        links = self.trees[0].links, self.trees[1].links
        tables = any(robot.origin.table for robot in self.robots)
        after = put_right(found, self.tolerance, tables=tables)
        free = {what for what, _ in after}
        wrong = differences(found, variables)
        single = self.single(found, variables)
        verdict = Verdict.DIFFERS if wrong else Verdict.SAME_AFTER if after else Verdict.SAME
        unexplained = () if verdict is Verdict.SAME else self.unexplained(found)
        if single is not None and verdict is not Verdict.SAME and not unexplained:
            verdict = Verdict.UP_TO_SINGLE if {one.what for one in wrong} <= BOUNDED else verdict
        return Sameness(
            names=(self.robots[0].name, self.robots[1].name),
            sources=(self.robots[0].source, self.robots[1].source),
            digests=(self.robots[0].sha256, self.robots[1].sha256),
            verdict=verdict,
            after=tuple(dict.fromkeys(words for _, words in after)),
            up_to=tuple(what for what in FREE if what in free),
            differences=wrong,
            remarks=remarks(
                found,
                variables,
                self.tolerance,
                SINGLE if single else 0.0,
                as_written=verdict is Verdict.UP_TO_SINGLE,
            ),
            joints=tuple(
                JointMap(names[0][s.a], names[1][s.b], s.sense, s.offset, s.conversion) for s in found.steps
            ),
            links=tuple((links[0][f.a], links[1][f.b]) for f in found.frames),
            tools=tuple(
                Tool(links[0][f.a], links[1][f.b], f.tool) for f in found.frames if f.tool is not IDENTITY
            ),
            orders=found.b.orders,
            base=found.X,
            base_links=(links[0][found.base[0]], links[1][found.base[1]]),
            rounding=self.rounding(found, variables),
            single=single,
            unexplained=unexplained,
            frames=(),
            as_written=None,
            written=(math.inf, math.inf),
            narrowed=tuple(
                f"{which}: {one}"
                for which, tree in zip("AB", self.trees, strict=True)
                for one in narrowed_ranges(tree)
            ),
            checked=Confirmation("not asked", reason="the bounds are not computed yet"),
            trees=self.trees,
        )

    def single(self, found: Alignment, variables: Variables) -> tuple[float, float] | None:
        """Bound the distance and angle (m, rad) between frames that single precision can cause, or None.

        The bound is the sum of the errors of both files and of the rounding errors of double precision.
        """
        if all(robot.single is None for robot in self.robots):
            return None
        most = np.array(self.rounding(found, variables))
        pairs = [(frame.a, frame.b) for frame in found.frames]
        off = np.zeros((len(pairs), 2))
        for which, robot in enumerate(self.robots):
            if robot.single is not None and pairs:
                off += robot.single.links[[pair[which] for pair in pairs]]
        metres, radians = (most + off.max(axis=0, initial=0.0)).tolist()
        return metres, radians

    def unexplained(self, found: Alignment) -> tuple[JointDifference, ...]:
        """Return the differences of the unchanged models that rounding does not explain, joint by joint.

        A is compared with B, and B with A, because the bounds differ (`urdfkin.comparison.single`).
        """
        off = [
            np.zeros((len(tree.joints), 3)) if robot.single is None else robot.single.joints
            for tree, robot in zip(self.trees, self.robots, strict=True)
        ]
        a, b = self.mechanisms
        unlike = tuple(
            JointComparison(found, (off[0], off[1]), base_as_written(a, b), self.tolerance).differences()
        )
        if unlike or not (off[0].any() or off[1].any()):
            return unlike
        back = align(b, a, {theirs: ours for ours, theirs in found.names.items()})
        other = JointComparison(back, (off[1], off[0]), base_as_written(b, a), self.tolerance)
        return tuple(one if one.a is None else replace(one, a=one.b, b=one.a) for one in other.differences())

    def as_written(self, found: Alignment) -> Alignment:
        """Return the alignment of the unchanged models, with the joint and link pairs of `found`.

        If one model is a Denavit-Hartenberg table, only links with equal names are compared, because the
        poses of the table's other links depend on its convention.
        """
        a, b = self.mechanisms
        gauge = replace(AS_WRITTEN, X=base_as_written(a, b), orders=found.b.orders)
        written = align(a, b, found.names, gauge)
        written.frames = written.frames_of(self._compared_links(found))
        return written

    def _compared_links(self, found: Alignment) -> list[tuple[int, int]]:
        tables = any(robot.origin.table for robot in self.robots)
        links = self.trees[0].links, self.trees[1].links
        pairs = ((frame.a, frame.b) for frame in found.frames)
        return [(a, b) for a, b in pairs if not tables or links[0][a] == links[1][b]]

    def _check_map(self, found: Alignment) -> None:
        made = found.names
        for ours, theirs in self.given.items():
            if made.get(ours) != theirs:
                raise InputError(
                    "these joints cannot be matched: their parent links are not matched",
                    where="map",
                    found=f"{ours!r} of A, {theirs!r} of B",
                    remedy="also map the joints before these joints, or remove this pair",
                )

    def search(self, found: Alignment, variables: Variables, *, as_written: bool = False) -> DistanceSearch:
        return DistanceSearch(self.robots, found, variables, as_written=as_written)

    def rounding(self, found: Alignment, variables: Variables) -> tuple[float, float]:
        """Bound the distance and the angle (m, rad) between two frames that differ only by rounding.

        `same` ignores a small rounding difference at each joint, and these differences add up along the path.
        For a joint without limits, the sum uses the range in which the joint is sampled.
        """
        ways = [
            max(abs(end) for end in ends)
            for step, pair in zip(found.steps, variables.pairs, strict=True)
            if pair is not None and step.kind == "prismatic"
            if math.isfinite(sum(ends := variables.range(pair.a)))
        ]
        ways += [WIDEST for step in found.steps if step.kind in ("planar", "floating")]
        reach = max(self.mechanisms[0].size, self.mechanisms[1].size) + sum(ways)
        slides, turns = (
            sum(
                pair.rounding
                for step, pair in zip(found.steps, variables.pairs, strict=True)
                if pair is not None and (step.kind == "prismatic") is slide
            )
            for slide in (True, False)
        )
        way, angle = found.deepest * self.tolerance.way, found.deepest * self.tolerance.angle + turns
        return way + slides + angle * reach, angle

    def _intervals(self, found: Alignment, variables: Variables) -> tuple[Interval, ...]:
        frames = found.frames
        metres, radians = self.rounding(found, variables)
        if not self.bounds:
            return ()
        uppers = self._uppers(found, variables)
        off = [k for k, upper in enumerate(uppers) if max(upper) > 0.0]
        search = self.search(found, variables)
        seen = dict(zip(off, search.worst([frames[k] for k in off]), strict=True)) if off else {}
        self._sharpen(uppers, frames, search, NEAR * max((way for way, _ in seen.values()), default=0.0))
        return tuple(
            self._interval(found, frame, search, seen.get(k), (uppers[k][0] + metres, uppers[k][1] + radians))
            for k, frame in enumerate(frames)
        )

    def _most(
        self, written: Alignment, variables: Variables, farthest: Interval | None
    ) -> tuple[float, float]:
        """Return one bound (m, rad) for all frames; improve it only if it can then prove `within`."""
        search = self.search(written, variables, as_written=True)
        if search.unbounded:
            return math.inf, math.inf
        metres, radians = self.rounding(written, variables)
        uppers = self._uppers(written, variables)
        target = 0.0 if self.within is None else self.within - metres
        if farthest is not None and farthest.lower <= target:
            self._sharpen(uppers, written.frames, search, target)
        most = _largest(uppers)
        return most[0] + metres, most[1] + radians

    def _uppers(self, found: Alignment, variables: Variables) -> list[tuple[float, float]]:
        """Return the bound (m, rad) of each frame; the largest bounds are computed on a finer grid."""
        frames = found.frames
        uppers = [upper_bounds(found, variables, frame) for frame in frames]
        off = [k for k, upper in enumerate(uppers) if max(upper) > 0.0]
        fine = set[int]()
        while len(fine) < FARTHEST and off and (widest := max(off, key=lambda k: uppers[k])) not in fine:
            uppers[widest] = upper_bounds(found, variables, frames[widest], FINE)
            fine.add(widest)
        return uppers

    def _sharpen(
        self,
        uppers: list[tuple[float, float]],
        frames: Sequence[FramePair],
        search: DistanceSearch,
        target: float,
    ) -> None:
        """Prove with boxes that no two matching frames are farther apart than a target (m)."""
        for _ in uppers:
            widest = max(range(len(uppers)), key=lambda k: uppers[k])
            if uppers[widest][0] <= target:
                break
            sharper = tightened(search, frames[widest], target, uppers[widest][0], self.boxes)
            uppers[widest] = sharper, uppers[widest][1]
            if sharper > target:
                break

    def _farthest(self, found: Alignment, variables: Variables) -> Interval | None:
        """Search for the frame with the largest distance between A and B, and return its interval."""
        if not found.frames:
            return None
        metres, radians = self.rounding(found, variables)
        search = self.search(found, variables, as_written=True)
        off = search.seen(found.frames)[0].max(axis=0)
        far = [found.frames[k] for k in np.argsort(-off, kind="stable")[:FARTHEST]]
        if off.max() <= metres:  # no position differs, so the frame with the largest angle counts
            far = [max(found.frames, key=lambda frame: upper_bounds(found, variables, frame)[1])]
        climbed = zip(search.worst(far), far, strict=True)
        seen, frame = max(climbed, key=lambda both: both[0][0])
        upper = (math.inf, math.inf) if search.unbounded else upper_bounds(found, variables, frame, FINE)
        return self._interval(found, frame, search, seen, (upper[0] + metres, upper[1] + radians))

    def _interval(
        self,
        found: Alignment,
        frame: FramePair,
        search: DistanceSearch,
        seen: tuple[float, FloatArray] | None,
        upper: tuple[float, float],
    ) -> Interval:
        names = self.trees[0].links[frame.a], self.trees[1].links[frame.b]
        if seen is None:
            return Interval(*names, 0.0, *upper, 0.0, (), ())
        metres, z = seen
        rounding = self.rounding(found, search.variables)
        if metres <= rounding[0] and upper[1] > rounding[1]:
            z = search.most_turned(frame)
        poses = search.poses(z[np.newaxis], [frame])
        turned = apart(poses[0][0, 0], poses[1][0, 0])[0]
        q_a, q_b = search.configurations(z[np.newaxis])
        lower = max(0.0, metres - rounding[0])
        return Interval(*names, lower, *upper, turned, tuple(q_a[0].tolist()), tuple(q_b[0].tolist()))

    def _confirm(self, found: Alignment, variables: Variables, frames: tuple[Interval, ...]) -> Confirmation:
        """Check the bounds with Pinocchio, which reads the texts of A and B with its own parser."""
        if not all(as_verify(robot.verifier.policy) for robot in self.robots):
            return Confirmation("not asked", reason="loaded with verify=False")
        for robot in self.robots:
            if (reason := robot.verifier.cannot()) is not None:
                return Confirmation("not verified", reason=reason)
        off = self.pinocchio_distances(found, variables)
        for interval, metres in zip(frames, off, strict=False):
            if not metres <= interval.upper * (1.0 + EPS):
                raise UrdfkinError(
                    "Pinocchio finds a distance beyond its proven bound",
                    where=f"frame {interval.frame}",
                    found=f"{metres:.6g} m, bound {interval.upper:.6g} m",
                    remedy="please report this as an error of urdfkin, with both robots",
                )
        return Confirmation("confirmed", PINOCCHIO.words, CONFIRMED, float(off.max(initial=0.0)))

    def pinocchio_distances(self, found: Alignment, variables: Variables) -> FloatArray:
        """Return each frame's largest distance (m) at `CONFIRMED` configurations, by Pinocchio."""
        search = self.search(found, variables)
        q_a, q_b = search.configurations(search.random(CONFIRMED), moved=True)
        return np.asarray(search.at(q_a, q_b, found.frames, pinocchios).max(axis=0, initial=0.0))


def _largest(bounds: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return max((way for way, _ in bounds), default=0.0), max((turn for _, turn in bounds), default=0.0)


def _reversed(names: Mapping[str, str]) -> dict[str, str]:
    return {theirs: ours for ours, theirs in names.items()}


def _fixed_here(
    tree: KinematicTree,
    other: KinematicTree,
    names: Mapping[str, str],
    labels: tuple[Sequence[str], Sequence[str]],
) -> set[int]:
    """Return the fixed joints of a tree that are moving joints in the other tree.

    Two joints match if they have the same name, or if their child links have the same label. `names` maps the
    name of a joint to its different name in the other tree. `labels` has a label for each link of both trees.
    """
    moving = {joint.name for joint in other.joints if joint.kind.nv}
    ours = {names.get(joint.name, joint.name) for joint in tree.joints if joint.kind.nv}
    children = {
        labels[1][i + 1] for i, joint in enumerate(other.joints) if joint.kind.nv and joint.name not in ours
    }
    return {
        i
        for i, joint in enumerate(tree.joints)
        if not joint.kind.nv and (names.get(joint.name, joint.name) in moving or labels[0][i + 1] in children)
    }


def _with_idle_joints_fixed(
    tree: KinematicTree,
    other: KinematicTree,
    names: Mapping[str, str],
    labels: tuple[Sequence[str], Sequence[str]],
) -> KinematicTree:
    """Return a tree in which mimic joints with the multiplier 0 are fixed joints at the rule's offset.

    A joint with the multiplier 0 never moves. The joint remains a mimic joint if the other model has a
    matching joint (as in `_fixed_here`) that moves: then `same` compares the two joints.
    """
    moves = [joint.kind.nv > 0 and not _never_moves(joint) for joint in other.joints]
    moving = {joint.name for joint, moved in zip(other.joints, moves, strict=True) if moved}
    children = {labels[1][i + 1] for i, moved in enumerate(moves) if moved}
    joints = tuple(
        Lock(joint, 0.0).fixed()
        if _never_moves(joint)
        and not (names.get(joint.name, joint.name) in moving or labels[0][i + 1] in children)
        else joint
        for i, joint in enumerate(tree.joints)
    )
    return tree if joints == tree.joints else replace(tree, joints=joints)


def _never_moves(joint: Joint) -> bool:
    return joint.mimic is not None and joint.mimic.multiplier == 0.0


def _spelled_alike(
    robots: tuple[Robot, Robot],
) -> tuple[tuple[Sequence[str], Sequence[str]], dict[str, str]]:
    """Return link labels of two models, and pairs of joints whose names differ only by USD's spelling.

    USD does not allow all names, so a USD file spells some names differently. Such a name is matched to a
    name of the other model, unless a second name of the other model has the same spelling.
    """
    labels, joints = [list(robot.tree.links) for robot in robots], dict[str, str]()
    for k, own in enumerate(robots):
        other = robots[1 - k]
        if not is_usd(own.source) or is_usd(other.source):
            continue
        for link, name in _originals(other.tree.links, own.tree.links).items():
            labels[k][own.tree.link_index(link)] = name
        names = [[joint.name for joint in robot.tree.joints] for robot in (other, own)]
        for joint, name in _originals(*names).items():
            joints |= {name: joint} if k else {joint: name}
    return (labels[0], labels[1]), joints


def _originals(names: Sequence[str], spelt: Sequence[str]) -> dict[str, str]:
    """Map each name that the USD file spells differently to the original name in `names`."""
    known, found = set(spelt), dict[str, set[str]]()
    for name in names:
        if name not in known:
            for word in spellings(name) & known - set(names):
                found.setdefault(word, set()).add(name)
    return {word: own.pop() for word, own in found.items() if len(own) == 1}


def base_as_written(a: Mechanism, b: Mechanism) -> FloatArray:
    """Return the pose (4, 4) of B's root in A's root frame, if the two models are not changed.

    If the root body of one model has a link with the name of the other model's root, these two links
    coincide. Otherwise, the two roots coincide.
    """
    if (root := a.labels[0]) in b.labels and not b.body_of[link := b.labels.index(root)]:
        return inverse(b.homes[link])
    if (root := b.labels[0]) in a.labels and not a.body_of[link := a.labels.index(root)]:
        return a.homes[link]
    return IDENTITY


def parse_map(words: tuple[str, ...]) -> dict[str, str]:
    """Parse words of the form NAME=NAME; raise InputError for a word of another form."""
    pairs = dict[str, str]()
    for word in words:
        ours, _, theirs = word.partition("=")
        if not ours or not theirs:
            raise InputError("a pair of joints is JOINT_OF_A=JOINT_OF_B", where="--map", found=repr(word))
        pairs[ours] = theirs
    return pairs
