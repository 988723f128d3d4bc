"""Prove joint by joint that single precision is the cause of every difference between two models.

A bound on the displacement of a frame by rounding is a sum over all joints. It depends on the whole range of
each prismatic joint. So the bound on rounding can be larger than an error in one joint. This proof has no
such sum: each joint may differ by the rounding of its own numbers only.

**What is compared.** The frames of a joint in its two bodies may be chosen freely, up to a motion along the
axis, and a converter may add links or merge fixed ones. So the proof does not compare the numbers in the
files. It compares quantities that do not depend on these choices. They are computed in the zero configuration
and expressed in the frame of a link P. Each link that both models have has its own P. P is the nearest
ancestor in A that both models have. The quantities are

- the pose of the link;
- the direction and the line of the axis of each joint between P and the link;
- the multiplier and the offset of each mimic rule.

By the product of exponentials, these determine the pose of each common link in every configuration. The
models are compared as they are written. The roots coincide, and no joint sense, zero offset or tool frame is
changed.

**The bound.** Let the path from P to the link have the joints 1 to n. Rounding can move the frame after joint
i by w_i and turn it by e_i, as `urdfkin.verify.usd_check.single_precision` derives from the numbers of this
joint. Let R_i be the constant rotation of joint i, and p_i its origin; a star marks the exact values. Then

    R_1 ... R_n    and    R*_1 ... R*_n    are apart by at most    e_1 + ... + e_n,

because angles of rotations add at most. Let W be the position error (m) and E the rotation error (rad) of the
frame before joint i. The position error of the frame after the joint is then at most

    W + E |p_i| + w_i,

because R p_i - R* p*_i = (R - R*) p_i + R* (p_i - p*_i). The axis of joint i passes through the origin of the
frame after the joint, and is fixed in this frame. So the position error and the rotation error of this frame
also bound the errors of the axis. The multiplier and the offset of a mimic rule have a relative error of at
most 2^-24.

In B, the paths to P and to the link may branch at a common ancestor. Let W and E be the position error and
the rotation error of the link relative to this ancestor. Let V and F be those of P. If the distance of the
link from P is d, the position error of the link relative to P is at most W + V + F d. Its rotation error is
at most E + F. The rounding errors of double precision, which `same` ignores, are added. If both models are
rounded, their bounds are added.

**Both orders.** A link that only B has can be the parent of a joint, or P can be far from the joint in B.
Then the bound contains the rounding of other joints. `same` therefore compares A with B, and B with A. In the
comparison that starts with a rounded model, the path from P to the link must have at most one moving joint,
and all its fixed joints must lie between P and the link. Otherwise, the difference is reported as
not explained.

**What the proof means.** If a difference exceeds its bound, single precision is not its cause. `same` names
the first joint with such a difference. If no difference exceeds its bound, an error that is smaller than the
rounding of the joint's own numbers may remain. Nothing can distinguish such an error from rounding. Some
parts are not compared joint by joint: planar and floating joints, joints in another order, and links on other
branches. They must agree up to double precision. Otherwise, the difference is reported as not explained.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile

import numpy as np

from urdfkin.comparison.result import JointDifference, angle, length
from urdfkin.model.mechanisms.mechanism import (
    Alignment,
    Mechanism,
    Screw,
    Step,
    Tolerance,
    apart,
    between,
)
from urdfkin.model.tree import FloatArray, inverse


class JointComparison:
    """The comparison of two aligned models as they are written, joint by joint.

    Args:
        found: The alignment. Only its pairs of joints and links are used.
        joints: Bounds (joints, 3) of A and of B, as in `SinglePrecision.joints`. They are zero for a model in
            double precision.
        base: (4, 4) pose of B's root in A's root frame, for models as they are written.
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
        #: The links at which the paths begin.
        self.start = (0, self.pairs[0]) if 0 in self.pairs else (back.get(0, 0), 0)
        self.pairs[self.start[0]] = self.start[1]

    def differences(self) -> Iterator[JointDifference]:
        """Yield each difference that is larger than rounding; the links come in A's order."""
        joints, links = self.found.a.tree.joints, self.found.a.tree.links
        starts = [m.homes[link] for m, link in zip(self.mechanisms, self.start, strict=True)]
        if not all(self.tolerance.holds(*apart(np.eye(4), T)) for T in (self.base, *starts)):
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
        """Return the nearest ancestor in A that both models have, and the joints from it to the link.

        If there is no such ancestor, return the link at which all paths begin.
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
        # paths[1][0] is B's path back to the reference link.
        if self.joints[0].any() and (len(steps) > 1 or self.joints[1][paths[1][0]].any()):
            yield JointDifference(name, "", None, "is carried by joints without a common link between them")
            return
        if any(step is not None and step.kind in ("planar", "floating") for step in steps):
            yield from self._of_free_joint(name, [way for _, way in paths])
            return
        screws, poses, bounds = zip(*(self._passed(k, *two) for k, two in enumerate(paths)), strict=True)
        if not paths[0][0] and len(paths[0][1]) == 1:
            name = f"joint {trees[0].joints[link - 1].name}"
        off = list(self._beyond(name, "origin", *apart(*poses), bounds[0] + bounds[1]))
        yield from off
        for step in filter(None, steps):
            joint = f"joint {trees[0].joints[step.a].name}"
            pair, bound = zip(*(screws[k][i] for k, i in enumerate((step.a, step.b))), strict=True)
            beyond = list(self._beyond(joint, "axis", *self._between(step, *pair), bound[0] + bound[1]))
            if (
                beyond and off
            ):  # another origin of the link also moves the axis, so compare the axes in the frame of the link
                seen = [screw.moved(inverse(T)) for screw, T in zip(pair, poses, strict=True)]
                beyond = list(
                    self._beyond(joint, "axis", *self._between(step, *seen), sum(bound) + sum(bounds))
                )
            yield from beyond

    def _between(self, step: Step, axis: Screw, other: Screw) -> tuple[float, float]:
        """Return the angle and the distance of two axes.

        Only the distance from the other line is compared, because a point may lie anywhere along its axis.
        """
        ends = (axis, other) if self.joints[0].any() else (other, axis)
        return between(*ends, turns=step.kind == "turns")[1:]

    def _passed(
        self, which: int, back: Sequence[int], path: Sequence[int]
    ) -> tuple[Mapping[int, tuple[Screw, FloatArray]], FloatArray, FloatArray]:
        """Return the screws of the joints on a path, the pose at the end, and bounds (m, rad) for them.

        Args:
            which: 0 for A, 1 for B.
            back: The fixed joints from the last common link to the reference link. Results are in the frame
                of this link.
            path: The joints from the last common link to the end.
        """
        tree = self.mechanisms[which].tree
        start, own = np.eye(4), np.zeros(2)
        for i in back:
            own, start = self._after(which, i, own), start @ tree.joints[i].T_parent_joint
        T, off, seen = np.eye(4), np.zeros(2), inverse(start)
        screws: dict[int, tuple[Screw, FloatArray]] = {}

        def placed() -> FloatArray:
            """Return the bounds of a frame relative to the reference link, which is at the end of `back`."""
            lever = float(np.linalg.norm((seen @ T)[:3, 3])) if back else 0.0
            return np.asarray(off + own + np.array([own[1] * lever, 0.0]))

        for i in path:
            off, T = self._after(which, i, off), T @ tree.joints[i].T_parent_joint
            at = seen @ T
            screws[i] = Screw(at[:3, :3] @ tree.joints[i].axis, at[:3, 3]), placed()
        return screws, seen @ T, placed()

    def _after(self, which: int, joint: int, off: FloatArray) -> FloatArray:
        """Return the bounds (m, rad) of the frame after a joint, from those of the frame before it."""
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
        """Compare a planar or floating joint, which must be the only joint of the root body.

        Yield its differences.
        """
        a, b = self.found.a, self.found.b
        ends = [(a, paths[0]), (b, paths[1])]
        if not all(len(path) == 1 and not _body_before(mechanism, path[0]) for mechanism, path in ends):
            why = "follows a planar or floating joint that is not compared joint by joint"
            yield JointDifference(name, "", None, why)
            return
        for T, other in (
            [mechanism.homes[mechanism.tree.joints[path[0]].parent] for mechanism, path in ends],
            [mechanism.homes[path[0] + 1] for mechanism, path in ends],
        ):
            if not self.tolerance.holds(*apart(T, self.base @ other)):
                why = "follows a planar or floating joint with another frame"
                yield JointDifference(name, "", None, why)

    def _of_rule(self, step: Step) -> Iterator[JointDifference]:
        """Compare the multipliers and the offsets of two mimic rules.

        Yield each difference that exceeds rounding.
        """
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


def _body_before(mechanism: Mechanism, joint: int) -> int:
    """Return the body that carries a joint; 0 is the root body."""
    return mechanism.body_of[mechanism.tree.joints[joint].parent]
