"""Robots and known changes of these robots: every verdict is right.

`python scripts/check_same.py` tries all changes on all robots; the tests try one change for each robot.
"""

import time
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.comparison import pairs
from tests.comparison.pairs import certified, changed, loaded, moves_alike, robot, written
from tests.dh.arms import CONVENTIONS, disguised, elbow, with_cells
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic
from urdfkin.comparison.certificate import SAME
from urdfkin.comparison.result import Verdict
from urdfkin.dh import make_dh_table
from urdfkin.model.mechanisms import matcher
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
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
    b = loaded(pairs.renamed(pairs.everything(a.tree)))
    found = urdfkin.same(a, b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences[:3]
    assert moves_alike(found, a, b, 1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "name", ["human", "icub", "romeo", "pr2", "tiago_pro", "tiago_dual", "g1_with_hands"]
)
def test_a_robot_with_random_names_zeros_and_signs_is_recognised_in_seconds(name: str, seed: int) -> None:
    b = loaded(pairs.disguised(robot(name).tree, seed))
    began = time.process_time()
    found = urdfkin.same(robot(name), b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences[:3]
    assert time.process_time() - began <= 5.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "pr2", "talos"])
def test_a_mimic_joint_with_a_larger_multiplier_is_detected_despite_new_names(name: str) -> None:
    b = loaded(pairs.disguised(pairs.with_another_rule(robot(name).tree), 1))
    found = urdfkin.same(robot(name), b, bounds=False)
    assert {one.what for one in found.differences} == {"mimic rule"}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kinds", ["RRRRRR", "PRRRRR", "RRPRRR", "RRRRRP"])
def test_a_table_with_other_signs_zeros_base_and_tool_is_the_same_robot(kinds: str, seed: int) -> None:
    tree = elbow(kinds)
    table = replace(disguised(make_dh_table(tree, "tip"), seed), base_frame="foot", tip_frame="hand")
    joints = [joint.name for joint in tree.joints if joint.kind.nv]
    given = dict(zip(joints, (row.joint for row in table.rows), strict=True))
    found = urdfkin.same(loaded(pairs.bounded(tree)), loaded(table), map=given, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences


def test_joints_of_equal_names_are_matched_on_a_body_with_many_joints() -> None:
    a, b = robot("go2"), present(changed("go2", "axis bent"))
    found = urdfkin.same(a, b)
    assert [one.a for one in found.joints] == [one.b for one in found.joints]
    assert certified(found, a, b)


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

    a = built(arm("left", 0.3), arm("right", -0.3), verify=False)
    b = loaded(pairs.renamed(pairs.everything(a.tree)))
    found = urdfkin.same(a, b, bounds=False)
    assert found, found.differences


def test_standard_and_modified_rows_of_one_robot_are_the_same() -> None:
    chain = elbow("RRRRRR")
    tables = [make_dh_table(chain, "tip", convention=convention) for convention in ("standard", "modified")]
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


# -- planar and floating joints with other frames -----------------------------------------------------

CHAIN = urdfs.robot(
    joint("free", "{}", "ground", "body", 'xyz="0.1 0.2 0.3" rpy="0.2 -0.3 0.4"'),
    joint("hip", "revolute", "body", "thigh", 'xyz="0.3 0.1 0" rpy="{} 0.5 0"', "0 1 0", limit(-1, 1.5)),
    joint("knee", "revolute", "thigh", "foot", 'xyz="0 0 -0.4" rpy="0.3 0 0"', "1 0 0", limit(-1, 1.5)),
)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floating", "planar"])
@pytest.mark.parametrize("also", ["", "renamed", "rerooted"])
def test_free_joints_with_a_different_zero_pose_are_equivalent(kind: str, also: str) -> None:
    a = loaded(CHAIN.format(kind, "0"), verify=True)
    tree = pairs.counted_elsewhere(a.tree)
    assert tree is not a.tree
    b = loaded(pairs.renamed(tree) if also == "renamed" else tree, verify=True)
    if also == "rerooted":  # the foot is the root, and the free joint is reversed
        b = loaded(pairs.counted_elsewhere(pairs.rerooted(a.tree)), verify=True)
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER
    assert any("the pose of q[" in line for line in found.after)
    assert moves_alike(found, a, b)
    assert "within the bounds" in str(found.confirmation)
    assert found.as_written is not None
    assert certified(found, a, b)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_joints_behind_a_free_joint_are_compared(kind: str) -> None:
    a, b = loaded(CHAIN.format(kind, "0")), loaded(CHAIN.format(kind, "0.001"))
    for other in (b, loaded(pairs.counted_elsewhere(b.tree))):
        found = urdfkin.same(a, other)
        assert [one.place for one in found.differences] == ["joint hip"]
        assert found.differences[0].radians == pytest.approx(0.001 * np.cos(0.5), rel=0.2)
        worst = present(found.worst)
        assert 0.0 < worst.lower <= worst.upper <= 1.03 * worst.lower


def test_a_tilted_plane_of_a_planar_joint_is_a_difference() -> None:
    a = loaded(CHAIN.format("planar", "0"))
    b = loaded(CHAIN.format("planar", "0").replace("0.2 -0.3 0.4", "0.2 -0.299 0.4"))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.DIFFERS
    assert found.differences[0].words.startswith("joint free: its plane is tilted by")
    assert np.isinf(present(found.worst).upper)  # a planar joint has no limits
    assert certified(found, a, b)


def test_a_map_of_all_joints_determines_the_bodies_that_are_matched() -> None:
    a = built(
        joint("j", "planar", "base", "cart", 'rpy="0.4 0.1 0"'),
        joint("k", "revolute", "base", "door", 'xyz="1 0 0"', "0.6 0 0.8", limit()),
        verify=False,
    )
    b = loaded(pairs.on_a_stand(pairs.renamed(a.tree)))
    moving = {joint.kind: joint.name for joint in b.tree.joints if joint.kind.nv}
    found = urdfkin.same(a, b, map={one.name: moving[one.kind] for one in a.tree.joints}, bounds=False)
    assert {one.a for one in found.joints} == {"j", "k"}


# -- chains without common names ---------------------------------------------------------------------


def random_chain(kinds: str, seed: int, tip: str = "tip") -> Robot:
    """Return a chain of revolute (R) and prismatic (P) joints with random axes and origins."""
    rng = np.random.default_rng(seed)
    links = [*(f"{tip}_{i}" for i in range(len(kinds))), tip]
    joints = [
        joint(
            f"{tip}_j{i}",
            "revolute" if kind == "R" else "prismatic",
            links[i],
            links[i + 1],
            'xyz="{} {} {}" rpy="{} {} {}"'.format(*rng.normal(size=6)),
            " ".join(map(str, rng.normal(size=3))),
            limit(-1, 1),
        )
        for i, kind in enumerate(kinds)
    ]
    return built(*joints, verify=False)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ["RPR", "RPPR", "PPPR", "PRPRPR", "RRPPRR", "RPPPRR"])
def test_prismatic_joints_between_revolute_joints_need_no_common_names(kinds: str) -> None:
    for seed in range(3):
        a = random_chain(kinds, seed)
        b = loaded(pairs.disguised(a.tree, seed))
        found = urdfkin.same(a, b, bounds=False)
        assert found.verdict is Verdict.SAME_AFTER, seed
        assert moves_alike(found, a, b)


@pytest.mark.parametrize("common", [["base"], ["tip"], ["base", "tip"]])
def test_a_common_base_and_a_common_tip_fix_the_zeros_of_prismatic_joints(common: list[str]) -> None:
    for seed in range(3):
        a = random_chain("RPPR", seed)
        names = {"base": a.tree.links[0], "tip": a.tree.links[-1]}
        offsets = {joint.name: 0.1 * (i + 1) for i, joint in enumerate(a.tree.joints)}
        joints = {joint.name: f"other_{joint.name}" for joint in a.tree.joints}
        links = {link: link if link in map(names.get, common) else f"other_{link}" for link in a.tree.links}
        moved = pairs.with_names(pairs.with_zeros_moved(a.tree, offsets), joints, links)
        b = loaded(moved if "base" in common else pairs.on_a_stand(moved))
        found = urdfkin.same(a, b, bounds=False)
        assert found.verdict is Verdict.SAME_AFTER, seed
        assert moves_alike(found, a, b)


def renamed(tree: KinematicTree, kept: set[str]) -> Robot:
    """Return a robot with other names of all joints, and of all links except `kept`."""
    joints = {one.name: f"other_{one.name}" for one in tree.joints}
    links = {link: link if link in kept else f"other_{link}" for link in tree.links}
    return loaded(pairs.with_names(tree, joints, links))


#: The kind, the parent link and the axis of each joint.
MOBILE_ARM = [("planar", 0, ""), ("continuous", 1, "0 0 1"), ("revolute", 2, "0 1 0")]
BESIDE_TWO_PLANES = [("planar", 0, ""), ("revolute", 0, "1 0 0"), ("planar", 0, "")]


@pytest.mark.parametrize("common", [(), (1,), (2,), (3,)])
@pytest.mark.parametrize("rows", [MOBILE_ARM, BESIDE_TWO_PLANES])
def test_a_robot_with_planar_joints_is_found_with_few_common_links(
    rows: list[tuple[str, int, str]], common: tuple[int, ...]
) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        a = built(
            *(
                joint(
                    f"j{i}",
                    kind,
                    f"l{parent}",
                    f"l{i + 1}",
                    'xyz="{} {} {}"'.format(*rng.normal(size=3)),
                    axis,
                    limit(-1, 1) if kind == "revolute" else "",
                )
                for i, (kind, parent, axis) in enumerate(rows)
            ),
            verify=False,
        )
        moved = pairs.counted_elsewhere(pairs.on_a_stand(a.tree))
        b = renamed(moved, {a.tree.links[i] for i in common})
        found = urdfkin.same(a, b)
        assert found.verdict is Verdict.SAME_AFTER, seed
        assert moves_alike(found, a, b)
        assert certified(found, a, b)


@pytest.mark.parametrize(
    ("kinds", "parents", "common", "seed"),
    [
        ("planar continuous", "01", {0}, 0),
        ("planar continuous", "01", set(), 0),
        ("planar continuous continuous", "012", set(), 0),
        ("continuous planar", "01", {2}, 0),
        ("continuous planar continuous", "012", {1}, 0),
        ("floating continuous planar", "012", {0, 2}, 0),
        ("planar planar continuous", "012", {0, 1}, 0),
        ("floating prismatic prismatic", "012", {0, 2}, 0),
        ("floating planar continuous planar", "0103", {2, 4}, 4),
    ],
)
def test_random_robots_with_planar_and_floating_joints_are_found_with_few_common_links(
    kinds: str, parents: str, common: set[int], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    a = built(
        *(
            joint(
                f"j{i}",
                kind,
                f"l{parent}",
                f"l{i + 1}",
                'xyz="{} {} {}" rpy="{} {} {}"'.format(*rng.normal(size=6)),
                "1 2 3" if kind in ("continuous", "prismatic") else "",
                limit() if kind == "prismatic" else "",
            )
            for i, (kind, parent) in enumerate(zip(kinds.split(), parents, strict=True))
        ),
        verify=False,
    )
    moved = pairs.counted_elsewhere(pairs.on_a_stand(pairs.shifted(pairs.flipped(a.tree))))
    b = renamed(moved, {f"l{i}" for i in common})
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER
    assert moves_alike(found, a, b)
    assert certified(found, a, b)


def test_a_common_link_after_the_first_joint_fixes_the_base() -> None:
    a = built(joint("j", "revolute", "base", "arm", 'xyz="0.22 0 0"', "0 1 0", limit(-1, 1)), verify=False)
    moved = pairs.on_a_stand(a.tree)
    b = renamed(moved, {"arm"})
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER
    assert moves_alike(found, a, b)
    assert certified(found, a, b)


def test_within_compares_only_the_bases_and_tips_of_two_tables() -> None:
    standard, modified = (make_dh_table(elbow(), "tip", convention=name) for name in CONVENTIONS)
    found = urdfkin.same(standard, modified, within=1e-9)
    assert found.as_written is not None
    assert found.within(1e-9)
    longer = with_cells(modified, 2, a=modified.rows[2].a + 0.1)
    assert not urdfkin.same(standard, longer, within=0.09).within(0.09)
    other = replace(modified, tip_frame="tool")  # the tips of two tables match
    assert urdfkin.same(standard, other, within=1e-9).within(1e-9)


def test_within_needs_a_frame_with_the_name_of_a_tables_tip() -> None:
    arm = loaded(pairs.bounded(elbow()))
    table = replace(make_dh_table(arm.tree, "tip"), tip_frame="tool")
    longer = with_cells(table, 2, a=table.rows[2].a + 0.1)
    for other in (table, longer):
        for a, b in ((arm, other), (other, arm)):
            with pytest.raises(urdfkin.InputError, match="the tip is not compared: found 'tool'"):
                urdfkin.same(a, b, within=0.01)
            assert not urdfkin.same(a, b).within(0.01)


def test_the_zeros_of_many_joints_are_not_computed_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matcher, "MAX_REFINED_JOINTS", 2)
    a = random_chain("RPPPRR", 0)
    b = loaded(pairs.disguised(a.tree, 0))
    assert urdfkin.same(a, b, bounds=False).verdict is Verdict.DIFFERS


def test_a_chain_with_a_displaced_axis_differs_without_common_names() -> None:
    a = random_chain("RPRRRP", 0)
    b = loaded(pairs.disguised(pairs.lengthened(a.tree, 1e-6), 0))
    assert urdfkin.same(a, b, bounds=False).verdict is Verdict.DIFFERS


def branched_robot(seed: int) -> Robot:
    """Return a robot with a revolute joint, a prismatic joint and two revolute joints side by side."""
    rng = np.random.default_rng(seed)
    joints = []
    for i, (kind, parent) in enumerate([("revolute", 0), ("prismatic", 1), ("revolute", 2), ("revolute", 2)]):
        origin = 'xyz="{} {} {}"'.format(*rng.choice([0.0, 0.1, 0.2, -0.3], 3))
        axis = rng.choice(["1 0 0", "0 1 0", "0 0 1"])
        joints.append(joint(f"j{i}", kind, f"l{parent}", f"l{i + 1}", origin, axis, limit(-1, 1)))
    return built(*joints, verify=False)


# In these robots, only the axes after the prismatic joint determine the shift along the first axis.
@pytest.mark.parametrize("seed", [3, 4, 12, 13, 17, 26])
def test_branches_after_a_prismatic_joint_need_no_common_names(seed: int) -> None:
    a = branched_robot(seed)
    b = loaded(pairs.disguised(a.tree, seed))
    found = urdfkin.same(a, b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER
    assert moves_alike(found, a, b)


# The pose of B's root and the zero offset of the first joint can compensate each other.
@pytest.mark.parametrize("offset", [0.0, 0.7])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_the_rule_of_a_joint_that_mimics_the_first_joint_fixes_its_zero(kind: str, offset: float) -> None:
    a = built(
        joint("j0", kind, "l0", "l1", 'xyz="0.1 0.2 0.3"', "0 0.6 0.8", limit()),
        joint("j1", "revolute", "l1", "l2", 'xyz="1 0.2 0"', "0 -0.8 0.6", limit() + mimic("j0", 1, 0.3)),
        joint("j2", "revolute", "l2", "l3", 'xyz="0.2 0.5 0.1"', "1 0 0", limit()),
        verify=False,
    )
    b = loaded(pairs.renamed(pairs.on_a_stand(pairs.with_zeros_moved(a.tree, {"j0": offset}))))
    found = urdfkin.same(a, b, bounds=False)
    assert found.verdict is Verdict.SAME_AFTER, found.differences
    assert moves_alike(found, a, b)
    assert certified(urdfkin.same(a, b), a, b)


@pytest.mark.parametrize(
    ("kind", "change"),
    [("revolute", pairs.on_a_stand), ("revolute", pairs.rerooted), ("prismatic", pairs.rerooted)],
)
def test_a_robot_with_one_joint_and_only_a_common_tip_is_recognised(kind: str, change: pairs.Change) -> None:
    a = built(joint("j", kind, "base", "tip", 'xyz="0.3 0 0.1"', "0 0.6 0.8", limit()))
    tree = change(a.tree)
    links = {link: link if link == "tip" else f"other_{link}" for link in tree.links}
    b = urdfkin.load(to_urdf(pairs.with_names(tree, {j.name: j.name for j in tree.joints}, links)))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER, found.differences
    assert ("tip", "tip") in found.links
    assert "within the bounds" in str(found.confirmation)
    assert certified(found, a, b)


# -- the order of joints -----------------------------------------------------------------------------

AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def gantry(order: str, wrist: str = "turn", tilt: str = "0") -> Robot:
    """Return three prismatic joints in an order, then a revolute joint about z and a prismatic joint."""
    joints, parent = list[str](), "base"
    for i, name in enumerate([*order, *(["turn", "quill"] if wrist == "turn" else ["quill", "turn"])]):
        child = f"{order}{i}" if i < 3 else f"{wrist}{i}" if i < 4 else "tool"
        kind, axis = ("revolute", "0 0 1") if name == "turn" else ("prismatic", AXES.get(name, "0 0 1"))
        origin = f'xyz="0 0 0" rpy="{tilt} 0 0"' if i == 4 else ""
        joints.append(joint(name, kind, parent, child, origin, axis, limit(-1, 1.5)))
        parent = child
    return built(*joints, verify=False)


@pytest.mark.slow
@pytest.mark.parametrize(("order", "wrist"), [("xyz", "quill"), ("zyx", "turn"), ("yzx", "quill")])
def test_robots_with_reordered_prismatic_joints_are_the_same(order: str, wrist: str) -> None:
    a, b = gantry("xyz"), gantry(order, wrist)
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME
    assert {(one.a, one.b) for one in found.joints} == {(name, name) for name in (*"xyz", "turn", "quill")}
    assert found.orders
    assert moves_alike(found, a, b)
    assert certified(found, a, b)


@pytest.mark.slow
def test_every_order_of_orthogonal_prismatic_joints_gives_the_same_robot() -> None:
    a = gantry("xyz")
    for order in permutations("xyz"):
        assert urdfkin.same(a, gantry("".join(order)), bounds=False).verdict is Verdict.SAME


def test_a_joint_order_that_the_axes_do_not_allow_is_a_difference() -> None:
    assert not urdfkin.same(gantry("xyz", tilt="0.001"), gantry("xyz", "quill", tilt="0.001"), bounds=False)


@pytest.mark.slow
def test_a_named_link_that_a_different_joint_carries_is_a_difference() -> None:
    named = loaded(gantry("yxz").urdf.replace('"yxz', '"xyz'))
    (one,) = urdfkin.same(gantry("xyz"), named, bounds=False).differences
    assert one.words == "link xyz0 is carried by joint x in A, by joint y in B"


@pytest.mark.slow
def test_the_schema_allows_conversions_and_joint_orders() -> None:
    from jsonschema import Draft202012Validator

    schema = Draft202012Validator(SAME.schema())
    a = loaded(CHAIN.format("planar", "0"))
    for found in (
        urdfkin.same(a, loaded(pairs.counted_elsewhere(a.tree)), bounds=False),
        urdfkin.same(gantry("xyz"), gantry("zyx"), bounds=False),
    ):
        schema.validate(written(found))


@pytest.mark.parametrize("floating_first", [True, False])
def test_a_root_joint_in_only_one_model_is_the_only_difference(floating_first: bool) -> None:
    text = CHAIN.format("fixed", "0").replace(
        '<axis xyz="0 0 1"/></joint><joint name="hip"', '</joint><joint name="hip"'
    )
    fixed, longer = (loaded(each, verify=True) for each in (text, text.replace("0 0 -0.4", "0 0 -0.425")))
    floating = urdfkin.load(text, root_joint="floating")
    found = urdfkin.same(*(floating, fixed) if floating_first else (fixed, floating))
    assert [one.words for one in found.differences] == [f"joint root_joint is only in {'BA'[floating_first]}"]
    assert found.worst is None
    both = (floating, longer) if floating_first else (longer, floating)
    found = urdfkin.same(*both)
    worst = present(found.worst)
    assert (worst.lower, worst.upper) == pytest.approx((0.025, 0.025), rel=1e-9)
    assert certified(found, *both)
