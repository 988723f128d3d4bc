"""Compute lower and upper bounds on the largest distance between a frame's positions in two models.

**Lower bound.** `DistanceSearch` starts at the sampled configurations with the largest distances, and varies
one coordinate at a time. The largest distance found is a lower bound.

**Upper bound.** `urdfkin.model.mechanisms.upper_bound` adds up the largest effects of all differences between
the models. These effects can be largest in different configurations, so their sum can be far above the
largest distance. `tighten` proves a smaller bound by branch and bound. It divides the ranges of the variables
into boxes, and bounds the distance in each box by a Taylor polynomial and its remainder.

    D(q) = p_B - p_A              difference of the frame's positions in B and A
    D_i                           derivative of D with respect to variable i
    c                             middle of the box
    c_i - h_i to c_i + h_i        range of variable i in the box
    c_i + x_i,  |x_i| <= h_i      value of variable i at a configuration q in the box
    M_ij                          bound on the length of the second derivative of D with respect to variables
                                  i and j, for every configuration (`curvature_bounds`)

    |D(q)| <= max over |x_i| <= h_i of |D(c) + sum_i D_i(c) x_i| + (1/2) sum_ij M_ij h_i h_j

A box is finished if its bound is at most the target. All other boxes are halved along the same variable. If
all boxes are finished, `tighten` returns the target. If the maximum number of boxes is reached first,
`tighten` returns the largest bound of the unfinished boxes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from urdfkin.compiled.evaluate import jacobians, placements
from urdfkin.compiled.plan import CompiledTree
from urdfkin.kinematics.roundings import EPS, MIMIC_LIMIT_ROUNDINGS, MIN_DIVISOR
from urdfkin.model.configuration import ASSUMED_LIMIT, neutral, sample, with_unit_quaternions
from urdfkin.model.mechanisms.mechanism import (
    Alignment,
    FramePair,
    LinearFunction,
    Variables,
    pose_difference,
)
from urdfkin.model.mechanisms.upper_bound import curvature_bounds, relevant_joints
from urdfkin.model.tree import FloatArray, inverse
from urdfkin.robot import Robot
from urdfkin.verify.oracle import QueryBatch

#: Number of configurations that are sampled uniformly within the joint ranges.
RANDOM_SAMPLES = 512
#: Number of random configurations at corners of the joint ranges.
CORNER_SAMPLES = 128
#: Number of starting points of the search for one frame.
STARTING_POINTS = 4
#: Number of values that one step of the search tries for one coordinate.
TRIALS_PER_STEP = 13
FRAMES_PER_BATCH = 24
#: Width of the search interval in each round, as a fraction of the coordinate's range.
SEARCH_WIDTHS = (1.0, 1.0, 0.5, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001)

#: Function that computes the poses (n, frames, 4, 4) of a robot's frames at q.
PoseFunction = Callable[[Robot, FloatArray, Sequence[str]], FloatArray]


class DistanceSearch:
    """Search for the largest frame distances.

    Args:
        as_written: True: B's root has a constant pose in A's root frame. False: B's base link has a constant
            pose in the frame of A's base link.
    """

    def __init__(
        self,
        robots: tuple[Robot, Robot],
        alignment: Alignment,
        variables: Variables,
        seed: int = 0,
        *,
        as_written: bool = False,
    ) -> None:
        self.robots, self.alignment, self.variables = robots, alignment, variables
        self.names = list(variables.ranges)
        self.ends = np.array([self._ends(name) for name in self.names]).reshape(-1, 2)
        self.rng = np.random.default_rng(seed)
        #: (4, 4) pose of B's base link in A's root frame, for A's zero configuration.
        self.T_root_base = alignment.X @ alignment.b.zero_poses[alignment.base[1]]
        #: For A and for B: whether the base link belongs to the same rigid body as the root link.
        self.base_fixed = tuple(
            m.body_of[link] == 0 for m, link in zip((alignment.a, alignment.b), alignment.base, strict=True)
        )
        #: Whether a moving joint between a robot's root and its base link changes the distances. If so, the
        #: bounds of `upper_bounds` and `tighten` are not valid.
        self.unbounded = as_written and not all(self.base_fixed)

    def _ends(self, name: str) -> tuple[float, float]:
        low, high = self.variables.ranges[name]
        tree = self.robots[name.startswith("b:")].tree
        widest = math.pi if tree.joints[tree.joint_index(name[2:])].kind.turns else ASSUMED_LIMIT
        if math.isinf(low) and math.isinf(high):
            return -widest, widest
        return (high - 2.0 * widest if math.isinf(low) else low), (
            low + 2.0 * widest if math.isinf(high) else high
        )

    def configurations(
        self, z: FloatArray, *, random_free_joints: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Return configurations of A and B.

        Args:
            z: (n, variables) values of the variables.
            random_free_joints: Whether A's planar and floating joints have random coordinates instead of
                neutral ones.

        Returns:
            (n, nq) configurations of both robots.
        """
        values = dict(zip(self.names, z.T, strict=True))
        tree_a, tree_b = (robot.tree for robot in self.robots)
        q_a = (
            sample(tree_a, len(z), self.rng) if random_free_joints else np.tile(neutral(tree_a), (len(z), 1))
        )
        q_b = np.tile(neutral(tree_b), (len(z), 1))
        for step in self.alignment.steps:
            joint = tree_a.joints[step.a]
            if joint.kind.nq > 1 and not step.kind_difference:
                at, to = tree_a.q_index[step.a], tree_b.q_index[step.b]
                own = q_a[:, at : at + joint.kind.nq]
                converted = own if step.conversion is None else step.conversion(joint.kind, own)
                q_b[:, to : to + joint.kind.nq] = converted
        for joint, at in zip(tree_a.joints, tree_a.q_index, strict=True):
            if joint.nq == 1:
                q_a[:, at] = values.get(f"a:{joint.name}", 0.0)
        for name, line in self.variables.coordinates_b.items():
            q_b[:, tree_b.q_index[tree_b.joint_index(name)]] = line.evaluate(values)
        return q_a, q_b

    def correspond(self, q_a: FloatArray, q_b: FloatArray) -> bool:
        """Return whether `q_a` (1, nq) of A and `q_b` (1, nq) of B are corresponding configurations.

        Each variable must be within its range in `ends`. A's planar and floating joints must be neutral.
        """
        sizes = tuple(robot.nq for robot in self.robots)
        if (q_a.shape, q_b.shape) != ((1, sizes[0]), (1, sizes[1])):
            return False
        z = np.zeros((1, len(self.names)))
        for k, name in enumerate(self.names):
            tree, q = (self.robots[0].tree, q_a) if name.startswith("a:") else (self.robots[1].tree, q_b)
            z[0, k] = q[0, tree.q_index[tree.joint_index(name[2:])]]
        low, high = self.ends.T
        rounding = EPS * MIMIC_LIMIT_ROUNDINGS * (1.0 + np.maximum(np.abs(low), np.abs(high)))
        alike = all(
            (np.abs(expected - q) <= EPS * MIMIC_LIMIT_ROUNDINGS * (1.0 + np.abs(expected))).all()
            for expected, q in zip(self.configurations(z), (q_a, q_b), strict=True)
        )
        return alike and bool((low - rounding <= z).all() and (z <= high + rounding).all())

    def poses(self, z: FloatArray, frames: Sequence[FramePair]) -> tuple[FloatArray, FloatArray]:
        return self.poses_at(*self.configurations(z), frames, own_poses)

    def poses_at(
        self, q_a: FloatArray, q_b: FloatArray, frames: Sequence[FramePair], compute_poses: PoseFunction
    ) -> tuple[FloatArray, FloatArray]:
        """Return poses (n, frames, 4, 4) of A's frames and of B's frames, all in A's root frame.

        B's poses do not include the transform `FramePair.tool`.
        """
        a, b = self.robots
        Ts_a = compute_poses(a, q_a, [a.tree.link_frames[frame.a] for frame in frames])
        base = b.tree.link_frames[self.alignment.base[1]]
        Ts_b = compute_poses(b, q_b, [base, *(b.tree.link_frames[frame.b] for frame in frames)])
        tools = np.array([inverse(frame.tool) for frame in frames]).reshape(-1, 4, 4)
        if self.unbounded:
            return Ts_a, self.alignment.X @ Ts_b[:, 1:] @ tools
        T_root_base = self.T_root_base
        if not self.base_fixed[0]:
            link = self.alignment.base[0]
            moved = compute_poses(a, q_a, [a.tree.link_frames[link]])
            T_root_base = moved @ inverse(self.alignment.a.zero_poses[link]) @ T_root_base
        return Ts_a, T_root_base @ np.linalg.inv(Ts_b[:, :1]) @ Ts_b[:, 1:] @ tools

    def distances_at(
        self, q_a: FloatArray, q_b: FloatArray, frames: Sequence[FramePair], compute_poses: PoseFunction
    ) -> FloatArray:
        a, b = self.poses_at(q_a, q_b, frames, compute_poses)
        return np.asarray(np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1))

    def random_values(self, n: int) -> FloatArray:
        low, high = self.ends.T
        return np.asarray(low + (high - low) * self.rng.random((n, len(self.names))))

    def distances(self, z: FloatArray, frames: Sequence[FramePair]) -> FloatArray:
        """Return the frame distances (n, frames), m."""
        return self.distances_at(*self.configurations(z), frames, own_poses)

    def sample_distances(self, frames: Sequence[FramePair]) -> tuple[FloatArray, FloatArray]:
        """Return distances (n, frames), m, and the sampled values (n, variables) of the variables."""
        low, high = self.ends.T
        z = self.random_values(RANDOM_SAMPLES)
        corners = np.where(self.rng.random((CORNER_SAMPLES, len(self.names))) < 0.5, low, high)
        z = np.concatenate((np.clip(np.zeros((1, len(self.names))), low, high), corners, z))
        return self.distances(z, frames), z

    def largest_distances(self, frames: Sequence[FramePair]) -> list[tuple[float, FloatArray]]:
        largest: list[tuple[float, FloatArray]] = []
        for first in range(0, len(frames), FRAMES_PER_BATCH):
            batch = frames[first : first + FRAMES_PER_BATCH]
            distances, z = self.sample_distances(batch)
            largest += self._maximize(batch, z[np.argsort(-distances, axis=0)[:STARTING_POINTS].T])
        return largest

    def values_of_largest_rotation(self, frame: FramePair) -> FloatArray:
        z = self.sample_distances([frame])[1]
        Ts_a, Ts_b = self.poses(z, [frame])
        turned = [pose_difference(T, other)[0] for T, other in zip(Ts_a[:, 0], Ts_b[:, 0], strict=True)]
        return np.asarray(z[int(np.argmax(turned))])

    def _maximize(self, frames: Sequence[FramePair], z: FloatArray) -> list[tuple[float, FloatArray]]:
        """Maximize each frame's distance, starting at `z` (frames, starting points, variables)."""
        variables = [self._variables_of(frame) for frame in frames]
        low, high = self.ends.T
        k, s = np.ogrid[: len(frames), : z.shape[1]]
        best = self._distances_per_frame(z[:, :, np.newaxis], frames)[..., 0]
        steps = np.linspace(-0.5, 0.5, TRIALS_PER_STEP)
        for width in SEARCH_WIDTHS:
            for turn in range(max(map(len, variables))):
                i = np.array([indices[turn % len(indices)] if indices else 0 for indices in variables])
                span = (high - low)[i][:, np.newaxis]
                middle = ((low + high) / 2.0)[i][:, np.newaxis] if width == 1.0 else z[k, s, i[:, np.newaxis]]
                values = middle[..., np.newaxis] + width * span[..., np.newaxis] * steps
                values = np.clip(
                    values, low[i][:, np.newaxis, np.newaxis], high[i][:, np.newaxis, np.newaxis]
                )
                tried = np.repeat(z[:, :, np.newaxis], TRIALS_PER_STEP, axis=2)
                place = k[..., np.newaxis], s[..., np.newaxis], np.arange(TRIALS_PER_STEP)
                tried[*place, i[:, np.newaxis, np.newaxis]] = values
                distances = self._distances_per_frame(tried, frames)
                best_trial = distances.argmax(axis=2)
                better = distances[k, s, best_trial] > best
                z = np.where(better[..., np.newaxis], tried[k, s, best_trial], z)
                best = np.where(better, distances[k, s, best_trial], best)
        best_start = best.argmax(axis=1)
        return [(float(best[n, m]), z[n, m]) for n, m in enumerate(best_start)]

    def _distances_per_frame(self, z: FloatArray, frames: Sequence[FramePair]) -> FloatArray:
        """Return the distance (m) of each frame k at the values `z[k]` of the variables.

        The shape of `z` is (frames, starting points, trials, variables).
        """
        # Without variables, `z.reshape(-1, 0)` would raise an error.
        flat = z.reshape(math.prod(z.shape[:-1]), z.shape[-1])
        distances = self.distances(flat, frames).reshape(*z.shape[:-1], len(frames))
        n = np.arange(len(frames))
        return np.asarray(distances[n, :, :, n])

    def _variables_of(self, frame: FramePair) -> list[int]:
        steps = set(self.alignment.indices(frame.previous))
        names = {
            line.variable
            for i, pair in enumerate(self.variables.pairs)
            if pair is not None and i in steps
            for line in (pair.a, pair.b)
            if line.slope
        }
        trees = self.robots[0].tree, self.robots[1].tree
        for step in (self.alignment.steps[i] for i in steps):
            if step.kind_difference == "kind":
                names |= {f"a:{trees[0].joints[step.a].name}", f"b:{trees[1].joints[step.b].name}"}
        return [i for i, name in enumerate(self.names) if name in names]


def own_poses(robot: Robot, q: FloatArray, frames: Sequence[str]) -> FloatArray:
    return placements(*_plan_and_q(robot, q, frames))


def _plan_and_q(robot: Robot, q: FloatArray, frames: Sequence[str]) -> tuple[CompiledTree, FloatArray]:
    tree = robot.tree
    return robot.plan([tree.frame_link(frame) for frame in frames]), with_unit_quaternions(tree, q)


def pinocchio_poses(robot: Robot, q: FloatArray, frames: Sequence[str]) -> FloatArray:
    return robot.verifier.oracle().placements(QueryBatch(frames, (q,)))


#: Maximum number of boxes in memory. With this number of boxes, `tighten` takes one or two seconds per frame.
MAX_BOXES = 2**17
#: Number of boxes in one batch. The Jacobians take 48 bytes for each box and coordinate. The 2^22 boxes of
#: `recheck` would take gigabytes in one batch.
BOXES_PER_BATCH = 2**16


class BoxBounds:
    """Bound the linear part of a frame's distance in each box: `|D + sum_i D_i x_i|`.

    Args:
        names: Every variable that changes the distance.
    """

    def __init__(self, search: DistanceSearch, frame: FramePair, names: Sequence[str]) -> None:
        self.search = search
        self.at = [search.names.index(name) for name in names]
        self.middle = search.ends.mean(axis=1)
        trees = [robot.tree for robot in search.robots]
        self.frames = trees[0].link_frames[frame.a], trees[1].link_frames[frame.b]
        q = search.configurations(self.middle[np.newaxis])[1]
        base = trees[1].link_frames[search.alignment.base[1]]
        #: (4, 4) pose of B's root in A's root frame.
        self.T_a_b = search.T_root_base @ inverse(own_poses(search.robots[1], q, [base])[0, 0])
        self.tool = inverse(frame.tool)[:3, 3]
        #: Derivatives of each robot's coordinates with respect to the variables: two (nv, variables) arrays.
        self.rates = [np.zeros((tree.nv, len(names))) for tree in trees]
        lines = {
            joint.name: LinearFunction(f"a:{joint.name}", 1.0, 0.0)
            for joint in trees[0].joints
            if joint.nv == 1
        }
        for rates, tree, own in zip(self.rates, trees, (lines, search.variables.coordinates_b), strict=True):
            for joint, line in own.items():
                if line.variable in names:
                    rates[tree.v_index[tree.joint_index(joint)], names.index(line.variable)] = line.slope

    def bounds(self, c: FloatArray, h: FloatArray) -> FloatArray:
        """Return upper bounds on |D + sum_i D_i x_i| for |x_i| <= h_i.

        Args:
            c: (n, variables) box centers.
            h: (variables,) half widths.

        Returns:
            (n,) bounds, m.
        """
        D, G = self.evaluate_at_centers(c)
        size = np.sqrt((D * D).sum(axis=1))
        along = (D[:, :, np.newaxis] * G).sum(axis=1) / np.maximum(size, MIN_DIVISOR)[:, np.newaxis]
        across = np.sqrt(np.maximum((G * G).sum(axis=1) - along * along, 0.0))
        return np.asarray(np.hypot(size + np.abs(along) @ h, across @ h))

    def evaluate_at_centers(self, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return D (n, 3) and its derivatives D_i (n, 3, variables) at the box centers c (n, variables)."""
        z = np.tile(self.middle, (len(c), 1))
        z[:, self.at] = c
        (a, b), (q_a, q_b) = self.search.robots, self.search.configurations(z)
        p_a, J_a = self._position_and_jacobian(a, q_a, self.frames[0], np.zeros(3))
        p_b, J_b = self._position_and_jacobian(b, q_b, self.frames[1], self.tool)
        R, p = self.T_a_b[:3, :3], self.T_a_b[:3, 3]
        return p_b @ R.T + p - p_a, R @ (J_b @ self.rates[1]) - J_a @ self.rates[0]

    def _position_and_jacobian(
        self, robot: Robot, q: FloatArray, frame: str, point: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the position (n, 3) and the Jacobian (n, 3, nv) of `point` (3,), given in `frame`."""
        inputs = _plan_and_q(robot, q, [frame])
        T, J = placements(*inputs)[:, 0], jacobians(*inputs)[:, 0]
        if not point.any():
            return T[:, :3, 3], J[:, :3]
        lever = T[:, :3, :3] @ point
        return T[:, :3, 3] + lever, J[:, :3] + np.cross(J[:, 3:], lever[:, :, np.newaxis], axis=1)


def tighten(
    search: DistanceSearch, frame: FramePair, target: float, upper: float, max_boxes: int = MAX_BOXES
) -> float:
    """Try to prove a smaller upper bound on a frame's distance.

    Args:
        search: Search for the distances between the two models.
        frame: The frame.
        target: Bound at which the proof ends, m.
        upper: A proven bound, m.
        max_boxes: Maximum number of boxes in memory.

    Returns:
        A proven bound, m; at most `upper`.
    """
    variables = search.variables
    steps, pairs = relevant_joints(search.alignment, variables, frame)
    moving_pairs = [pair for pair in pairs if pair is not None]
    # Boxes over one turn cover an unlimited variable only if its joints are revolute and have the multiplier
    # 1 or -1. Such a joint repeats its poses after one turn of the variable.
    ranges_are_covered = all(
        step.kind == "turns" and abs(line.slope) == 1.0
        for step, pair in zip(steps, moving_pairs, strict=False)
        for line in (pair.a, pair.b)
        if line.slope and math.inf in np.abs(variables.ranges[line.variable])
    )
    is_possible = len(moving_pairs) == len(pairs) and all(search.base_fixed) and ranges_are_covered
    if not target < upper < math.inf or not is_possible:
        return upper
    names, M = curvature_bounds(steps, moving_pairs, variables, frame)
    boxes = BoxBounds(search, frame, names)
    ends = search.ends[boxes.at]
    c, h, proven = ends.mean(axis=1)[np.newaxis], (ends[:, 1] - ends[:, 0]) / 2.0, np.array([upper])
    if not np.isfinite(M).all() or 2 ** _halvings(h, M, upper) > max_boxes:
        return upper
    if not names:  # The distance is constant.
        return min(upper, float(boxes.bounds(c, h)[0]))
    while len(c) and 2 * len(c) <= max_boxes:
        i = _worst_variable(h, M)
        h[i] /= 2.0
        c, proven = np.repeat(c, 2, axis=0), np.repeat(proven, 2)
        c[::2, i] -= h[i]
        c[1::2, i] += h[i]
        if (second_order := 0.5 * float(h @ M @ h)) < upper:
            bounds = [boxes.bounds(c[k : k + BOXES_PER_BATCH], h) for k in range(0, len(c), BOXES_PER_BATCH)]
            proven = np.minimum(proven, np.concatenate(bounds) + second_order)
            keep = proven > target
            c, proven = c[keep], proven[keep]
    return float(proven.max(initial=target))


def _worst_variable(h: FloatArray, M: FloatArray) -> int:
    return int((h * (M @ h)).argmax())


def _halvings(h: FloatArray, M: FloatArray, upper: float) -> int:
    """Count the halvings of box widths until (1/2) sum_ij M_ij h_i h_j is below `upper`."""
    h, count = h.copy(), 0
    while 0.5 * h @ M @ h >= upper:
        h[_worst_variable(h, M)] /= 2.0
        count += 1
    return count
