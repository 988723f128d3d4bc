"""Sections 7.2 and 7.2.1: rotation about a fixed axis, equations 7.11 to 7.34 and example 7.1."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from tests.high_precision import about, array, column, mp, rate, turn
from tests.kinematics.rotation.strategies import ROUNDING, close
from urdfkin.kinematics.rotation import (
    angular_velocity_about,
    circular_velocity,
    rotation_about,
    rotation_about_derivative,
    rotation_rate,
    skew,
    split_along,
    turning_vector_rate,
    unskew,
)

X, Y, Z = np.eye(3)
THETA, SPEED, A1 = 0.9, -1.7, 0.8
K = np.array([2.0, -1.0, 2.0]) / 3.0
P = np.array([0.3, 1.1, -0.7])


def R_z(t: Any) -> Any:
    return turn("z", mp.mpf(THETA) + t * mp.mpf(SPEED))


def R_k(t: Any) -> Any:
    return about(column(2, -1, 2), mp.mpf(THETA) + t * mp.mpf(SPEED))


# -- the one-link manipulator in space ---------------------------------------------------------------


def test_7_11_the_endpoints_velocity_is_the_cross_product_of_w_and_the_position() -> None:
    d_01 = array(R_z(mp.mpf(0)) * column(A1, 0, 0))
    expected = array(rate(lambda t: R_z(t) * column(A1, 0, 0), 0.0))
    assert close(turning_vector_rate([0.0, 0.0, SPEED], d_01), expected)


def test_7_12_the_angular_velocity_is_the_axis_times_the_rate() -> None:
    assert close(skew(angular_velocity_about(Z, SPEED)), array(rate(R_z, 0.0) * R_z(mp.mpf(0)).T))


def test_7_13_the_velocity_is_the_rate_of_the_spatial_rotation_times_a1_x1() -> None:
    R_rate = SPEED * rotation_about_derivative(Z, THETA)
    assert close(R_rate @ (A1 * X), array(rate(lambda t: R_z(t) * column(A1, 0, 0), 0.0)))


def test_7_14_the_rate_of_R_z_has_the_texts_entries() -> None:
    c, s = np.cos(THETA), np.sin(THETA)
    assert close(rotation_about_derivative(Z, THETA), [[-s, -c, 0], [c, -s, 0], [0, 0, 0]])
    assert close(SPEED * rotation_about_derivative(Z, THETA), array(rate(R_z, 0.0)))


def test_7_15_the_rate_of_R_z_has_the_factors_S_z_and_R_z() -> None:
    R = rotation_about(Z, THETA)
    assert close(SPEED * skew(Z) @ R, array(rate(R_z, 0.0)))


def test_7_16_the_skew_matrix_of_z_has_the_texts_entries() -> None:
    assert np.array_equal(skew(Z), [[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    assert np.array_equal(unskew([[0, -1, 0], [1, 0, 0], [0, 0, 0]]), Z)


def test_7_17_both_derivations_of_the_endpoints_velocity_agree() -> None:
    d_01 = rotation_about(Z, THETA) @ (A1 * X)
    by_matrix = A1 * SPEED * skew(Z) @ rotation_about(Z, THETA) @ X
    assert close(by_matrix, turning_vector_rate(SPEED * Z, d_01))
    assert close(by_matrix, array(rate(lambda t: R_z(t) * column(A1, 0, 0), 0.0)))


# -- an arbitrary axis: by geometry ------------------------------------------------------------------


def test_7_18_a_vector_is_the_sum_of_the_axial_part_and_the_radial_part() -> None:
    along, radial = split_along(K, P)
    assert close(along + radial, P)
    assert close(np.cross(along, K), 0.0)
    assert abs(radial @ K) <= ROUNDING


def test_7_19_a_rotation_changes_only_the_radial_part_of_a_vector() -> None:
    turned = rotation_about(K, THETA) @ P
    assert close(split_along(K, turned)[0], split_along(K, P)[0])


def test_7_20_the_radial_part_moves_along_the_tangent() -> None:
    radial = split_along(K, P)[1]
    expected = array(rate(lambda t: about(column(2, -1, 2), t * mp.mpf(SPEED)) * column(*radial), 0.0))
    assert close(circular_velocity(K, SPEED, radial), expected)


def test_7_21_the_velocity_of_the_whole_vector_is_w_cross_p() -> None:
    expected = array(rate(lambda t: about(column(2, -1, 2), t * mp.mpf(SPEED)) * column(*P), 0.0))
    assert close(circular_velocity(K, SPEED, P), expected)


# -- an arbitrary axis: by the rotation matrix -------------------------------------------------------


def test_7_22_the_rate_of_a_rotation_is_the_derivative_by_the_angle_times_the_angular_rate() -> None:
    assert close(rotation_about_derivative(K, THETA) * SPEED, array(rate(R_k, 0.0)))


def test_7_23_the_transpose_of_a_rotation_is_the_inverse() -> None:
    R = rotation_about(K, THETA)
    assert close(R @ R.T, np.eye(3))


def test_7_24_the_derivative_of_a_rotation_times_the_transpose_vanishes() -> None:
    R, dR = rotation_about(K, THETA), rotation_about_derivative(K, THETA)
    assert close(dR @ R.T + R @ dR.T, 0.0)


def test_7_25_and_7_26_dR_times_R_transposed_is_skew_symmetric() -> None:
    S = rotation_about_derivative(K, THETA) @ rotation_about(K, THETA).T
    assert close(S + S.T, 0.0)
    assert np.abs(S).max() > 0.1


def test_7_27_the_derivative_of_a_rotation_is_S_R_and_minus_S_transposed_R() -> None:
    R, dR = rotation_about(K, THETA), rotation_about_derivative(K, THETA)
    S = array(rate(R_k, 0.0) * R_k(mp.mpf(0)).T) / SPEED
    assert close(dR, S @ R)
    assert close(dR, -S.T @ R)


def test_7_28_rodrigues_formula_agrees_with_scipy_and_pinocchio() -> None:
    for angle in (-9.0, 0.0, 1e-9, 1.0, np.pi, 5.0):
        R = rotation_about(K, angle)
        assert close(R, Rotation.from_rotvec(angle * K).as_matrix())
        assert close(R, pin.exp3(angle * K))


def test_7_29_the_derivative_of_rodrigues_formula_has_the_texts_three_terms() -> None:
    c, s = np.cos(THETA), np.sin(THETA)
    terms = -np.eye(3) * s + np.outer(K, K) * s + skew(K) * c
    assert close(rotation_about_derivative(K, THETA), terms)


def test_7_30_the_product_of_the_two_formulas_has_the_texts_nine_terms() -> None:
    c, s, S, kk = np.cos(THETA), np.sin(THETA), skew(K), np.outer(K, K)
    nine = (-np.eye(3) * s * c - kk * s * (1 - c) + S * s**2 + kk * s * c + kk @ kk * s * (1 - c)) + (
        -kk @ S * s**2 + S * c**2 + S @ kk * c * (1 - c) - S @ S * s * c
    )
    assert close(rotation_about_derivative(K, THETA) @ rotation_about(K, THETA).T, nine)


def test_7_31_the_double_cross_product_of_the_axis_with_a_vector_is_minus_the_radial_part() -> None:
    assert close(skew(K) @ skew(K) @ P, np.cross(K, np.cross(K, P)))
    assert close(skew(K) @ skew(K), np.outer(K, K) - np.eye(3))


def test_7_32_the_skew_matrix_of_a_rotation_about_an_axis_is_that_of_the_axis() -> None:
    assert close(unskew(rotation_about_derivative(K, THETA) @ rotation_about(K, THETA).T), K)


def test_7_33_the_derivative_of_a_rotation_by_the_angle_is_S_k_R() -> None:
    exact = array(rate(lambda phi: about(column(2, -1, 2), phi), THETA))
    assert close(rotation_about_derivative(K, THETA), exact)


def test_7_34_the_rate_of_a_rotation_is_S_w_R_with_w_along_the_axis() -> None:
    w = angular_velocity_about(K, SPEED)
    assert close(rotation_rate(rotation_about(K, THETA), w), array(rate(R_k, 0.0)))


@pytest.mark.parametrize(("axis", "name"), [(X, "x"), (Y, "y"), (Z, "z")])
def test_example_7_1_the_derivative_of_a_rotation_about_x_y_or_z_is_S_times_the_rotation(
    axis: Any, name: str
) -> None:
    phi = 0.6
    exact = array(rate(lambda angle: turn(name, angle), phi))
    assert close(rotation_about_derivative(axis, phi), exact)
    assert close(exact @ rotation_about(axis, phi).T, skew(axis))
    if name == "x":
        c, s = np.cos(phi), np.sin(phi)
        assert close(exact, [[0, 0, 0], [0, -s, -c], [0, c, -s]])
