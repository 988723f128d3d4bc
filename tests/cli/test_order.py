"""`urdfkin order`: the table of all tools, and the code that converts from one to another."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as run
from urdfkin.model.conventions import BUILT_IN

TOOLS = [name for name in BUILT_IN if name != "idyntree"]


def test_a_row_is_a_joint_and_a_column_a_convention() -> None:
    lines = run("order", "a1", "--root-joint", "floating", "--format", "csv").text.splitlines()
    table = [line.split(",") for line in lines]
    assert table[0] == ["joint", *TOOLS]
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    assert [row[0] for row in table[1:]] == list(robot.joint_names)
    for k, name in enumerate(TOOLS, 1):
        for row in table[1:]:
            q, _, v = row[k].partition("/")
            first = int((v or q).split("-")[0])
            assert robot.convention(name).rate_names[first].split(".")[0] == row[0]


def test_tools_with_the_same_indices_share_a_column() -> None:
    text = run("order", "a1").text
    assert "urdfkin: also pinocchio, kdl, isaacgym" in text
    assert text.splitlines()[1].split() == [
        "joint",
        "urdfkin",
        "urdf",
        "isaaclab",
        "isaaclab3",
        "alphabetical",
    ]


@pytest.mark.parametrize(
    ("start", "end"), list(itertools.product(("mujoco", "isaaclab", "drake", "pinocchio"), repeat=2))
)
def test_the_printed_code_converts(start: str, end: str) -> None:
    text = run("order", "tiago", "--from", start, "--to", end, "--root-joint", "floating").text
    robot = urdfkin.load("tiago", root_joint="floating", verify=False)
    rng = np.random.default_rng(0)
    q, v = robot.sample(1)[0], rng.standard_normal(robot.nv)
    q_from, v_from = robot.convention(start).to(q, v)
    space: dict[str, Any] = {
        "q_from": q_from,
        "v_from": v_from,
        "np": np,
        "robot": robot,
        "six_from": np.arange(6),
    }
    exec(text, space)
    q_to, v_to = robot.convention(end).to(q, v)
    assert np.allclose(space["q_to"], q_to, 0, 1e-14)
    assert np.allclose(space["v_to"], v_to, 0, 1e-14)
    assert ("six_to" in text) == ((start == "drake") != (end == "drake"))


def test_units_and_motor_zeros_are_in_the_code(tmp_path: Path) -> None:
    file = tmp_path / "motors.toml"
    file.write_text('joints = ["joint_2", "joint_1"]\nangle = "deg"\n[joint.joint_1]\nsign = -1\nzero = 5\n')
    space: dict[str, Any] = {"q_from": np.array([1.0, 2.0]), "v_from": np.array([1.0, 2.0]), "np": np}
    exec(run("order", "planar_two_link", "--to", str(file)).text, space)
    assert np.allclose(space["q_to"], [np.degrees(2), 5 - np.degrees(1)])
    assert np.allclose(space["v_to"], [np.degrees(2), -np.degrees(1)])


def test_json_has_the_same_numbers_as_the_library() -> None:
    data = run("order", "a1", "--to", "isaaclab", "--format", "json").data
    permutation = urdfkin.load("a1", verify=False).convention("isaaclab").permutation
    assert permutation is not None
    assert data["q"]["reordering"]["index"] == permutation.tolist()
    every = run("order", "a1", "--format", "json").data["conventions"]
    assert list(every) == TOOLS
    assert every["isaaclab"]["sources"]


def test_an_unknown_convention_is_one_line_with_the_nearest() -> None:
    done = run("order", "a1", "--to", "mujocco")
    assert done.code == 2
    assert "unknown convention 'mujocco'; did you mean mujoco" in done.err
