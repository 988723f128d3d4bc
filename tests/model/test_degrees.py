"""Each function and command warns of values that look like degrees by the same rule."""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import urdfkin as command
from tests.urdfs import joint, limit
from urdfkin.calibration.calibrate import ImplausibleError
from urdfkin.model.configuration import degrees_messages
from urdfkin.robot import Robot
from urdfkin.robot.trajectory import make_line_trajectory

#: A pose of the ur5 in degrees.
DEGREES = [0.0, -90.0, 90.0, -45.0, 30.0, 0.0]
ONES = np.ones(6)


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return urdfkin.load("ur5")


WAYS: dict[str, Callable[[Robot], object]] = {
    "array": lambda robot: robot.placement(DEGREES),
    "batch": lambda robot: robot.jacobian(np.tile(DEGREES, (3, 2, 1))),
    "mapping": lambda robot: robot.placement(dict(zip(robot.coordinate_names, DEGREES, strict=True))),
    "text": lambda robot: robot.placement("ready, elbow_joint=90"),
    "velocity": lambda robot: robot.velocity(DEGREES, ONES),
    "acceleration": lambda robot: robot.acceleration(DEGREES, ONES, ONES),
    "hessian": lambda robot: robot.hessian(DEGREES),
    "unchecked": lambda robot: robot.placement(DEGREES, verify=False),
    "relative": lambda robot: robot.relative_placement(DEGREES, "tool0", "base_link"),
    "singular values": lambda robot: robot.singular_values(DEGREES, "tool0"),
    "integrate": lambda robot: robot.integrate(DEGREES, ONES),
    "difference": lambda robot: robot.difference("neutral", DEGREES),
    "to pinocchio": lambda robot: robot.to_pinocchio(DEGREES),
    "convention": lambda robot: robot.convention("drake").to(DEGREES),
    "view": lambda robot: robot.view(DEGREES),
    "trajectory": lambda robot: make_line_trajectory(robot, np.zeros(6), np.array(DEGREES), 1.0, 5),
    "prepared": lambda robot: urdfkin.load("ur5").prepare("tool0").placement(np.array(DEGREES)),
    "prepared, unchecked": lambda _: urdfkin.load("ur5", verify=False).placement(np.array(DEGREES)),
}


@pytest.mark.parametrize("way", WAYS)
def test_each_function_warns_of_degrees(ur5: Robot, way: str) -> None:
    with pytest.warns(urdfkin.DegreesWarning, match=r"90 is outside .*; degrees\? write -?90deg") as caught:
        WAYS[way](ur5)
    assert caught[0].filename == __file__


def test_the_warning_about_degrees_contains_the_line_about_the_limits(ur5: Robot) -> None:
    (first, *_) = ur5.limit_violations(DEGREES)
    assert degrees_messages(ur5.tree, np.array(DEGREES))[0] == first
    with pytest.warns(urdfkin.DegreesWarning) as caught:
        ur5.to_pinocchio(DEGREES)
    assert first in str(caught[0].message)


@pytest.mark.parametrize(
    "q",
    [
        np.full(6, math.radians(400.0)),  # more than a turn
        np.full(6, 2.0 * math.pi),
        np.full(6, 1e6),  # not an angle in degrees either
        np.full(6, np.pi / 2.0),
        np.empty((0, 6)),
        [3.0, -3.0, 1.0, 0.0, 0.0, 7.0],
    ],
)
def test_plausible_angles_and_absurdly_large_values_cause_no_warning(ur5: Robot, q: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", urdfkin.DegreesWarning)
        ur5.to_pinocchio(q)


def test_lengths_and_joints_without_limits_cause_no_warning() -> None:
    joints = joint("wheel", "continuous", "a", "b"), joint("rail", "prismatic", "b", "c", more=limit(0, 1))
    robot = urdfkin.load(urdfs.robot(*joints))
    assert robot.tree.min_implausible_angle == math.inf
    robot.placement([300.0, 30.0])


def test_only_some_configurations_of_a_batch_are_checked_for_degrees(ur5: Robot) -> None:
    looked = list[int]()

    class Counted(np.ndarray):
        def ravel(self, *args: Any, **options: Any) -> Any:
            looked.append(self.size)
            return np.asarray(self).ravel(*args, **options)

    q = np.degrees(ur5.sample(100_000)).reshape(100, 1000, 6)
    assert degrees_messages(ur5.tree, q.view(Counted))
    assert looked
    assert looked[0] <= 16 * 6


def test_a_batch_in_radians_gets_no_hint(ur5: Robot) -> None:
    q = ur5.sample(200_000)
    assert degrees_messages(ur5.tree, q) == []
    assert degrees_messages(ur5.tree, q[::2, ::-1]) == []


# -- commands, calibration ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["placement", "imu", "singular-values", "hessian"])
def test_a_command_prints_one_line_about_degrees(name: str) -> None:
    done = command(name, "ur5", "--q", "neutral,elbow_joint=90")
    assert done.err.count("degrees?") == 1
    assert "warning: joint elbow_joint: 90 is outside" in done.err
    assert "DegreesWarning" not in done.err


@pytest.mark.slow
def test_a_plot_of_a_trajectory_in_degrees_prints_a_warning(tmp_path: Any) -> None:
    names = urdfkin.load("ur5").coordinate_names
    file = tmp_path / "t.csv"
    rows = [[k / 10.0, *(k / 10.0 * x for x in DEGREES)] for k in range(11)]
    file.write_text("\n".join([",".join(("t", *names)), *(",".join(map(repr, row)) for row in rows)]))
    done = command("plot", "ur5", "--trajectory", str(file), "-o", str(tmp_path / "p.svg"))
    assert done.err.count("degrees?") >= 1
    assert "elbow_joint: 90 is outside" in done.err


def test_calibrate_refuses_degrees_even_with_force_unless_radians_is_true(ur5: Robot) -> None:
    q = ur5.sample(30)
    T = ur5.placement(q, "tool0")
    for force in (False, True):
        with pytest.raises(ImplausibleError, match="look like degrees") as caught:
            urdfkin.calibrate(ur5, np.degrees(q), T, tip="tool0", fit=["offsets"], force=force)
        assert "radians=True" in str(caught.value)
    turns = q + 4.0 * math.pi  # whole turns, outside the limits
    found = urdfkin.calibrate(ur5, turns, T, tip="tool0", fit=["offsets"], radians=True)
    assert found.full_fit is not None
