"""Pairs made of the catalogue's robots by known changes: the verdict is right on every one.

`python scripts/check_same.py` tries all changes on all robots; the tests take turns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import urdfkin
from tests.dh.test_compare import disguised, elbow
from tests.sameness import pairs
from tests.sameness.pairs import changed, robot
from urdfkin.dh import dh_table
from urdfkin.sameness.certificate import certificate, recheck
from urdfkin.sameness.result import Verdict
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.writer import to_urdf

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


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "panda", "xarm7", "kinova", "go2", "laikago"])
def test_a_robot_is_found_again_though_no_name_zero_sense_and_base_is_left(name: str) -> None:
    a = robot(name)
    b = urdfkin.load(to_urdf(pairs.renamed(pairs.everything(a.tree))), verify=False)
    found = urdfkin.same(a, b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences[:3]
    elsewhere = {line.split()[1] for line in found.after if line.startswith("frame ")}
    links = [pair for pair in found.links if pair[1] not in elsewhere]
    q, base = a.sample(3, 1), f"link:{found.base_links[1]}"
    T_a = a.placement(q, [f"link:{ours}" for ours, _ in links])
    T_b = b.placement(found.to_b(q), [base, *(f"link:{theirs}" for _, theirs in links)])
    home = found.base @ b.placement(b.neutral(), base)
    np.testing.assert_allclose(T_a, home @ np.linalg.inv(T_b[:, :1]) @ T_b[:, 1:], atol=1e-10)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kinds", ["RRRRRR", "PRRRRR", "RRPRRR", "RRRRRP"])
def test_a_table_with_other_signs_zeros_base_and_tool_is_the_same_robot(kinds: str, seed: int) -> None:
    tree = elbow(kinds)
    table = replace(disguised(dh_table(tree, "tip"), seed), base_frame="foot", tip_frame="hand")
    joints = [joint.name for joint in tree.joints if joint.kind.nv]
    given = dict(zip(joints, (row.joint for row in table.rows), strict=True))
    a = urdfkin.load(to_urdf(pairs.bounded(tree)), verify=False)
    found = urdfkin.same(a, urdfkin.load(table, verify=False), map=given, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences


def test_joints_of_one_name_are_each_others_however_many_hang_on_a_body() -> None:
    a = robot("go2")
    b = changed("go2", "axis bent")
    assert b is not None
    found = urdfkin.same(a, b)
    assert [one.a for one in found.joints] == [one.b for one in found.joints]
    assert recheck(certificate(found), a, b) == []
