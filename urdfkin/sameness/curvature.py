"""How fast the distance of a frame of two models bends: second derivatives, bounded everywhere.

With D = p_B - p_A, what a joint does to D it does again to a derivative of D: a turn's derivative is the
turn, and then u x. So y, where B's frame is, and d, how far it is from A's, give way to

    y_i = u' x (Y - o'),    d_i = u x (Y - e(S t) (y - d)) + (u' - u) x (Y - o') + u x (o - o'),

with Y = e(S' t') y, and these pass the joints in front as vectors that have no place
(`urdfkin.model.mechanisms.upper`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from urdfkin.model.mechanisms.alignment import IDENTITY, FramePair, Step
from urdfkin.model.mechanisms.mechanism import Screw
from urdfkin.model.mechanisms.support import Support, point
from urdfkin.model.mechanisms.upper import COARSE, at_the_frame, before_it, difference, passed
from urdfkin.model.mechanisms.variables import Pair, Variables
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray

_ORIGIN = np.zeros(3)
_Vectors = tuple[Support, Support]


def curvature(
    steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables, frame: FramePair
) -> tuple[list[str], FloatArray]:
    """Names of variables, and (variables, variables) what second derivatives of D are at most, metres.

    inf where a joint's values are moved by two variables, or by one at two rates.
    """
    names = list(dict.fromkeys(line.variable for pair in pairs for line in (pair.a, pair.b) if line.slope))
    found = np.zeros((len(names), len(names)))
    for i, j, most in _bends(steps, pairs, variables, frame):
        if not most:
            continue
        if not all(pairs[k].a.slope and pairs[k].a.slope == pairs[k].b.slope for k in (i, j)):
            return names, np.full_like(found, math.inf)
        bend = most * abs(pairs[i].a.slope * pairs[j].a.slope)
        at, to = (names.index(pairs[k].a.variable) for k in (i, j))
        found[at, to] += bend
        if i != j:
            found[to, at] += bend
    return names, found


def _bends(
    steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables, frame: FramePair
) -> Iterator[tuple[int, int, float]]:
    """For two steps, i not in front of j, the largest second derivative by the joints' values."""
    free = [_without_place(step) for step in steps]
    d, y = at_the_frame(frame, COARSE)
    for i in reversed(range(len(steps))):
        first = _derived(steps[i], pairs[i], variables, d, y)
        if steps[i].kind == "turns":
            yield i, i, _in_front(_crossed(free[i], *first), free[: i + 1], pairs, variables)
        vectors = before_it(free[i], *first)
        for j in reversed(range(i)):
            if steps[j].kind == "turns":
                second = _derived(free[j], pairs[j], variables, *vectors)
                yield i, j, _in_front(second, free[: j + 1], pairs, variables)
                vectors = passed(free[j], pairs[j], variables, *vectors)
            else:
                vectors = before_it(free[j], *vectors)
        d, y = passed(steps[i], pairs[i], variables, d, y)


def _in_front(vectors: _Vectors, steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables) -> float:
    """The largest d in front of all steps, of vectors behind the last one's L."""
    vectors = before_it(steps[-1], *vectors)
    for step, pair in zip(reversed(steps[:-1]), reversed(pairs[: len(steps) - 1]), strict=True):
        slides = step.kind != "turns"
        vectors = before_it(step, *vectors) if slides else passed(step, pair, variables, *vectors)
    return vectors[0].largest()


def _derived(step: Step, pair: Pair, variables: Variables, d: Support, y: Support) -> _Vectors:
    """The derivatives of both by a joint's value, behind its L."""
    if step.kind != "turns":
        u, other = step.axis.direction, step.other.direction
        return point(d.grid, other - u), point(d.grid, other)
    d, y = difference(step, pair, variables, y, d), y.turned(step.other, *variables.range(pair.b))
    return _crossed(step, d, y)


def _crossed(step: Step, d: Support, y: Support) -> _Vectors:
    """U x both."""
    G, axis, other = d.grid.points, step.axis, step.other
    most = 0.0
    if other is not axis:
        reach = Support(d.grid, y.values - G @ other.point).largest()
        most = float(np.linalg.norm(other.direction - axis.direction)) * reach
        most += float(np.linalg.norm(np.cross(axis.direction, axis.point - other.point)))
    across, there = np.cross(G, axis.direction), np.cross(G, other.direction)
    bent = Support(d.grid, d.at(across) + most * d.grid.lengths)
    return bent, Support(d.grid, y.at(there) - there @ other.point)


def _without_place(step: Step) -> Step:
    """What a step does to vectors."""
    axis = Screw(step.axis.direction, _ORIGIN)
    other = axis if step.other is step.axis else Screw(step.other.direction, _ORIGIN)
    before = IDENTITY if step.before is IDENTITY else pose(step.before[:3, :3])
    return replace(step, axis=axis, other=other, before=before)
