"""Deleted robots free their memory and files, and a copy of a robot has an empty certificate."""

import copy
import json
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts.leaks import PARTS
from urdfkin.robot import Robot

ROBOTS = 300


@pytest.mark.long
def test_three_hundred_deleted_robots_leak_no_object_file_descriptor_or_memory() -> None:
    # `python -m scripts.leaks 10000` is a longer run of this test.
    command, root = [sys.executable, "-m", "scripts.leaks", str(ROBOTS)], Path(__file__).parents[2]
    parts = json.loads(subprocess.run(command, capture_output=True, check=True, cwd=root).stdout)
    assert len(parts) == PARTS
    # The first parts fill caches of limited size. One leaked object for each robot would be 180 objects.
    second, last = parts[1], parts[-1]
    assert last["descriptors"] == second["descriptors"]
    assert last["objects"] - second["objects"] < 60
    assert last["MiB"] - second["MiB"] < 8.0


COPIES: list[Callable[[Robot], Robot]] = [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]


@pytest.mark.parametrize("copied", COPIES)
def test_a_copy_of_a_robot_has_its_own_certificate(copied: Callable[[Robot], Robot]) -> None:
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
def test_a_copy_of_a_robot_gives_the_same_results(copied: Callable[[Robot], Robot]) -> None:
    robot = urdfkin.load("panda", verify="sample")
    again = copied(robot)
    assert (again.name, again.verifier.policy, again.tip_frame) == (robot.name, "sample", robot.tip_frame)
    assert (again.sample(3) == robot.sample(3)).all()
    np.testing.assert_array_equal(
        again.placement(again.sample(3), again.link_frames),
        robot.placement(robot.sample(3), robot.link_frames, verify=False),
    )
