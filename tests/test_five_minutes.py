"""The first five minutes: one's own robot's Jacobian, its table, and why Pinocchio's numbers differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio
import pytest

import urdfkin as library
from tests.cli.running import urdfkin

#: Somebody's own: joints are not in alphabetical order, a wheel turns without end.
OWN = (
    '<robot name="mine"><link name="floor"/><link name="column"/><link name="upper"/><link name="tool"/>'
    '<joint name="turntable" type="continuous"><parent link="floor"/><child link="column"/>'
    '<axis xyz="0 0 1"/></joint>'
    '<joint name="shoulder" type="revolute"><parent link="column"/><child link="upper"/>'
    '<origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="9" velocity="3"/></joint>'
    '<joint name="elbow" type="revolute"><parent link="upper"/><child link="tool"/>'
    '<origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="9" velocity="3"/></joint>'
    "</robot>"
)
POSE = "turntable=90deg, shoulder=-30deg, elbow=45deg"


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "mine.urdf"
    path.write_text(OWN)
    return path


def test_minute_one_the_jacobian_at_a_pose_in_degrees_by_joint_names(mine: Path) -> None:
    done = urdfkin("jacobian", str(mine), "--q", POSE)
    assert done.code == 0
    assert all(name in done.text for name in ("jacobian of tool", "turntable", "shoulder", "elbow"))
    assert "verified by Pinocchio" in done.text
    data = urdfkin("jacobian", str(mine), "--q", POSE, "--format", "json").data
    model = pinocchio.buildModelFromUrdf(str(mine))
    q = np.array([np.cos(np.pi / 2), np.sin(np.pi / 2), np.radians(-30), np.radians(45)])
    frame = model.getFrameId("tool")
    J = pinocchio.computeFrameJacobian(
        model, model.createData(), q, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    np.testing.assert_allclose(data["result"][0], J, atol=1e-15)


def test_minute_three_the_table_in_a_notebook(mine: Path) -> None:
    robot = library.load(mine)
    table = robot.dh()
    cell = table._repr_html_()
    assert "standard Denavit-Hartenberg parameters" in cell
    assert all("<td" in cell and joint in cell for joint in ("turntable", "shoulder", "elbow"))
    np.testing.assert_allclose(table.placement(POSE), robot.placement(POSE, "tool"), atol=1e-15)


def test_minute_five_why_pinocchios_numbers_differ(mine: Path) -> None:
    robot = library.load(mine)
    q = pinocchio.neutral(pinocchio.buildModelFromUrdf(str(mine)))
    with pytest.raises(
        library.InputError, match=r"Pinocchio's q has that length: robot.from_pinocchio\(q\)"
    ) as why:
        robot.jacobian(q)
    assert "turntable, shoulder, elbow" in str(why.value)
    np.testing.assert_array_equal(robot.from_pinocchio(q), robot.neutral())
    page = (Path(__file__).parents[1] / "docs" / "conventions-used.md").read_text(encoding="utf-8")
    for answer in (
        "LOCAL_WORLD_ALIGNED",
        "classical one",
        "[linear; angular]",
        "from_pinocchio",
        "not the order of the file",
    ):
        assert answer in page
