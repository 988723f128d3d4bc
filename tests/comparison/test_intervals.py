"""The interval of the largest distance holds the truth, and is narrow."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import urdfkin
from tests.comparison import pairs
from tests.comparison.pairs import robot
from tests.comparison.searching import far, searched
from urdfkin.model.mechanisms.mechanism import Screw, along
from urdfkin.model.mechanisms.upper_bound import Grid, point
from urdfkin.robot import Robot
from urdfkin.urdf.writer import to_urdf

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
