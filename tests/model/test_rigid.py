"""How far two poses are apart: the angle and the way, about every axis."""

import math

import numpy as np
import pytest

from tests.random_chains import rotation, shift
from urdfkin.model.mechanisms.mechanism import apart


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, math.pi / 2, 3.0, -3.0])
def test_poses_are_apart_by_the_angle_and_the_way_that_one_was_moved(axis: str, angle: float) -> None:
    T = shift(0.1, -0.2, 0.3) @ rotation("y", 0.7) @ rotation("x", -1.1)
    moved = T @ rotation(axis, angle)
    moved[:3, 3] += [2.0, 3.0, 6.0]
    turned, way = apart(T, moved)
    assert turned == pytest.approx(abs(angle), rel=1e-6, abs=1e-15)
    assert way == pytest.approx(7.0, rel=1e-15)
    assert apart(moved, T) == pytest.approx((turned, way), rel=1e-12)
    assert np.allclose(apart(T, T), 0.0, atol=1e-15)
