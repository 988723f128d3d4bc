"""Three angles and a rotation, there and back, in all 24 sequences."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.kinematics.rotation.strategies import ROUNDING, angles
from urdfkin.errors import UnknownNameError
from urdfkin.kinematics.rotation import (
    SEQUENCES,
    euler_of,
    rotation_about,
    rotation_from_euler,
    rotation_from_rpy,
    rpy_of,
)

three_angles = st.tuples(angles, angles, angles)


def test_there_are_twelve_turning_and_twelve_fixed_sequences() -> None:
    assert len(set(SEQUENCES)) == 24
    assert sum(name.isupper() for name in SEQUENCES) == 12


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(three_angles)
def test_a_rotation_from_angles_is_scipys(name: str, turns: tuple[float, float, float]) -> None:
    expected = Rotation.from_euler(name, turns).as_matrix()
    assert np.abs(rotation_from_euler(name, turns) - expected).max() <= ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
@settings(max_examples=40)  # for each of 24 sequences
@given(three_angles)
def test_angles_of_a_rotation_give_it_back_at_the_singularity_too(
    name: str, turns: tuple[float, float, float]
) -> None:
    R = rotation_from_euler(name, turns)
    found = euler_of(name, R)
    assert np.abs(rotation_from_euler(name, found) - R).max() <= ROUNDING
    low, high = (0.0, np.pi) if name[0] == name[2] else (-np.pi / 2, np.pi / 2)
    assert low <= found[1] <= high


@pytest.mark.parametrize("name", SEQUENCES)
def test_angles_inside_the_range_come_back_themselves(name: str) -> None:
    middle = 1.1 if name[0] == name[2] else -0.7
    assert (
        np.abs(euler_of(name, rotation_from_euler(name, [0.3, middle, -2.0])) - [0.3, middle, -2.0]).max()
        < 1e-14
    )


@given(three_angles)
def test_rpy_is_pinocchios(rpy: tuple[float, float, float]) -> None:
    assert np.abs(rotation_from_rpy(rpy) - pin.rpy.rpyToMatrix(np.array(rpy))).max() <= ROUNDING


@given(three_angles)
def test_rpy_of_any_rotation_gives_it_back_to_rounding(rpy: tuple[float, float, float]) -> None:
    R = rotation_from_rpy(rpy)
    assert np.abs(rotation_from_rpy(rpy_of(R)) - R).max() <= ROUNDING


@given(st.sampled_from([0.5, -0.5]), angles, st.sampled_from([0.0, 1e-17, 1e-12, 1e-9, 1e-8, 1e-5]))
def test_rpy_is_exact_through_gimbal_lock(half: float, yaw: float, off: float) -> None:
    R = rotation_about([0.0, 0.0, 1.0], yaw) @ rotation_about([0.0, 1.0, 0.0], half * np.pi - off)
    assert np.abs(rotation_from_rpy(rpy_of(R)) - R).max() <= ROUNDING


def test_exact_gimbal_lock_has_no_yaw() -> None:
    straight_up = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert rpy_of(straight_up).tolist() == [0.0, np.pi / 2, 0.0]
    assert rpy_of(np.eye(3)).tolist() == [0.0, 0.0, 0.0]


def test_batches_are_their_members() -> None:
    turns = np.random.default_rng(3).uniform(-3.0, 3.0, (2, 5, 3))
    Rs = rotation_from_euler("XZX", turns)
    assert Rs.shape == (2, 5, 3, 3)
    assert np.array_equal(euler_of("XZX", Rs)[1, 3], euler_of("XZX", Rs[1, 3]))
    assert euler_of("zyx", np.zeros((0, 3, 3))).shape == (0, 3)


def test_an_unknown_sequence_offers_the_nearest_names() -> None:
    with pytest.raises(UnknownNameError, match="unknown Euler sequence 'ZYy'"):
        rotation_from_euler("ZYy", [0.0, 0.0, 0.0])
