"""Quaternions are SciPy's, scalar last, and multiply like rotations."""

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from tests.kinematics.rotation.strategies import ROUNDING, angles, axes
from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import conjugate, multiply, quaternion_of, rotation_about, rotation_of


@pytest.mark.slow
@given(axes, angles)
def test_quaternion_and_rotation_are_each_others_inverse(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    quat = quaternion_of(R)
    assert quat[3] >= 0.0
    assert np.abs(rotation_of(quat) - R).max() <= ROUNDING
    assert np.abs(Rotation.from_quat(quat).as_matrix() - R).max() <= ROUNDING


@pytest.mark.slow
@given(axes, angles, axes, angles)
def test_a_product_of_quaternions_is_the_product_of_rotations(
    k: FloatArray, phi: float, m: FloatArray, psi: float
) -> None:
    p, q = quaternion_of(rotation_about(k, phi)), quaternion_of(rotation_about(m, psi))
    assert np.abs(rotation_of(multiply(p, q)) - rotation_of(p) @ rotation_of(q)).max() <= 2 * ROUNDING


@pytest.mark.slow
@given(axes, angles)
def test_the_conjugate_is_the_inverse(axis: FloatArray, angle: float) -> None:
    quat = quaternion_of(rotation_about(axis, angle))
    assert np.abs(multiply(quat, conjugate(quat)) - [0, 0, 0, 1]).max() <= ROUNDING


def test_a_quaternion_that_is_not_of_unit_length_is_refused() -> None:
    with pytest.raises(InputError, match="unit quaternion: found norm 2"):
        rotation_of([0.0, 0.0, 0.0, 2.0])
