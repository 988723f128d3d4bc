"""Which joints of two bodies are each other's: by given and agreeing names, else by how they lie."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from urdfkin.model.mechanisms.mechanism import Edge, Mechanism, Screw, Tolerance, between_lines
from urdfkin.model.mechanisms.rigid import apart
from urdfkin.model.tree import FloatArray, JointKind

Pair = tuple[Edge, Edge]


def family(kind: JointKind) -> str:
    """What two joints must have in common to be each other's: how they move, not how far."""
    return "turns" if kind.turns else kind.value


class Pairing:
    """The pairs of two mechanisms, body by body.

    Args:
        a: One.
        b: The other.
        given: Joint names of `a` and the names that they have in `b`.
        tolerance: Within which axes agree.
    """

    def __init__(self, a: Mechanism, b: Mechanism, given: Mapping[str, str], tolerance: Tolerance) -> None:
        self.a, self.b, self.given, self._tolerance = a, b, given, tolerance
        self._signatures: dict[tuple[int, int, int], str] = {}

    def links(self, body_a: int, body_b: int) -> list[tuple[int, int]]:
        """Links of one name on two bodies."""
        there = {self.b.tree.links[link]: link for link in self.b.bodies[body_b]}
        return [
            (link, there[name])
            for link in self.a.bodies[body_a]
            if (name := self.a.tree.links[link]) in there
        ]

    def edges(
        self, bodies: tuple[int, int], came: tuple[Edge | None, Edge | None], G: FloatArray, XC: FloatArray
    ) -> tuple[list[Pair], list[Edge], list[Edge]]:
        """Joints that lead on from two bodies: pairs, and what is left over of each.

        Args:
            bodies: Of a and of b.
            came: The joints by which they were reached.
            G: (4, 4) what moves a's home to where b's is.
            XC: (4, 4) what moves b's own home there.
        """
        left_a = [edge for edge in self.a.edges_of[bodies[0]] if edge is not came[0]]
        left_b = [edge for edge in self.b.edges_of[bodies[1]] if edge is not came[1]]
        pairs: list[Pair] = []
        for e, f in self._by_name(bodies, list(left_a), list(left_b)):
            if e in left_a and f in left_b:
                pairs.append((e, f))
                left_a.remove(e)
                left_b.remove(f)
        named = {name for pair in self.given.items() for name in pair}
        rest = sorted(
            (self._unlikeness(bodies, e, f, G, XC), i, j)
            for i, e in enumerate(left_a)
            for j, f in enumerate(left_b)
            if family(self.a.joint(e).kind) == family(self.b.joint(f).kind)
            and not {self.a.joint(e).name, self.b.joint(f).name} & named
        )
        taken_a, taken_b = set[int](), set[int]()
        for _, i, j in rest:
            if i not in taken_a and j not in taken_b:
                pairs.append((left_a[i], left_b[j]))
                taken_a.add(i)
                taken_b.add(j)
        return (
            pairs,
            [edge for i, edge in enumerate(left_a) if i not in taken_a],
            [edge for j, edge in enumerate(left_b) if j not in taken_b],
        )

    def _by_name(self, bodies: tuple[int, int], ours: list[Edge], theirs: list[Edge]) -> Iterator[Pair]:
        by_name = {self.b.joint(f).name: f for f in theirs}
        for e in ours:
            name = self.a.joint(e).name
            if (f := by_name.get(self.given.get(name, name))) is not None:
                yield e, f
        for e in ours:
            links = {self.a.tree.links[k] for k in self.a.bodies[e.beyond(bodies[0])]}
            for f in theirs:
                if links & {self.b.tree.links[k] for k in self.b.bodies[f.beyond(bodies[1])]}:
                    yield e, f

    def _unlikeness(
        self, bodies: tuple[int, int], e: Edge, f: Edge, G: FloatArray, XC: FloatArray
    ) -> tuple[bool, float, float]:
        """Of shape, then of axes, then, where axes lie on one line, of where they point and stand on it."""
        other_shape = self._signature(0, bodies[0], e) != self._signature(1, bodies[1], f)
        angle, way = self.mismatch(e, f, G, XC)
        off = 0.0 if self._tolerance.holds(angle, way) else angle * max(self.a.size, 1e-9) + way
        _, place = apart(G @ self.a.homes[e.joint + 1], XC @ self.b.homes[f.joint + 1])
        s, t = self.a.screw(e).moved(G), self.b.screw(f).moved(XC)
        return other_shape, off, place + self.a.size * bool(s.direction @ t.direction < 0.0)

    def _signature(self, which: int, body: int, edge: Edge) -> str:
        """What hangs on a joint, joints' kinds alone."""
        mechanism = (self.a, self.b)[which]
        if (known := self._signatures.get((which, body, edge.joint))) is None:
            beyond = edge.beyond(body)
            below = sorted(
                self._signature(which, beyond, other)
                for other in mechanism.edges_of[beyond]
                if other is not edge
            )
            known = f"({family(mechanism.joint(edge).kind)}{''.join(below)})"
            self._signatures[which, body, edge.joint] = known
        return known

    def mismatch(self, e: Edge, f: Edge, G: FloatArray, XC: FloatArray) -> tuple[float, float]:
        """How far (rad, m) the axes of two joints lie apart as lines, whichever way they point."""
        kind = family(self.a.joint(e).kind)
        if kind != family(self.b.joint(f).kind):
            return 0.0, 0.0
        if kind == "floating":  # goes anywhere, wherever it counts from
            return 0.0, 0.0
        if kind == "planar":
            normals = (T[:3, 2] for T in (G @ self.a.homes[e.joint + 1], XC @ self.b.homes[f.joint + 1]))
            return between_lines(*(Screw(normal, normal) for normal in normals), placed=False)
        s, t = self.a.screw(e).moved(G), self.b.screw(f).moved(XC)
        return between_lines(s, t, placed=kind == "turns")
