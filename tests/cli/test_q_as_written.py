"""--q, --v and --a as people write them: by name, in degrees, as a pose; each command reads them the same."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import urdfkin

Q = "panda_joint1=30deg,panda_joint4=-pi/2,panda_joint6=1.5"
LONG = [math.pi / 6, -0.785398, 0.0, -math.pi / 2, 0.0, 1.5, 0.785398, 0.001]


def test_a_pose_in_degrees_by_joint_names_is_what_the_numbers_are() -> None:
    named = urdfkin("jacobian", "panda", "--q", f"ready,{Q}", "--format", "json")
    assert named.code == 0
    assert "warning" not in named.err
    assert named.data["q"] == [LONG]
    blanks = urdfkin("jacobian", "panda", "--q", f"[{' '.join(map(repr, LONG))}]", "--format", "json")
    assert blanks.data["result"] == named.data["result"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--q", Q), "error: --q: no value for panda_joint2, panda_joint3, panda_joint5, panda"),
        (("--q", Q), "or begin with a pose that they keep: 'neutral, panda_joint1=...'"),
        (("--q", "raedy"), "error: --q: unknown pose 'raedy'; did you mean ready?"),
        (("--q", "0 0 0 0 0 0 0 0 0"), "robot.from_pinocchio(q, mimic=False) converts it to urdfkin's; "),
        (("--q", "ready", "--v", "neutral,panda_joint1=1mm/s"), "--v, panda_joint1: wrong unit: found"),
    ],
)  # fmt: skip
def test_what_is_missing_or_not_meant_is_said(words: tuple[str, ...], message: str) -> None:
    done = urdfkin("velocity", "panda", *words)
    assert done.code == 2
    assert message in done.err


def test_degrees_typed_as_radians_are_recognised() -> None:
    done = urdfkin("placement", "panda", "--q", "ready,panda_joint1=30", "--no-verify")
    assert "warning: joint panda_joint1: 30 is outside [-2.8973, 2.8973]; degrees? write 30deg" in done.err


@pytest.mark.slow
def test_every_command_that_takes_q_reads_it_so(tmp_path: Path) -> None:
    q = "shoulder_pan_joint=30deg, shoulder_lift_joint=-90deg, elbow_joint=90deg, wrist_1_joint=0,"
    q += "wrist_2_joint=pi/2 , wrist_3_joint=0"
    at = library.load("ur5").placement(q, "tool0")[:3, 3]
    for command in ("imu", "singular-values"):
        done = urdfkin(command, "ur5", "--q", q, "--format", "json")
        assert (done.code, done.data["q"][0][0]) == (0, math.pi / 6)
    picture = tmp_path / "way.svg"
    done = urdfkin("plot", "ur5", "--to", "raedy", "-o", str(picture))
    assert "error: --to: unknown pose 'raedy'; did you mean ready?" in done.err
    assert (
        urdfkin("plot", "ur5", "--from", "ready", "--to", q, "--panel", "position", "-o", str(picture)).code
        == 0
    )
    assert ", ".join(f"{x:.3g}" for x in np.round(at, 9)) in picture.read_text()
