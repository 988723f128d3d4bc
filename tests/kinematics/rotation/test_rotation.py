"""Rotations agree with SciPy and Pinocchio, and a conversion and its inverse give the same rotation."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.kinematics.rotation.strategies import ROUNDING, angles, axes, vectors3
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.inputs import FloatArray, determinant
from urdfkin.kinematics.rotation import (
    EULER_SEQUENCES,
    add_angular_velocities,
    angular_velocity_of,
    axis_angle_of,
    conjugate_quaternion,
    euler_of,
    exp_rotation,
    integrate_orientation,
    log_rotation,
    multiply_quaternions,
    quaternion_of,
    quaternion_rate_matrix,
    rotation_about,
    rotation_from_euler,
    rotation_from_quaternion,
    rotation_from_rpy,
    rotation_with_z_axis,
    rpy_of,
    skew,
    unskew,
)


@pytest.mark.slow
@given(axes, angles)
def test_rotation_about_agrees_with_scipy_and_pinocchio(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    assert np.abs(R - Rotation.from_rotvec(angle * axis).as_matrix()).max() <= ROUNDING * max(1.0, abs(angle))
    assert np.abs(R - pin.AngleAxis(angle, axis).toRotationMatrix()).max() <= ROUNDING
    assert np.abs(R @ R.T - np.eye(3)).max() <= ROUNDING
    assert abs(float(determinant(R)) - 1.0) <= ROUNDING


@pytest.mark.slow
@given(axes, angles)
def test_exp_rotation_agrees_with_pinocchios_exp3(axis: FloatArray, angle: float) -> None:
    assert np.abs(exp_rotation(angle * axis) - pin.exp3(angle * axis)).max() <= ROUNDING * max(1, abs(angle))


@pytest.mark.slow
@given(axes, angles)
def test_log_is_the_inverse_of_exp_even_at_half_a_turn(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    vector = log_rotation(R)
    assert np.linalg.norm(vector) <= np.pi * (1 + ROUNDING)
    assert np.abs(exp_rotation(vector) - R).max() <= ROUNDING


@pytest.mark.slow
@given(axes)
def test_log_agrees_with_pinocchios_log3_away_from_half_a_turn(axis: FloatArray) -> None:
    # Near half a turn, Pinocchio's error grows, so only the law above tests these angles.
    for angle in (0.0, 1e-9, 1e-4, 0.3, 1.0, 2.0):
        R = pin.exp3(angle * axis)
        assert np.abs(log_rotation(R) - pin.log3(R)).max() <= 4 * ROUNDING


def test_axis_and_angle_of_a_rotation_are_recovered() -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    for angle in (1e-12, 0.5, 3.0, np.pi - 1e-9):
        found, size = axis_angle_of(rotation_about(axis, angle))
        assert abs(float(size) - angle) <= ROUNDING
        assert np.abs((found - axis) * angle).max() <= ROUNDING


def test_the_identity_has_axis_z_and_angle_zero() -> None:
    axis, angle = axis_angle_of(np.eye(3))
    assert axis.tolist() == [0.0, 0.0, 1.0]
    assert float(angle) == 0.0


def test_the_axis_of_a_half_turn_is_recovered() -> None:
    for axis in np.vstack((np.eye(3), [[0.6, 0.8, 0.0]])):
        found, angle = axis_angle_of(2.0 * np.outer(axis, axis) - np.eye(3))
        assert np.abs(np.abs(found @ axis) - 1.0) <= ROUNDING
        assert float(angle) == np.pi


@pytest.mark.slow
@given(axes)
def test_the_z_axis_of_the_aligning_rotation_is_the_given_axis(axis: FloatArray) -> None:
    R = rotation_with_z_axis(axis)
    assert np.array_equal(R[:, 2], axis + 0.0)
    assert np.abs(R @ R.T - np.eye(3)).max() <= ROUNDING
    assert abs(float(determinant(R)) - 1.0) <= ROUNDING


def test_coordinate_axes_are_aligned_without_rounding() -> None:
    axes_both_ways = np.vstack((np.eye(3), -np.eye(3)))
    Rs = rotation_with_z_axis(axes_both_ways)
    assert np.isin(Rs, (-1.0, 0.0, 1.0)).all()
    assert np.array_equal(Rs[:, :, 2], axes_both_ways)
    assert np.array_equal(rotation_with_z_axis([0.0, 0.0, 1.0]), np.eye(3))


# -- rotations and angles in all 24 sequences ------------------------------------------------------


three_angles = st.tuples(angles, angles, angles)


def test_there_are_twelve_sequences_about_moving_axes_and_twelve_about_fixed_axes() -> None:
    assert len(set(EULER_SEQUENCES)) == 24
    assert sum(name.isupper() for name in EULER_SEQUENCES) == 12


@pytest.mark.slow
@pytest.mark.parametrize("name", EULER_SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(three_angles)
def test_a_rotation_from_euler_angles_agrees_with_scipy(name: str, turns: tuple[float, float, float]) -> None:
    expected = Rotation.from_euler(name, turns).as_matrix()
    assert np.abs(rotation_from_euler(name, turns) - expected).max() <= ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", EULER_SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(three_angles)
def test_euler_angles_of_a_rotation_reproduce_the_rotation_even_at_the_singularity(
    name: str, turns: tuple[float, float, float]
) -> None:
    R = rotation_from_euler(name, turns)
    found = euler_of(name, R)
    assert np.abs(rotation_from_euler(name, found) - R).max() <= ROUNDING
    low, high = (0.0, np.pi) if name[0] == name[2] else (-np.pi / 2, np.pi / 2)
    assert low <= found[1] <= high


@pytest.mark.parametrize("name", EULER_SEQUENCES)
def test_angles_within_the_range_are_recovered(name: str) -> None:
    middle = 1.1 if name[0] == name[2] else -0.7
    assert (
        np.abs(euler_of(name, rotation_from_euler(name, [0.3, middle, -2.0])) - [0.3, middle, -2.0]).max()
        < 1e-14
    )


@given(three_angles)
def test_rotation_from_rpy_agrees_with_pinocchio(rpy: tuple[float, float, float]) -> None:
    assert np.abs(rotation_from_rpy(rpy) - pin.rpy.rpyToMatrix(np.array(rpy))).max() <= ROUNDING


@given(st.sampled_from([0.5, -0.5]), angles, st.sampled_from([0.0, 1e-17, 1e-12, 1e-9, 1e-8, 1e-5]))
def test_rpy_angles_reproduce_the_rotation_near_and_at_gimbal_lock(
    half: float, yaw: float, off: float
) -> None:
    R = rotation_about([0.0, 0.0, 1.0], yaw) @ rotation_about([0.0, 1.0, 0.0], half * np.pi - off)
    assert np.abs(rotation_from_rpy(rpy_of(R)) - R).max() <= ROUNDING


def test_at_gimbal_lock_the_yaw_angle_is_zero() -> None:
    straight_up = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert rpy_of(straight_up).tolist() == [0.0, np.pi / 2, 0.0]
    assert rpy_of(np.eye(3)).tolist() == [0.0, 0.0, 0.0]


def test_a_batch_gives_the_results_of_single_calls() -> None:
    turns = np.random.default_rng(3).uniform(-3.0, 3.0, (2, 5, 3))
    Rs = rotation_from_euler("XZX", turns)
    assert Rs.shape == (2, 5, 3, 3)
    assert np.array_equal(euler_of("XZX", Rs)[1, 3], euler_of("XZX", Rs[1, 3]))
    assert euler_of("zyx", np.zeros((0, 3, 3))).shape == (0, 3)


# -- quaternions -----------------------------------------------------------------------------------


@pytest.mark.slow
@given(axes, angles)
def test_quaternion_and_rotation_matrix_can_be_converted_both_ways(axis: FloatArray, angle: float) -> None:
    R = rotation_about(axis, angle)
    quat = quaternion_of(R)
    assert quat[3] >= 0.0
    assert np.abs(rotation_from_quaternion(quat) - R).max() <= ROUNDING
    assert np.abs(Rotation.from_quat(quat).as_matrix() - R).max() <= ROUNDING


@pytest.mark.slow
@given(axes, angles, axes, angles)
def test_a_product_of_quaternions_represents_the_product_of_rotations(
    k: FloatArray, phi: float, m: FloatArray, psi: float
) -> None:
    p, q = quaternion_of(rotation_about(k, phi)), quaternion_of(rotation_about(m, psi))
    assert (
        np.abs(
            rotation_from_quaternion(multiply_quaternions(p, q))
            - rotation_from_quaternion(p) @ rotation_from_quaternion(q)
        ).max()
        <= 2 * ROUNDING
    )


@pytest.mark.slow
@given(axes, angles)
def test_the_conjugate_of_a_unit_quaternion_is_the_inverse(axis: FloatArray, angle: float) -> None:
    quat = quaternion_of(rotation_about(axis, angle))
    assert np.abs(multiply_quaternions(quat, conjugate_quaternion(quat)) - [0, 0, 0, 1]).max() <= ROUNDING


# -- skew matrices ---------------------------------------------------------------------------------


@pytest.mark.slow
@given(vectors3, vectors3)
def test_the_skew_matrix_times_a_vector_is_the_cross_product(w: FloatArray, p: FloatArray) -> None:
    assert np.abs(skew(w) @ p - np.cross(w, p)).max() <= ROUNDING


@given(vectors3)
def test_unskew_is_the_exact_inverse_of_skew(w: FloatArray) -> None:
    assert np.array_equal(unskew(skew(w)), w)


def test_every_leading_shape_is_preserved_even_an_empty_one() -> None:
    assert skew(np.ones((4, 0, 3))).shape == (4, 0, 3, 3)
    assert unskew(np.zeros((4, 0, 3, 3))).shape == (4, 0, 3)
    w = np.arange(12.0).reshape(2, 2, 3)
    assert np.array_equal(skew(w)[1, 0], skew(w[1, 0]))


REFUSED: dict[str, tuple[Any, Any, str]] = {
    "an axis of another length": (
        rotation_about,
        ([0.0, 0.0, 2.0], 1.0),
        "axis must be a unit vector: found norm 2.*divide it",
    ),
    "twice a rotation": (log_rotation, (2.0 * np.eye(3),), "R must be a rotation"),
    "a reflection": (log_rotation, (np.diag([1.0, 1.0, -1.0]),), "reflection"),
    "no rate of a rotation": (angular_velocity_of, (np.eye(3), np.eye(3)), "skew-symmetric"),
    "one rotation and two velocities": (
        add_angular_velocities,
        (np.eye(3)[np.newaxis], np.zeros((2, 3))),
        "the same n",
    ),
    "an unknown frame": (quaternion_rate_matrix, ([0, 0, 0, 1], "world"), "'fixed' or 'body'"),
    "equal times": (
        integrate_orientation,
        (np.zeros, [0, 0, 0, 1], [0.0, 0.5, 0.5]),
        "increasing numbers: found 0.5, then",
    ),
    "times in two dimensions": (integrate_orientation, (np.zeros, [0, 0, 0, 1], [[0.0]]), r"shape \(1, 1\)"),
    "an unknown sequence": (rotation_from_euler, ("ZYy", [0.0] * 3), "unknown Euler sequence 'ZYy'"),
    "a quaternion of length 2": (
        rotation_from_quaternion,
        ([0.0, 0.0, 0.0, 2.0],),
        "unit quaternion: found norm 2",
    ),
    "a symmetric matrix": (unskew, (np.eye(3),), r"skew-symmetric.*symmetric part of 1"),
    "two numbers": (skew, ([1.0, 2.0],), "w must"),
    "a number": (skew, (3.0,), "w must"),
    "a vector with nan": (skew, ([1.0, 2.0, np.nan],), "w must"),
    "a text": (skew, ("abc",), "w must"),
    "a vector with inf": (skew, ([np.inf, 0, 0],), "w must"),
}


@pytest.mark.parametrize("given", REFUSED)
def test_an_invalid_rotation_is_refused(given: str) -> None:
    function, arguments, message = REFUSED[given]
    kind = UnknownNameError if given == "an unknown sequence" else InputError
    with pytest.raises(kind, match=message):
        function(*arguments)
