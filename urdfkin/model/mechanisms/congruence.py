"""An exact match of two subtrees: every axis of one lies on an axis of the other, whatever their zeros are.

The axes on one body are fixed to each other. A joint leaves free only a rotation about its axis, or a
displacement along it. So whether all that a joint moves matches depends on the two joints and on the senses
and places of their axes, not on the angle: each such case is computed once. The search visits a pair of
joints a few times, however long the chains are and however many joints have two possible zeros.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.model.mechanisms.joint_matching import Came, Pair, Pairing, family
from urdfkin.model.mechanisms.mechanism import Edge, Mechanism, Tolerance, apart
from urdfkin.model.pose import inverse
from urdfkin.model.tree import FloatArray

#: Poses of B's body behind two joints, given the bodies behind them, the joints and B's pose before them.
Poses = Callable[[tuple[int, int], Pair, FloatArray], Iterable[FloatArray]]

#: A deeper tree is matched joint by joint, without this search, which recurses.
DEEPEST = 200
#: So many ways to assign the joints of two bodies are tried.
MOST_ASSIGNMENTS = 5000

IDENTITY = np.eye(4)

#: Coordinates of A, each with B's that belongs to it, and by how much faster B's moves (the sign: sense).
Rates = Mapping[str, tuple[str, float]]


@dataclass(frozen=True, slots=True, eq=False)
class _Match:
    """What matches behind some joints.

    Attributes:
        X: (4, 4) the pose of B's body behind the joint.
        rates: How coordinates belong together there.
    """

    X: FloatArray
    rates: Rates


class Congruence:
    """Exact matches of the subtrees of two mechanisms.

    Args:
        a: One.
        b: The other.
        pairing: Joints and links that names pair.
        tolerance: Within which axes agree.
        poses: Candidates for the pose of B's body behind a joint.
    """

    def __init__(
        self, a: Mechanism, b: Mechanism, pairing: Pairing, tolerance: Tolerance, poses: Poses
    ) -> None:
        self.a, self.b, self.pairing, self.tolerance, self.poses = a, b, pairing, tolerance, poses
        self._known = dict[tuple[int, int, int], list[tuple[FloatArray, _Match | None]]]()
        self._off = max(*a.depths, *b.depths) > DEEPEST
        self._rules = True

    def ignore_rules(self) -> None:
        """Match axes alone from now on, whatever mimic rules say: these differ."""
        self._rules = False
        self._known.clear()

    def at(self, bodies: tuple[int, int], came: Came, X: FloatArray) -> Sequence[Pair] | None:
        """The pairs of joints at two bodies if all that they carry matches, else None.

        Args:
            bodies: Of A and of B.
            came: The joints by which they were reached.
            X: (4, 4) what moves B's body from its own home to where it stands at A's.
        """
        found = None if self._off else self._at(bodies, came, X)
        return None if found is None else found[0]

    def behind(self, e: Edge, f: Edge, bodies: tuple[int, int], X: FloatArray) -> FloatArray | None:
        """(4, 4) the pose of B's body behind two joints with which everything there matches; None: no pose.

        Args:
            e: Joint of A.
            f: Joint of B.
            bodies: Those that carry them on the way.
            X: (4, 4) the pose of B's body there, as for `at`.
        """
        found = None if self._off else self._behind(e, f, bodies, X)
        return None if found is None else found.X

    def _at(self, bodies: tuple[int, int], came: Came, X: FloatArray) -> tuple[Sequence[Pair], Rates] | None:
        if not self.pairing.same_shape(bodies, came):
            return None
        for i, j in self.pairing.links(*bodies):
            if not self.tolerance.holds(*apart(self.a.homes[i], X @ self.b.homes[j])):
                return None
        named, left_a, left_b = self.pairing.by_names(bodies, came)
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
        """Each joint of A with one of B of its own, such that all behind them matches; None where none is."""
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
        """How the coordinates of two joints belong together; nothing where there is not one of each."""
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
        """Both, or None where they say two things of one coordinate."""
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
        """Whether two poses of B's body before a joint differ by what the joint itself can undo."""
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
    """Each pose once, to the last bit; two that rounding parts are both tried."""
    seen = set[bytes]()
    for X in poses:
        if (key := X.tobytes()) not in seen:
            seen.add(key)
            yield X
