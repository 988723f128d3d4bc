"""Mimic rules are read and followed to their end twice; a slip in either reading is not verified."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests.reading import tree_of
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Origin
from urdfkin.verify.oracle import rules_of_text


def chain_of_followers(rules: list[tuple[int, float, float]]) -> str:
    """Joint j0 moves; joint j(i+1) follows the joint of rule i's number, by its multiplier and offset."""
    text = '<robot name="r"><link name="l0"/>'
    for i in range(len(rules) + 1):
        mimic = ""
        if i:
            leader, multiplier, offset = rules[i - 1]
            mimic = f'<mimic joint="j{leader}" multiplier="{multiplier!r}" offset="{offset!r}"/>'
        text += (
            f'<link name="l{i + 1}"/><joint name="j{i}" type="continuous"><parent link="l{i}"/>'
            f'<child link="l{i + 1}"/><origin xyz="0.1 0.2 0.3"/><axis xyz="0 0 1"/>{mimic}</joint>'
        )
    return text + "</robot>"


numbers = st.floats(-2.0, 2.0).filter(lambda x: x == 0.0 or abs(x) > 1e-3)


@pytest.mark.slow
@settings(max_examples=60)
@given(data=st.data(), n=st.integers(1, 5))
def test_chains_of_followers_end_at_the_same_joint_with_the_same_rule(data: st.DataObject, n: int) -> None:
    rules = [(data.draw(st.integers(0, i)), data.draw(numbers), data.draw(numbers)) for i in range(n)]
    text = chain_of_followers(rules)
    theirs = rules_of_text(text, {f"j{i}" for i in range(n + 1)})
    ours = {joint.name: joint.mimic for joint in tree_of(text.encode()).joints if joint.mimic}
    assert theirs.keys() == ours.keys()
    angles = [0.7]  # by the rules themselves, one after the other
    for i, (leader, multiplier, offset) in enumerate(rules, start=1):
        angles.append(multiplier * angles[leader] + offset)
        for rule in (theirs[f"j{i}"], ours[f"j{i}"]):
            assert rule.leader == "j0"
            assert rule.multiplier * 0.7 + rule.offset == pytest.approx(angles[i], abs=1e-12)


TEXT = chain_of_followers([(0, 1.5, 0.2), (1, -0.5, 0.1), (0, 2.0, 0.0)])

MISREAD: list[tuple[str, Callable[[str], str]]] = [
    ("a multiplier", lambda text: text.replace("1.5", "1.500000001")),
    ("an offset in the middle of a chain", lambda text: text.replace('"0.2"', '"0.2000000001"')),
    ("whom it follows", lambda text: text.replace('<mimic joint="j1"', '<mimic joint="j0"')),
    ("a rule that was lost", lambda text: re.sub('<mimic joint="j0" multiplier="2.0"[^>]*>', "", text)),
]  # fmt: skip


@pytest.mark.parametrize(("what", "misread"), MISREAD)
def test_a_rule_that_urdfkin_misreads_is_not_verified(what: str, misread: Callable[[str], str]) -> None:
    robot = Robot(tree_of(misread(TEXT).encode()), TEXT, origin=Origin("<text>"))
    assert misread(TEXT) != TEXT, what
    refused_at_the_door(robot) if robot.nq > 1 else disagrees(robot)


def refused_at_the_door(robot: Robot) -> None:
    with pytest.warns(urdfkin.NotVerifiedWarning, match="Pinocchio finds other coordinates .*: found j3"):
        robot.placement(robot.neutral(), "l4")
    assert not robot.certificate().verified


def disagrees(robot: Robot) -> None:
    with pytest.raises(urdfkin.VerificationError):
        robot.placement([0.7], "l4")
    with pytest.raises(urdfkin.VerificationError):
        robot.jacobian([0.7], "l4")


def test_a_reader_that_loses_every_rule_is_not_verified() -> None:
    # Only the user's own mimic=False frees the followers: a tree without any says nothing.
    robot = Robot(tree_of(TEXT.encode(), mimic=False), TEXT, origin=Origin("<text>"))
    with pytest.warns(urdfkin.NotVerifiedWarning, match="Pinocchio finds other coordinates"):
        robot.placement(robot.neutral(), "l4")
    free = urdfkin.load(TEXT, mimic=False)
    free.placement([0.1, 0.2, 0.3, 0.4], "l4")
    assert free.certificate().verified


def test_joints_in_another_order_are_not_verified() -> None:
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
        '<joint name="x" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>'
        '<joint name="y" type="continuous"><parent link="a"/><child link="c"/><axis xyz="0 0 1"/></joint>'
        "</robot>"
    )
    swapped = text.replace('"x"', '"z"')  # read so, x stands after y
    tree = tree_of(swapped.encode())
    for joint in tree.joints:
        if joint.name == "z":
            object.__setattr__(joint, "name", "x")
    robot = Robot(tree, text, origin=Origin("<text>"))
    assert robot.joint_names == ("y", "x")
    with pytest.warns(urdfkin.NotVerifiedWarning, match="other joints .* found the same in another order"):
        robot.placement([0.1, 0.2], "b")


def test_a_coordinate_that_is_given_to_another_joint_is_found() -> None:
    # Both sides once took from the tree which number of q is whose.
    robot = urdfkin.load("ur5")
    first, second, *_ = (i for i, joint in enumerate(robot.tree.joints) if joint.nq)
    places = list(robot.tree.q_index)
    places[first], places[second] = places[second], places[first]
    robot.tree.__dict__["q_index"] = tuple(places)
    with pytest.raises(urdfkin.VerificationError):
        robot.placement(np.arange(6.0), "tool0")
