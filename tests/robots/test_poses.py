"""Named poses of the catalogue, held against Pinocchio's limits and the SRDF files of example-robot-data."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio
import pytest

import urdfkin
from urdfkin.system.resources import example_robots_dir
from urdfkin.urdf.catalogue import catalogue

#: The SRDF's pose that `ready` is, for each robot that has one.
SRDF = {
    "a1": "standing", "anymal_kinova": "standing_with_arm_up", "b1": "standing",
    "b1_z1": "standing_with_arm_home", "centauro": "homing_nominal", "go1": "standing", "go2": "standing",
    "hyq": "standing", "icub": "half_sitting", "icub_reduced": "half_sitting", "kinova": "arm_up",
    "panda": "default", "panda_collision": "default", "talos": "half_sitting", "talos_box": "half_sitting",
}  # fmt: skip


def test_the_robots_with_a_pose_of_their_own_are_those_named_here() -> None:
    assert {name for name, entry in catalogue().items() if entry.poses} == set(SRDF)


@pytest.mark.slow
def test_ready_lies_within_every_limit_of_every_robot() -> None:
    outside = {}
    for name in catalogue():
        robot = urdfkin.load(name, verify=False)
        outside[name] = robot.limit_violations("ready")
        # Of what is at 0 in neutral, only that moves which may not be there, but for poses of their own.
        if not catalogue()[name].poses:
            moved = np.flatnonzero(robot.poses["ready"] != robot.neutral())
            assert len(moved) <= len(robot.limit_violations("neutral")), name
    assert {name: lines for name, lines in outside.items() if lines} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", SRDF)
def test_pinocchio_finds_ready_within_its_limits_and_neutral_outside(name: str) -> None:
    robot = urdfkin.load(name, verify=False)
    model = pinocchio.buildModelFromUrdf(str(catalogue()[name].path))

    def within(pose: str) -> bool:
        q = robot.to_pinocchio(robot.poses[pose])
        return bool(((model.lowerPositionLimit <= q) & (q <= model.upperPositionLimit)).all())

    assert within("ready")
    assert not within("neutral")


@pytest.mark.slow
@pytest.mark.parametrize("name", SRDF)
def test_ready_is_the_srdfs_pose(name: str) -> None:
    folder = Path(example_robots_dir()) / catalogue()[name].relative_path.parts[0] / "srdf"
    texts = [ElementTree.parse(path).getroot() for path in sorted(folder.glob("*.srdf"))]
    states = [
        state for root in texts for state in root.iter("group_state") if state.get("name") == SRDF[name]
    ]
    robot = urdfkin.load(name, verify=False)
    ready = dict(zip(robot.coordinate_names, robot.poses["ready"].tolist(), strict=True))
    found = []
    for state in states:
        says = {joint.get("name", ""): joint.get("value", "").split() for joint in state.iter("joint")}
        of_ours = {joint: float(x[0]) for joint, x in says.items() if joint in ready and len(x) == 1}
        if name == "kinova":  # its limits are a turn further than its pose
            of_ours["j2s6s200_joint_3"] = round(of_ours["j2s6s200_joint_3"] + 2.0 * np.pi, 4)
        found.append(
            all(ready[joint] == x for joint, x in of_ours.items()) and len(of_ours) >= len(ready) - 3
        )
    assert any(found)
