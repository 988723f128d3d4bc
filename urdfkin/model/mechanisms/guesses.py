"""Where one model may have to be set for its axes to lie on another's: guesses to be tried, not results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import pi, remainder
from typing import TypeVar

import numpy as np

from urdfkin.model.mechanisms.mechanism import Edge, Mechanism, Screw
from urdfkin.model.mechanisms.rigid import ALONG, along, angle_from_to, between
from urdfkin.model.tree import FloatArray

_Some = TypeVar("_Some")
#: One of A and one of B.
Both = tuple[_Some, _Some]


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A joint's screw at home.

    Attributes:
        screw: Its line; that of a slide has no place.
        turns: Whether it turns.
        seen: The line that it is seen from.
    """

    screw: Screw
    turns: bool
    seen: Screw

    def moved(self, T: FloatArray) -> Axis:
        """The axis after a rigid motion."""
        return Axis(self.screw.moved(T), self.turns, self.seen.moved(T))

    def height(self, u: FloatArray) -> float | None:
        """How far along u (m) the nearest point of the line that it is seen from is; None where any is."""
        s, start = self.screw, self.seen
        along_s = float(start.direction @ s.direction)
        if not self.turns or 1.0 - along_s**2 < ALONG**2:
            return None
        way = s.point - start.point
        foot = float(way @ start.direction - along_s * (way @ s.direction)) / (1.0 - along_s**2)
        return float(u @ (start.point + foot * start.direction))


def zeros(u: Screw, ours: Axis, theirs: Axis, turns: bool) -> Iterator[float]:
    """By how much theirs must be turned about u, or slid along it, to lie as ours does."""
    if not turns:
        heights = ours.height(u.direction), theirs.height(u.direction)
        if heights[0] is not None and heights[1] is not None:
            yield heights[0] - heights[1]
        return
    s, t = ours.screw, theirs.screw
    guess = angle_from_to(u.direction, t.direction, s.direction)
    if guess is not None:
        yield guess
        yield remainder(guess + pi, 2.0 * pi)
    if ours.turns:
        feet = [line.point - line.direction * (line.direction @ (line.point - u.point)) for line in (t, s)]
        guess = angle_from_to(u.direction, feet[0] - u.point, feet[1] - u.point)
        if guess is not None:
            yield guess


def behind(
    mechanisms: Both[Mechanism], came: Both[Edge | None], bodies: Both[int], seen: Both[Screw]
) -> Iterator[Both[Axis]]:
    """Pairs of axes at two bodies, and behind the ones along a line, which move nothing seen from it."""
    for e, f in _led_on(mechanisms, came, bodies):
        axes = _axis(mechanisms[0], e, seen[0]), _axis(mechanisms[1], f, seen[1])
        yield axes
        screws = axes[0].screw, axes[1].screw
        if np.linalg.norm(np.cross(screws[0].direction, seen[0].direction)) < ALONG:
            beyond = e.beyond(bodies[0]), f.beyond(bodies[1])
            yield from behind(mechanisms, (e, f), beyond, screws if axes[0].turns else seen)


def laid(a: Mechanism, b: Mechanism, bodies: Both[int]) -> Iterator[FloatArray]:
    """Where B's root may stand for its axes to lie on A's: first axis on first, then by those behind it.

    What is left free is a turn about the first axis and a slide along it. Where nothing is behind, as of a
    rotor, those beside it tell.
    """
    firsts = _firsts((a, b), (None, None), bodies, ())
    for (ours, theirs), near, far in firsts:
        seen = far or [
            (replace(one, seen=ours.screw), replace(other, seen=theirs.screw)) for (one, other), *_ in firsts
        ]
        for start in (theirs.screw, theirs.screw.reversed()):
            K = between(start, ours.screw, turns=True)[0]
            for turn in _guesses(ours.screw, [*near, *seen], K, turns=True):
                X = along(ours.screw, turn, turns=True) @ K
                for way in _guesses(ours.screw, seen, X, turns=False):
                    yield along(ours.screw, way, turns=False) @ X


def _guesses(u: Screw, pairs: Sequence[Both[Axis]], X: FloatArray, *, turns: bool) -> list[float]:
    return [x for ours, theirs in pairs for x in zeros(u, ours, theirs.moved(X), turns)] or [0.0]


def _firsts(
    mechanisms: Both[Mechanism], came: Both[Edge | None], bodies: Both[int], near: tuple[Both[Axis], ...]
) -> list[tuple[Both[Axis], tuple[Both[Axis], ...], list[Both[Axis]]]]:
    """Pairs of first turning axes, with slides before them and what is behind; of slides where none turns."""
    found = list[tuple[Both[Axis], tuple[Both[Axis], ...], list[Both[Axis]]]]()
    for e, f in _led_on(mechanisms, came, bodies):
        pair, beyond = (
            (_axis(mechanisms[0], e), _axis(mechanisms[1], f)),
            (e.beyond(bodies[0]), f.beyond(bodies[1])),
        )
        lines = pair[0].screw, pair[1].screw
        deeper = [] if pair[0].turns else _firsts(mechanisms, (e, f), beyond, (*near, pair))
        found += deeper or [(pair, near, list(behind(mechanisms, (e, f), beyond, lines)))]
    return found


def _led_on(mechanisms: Both[Mechanism], came: Both[Edge | None], bodies: Both[int]) -> Iterator[Both[Edge]]:
    """All pairs of joints with axes that lead on from two bodies and move alike."""
    ours, theirs = (
        [edge for edge in mechanism.edges_of[body] if edge is not by and mechanism.joint(edge).kind.has_axis]
        for mechanism, by, body in zip(mechanisms, came, bodies, strict=True)
    )
    for e, f in product(ours, theirs):
        if _axis(mechanisms[0], e).turns is _axis(mechanisms[1], f).turns:
            yield e, f


def _axis(mechanism: Mechanism, edge: Edge, seen: Screw | None = None) -> Axis:
    screw = mechanism.screw(edge)
    return Axis(screw, mechanism.joint(edge).kind.turns, seen or screw)
