"""Each built-in convention that a library defines: the library's results with converted inputs are ours.

MuJoCo and Pinocchio run everywhere. The others run where they are installed:
`pip install drake idyntree roboticstoolbox-python newton[importers]`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.conventions.libraries import LIBRARIES, Library
from urdfkin.conventions import Conversion, find_convention
from urdfkin.robot import Robot

ROBOTS = (
    "a1", "anymal_c", "baxter", "go2", "hyq", "icub", "kinova", "panda", "romeo_small", "solo12", "so101",
    "simple_humanoid", "talos_reduced", "tiago", "tiago_dual", "ur5", "ur10", "ur3_gripper", "xarm7", "z1",
)  # fmt: skip
#: Robots with a floating base and branches, for the planted mistakes.
FEW = ("a1", "tiago", "panda")


def _loaded(name: str, library: str) -> Robot:
    root = None if library == "rtb" else "floating"
    return urdfkin.load(name, root_joint=root, verify=False)


def _worst(robot: Robot, library: Library, conversion: Conversion, seed: int = 0) -> float:
    """Return the largest difference of placements, velocities and Jacobians of three links."""
    rng = np.random.default_rng(seed)
    q, v = robot.sample(1, seed)[0], rng.standard_normal(robot.nv)
    their_q, their_v = conversion.to(q, v)
    worst = 0.0
    for link in {robot.link_names[-1], robot.link_names[len(robot.link_names) // 2], robot.tip_frame}:
        T, twist, J = library.evaluate(their_q, their_v, link)
        frame = f"link:{link}"
        pairs = (
            (T, robot.placement(q, frame)),
            (conversion.six(twist), robot.velocity(q, v, frame)),
            (conversion.from_jacobian(q, J), robot.jacobian(q, frame)),
        )
        worst = max(
            worst, *(float(np.abs(theirs - ours).max() / (1 + np.abs(ours).max())) for theirs, ours in pairs)
        )
    return worst


def _conversion(robot: Robot, name: str, library: Library, **changes: Any) -> Conversion:
    joints = library.names if name == "idyntree" else None
    return robot.convention(replace(find_convention(name), **changes), joints)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("robot_name", ROBOTS)
@pytest.mark.parametrize("name", LIBRARIES)
def test_a_librarys_own_results_in_its_convention_are_ours(
    name: str, robot_name: str, tmp_path: Path
) -> None:
    robot = _loaded(robot_name, name)
    library = LIBRARIES[name](robot, tmp_path)
    conversion = _conversion(robot, name, library)
    assert list(conversion.joint_names) == library.names
    if (name, robot_name) == ("rtb", "icub"):
        return  # the toolbox turns an axis that is not parallel to x, y or z
    assert _worst(robot, library, conversion) < library.tolerance


#: Mistakes in a convention that has a floating base.
MISTAKES: dict[str, dict[str, Any]] = {
    "quaternion": {"xyzw": {"quaternion": "wxyz"}, "wxyz": {"quaternion": "xyzw"}},
    "six": {"linear first": {"six": "angular first"}, "angular first": {"six": "linear first"}},
    "linear": {"body": {"linear": "parent"}, "parent": {"linear": "body"}},
    "angular": {"body": {"angular": "parent"}, "parent": {"angular": "body"}},
    "base_v": {"linear first": {"base_v": "angular first"}, "angular first": {"base_v": "linear first"}},
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("name", [name for name in LIBRARIES if name != "rtb"])
def test_a_planted_mistake_in_a_convention_is_found(name: str, mistake: str, tmp_path: Path) -> None:
    robot = _loaded("a1", name)
    library = LIBRARIES[name](robot, tmp_path)
    right = find_convention(name)
    wrong = _conversion(robot, name, library, **MISTAKES[mistake][getattr(right, mistake)])
    assert _worst(robot, library, wrong) > 1e-3


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("robot_name", FEW)
@pytest.mark.parametrize("name", LIBRARIES)
def test_two_exchanged_joints_are_found(name: str, robot_name: str, tmp_path: Path) -> None:
    robot = _loaded(robot_name, name)
    library = LIBRARIES[name](robot, tmp_path)
    joints = list(library.names)
    joints[1], joints[2] = joints[2], joints[1]
    wrong = robot.convention(name, joints)
    links = robot.link_names[1:]
    q = robot.sample(1)[0]
    theirs = np.array([library.evaluate(wrong.to(q), np.zeros(wrong.nv), link)[0] for link in links])
    assert np.abs(theirs - robot.placement(q, robot.link_frames[1:])).max() > 1e-3
