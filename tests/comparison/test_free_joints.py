"""Planar and floating joints with other frames, and joints whose order does not matter."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.comparison import pairs
from tests.comparison.pairs import certified, loaded, moves_alike, written
from tests.reading import present
from tests.urdfs import joint, limit
from urdfkin.comparison.certificate import SAME
from urdfkin.comparison.result import Verdict
from urdfkin.robot import Robot

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
    assert "within the bounds" in str(found.checked)
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
    return loaded(urdfs.robot(*joints, name="gantry"))


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
