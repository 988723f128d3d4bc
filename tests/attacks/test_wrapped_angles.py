"""A log with wrapped angles is read as the logged motion, with a note about each changed joint."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.cli import running
from tests.urdfs import joint, limit, loaded, mimic
from tests.urdfs import robot as robot_of
from urdfkin.kinematics.rotation import rotation_from_quaternion
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import frame_motion
from urdfkin.robot.trajectory import Trajectory, read_trajectory
from urdfkin.view.plot import check_summary

T = np.linspace(0.0, 4.0, 81)


def arm_of(kind: str, more: str = "") -> Robot:
    return loaded(robot_of(joint("base", kind, "a", "b", 'xyz="1 0 0"', more=more)))


def wheel(mimic_joint: str = "") -> Robot:
    return loaded(robot_of(joint("wheel", "continuous", "a", "b", 'xyz="1 0 0"'), mimic_joint))


def wrapped(angle: NDArray[Any]) -> NDArray[Any]:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def read(robot: Robot, path: Path, q: NDArray[Any], t: NDArray[Any] = T) -> Trajectory:
    names = ",".join(["t", *robot.coordinate_names])
    np.savetxt(path, np.column_stack([t, q]), "%.17g", ",", header=names, comments="")
    return read_trajectory(robot, path)


@pytest.mark.parametrize("start", [0.0, np.pi])
def test_a_wheel_at_constant_speed_has_a_constant_rate_for_any_wrapped_log(
    start: float, tmp_path: Path
) -> None:
    angle = 2.0 * T + 0.3
    motion = read(wheel(), tmp_path / "w.csv", wrapped(angle - start) + start)
    np.testing.assert_allclose(motion.v, 2.0, atol=1e-9)
    np.testing.assert_allclose(motion.a, 0.0, atol=1e-7)
    turns = (motion.q[:, 0] - angle) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-9)
    assert "angle jumps by a whole turn after sample" in motion.notes[0]
    assert "after unwrapping wheel" in motion.rates_source


def test_a_wheel_may_reverse_and_unwrapped_angles_do_not_change(tmp_path: Path) -> None:
    angle = 7.0 * np.sin(T)
    motion = read(wheel(), tmp_path / "w.csv", wrapped(angle))
    np.testing.assert_allclose(motion.q[:, 0], angle, atol=1e-12)
    np.testing.assert_allclose(motion.v[2:-2, 0], 7.0 * np.cos(T)[2:-2], atol=0.01)
    angle = np.sin(T)
    motion = read(wheel(), tmp_path / "w.csv", angle)
    np.testing.assert_array_equal(motion.q[:, 0], angle)
    assert motion.notes == ()
    assert motion.rates_source == "by central differences"


def test_revolute_joints_and_fast_unwrapped_wheels_do_not_change(tmp_path: Path) -> None:
    angle = np.where(T < 2.0, 3.0, -3.0)
    motion = read(arm_of("revolute", limit(-6, 6)), tmp_path / "r.csv", angle)
    np.testing.assert_array_equal(motion.q[:, 0], angle)
    angle = 3.5 * np.arange(len(T))
    motion = read(wheel(), tmp_path / "w.csv", angle)
    np.testing.assert_array_equal(motion.q[:, 0], angle)
    (note,) = motion.notes
    assert "span more than one turn and are not unwrapped" in note


def test_a_step_of_nearly_half_a_turn_is_reported_as_uncertain(tmp_path: Path) -> None:
    motion = read(wheel(), tmp_path / "w.csv", wrapped(2.9 * np.arange(len(T))))
    np.testing.assert_allclose(np.diff(motion.q[:, 0]), 2.9)
    assert any("the shorter direction is assumed, which may be wrong" in note for note in motion.notes)
    assert any(f"and in {len(T) - 2} more steps" in note for note in motion.notes)


@pytest.mark.parametrize(
    ("kind", "ratio", "told"),
    [("revolute", 0.5, True), ("revolute", 3.0, False), ("prismatic", 1.0, True), ("continuous", 0.5, True)],
)
def test_a_mimic_joint_of_an_unwrapped_joint_is_reported(
    kind: str, ratio: float, told: bool, tmp_path: Path
) -> None:
    more = mimic("wheel", ratio) + limit(-6, 6)
    mimic_joint = joint("f", kind, "b", "c", 'xyz="1 0 0"', more=more)
    motion = read(wheel(mimic_joint), tmp_path / "w.csv", wrapped(2.0 * T))
    assert any("joint f mimics wheel" in note for note in motion.notes) is told
    np.testing.assert_allclose(motion.q[:, 0], 2.0 * T, atol=1e-12)


def test_a_planar_joint_on_a_circle_has_constant_velocity_in_its_own_frame(tmp_path: Path) -> None:
    t = np.linspace(0.0, 4.0, 4001)
    angle = 2.0 * t
    q = np.column_stack([3.0 * np.sin(angle), -3.0 * np.cos(angle), wrapped(angle)])
    motion = read(arm_of("planar"), tmp_path / "p.csv", q, t)
    np.testing.assert_allclose(motion.v[1:-1], np.tile([6.0, 0.0, 2.0], (len(t) - 2, 1)), atol=1e-4)
    np.testing.assert_allclose(motion.a[3:-3], 0.0, atol=1e-4)


def test_a_quaternion_that_changes_its_sign_is_the_same_orientation(tmp_path: Path) -> None:
    t = np.linspace(0.0, 4.0, 401)
    axis = np.array([0.6, 0.0, 0.8])
    quaternion = np.column_stack([np.sin(t)[:, None] * axis, np.cos(t)])
    signs = np.where((np.arange(len(t)) // 7) % 2, -1.0, 1.0)[:, None]
    q = np.column_stack([np.cos(t), np.sin(t), 0.0 * t, signs * quaternion])
    motion = read(arm_of("floating"), tmp_path / "f.csv", q, t)
    np.testing.assert_allclose(motion.v[2:-2, 3:], np.tile(2.0 * axis, (len(t) - 4, 1)), atol=1e-3)
    np.testing.assert_allclose(motion.a[3:-3, 3:], 0.0, atol=1e-2)
    world = np.column_stack([-np.sin(t), np.cos(t), 0.0 * t])
    own = np.einsum("nji,nj->ni", rotation_from_quaternion(quaternion), world)
    np.testing.assert_allclose(motion.v[2:-2, :3], own[2:-2], atol=1e-3)
    assert any("quaternion changes its sign" in note for note in motion.notes)


def test_a_plot_verifies_the_formula_and_not_the_rates(tmp_path: Path) -> None:
    robot = wheel()
    motion = read(robot, tmp_path / "w.csv", wrapped(2.0 * T))
    words = check_summary(frame_motion(robot, motion, "b"), motion)
    assert "verified by Pinocchio" in words
    assert "not whether v and a are the derivatives of q" in words


@pytest.mark.slow
def test_plot_prints_a_note_about_unwrapped_angles_on_stderr(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    robot = wheel()
    read(robot, tmp_path / "w.csv", wrapped(2.0 * T))
    (tmp_path / "w.urdf").write_text(robot.urdf)
    done = running.good(f"plot {tmp_path}/w.urdf --trajectory {tmp_path}/w.csv -o {tmp_path}/w.svg")
    assert "warning: joint wheel: its angle jumps by a whole turn after sample" in done.err
    assert "after unwrapping wheel" in done.text
    assert "not whether v and a" in " ".join((tmp_path / "w.svg").read_text().split())
