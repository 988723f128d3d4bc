"""Bound the distance between a frame of two models by branch and bound.

`urdfkin.model.mechanisms.upper_bound` adds the effects of all differences, each at its own worst
configuration. Where many things differ, that sum is too large. This module bounds D(q) = p_B - p_A in boxes
of all variables together. In a box with middle c and half widths h,

    |D(q)| <= max |D(c) + sum_i D_i(c) x_i| + (1/2) sum_ij M_ij h_i h_j,     |x_i| <= h_i.

Here M_ij bounds the second derivatives at every configuration. Boxes whose bound is small enough are
dropped. The others are halved.

M_ij is computed joint by joint. The derivative of a rotation about the axis u is the rotation, followed by
u x. Let y be the position of B's frame, and d its distance from A's frame. The derivatives of both are

    y_i = u' x (Y - o'),    d_i = u x (Y - e(S t) (y - d)) + (u' - u) x (Y - o') + u x (o - o'),

with Y = e(S' t') y. The joints in front transform these derivatives as free vectors
(`urdfkin.model.mechanisms.upper_bound`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from urdfkin.comparison.lower_bound import Search, urdfkins
from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, FramePair, Step
from urdfkin.model.mechanisms.mechanism import Screw
from urdfkin.model.mechanisms.upper_bound import (
    COARSE,
    Support,
    at_the_frame,
    before_it,
    behind_first,
    difference,
    passed,
    point,
)
from urdfkin.model.mechanisms.variables import Line, Pair, Variables
from urdfkin.model.pose import inverse, pose
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

_ORIGIN = np.zeros(3)
_Vectors = tuple[Support, Support]


def curvature(
    steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables, frame: FramePair
) -> tuple[list[str], FloatArray]:
    """Return names of variables, and bounds (variables, variables) of the second derivatives of D, metres.

    Bounds are inf where two variables move one pair of joints, or one variable moves them by two factors.
    """
    names = list(dict.fromkeys(line.variable for pair in pairs for line in (pair.a, pair.b) if line.slope))
    found = np.zeros((len(names), len(names)))
    for i, j, most in _second_derivatives(steps, pairs, variables, frame):
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


def _second_derivatives(
    steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables, frame: FramePair
) -> Iterator[tuple[int, int, float]]:
    """Yield i, j <= i and the largest second derivative by the values of joints i and j."""
    free = [_as_free_vectors(step) for step in steps]
    d, y = at_the_frame(frame, COARSE)
    for i in reversed(range(len(steps))):
        first = _derivatives(steps[i], pairs[i], variables, d, y)
        if steps[i].kind == "turns":
            yield i, i, _pass_to_front(_cross_products(free[i], *first), free[: i + 1], pairs, variables)
        vectors = before_it(free[i], *first)
        for j in reversed(range(i)):
            if steps[j].kind == "turns":
                second = _derivatives(free[j], pairs[j], variables, *vectors)
                yield i, j, _pass_to_front(second, free[: j + 1], pairs, variables)
                vectors = passed(free[j], pairs[j], variables, *vectors)
            else:
                vectors = before_it(free[j], *vectors)
        d, y = passed(steps[i], pairs[i], variables, d, y)


def _pass_to_front(
    vectors: _Vectors, steps: Sequence[Step], pairs: Sequence[Pair], variables: Variables
) -> float:
    """Return the largest d in front of all steps, from vectors behind the last step's L."""
    vectors = before_it(steps[-1], *vectors)
    for step, pair in zip(reversed(steps[:-1]), reversed(pairs[: len(steps) - 1]), strict=True):
        slides = step.kind != "turns"
        vectors = before_it(step, *vectors) if slides else passed(step, pair, variables, *vectors)
    return vectors[0].largest()


def _derivatives(step: Step, pair: Pair, variables: Variables, d: Support, y: Support) -> _Vectors:
    """Return the derivatives of d and y by a joint's value, behind its L."""
    if step.kind != "turns":
        u, other = step.axis.direction, step.other.direction
        return point(d.grid, other - u), point(d.grid, other)
    d, y = difference(step, pair, variables, y, d), y.turned(step.other, *variables.range(pair.b))
    return _cross_products(step, d, y)


def _cross_products(step: Step, d: Support, y: Support) -> _Vectors:
    """Return the cross products of u with d and of u' with y."""
    G, axis, other = d.grid.points, step.axis, step.other
    most = 0.0
    if other is not axis:
        reach = Support(d.grid, y.values - G @ other.point).largest()
        most = float(np.linalg.norm(other.direction - axis.direction)) * reach
        most += float(np.linalg.norm(np.cross(axis.direction, axis.point - other.point)))
    across, there = np.cross(G, axis.direction), np.cross(G, other.direction)
    bent = Support(d.grid, d.at(across) + most * d.grid.lengths)
    return bent, Support(d.grid, y.at(there) - there @ other.point)


def _as_free_vectors(step: Step) -> Step:
    """Return the step's effect on free vectors."""
    axis = Screw(step.axis.direction, _ORIGIN)
    other = axis if step.other is step.axis else Screw(step.other.direction, _ORIGIN)
    before = IDENTITY if step.before is IDENTITY else pose(step.before[:3, :3])
    return replace(step, axis=axis, other=other, before=before)


#: Largest number of boxes at a time: one or two seconds of a processor for a frame.
MOST = 2**17
#: Boxes computed in one batch: Jacobians of more would take gigabytes.
TOGETHER = 2**16


class Boxes:
    """Bounds of one frame's distance in boxes of configurations.

    Args:
        search: Both robots.
        frame: The frame.
        names: Names of the variables that move it: see `moved_together`.
    """

    def __init__(self, search: Search, frame: FramePair, names: Sequence[str]) -> None:
        self.search = search
        self.at = [search.names.index(name) for name in names]
        self.middle = search.ends.mean(axis=1)
        trees = [robot.tree for robot in search.robots]
        self.frames = trees[0].link_frames[frame.a], trees[1].link_frames[frame.b]
        # B's frame as a tool, expressed in A's root frame.
        q = search.configurations(self.middle[np.newaxis])[1]
        base = trees[1].link_frames[search.found.base[1]]
        self.seen = search.hold @ inverse(urdfkins(search.robots[1], q, [base])[0, 0])
        self.tool = inverse(frame.tool)[:3, 3]
        #: (nv, variables) derivatives of each robot's joint values by the variables.
        self.rates = [np.zeros((tree.nv, len(names))) for tree in trees]
        lines = {joint.name: Line(f"a:{joint.name}", 1.0, 0.0) for joint in trees[0].joints if joint.nv == 1}
        for rates, tree, own in zip(self.rates, trees, (lines, search.variables.leaders), strict=True):
            for joint, line in own.items():
                if line.variable in names:
                    rates[tree.v_index[tree.joint_index(joint)], names.index(line.variable)] = line.slope

    def bounds(self, c: FloatArray, h: FloatArray) -> FloatArray:
        """Bound |D + sum_i D_i x_i| over |x_i| <= h_i, (n,) for middles (n, variables)."""
        D, G = self.at_middles(c)
        size = np.sqrt((D * D).sum(axis=1))
        along = (D[:, :, np.newaxis] * G).sum(axis=1) / np.maximum(size, NOT_ZERO)[:, np.newaxis]
        across = np.sqrt(np.maximum((G * G).sum(axis=1) - along * along, 0.0))
        return np.asarray(np.hypot(size + np.abs(along) @ h, across @ h))

    def at_middles(self, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return D (n, 3) and its derivatives (n, 3, variables) at values (n, variables)."""
        z = np.tile(self.middle, (len(c), 1))
        z[:, self.at] = c
        (a, b), (q_a, q_b) = self.search.robots, self.search.configurations(z)
        p_a, J_a = self._origin(a, q_a, self.frames[0], np.zeros(3))
        p_b, J_b = self._origin(b, q_b, self.frames[1], self.tool)
        R, p = self.seen[:3, :3], self.seen[:3, 3]
        return p_b @ R.T + p - p_a, R @ (J_b @ self.rates[1]) - J_a @ self.rates[0]

    def _origin(
        self, robot: Robot, q: FloatArray, frame: str, tool: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the position (n, 3) of a frame's point, and its Jacobian (n, 3, nv)."""
        T, J = urdfkins(robot, q, [frame])[:, 0], robot.jacobian(q, frame, verify=False)
        if not tool.any():
            return T[:, :3, 3], J[:, :3]
        lever = T[:, :3, :3] @ tool
        return T[:, :3, 3] + lever, J[:, :3] + np.cross(J[:, 3:], lever[:, :, np.newaxis], axis=1)


def tightened(search: Search, frame: FramePair, target: float, upper: float, most: int = MOST) -> float:
    """Return a bound of a frame's distance, metres: `target` if it can be proven, else up to `upper`.

    Args:
        search: Both robots.
        frame: The frame.
        target: The bound to prove.
        upper: The bound that is proven already.
        most: Largest number of boxes at a time.
    """
    variables = search.variables
    steps, pairs = moved_together(search.found, variables, frame)
    some = [pair for pair in pairs if pair is not None]
    all_round = all(
        step.kind == "turns" and abs(line.slope) == 1.0
        for step, pair in zip(steps, some, strict=False)
        for line in (pair.a, pair.b)
        if line.slope and math.inf in np.abs(variables.ranges[line.variable])
    )
    if not target < upper < math.inf or len(some) < len(pairs) or not (all(search.stands) and all_round):
        return upper
    names, M = curvature(steps, some, variables, frame)
    boxes = Boxes(search, frame, names)
    ends = search.ends[boxes.at]
    c, h, proven = ends.mean(axis=1)[np.newaxis], (ends[:, 1] - ends[:, 0]) / 2.0, np.array([upper])
    if not np.isfinite(M).all() or 2 ** _halvings(h, M, upper) > most:
        return upper
    if not names:  # no joint of the path changes the distance
        return min(upper, float(boxes.bounds(c, h)[0]))
    while len(c) and 2 * len(c) <= most:
        i = _longest(h, M)
        h[i] /= 2.0
        c, proven = np.repeat(c, 2, axis=0), np.repeat(proven, 2)
        c[::2, i] -= h[i]
        c[1::2, i] += h[i]
        if (rest := 0.5 * float(h @ M @ h)) < upper:
            bounds = [boxes.bounds(c[k : k + TOGETHER], h) for k in range(0, len(c), TOGETHER)]
            proven = np.minimum(proven, np.concatenate(bounds) + rest)
            keep = proven > target
            c, proven = c[keep], proven[keep]
    return float(proven.max(initial=target))


def moved_together(
    found: Alignment, variables: Variables, frame: FramePair
) -> tuple[list[Step], list[Pair | None]]:
    """Return the steps to a frame, from the first that differs or shares a variable with one that does.

    A joint before the first difference rotates D and does not change its length. But its variable may also
    move a mimic joint behind the difference. Then D depends on both motions, and the step is included.
    """
    steps, pairs = found.path(frame.previous), [variables.pairs[i] for i in found.indices(frame.previous)]
    first = len(steps) - len(behind_first(found, variables, frame)[0])
    for i in reversed(range(first)):
        if _variables(pairs[i : i + 1]) & _variables(pairs[first:]):
            first = i  # the steps between have variables too
    return steps[first:], pairs[first:]


def _variables(pairs: Sequence[Pair | None]) -> set[str]:
    lines = (line for pair in pairs if pair is not None for line in (pair.a, pair.b))
    return {line.variable for line in lines if line.slope}


def _longest(h: FloatArray, M: FloatArray) -> int:
    """Return the index of the variable that contributes most to the second-order term."""
    return int((h * (M @ h)).argmax())


def _halvings(h: FloatArray, M: FloatArray, upper: float) -> int:
    """Return how often a box must be halved until its bound can be below `upper`."""
    h, count = h.copy(), 0
    while 0.5 * h @ M @ h >= upper:
        h[_longest(h, M)] /= 2.0
        count += 1
    return count
