"""Section 7.4.7: the elbow robot of figure 7.16, equations 7.109 to 7.114, and the saved operations.

d1 = 0.6 m, a2 = 0.5 m, d4 = 0.45 m, as in robots/elbow.urdf.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.text.robots import close, motion, robot
from urdfkin.dh import motion as motion_of
from urdfkin.kinematics.bodies import interorigin_vector
from urdfkin.kinematics.inputs import FloatArray

D1, A2, D4 = 0.6, 0.5, 0.45
MOVING = motion("elbow", 5)
Z = [MOVING.axis(i) for i in range(1, 7)]
X2 = MOVING.x(2)


def jacobian() -> FloatArray:
    return robot("elbow").jacobian(MOVING.q, "wrist")


def arm(i: int) -> FloatArray:
    """Return d_i6 by the recursion of 7.110, which begins at the wrist."""
    vector = np.zeros(3)
    for k in range(6, i, -1):
        row = MOVING.rows[k - 1]
        vector = interorigin_vector(float(row.d), MOVING.axis(k), float(row.a), MOVING.x(k)) + vector
    return vector


def test_7_109_the_upper_right_block_is_zero_and_the_lower_rows_are_the_axes() -> None:
    J = jacobian()
    assert np.abs(J[:3, 3:]).max() <= 4 * np.finfo(np.float64).eps
    assert close(J[3:], np.stack(Z, axis=-1))
    for i in range(3):
        assert close(J[:3, i], np.cross(Z[i], MOVING.origin(6) - MOVING.origin(i)))


@pytest.mark.slow
def test_7_110_moment_arms_are_computed_recursively_from_the_wrist() -> None:
    for i in range(6):
        assert close(arm(i), MOVING.origin(6) - MOVING.origin(i))
    assert not arm(4).any()
    assert not arm(5).any()
    assert close(np.cross(arm(3), Z[3]), 0.0)


def test_7_111_the_moment_arm_from_the_elbow_is_the_forearm() -> None:
    assert close(arm(2), D4 * Z[3])


def test_7_112_the_moment_arm_from_the_shoulder_is_the_sum_of_both_links() -> None:
    assert close(arm(1), A2 * X2 + D4 * Z[3])


def test_7_113_the_moment_arm_from_the_base_includes_the_trunk() -> None:
    assert close(arm(0), D1 * Z[0] + A2 * X2 + D4 * Z[3])


def test_7_114_shortened_moment_arms_give_the_same_jacobian() -> None:
    both = A2 * X2 + D4 * Z[3]
    linear = [np.cross(Z[0], both), np.cross(Z[1], both), np.cross(Z[2], D4 * Z[3]), *np.zeros((3, 3))]
    J = np.vstack((np.stack(linear, axis=-1), np.stack(Z, axis=-1)))
    assert close(jacobian(), J)


# -- operations that the substitution saves --------------------------------------------------------


class Counted:
    multiplications = 0

    def __init__(self, value: float) -> None:
        self.value = value

    def __mul__(self, other: Counted) -> Counted:
        Counted.multiplications += 1
        return Counted(self.value * other.value)

    def __add__(self, other: Counted) -> Counted:
        return Counted(self.value + other.value)

    def __sub__(self, other: Counted) -> Counted:
        return Counted(self.value - other.value)


def counted(x: Any) -> Any:
    return np.vectorize(Counted, otypes=[object])(x)


def crossed(x: Any, y: Any) -> Any:
    return np.array([x[i] * y[j] - x[j] * y[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def values(columns: list[Any]) -> FloatArray:
    return np.array([[x.value for x in column] for column in columns]).T


def linear_rows_by_7_110(nonzero: int) -> tuple[FloatArray, int]:
    """Return the linear rows by 7.110; columns from `nonzero` on are zero (7.109)."""
    Counted.multiplications = 0
    z, vector, columns = [counted(axis) for axis in Z], counted(np.zeros(3)), []
    for k in range(6, 0, -1):
        row = MOVING.rows[k - 1]
        own = z[k - 1] * Counted(float(row.d)) + counted(MOVING.x(k)) * Counted(float(row.a))
        vector = own + vector
        columns.append(crossed(z[k - 1], vector) if k <= nonzero else counted(np.zeros(3)))
    return values(columns[::-1]), Counted.multiplications


def linear_rows_by_7_114() -> tuple[FloatArray, int]:
    Counted.multiplications = 0
    z = [counted(axis) for axis in Z]
    forearm = z[3] * Counted(D4)
    both = counted(X2) * Counted(A2) + forearm
    columns = [crossed(z[0], both), crossed(z[1], both), crossed(z[2], forearm)]
    return values([*columns, *counted(np.zeros((3, 3)))]), Counted.multiplications


def test_the_substitution_in_7_114_saves_two_thirds_of_the_multiplications() -> None:
    (full, all_of_them), (shorter, with_zeros) = linear_rows_by_7_110(6), linear_rows_by_7_110(3)
    shortest, substituted = linear_rows_by_7_114()
    for rows in (full, shorter, shortest):
        assert close(rows, jacobian()[:3])
    # Six products for each cross product and interorigin vector; with 7.114, fewer of both.
    assert (all_of_them, with_zeros, substituted) == (72, 54, 24)


def test_the_elbows_standard_table_has_the_rows_of_figure_7_16() -> None:
    table = robot("elbow").dh("wrist")
    found = [(row.a, row.d, row.alpha, row.theta) for row in table.rows]
    expected = [(float(row.a), float(row.d), float(row.alpha), 0.0) for row in MOVING.rows]
    assert close(found, expected)
    assert close(motion_of.jacobian(table, MOVING.q), jacobian())
