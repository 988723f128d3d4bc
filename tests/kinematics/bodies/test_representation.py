"""The manipulator Jacobian against the velocity Jacobian, for every representation, and its singularity."""

import numpy as np
import pytest

from tests.kinematics.rotation.strategies import ROUNDING
from urdfkin.errors import InputError, RepresentationSingularityError, UnknownNameError
from urdfkin.kinematics.bodies import (
    analytical_jacobian,
    frame_velocity,
    orientation_of,
    pose_rates,
    representation_inverse,
    representation_matrix,
    tool_velocity,
    velocity_jacobian,
    velocity_of_pose_rates,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import SEQUENCES, exp_rotation, rotation_from_euler, rotation_of

R = exp_rotation([0.5, -0.8, 0.3])
REPRESENTATIONS = (*SEQUENCES, "quaternion")


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_the_rates_are_the_difference_quotient_of_the_representation(representation: str) -> None:
    velocity, step = np.array([0.1, 0.2, 0.3, -0.4, 0.9, 0.6]), 1e-3
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}

    def turned(t: float) -> FloatArray:
        return orientation_of(representation, exp_rotation(velocity[3:] * t) @ R)

    slope = sum(w / step * (turned(n * step) - turned(-n * step)) for n, w in weights.items())
    rates = pose_rates(representation, R, velocity)
    assert np.array_equal(rates[:3], velocity[:3])
    assert np.abs(rates[3:] - slope).max() < 1e-11
    assert np.abs(velocity_of_pose_rates(representation, R, rates) - velocity).max() <= 8 * ROUNDING


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_manipulator_and_velocity_jacobian_are_each_others(representation: str) -> None:
    J_v = np.random.default_rng(0).normal(size=(4, 6, 7))
    Rs = exp_rotation(np.random.default_rng(1).normal(size=(4, 3)))
    J = analytical_jacobian(representation, Rs, J_v)
    assert J.shape == ((4, 7, 7) if representation == "quaternion" else (4, 6, 7))
    assert np.abs(velocity_jacobian(representation, Rs, J) - J_v).max() <= 256 * ROUNDING


def test_a_quaternions_matrix_has_a_right_inverse_everywhere() -> None:
    for angle in (0.0, 1e-9, 1.0, np.pi):
        turned = exp_rotation([0.0, angle, 0.0])
        product = representation_matrix("quaternion", turned) @ representation_inverse("quaternion", turned)
        assert np.abs(product - np.eye(6)).max() <= ROUNDING
    assert np.abs(rotation_of(orientation_of("quaternion", R)) - R).max() <= ROUNDING


def test_at_the_singularity_the_jacobian_is_refused_with_the_distance() -> None:
    for sequence, middle in (("ZYZ", 0.0), ("xyz", np.pi / 2)):
        singular = rotation_from_euler(sequence, [0.3, middle, 0.0])
        with pytest.raises(RepresentationSingularityError, match=f"{sequence}.*rad from it") as caught:
            analytical_jacobian(sequence, singular, np.ones((6, 3)))
        assert caught.value.distance < 1e-9
        # The other way there is no singularity: angular velocities of Euler rates always exist.
        assert np.isfinite(velocity_jacobian(sequence, singular, np.ones((6, 3)))).all()


def test_how_near_is_too_near_is_the_callers_choice() -> None:
    near = rotation_from_euler("ZYZ", [0.3, 1e-4, 0.0])
    assert np.isfinite(analytical_jacobian("ZYZ", near, np.ones((6, 3)))).all()
    with pytest.raises(RepresentationSingularityError):
        analytical_jacobian("ZYZ", near, np.ones((6, 3)), nearest=1e-3)


def test_unknown_representations_and_shapes_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="Euler sequence 'zzz'"):
        analytical_jacobian("zzz", R, np.ones((6, 3)))
    with pytest.raises(InputError, match=r"J_v must have the shape"):
        analytical_jacobian("ZYZ", R, np.ones((5, 3)))


def test_velocities_are_referred_to_the_tool_and_back() -> None:
    generator = np.random.default_rng(2)
    velocity, d = generator.normal(size=(5, 6)), generator.normal(size=(5, 3))
    there = tool_velocity(velocity, d)
    assert np.array_equal(there[:, 3:], velocity[:, 3:])
    assert np.abs(frame_velocity(there, d) - velocity).max() <= 4 * ROUNDING
