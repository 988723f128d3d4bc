"""Prove joint by joint that single precision is the cause of every difference between two models.

A bound on the displacement of a frame by rounding is a sum over all joints. This sum is larger for robots
whose prismatic joints have long ranges. An error in one joint can be smaller than this sum, so a comparison
with the sum does not detect the error. The proof in this module has no such sum: each joint may differ only
by the rounding of this joint's own numbers.

**What is compared.** Two files can describe the same joint by different frames. For example, the origin of a
joint may be shifted along its axis, and a converter may add links or merge fixed links. Therefore, the proof
does not compare the numbers in the files. It compares quantities that do not depend on the choice of frames.
`same` computes these quantities for each link that both models have. The robot is in the zero configuration,
and the quantities are expressed in the frame of a link P. P is the link's nearest ancestor in A that both
models have, so different links have different ancestors P. The quantities are

- the pose of the link;
- the direction and the line of the axis of each joint between P and the link;
- the multiplier and the offset of each mimic rule.

By the product of exponentials, these quantities determine the pose of each common link in every
configuration. The models are compared as they are written: the roots of A and B coincide, and no joint
direction, joint zero or tool frame is changed.

**The bound.** Let the joints 1 to n be the joints on the path from P to the link. Rounding can shift the
frame after joint i by up to w_i, and rotate this frame by up to e_i. The function
`urdfkin.verify.usd_check.single_precision` computes w_i and e_i from the numbers of joint i. Let R_i be the
constant rotation of joint i, and p_i its origin. A star marks the exact values. Then

    R_1 ... R_n    and    R*_1 ... R*_n    are apart by at most    e_1 + ... + e_n,

because the angle of a product of rotations is at most the sum of their angles. Let W be the position error
(m) and E the rotation error (rad) of the frame before joint i. The position error of the frame after the
joint is then at most

    W + E |p_i| + w_i,

because R p_i - R* p*_i = (R - R*) p_i + R* (p_i - p*_i). The axis of joint i passes through the origin of the
frame after the joint, and is fixed in this frame. Therefore, the errors of the axis are at most the position
error and the rotation error of this frame. The multiplier and the offset of a mimic rule have a relative
error of at most 2^-24.

In B, P may be no ancestor of the link: the paths to P and to the link may branch at a common ancestor. Let W
and E be the position error and the rotation error of the link relative to this common ancestor. Let V and F
be the position error and the rotation error of P relative to the common ancestor. Let d be the distance
between the link and P. Then the position error of the link relative to P is at most W + V + F d, and the
rotation error is at most E + F. `same` ignores the rounding errors of double precision, so these errors are
added to the bounds. If both models are rounded, the bounds of both models are added.

**Both orders.** The bound for one joint can contain the rounding of other joints. This happens if the parent
of the joint is a link that only B has, or if P is far from the joint in B. Therefore, `same` compares A with
B, and also B with A. If the comparison starts with a rounded model, the path from P to the link must have at
most one moving joint. In the other model, the path from the common ancestor to P must have no rounded joint.
Otherwise, `same` reports the difference as not explained.

**What the proof means.** If a difference exceeds its bound, single precision is not the cause of this
difference. `same` names the first joint with a difference that exceeds its bound. If no difference exceeds
its bound, a joint can still have an error that is smaller than the rounding of the joint's own numbers. No
comparison of the two models can detect an error of this size. The proof does not cover planar joints,
floating joints, joints in another order, and links on different branches of A and B. These joints and links
must agree up to double precision. Otherwise, `same` reports the difference as not explained.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile

import numpy as np

from urdfkin.comparison.result import JointDifference, angle, length
from urdfkin.model.mechanisms.mechanism import (
    Alignment,
    MatchedJoints,
    Screw,
    Tolerance,
    pose_difference,
    smallest_motion,
)
from urdfkin.model.tree import FloatArray, inverse


class JointComparison:
    """The comparison of two aligned models joint by joint, without changes of the models.

    Args:
        found: The alignment of the two models; only its pairs of joints and links are used.
        joints: Bounds (joints, 3) of A and of B, as in `SinglePrecision.joints`; 0 for double precision.
        base: (4, 4) pose of B's root in A's root frame, for unchanged models.
        tolerance: The largest differences that count as rounding of double precision.
    """

    def __init__(
        self,
        found: Alignment,
        joints: tuple[FloatArray, FloatArray],
        base: FloatArray,
        tolerance: Tolerance,
    ) -> None:
        self.found, self.joints, self.base, self.tolerance = found, joints, base, tolerance
        self.mechanisms = found.a, found.b
        self.pairs = {frame.a: frame.b for frame in found.frames}
        self.steps = {step.a: step for step in found.steps}
        back = {b: a for a, b in self.pairs.items()}
        #: The link of A and the link of B at which the compared paths begin.
        self.start = (0, self.pairs[0]) if 0 in self.pairs else (back.get(0, 0), 0)
        self.pairs[self.start[0]] = self.start[1]

    def differences(self) -> Iterator[JointDifference]:
        """Yield each difference that is larger than rounding; the links come in A's order."""
        joints, links = self.found.a.tree.joints, self.found.a.tree.links
        starts = [m.homes[link] for m, link in zip(self.mechanisms, self.start, strict=True)]
        if not all(self.tolerance.holds(*pose_difference(np.eye(4), T)) for T in (self.base, *starts)):
            yield JointDifference(f"link {links[self.start[0]]}", "base", None, "at another place")
        done = set[int]()
        for link, other in sorted(self.pairs.items()):
            if (link, other) == self.start:
                continue
            above, path = self._way(link)
            paths = self._paths(0, above, link), self._paths(1, self.pairs[above], other)
            yield from self._of_paths(link, paths)
            done.update(path)
        for step in self.found.steps:
            yield from self._of_rule(step)
            if step.a not in done:
                why = "carries no link that both models have"
                yield JointDifference(f"joint {joints[step.a].name}", "", None, why)

    def _way(self, link: int) -> tuple[int, list[int]]:
        """Return the link's nearest ancestor in A that both models have, and the joints between the two.

        Without such an ancestor, the result has the link at which all paths begin.
        """
        joints, path = self.found.a.tree.joints, list[int]()
        while link:
            path.insert(0, link - 1)
            link = joints[link - 1].parent
            if link in self.pairs:
                return link, path
        return self.start[0], path

    def _paths(self, which: int, start: int, end: int) -> tuple[list[int], list[int]]:
        """Return the joints on the paths from the last common ancestor to two links."""
        tree = self.mechanisms[which].tree
        ways = tree.path(start), tree.path(end)
        n = sum(1 for _ in takewhile(lambda two: two[0] == two[1], zip(*ways, strict=False)))
        return list(ways[0][n:]), list(ways[1][n:])

    def _of_paths(self, link: int, paths: Sequence[tuple[list[int], list[int]]]) -> Iterator[JointDifference]:
        trees = self.found.a.tree, self.found.b.tree
        moving = [
            [[i for i in way if tree.joints[i].kind.nv] for way in two]
            for tree, two in zip(trees, paths, strict=True)
        ]
        steps = [self.steps.get(i) for i in moving[0][1]]
        name = f"link {trees[0].links[link]}"
        partners = [None if step is None or step.unlike else step.b for step in steps]
        if moving[0][0] or moving[1][0] or partners != moving[1][1]:
            yield JointDifference(name, "", None, "is carried by other joints in the other model")
            return
        # The joints paths[1][0] of B lie between the common ancestor and the reference link P.
        if self.joints[0].any() and (len(steps) > 1 or self.joints[1][paths[1][0]].any()):
            yield JointDifference(name, "", None, "is carried by joints without a common link between them")
            return
        if any(step is not None and step.kind in ("planar", "floating") for step in steps):
            yield from self._of_free_joint(name, [way for _, way in paths])
            return
        screws, poses, bounds = zip(*(self._passed(k, *two) for k, two in enumerate(paths)), strict=True)
        if not paths[0][0] and len(paths[0][1]) == 1:
            name = f"joint {trees[0].joints[link - 1].name}"
        off = list(self._beyond(name, "origin", *pose_difference(*poses), bounds[0] + bounds[1]))
        yield from off
        for step in filter(None, steps):
            joint = f"joint {trees[0].joints[step.a].name}"
            pair, bound = zip(*(screws[k][i] for k, i in enumerate((step.a, step.b))), strict=True)
            beyond = list(self._beyond(joint, "axis", *self._between(step, *pair), bound[0] + bound[1]))
            # A shifted link origin also shifts the axis, so the axes are compared in the link's frame.
            if beyond and off:
                seen = [screw.moved(inverse(T)) for screw, T in zip(pair, poses, strict=True)]
                beyond = list(
                    self._beyond(joint, "axis", *self._between(step, *seen), sum(bound) + sum(bounds))
                )
            yield from beyond

    def _between(self, step: MatchedJoints, axis: Screw, other: Screw) -> tuple[float, float]:
        """Return the angle of two axes, and the distance of one axis' point from the other axis.

        The point of an axis may lie anywhere on this axis.
        """
        ends = (axis, other) if self.joints[0].any() else (other, axis)
        return smallest_motion(*ends, turns=step.kind == "turns")[1:]

    def _passed(
        self, which: int, back: Sequence[int], path: Sequence[int]
    ) -> tuple[Mapping[int, tuple[Screw, FloatArray]], FloatArray, FloatArray]:
        """Return a path's joint screws and the pose at its end, with bounds (m, rad) on their errors.

        Both joint lists begin at the last common link. The list `back` has the fixed joints to the reference
        link, in whose frame the results are. `which` is 0 for A and 1 for B.
        """
        tree = self.mechanisms[which].tree
        start, own = np.eye(4), np.zeros(2)
        for i in back:
            own, start = self._after(which, i, own), start @ tree.joints[i].T_parent_joint
        T, off, seen = np.eye(4), np.zeros(2), inverse(start)
        screws: dict[int, tuple[Screw, FloatArray]] = {}

        def placed() -> FloatArray:
            """Return the error bounds (m, rad) of the current frame relative to the reference link."""
            lever = float(np.linalg.norm((seen @ T)[:3, 3])) if back else 0.0
            return np.asarray(off + own + np.array([own[1] * lever, 0.0]))

        for i in path:
            off, T = self._after(which, i, off), T @ tree.joints[i].T_parent_joint
            at = seen @ T
            screws[i] = Screw(at[:3, :3] @ tree.joints[i].axis, at[:3, 3]), placed()
        return screws, seen @ T, placed()

    def _after(self, which: int, joint: int, off: FloatArray) -> FloatArray:
        """Return the error bounds (m, rad) after a joint; `off` contains the bounds before the joint."""
        metres, radians = self.joints[which][joint, :2]
        length_of = self.mechanisms[which].tree.joints[joint].length
        return np.array([off[0] + off[1] * length_of + metres, off[1] + radians])

    def _beyond(
        self, place: str, what: str, tilt: float, shift: float, bound: FloatArray
    ) -> Iterator[JointDifference]:
        metres, radians = bound.tolist()
        far, turned = shift > metres + self.tolerance.way, tilt > radians + self.tolerance.angle
        sizes = [f"{length(shift)} off"] * far + [f"turned by {angle(tilt)}"] * turned
        most = [length(metres)] * far + [angle(radians)] * turned
        if sizes:
            explained = " and ".join(most) if bound.any() else ""
            yield JointDifference(place, what, None, " and ".join(sizes), explained)

    def _of_free_joint(self, name: str, paths: Sequence[list[int]]) -> Iterator[JointDifference]:
        """Yield the differences of a planar or floating joint, which must be attached to the root body."""
        a, b = self.found.a, self.found.b
        ends = [(a, paths[0]), (b, paths[1])]
        parents = [mechanism.tree.joints[path[0]].parent for mechanism, path in ends]
        bodies = [a.body_of[parents[0]], b.body_of[parents[1]]]  # the root body has the index 0
        if any(bodies) or not all(len(path) == 1 for path in paths):
            why = "follows a planar or floating joint that is not compared joint by joint"
            yield JointDifference(name, "", None, why)
            return
        for T, other in (
            [mechanism.homes[link] for (mechanism, _), link in zip(ends, parents, strict=True)],
            [mechanism.homes[path[0] + 1] for mechanism, path in ends],
        ):
            if not self.tolerance.holds(*pose_difference(T, self.base @ other)):
                why = "follows a planar or floating joint with another frame"
                yield JointDifference(name, "", None, why)

    def _of_rule(self, step: MatchedJoints) -> Iterator[JointDifference]:
        """Yield each difference of two mimic rules that exceeds rounding."""
        trees = self.found.a.tree, self.found.b.tree
        a, b = trees[0].joints[step.a].mimic, trees[1].joints[step.b].mimic
        place = f"joint {trees[0].joints[step.a].name}"
        if a is None and b is None:
            return
        if a is None or b is None or self.found.names.get(a.leader) != b.leader:
            yield JointDifference(place, "mimic joint", *(one.leader if one else "none" for one in (a, b)))
            return
        share = float(self.joints[0][step.a, 2] + self.joints[1][step.b, 2])
        for what in ("multiplier", "offset"):
            x, y = getattr(a, what), getattr(b, what)
            size = max(abs(x), abs(y))
            if abs(x - y) > share * size + self.tolerance.angle * max(1.0, size):
                explained = f"{share * size:.2g}" if share else ""
                yield JointDifference(place, f"mimic {what}", x, y, explained)
