"""The least-squares solver finds the minimum of Rosenbrock's function, and limits its steps."""

import math

import numpy as np

from urdfkin.kinematics.least_squares import least_squares
from urdfkin.model.tree import FloatArray


def residuals(x: FloatArray) -> FloatArray:
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def left_over(x: FloatArray) -> tuple[FloatArray, float]:
    return -residuals(x), -20.0 * x[0]


def slopes(x: FloatArray, seen: float) -> FloatArray:
    assert seen == -20.0 * x[0], "of another state"
    return np.array([[seen, 10.0], [-1.0, 0.0]])


def test_least_squares_finds_the_minimum_of_the_rosenbrock_function() -> None:
    found, left = least_squares(np.array([-1.2, 1.0]), left_over, slopes, np.add)
    np.testing.assert_allclose(found, 1.0, atol=1e-12)
    assert left == float(np.linalg.norm(residuals(found))) < 1e-12


def test_no_step_is_longer_than_the_limit() -> None:
    steps = list[float]()

    def moved(x: FloatArray, step: FloatArray) -> FloatArray:
        steps.append(float(np.abs(step).max()))
        return x + step

    found, _ = least_squares(np.array([-1.2, 1.0]), left_over, slopes, moved, max_step=0.5)
    assert max(steps) <= 0.5
    np.testing.assert_allclose(found, 1.0, atol=1e-12)


def test_least_squares_without_parameters_returns_the_start() -> None:
    start = np.zeros(2)
    found, left = least_squares(start, left_over, lambda *_: np.empty((2, 0)), np.add)
    assert found is start
    assert math.isclose(left, 1.0)
