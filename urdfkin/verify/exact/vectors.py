"""Numbers of many digits, intervals, and the rotations that are made of angles; vectors are triples of them.

The kind of number is a context: `mp` of mpmath's for fifty digits, `urdfkin.verify.exact.intervals` for
intervals.
"""

from __future__ import annotations

from typing import Any

import mpmath

from urdfkin.kinematics import equations as eq

#: Digits of the judge's arithmetic. Doubles have 16; fifty leave no doubt about the last of them.
DIGITS = 50

#: A context of our own: mpmath's global one stays as its user set it.
mp = mpmath.mp.clone()
mp.dps = DIGITS

Context = Any
Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

# Whole numbers are numbers of every kind.
ZERO: Vector = (0, 0, 0)
IDENTITY: Matrix = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def exact(value: float, context: Context = mp) -> Number:
    """A double as it is, to its last bit."""
    return context.mpf(float(value))


def unit(x: Vector, context: Context) -> Vector:
    """`x` divided by its length."""
    length = context.sqrt(eq.dot(x, x))
    return x[0] / length, x[1] / length, x[2] / length


def about(axis: Vector, angle: Number, context: Context) -> Matrix:
    """R_k(phi), 7.28, for a unit axis."""
    c, s = context.cos_sin(angle)
    columns = (
        eq.plus(
            eq.plus(eq.times(c, e), eq.times((1 - c) * eq.dot(axis, e), axis)), eq.times(s, eq.cross(axis, e))
        )
        for e in IDENTITY
    )
    found: Matrix = eq.transposed(tuple(columns))
    return found


def from_rpy(rpy: Vector, context: Context) -> Matrix:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = ((sine, cosine, 0, 1) for cosine, sine in map(context.cos_sin, rpy))
    found: Matrix = eq.product(eq.product(eq.about_z(*z), eq.about_y(*y)), eq.about_x(*x))
    return found


def from_quaternion(quaternion: tuple[Number, ...], context: Context) -> Matrix:
    """The rotation of a quaternion (x, y, z, w), put to length one first."""
    length = context.sqrt(sum(x * x for x in quaternion))
    found: Matrix = eq.rotation_of_quaternion(*(x / length for x in quaternion))
    return found


def nearest_rotation(M: Matrix) -> Matrix:
    """The rotation that a matrix means which is one to some digits: the orthogonal factor of M = U H.

    Newton's method, X - X (X^T X - I)/2, which doubles the digits with each step.
    """
    for _ in range(6):
        x, y, z = (
            eq.minus(row, eq.times(0.5, step)) for row, step in zip(M, eq.product(M, defect(M)), strict=True)
        )
        M = x, y, z
    return M


def defect(M: Matrix) -> Matrix:
    """M^T M - I, which is nothing for a rotation."""
    gram = eq.product(eq.transposed(M), M)
    x, y, z = (eq.minus(row, unit) for row, unit in zip(gram, IDENTITY, strict=True))
    return x, y, z
