"""`urdfkin chain` prints the axes and origins of the robot's frames, up and down the tree."""

import csv
import io

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import good, refused, urdfkin
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

PATHS = [
    ("panda", "panda_link0", "panda_hand_tcp"), ("panda", "panda_leftfinger", "panda_link2"),
    ("talos", "left_sole_link", "gripper_right_base_link"), ("polar", "", ""),
]  # fmt: skip


@pytest.mark.parametrize(("name", "base", "tip"), PATHS)
def test_axes_and_origins_of_a_chain_agree_with_the_robots_frames(name: str, base: str, tip: str) -> None:
    robot = library.load(name)
    ends = ["--base", base, "--tip", tip] if base else []
    data = good("chain", name, *ends, "--q", "random", "--seed", "3", "--format", "json").data
    q = np.array(data["q"])
    here = np.linalg.inv(robot.placement(q, data["base"]))
    values = dict(zip(robot.coordinate_names, q, strict=True))
    for joint in data["joints"]:
        model = robot.tree.joints[robot.tree.joint_index(joint["name"])]
        T = here @ robot.placement(q, f"joint:{joint['name']}")
        axis = T[:3, :3] @ model.axis
        slid = joint["kind"] == "prismatic" and not joint["backwards"]
        origin = T[:3, 3] - (axis * values[joint["name"]] if slid else 0.0)
        np.testing.assert_allclose(joint["axis"], -axis if joint["backwards"] else axis, atol=1e-14)
        np.testing.assert_allclose(joint["origin"], origin, atol=1e-14)
    T_base_tip = here @ robot.placement(q, data["tip"])
    np.testing.assert_allclose(data["placement"], T_base_tip, atol=1e-14)
    ways = np.array([joint["interorigin"] for joint in data["joints"]])
    np.testing.assert_allclose(data["joints"][0]["origin"] + ways.sum(axis=0), T_base_tip[:3, 3], atol=1e-14)
    assert data["verified"] is True


def test_the_table_and_the_csv_have_the_same_joints_in_the_order_of_the_path(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    names = list(library.load("panda").chain("panda_link2", "panda_leftfinger").joint_names)
    words = ["chain", "panda", "--base", "panda_leftfinger", "--tip", "panda_link2"]
    lines = urdfkin(*words).text.splitlines()
    rows = list(csv.reader(io.StringIO(urdfkin(*words, "--format", "csv").text)))
    assert [row[1] for row in rows[1:]] == [line.split()[0] for line in lines[3:-2]] == names
    assert all("backwards" in line for line in lines[3:-2])
    assert lines[-1].startswith("Pinocchio 4")


@pytest.mark.parametrize("mistake", ["an origin", "an axis", "the tip"])
def test_a_wrong_axis_or_origin_of_a_chain_is_a_disagreement(
    mistake: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = FrameChain.frames

    def wrong(path: FrameChain, q: FloatArray) -> FloatArray:
        poses = right(path, q)
        if mistake == "an axis":
            poses[..., 2, :3, 2] *= -1.0
        else:
            poses[..., -1 if mistake == "the tip" else 1, 0, 3] += 1e-12
        return poses

    monkeypatch.setattr(FrameChain, "frames", wrong)
    done = urdfkin("chain ur5 --q random")
    assert (done.code, done.out) == (1, b"")
    assert "the chain's axes disagree" in done.err


def test_an_unverified_chain_is_marked_and_a_batch_or_a_floating_joint_is_refused() -> None:
    done = urdfkin("chain ur5 --no-verify")
    assert done.code == 3
    assert "NOT VERIFIED" in done.text
    assert "the chain needs exactly one configuration" in refused("chain ur5 --q random:2")
    assert "a floating joint has no single axis" in refused("chain a1 --root-joint floating --base universe")
