"""The Jacobian and the acceleration are derivatives of the placement: a study of the step size.

A central difference with step h is off by a truncation error that falls with h^2, and by a rounding error
that grows with 1/h (first derivative) or 1/h^2 (second). Both must be seen: a difference quotient that
merely comes close proves little, one that converges at the right rate to the right limit proves the limit.
"""

import numpy as np
import pytest

from tests.laws.subjects import EPS, NAMES, moved, robot_of, rotation_vector, state
from urdfkin.model.tree import FloatArray

STEPS = 2.0 ** -np.arange(3.0, 26.0)


def errors(name: str, seed: int, order: int) -> tuple[FloatArray, FloatArray, float]:
    """Errors of the quotients of position and orientation at each step, and the size of what is divided."""
    robot = robot_of(name)
    q, v, a = (x[0] for x in state(robot, 1, seed))
    frame = robot.tip_frame
    after = robot.placement(moved(robot, q, v, STEPS), frame)
    before = robot.placement(moved(robot, q, v, -STEPS), frame)
    now = robot.placement(q, frame)
    reach = 1.0 + float(np.abs(after[:, :3, 3]).max())
    h = STEPS[:, np.newaxis]
    if order == 1:
        velocity = robot.jacobian(q, frame) @ v
        linear = (after[:, :3, 3] - before[:, :3, 3]) / (2.0 * h) - velocity[:3]
        turn = rotation_vector(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2)) / (2.0 * h)
        return np.abs(linear).max(axis=1), np.abs(turn - velocity[3:]).max(axis=1), reach
    acceleration = robot.acceleration(q, v, np.zeros_like(a), frame)
    linear = (after[:, :3, 3] - 2.0 * now[:3, 3] + before[:, :3, 3]) / h**2 - acceleration[:3]
    forth = rotation_vector(after[:, :3, :3] @ now[:3, :3].T)
    back = rotation_vector(before[:, :3, :3] @ now[:3, :3].T)
    turn = (forth + back) / h**2 - acceleration[3:]
    return np.abs(linear).max(axis=1), np.abs(turn).max(axis=1), reach


def assert_converges(error: FloatArray, reach: float, order: int) -> None:
    """Falls with h^2 as long as truncation rules, and ends at the rounding floor."""
    floor = 200.0 * EPS * reach / STEPS**order
    falling = np.flatnonzero((error[:-1] > 30.0 * floor[:-1]) & (error[1:] > 30.0 * floor[1:]))
    if len(falling) > 2:
        rates = np.log2(error[falling] / error[falling + 1])
        assert abs(rates[-1] - 2.0) < 0.1, rates
        assert abs(rates[len(rates) // 2 :] - 2.0).max() < 0.3, rates
    constant = max(float(error[0]), reach) / STEPS[0] ** 2
    assert (error <= 4.0 * constant * STEPS**2 + floor).all()
    # The best step leaves an error of about eps^(2/3) for slopes and eps^(1/2) for curvatures.
    assert error.min() < 300.0 * reach * EPS ** (2.0 / (2.0 + order))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_the_jacobian_is_the_limit_of_difference_quotients_of_second_order(name: str, seed: int) -> None:
    linear, angular, reach = errors(name, seed, order=1)
    assert_converges(linear, reach, 1)
    assert_converges(angular, 1.0, 1)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_the_acceleration_is_the_limit_of_second_differences_along_constant_rates(
    name: str, seed: int
) -> None:
    linear, angular, reach = errors(name, seed, order=2)
    assert_converges(linear, reach, 2)
    assert_converges(angular, 1.0, 2)


def test_a_jacobian_that_is_slightly_wrong_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    linear, _, reach = errors("panda", 0, order=1)
    with pytest.raises(AssertionError):
        assert_converges(linear + 1e-7, reach, 1)
