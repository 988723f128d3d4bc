"""The motion of a frame consists of the robot's results, and reports a disagreement with Pinocchio."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import state
from tests.laws.test_imu import moving_base
from tests.verify.test_singular_values import ROWS, SLIDE
from urdfkin.compiled import breakdown
from urdfkin.compiled.breakdown import AccelerationBreakdown
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.robot.trajectory import Trajectory
from urdfkin.verify.pinocchio import PinocchioOracle

N = 7
REFERENCES = ["local", "world", "local_world_aligned"]


def assert_is_the_robots(
    x: FrameMotion, robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, **how: Any
) -> None:
    tip = robot.tip_frame
    referred = {"reference": x.reference, **how}
    np.testing.assert_array_equal(x.placement, robot.placement(q, tip, **how))
    np.testing.assert_array_equal(x.velocity, robot.velocity(q, v, tip, **referred))
    np.testing.assert_array_equal(x.acceleration, robot.acceleration(q, v, a, tip, **referred))
    np.testing.assert_array_equal(x.jacobian, robot.jacobian(q, tip, **referred))
    np.testing.assert_allclose(x.breakdown.total, x.acceleration, rtol=1e-12, atol=1e-12)
    assert x.agrees


@pytest.mark.parametrize("reference", REFERENCES)
def test_a_frame_motion_has_the_results_of_the_robots_methods_and_is_checked(reference: str) -> None:
    robot = urdfkin.load("panda")
    x = frame_motion(robot, state(robot, N, 0), robot.tip_frame, reference)
    assert_is_the_robots(x, robot, *state(robot, N, 0))
    assert set(x.checks) >= {"placement", "velocity", "acceleration", "jacobian"}
    assert all(check.units.shape == (N,) for check in x.checks.values())


def test_a_disagreement_of_a_frame_motion_is_stored_and_raises_no_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = urdfkin.load("panda")
    right = PinocchioOracle.velocities
    monkeypatch.setattr(PinocchioOracle, "velocities", lambda *args: right(*args) * (1.0 + 1e-10))
    x = frame_motion(robot, state(robot, N, 0), robot.tip_frame)
    assert not x.agrees
    assert (x.checks["velocity"].bound_ratio > 1.0).all()
    assert (x.checks["placement"].bound_ratio < 1.0).all()


def test_a_wrong_breakdown_of_a_frame_motion_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("panda")
    right = breakdown.acceleration_breakdown

    def wrong(*args: Any) -> AccelerationBreakdown:
        found = right(*args)
        return replace(found, terms=found.terms * (1.0 + 1e-10))

    monkeypatch.setattr("urdfkin.robot.frame_motion.acceleration_breakdown", wrong)
    x = frame_motion(robot, state(robot, N, 0), robot.tip_frame)
    assert not x.agrees
    assert (x.checks["acceleration breakdown"].bound_ratio > 1.0).all()
    assert (x.checks["acceleration"].bound_ratio < 1.0).all()


def test_manipulability_is_the_square_root_of_the_determinant_of_j_times_j_transposed() -> None:
    robot = urdfkin.load("ur5")
    x = frame_motion(robot, state(robot, N, 0), robot.tip_frame)
    for rows in ROWS.values():
        J = x.jacobian[:, rows]
        squares = np.linalg.det(J @ J.swapaxes(1, 2))
        np.testing.assert_allclose(x.manipulability(rows) ** 2, squares, rtol=1e-6)
    np.testing.assert_allclose(x.singular_values.prod(axis=1), x.manipulability(), rtol=1e-12)


def test_the_manipulability_of_a_frame_that_no_joint_moves_is_zero() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(N, 0)
    still = np.zeros_like(q)
    assert not frame_motion(robot, (q, still, still), "base_link").manipulability().any()


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("rows", ROWS)
def test_manipulability_is_equal_for_one_configuration_and_in_a_batch(rows: str, reference: str) -> None:
    robot = urdfkin.load(SLIDE)
    q, still = np.array([[0.3, 0.0], [0.3, 1.0]]), np.zeros((2, 2))
    both = frame_motion(robot, (q, still, still), "c", reference).manipulability(ROWS[rows])
    for k in range(2):
        one = slice(k, k + 1)
        x = frame_motion(robot, (q[one], still[one], still[one]), "c", reference)
        assert x.manipulability(ROWS[rows]).tolist() == both[one].tolist()
    if reference == "local_world_aligned":
        expected = robot.singular_values(q, "c", rows).manipulability.value
        np.testing.assert_allclose(both, expected, rtol=1e-14)


def test_a_moving_base_of_a_trajectory_moves_the_frame_and_is_checked(tmp_path: Path) -> None:
    robot, base, rng = urdfkin.load("ur5"), moving_base(5, 3), np.random.default_rng(2)
    q, (v, a) = robot.sample(5, 1), rng.standard_normal((2, 5, 6))
    motion = {"base_placement": base.placement, "base_velocity": base.velocity}
    motion |= {"base_acceleration": base.acceleration, "q": q, "v": v, "a": a, "t": np.arange(5.0)}
    np.savez(tmp_path / "log.npz", **motion)  # type: ignore[arg-type]
    x = urdfkin.frame_motion(robot, urdfkin.read_trajectory(robot, tmp_path / "log.npz"), "tool0")
    assert_is_the_robots(x, robot, q, v, a, base=base)
    assert repr(x) == "<FrameMotion of tool0: 5 samples, verified by Pinocchio>"


def test_a_motion_of_two_arrays_is_refused() -> None:
    robot = urdfkin.load("ur5")
    with pytest.raises(urdfkin.InputError, match="a trajectory, or q, v and a: found 2 arrays"):
        urdfkin.frame_motion(robot, (np.zeros((1, 6)), np.zeros((1, 6))), "tool0")


def test_in_world_the_manipulability_includes_a_joint_that_only_a_displaced_base_moves_away() -> None:
    robot = urdfkin.load("planar_two_link")
    q, still, placement = np.array([[0.3, 1.0]]), np.zeros((1, 2)), np.eye(4)
    placement[:3, 3] = 0.0, 1.0, 0.0
    motion = Trajectory(np.zeros(1), q, still, still, "given", base=BaseMotion(placement))
    x = frame_motion(robot, motion, "tip", "world")
    J = x.jacobian[0, :2]
    assert x.manipulability(slice(0, 3)) == pytest.approx([abs(np.linalg.det(J))], rel=1e-12)
    assert abs(np.linalg.det(J)) > 0.1


def test_a_motion_that_is_neither_a_trajectory_nor_arrays_is_an_input_error() -> None:
    robot = urdfkin.load("planar_two_link")
    with pytest.raises(urdfkin.InputError, match="motion must be a trajectory, or q, v and a: found None"):
        frame_motion(robot, None, "tip")  # type: ignore[arg-type]
