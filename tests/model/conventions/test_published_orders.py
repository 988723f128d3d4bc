"""The orders of Isaac Lab and Isaac Gym are those that other projects have published."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import urdfkin
from urdfkin.model.conventions import find_convention

LEGS = ("LF", "LH", "RF", "RH")
SIDES = ("left", "right")
#: github.com/isaac-sim/IsaacLab/issues/270 and source/isaaclab_tasks/test/core/test_anymal_symmetry.py.
ANYMAL = [f"{leg}_{part}" for part in ("HAA", "HFE", "KFE") for leg in LEGS]
#: github.com/isaac-sim/IsaacLab/issues/270: "in the isaac gym environments".
ANYMAL_GYM = [f"{leg}_{part}" for leg in LEGS for part in ("HAA", "HFE", "KFE")]
#: github.com/ccwss-maker/unitree_go2_simulation, file `cmd`: the printed joint_names of Isaac Lab.
GO2 = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in ("FL", "FR", "RL", "RR")]
#: github.com/Improbable-AI/walk-these-ways, go1_gym_deploy/utils/cheetah_state_estimator.py: joint_idxs, from
#: the order of the file and of the motors (FR, FL, RR, RL) to that of Isaac Gym.
GO1_GYM = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
#: github.com/NVlabs/GR00T-WholeBodyControl/issues/78, which cites policy_parameters.hpp: mujoco_to_isaaclab.
G1 = [
    0, 6, 12, 1, 7, 13, 2, 8, 14, 3, 9, 15, 22, 4, 10, 16, 23, 5, 11, 17, 24, 18, 25, 19, 26, 20, 27, 21, 28,
]  # fmt: skip
#: github.com/RoboCubPilot/g1_deploy_mujoco/issues/5: the first joints of the policy.
G1_NAMES = ["left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint", "left_hip_roll_joint"]


def _pairs(words: str) -> list[str]:
    """Return the names of both sides, but "torso" once."""
    return [name for word in words.split() for name in ([word] if word == "torso" else _sides(word))]


def _sides(part: str) -> list[str]:
    return [f"{side}_{part}" for side in SIDES]


#: github.com/jiemingcui/gaponet, tasks/humanoid_amass/motions/joint_names.py: h1_2_with_hand_fix_joints.
H1_2 = _pairs(
    "hip_yaw torso hip_pitch shoulder_pitch hip_roll shoulder_roll knee shoulder_yaw ankle_pitch elbow"
    " ankle_roll wrist_roll wrist_pitch wrist_yaw"
)
#: docs.isaacsim.omniverse.nvidia.com/latest/robot_setup_tutorials/tutorial_rig_legged_robot.html: dof_names.
H1 = _pairs("hip_yaw torso hip_roll shoulder_pitch hip_pitch shoulder_roll knee shoulder_yaw ankle elbow")
#: github.com/isaac-sim/IsaacSim, the docstring of dof_names of Articulation: the Franka Panda with its hand.
PANDA = [*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1", "panda_finger_joint2"]


def _humanoid(leg: str, arm: str) -> str:
    """Return a robot with two legs on the pelvis and two arms on the torso, the right ones first."""
    chains = [("pelvis", [f"{side}_{part}" for part in leg.split()]) for side in SIDES[::-1]]
    chains.append(("pelvis", ["torso"]))
    chains += [("torso_link", [f"{side}_{part}" for part in arm.split()]) for side in SIDES[::-1]]
    text = '<link name="pelvis"/>'
    for parent, joints in chains:
        for joint in joints:
            text += f'<link name="{joint}_link"/><joint name="{joint}" type="continuous"><axis xyz="0 0 1"/>'
            text += f'<parent link="{parent}"/><child link="{joint}_link"/></joint>'
            parent = f"{joint}_link"  # noqa: PLW2901
    return f'<robot name="humanoid">{text}</robot>'


H1_URDF = _humanoid(
    "hip_yaw hip_roll hip_pitch knee ankle", "shoulder_pitch shoulder_roll shoulder_yaw elbow"
)
H1_2_URDF = _humanoid(
    "hip_yaw hip_pitch hip_roll knee ankle_pitch ankle_roll",
    "shoulder_pitch shoulder_roll shoulder_yaw elbow wrist_roll wrist_pitch wrist_yaw",
)


@pytest.mark.parametrize(
    ("robot", "convention", "published"),
    [
        ("anymal_c", "isaaclab", ANYMAL),
        ("anymal_c", "isaacgym", ANYMAL_GYM),
        ("go2", "isaaclab", GO2),
        (H1_URDF, "isaaclab", H1),
        (H1_2_URDF, "isaaclab", H1_2),
        ("panda", "isaaclab", PANDA),
    ],
    ids=["anymal_c", "anymal_c isaacgym", "go2", "h1", "h1_2", "panda"],
)
def test_the_order_is_the_published_one(robot: str, convention: str, published: list[str]) -> None:
    loaded = urdfkin.load(robot, verify=False)
    assert list(loaded.convention(convention).joint_names) == published
    if robot != "panda":  # a chain whose last two joints are siblings
        assert list(loaded.convention("urdf").joint_names) != published


def test_isaac_gym_has_the_go1s_legs_by_name_and_not_as_in_the_file() -> None:
    go1 = urdfkin.load("go1", verify=False)
    written = go1.convention("urdf").joint_names
    assert [written.index(name) for name in go1.convention("isaacgym").joint_names] == GO1_GYM


def test_isaac_lab_3_has_siblings_in_the_order_of_the_file() -> None:
    go1 = urdfkin.load("go1", verify=False)
    legs = ("FR", "FL", "RR", "RL")
    expected = tuple(f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in legs)
    assert go1.convention("isaaclab3").joint_names == expected


def test_the_g1_has_the_published_permutation_from_mujoco_to_isaac_lab() -> None:
    g1 = urdfkin.load("g1", verify=False)
    mujoco, isaaclab = g1.convention("mujoco"), g1.convention("isaaclab")
    assert list(isaaclab.joint_names[:4]) == G1_NAMES
    assert [mujoco.joint_names.index(name) for name in isaaclab.joint_names] == G1
    q = g1.sample(3)
    assert np.array_equal(mujoco.to(q)[:, G1], isaaclab.to(q))


def test_a_fixed_joint_counts_as_a_level_only_if_the_importer_keeps_it() -> None:
    text = """<robot name="r"><link name="base"/><link name="flange"/>
    <link name="x"/><link name="y"/><link name="z"/>
    <joint name="mount" type="fixed"><parent link="base"/><child link="flange"/></joint>
    <joint name="a" type="continuous"><parent link="flange"/><child link="x"/><axis xyz="0 0 1"/></joint>
    <joint name="b" type="continuous"><parent link="base"/><child link="y"/><axis xyz="0 0 1"/></joint>
    <joint name="c" type="continuous"><parent link="y"/><child link="z"/><axis xyz="0 0 1"/></joint>
    </robot>"""
    robot = urdfkin.load(text, verify=False)
    kept = replace(find_convention("isaaclab"), order="breadth first, with fixed joints")
    assert robot.convention("isaaclab").joint_names == ("a", "b", "c")
    assert robot.convention(kept).joint_names == ("b", "c", "a")
