"""Pairs made of the catalogue's robots by known changes: the verdict is right on every one.

`python scripts/check_same.py` tries all changes on all robots; the tests take turns.
"""

from __future__ import annotations

import pytest

import urdfkin
from tests.sameness import pairs
from tests.sameness.pairs import changed, robot
from urdfkin.sameness.result import Verdict
from urdfkin.urdf.catalogue import catalogue

ROBOTS = sorted(catalogue())
MOVED = [what for what in pairs.UNLIKE if what not in ("other rule", "rounded")]


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_what_is_the_same_robot_is_found_to_be_so(turn: int) -> None:
    what = list(pairs.ALIKE)[turn % len(pairs.ALIKE)]
    other = changed(ROBOTS[turn], what)
    if other is None:  # nothing to turn over
        return
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found, (what, found.differences[:3])


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_what_is_not_is_found_out_and_the_joint_named(turn: int) -> None:
    what = MOVED[turn % len(MOVED)]
    tree = robot(ROBOTS[turn]).tree
    if not pairs.moving(tree):
        return
    other = changed(ROBOTS[turn], what)
    assert other is not None
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found.verdict is Verdict.DIFFERS, what
    chain = pairs.moving(tree)
    at = chain[len(chain) // 2]
    assert found.differences[0].place in {f"joint {tree.joints[at].name}", f"link {tree.links[at + 1]}"}


FOLLOWED = ["panda", "pr2", "talos", "baxter"]


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLLOWED)
def test_a_follower_that_moves_by_a_tenth_more_is_found_out(name: str) -> None:
    found = urdfkin.same(robot(name), changed(name, "other rule") or robot(name), bounds=False)
    assert [one.what for one in found.differences] == ["mimic rule"]
