"""Planar and floating joints that count from another place, and joints whose order does not matter."""

from __future__ import annotations

import json
from itertools import permutations

import numpy as np
import pytest

import urdfkin
from tests.comparison import pairs
from tests.comparison.pairs import loaded
from tests.reading import present
from urdfkin.comparison.certificate import SAME, certificate, recheck
from urdfkin.comparison.result import Sameness, Verdict
from urdfkin.robot import Robot

LIMIT = '<limit lower="-1" upper="1.5" effort="1" velocity="1"/>'
CHAIN = (
    '<robot name="r"><link name="ground"/><link name="body"/><link name="thigh"/><link name="foot"/>'
    '<joint name="free" type="{}"><parent link="ground"/><child link="body"/>'
    '<origin xyz="0.1 0.2 0.3" rpy="0.2 -0.3 0.4"/><axis xyz="0 0 1"/></joint>'
    '<joint name="hip" type="revolute"><parent link="body"/><child link="thigh"/>'
    '<origin xyz="0.3 0.1 0" rpy="{} 0.5 0"/><axis xyz="0 1 0"/>' + LIMIT + "</joint>"
    '<joint name="knee" type="revolute"><parent link="thigh"/><child link="foot"/>'
    '<origin xyz="0 0 -0.4" rpy="0.3 0 0"/><axis xyz="1 0 0"/>' + LIMIT + "</joint></robot>"
)


def moves_alike(found: Sameness, a: Robot, b: Robot) -> bool:
    """Whether all links stand alike at random configurations of either's free joints too."""
    q = a.sample(5, 1)
    base = f"link:{found.base_links[1]}"
    T_a = a.placement(q, [f"link:{ours}" for ours, _ in found.links])
    T_b = b.placement(found.to_b(q), [base, *(f"link:{theirs}" for _, theirs in found.links)])
    seen = found.base @ b.placement(b.neutral(), base) @ np.linalg.inv(T_b[:, :1]) @ T_b[:, 1:]
    return bool(np.abs(T_a - seen).max() <= 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floating", "planar"])
@pytest.mark.parametrize("also", ["", "renamed", "rerooted"])
def test_a_free_joint_may_count_from_another_place(kind: str, also: str) -> None:
    a = loaded(CHAIN.format(kind, "0"), verify=True)
    tree = pairs.counted_elsewhere(a.tree)
    assert tree is not a.tree
    b = loaded(pairs.renamed(tree) if also == "renamed" else tree, verify=True)
    if also == "rerooted":  # stands on its foot, and the free joint runs back to the ground
        b = loaded(pairs.counted_elsewhere(pairs.rerooted(a.tree)), verify=True)
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME_AFTER
    assert any("the pose of q[" in line for line in found.after)
    assert moves_alike(found, a, b)
    assert "within the bounds" in str(found.checked)
    assert found.as_written is not None
    document = json.loads(json.dumps(certificate(found)))
    assert recheck(document, a, b) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_what_hangs_on_a_free_joint_is_still_compared(kind: str) -> None:
    a, b = loaded(CHAIN.format(kind, "0")), loaded(CHAIN.format(kind, "0.001"))
    moved = loaded(pairs.counted_elsewhere(b.tree))
    for other in (b, moved):
        found = urdfkin.same(a, other)
        assert [one.place for one in found.differences] == ["joint hip"]
        assert found.differences[0].radians == pytest.approx(0.001 * np.cos(0.5), rel=0.2)
        worst = present(found.worst)
        assert 0.0 < worst.lower <= worst.upper <= 1.03 * worst.lower


def test_a_plane_that_is_tilted_is_no_matter_of_coordinates() -> None:
    a = loaded(CHAIN.format("planar", "0"))
    b = loaded(CHAIN.format("planar", "0").replace("0.2 -0.3 0.4", "0.2 -0.299 0.4"))
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.DIFFERS
    assert found.differences[0].words.startswith("joint free: its plane is tilted by")
    assert np.isinf(present(found.worst).upper)  # it slides without limits
    assert recheck(json.loads(json.dumps(certificate(found))), a, b) == []


# -- the order of joints -----------------------------------------------------------------------------

AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def gantry(order: str, wrist: str = "turn", tilt: str = "0") -> Robot:
    """Slides in an order, then a turn about z, and a slide along it: what hangs on them is the same."""
    links = "".join(f'<link name="{order}{i}"/>' for i in range(3))
    text, parent = "", "base"
    for i, name in enumerate([*order, *(["turn", "quill"] if wrist == "turn" else ["quill", "turn"])]):
        child = f"{order}{i}" if i < 3 else f"{wrist}{i}" if i < 4 else "tool"
        kind, axis = ("revolute", "0 0 1") if name == "turn" else ("prismatic", AXES.get(name, "0 0 1"))
        origin = f'<origin xyz="0 0 0" rpy="{tilt} 0 0"/>' if i == 4 else ""
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{origin}'
            f'<axis xyz="{axis}"/>{LIMIT}</joint>'
        )
        parent = child
    links += f'<link name="base"/><link name="{wrist}3"/><link name="tool"/>'
    return loaded(f'<robot name="gantry">{links}{text}</robot>')


@pytest.mark.slow
@pytest.mark.parametrize(("order", "wrist"), [("xyz", "quill"), ("zyx", "turn"), ("yzx", "quill")])
def test_slides_may_come_in_any_order_and_one_along_an_axis_before_it_or_behind(
    order: str, wrist: str
) -> None:
    a, b = gantry("xyz"), gantry(order, wrist)
    found = urdfkin.same(a, b)
    assert found.verdict is Verdict.SAME
    assert {(one.a, one.b) for one in found.joints} == {(name, name) for name in (*"xyz", "turn", "quill")}
    assert found.orders
    assert moves_alike(found, a, b)
    assert recheck(json.loads(json.dumps(certificate(found))), a, b) == []


@pytest.mark.slow
def test_every_order_of_slides_is_the_same_robot() -> None:
    a = gantry("xyz")
    for order in permutations("xyz"):
        assert urdfkin.same(a, gantry("".join(order)), bounds=False).verdict is Verdict.SAME


def test_an_order_that_axes_do_not_allow_is_a_difference() -> None:
    assert not urdfkin.same(gantry("xyz", tilt="0.001"), gantry("xyz", "quill", tilt="0.001"), bounds=False)


@pytest.mark.slow
def test_a_carriage_that_another_joint_carries_is_a_difference() -> None:
    a, b = gantry("xyz"), gantry("yxz")
    named = loaded(b.urdf.replace('"yxz', '"xyz'))
    found = urdfkin.same(a, named, bounds=False)
    assert [one.words for one in found.differences] == [
        "link xyz0 is carried by joint x in A, by joint y in B"
    ]


@pytest.mark.slow
def test_the_schema_knows_conversions_and_orders() -> None:
    from jsonschema import Draft202012Validator  # noqa: PLC0415

    schema = Draft202012Validator(SAME.schema())
    a = loaded(CHAIN.format("planar", "0"))
    for found in (
        urdfkin.same(a, loaded(pairs.counted_elsewhere(a.tree)), bounds=False),
        urdfkin.same(gantry("xyz"), gantry("zyx"), bounds=False),
    ):
        schema.validate(json.loads(json.dumps(certificate(found))))


@pytest.mark.parametrize("floating_first", [True, False])
def test_what_carries_the_root_of_one_model_alone_is_all_that_differs(floating_first: bool) -> None:
    text = CHAIN.format("fixed", "0").replace(
        '<axis xyz="0 0 1"/></joint><joint name="hip"', '</joint><joint name="hip"'
    )
    fixed, longer = (loaded(each, verify=True) for each in (text, text.replace("0 0 -0.4", "0 0 -0.425")))
    floating = urdfkin.load(text, root_joint="floating")
    both = (floating, fixed) if floating_first else (fixed, floating)
    found = urdfkin.same(*both)
    assert [one.words for one in found.differences] == [f"joint root_joint is only in {'BA'[floating_first]}"]
    assert found.worst is None
    found = urdfkin.same(*(floating, longer) if floating_first else (longer, floating))
    assert found.worst is not None
    assert found.worst.lower == pytest.approx(0.025, rel=1e-9)
    assert found.worst.upper == pytest.approx(0.025, rel=1e-9)
    assert recheck(certificate(found), *((floating, longer) if floating_first else (longer, floating))) == []
