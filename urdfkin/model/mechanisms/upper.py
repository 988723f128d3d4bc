"""How far apart a frame of two models can be at most: proven for all configurations at once.

Behind joint i, seen from A's home, let y be where B's frame is and d how far B's is from A's. In front of it

    d' = (L - 1) e(S' t') y  +  (e(S' t') - e(S t')) y  +  (e(S t') - e(S t)) y  +  e(S t) d.

All but the last are nothing where nothing differs. For each direction u the largest u . d' is at most the sum
of the largest of each term, which support functions of y and d give (`urdfkin.model.mechanisms.support`).
Where a single thing differs there is one term, and nothing is given away but what the grid costs; where
several do, each may have its own worst configuration, and the bound is larger than the truth by what they do
not share. Where nothing is but moved, the lengths of the ways add up to a bound that costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from urdfkin.kinematics.rotation.axis_angle import rotation_about
from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, FramePair, Step
from urdfkin.model.mechanisms.mechanism import Screw
from urdfkin.model.mechanisms.rigid import apart
from urdfkin.model.mechanisms.support import Grid, Support, point
from urdfkin.model.mechanisms.variables import Pair, Variables
from urdfkin.model.tree import FloatArray

#: For every frame; for the one that is farthest.
COARSE, FINE = Grid(8, 24), Grid(16, 48)
#: A joint that turns more often is bounded as a whole.
MOST_VALUES = 1024


def upper_bounds(
    found: Alignment, variables: Variables, frame: FramePair, grid: Grid = COARSE
) -> tuple[float, float]:
    """(m, rad) that a frame's places, and its orientations, are apart at most, within limits.

    0 where nothing on its way differs; inf where a joint that nothing bounds lets it grow, or a joint is of
    another kind.
    """
    steps, pairs = behind_first(found, variables, frame)
    if not steps and frame.end is IDENTITY:
        return 0.0, 0.0
    if any(step.unlike and pair is None for step, pair in zip(steps, pairs, strict=True)):
        return math.inf, math.inf
    radians = _radians(steps, pairs, variables, frame)
    if not steps:  # nothing that moves it one way in A and another in B: as far off everywhere
        d = frame.end[:3, :3] @ frame.home[:3, 3] + frame.end[:3, 3] - frame.home[:3, 3]
        return float(np.linalg.norm(d)), radians
    return _metres(steps, pairs, variables, frame, grid), radians


def behind_first(
    found: Alignment, variables: Variables, frame: FramePair
) -> tuple[list[Step], list[Pair | None]]:
    """The steps on the way to a frame, and their values, from the first one that differs."""
    steps = found.path(frame.previous)
    pairs = [variables.pairs[i] for i in found.indices(frame.previous)]
    first = next((i for i, (s, p) in enumerate(zip(steps, pairs, strict=True)) if _differs(s, p)), len(steps))
    return steps[first:], pairs[first:]


def _differs(step: Step, pair: Pair | None) -> bool:
    return step.differs or bool(step.unlike) or (pair is not None and pair.a != pair.b)


def _radians(
    steps: Sequence[Step], pairs: Sequence[Pair | None], variables: Variables, frame: FramePair
) -> float:
    """The angle of a product of rotations is at most the sum of theirs."""
    total = apart(IDENTITY, frame.end)[0]
    for step, pair in zip(steps, pairs, strict=True):
        total += apart(IDENTITY, step.before)[0]
        if step.kind != "turns" or pair is None:
            continue
        if step.other is not step.axis:
            # Q R Q^T R^T, of a turn by t and a tilt by s: sin(its quarter) = sin(s/2) sin(t/2).
            most = min(max(map(abs, variables.range(pair.b))), math.pi)
            total += 4.0 * math.asin(math.sin(step.tilt / 2.0) * math.sin(most / 2.0))
        if pair.a != pair.b:
            total += variables.off(pair)
    return min(total, math.pi)


def _metres(
    steps: Sequence[Step], pairs: Sequence[Pair | None], variables: Variables, frame: FramePair, grid: Grid
) -> float:
    d, y = at_the_frame(frame, grid)
    ways = _off(frame.end, y.largest())
    for step, pair in zip(reversed(steps), reversed(pairs), strict=True):
        d, y = passed(step, pair, variables, d, y)
        moves_alike = step.other is step.axis and pair is not None and pair.a == pair.b
        ways += _off(step.before, y.largest()) if moves_alike else math.inf
    return min(d.largest(), ways)


def _off(L: FloatArray, reach: float) -> float:
    """How far (m) L moves any point within reach at most: |(R - 1) y + p|, y before L or behind it."""
    turned, moved = float(np.linalg.norm(L[:3, :3] - np.eye(3))), float(np.linalg.norm(L[:3, 3]))
    return moved + turned * reach if turned else moved


def at_the_frame(frame: FramePair, grid: Grid) -> tuple[Support, Support]:
    """D and y behind the last joint."""
    p, end = frame.home[:3, 3], frame.end
    y = end[:3, :3] @ p + end[:3, 3]
    return point(grid, y - p), point(grid, y)


def passed(
    step: Step, pair: Pair | None, variables: Variables, d: Support, y: Support
) -> tuple[Support, Support]:
    """D and y in front of a step, from those behind it."""
    if pair is None:  # a planar or floating joint may turn to where it is worst, and go anywhere
        d = Support(d.grid, d.largest() * d.grid.lengths)
        y = Support(d.grid, np.full(len(d.grid.points), math.inf))
    else:
        d = difference(step, pair, variables, y, d)
        ends = variables.range(pair.b)
        y = y.turned(step.other, *ends) if step.kind == "turns" else y.slid(step.other.direction, *ends)
    return before_it(step, d, y)


def before_it(step: Step, d: Support, y: Support) -> tuple[Support, Support]:
    """D and y in front of a step's L."""
    if step.before is IDENTITY:
        return d, y
    G, L = d.grid.points, step.before
    return Support(d.grid, d.values + y.at(G @ (L[:3, :3] - np.eye(3))) + G @ L[:3, 3]), y.moved(L)


def difference(step: Step, pair: Pair, variables: Variables, y: Support, d: Support) -> Support:
    """Of (e(S' t') - e(S t)) y + e(S t) d, over what t and t' range over."""
    same = step.other is step.axis and pair.a == pair.b
    if step.kind == "turns":
        about = Screw(step.axis.direction, np.zeros(3))
        if same:
            return d.turned(about, *variables.range(pair.a)) if d.values.any() else d
        z = _values(pair, variables, d.grid)
        if z is not None:
            return _together(step, pair, z, y, d)
        return d.turned(about, *variables.range(pair.a)) + _set_off(step, pair, variables, y)
    return d if same else d + _slid_apart(step, pair, variables, y.grid)


def _slid_apart(step: Step, pair: Pair, variables: Variables, grid: Grid) -> Support:
    """Of two slides' difference, which is largest at the ends of their ranges."""
    if (name := pair.variable) is not None:
        ends = [(z, z) for z in variables.ranges.get(name, (0.0, 0.0))]
        values = [
            tuple(
                line.constant + (line.slope and line.slope * z)
                for line, z in zip((pair.a, pair.b), zz, strict=True)
            )
            for zz in ends
        ]
    else:
        values = [(t, other) for t in variables.range(pair.a) for other in variables.range(pair.b)]
    with np.errstate(invalid="ignore"):
        found = [
            grid.points @ step.other.direction * other - grid.points @ step.axis.direction * t
            for t, other in values
        ]
    worst = np.max(found, axis=0)
    return Support(grid, np.where(np.isnan(worst), np.inf, worst))


def _values(pair: Pair, variables: Variables, grid: Grid) -> FloatArray | None:
    """(n,) values of the variable that moves a turning joint in both models; None where one is not enough."""
    if (name := pair.variable) is None:
        return None
    low, high = variables.ranges[name]
    fastest = max(abs(pair.a.slope), abs(pair.b.slope))
    if math.isinf(high - low):
        if {abs(pair.a.slope), abs(pair.b.slope)} - {0.0, 1.0}:
            return None
        low, high = -math.pi, math.pi
    count = max(1, math.ceil(fastest * (high - low) / math.pi * grid.segments))
    return np.linspace(low, high, count + 1) if count <= MOST_VALUES else None


def _together(step: Step, pair: Pair, z: FloatArray, y: Support, d: Support) -> Support:
    """The same where one variable moves both: from each of its values to the next, the larger ends.

    Between two values h apart a function exceeds both by h^2/8 of its second derivative at most. Where t' = t
    + c that is R' P' x' - R P x, with x the way from the axis to y, P what takes its part across, and R' a
    turn about the other axis: |R' - R| <= 2 |u' - u| + |c|, |P' - P| <= |u' - u|, and x' - x lies across by
    what the axes are off. Else it is no more than what either turn has, squared with its rate.
    """
    G = y.grid.points
    axis, other = step.axis, step.other
    t, t_other = (line.constant + line.slope * z for line in (pair.a, pair.b))
    turns = [rotation_about(screw.direction, values) for screw, values in ((axis, t), (other, t_other))]
    D = turns[1] - turns[0]
    c = (other.point - turns[1] @ other.point) - (axis.point - turns[0] @ axis.point)
    apart_ = y.at(G @ D) + (G @ c.T).T
    widest = y.radius(other)
    if pair.a.slope == pair.b.slope:
        tilt = float(np.linalg.norm(other.direction - axis.direction))
        reach = Support(y.grid, y.values - G @ other.point).largest() if tilt else 0.0
        off = float(np.linalg.norm(np.cross(other.point - axis.point, axis.direction)))
        late = abs(pair.b.constant - pair.a.constant)
        bend = (2.0 * tilt + min(late, 2.0)) * widest + tilt * reach + off
        bend *= pair.a.slope**2
    else:
        bend = pair.a.slope**2 * y.radius(axis) + pair.b.slope**2 * widest
    between = np.maximum(apart_[:-1], apart_[1:]) + bend * (z[1] - z[0]) ** 2 / 8.0 * y.grid.lengths
    if d.values.any():
        half = abs(pair.a.slope) * (z[1] - z[0]) / 2.0
        ends = d.turned_back(axis.direction, t, 1.0)
        middles = d.turned_back(axis.direction, (t[:-1] + t[1:]) / 2.0, 1.0 / math.cos(half))
        between += np.maximum(np.maximum(ends[:-1], ends[1:]), middles)
    return Support(y.grid, between.max(axis=0))


def _set_off(step: Step, pair: Pair, variables: Variables, y: Support) -> Support:
    """Of (e(S' t') - e(S t)) y where t' and t are moved by two variables, or by one without end.

    Set off along a chord by what the values differ by; where the axis is another one too, all of either turn.
    """
    G, u = y.grid.points, step.axis.direction
    if step.other is not step.axis:
        there = y.turned(step.other, *variables.range(pair.b))
        back = Support(y.grid, y.values).turned(step.axis, *variables.range(pair.a))
        return Support(y.grid, there.values + back.at(-G))
    chord = 2.0 * math.sin(min(variables.off(pair), math.pi) / 2.0) * y.radius(step.axis)
    across = G - (G @ u)[:, None] * u
    return Support(y.grid, chord * np.linalg.norm(across, axis=1))
