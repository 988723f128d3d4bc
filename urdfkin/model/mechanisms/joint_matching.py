"""Find joints of two mechanisms that may correspond, and poses and zero offsets that align their axes.

The joints at two matched bodies are paired in three steps. First, joints are paired by the names that the
user gives, or by equal names. Second, two joints are paired if the bodies after the joints contain links with
equal labels. By default, a link's label is the link's name. Third, the remaining joints of the same kind are
paired by geometry, the most similar joints first.

Two subtrees match exactly if suitable zero offsets make every axis of one subtree coincide with an axis of
the other subtree. The zero offsets must also make links with equal labels coincide. The multipliers of the
mimic rules must correspond; the method `SubtreeMatcher.ignore_mimic_rules` removes this condition.

The value of the joint before a subtree does not matter, because the joint's zero offset can compensate any
value. Therefore, the result of a comparison depends on two things only: the two joints before the subtrees,
and the pose of B's joint axis relative to A's joint axis. `SubtreeMatcher` stores the result of each
comparison, so that the search is fast even for long chains.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import pi, remainder
from typing import TypeVar

import numpy as np

from urdfkin.kinematics.rotation import exp_rotation, log_rotation, skew
from urdfkin.model.chain import MIN_ROBOT_SIZE
from urdfkin.model.mechanisms.mechanism import (
    IDENTITY,
    PARALLEL_TOLERANCE,
    Alignment,
    AlignmentChoices,
    Edge,
    FreeJointConversion,
    MatchedJoints,
    Mechanism,
    Screw,
    Tolerance,
    angle_from_to,
    line_difference,
    nearest_planar_pose,
    out_of_plane_compensation,
    pose_difference,
    screw_motion,
    size_of,
    smallest_motion,
)
from urdfkin.model.tree import FloatArray, JointKind, inverse, pose

EdgePair = tuple[Edge, Edge]
PreviousEdges = tuple[Edge | None, Edge | None]


def motion_type(kind: JointKind) -> str:
    return "turns" if kind.turns else str(kind.value)


class JointMatcher:
    """Find corresponding joints of two mechanisms.

    `name_map` maps joint names of A to joint names of B.
    """

    def __init__(self, a: Mechanism, b: Mechanism, name_map: Mapping[str, str], tolerance: Tolerance) -> None:
        self.a, self.b, self.name_map, self._tolerance = a, b, name_map, tolerance
        self._named = {name for pair in name_map.items() for name in pair}
        self._subtree_shapes: dict[tuple[bool, int, int], str] = {}
        self._links: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {}
        self._by_names = dict[
            tuple[tuple[int, int], PreviousEdges], tuple[Sequence[EdgePair], Sequence[Edge], Sequence[Edge]]
        ]()

    def link_pairs(self, body_a: int, body_b: int) -> tuple[tuple[int, int], ...]:
        if (known := self._links.get((body_a, body_b))) is None:
            links_b = {self.b.labels[link]: link for link in self.b.bodies[body_b]}
            known = self._links[body_a, body_b] = tuple(
                (link, links_b[name])
                for link in self.a.bodies[body_a]
                if (name := self.a.labels[link]) in links_b
            )
        return known

    def pair_joints(
        self, bodies: tuple[int, int], via: PreviousEdges, motion_a: FloatArray, motion_b: FloatArray
    ) -> tuple[Sequence[EdgePair], Sequence[Edge], Sequence[Edge]]:
        """Return joint pairs at two bodies, unpaired joints of A, and unpaired joints of B.

        `BodyPair` describes the arguments.
        """
        named, unpaired_a, unpaired_b = self.pair_by_name(bodies, via)
        pairs = list(named)
        ranked = sorted(
            (self._dissimilarity(one, other), i, j)
            for i, one in self._geometries(self.a, bodies[0], unpaired_a, motion_a)
            for j, other in self._geometries(self.b, bodies[1], unpaired_b, motion_b)
            if one.kind == other.kind
        )
        taken_a, taken_b = set[int](), set[int]()
        for _, i, j in ranked:
            if i not in taken_a and j not in taken_b:
                pairs.append((unpaired_a[i], unpaired_b[j]))
                taken_a.add(i)
                taken_b.add(j)
        return (
            pairs,
            [edge for i, edge in enumerate(unpaired_a) if i not in taken_a],
            [edge for j, edge in enumerate(unpaired_b) if j not in taken_b],
        )

    def pair_by_name(
        self, bodies: tuple[int, int], via: PreviousEdges
    ) -> tuple[Sequence[EdgePair], Sequence[Edge], Sequence[Edge]]:
        if (known := self._by_names.get((bodies, via))) is None:
            left_a = [edge for edge in self.a.edges_by_body[bodies[0]] if edge is not via[0]]
            left_b = [edge for edge in self.b.edges_by_body[bodies[1]] if edge is not via[1]]
            pairs = list[EdgePair]()
            for e, f in self._name_pairs(bodies, list(left_a), list(left_b)):
                if e in left_a and f in left_b:
                    pairs.append((e, f))
                    left_a.remove(e)
                    left_b.remove(f)
            known = self._by_names[bodies, via] = pairs, left_a, left_b
        return known

    def has_same_shape(self, bodies: tuple[int, int], via: PreviousEdges) -> bool:
        shapes = (
            sorted(self._subtree_shape(m, body, edge) for edge in m.edges_by_body[body] if edge is not by)
            for m, body, by in zip((self.a, self.b), bodies, via, strict=True)
        )
        return next(shapes) == next(shapes)

    def have_equal_subtrees(self, bodies: tuple[int, int], e: Edge, f: Edge) -> bool:
        return self._subtree_shape(self.a, bodies[0], e) == self._subtree_shape(self.b, bodies[1], f)

    def all_axes_coincide(self, bodies: tuple[int, int], X: FloatArray) -> bool:
        """Return whether each joint axis at A's body coincides with a joint axis at B's body.

        X (4, 4) moves B before the comparison.
        """
        return all(
            any(
                motion_type(self.a.joint(e).kind) == motion_type(self.b.joint(f).kind)
                and self._tolerance.holds(*self.mismatch(e, f, IDENTITY, X))
                for f in self.b.edges_by_body[bodies[1]]
            )
            for e in self.a.edges_by_body[bodies[0]]
            if _has_direction(self.a, e)
        )

    def rank_candidates(
        self, bodies: tuple[int, int], e: Edge, edges: Sequence[Edge], X: FloatArray
    ) -> list[Edge]:
        """Return the joints in `edges` that are not in `name_map`, the joint most similar to `e` first.

        `e` is a joint of A, and `edges` are joints of B. X (4, 4) moves B before the comparison.
        """
        one = self._geometries(self.a, bodies[0], [e], IDENTITY)
        others = self._geometries(self.b, bodies[1], edges, X)
        ranked = sorted((self._dissimilarity(one[0][1], other), j) for j, other in others) if one else []
        return [edges[j] for _, j in ranked]

    def _name_pairs(
        self, bodies: tuple[int, int], edges_a: list[Edge], edges_b: list[Edge]
    ) -> Iterator[EdgePair]:
        by_name = {self.b.joint(f).name: f for f in edges_b}
        for e in edges_a:
            name = self.a.joint(e).name
            if (f := by_name.get(self.name_map.get(name, name))) is not None:
                yield e, f
        for e in edges_a:
            links = {self.a.labels[k] for k in self.a.bodies[e.other_body(bodies[0])]}
            for f in edges_b:
                if links & {self.b.labels[k] for k in self.b.bodies[f.other_body(bodies[1])]}:
                    yield e, f

    def _geometries(
        self, mechanism: Mechanism, body: int, edges: Sequence[Edge], T: FloatArray
    ) -> list[tuple[int, _JointGeometry]]:
        return [
            (i, _JointGeometry.of(mechanism, edge, T, self._subtree_shape(mechanism, body, edge)))
            for i, edge in enumerate(edges)
            if mechanism.joint(edge).name not in self._named
        ]

    def _dissimilarity(self, one: _JointGeometry, other: _JointGeometry) -> tuple[bool, float, float]:
        angle, shift = one.mismatch(other)
        axes = (
            0.0 if self._tolerance.holds(angle, shift) else angle * max(self.a.size, MIN_ROBOT_SIZE) + shift
        )
        origins = math.dist(one.origin, other.origin)
        is_opposite = bool(one.screw.direction @ other.screw.direction < 0.0)
        return one.subtree_shape != other.subtree_shape, axes, origins + self.a.size * is_opposite

    def _subtree_shape(self, mechanism: Mechanism, body: int, edge: Edge) -> str:
        key = mechanism is self.a, body, edge.joint
        if (known := self._subtree_shapes.get(key)) is None:
            next_body = edge.other_body(body)
            below = sorted(
                self._subtree_shape(mechanism, next_body, other)
                for other in mechanism.edges_by_body[next_body]
                if other is not edge
            )
            known = f"({motion_type(mechanism.joint(edge).kind)}{''.join(below)})"
            self._subtree_shapes[key] = known
        return known

    def mismatch(self, e: Edge, f: Edge, motion_a: FloatArray, motion_b: FloatArray) -> tuple[float, float]:
        """Return the angle (rad) and the distance (m) between the axes of two joints.

        | Joints | Angle | Distance |
        |---|---|---|
        | revolute | between the axes | between the axes |
        | prismatic | between the axes | 0 |
        | planar | between the normals | 0 |
        | floating, or of different kinds | 0 | 0 |
        """
        kind = motion_type(self.a.joint(e).kind)
        if kind != motion_type(self.b.joint(f).kind):
            return 0.0, 0.0
        return _line_difference(
            kind, self.a.screw(e).transform(motion_a), self.b.screw(f).transform(motion_b)
        )


@dataclass(frozen=True, slots=True, eq=False)
class _JointGeometry:
    kind: str
    subtree_shape: str
    screw: Screw
    origin: list[float]

    @classmethod
    def of(cls, mechanism: Mechanism, edge: Edge, T: FloatArray, subtree_shape: str = "") -> _JointGeometry:
        pose = T @ mechanism.zero_poses[edge.joint + 1]
        screw = mechanism.screw(edge).transform(T)
        return cls(motion_type(mechanism.joint(edge).kind), subtree_shape, screw, pose[:3, 3].tolist())

    def mismatch(self, other: _JointGeometry) -> tuple[float, float]:
        return _line_difference(self.kind, self.screw, other.screw)


def _line_difference(kind: str, s: Screw, t: Screw) -> tuple[float, float]:
    if kind == "floating":  # any two floating joints agree, because a floating joint reaches every pose
        return 0.0, 0.0
    return line_difference(s, t, with_distance=kind == "turns")


_Some = TypeVar("_Some")
Both = tuple[_Some, _Some]


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A joint's axis in the zero configuration.

    `reference_line` is usually the previous joint's axis.
    The axis of a prismatic joint has no position.
    """

    screw: Screw
    turns: bool
    reference_line: Screw
    #: Whether a planar joint can rotate the axis about the reference line.
    behind_plane: bool = False

    def transform(self, T: FloatArray) -> Axis:
        return replace(self, screw=self.screw.transform(T), reference_line=self.reference_line.transform(T))

    def nearest_point_coordinate(self, u: FloatArray) -> float | None:
        """Return the coordinate along u (m) of the reference line's point that is nearest to the axis.

        The result is None for prismatic joints and parallel lines.
        """
        s, start = self.screw, self.reference_line
        # A formula with 1 - cos^2 of the angle loses all digits at angles below 1e-8.
        normal = np.cross(start.direction, s.direction)
        squared_sine = float(normal @ normal)
        if not self.turns or squared_sine < PARALLEL_TOLERANCE**2:
            return None
        distance = float(np.cross(s.point - start.point, s.direction) @ normal) / squared_sine
        return float(u @ (start.point + distance * start.direction))


def zero_candidates(u: Screw, axis_a: Axis, axis_b: Axis, turns: bool) -> Iterator[float]:
    """Yield values (rad or m) of the joint with axis u at which `axis_b` may coincide with `axis_a`."""
    if not turns:
        coordinates = (
            axis_a.nearest_point_coordinate(u.direction),
            axis_b.nearest_point_coordinate(u.direction),
        )
        if coordinates[0] is not None and coordinates[1] is not None:
            yield coordinates[0] - coordinates[1]
        return
    if axis_a.behind_plane:
        return
    s, t = axis_a.screw, axis_b.screw
    candidate = angle_from_to(u.direction, t.direction, s.direction)
    if candidate is not None:
        yield candidate
        yield remainder(candidate + pi, 2.0 * pi)
    if axis_a.turns:
        perpendiculars = [
            line.point - line.direction * (line.direction @ (line.point - u.point)) for line in (t, s)
        ]
        candidate = angle_from_to(u.direction, perpendiculars[0] - u.point, perpendiculars[1] - u.point)
        if candidate is not None:
            yield candidate


#: Two axes are nearly parallel if the sine of their angle is below this value. An error of one axis can then
#: move the nearest points of the axes by more than 100 times the error.
_NEARLY_PARALLEL_SINE = 1e-2


def later_axes(
    mechanisms: Both[Mechanism],
    via: Both[Edge | None],
    bodies: Both[int],
    reference_line: Both[Screw],
    *,
    past_prismatic: bool = False,
    behind_plane: bool = False,
) -> Iterator[Both[Axis]]:
    """Yield pairs of axes of A and B after the joints `via`.

    A branch ends at the first axis that is not nearly parallel to `reference_line[0]`, because nearly
    parallel axes determine zero offsets inexactly. With `past_prismatic`, the branch continues after such an
    axis if the joint is prismatic, because a prismatic axis has no position. Behind a planar joint, the axes
    determine only heights above its plane.
    """
    behind_plane |= via[0] is not None and _motion_type(mechanisms[0], via[0]) == "planar"
    for e, f in _next_joints(mechanisms, via, bodies):
        axes = (
            replace(_axis(mechanisms[0], e, reference_line[0]), behind_plane=behind_plane),
            replace(_axis(mechanisms[1], f, reference_line[1]), behind_plane=behind_plane),
        )
        yield axes
        screws = axes[0].screw, axes[1].screw
        sine = np.linalg.norm(np.cross(screws[0].direction, reference_line[0].direction))
        passes = past_prismatic and _motion_type(mechanisms[0], e) == "prismatic"
        if sine < _NEARLY_PARALLEL_SINE or passes:
            next_bodies = e.other_body(bodies[0]), f.other_body(bodies[1])
            yield from later_axes(
                mechanisms,
                (e, f),
                next_bodies,
                screws if axes[0].turns else reference_line,
                past_prismatic=past_prismatic,
                behind_plane=behind_plane,
            )


#: Maximum number of Gauss-Newton steps. Two steps are usually enough. If axes are parallel up to 1e-8 rad,
#: more steps are necessary, and one step can change an angle by 1 rad.
_REFINEMENT_STEPS = 10
#: The fit stops if |step| (rad, m) is below this value.
_NEGLIGIBLE_CHANGE = 1e-14


def refine_choices(alignment: Alignment, *, with_links: bool) -> AlignmentChoices:
    """Solve for B's root pose, all zero offsets and all conversions together.

    With the solution, all axes of B coincide with axes of A. `MechanismMatcher` finds one zero offset after
    another. This fails if an axis depends on two unknown offsets, or if nearly parallel axes magnify the
    rounding error of an offset.

    Args:
        alignment: The joints of each pair have the same kind.
        with_links: Whether matched links of B must also coincide with links of A.
    """
    size, steps = size_of(alignment.a, alignment.b), _refined_steps(alignment)
    turns = np.array([turning for step in steps for _, turning in step.screws])
    # A rotation of 1 rad and a shift by `size` displace links by about the same distance.
    scales = np.concatenate(([1.0] * 3, [size] * 3, np.where(turns, 1.0, size)))
    X, values = alignment.X, np.concatenate([step.values for step in steps])
    for _ in range(_REFINEMENT_STEPS):
        r, J, _ = _errors(alignment, steps, X, values, size, with_links=with_links)
        change = scales * np.linalg.lstsq(J * scales, -r, rcond=None)[0]
        X, values = pose(exp_rotation(change[:3]), change[3:6]) @ X, values + change[6:]
        if np.abs(change).max() < _NEGLIGIBLE_CHANGE:
            break
        # If two axes nearly coincide, a step can add many turns. Large angles have large rounding errors.
        values = np.where(turns & (np.abs(values) > pi), np.remainder(values + pi, 2.0 * pi) - pi, values)
    motions = _errors(alignment, steps, X, values, size, with_links=with_links)[2]
    joints, k = alignment.a.tree.joints, 0
    zeros, conversions = dict[str, tuple[int, float]](), dict[str, FreeJointConversion]()
    for one, refined, motion in zip(alignment.steps, steps, motions, strict=True):
        if refined.kind is None:
            zeros[joints[one.a].name] = one.sense, float(values[k])
        else:
            before = motions[one.previous] if one.previous >= 0 else X
            conversions[joints[one.a].name] = _conversion(alignment, one, refined, before, motion)
        k += len(refined.screws)
    return replace(alignment.choices, X=X, zeros=zeros, conversions=conversions)


@dataclass(frozen=True, slots=True, eq=False)
class _RefinedStep:
    """A joint of B in a fit. It moves B's later bodies by `start @ exp(S_1 v_1) ... exp(S_k v_k)`.

    Attributes:
        kind: Planar or floating; None for a joint with one zero offset.
        is_reversed: Whether the path crosses the joint from child to parent.
        start: (4, 4) motion before the screws, in B's root frame.
        screws: The screws S in B's root frame, and whether each screw is a rotation.
        values: (k,) values v at the start of the fit.
    """

    edge: Edge
    kind: JointKind | None
    is_reversed: bool
    start: FloatArray
    screws: Sequence[tuple[Screw, bool]]
    values: FloatArray


def _refined_steps(alignment: Alignment) -> list[_RefinedStep]:
    b, found = alignment.b, list[_RefinedStep]()
    edges = {edge.joint: edge for edge in b.edges}
    for step in alignment.steps:
        edge = edges[step.b]
        if step.previous >= 0:
            previous = found[step.previous]
            body = previous.edge.inner if previous.is_reversed else previous.edge.outer
        else:
            body = b.body_of[alignment.base[1]]
        back = edge.outer == body
        if step.kind in ("turns", "prismatic"):
            screw = b.screw(edge).reverse() if back else b.screw(edge)
            screws, values = [(screw, step.kind == "turns")], np.array([step.offset])
            found.append(_RefinedStep(edge, None, back, IDENTITY, screws, values))
            continue
        T, P = b.zero_poses[edge.joint + 1], IDENTITY
        if step.conversion is not None:
            P = step.conversion.before @ step.conversion.behind
            P = inverse(P) if back else P
        x, y, z = (Screw(T[:3, i], T[:3, 3]) for i in range(3))
        screws = [(x, False), (y, False), (z, True)]
        if step.kind == "floating":
            screws += [(z, False), (y, True), (x, True)]
        start, kind = T @ P @ inverse(T), JointKind(step.kind)
        found.append(_RefinedStep(edge, kind, back, start, screws, np.zeros(len(screws))))
    return found


def _conversion(
    alignment: Alignment, step: MatchedJoints, refined: _RefinedStep, before: FloatArray, after: FloatArray
) -> FreeJointConversion:
    """Return the conversion of a planar or floating joint.

    `before` and `after` (4, 4) move the bodies before and after B's joint.
    """
    pose_a, zero_pose_b = alignment.a.zero_poses[step.a + 1], alignment.b.zero_poses[refined.edge.joint + 1]
    M, N = inverse(before @ zero_pose_b) @ pose_a, inverse(pose_a) @ after @ zero_pose_b
    if refined.kind is JointKind.PLANAR:
        compensation = out_of_plane_compensation(M)
        N = compensation @ nearest_planar_pose(inverse(compensation) @ N)
    M, N = (inverse(N), inverse(M)) if refined.is_reversed else (M, N)
    return FreeJointConversion(M, N, step.conversion is not None and step.conversion.back)


def _errors(
    alignment: Alignment,
    steps: Sequence[_RefinedStep],
    X: FloatArray,
    values: FloatArray,
    size: float,
    *,
    with_links: bool,
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Return differences, their derivatives, and the motion (4, 4) of B's bodies after each joint pair.

    The differences (k,) of axes and links are in m; angles are multiplied by `size`. The derivatives
    (k, 6 + n) are with respect to a twist of B's root in A's root frame, and to `values` (n,).
    """
    b, n = alignment.b, len(values)
    # Motions of B's bodies, and the derivatives (6, 6 + n) of their twists: at the root and after each joint.
    root = X, np.eye(6, 6 + n)
    after, k = list[tuple[FloatArray, FloatArray]](), 0
    errors, derivatives = list[FloatArray](), list[FloatArray]()
    for step, refined in zip(alignment.steps, steps, strict=True):
        motion, twist = after[step.previous] if step.previous >= 0 else root
        if step.kind != "floating":
            screw = refined.screws[0][0] if refined.kind is None else b.screw(refined.edge)
            axis, target = screw.transform(motion), step.axis_a
            u, p = axis.direction, axis.point
            sense = step.sense if refined.kind is None else math.copysign(1.0, u @ target.direction)
            errors.append(size * (sense * u - target.direction))
            derivatives.append(-size * sense * skew(u) @ twist[:3])
            if step.kind == "turns":
                across = np.eye(3) - np.outer(target.direction, target.direction)
                errors.append(across @ (p - target.point))
                derivatives.append(across @ (twist[3:] - skew(p) @ twist[:3]))
        motion, twist = motion @ refined.start, twist.copy()
        for screw, turns in refined.screws:
            axis = screw.transform(motion)
            u, p = axis.direction, axis.point
            twist[:, 6 + k] = np.concatenate((u, np.cross(p, u)) if turns else (np.zeros(3), u))
            motion = motion @ screw_motion(screw, values[k], turns=turns)
            k += 1
        after.append((motion, twist))
    for frame in alignment.frames if with_links else ():
        if frame.tool is not IDENTITY:
            continue
        motion, twist = after[frame.previous] if frame.previous >= 0 else root
        T = motion @ b.zero_poses[frame.b]
        errors.append(size * log_rotation(T[:3, :3] @ frame.zero_pose[:3, :3].T))
        errors.append(T[:3, 3] - frame.zero_pose[:3, 3])
        derivatives.append(size * twist[:3])
        derivatives.append(twist[3:] - skew(T[:3, 3]) @ twist[:3])
    empty = np.zeros(0), np.zeros((0, 6 + n))
    return (
        np.concatenate([empty[0], *errors]),
        np.concatenate([empty[1], *derivatives]),
        [motion for motion, _ in after],
    )


def root_poses_by_axes(a: Mechanism, b: Mechanism, bodies: Both[int]) -> Iterator[FloatArray]:
    """Yield poses of B's root that align an axis of B with an axis of A.

    The rotation about A's axis and the shift along A's axis are 0 unless other axes determine them.
    """
    firsts = _first_revolute_axes((a, b), (None, None), bodies, ())
    for (axis_a, axis_b), before, after, further in firsts:
        lines = axis_a.screw, axis_b.screw
        # If the axes after `axis_a` do not determine the pose of B's root, other axes are used: axes after a
        # prismatic joint, and axes of other branches, such as the rotors of a drone.
        more = [*further, *(_with_reference_lines(lines, *pair) for pair, *_ in firsts)]
        for start in (axis_b.screw, axis_b.screw.reverse()):
            K = smallest_motion(start, axis_a.screw, turns=True)[0]
            # A rotation about A's axis does not change coordinates along this axis.
            shifts = _candidates(axis_a.screw, K, after, more, turns=False)
            for angle in _candidates(axis_a.screw, K, [*before, *after], more, turns=True):
                X = screw_motion(axis_a.screw, angle, turns=True) @ K
                for shift in shifts:
                    yield screw_motion(axis_a.screw, shift, turns=False) @ X


def root_poses_by_siblings(
    a: Mechanism, b: Mechanism, bodies: Both[int], have_equal_subtrees: Callable[[Edge, Edge], bool]
) -> Iterator[FloatArray]:
    """Yield poses of B's root that align up to three joint axes, all at one body of A and one body of B.

    If the aligned axes do not determine the shift along the first axis, later axes determine it. The default
    is 0.
    """
    edges = _with_axes(a, bodies[0])
    axes_a = [_axis(a, edge) for edge in edges]
    turning = [i for i, axis in enumerate(axes_a) if axis.turns]
    if len(edges) < 2 or not turning:
        return
    first = turning[0]
    u = axes_a[first].screw
    sines = [float(np.linalg.norm(np.cross(u.direction, axis.screw.direction))) for axis in axes_a]
    rest = sorted((i for i in range(len(edges)) if i != first), key=lambda i: -sines[i])
    second, others = rest[0], [i for i in rest[1:] if axes_a[i].turns][:1]
    axes_b = [
        [(f, _axis(b, f)) for f in _with_axes(b, bodies[1]) if have_equal_subtrees(edge, f)] for edge in edges
    ]
    for f, axis in axes_b[first]:
        lines = u, axis.screw
        with_lines = partial(_with_reference_lines, lines)
        next_bodies = edges[first].other_body(bodies[0]), f.other_body(bodies[1])
        later_pairs = list(later_axes((a, b), (edges[first], f), next_bodies, lines))
        for start, (g, other) in product((axis.screw, axis.screw.reverse()), axes_b[second]):
            if g is f:
                continue
            pair = with_lines(axes_a[second], other)
            other_pairs = [
                with_lines(axes_a[i], one)
                for i in others
                for h, one in axes_b[i]
                if h is not f and h is not g
            ]
            # The axis of a prismatic joint has no position. The axes after the prismatic joint can determine
            # the shift along u.
            if _motion_type(a, edges[second]) == "prismatic":
                carried = edges[second].other_body(bodies[0]), g.other_body(bodies[1])
                next_joints = _next_joints((a, b), (edges[second], g), carried)
                other_pairs += [with_lines(_axis(a, e), _axis(b, h)) for e, h in next_joints]
            K = smallest_motion(start, u, turns=True)[0]
            for angle in zero_candidates(u, pair[0], pair[1].transform(K), turns=True):
                X = screw_motion(u, angle, turns=True) @ K
                shifts = list(zero_candidates(u, pair[0], pair[1].transform(X), turns=False))
                for shift in shifts or _candidates(u, X, [*other_pairs, *later_pairs], turns=False):
                    yield screw_motion(u, shift, turns=False) @ X


def _with_reference_lines(lines: Both[Screw], axis_a: Axis, axis_b: Axis) -> Both[Axis]:
    return replace(axis_a, reference_line=lines[0]), replace(axis_b, reference_line=lines[1])


def _with_axes(mechanism: Mechanism, body: int) -> list[Edge]:
    return [edge for edge in mechanism.edges_by_body[body] if _has_direction(mechanism, edge)]


def _candidates(
    u: Screw, X: FloatArray, pairs: Sequence[Both[Axis]], more: Sequence[Both[Axis]] = (), *, turns: bool
) -> list[float]:
    """Return the values that `pairs` determine.

    If `pairs` determine no value, return 0 and the values that `more` determines.
    """
    found, others = (
        [x for one, other in group for x in zero_candidates(u, one, other.transform(X), turns)]
        for group in (pairs, more)
    )
    return found or [0.0, *others]


def _first_revolute_axes(
    mechanisms: Both[Mechanism],
    via: Both[Edge | None],
    bodies: Both[int],
    earlier_pairs: tuple[Both[Axis], ...],
) -> list[tuple[Both[Axis], tuple[Both[Axis], ...], list[Both[Axis]], list[Both[Axis]]]]:
    """Pair the first revolute axis of each branch of A with the first revolute axis of each branch of B.

    Each item contains the pair, the earlier pairs of prismatic axes, and the results of `later_axes` without
    and with `past_prismatic`. Branches without revolute axes give their last pair of prismatic axes.
    """
    first_axes = list[tuple[Both[Axis], tuple[Both[Axis], ...], list[Both[Axis]], list[Both[Axis]]]]()
    for e, f in _next_joints(mechanisms, via, bodies):
        pair, next_bodies = (
            (_axis(mechanisms[0], e), _axis(mechanisms[1], f)),
            (e.other_body(bodies[0]), f.other_body(bodies[1])),
        )
        lines = pair[0].screw, pair[1].screw
        deeper = (
            []
            if _motion_type(mechanisms[0], e) != "prismatic"
            else _first_revolute_axes(mechanisms, (e, f), next_bodies, (*earlier_pairs, pair))
        )
        after = partial(later_axes, mechanisms, (e, f), next_bodies, lines)
        first_axes += deeper or [(pair, earlier_pairs, list(after()), list(after(past_prismatic=True)))]
    return first_axes


def _next_joints(
    mechanisms: Both[Mechanism], via: Both[Edge | None], bodies: Both[int]
) -> Iterator[Both[Edge]]:
    edges_a, edges_b = (
        [edge for edge in mechanism.edges_by_body[body] if edge is not by and _has_direction(mechanism, edge)]
        for mechanism, by, body in zip(mechanisms, via, bodies, strict=True)
    )
    for e, f in product(edges_a, edges_b):
        if _motion_type(mechanisms[0], e) == _motion_type(mechanisms[1], f):
            yield e, f


def _motion_type(mechanism: Mechanism, edge: Edge) -> str:
    return motion_type(mechanism.joint(edge).kind)


def _has_direction(mechanism: Mechanism, edge: Edge) -> bool:
    """Return whether a joint has an axis, or a plane with a normal."""
    return _motion_type(mechanism, edge) in ("turns", "prismatic", "planar")


def _axis(mechanism: Mechanism, edge: Edge, reference_line: Screw | None = None) -> Axis:
    screw = mechanism.screw(edge)
    return Axis(screw, mechanism.joint(edge).kind.turns, reference_line or screw)


#: Function that proposes poses of B's next body. The arguments are the next bodies of A and B, the joints
#: before them, and the pose (4, 4) of B's current body.
ProposePoses = Callable[[tuple[int, int], EdgePair, FloatArray], Iterable[FloatArray]]

#: Maximum number of joint pairs that an exact search tries for each pair of bodies.
MAX_ASSIGNMENTS = 5000

#: Map from a coordinate of A to the matching coordinate of B, and B's velocity divided by A's velocity.
VelocityRatios = Mapping[str, tuple[str, float]]


@dataclass(frozen=True, slots=True, eq=False)
class _Match:
    """An exact match of two subtrees.

    Attributes:
        X: (4, 4) motion that moves B's next body to A's next body, in the zero configuration.
    """

    X: FloatArray
    ratios: VelocityRatios


class SubtreeMatcher:
    """Find subtrees that match exactly."""

    def __init__(
        self,
        a: Mechanism,
        b: Mechanism,
        joint_matcher: JointMatcher,
        tolerance: Tolerance,
        poses: ProposePoses,
    ) -> None:
        self.a, self.b, self.joint_matcher, self.tolerance, self.poses = a, b, joint_matcher, tolerance, poses
        self._cache = dict[tuple[int, int, int], list[tuple[FloatArray, _Match | None]]]()
        self._uses_mimic_rules = True

    def ignore_mimic_rules(self) -> None:
        self._uses_mimic_rules = False
        self._cache.clear()

    def exact_joint_pairs(
        self, bodies: tuple[int, int], via: PreviousEdges, X: FloatArray
    ) -> Sequence[EdgePair] | None:
        """Return pairs of the joints at two bodies; None if the bodies' subtrees do not match exactly.

        X (4, 4) moves B before the comparison.
        """
        found = self._match_bodies(bodies, via, X)
        return None if found is None else found[0]

    def pose_after(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> FloatArray | None:
        """Return `_Match.X` for the bodies after the joints e and f; None without an exact match."""
        found = self._match_subtrees(e, f, bodies, X)
        return None if found is None else found.X

    def _match_bodies(
        self, bodies: tuple[int, int], via: PreviousEdges, X: FloatArray
    ) -> tuple[Sequence[EdgePair], VelocityRatios] | None:
        if not self.joint_matcher.has_same_shape(bodies, via):
            return None
        for i, j in self.joint_matcher.link_pairs(*bodies):
            if not self.tolerance.holds(*pose_difference(self.a.zero_poses[i], X @ self.b.zero_poses[j])):
                return None
        named, left_a, left_b = self.joint_matcher.pair_by_name(bodies, via)
        if len(left_a) != len(left_b) or not all(self._axes_coincide(e, f, X) for e, f in named):
            return None
        candidates = [[f] for _, f in named]
        for e in left_a:
            some = self.joint_matcher.rank_candidates(bodies, e, left_b, X)
            candidates.append([f for f in some if self._axes_coincide(e, f, X)])
        return self._assign([*(e for e, _ in named), *left_a], candidates, bodies, X, [MAX_ASSIGNMENTS], {})

    def _assign(
        self,
        edges: Sequence[Edge],
        candidates: Sequence[Sequence[Edge]],
        bodies: tuple[int, int],
        X: FloatArray,
        tries: list[int],
        ratios: VelocityRatios,
    ) -> tuple[Sequence[EdgePair], VelocityRatios] | None:
        if not edges:
            return [], ratios
        k = min(range(len(edges)), key=lambda i: len(candidates[i]))
        for f in candidates[k]:
            tries[0] -= 1
            match = self._match_subtrees(edges[k], f, bodies, X) if tries[0] >= 0 else None
            both = None if match is None else self._merge_ratios(ratios, match.ratios)
            if both is None:
                continue
            others = [[g for g in some if g is not f] for i, some in enumerate(candidates) if i != k]
            rest = self._assign([*edges[:k], *edges[k + 1 :]], others, bodies, X, tries, both)
            if rest is not None:
                return [(edges[k], f), *rest[0]], rest[1]
        return None

    def _match_subtrees(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> _Match | None:
        if not self._axes_coincide(e, f, X):
            return None
        cases = self._cache.setdefault((e.joint, f.joint, bodies[0]), [])
        for other, match in cases:
            if self._is_same_case(e, other, X):
                return match
        next_bodies = e.other_body(bodies[0]), f.other_body(bodies[1])
        match, own = None, self._velocity_ratio(e, f, bodies, X)
        if self.joint_matcher.has_same_shape(next_bodies, (e, f)):
            for there in _distinct(self.poses(next_bodies, (e, f), X)):
                found_pairs = self._match_bodies(next_bodies, (e, f), there)
                ratios = None if found_pairs is None else self._merge_ratios(own, found_pairs[1])
                if ratios is not None:
                    match = _Match(there, ratios)
                    break
        cases.append((X, match))
        return match

    def _velocity_ratio(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> VelocityRatios:
        joints = self.a.joint(e), self.b.joint(f)
        if not self._uses_mimic_rules or not joints[0].kind.has_axis:
            return {}
        (x, m), (y, n) = (
            (joint.name, 1.0) if (rule := joint.mimic) is None else (rule.mimicked_joint, rule.multiplier)
            for joint in joints
        )
        if not m or not n:
            return {}
        alike = float(self.a.screw(e).direction @ (X[:3, :3] @ self.b.screw(f).direction)) > 0.0
        back = (e.outer == bodies[0]) != (f.outer == bodies[1])
        return {x: (y, (1.0 if alike != back else -1.0) * m / n)}

    def _merge_ratios(self, some: VelocityRatios, others: VelocityRatios) -> VelocityRatios | None:
        """Return None if a coordinate has two different partners or two different ratios."""
        for x in some.keys() & others.keys():
            (y, ratio), (other, other_ratio) = some[x], others[x]
            tolerance = self.tolerance.angle * max(1.0, abs(other_ratio))
            if y != other or abs(ratio - other_ratio) > tolerance:
                return None
        both = {**some, **others}
        return both if len({y for y, _ in both.values()}) == len(both) else None

    def _axes_coincide(self, e: Edge, f: Edge, X: FloatArray) -> bool:
        kinds = motion_type(self.a.joint(e).kind), motion_type(self.b.joint(f).kind)
        if kinds[0] != kinds[1] or kinds[0] == "fixed":
            return False
        return self.tolerance.holds(*self.joint_matcher.mismatch(e, f, IDENTITY, X))

    def _is_same_case(self, e: Edge, X: FloatArray, other: FloatArray) -> bool:
        """Return whether B's poses X and `other` differ only by a motion of A's joint e.

        For a planar joint, the poses must be equal.
        """
        kind = self.a.joint(e).kind
        if kind.nq > 1:
            return motion_type(kind) == "floating" or self.tolerance.holds(*pose_difference(X, other))
        screw, D = self.a.screw(e), other @ inverse(X)
        if kind.turns:
            moved = screw.transform(D)
            return self.tolerance.holds(
                float(np.linalg.norm(moved.direction - screw.direction)),
                float(np.linalg.norm(moved.point - screw.point)),
            )
        across = D[:3, 3] - screw.direction * (screw.direction @ D[:3, 3])
        return self.tolerance.holds(pose_difference(IDENTITY, D)[0], float(np.linalg.norm(across)))


def _distinct(poses: Iterable[FloatArray]) -> Iterator[FloatArray]:
    seen = set[bytes]()
    for X in poses:
        if (key := X.tobytes()) not in seen:
            seen.add(key)
            yield X
