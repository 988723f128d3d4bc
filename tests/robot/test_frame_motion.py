"""A frame's motion is what the robot's own methods give, its parts add up, and a disagreement is seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.laws.test_imu import moving_base
from tests.verify.test_singular_values import SLIDE
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.verify.pinocchio import PinocchioOracle

N = 7


def motion(robot: Robot, reference: str = "local_world_aligned") -> FrameMotion:
    rng = np.random.default_rng(0)
    v, a = rng.standard_normal((2, N, robot.nv))
    return frame_motion(robot, (robot.sample(N, 0), v, a), robot.tip_frame, reference)


@pytest.mark.parametrize("reference", ["local", "world", "local_world_aligned"])
def test_it_is_what_the_robots_methods_give_and_pinocchio_confirms(reference: str) -> None:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(0)
    v, a = rng.standard_normal((2, N, robot.nv))
    q, tip = robot.sample(N, 0), robot.tip_frame
    x = frame_motion(robot, (q, v, a), tip, reference)
    np.testing.assert_array_equal(x.placement, robot.placement(q, tip))
    np.testing.assert_array_equal(x.velocity, robot.velocity(q, v, tip, reference))
    np.testing.assert_array_equal(x.acceleration, robot.acceleration(q, v, a, tip, reference))
    np.testing.assert_array_equal(x.jacobian, robot.jacobian(q, tip, reference))
    np.testing.assert_allclose(x.parts.total, x.acceleration, rtol=1e-12, atol=1e-12)
    assert x.agrees
    assert set(x.checks) >= {"placement", "velocity", "acceleration", "jacobian"}
    assert all(check.units.shape == (N,) for check in x.checks.values())


def test_a_disagreement_is_shown_and_not_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("panda")
    right = PinocchioOracle.velocities
    monkeypatch.setattr(PinocchioOracle, "velocities", lambda *args: right(*args) * (1.0 + 1e-10))
    x = motion(robot)
    assert not x.agrees
    assert (x.checks["velocity"].share > 1.0).all()
    assert (x.checks["placement"].share < 1.0).all()


def test_manipulability_is_the_root_of_the_determinant() -> None:
    x = motion(urdfkin.load("ur5"))
    for rows in (slice(0, 6), slice(0, 3), slice(3, 6)):
        J = x.jacobian[:, rows]
        np.testing.assert_allclose(
            x.manipulability(rows) ** 2, np.linalg.det(J @ J.swapaxes(1, 2)), rtol=1e-6
        )
    np.testing.assert_allclose(x.singular_values.prod(axis=1), x.manipulability(), rtol=1e-12)


def test_a_frame_that_nothing_moves_has_no_manipulability() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(N, 0)
    still = np.zeros_like(q)
    assert not frame_motion(robot, (q, still, still), "base_link").manipulability().any()


@pytest.mark.parametrize("reference", ["local", "world", "local_world_aligned"])
@pytest.mark.parametrize("rows", [slice(0, 6), slice(0, 3), slice(3, 6)], ids=["all", "linear", "angular"])
def test_one_configuration_alone_and_in_a_batch_have_the_same_manipulability(
    rows: slice, reference: str
) -> None:
    robot = urdfkin.load(SLIDE)
    q, still = np.array([[0.3, 0.0], [0.3, 1.0]]), np.zeros((2, 2))
    both = frame_motion(robot, (q, still, still), "c", reference).manipulability(rows)
    for k in range(2):
        one = slice(k, k + 1)
        alone = frame_motion(robot, (q[one], still[one], still[one]), "c", reference).manipulability(rows)
        assert alone.tolist() == both[one].tolist()


@pytest.mark.parametrize("rows", ["all", "linear", "angular"])
def test_manipulability_is_the_robots_own(rows: str) -> None:
    robot, part = urdfkin.load(SLIDE), {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}
    q, still = np.array([[0.3, 0.0], [0.3, 1.0]]), np.zeros((2, 2))
    found = frame_motion(robot, (q, still, still), "c").manipulability(part[rows])
    expected = robot.singular_values(q, "c", rows).manipulability.value
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_a_moving_base_of_a_trajectory_moves_the_frame_and_is_checked(tmp_path: Path) -> None:
    robot, base, rng = urdfkin.load("ur5"), moving_base(5, 3), np.random.default_rng(2)
    q, (v, a) = robot.sample(5, 1), rng.standard_normal((2, 5, 6))
    fields: dict[str, Any] = {
        f"base_{name}": getattr(base, name) for name in ("placement", "velocity", "acceleration")
    }
    np.savez(tmp_path / "log.npz", t=np.arange(5.0), q=q, v=v, a=a, **fields)
    x = urdfkin.frame_motion(robot, urdfkin.read_trajectory(robot, tmp_path / "log.npz"), "tool0")
    np.testing.assert_array_equal(x.placement, robot.placement(q, "tool0", base=base))
    np.testing.assert_array_equal(x.velocity, robot.velocity(q, v, "tool0", base=base))
    np.testing.assert_array_equal(x.acceleration, robot.acceleration(q, v, a, "tool0", base=base))
    np.testing.assert_allclose(x.parts.total, x.acceleration, atol=1e-12)
    assert x.agrees
    assert repr(x) == "<FrameMotion of tool0: 5 samples, verified by Pinocchio>"


def test_a_motion_of_two_arrays_is_refused() -> None:
    robot = urdfkin.load("ur5")
    with pytest.raises(urdfkin.InputError, match="a trajectory, or q, v and a: found 2 arrays"):
        urdfkin.frame_motion(robot, (np.zeros((1, 6)), np.zeros((1, 6))), "tool0")
