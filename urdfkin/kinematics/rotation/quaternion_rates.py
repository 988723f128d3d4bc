"""Rates of a unit quaternion and the angular velocity, each from the other.

Section 7.2.5, equation 7.57. Here the angular velocity may be expressed in the fixed frame 0, as the text
does, or in the turning body's frame: `frame="fixed"` or `frame="body"`. There is no singularity.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, vectors
from urdfkin.kinematics.rotation.quaternion import unit_quaternions
from urdfkin.kinematics.rotation.skew import skew

ExpressedIn = Literal["fixed", "body"]


def quaternion_rate_matrix(quat: ArrayLike, frame: ExpressedIn = "fixed") -> FloatArray:
    """E, with (q-dot, q0-dot) = E w, that is 1/2 [q0 I - S(q); -q^T] for w in the fixed frame (7.57).

    In the body's frame the sign of S(q) changes. The columns are perpendicular and 1/2 long, and
    perpendicular to the quaternion, so that its length stays.

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        frame: Where `w` is expressed.

    Returns:
        (..., 4, 3), without unit.

    Raises:
        InputError: a shape, not of unit length, or an unknown `frame`.
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
    """The rate of the quaternion of a body that turns with w (7.57).

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        w: (..., 3) angular velocity of the body, rad/s.
        frame: Where `w` is expressed: the fixed frame 0 or the body's own.

    Returns:
        (..., 4) rates, 1/s, scalar last.

    Raises:
        InputError: a shape, not of unit length, or an unknown `frame`.

    Example:
        >>> quaternion_rates([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 2.0]) + 0.0
        array([0., 0., 1., 0.])
    """
    return (quaternion_rate_matrix(quat, frame) @ vectors(w, "w")[..., np.newaxis])[..., 0]


def angular_velocity_from_quaternion_rates(
    quat: ArrayLike, rates: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """The angular velocity w = 4 E^T (q-dot, q0-dot), the inverse of 7.57.

    A part of the rates along the quaternion would change its length, is no motion, and does not count.

    Args:
        quat: (..., 4) unit quaternion of the body's orientation in frame 0, scalar last.
        rates: (..., 4) its rates, 1/s, scalar last.
        frame: Where the result is expressed: the fixed frame 0 or the body's own.

    Returns:
        (..., 3) angular velocity of the body, rad/s.

    Raises:
        InputError: a shape, not of unit length, or an unknown `frame`.
    """
    E = quaternion_rate_matrix(quat, frame)
    w: FloatArray = 4.0 * (E.swapaxes(-1, -2) @ vectors(rates, "rates", 4)[..., np.newaxis])[..., 0]
    return w
