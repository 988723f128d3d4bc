"""Exact matching of two subtrees: every axis of one coincides with an axis of the other, for some zeros.

The axes on one body are fixed relative to each other. A joint leaves free only a rotation about its axis, or
a translation along it. So whether the subtrees behind two joints match depends on the joints and on the
directions and positions of their axes, not on the angle; each case is computed once. The search visits each
pair of joints a few times, even for long chains and for many joints with two possible zeros.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.model.mechanisms.joint_matching import Pair, Pairing, Via, family
from urdfkin.model.mechanisms.mechanism import Edge, Mechanism, Tolerance, apart
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray

#: Poses of B's body behind two joints, from the bodies behind them, the joints, and B's pose before them.
Poses = Callable[[tuple[int, int], Pair, FloatArray], Iterable[FloatArray]]

#: Largest depth of a tree for this recursive search; deeper trees are matched joint by joint.
DEEPEST = 200
#: Largest number of attempts to assign the joints of two bodies.
MOST_ASSIGNMENTS = 5000

IDENTITY = np.eye(4)

#: A's coordinates, each with B's coordinate and the ratio of their velocities (its sign is the sense).
Rates = Mapping[str, tuple[str, float]]


@dataclass(frozen=True, slots=True, eq=False)
class _Match:
    """The match of the subtrees behind two joints.

    Attributes:
        X: (4, 4) pose of B's body behind the joint.
        rates: Corresponding coordinates in these subtrees.
    """

    X: FloatArray
    rates: Rates


class Congruence:
    """Exact matches of the subtrees of two mechanisms.

    Args:
        a: One mechanism.
        b: The other mechanism.
        pairing: Joints and links paired by name.
        tolerance: Tolerance for axes.
        poses: Returns candidate poses of B's body behind a joint.
    """

    def __init__(
        self, a: Mechanism, b: Mechanism, pairing: Pairing, tolerance: Tolerance, poses: Poses
    ) -> None:
        self.a, self.b, self.pairing, self.tolerance, self.poses = a, b, pairing, tolerance, poses
        self._known = dict[tuple[int, int, int], list[tuple[FloatArray, _Match | None]]]()
        self._off = max(*a.depths, *b.depths) > DEEPEST
        self._rules = True

    def ignore_rules(self) -> None:
        """Match axes only, from now on; the mimic rules differ."""
        self._rules = False
        self._known.clear()

    def at(self, bodies: tuple[int, int], via: Via, X: FloatArray) -> Sequence[Pair] | None:
        """Return the joint pairs of two bodies if their subtrees match exactly, else None.

        Args:
            bodies: Of A and of B.
            via: The joints by which they were reached.
            X: (4, 4) motion of B's body from its zero configuration to its pose at A's.
        """
        found = None if self._off else self._at(bodies, via, X)
        return None if found is None else found[0]

    def behind(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> FloatArray | None:
        """Return the pose (4, 4) of B's body behind two joints for an exact match; None if there is none.

        Args:
            e: Joint of A.
            f: Joint of B.
            bodies: The bodies before the joints.
            X: (4, 4) pose of B's body before the joint, as for `at`.
        """
        found = None if self._off else self._behind(e, f, bodies, X)
        return None if found is None else found.X

    def _at(self, bodies: tuple[int, int], via: Via, X: FloatArray) -> tuple[Sequence[Pair], Rates] | None:
        if not self.pairing.same_shape(bodies, via):
            return None
        for i, j in self.pairing.links(*bodies):
            if not self.tolerance.holds(*apart(self.a.homes[i], X @ self.b.homes[j])):
                return None
        named, left_a, left_b = self.pairing.by_names(bodies, via)
        if len(left_a) != len(left_b) or not all(self._lie_alike(e, f, X) for e, f in named):
            return None
        candidates = [[f] for _, f in named]
        for e in left_a:
            some = self.pairing.likeliest(bodies, e, left_b, X)
            candidates.append([f for f in some if self._lie_alike(e, f, X)])
        return self._assigned(
            [*(e for e, _ in named), *left_a], candidates, bodies, X, [MOST_ASSIGNMENTS], {}
        )

    def _assigned(
        self,
        left: Sequence[Edge],
        candidates: Sequence[Sequence[Edge]],
        bodies: tuple[int, int],
        X: FloatArray,
        tries: list[int],
        rates: Rates,
    ) -> tuple[Sequence[Pair], Rates] | None:
        """Assign a different joint of B to each joint of A, so that subtrees match; None if impossible."""
        if not left:
            return [], rates
        at = min(range(len(left)), key=lambda i: len(candidates[i]))
        for f in candidates[at]:
            tries[0] -= 1
            found = self._behind(left[at], f, bodies, X) if tries[0] >= 0 else None
            both = None if found is None else self._together(rates, found.rates)
            if both is None:
                continue
            others = [[g for g in some if g is not f] for i, some in enumerate(candidates) if i != at]
            rest = self._assigned([*left[:at], *left[at + 1 :]], others, bodies, X, tries, both)
            if rest is not None:
                return [(left[at], f), *rest[0]], rest[1]
        return None

    def _behind(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> _Match | None:
        if not self._lie_alike(e, f, X):
            return None
        known = self._known.setdefault((e.joint, f.joint, bodies[0]), [])
        for other, match in known:
            if self._same_case(e, other, X):
                return match
        beyond = e.beyond(bodies[0]), f.beyond(bodies[1])
        found, own = None, self._rate(e, f, bodies, X)
        if self.pairing.same_shape(beyond, (e, f)):
            for there in _distinct(self.poses(beyond, (e, f), X)):
                some = self._at(beyond, (e, f), there)
                rates = None if some is None else self._together(own, some[1])
                if rates is not None:
                    found = _Match(there, rates)
                    break
        known.append((X, found))
        return found

    def _rate(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> Rates:
        """Return the corresponding coordinates of two joints; empty if one of them has none."""
        joints = self.a.joint(e), self.b.joint(f)
        if not self._rules or not joints[0].kind.has_axis:
            return {}
        (x, m), (y, n) = (
            (joint.name, 1.0) if (rule := joint.mimic) is None else (rule.leader, rule.multiplier)
            for joint in joints
        )
        if not m or not n:
            return {}
        alike = float(self.a.screw(e).direction @ (X[:3, :3] @ self.b.screw(f).direction)) > 0.0
        back = (e.outer == bodies[0]) != (f.outer == bodies[1])
        return {x: (y, (1.0 if alike != back else -1.0) * m / n)}

    def _together(self, some: Rates, others: Rates) -> Rates | None:
        """Return the union of two correspondences, or None if they contradict each other."""
        for x, (y, rate) in others.items():
            there = some.get(x)
            if there is None:
                continue
            near = self.tolerance.angle * max(1.0, abs(rate))
            if there[0] != y or abs(there[1] - rate) > near:
                return None
        both = {**some, **others}
        return both if len({y for y, _ in both.values()}) == len(both) else None

    def _lie_alike(self, e: Edge, f: Edge, X: FloatArray) -> bool:
        kinds = family(self.a.joint(e).kind), family(self.b.joint(f).kind)
        if kinds[0] != kinds[1] or kinds[0] == "fixed":
            return False
        return self.tolerance.holds(*self.pairing.mismatch(e, f, IDENTITY, X))

    def _same_case(self, e: Edge, X: FloatArray, other: FloatArray) -> bool:
        """Return whether two poses of B's body before a joint differ by a motion that the joint can undo."""
        kind = self.a.joint(e).kind
        if kind.nq > 1:
            return family(kind) == "floating" or self.tolerance.holds(*apart(X, other))
        screw, D = self.a.screw(e), other @ inverse(X)
        if kind.turns:
            moved = screw.moved(D)
            return self.tolerance.holds(
                float(np.linalg.norm(moved.direction - screw.direction)),
                float(np.linalg.norm(moved.point - screw.point)),
            )
        across = D[:3, 3] - screw.direction * (screw.direction @ D[:3, 3])
        return self.tolerance.holds(apart(IDENTITY, D)[0], float(np.linalg.norm(across)))


def _distinct(poses: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """Yield each pose once; poses are equal if all bits are equal."""
    seen = set[bytes]()
    for X in poses:
        if (key := X.tobytes()) not in seen:
            seen.add(key)
            yield X
