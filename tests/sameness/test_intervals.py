"""The interval of the largest distance holds the truth, and is narrow."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

import urdfkin
from tests.sameness import pairs
from tests.sameness.test_pairs import robot
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind
from urdfkin.robot import Robot
from urdfkin.sameness.mechanism import Screw
from urdfkin.sameness.result import Interval
from urdfkin.sameness.rigid import along
from urdfkin.sameness.support import Grid, point
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.exact.decimals import read_exact
from urdfkin.verify.exact.recursion import move
from urdfkin.verify.exact.vectors import mp
from urdfkin.verify.quantities import PLACEMENT

CASES: dict[str, tuple[str, Callable[[Robot], str]]] = {
    "elbow, tilted": ("elbow", lambda r: to_urdf(pairs.tilted(r.tree, 1e-2))),
    "polar, lengthened": ("polar", lambda r: to_urdf(pairs.lengthened(r.tree, 1e-3))),
    "elbow, an axis bent": ("elbow", lambda r: to_urdf(pairs.bent_axis(r.tree, 1e-4))),
    "panda, rounded": ("panda", lambda r: to_urdf(pairs.rounded(r.tree))),
    "panda, a follower": ("panda", lambda r: to_urdf(pairs.with_another_rule(r.tree))),
    "ur5 and ur10": ("ur5", lambda r: to_urdf(pairs.bounded(urdfkin.load("ur10", verify=False).tree))),
}
#: How wide an interval may be: one thing differs, or many do, each with its own worst configuration.
WIDTH = {"panda, rounded": 2.0}


def placed(robot: Robot, q: FloatArray, frame: str) -> list[Any]:
    """A frame's place at fifty digits, from the decimals of the text."""
    tree, link = robot.tree, robot.tree.link_index(frame)
    zeros = [mp.mpf(0)] * tree.nv
    numbers = [mp.mpf(float(x)) for x in q]
    exact = read_exact(robot.urdf, tree, mp, tree.path(link))
    motion = move(tree, exact, numbers, zeros, zeros, base=None, context=mp)
    T = PLACEMENT.truth(motion, link, Reference.LOCAL_WORLD_ALIGNED)
    return [T[i][3] for i in range(3)]


def far(a: Robot, b: Robot, q_a: FloatArray, q_b: FloatArray, interval: Interval) -> float:
    """How far a frame is off at a configuration, at fifty digits."""
    places = placed(a, q_a, interval.frame), placed(b, q_b, interval.frame_b)
    with mp.workdps(50):
        return float(mp.sqrt(sum((x - y) ** 2 for x, y in zip(*places, strict=True))))


def within(robot: Robot, q: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether all joints, followers too, keep their limits."""
    keeps = np.ones(len(q), dtype=bool)
    for joint, at in zip(robot.tree.joints, robot.tree.q_index, strict=True):
        if joint.kind.has_axis and joint.limit is not None and joint.kind is not JointKind.CONTINUOUS:
            rule = joint.mimic
            value = q[:, at] if rule is None else rule.multiplier * q[:, at] + rule.offset
            keeps &= (joint.limit.lower <= value) & (value <= joint.limit.upper)
    return keeps


def searched(a: Robot, b: Robot, at_b: Callable[[FloatArray], FloatArray], interval: Interval) -> float:
    """The largest distance that a global search finds, computed at fifty digits."""
    path = a.tree.path(a.tree.link_index(interval.frame))
    leaders = {
        (a.tree.joints[i].mimic.leader if a.tree.joints[i].mimic else a.tree.joints[i].name)  # type: ignore[union-attr]
        for i in path
        if a.tree.joints[i].kind.nv
    }
    joints = [joint for joint in a.tree.joints if joint.name in leaders]
    places = [a.tree.q_index[a.tree.joint_index(joint.name)] for joint in joints]
    ends = [
        (j.limit.lower, j.limit.upper) if j.limit and math.isfinite(j.limit.lower) else (-math.pi, math.pi)
        for j in joints
    ]

    def full(x: FloatArray) -> FloatArray:
        q = np.tile(a.neutral(), (x.shape[1], 1))
        q[:, places] = x.T
        return q

    def off(x: FloatArray) -> FloatArray:
        q = full(x)
        T_a = a.placement(q, f"link:{interval.frame}")
        T_b = b.placement(at_b(q), f"link:{interval.frame_b}")
        metres = np.linalg.norm(T_a[:, :3, 3] - T_b[:, :3, 3], axis=-1)
        return -np.where(within(a, q) & within(b, at_b(q)), metres, 0.0)

    best = differential_evolution(
        off, ends, seed=3, popsize=20, maxiter=60, vectorized=True, polish=False, updating="deferred"
    )
    q = full(best.x[:, np.newaxis])[0]
    return far(a, b, q, at_b(q), interval)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("case", CASES)
def test_the_interval_holds_what_a_global_search_at_fifty_digits_finds(case: str) -> None:
    name, change = CASES[case]
    a = robot(name)
    b = urdfkin.load(change(a), verify=False)
    found = urdfkin.same(a, b)
    tools = {line.split()[1] for line in found.after if line.startswith("frame ")}
    worst = max((f for f in found.frames if f.frame not in tools), key=lambda f: f.upper)
    found_elsewhere = searched(a, b, found.to_b, worst)
    assert worst.lower <= far(a, b, np.array(worst.q_a), np.array(worst.q_b), worst), "it is attained"
    assert found_elsewhere <= worst.upper
    assert worst.lower >= 0.9999 * found_elsewhere, "nothing worse is found by another search"
    assert worst.upper <= WIDTH.get(case, 1.02) * worst.lower


@pytest.mark.parametrize("seed", range(4))
def test_a_support_function_is_a_bound_and_a_close_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, p = Grid(16, 48), rng.standard_normal(3)
    reach, points = point(grid, p), p[np.newaxis]
    for _ in range(3):
        axis = rng.standard_normal(3)
        screw = Screw(axis / np.linalg.norm(axis), rng.standard_normal(3))
        low, high = sorted(rng.uniform(-4.0, 4.0, 2))
        reach = reach.turned(screw, low, high)
        turns = [along(screw, t, turns=True) for t in np.linspace(low, high, 60)]
        points = np.concatenate([points @ T[:3, :3].T + T[:3, 3] for T in turns])
        points = points[rng.permutation(len(points))[:4000]]
    u = rng.standard_normal((200, 3))
    u /= np.linalg.norm(u, axis=1)[:, np.newaxis]
    size = np.linalg.norm(points, axis=1).max()
    slack = reach.at(u) - (points @ u.T).max(axis=0)
    assert (slack >= -1e-12).all()
    assert np.median(slack) <= 0.03 * size
    assert reach.largest() >= size


def test_a_frame_that_slides_without_end_has_no_bound() -> None:
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
        '<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><origin rpy="{} 0 0"/>'
        '<axis xyz="0 0 1"/></joint>'
        '<joint name="fly" type="floating"><parent link="b"/><child link="c"/></joint></robot>'
    )
    found = urdfkin.same(text.format("0"), text.format("0.1"))
    assert found.differences[0].place == "joint turn"
    worst = found.worst
    assert worst is not None
    assert worst.frame == "c"
    assert math.isinf(worst.upper)
