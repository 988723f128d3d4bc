"""The accuracy study reads quaternions of URDF 1.1 exactly."""

import numpy as np
import pytest

import urdfkin
from tests.urdfs import chain
from urdfkin.robot import Robot
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.verify.exact.numbers import precision, read_exact

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")


def text(origins: list[str], version: str) -> str:
    inside = [f'<origin xyz="0.3 0.2 0.1" {origin}/>' for origin in origins]
    return chain(inside, origin="", axis="0 1 0", attributes=version)


def quaternions(scale: float) -> list[str]:
    rng = np.random.default_rng(4)
    written = (" ".join(f"{x:.9g}" for x in scale * rng.normal(size=4)) for _ in range(5))
    return [f'quat_xyzw="{words}"' for words in written]


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1e-9, 3e20])
@pytest.mark.parametrize("version", ["1.1", "1.2"])
def test_true_errors_of_robots_with_quaternions_are_rounding_errors(version: str, scale: float) -> None:
    robot = urdfkin.load(text(quaternions(scale), f'version="{version}"'))
    assert worst_error(robot) < 24.0


def worst_error(robot: Robot) -> float:
    lines = accuracy_study(robot, samples=3).lines
    return max(max(line.urdfkin.worst, line.pinocchio.worst) for line in lines)


@pytest.mark.parametrize("version", ["", 'version="1.0"'])
def test_quaternions_in_files_of_urdf_1_0_are_ignored(version: str) -> None:
    robot = urdfkin.load(text(['rpy="0.1 0.2 0.3" quat_xyzw="0 0 0.6 0.8"'], version))
    assert worst_error(robot) < 10.0


def test_the_decimals_of_a_quaternion_are_read_exactly() -> None:
    robot = urdfkin.load(text(['quat_xyzw="0 0 0.6 0.8"'], 'version="1.1"'))
    with precision(50):
        R = read_exact(robot.urdf, robot.tree)[0].R
        assert abs(25 * R[0][0] - 7) < 1e-48
        assert abs(25 * R[1][0] - 24) < 1e-48
