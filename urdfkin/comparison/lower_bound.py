"""Search the configuration with the largest distance between a frame of two models.

The distance at the configuration found is attained, so it is a lower bound of the largest distance. The upper
bound (`urdfkin.model.mechanisms.upper_bound`) limits how far the search can be off. Each joint value enters a
position as a sine and a cosine. Therefore coordinate search from the worst of many random configurations
works well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from urdfkin.kinematics.roundings import EPS, FOLLOWER
from urdfkin.model.configuration import neutral
from urdfkin.model.mechanisms.alignment import Alignment, FramePair
from urdfkin.model.mechanisms.mechanism import apart
from urdfkin.model.mechanisms.variables import Line, Variables
from urdfkin.model.pose import inverse
from urdfkin.model.ranges import WIDEST
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.sampling import sample

#: Number of random configurations, and of corners of all ranges, at the start of a search.
SAMPLES, CORNERS = 512, 128
#: Number of the worst configurations that the search starts from, and of values tried along a coordinate.
STARTS, ALONG = 4, 13
#: Frames that are searched in one batch.
TOGETHER = 24
#: Share of its range within which a coordinate is varied, round by round.
WINDOWS = (1.0, 1.0, 0.5, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001)

#: Computes the poses (n, frames, 4, 4) of a robot's frames at q.
Placements = Callable[[Robot, FloatArray, Sequence[str]], FloatArray]


class Search:
    """Search over the common variables of two aligned robots.

    Args:
        robots: A and B.
        found: The alignment of the robots.
        variables: The variables that move both robots.
        seed: Seed of the random configurations.
    """

    def __init__(
        self, robots: tuple[Robot, Robot], found: Alignment, variables: Variables, seed: int = 0
    ) -> None:
        self.robots, self.found, self.variables = robots, found, variables
        self.names = list(variables.ranges)
        self.ends = np.array([self._ends(name) for name in self.names]).reshape(-1, 2)
        self.rng = np.random.default_rng(seed)
        #: (4, 4) pose of B's base link in A's root frame; it moves with A's base link.
        self.hold = found.X @ found.b.homes[found.base[1]]
        #: For each robot, whether its base link is on the root body.
        self.stands = tuple(
            m.body_of[link] == 0 for m, link in zip((found.a, found.b), found.base, strict=True)
        )

    def _ends(self, name: str) -> tuple[float, float]:
        low, high = self.variables.ranges[name]
        tree = self.robots[name.startswith("b:")].tree
        widest = math.pi if tree.joints[tree.joint_index(name[2:])].kind.turns else WIDEST
        if math.isinf(low) and math.isinf(high):
            return -widest, widest
        return (high - 2.0 * widest if math.isinf(low) else low), (
            low + 2.0 * widest if math.isinf(high) else high
        )

    def configurations(self, z: FloatArray, *, moved: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return configurations (n, nq) of A and of B for values (n, variables).

        Args:
            z: The values of the variables.
            moved: Whether A's planar and floating joints are random instead of neutral.
        """
        values = dict(zip(self.names, z.T, strict=True))
        tree_a, tree_b = (robot.tree for robot in self.robots)
        q_a = sample(tree_a, len(z), self.rng) if moved else np.tile(neutral(tree_a), (len(z), 1))
        q_b = np.tile(neutral(tree_b), (len(z), 1))
        for step in self.found.steps:
            joint = tree_a.joints[step.a]
            if joint.kind.nq > 1 and not step.unlike:
                at, to = tree_a.q_index[step.a], tree_b.q_index[step.b]
                own = q_a[:, at : at + joint.kind.nq]
                converted = own if step.conversion is None else step.conversion(joint.kind, own)
                q_b[:, to : to + joint.kind.nq] = converted
        for joint, at in zip(tree_a.joints, tree_a.q_index, strict=True):
            if joint.nq == 1:
                q_a[:, at] = values.get(f"a:{joint.name}", 0.0)
        for name, line in self.variables.leaders.items():
            q_b[:, tree_b.q_index[tree_b.joint_index(name)]] = _value(line, values)
        return q_a, q_b

    def belong_together(self, q_a: FloatArray, q_b: FloatArray) -> bool:
        """Return whether two configurations (1, nq) correspond and are within all ranges, to rounding."""
        sizes = tuple(robot.nq for robot in self.robots)
        if (q_a.shape, q_b.shape) != ((1, sizes[0]), (1, sizes[1])):
            return False
        z = np.zeros((1, len(self.names)))
        for k, name in enumerate(self.names):
            tree, q = (self.robots[0].tree, q_a) if name.startswith("a:") else (self.robots[1].tree, q_b)
            z[0, k] = q[0, tree.q_index[tree.joint_index(name[2:])]]
        low, high = self.ends.T
        room = EPS * FOLLOWER * (1.0 + np.maximum(np.abs(low), np.abs(high)))
        mapped = self.configurations(z)[1]
        off = np.abs(mapped - q_b) <= EPS * FOLLOWER * (1.0 + np.abs(mapped))
        return bool(off.all() and (low - room <= z).all() and (z <= high + room).all())

    def poses(self, z: FloatArray, frames: Sequence[FramePair]) -> tuple[FloatArray, FloatArray]:
        """Return poses (n, frames, 4, 4) of A and of B, on A's base, at values (n, variables)."""
        return self.poses_at(*self.configurations(z), frames, urdfkins)

    def poses_at(
        self, q_a: FloatArray, q_b: FloatArray, frames: Sequence[FramePair], computed: Placements
    ) -> tuple[FloatArray, FloatArray]:
        """Return `poses` at configurations (n, nq) of each robot, computed by the function `computed`."""
        a, b = self.robots
        Ts_a = computed(a, q_a, [a.tree.link_frames[frame.a] for frame in frames])
        base = b.tree.link_frames[self.found.base[1]]
        Ts_b = computed(b, q_b, [base, *(b.tree.link_frames[frame.b] for frame in frames)])
        tools = np.array([inverse(frame.tool) for frame in frames]).reshape(-1, 4, 4)
        hold = self.hold
        if not self.stands[0]:
            link = self.found.base[0]
            moved = computed(a, q_a, [a.tree.link_frames[link]])
            hold = moved @ inverse(self.found.a.homes[link]) @ hold
        return Ts_a, hold @ np.linalg.inv(Ts_b[:, :1]) @ Ts_b[:, 1:] @ tools

    def at(
        self, q_a: FloatArray, q_b: FloatArray, frames: Sequence[FramePair], computed: Placements
    ) -> FloatArray:
        """Return distances (n, frames), metres, at configurations (n, nq) of each robot."""
        return _distances(*self.poses_at(q_a, q_b, frames, computed))

    def random(self, n: int) -> FloatArray:
        """Return random values (n, variables) within their ranges."""
        low, high = self.ends.T
        return np.asarray(low + (high - low) * self.rng.random((n, len(self.names))))

    def metres(self, z: FloatArray, frames: Sequence[FramePair]) -> FloatArray:
        """Return distances (n, frames) of the frames' origins, metres; arguments as for `poses`."""
        return _distances(*self.poses(z, frames))

    def seen(self, frames: Sequence[FramePair]) -> tuple[FloatArray, FloatArray]:
        """Return distances (n, frames) at random values and at corners of the ranges, and these values."""
        low, high = self.ends.T
        z = self.random(SAMPLES)
        corners = np.where(self.rng.random((CORNERS, len(self.names))) < 0.5, low, high)
        z = np.concatenate((np.clip(np.zeros((1, len(self.names))), low, high), corners, z))
        return self.metres(z, frames), z

    def worst(self, frames: Sequence[FramePair]) -> list[tuple[float, FloatArray]]:
        """Return for each frame the largest distance found, metres, and the values there."""
        found: list[tuple[float, FloatArray]] = []
        for first in range(0, len(frames), TOGETHER):
            some = frames[first : first + TOGETHER]
            off, z = self.seen(some)
            found += self._climb(some, z[np.argsort(-off, axis=0)[:STARTS].T])
        return found

    def most_turned(self, frame: FramePair) -> FloatArray:
        """Return the sampled values (variables,) at which a frame's orientations differ most."""
        z = self.seen([frame])[1]
        Ts_a, Ts_b = self.poses(z, [frame])
        turned = [apart(T, other)[0] for T, other in zip(Ts_a[:, 0], Ts_b[:, 0], strict=True)]
        return np.asarray(z[int(np.argmax(turned))])

    def _climb(self, frames: Sequence[FramePair], z: FloatArray) -> list[tuple[float, FloatArray]]:
        """Maximize each frame's distance by coordinate search.

        Args:
            frames: The frames; each is searched separately, all in one batch.
            z: (frames, starts, variables) start values.
        """
        ways = [self._variables_of(frame) for frame in frames]
        low, high = self.ends.T
        k, s = np.ogrid[: len(frames), : z.shape[1]]
        best = self._own_distances(z[:, :, np.newaxis], frames)[..., 0]
        steps = np.linspace(-0.5, 0.5, ALONG)
        for window in WINDOWS:
            for turn in range(max(map(len, ways))):
                i = np.array([way[turn % len(way)] if way else 0 for way in ways])
                span = (high - low)[i][:, np.newaxis]
                middle = (
                    ((low + high) / 2.0)[i][:, np.newaxis] if window == 1.0 else z[k, s, i[:, np.newaxis]]
                )
                values = middle[..., np.newaxis] + window * span[..., np.newaxis] * steps
                values = np.clip(
                    values, low[i][:, np.newaxis, np.newaxis], high[i][:, np.newaxis, np.newaxis]
                )
                tried = np.repeat(z[:, :, np.newaxis], ALONG, axis=2)
                tried[
                    k[..., np.newaxis], s[..., np.newaxis], np.arange(ALONG), i[:, np.newaxis, np.newaxis]
                ] = values
                off = self._own_distances(tried, frames)
                at = off.argmax(axis=2)
                better = off[k, s, at] > best
                z = np.where(better[..., np.newaxis], tried[k, s, at], z)
                best = np.where(better, off[k, s, at], best)
        at = best.argmax(axis=1)
        return [(float(best[n, m]), z[n, m]) for n, m in enumerate(at)]

    def _own_distances(self, z: FloatArray, frames: Sequence[FramePair]) -> FloatArray:
        """Return distances (frames, starts, values) of each frame at its own values, variables last."""
        flat = z.reshape(math.prod(z.shape[:-1]), z.shape[-1])  # also for robots without variables
        off = self.metres(flat, frames).reshape(*z.shape[:-1], len(frames))
        n = np.arange(len(frames))
        return np.asarray(off[n, :, :, n])

    def _variables_of(self, frame: FramePair) -> list[int]:
        """Return the indices of the variables that move a frame in at least one model."""
        steps = set(self.found.indices(frame.previous))
        names = {
            line.variable
            for i, pair in enumerate(self.variables.pairs)
            if pair is not None and i in steps
            for line in (pair.a, pair.b)
            if line.slope
        }
        trees = self.robots[0].tree, self.robots[1].tree
        for step in (self.found.steps[i] for i in steps):
            if step.unlike == "kind":
                names |= {f"a:{trees[0].joints[step.a].name}", f"b:{trees[1].joints[step.b].name}"}
        return [i for i, name in enumerate(self.names) if name in names]


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1))


def urdfkins(robot: Robot, q: FloatArray, frames: Sequence[str]) -> FloatArray:
    """Return poses (n, frames, 4, 4) computed by the forward recursion."""
    return robot.placement(q, frames, verify=False)


def pinocchios(robot: Robot, q: FloatArray, frames: Sequence[str]) -> FloatArray:
    """Return poses (n, frames, 4, 4) computed by Pinocchio from the robot's text."""
    return robot.verifier.oracle().placements(q, frames)


def _value(line: Line, values: dict[str, FloatArray]) -> FloatArray | float:
    return line.constant + (line.slope * values.get(line.variable, 0.0) if line.slope else 0.0)
