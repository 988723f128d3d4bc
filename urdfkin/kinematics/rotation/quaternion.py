"""Unit quaternions, their time derivatives, and the integration of an angular velocity.

Section 7.2.5 of the textbook, equation 7.57. A quaternion is (qx, qy, qz, qw), with the scalar last as in a
configuration; qw is the textbook's q0. A quaternion and its negative are the same rotation.

The angular velocity is expressed in the fixed frame 0, as in the textbook (`frame="fixed"`), or in the
frame of the turning body (`frame="body"`). Quaternion rates have no singularity.

`integrate_orientation` integrates the rates of a quaternion and normalises the quaternion after each step. It
does not integrate the angular velocity itself, because that integral is not an orientation (example 7.3).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, rotations, scalars, vectors
from urdfkin.kinematics.rotation.matrix import skew

#: Largest accepted deviation of a quaternion's norm from 1.
NORM_TOLERANCE = 1e-6


def unit_quaternions(value: ArrayLike, name: str = "quat") -> FloatArray:
    """Return `value` as quaternions (..., 4) that are normalised to unit length, up to rounding.

    Args:
        value: (..., 4), scalar last.
        name: Name of the argument, for messages.

    Returns:
        (..., 4) of unit length.

    Raises:
        InputError: a wrong shape, or a norm that differs from 1 by more than 1e-6.
    """
    quat = vectors(value, name, 4)
    norms = np.sqrt((quat * quat).sum(axis=-1, keepdims=True))
    if (np.abs(norms - 1.0) > NORM_TOLERANCE).any():
        worst = norms.flat[np.abs(norms - 1.0).argmax()]
        raise InputError(f"{name} must be a unit quaternion", found=f"norm {worst:.9g}")
    normalised: FloatArray = quat / norms
    return normalised


def rotation_of(quat: ArrayLike) -> FloatArray:
    """Return R = (q0^2 - q.q) I + 2 q q^T + 2 q0 S(q), the rotation of a unit quaternion.

    Args:
        quat: (..., 4), scalar last.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        InputError: a wrong shape, or a quaternion that is not of unit length.
    """
    x, y, z, w = np.moveaxis(unit_quaternions(quat), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(R: ArrayLike) -> FloatArray:
    """Return the unit quaternion with qw >= 0 of a rotation.

    The function uses Shepperd's method: it divides by the component with the largest absolute value, which
    avoids cancellation.

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a wrong shape, or `R` is not a rotation.
    """
    R = rotations(R, "R")
    # K = 4 q q^T is linear in R. The row of K with the largest diagonal entry gives q without cancellation.
    K = np.empty((*R.shape[:-2], 4, 4))
    trace = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2]
    K[..., 3, 3] = 1.0 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        K[..., i, i] = 1.0 + 2.0 * R[..., i, i] - trace
        K[..., i, j] = K[..., j, i] = R[..., i, j] + R[..., j, i]
        K[..., i, 3] = K[..., 3, i] = R[..., k, j] - R[..., j, k]
    largest = np.diagonal(K, axis1=-2, axis2=-1).argmax(axis=-1)
    row = np.take_along_axis(K, largest[..., np.newaxis, np.newaxis], axis=-2)[..., 0, :]
    quat: FloatArray = row / np.sqrt((row * row).sum(axis=-1, keepdims=True))
    return np.where(quat[..., 3:] < 0.0, -quat, quat)


def multiply(left: ArrayLike, right: ArrayLike) -> FloatArray:
    """Return the product of two quaternions, with R(left right) = R(left) R(right).

    Args:
        left: (..., 4), scalar last; any length.
        right: (..., 4), scalar last; any length.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a wrong shape.
    """
    left, right = vectors(left, "left", 4), vectors(right, "right", 4)
    p, p0, q, q0 = left[..., :3], left[..., 3:], right[..., :3], right[..., 3:]
    scalar = p0 * q0 - (p * q).sum(axis=-1, keepdims=True)
    return np.concatenate((p0 * q + q0 * p + np.cross(p, q), scalar), axis=-1)


def conjugate(quat: ArrayLike) -> FloatArray:
    """Return the conjugate (-q, q0), the inverse rotation of a unit quaternion.

    Args:
        quat: (..., 4), scalar last.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a wrong shape.
    """
    conjugated: FloatArray = vectors(quat, "quat", 4) * np.array([-1.0, -1.0, -1.0, 1.0])
    return conjugated


ExpressedIn = Literal["fixed", "body"]


def quaternion_rate_matrix(quat: ArrayLike, frame: ExpressedIn = "fixed") -> FloatArray:
    """Return the matrix E in (q-dot, q0-dot) = E w (7.57).

    For w in the fixed frame, E = 1/2 [q0 I - S(q); -q^T]. For w in the body's frame, the sign of S(q)
    changes. The columns of E have length 1/2. They are perpendicular to each other and to the quaternion, so
    the quaternion's length is constant.

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        frame: Frame of `w`: "fixed" or "body".

    Returns:
        (..., 4, 3), dimensionless.

    Raises:
        InputError: a wrong shape, a quaternion that is not of unit length, or an unknown `frame`.
    """
    if frame not in ("fixed", "body"):
        raise InputError("frame must be 'fixed' or 'body'", found=repr(frame))
    quat = unit_quaternions(quat)
    q, q0 = quat[..., :3], quat[..., 3]
    turn = -skew(q) if frame == "fixed" else skew(q)
    top = turn + q0[..., np.newaxis, np.newaxis] * np.eye(3)
    E: FloatArray = 0.5 * np.concatenate((top, -q[..., np.newaxis, :]), axis=-2)
    return E


def quaternion_rates(quat: ArrayLike, w: ArrayLike, frame: ExpressedIn = "fixed") -> FloatArray:
    """Return the time derivative of a body's quaternion from the body's angular velocity w (7.57).

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        w: (..., 3) angular velocity of the body, rad/s.
        frame: Frame of `w`: "fixed" is frame 0, "body" the body's own.

    Returns:
        (..., 4) rates, 1/s, scalar last.

    Raises:
        InputError: a wrong shape, a quaternion that is not of unit length, or an unknown `frame`.

    Example:
        >>> quaternion_rates([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 2.0]) + 0.0
        array([0., 0., 1., 0.])
    """
    return (quaternion_rate_matrix(quat, frame) @ vectors(w, "w")[..., np.newaxis])[..., 0]


def angular_velocity_from_quaternion_rates(
    quat: ArrayLike, rates: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """Return the angular velocity w = 4 E^T (q-dot, q0-dot), the inverse of 7.57.

    The component of the rates along the quaternion changes only the quaternion's length. No rotation causes
    this component, so the function ignores it.

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        rates: (..., 4) rates of `quat`, 1/s, scalar last.
        frame: Frame of the result: "fixed" is frame 0, "body" the body's own.

    Returns:
        (..., 3) angular velocity of the body, rad/s.

    Raises:
        InputError: a wrong shape, a quaternion that is not of unit length, or an unknown `frame`.
    """
    E = quaternion_rate_matrix(quat, frame)
    w: FloatArray = 4.0 * (E.swapaxes(-1, -2) @ vectors(rates, "rates", 4)[..., np.newaxis])[..., 0]
    return w


def integrate_orientation(
    w: Callable[[float], ArrayLike], quat: ArrayLike, times: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """Integrate 7.57 with an angular velocity w(t), by the fourth-order Runge-Kutta method.

    The results are orientations as quaternions.

    The exact quaternion has constant length. Rounding and truncation errors change the length, so the
    quaternion is normalised after each step. If the step is halved, the truncation error is divided by about
    16.

    Args:
        w: Function of the time in s that returns the angular velocity, (..., 3) rad/s. It must be smooth
            within a step, so add a time to `times` at each jump. At the two ends of a step, w is evaluated
            just inside the step.
        quat: (..., 4) orientation at `times[0]`, unit quaternion, scalar last.
        times: (n,) increasing times in s; the method makes one step from each time to the next.
        frame: Frame of w: "fixed" is frame 0, "body" the body's own.

    Returns:
        (n, ..., 4) unit quaternions, scalar last.

    Raises:
        InputError: a wrong shape, or times that do not increase.
    """
    times = scalars(times, "times")
    if times.ndim != 1 or (np.diff(times) <= 0.0).any():
        raise InputError(
            "times must be a one-dimensional array of increasing numbers", found=str(times.shape)
        )
    quats = [unit_quaternions(quat)]
    for start, end in pairwise(times.tolist()):
        quats.append(_step(w, quats[-1], start, end, frame))
    return np.stack(quats)


def _step(
    w: Callable[[float], ArrayLike], quat: FloatArray, start: float, end: float, frame: ExpressedIn
) -> FloatArray:
    """Return the normalised quaternion after one Runge-Kutta step."""
    step = end - start
    first, middle, last = (
        vectors(w(t), "w") for t in (np.nextafter(start, end), (start + end) / 2.0, np.nextafter(end, start))
    )
    k1 = _rates(quat, first, frame)
    k2 = _rates(quat + step / 2.0 * k1, middle, frame)
    k3 = _rates(quat + step / 2.0 * k2, middle, frame)
    k4 = _rates(quat + step * k3, last, frame)
    stepped = quat + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    normalised: FloatArray = stepped / np.sqrt((stepped * stepped).sum(axis=-1, keepdims=True))
    return normalised


def _rates(quat: FloatArray, w: FloatArray, frame: ExpressedIn) -> FloatArray:
    """Return the rates of a quaternion of any length.

    Equation 7.57 is linear in the quaternion, so it needs no unit quaternion.
    """
    length = np.sqrt((quat * quat).sum(axis=-1, keepdims=True))
    rates: FloatArray = length * quaternion_rates(quat / length, w, frame)
    return rates
