"""Sections 7.2.2 and 7.2.3: any moving rotation, sums of angular velocities; 7.35 to 7.50, example 7.2."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from tests.high_precision import about, angular_velocity, array, column, mp, rate, turn
from tests.kinematics.rotation import strategies
from urdfkin.kinematics.bodies import MovingFrame, compose, point_position
from urdfkin.kinematics.rotation import (
    add_angular_velocities,
    angular_velocity_about,
    angular_velocity_of,
    exp_rotation,
    rotate_skew,
    rotation_about,
    rotation_rate,
    skew,
    turning_vector_rate,
)

close = partial(strategies.close, room=8.0)

T = 0.8
P_1 = np.array([0.3, 1.1, -0.7])
B = np.array([-0.5, 0.2, 0.9])


def R_01(t: Any) -> Any:
    return about(column(1, 2, 3), mp.sin(t)) * about(column(-1, 0, 2), t * t)


def R_12(t: Any) -> Any:
    return about(column(0, 1, -1), mp.exp(t) / 2)


def R_23(t: Any) -> Any:
    return about(column(3, 0, 4), 2 * t)


def now(R: Callable[[Any], Any]) -> Any:
    return array(R(mp.mpf(T)))


W_01, W_12, W_23 = (array(angular_velocity(R, T)) for R in (R_01, R_12, R_23))


def test_7_35_a_rotation_times_its_transpose_is_the_identity() -> None:
    R = exp_rotation([0.4, -1.2, 2.0])
    assert close(R @ R.T, np.eye(3))


def test_7_36_the_rate_of_a_rotation_times_the_transpose_vanishes() -> None:
    R_rate = rotation_rate(now(R_01), W_01)
    assert close(R_rate @ now(R_01).T + now(R_01) @ R_rate.T, 0.0)


def test_7_37_S_is_the_skew_matrix_of_the_angular_velocity() -> None:
    S = rotation_rate(now(R_01), W_01) @ now(R_01).T
    assert close(S + S.T, 0.0)
    assert close(angular_velocity_of(now(R_01), array(rate(R_01, T))), W_01)


def test_7_38_the_rate_of_any_moving_rotation_is_S_w_R() -> None:
    assert close(rotation_rate(now(R_01), W_01), array(rate(R_01, T)))


def test_7_39_a_rotation_converts_a_vector_from_frame_1_to_frame_0() -> None:
    frame = MovingFrame(now(R_01), np.zeros(3))
    assert close(point_position(frame, P_1), array(R_01(mp.mpf(T)) * column(*P_1)))


def test_7_40_the_rate_of_a_vector_fixed_in_frame_1_is_the_rate_of_the_rotation_times_p() -> None:
    assert close(rotation_rate(now(R_01), W_01) @ P_1, array(rate(lambda t: R_01(t) * column(*P_1), T)))


def test_7_41_the_rate_of_a_vector_fixed_in_frame_1_is_w_cross_p() -> None:
    p_0 = now(R_01) @ P_1
    assert close(turning_vector_rate(W_01, p_0), array(rate(lambda t: R_01(t) * column(*P_1), T)))


def test_7_42_w_cross_R_is_the_cross_product_with_each_column() -> None:
    columns = np.cross(W_01, now(R_01).T).T
    assert close(rotation_rate(now(R_01), W_01), columns)


def test_example_7_2_a_rotation_about_x_has_its_angular_velocity_along_x() -> None:
    phi, phi_rate = 0.6, 1.9
    exact = array(rate(lambda t: turn("x", mp.mpf(phi) + mp.mpf(phi_rate) * t), 0.0))
    w = angular_velocity_about([1.0, 0.0, 0.0], phi_rate)
    assert close(rotation_rate(rotation_about([1.0, 0.0, 0.0], phi), w), exact)
    assert close(angular_velocity_of(rotation_about([1.0, 0.0, 0.0], phi), exact), w)


# -- addition of angular velocities ------------------------------------------------------------------


def frames() -> tuple[MovingFrame, MovingFrame]:
    return MovingFrame(now(R_01), np.zeros(3), W_01), MovingFrame(now(R_12), np.zeros(3), W_12)


def test_7_43_the_rotation_of_frame_2_is_the_product_of_two_rotations() -> None:
    assert close(compose(*frames()).R_0_1, array(R_01(mp.mpf(T)) * R_12(mp.mpf(T))))


def test_7_44_the_rate_of_the_product_obeys_the_product_rule() -> None:
    both = rotation_rate(now(R_01), W_01) @ now(R_12) + now(R_01) @ rotation_rate(now(R_12), W_12)
    assert close(both, array(rate(lambda t: R_01(t) * R_12(t), T)))


def test_7_45_skew_matrices_in_the_same_frame_add() -> None:
    R_02 = now(R_01) @ now(R_12)
    whole = array(angular_velocity(lambda t: R_01(t) * R_12(t), T))
    inner = rotate_skew(now(R_01), skew(W_12))
    assert close(skew(whole) @ R_02, skew(W_01) @ R_02 + inner @ R_02)


def test_7_46_a_similarity_transformation_converts_a_skew_matrix_to_another_frame() -> None:
    assert close(rotate_skew(now(R_01), skew(W_12)), skew(now(R_01) @ W_12))


def test_7_47_the_left_side_of_7_46_times_a_vector_is_a_cross_product() -> None:
    assert close(rotate_skew(now(R_01), skew(W_12)) @ B, np.cross(now(R_01) @ W_12, B))


def test_7_48_the_right_side_of_7_46_times_a_vector_is_the_rotated_cross_product() -> None:
    R = now(R_01)
    b_1 = R.T @ B
    assert close(rotate_skew(R, skew(W_12)) @ B, R @ np.cross(W_12, b_1))
    assert close(R @ turning_vector_rate(W_12, b_1), turning_vector_rate(R @ W_12, B))


def test_7_49_two_angular_velocities_in_the_same_frame_add() -> None:
    whole = array(angular_velocity(lambda t: R_01(t) * R_12(t), T))
    assert close(compose(*frames()).w_0_1, whole)


def test_7_50_any_number_of_angular_velocities_in_the_same_frame_add() -> None:
    Rs = np.stack([now(R) for R in (R_01, R_12, R_23)])
    whole = array(angular_velocity(lambda t: R_01(t) * R_12(t) * R_23(t), T))
    assert close(add_angular_velocities(Rs, np.stack([W_01, W_12, W_23])), whole)
