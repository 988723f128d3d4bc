"""Where one model may have to be set for its axes to lie on another's: guesses to be tried, not results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
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


def laid_by_siblings(
    a: Mechanism, b: Mechanism, bodies: Both[int], alike: Callable[[Edge, Edge], bool]
) -> Iterator[FloatArray]:
    """Where B's root may stand for three axes of one body to lie on three of A's, whatever is behind them.

    Args:
        a: One.
        b: The other.
        bodies: Of both, with several joints each.
        alike: Whether a joint of A may be one of B.
    """
    edges = _with_axes(a, bodies[0])
    ours = [_axis(a, edge) for edge in edges]
    turning = [i for i, axis in enumerate(ours) if axis.turns]
    if len(edges) < 2 or not turning:
        return
    first = turning[0]
    u = ours[first].screw
    rest = sorted((i for i in range(len(edges)) if i != first), key=lambda i: -_across(u, ours[i].screw))
    second, others = rest[0], [i for i in rest[1:] if ours[i].turns][:1]
    theirs = [[(f, _axis(b, f)) for f in _with_axes(b, bodies[1]) if alike(edge, f)] for edge in edges]
    for f, axis in theirs[first]:
        lines = u, axis.screw
        pair_of = partial(_seen_from, lines)
        beyond = edges[first].beyond(bodies[0]), f.beyond(bodies[1])
        far = list(behind((a, b), (edges[first], f), beyond, lines))
        for start, (g, other) in product((axis.screw, axis.screw.reversed()), theirs[second]):
            if g is f:
                continue
            pair = pair_of(ours[second], other)
            more = [
                pair_of(ours[i], one) for i in others for h, one in theirs[i] if h is not f and h is not g
            ]
            if not ours[second].turns:  # a slide across the first axis leaves heights along it as they are
                carried = edges[second].beyond(bodies[0]), g.beyond(bodies[1])
                led = _led_on((a, b), (edges[second], g), carried)
                more += [pair_of(_axis(a, e), _axis(b, h)) for e, h in led]
            K = between(start, u, turns=True)[0]
            for turn in zeros(u, pair[0], pair[1].moved(K), turns=True):
                X = along(u, turn, turns=True) @ K
                ways = list(zeros(u, pair[0], pair[1].moved(X), turns=False))
                for way in ways or _guesses(u, [*more, *far], X, turns=False):
                    yield along(u, way, turns=False) @ X


def _seen_from(lines: Both[Screw], ours: Axis, theirs: Axis) -> Both[Axis]:
    return replace(ours, seen=lines[0]), replace(theirs, seen=lines[1])


def _with_axes(mechanism: Mechanism, body: int) -> list[Edge]:
    return [edge for edge in mechanism.edges_of[body] if mechanism.joint(edge).kind.has_axis]


def _across(u: Screw, s: Screw) -> float:
    """The sine of the angle between two axes."""
    return float(np.linalg.norm(np.cross(u.direction, s.direction)))


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
