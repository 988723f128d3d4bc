"""Vectors and rotations of many digits: tuples of mpmath numbers, and the few products that are needed."""

from __future__ import annotations

from typing import Any

import mpmath

#: Digits of the judge's arithmetic. Doubles have 16; fifty leave no doubt about the last of them.
DIGITS = 50

#: The judge's own arithmetic context: mpmath's global one stays as its user set it.
mp = mpmath.mp.clone()
mp.dps = DIGITS

Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (mp.mpf(0), mp.mpf(0), mp.mpf(0))
_ONE, _NONE = mp.mpf(1), mp.mpf(0)
IDENTITY: Matrix = (_ONE, _NONE, _NONE), (_NONE, _ONE, _NONE), (_NONE, _NONE, _ONE)


def exact(value: float) -> Number:
    """A double as it is, to its last bit."""
    return mp.mpf(float(value))


def plus(*terms: Vector) -> Vector:
    """The sum of some vectors."""
    x, y, z = (sum(entries, mp.mpf(0)) for entries in zip(*terms, strict=True))
    return x, y, z


def minus(x: Vector, y: Vector) -> Vector:
    """`x - y`."""
    return x[0] - y[0], x[1] - y[1], x[2] - y[2]


def times(c: Number, x: Vector) -> Vector:
    """`c x`."""
    return c * x[0], c * x[1], c * x[2]


def dot(x: Vector, y: Vector) -> Number:
    """`x . y`."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def cross(x: Vector, y: Vector) -> Vector:
    """`x x y`."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def rotate(R: Matrix, x: Vector) -> Vector:
    """`R x`."""
    return dot(R[0], x), dot(R[1], x), dot(R[2], x)


def transposed(R: Matrix) -> Matrix:
    """`R^T`."""
    return (R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])


def product(R: Matrix, S: Matrix) -> Matrix:
    """`R S`."""
    x, y, z = transposed(S)
    first, second, third = ((dot(row, x), dot(row, y), dot(row, z)) for row in R)
    return first, second, third


def unit(x: Vector) -> Vector:
    """`x` divided by its length."""
    length = mp.sqrt(dot(x, x))
    return x[0] / length, x[1] / length, x[2] / length


def about(axis: Vector, angle: Number) -> Matrix:
    """R_k(phi), 7.28, for a unit axis."""
    c, s = mp.cos(angle), mp.sin(angle)
    x, y, z = (
        plus(times(c, e), times((1 - c) * dot(axis, e), axis), times(s, cross(axis, e))) for e in IDENTITY
    )
    return transposed((x, y, z))


def from_rpy(rpy: Vector) -> Matrix:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = rpy
    x, y, z = IDENTITY
    return product(product(about(z, yaw), about(y, pitch)), about(x, roll))


def from_quaternion(x: Number, y: Number, z: Number, w: Number) -> Matrix:
    """The rotation of a quaternion, put to length one first."""
    n = x * x + y * y + z * z + w * w
    return (
        (1 - 2 * (y * y + z * z) / n, 2 * (x * y - z * w) / n, 2 * (x * z + y * w) / n),
        (2 * (x * y + z * w) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - x * w) / n),
        (2 * (x * z - y * w) / n, 2 * (y * z + x * w) / n, 1 - 2 * (x * x + y * y) / n),
    )
