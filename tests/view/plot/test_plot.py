"""A plot draws the numbers and states what was checked; the same motion gives the same file."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import urdfkin
from urdfkin.cli.view import PANELS as OFFERED
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.robot.trajectory import Trajectory, make_line_trajectory
from urdfkin.view.figure import figure_bytes
from urdfkin.view.plot import COORDINATE_PANELS, PANELS, _line_style, check_summary, plot_motion

pytest.importorskip("matplotlib")
Case = tuple[Robot, FrameMotion, Trajectory]


@pytest.fixture(scope="module")
def case() -> Case:
    robot = urdfkin.load("panda")
    x = make_line_trajectory(robot, robot.sample(1, 1)[0], robot.sample(1, 2)[0], 1.0, 21)
    return robot, frame_motion(robot, x, robot.tip_frame), x


def test_the_title_states_start_and_end_and_every_panel_is_available(case: Case, tmp_path: Path) -> None:
    assert (*COORDINATE_PANELS, *PANELS) == OFFERED
    assert len({tuple(_line_style(k).values()) for k in range(14)}) == 14
    robot, x, trajectory = case
    title = plot_motion(robot, x, trajectory, ["position"]).get_suptitle()
    start, end = (", ".join(f"{p:.3g}" for p in x.placement[k, :3, 3].round(9) + 0.0) for k in (0, -1))
    assert title.endswith(f"from ({start}) to ({end}) m in 1 s")
    with pytest.raises(InputError, match="unknown picture format"):
        figure_bytes(plot_motion(*case, ["position"]), tmp_path / "a.bmp")
    with pytest.raises(UnknownNameError, match="velocity"):
        plot_motion(*case, ["velocty"])


def test_panels_of_coordinates_without_a_moving_joint_are_refused() -> None:
    robot = urdfkin.load('<robot name="a"><link name="l"/></robot>')
    trajectory = make_line_trajectory(robot, [], [], 1.0, 3)
    motion = frame_motion(robot, trajectory, "l")
    assert plot_motion(robot, motion, trajectory).axes
    with pytest.raises(InputError, match="no joint of the robot moves: found q, v; choose other panels"):
        plot_motion(robot, motion, trajectory, ["q", "v"])


def test_the_plotted_lines_have_the_values_of_the_motion(case: Case) -> None:
    robot, x, trajectory = case
    figure = plot_motion(robot, x, trajectory, ["velocity", "parts"])
    velocity, parts = figure.axes
    for k, drawn in enumerate(velocity.lines):
        np.testing.assert_array_equal(drawn.get_ydata(), x.velocity[:, k])
        np.testing.assert_array_equal(drawn.get_xdata(), trajectory.t)
    together = next(drawn for drawn in parts.lines if drawn.get_label() == "sum")
    np.testing.assert_array_equal(together.get_ydata(), np.linalg.norm(x.acceleration[:, :3], axis=1))


def test_q_and_v_are_plotted_with_limits_and_one_unit_for_each_axis(case: Case) -> None:
    robot, x, trajectory = case
    axes = plot_motion(robot, x, trajectory, ["q", "v", "a"]).axes
    assert [one.get_ylabel().split("\n")[0] for one in axes] == [
        "q [rad]", "q [m]", "v [rad/s]", "v [m/s]", "a [rad/s²]", "a [m/s²]"
    ]  # fmt: skip
    angles = [drawn for drawn in axes[0].lines if drawn.get_label() in robot.coordinate_names]
    assert [drawn.get_label() for drawn in angles] == list(robot.coordinate_names[:7])
    for k, drawn in enumerate(angles):
        np.testing.assert_array_equal(drawn.get_ydata(), trajectory.q[:, k])
    limits = (*_of(robot.limits), *_of([-robot.velocity_limits, robot.velocity_limits]))
    for one, bounds in zip(axes, limits, strict=False):
        thin = (drawn for drawn in one.lines if drawn.get_linewidth() == 0.6)
        assert {float(np.asarray(drawn.get_ydata())[0]) for drawn in thin} == bounds


def _of(bounds: Any) -> tuple[set[float], set[float]]:
    """Return the bounds of the panda's seven angles, and of its finger."""
    return {float(x) for row in bounds for x in row[:7]}, {float(x) for row in bounds for x in row[7:]}


@pytest.mark.slow
def test_long_legends_do_not_make_the_panels_narrower() -> None:
    robot = urdfkin.load("a1", root_joint="floating")
    x = make_line_trajectory(robot, robot.poses["ready"], robot.sample(1, 3)[0], 1.0, 11)
    figure = plot_motion(robot, frame_motion(robot, x, "FL_foot"), x)
    figure.draw_without_rendering()
    assert min(axes.get_position().width for axes in figure.axes) > 0.72 / 3
    for axes in figure.axes:
        if (legend := axes.get_legend()) is not None:
            box = legend.get_window_extent().transformed(figure.transFigure.inverted())
            assert box.x1 < axes.get_position().x1 + 0.03


def test_the_legend_names_joints_outside_the_limits_and_counts_the_others() -> None:
    robot = urdfkin.load("romeo", root_joint=None)
    end = np.clip(robot.sample(1, 3)[0], *robot.limits)
    far = [robot.coordinate_names.index(name) for name in ("LElbowYaw", "RWristPitch")]
    end[far] = robot.limits[1, far] + 0.5
    x = make_line_trajectory(robot, robot.neutral(), end, 1.0, 11)
    (axes, *_) = plot_motion(robot, frame_motion(robot, x, robot.tip_frame), x, ["q"]).axes
    legend = axes.get_legend()
    assert legend is not None
    words = [text.get_text() for text in legend.get_texts()]
    assert words == [f"{robot.nq - 2} others", "LElbowYaw", "RWristPitch", "outside the limits"]


@pytest.mark.parametrize("panels", [[], ["q"], ["position", "velocity", "disagreement"]])
def test_a_plot_fits_a_page_and_no_curve_touches_the_top(panels: list[str], case: Case) -> None:
    figure = plot_motion(*case, panels)
    width, height = figure.get_size_inches()
    assert width <= 7.6  # A4 is 8.27 by 11.69 inches, US Letter 8.5 by 11
    assert height <= 10.4
    for axes in figure.axes:
        if axes.lines and axes.get_yscale() == "linear":
            largest = max(float(np.max(np.asarray(drawn.get_ydata()))) for drawn in axes.lines)
            lower, upper = axes.get_ylim()
            assert upper - largest > 0.03 * (upper - lower), axes.get_ylabel()


def test_crosses_mark_limit_violations_and_disagreements_are_plotted_with_the_bound(case: Case) -> None:
    robot, motion, trajectory = case
    x = make_line_trajectory(robot, robot.poses["ready"], robot.poses["neutral"], 1.0, 21)
    (axes, _) = plot_motion(robot, frame_motion(robot, x, robot.tip_frame), x, ["q"]).axes
    crosses = next(drawn for drawn in axes.lines if drawn.get_label() == "outside the limits")
    outside = x.q[:, 3] > robot.limits[1, 3]
    assert outside.any()
    np.testing.assert_array_equal(crosses.get_ydata(), x.q[outside, 3])
    (bounded,) = plot_motion(robot, motion, trajectory, ["disagreement"]).axes
    for check in motion.checks.values():
        assert (check.bound > 0.0).all()
        np.testing.assert_allclose(check.units, check.bound_ratio * check.bound, rtol=1e-12)
        assert any(np.array_equal(drawn.get_ydata(), check.bound) for drawn in bounded.lines)
    assert bounded.get_ylim()[1] > max(check.bound.max() for check in motion.checks.values())


def test_no_axis_of_a_plot_mixes_metres_and_radians(case: Case) -> None:
    robot, x, trajectory = case
    names = ["singular-values", "angular-singular-values", "manipulability", "angular-manipulability"]
    figure = plot_motion(robot, x, trajectory, names)
    J = x.jacobian
    for axes, rows in zip(figure.axes[:2], (slice(0, 3), slice(3, 6)), strict=True):
        drawn = np.array([one.get_ydata() for one in axes.lines]).T
        np.testing.assert_allclose(drawn, np.linalg.svd(J[:, rows], compute_uv=False), rtol=1e-12)
    for axes, rows in zip(figure.axes[2:], (slice(0, 3), slice(3, 6)), strict=True):
        determinant = np.linalg.det(J[:, rows] @ J[:, rows].swapaxes(1, 2))
        np.testing.assert_allclose(np.asarray(axes.lines[0].get_ydata()), np.sqrt(determinant), rtol=1e-6)


@pytest.mark.slow
def test_a_floating_base_is_plotted_with_position_and_quaternion(tmp_path: Path) -> None:
    robot = urdfkin.load("a1", root_joint="floating")
    x = make_line_trajectory(robot, robot.poses["ready"], robot.sample(1, 3)[0], 1.0, 11)
    motion = frame_motion(robot, x, "FL_foot")
    assert motion.agrees
    *axes, _ = plot_motion(robot, motion, x, ["q", "v"]).axes
    assert [one.get_ylabel().split("\n")[0] for one in axes] == [
        "q [rad]", "q [m]", "q [quaternion]", "v [rad/s]", "v [m/s]"
    ]  # fmt: skip
    assert figure_bytes(plot_motion(robot, motion, x), tmp_path / "a.svg")


@pytest.mark.slow
def test_a_plot_contains_every_panel_and_a_footer_about_the_verification(case: Case, tmp_path: Path) -> None:
    robot, x, trajectory = case
    written = "".join(
        ET.fromstring(figure_bytes(plot_motion(robot, x, trajectory), tmp_path / "a.svg")).itertext()
    )
    panels = "position", "velocity", "parts", "singular", "manipulability", "disagreement"
    for words in (*panels, "verified by"):
        assert words in written
    assert check_summary(x, trajectory) in written


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "head"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_the_suffix_selects_the_picture_format_and_equal_motions_give_equal_files(
    ending: str, head: bytes, case: Case, tmp_path: Path
) -> None:
    files = [figure_bytes(plot_motion(*case, ["position"]), tmp_path / f"a.{ending}") for _ in range(2)]
    assert files[0].startswith(head)
    assert files[0] == files[1]
