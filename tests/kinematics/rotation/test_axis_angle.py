"""Rotation about an axis agrees with SciPy and Pinocchio and comes apart again."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from tests.kinematics.rotation.strategies import ROUNDING, angles, axes
from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, determinant
from urdfkin.kinematics.rotation import (
    axis_aligning,
    axis_angle_of,
    exp_rotation,
    log_rotation,
    rotation_about,
)


@pytest.mark.slow
@given(axes, angles)
def test_rotation_about_is_scipys_and_pinocchios(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    assert np.abs(R - Rotation.from_rotvec(angle * axis).as_matrix()).max() <= ROUNDING * max(1.0, abs(angle))
    assert np.abs(R - pin.AngleAxis(angle, axis).toRotationMatrix()).max() <= ROUNDING
    assert np.abs(R @ R.T - np.eye(3)).max() <= ROUNDING
    assert abs(float(determinant(R)) - 1.0) <= ROUNDING


@pytest.mark.slow
@given(axes, angles)
def test_exp_is_pinocchios_exp3(axis: FloatArray, angle: float) -> None:
    assert np.abs(exp_rotation(angle * axis) - pin.exp3(angle * axis)).max() <= ROUNDING * max(1, abs(angle))


@pytest.mark.slow
@given(axes, angles)
def test_log_undoes_exp_also_at_half_a_turn(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    vector = log_rotation(R)
    assert np.linalg.norm(vector) <= np.pi * (1 + ROUNDING)
    assert np.abs(exp_rotation(vector) - R).max() <= ROUNDING


@pytest.mark.slow
@given(axes)
def test_log_is_pinocchios_log3_away_from_half_a_turn(axis: FloatArray) -> None:
    # Near half a turn Pinocchio's own error grows; there the law above is the test.
    for angle in (0.0, 1e-9, 1e-4, 0.3, 1.0, 2.0):
        R = pin.exp3(angle * axis)
        assert np.abs(log_rotation(R) - pin.log3(R)).max() <= 4 * ROUNDING


def test_axis_and_angle_come_back() -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    for angle in (1e-12, 0.5, 3.0, np.pi - 1e-9):
        found, size = axis_angle_of(rotation_about(axis, angle))
        assert abs(float(size) - angle) <= ROUNDING
        assert np.abs((found - axis) * angle).max() <= ROUNDING


def test_no_rotation_has_the_axis_z_and_no_angle() -> None:
    axis, angle = axis_angle_of(np.eye(3))
    assert axis.tolist() == [0.0, 0.0, 1.0]
    assert float(angle) == 0.0


def test_half_a_turn_about_each_axis_keeps_the_axis() -> None:
    for axis in np.vstack((np.eye(3), [[0.6, 0.8, 0.0]])):
        found, angle = axis_angle_of(2.0 * np.outer(axis, axis) - np.eye(3))
        assert np.abs(np.abs(found @ axis) - 1.0) <= ROUNDING
        assert float(angle) == np.pi


def test_an_axis_of_another_length_is_refused() -> None:
    with pytest.raises(InputError, match=r"axis must be a unit vector: found norm 2.*divide it"):
        rotation_about([0.0, 0.0, 2.0], 1.0)


def test_what_is_no_rotation_is_refused() -> None:
    with pytest.raises(InputError, match="R must be a rotation"):
        log_rotation(2.0 * np.eye(3))
    with pytest.raises(InputError, match="reflection"):
        log_rotation(np.diag([1.0, 1.0, -1.0]))


@pytest.mark.slow
@given(axes)
def test_the_aligning_rotation_has_the_axis_as_its_z(axis: FloatArray) -> None:
    R = axis_aligning(axis)
    assert np.array_equal(R[:, 2], axis + 0.0)
    assert np.abs(R @ R.T - np.eye(3)).max() <= ROUNDING
    assert abs(float(determinant(R)) - 1.0) <= ROUNDING


def test_coordinate_axes_are_aligned_without_rounding() -> None:
    axes_both_ways = np.vstack((np.eye(3), -np.eye(3)))
    Rs = axis_aligning(axes_both_ways)
    assert np.isin(Rs, (-1.0, 0.0, 1.0)).all()
    assert np.array_equal(Rs[:, :, 2], axes_both_ways)
    assert np.array_equal(axis_aligning([0.0, 0.0, 1.0]), np.eye(3))
