"""Robots of the catalogue and known changes of these robots: every verdict is right.

`python scripts/check_same.py` tries all changes on all robots; the tests try one change for each robot.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

import urdfkin
from tests import urdfs
from tests.comparison import pairs
from tests.comparison.pairs import changed, robot
from tests.dh.arms import disguised, elbow
from tests.reading import present
from tests.urdfs import joint, limit, mimic
from urdfkin.comparison.certificate import certificate, recheck
from urdfkin.comparison.result import Verdict
from urdfkin.dh import dh_table
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.writer import to_urdf

ROBOTS = sorted(catalogue())
MOVED = [what for what in pairs.UNLIKE if what not in ("other rule", "rounded")]


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_changes_that_preserve_the_robot_are_recognised(turn: int) -> None:
    what = list(pairs.ALIKE)[turn % len(pairs.ALIKE)]
    other = changed(ROBOTS[turn], what)
    if other is None:  # the change changes nothing
        return
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found, (what, found.differences[:3])


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_changes_of_the_motion_are_detected_and_the_joint_is_named(turn: int) -> None:
    what = MOVED[turn % len(MOVED)]
    tree = robot(ROBOTS[turn]).tree
    if not pairs.moving(tree):
        return
    other = present(changed(ROBOTS[turn], what))
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found.verdict is Verdict.DIFFERS, what
    at, moved = pairs.middle(tree)
    assert found.differences[0].place in {f"joint {moved.name}", f"link {tree.links[at + 1]}"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "pr2", "talos", "baxter"])
def test_a_mimic_joint_with_a_larger_multiplier_is_detected(name: str) -> None:
    found = urdfkin.same(robot(name), changed(name, "other rule") or robot(name), bounds=False)
    assert [one.what for one in found.differences] == ["mimic rule"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "panda", "xarm7", "kinova", "go2", "laikago", "iris"])
def test_a_robot_with_all_names_zeros_signs_and_the_base_changed_is_recognised(name: str) -> None:
    a = robot(name)
    b = urdfkin.load(to_urdf(pairs.renamed(pairs.everything(a.tree))), verify=False)
    found = urdfkin.same(a, b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences[:3]
    assert pairs.moves_alike(found, a, b, 1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "name", ["human", "icub", "romeo", "pr2", "tiago_pro", "tiago_dual", "g1_with_hands"]
)
def test_a_robot_with_random_names_zeros_and_signs_is_recognised_in_seconds(name: str, seed: int) -> None:
    b = pairs.loaded(pairs.disguised(robot(name).tree, seed))
    began = time.process_time()
    found = urdfkin.same(robot(name), b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences[:3]
    assert time.process_time() - began <= 5.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "pr2", "talos"])
def test_a_mimic_joint_with_a_larger_multiplier_is_detected_despite_new_names(name: str) -> None:
    b = pairs.loaded(pairs.disguised(pairs.with_another_rule(robot(name).tree), 1))
    found = urdfkin.same(robot(name), b, bounds=False)
    assert {one.what for one in found.differences} == {"mimic rule"}


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


def test_joints_of_equal_names_are_matched_on_a_body_with_many_joints() -> None:
    a, b = robot("go2"), present(changed("go2", "axis bent"))
    found = urdfkin.same(a, b)
    assert [one.a for one in found.joints] == [one.b for one in found.joints]
    assert recheck(certificate(found), a, b) == []


@pytest.mark.slow
def test_a_vendors_table_with_a_rounded_last_digit_differs_by_no_more_than_this_digit() -> None:
    table = Path(__file__).parents[2] / "robots" / "dh" / "kinova.toml"
    found = urdfkin.same("kinova", table)
    assert found.verdict is Verdict.DIFFERS
    assert present(found.worst).upper == pytest.approx(5e-5, rel=1e-6)  # d4: 0.3111 m, not 0.31105


@pytest.mark.slow
def test_mirrored_arms_are_distinguished_without_equal_names() -> None:
    def arm(side: str, y: float) -> str:
        a, b, c = (f"{side}_{name}" for name in "abc")
        first = joint(a, "continuous", "trunk", f"{a}_link", axis="0 1 0")
        second = joint(b, "continuous", f"{a}_link", f"{b}_link", f'xyz="0 {y} 0.2"', "1 0 0")
        return first + second + joint(c, "continuous", f"{b}_link", f"{c}_link", f'xyz="0.1 {y} -0.2"')

    a = urdfkin.load(urdfs.robot(arm("left", 0.3), arm("right", -0.3)), verify=False)
    b = urdfkin.load(to_urdf(pairs.renamed(pairs.everything(a.tree))), verify=False)
    found = urdfkin.same(a, b, bounds=False)
    assert found, found.differences


def test_standard_and_modified_rows_of_one_robot_are_the_same() -> None:
    chain = elbow("RRRRRR")
    tables = [dh_table(chain, "tip", convention=convention) for convention in ("standard", "modified")]
    found = urdfkin.same(*tables)
    assert found, found.differences
    assert all(line.startswith("frame ") for line in found.after)


#: A robot with a mimic joint, whose multiplier and offset are placeholders.
FOLLOWING = urdfs.robot(
    joint("j", "revolute", "a", "b", more=limit()),
    joint("k", "revolute", "b", "c", 'xyz="0.3 0 0"', more=limit() + mimic("j", "{}", "{}")),
    joint("e", "fixed", "c", "d", 'xyz="0.3 0 0"', axis=""),
)


def test_mimic_rules_that_differ_by_less_than_rounding_are_equal() -> None:
    found = urdfkin.same(FOLLOWING.format(0.5, 0.1), FOLLOWING.format(0.5, 0.1 + 2.5e-13))
    assert found.verdict is Verdict.SAME
    worst = max(frame.radians for frame in found.frames)
    assert 2.5e-13 < worst < 1e-12, "the rule's difference is part of the stated rounding"


@pytest.mark.parametrize(("multiplier", "offset"), [(0.5, 0.1 + 1e-12), (0.5 + 1e-12, 0.1)])
def test_mimic_rules_that_differ_by_more_than_rounding_are_a_difference(
    multiplier: float, offset: float
) -> None:
    found = urdfkin.same(FOLLOWING.format(0.5, 0.1), FOLLOWING.format(multiplier, offset))
    assert found.verdict is Verdict.DIFFERS
