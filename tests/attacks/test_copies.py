"""A copy of a robot has handed out nothing yet: its certificate is its own, and begins empty."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

import urdfkin
from urdfkin.robot import Robot

COPIES: list[Callable[[Robot], Robot]] = [
    copy.copy,
    copy.deepcopy,
    lambda robot: pickle.loads(pickle.dumps(robot)),
]


@pytest.mark.parametrize("copied", COPIES)
def test_a_copy_has_a_ledger_of_its_own(copied: Callable[[Robot], Robot]) -> None:
    robot = urdfkin.load("panda")
    q = robot.neutral()
    robot.placement(q, "panda_hand")
    robot.prepare("panda_hand").placement(q)
    again = copied(robot)
    assert again.certificate().lines == ()
    assert not again.certificate().verified
    again.jacobian(q, "panda_hand", verify=False)
    again.prepare("panda_hand").jacobian(q)
    assert [(line.checked, line.unchecked) for line in robot.certificate().lines] == [(1, 1)]
    assert [(line.checked, line.unchecked) for line in again.certificate().lines] == [(0, 2)]
    assert (again.placement(q, "panda_hand") == robot.placement(q, "panda_hand")).all()


@pytest.mark.parametrize("copied", COPIES)
def test_a_copy_is_the_same_robot(copied: Callable[[Robot], Robot]) -> None:
    robot = urdfkin.load("panda", verify="sample")
    again = copied(robot)
    assert (again.name, again.verifier.policy, again.tip_frame) == (robot.name, "sample", robot.tip_frame)
    assert (again.sample(3) == robot.sample(3)).all()
    np.testing.assert_array_equal(
        again.placement(again.sample(3), again.link_frames),
        robot.placement(robot.sample(3), robot.link_frames, verify=False),
    )
