"""The sheet draws the numbers, says what was checked, and the same motion gives the same file."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import urdfkin
from urdfkin.cli.plot import PANELS as OFFERED
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.motion.frame_motion import FrameMotion, frame_motion
from urdfkin.motion.trajectory import Trajectory, line
from urdfkin.robot import Robot
from urdfkin.view.figure import save
from urdfkin.view.plot.panels import PANELS
from urdfkin.view.plot.sheet import foot, sheet

pytest.importorskip("matplotlib")
Case = tuple[Robot, FrameMotion, Trajectory]


@pytest.fixture(scope="module")
def case() -> Case:
    robot = urdfkin.load("panda")
    x = line(robot, robot.sample(1, 1)[0], robot.sample(1, 2)[0], 1.0, 21)
    return robot, frame_motion(robot, x.q, x.v, x.a, robot.tip_frame), x


def test_the_command_offers_every_panel_there_is() -> None:
    assert tuple(PANELS) == OFFERED


def test_the_lines_are_the_numbers(case: Case) -> None:
    robot, x, trajectory = case
    figure = sheet(robot, x, trajectory, ["velocity", "parts"])
    velocity, parts = figure.axes
    for k, drawn in enumerate(velocity.lines):
        np.testing.assert_array_equal(drawn.get_ydata(), x.velocity[:, k])
        np.testing.assert_array_equal(drawn.get_xdata(), trajectory.t)
    together = next(drawn for drawn in parts.lines if drawn.get_label() == "all together")
    np.testing.assert_array_equal(together.get_ydata(), np.linalg.norm(x.acceleration[:, :3], axis=1))


def test_the_bound_is_drawn_beside_what_it_bounds(case: Case) -> None:
    robot, x, trajectory = case
    (axes,) = sheet(robot, x, trajectory, ["disagreement"]).axes
    for check in x.checks.values():
        assert (check.bound > 0.0).all()
        np.testing.assert_allclose(check.units, check.share * check.bound, rtol=1e-12)
        assert any(np.array_equal(drawn.get_ydata(), check.bound) for drawn in axes.lines)
    assert axes.get_ylim()[1] > max(check.bound.max() for check in x.checks.values())


def test_the_title_says_from_where_to_where_and_how_long(case: Case) -> None:
    robot, x, trajectory = case
    title = sheet(robot, x, trajectory, ["position"]).get_suptitle()
    start, end = (", ".join(f"{p:.3g}" for p in x.placement[k, :3, 3].round(9)) for k in (0, -1))
    assert title.endswith(f"from ({start}) to ({end}) m in 1 s")


@pytest.mark.slow
def test_every_panel_is_on_the_sheet_and_the_foot_says_what_was_checked(case: Case, tmp_path: Path) -> None:
    robot, x, trajectory = case
    written = "".join(ET.fromstring(save(sheet(robot, x, trajectory), tmp_path / "a.svg")).itertext())
    for words in (
        "position",
        "velocity",
        "parts",
        "singular",
        "manipulability",
        "disagreement",
        "verified by",
    ):
        assert words in written
    assert foot(x, trajectory) in written


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "head"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_the_ending_says_the_format_and_the_same_motion_gives_the_same_file(
    ending: str, head: bytes, case: Case, tmp_path: Path
) -> None:
    files = [save(sheet(*case, ["position"]), tmp_path / f"a.{ending}") for _ in range(2)]
    assert files[0].startswith(head)
    assert files[0] == files[1]


def test_unknown_endings_and_panels_are_refused_by_name(case: Case, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown kind of picture"):
        save(sheet(*case, ["position"]), tmp_path / "a.bmp")
    with pytest.raises(UnknownNameError, match="velocity"):
        sheet(*case, ["velocty"])
