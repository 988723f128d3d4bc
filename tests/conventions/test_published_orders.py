"""The orders of Isaac Lab and Isaac Gym are those that other projects have published."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import urdfkin
from urdfkin.conventions import find_convention

LEGS = ("LF", "LH", "RF", "RH")
SIDES = ("left", "right")
#: github.com/isaac-sim/IsaacLab/issues/270 and source/isaaclab_tasks/test/core/test_anymal_symmetry.py.
ANYMAL = [f"{leg}_{part}" for part in ("HAA", "HFE", "KFE") for leg in LEGS]
#: github.com/isaac-sim/IsaacLab/issues/270: "in the isaac gym environments".
ANYMAL_GYM = [f"{leg}_{part}" for leg in LEGS for part in ("HAA", "HFE", "KFE")]
#: github.com/ccwss-maker/unitree_go2_simulation, file `cmd`: the printed joint_names of Isaac Lab.
GO2 = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in ("FL", "FR", "RL", "RR")]
#: github.com/NVlabs/GR00T-WholeBodyControl/issues/78, which cites policy_parameters.hpp: mujoco_to_isaaclab.
G1 = [
    0,
    6,
    12,
    1,
    7,
    13,
    2,
    8,
    14,
    3,
    9,
    15,
    22,
    4,
    10,
    16,
    23,
    5,
    11,
    17,
    24,
    18,
    25,
    19,
    26,
    20,
    27,
    21,
    28,
]
#: github.com/RoboCubPilot/g1_deploy_mujoco/issues/5: the first joints of the policy.
G1_NAMES = ["left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint", "left_hip_roll_joint"]
#: github.com/jiemingcui/gaponet, tasks/humanoid_amass/motions/joint_names.py: h1_2_with_hand_fix_joints.
H1_2 = [
    "left_hip_yaw",
    "right_hip_yaw",
    "torso",
    "left_hip_pitch",
    "right_hip_pitch",
    "left_shoulder_pitch",
    "right_shoulder_pitch",
    "left_hip_roll",
    "right_hip_roll",
    "left_shoulder_roll",
    "right_shoulder_roll",
    "left_knee",
    "right_knee",
    "left_shoulder_yaw",
    "right_shoulder_yaw",
    "left_ankle_pitch",
    "right_ankle_pitch",
    "left_elbow",
    "right_elbow",
    "left_ankle_roll",
    "right_ankle_roll",
    "left_wrist_roll",
    "right_wrist_roll",
    "left_wrist_pitch",
    "right_wrist_pitch",
    "left_wrist_yaw",
    "right_wrist_yaw",
]
_LEG = ("hip_yaw", "hip_pitch", "hip_roll", "knee", "ankle_pitch", "ankle_roll")
_ARM = (
    "shoulder_pitch",
    "shoulder_roll",
    "shoulder_yaw",
    "elbow",
    "wrist_roll",
    "wrist_pitch",
    "wrist_yaw",
)


def _h1_2() -> str:
    """Return a robot with the joints of an H1-2: two legs on the pelvis, two arms on the torso."""
    chains = {f"{side}_leg": ("pelvis", [f"{side}_{part}" for part in _LEG]) for side in SIDES}
    chains["torso"] = "pelvis", ["torso"]
    chains |= {f"{side}_arm": ("torso_link", [f"{side}_{part}" for part in _ARM]) for side in SIDES}
    text = '<link name="pelvis"/>'
    for parent, joints in chains.values():
        for joint in joints:
            text += f'<link name="{joint}_link"/><joint name="{joint}" type="continuous"><axis xyz="0 0 1"/>'
            text += f'<parent link="{parent}"/><child link="{joint}_link"/></joint>'
            parent = f"{joint}_link"  # noqa: PLW2901
    return f'<robot name="h1_2">{text}</robot>'


@pytest.mark.parametrize(
    ("robot", "convention", "published"),
    [
        ("anymal_c", "isaaclab", ANYMAL),
        ("anymal_c", "isaacgym", ANYMAL_GYM),
        ("go2", "isaaclab", GO2),
        (_h1_2(), "isaaclab", H1_2),
    ],
    ids=["anymal_c isaaclab", "anymal_c isaacgym", "go2 isaaclab", "h1_2 isaaclab"],
)
def test_the_order_is_the_published_one(robot: str, convention: str, published: list[str]) -> None:
    loaded = urdfkin.load(robot, verify=False)
    assert list(loaded.convention(convention).joint_names) == published
    assert list(loaded.convention("urdf").joint_names) != published


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
