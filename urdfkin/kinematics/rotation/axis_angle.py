"""Conversion of an axis and an angle to a rotation matrix, and of a rotation matrix to its axis and angle.

Section 7.2.1 of the textbook, equations 7.18 to 7.34. A *rotation vector* is the unit axis times the angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray, scalars, unit_vectors, vectors
from urdfkin.kinematics.rotation.matrix import skew
from urdfkin.kinematics.rotation.quaternion import quaternion_of


def rotation_about(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return R_k(phi) = I cos(phi) + k k^T (1 - cos(phi)) + S(k) sin(phi), Rodrigues' formula (7.28).

    Args:
        axis: (..., 3) unit axis k.
        angle: (...) angle phi in radians.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        InputError: a wrong shape, a value that is not finite, or an axis that is not a unit vector.

    Example:
        >>> rotation_about([0.0, 0.0, 1.0], np.pi / 2).round(15) + 0.0
        array([[ 0., -1.,  0.],
               [ 1.,  0.,  0.],
               [ 0.,  0.,  1.]])
    """
    axis = unit_vectors(axis, "axis")
    angle = scalars(angle, "angle")[..., np.newaxis, np.newaxis]
    # This is 1 - cos(phi), computed without cancellation at small angles.
    versine = 2.0 * np.sin(angle / 2.0) ** 2
    outer = axis[..., :, np.newaxis] * axis[..., np.newaxis, :]
    return np.eye(3) * np.cos(angle) + outer * versine + skew(axis) * np.sin(angle)


def rotation_about_derivative(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return the derivative dR_k(phi)/dphi = S(k) R_k(phi), per radian (7.33; 7.29 states its terms).

    Args:
        axis: (..., 3) unit axis k.
        angle: (...) angle phi in radians.

    Returns:
        (..., 3, 3), 1/rad.

    Raises:
        InputError: as for `rotation_about`.
    """
    return skew(axis) @ rotation_about(axis, angle)


def angular_velocity_about(axis: ArrayLike, rate: ArrayLike) -> FloatArray:
    """Return the angular velocity w = phi-dot k of a rotation about a fixed axis (7.12, 7.34).

    Args:
        axis: (..., 3) unit axis k.
        rate: (...) phi-dot in rad/s.

    Returns:
        (..., 3) rad/s, in the frame of `axis`.

    Raises:
        InputError: a wrong shape, or an axis that is not a unit vector.
    """
    w: FloatArray = scalars(rate, "rate")[..., np.newaxis] * unit_vectors(axis, "axis")
    return w


def circular_velocity(axis: ArrayLike, rate: ArrayLike, p: ArrayLike) -> FloatArray:
    """Return phi-dot k x p, the velocity of the tip of a vector p that turns about k (7.21).

    Args:
        axis: (..., 3) unit axis k.
        rate: (...) phi-dot in rad/s.
        p: (..., 3) vector from a point on the axis, in metres.

    Returns:
        (..., 3) velocity in m/s, in the frame of the arguments.

    Raises:
        InputError: a wrong shape, or an axis that is not a unit vector.
    """
    return np.cross(angular_velocity_about(axis, rate), vectors(p, "p"))


def split_along(axis: ArrayLike, p: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Split a vector p = k (k . p) + r into the part along the axis k and the radial part r (7.18).

    Args:
        axis: (..., 3) unit axis k.
        p: (..., 3).

    Returns:
        The part along the axis (..., 3), and r (..., 3), perpendicular to it.

    Raises:
        InputError: a wrong shape, or an axis that is not a unit vector.
    """
    axis, p = unit_vectors(axis, "axis"), vectors(p, "p")
    along = axis * (axis * p).sum(axis=-1, keepdims=True)
    return along, p - along


def exp_rotation(rotation_vector: ArrayLike) -> FloatArray:
    """Return the rotation R_k(phi) of the rotation vector phi k, without a division by phi.

    Args:
        rotation_vector: (..., 3), radians.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        InputError: a wrong shape, or a value that is not finite.
    """
    vector = vectors(rotation_vector, "rotation_vector")
    angle = np.sqrt((vector * vector).sum(axis=-1))[..., np.newaxis, np.newaxis]
    S = skew(vector)
    # np.sinc(x) is sin(pi x) / (pi x), and 1 at 0.
    half = np.sinc(angle / (2.0 * np.pi))
    R: FloatArray = np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * half**2 * (S @ S)
    return R


def log_rotation(R: ArrayLike) -> FloatArray:
    """Return the rotation vector phi k of a rotation, with phi in [0, pi].

    The result is accurate for every angle, also near 0 and near pi.

    At phi = pi both k and -k are correct; the function returns either of them.

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3), radians.

    Raises:
        InputError: a wrong shape, or `R` is not a rotation.
    """
    quat = quaternion_of(R)
    vector, scalar = quat[..., :3], quat[..., 3:]
    sine = np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, scalar)
    small = sine < 1e-150  # for a small angle, phi is twice this sine; the quotient would lose digits
    log: FloatArray = np.where(small, 2.0 * vector, vector * (angle / np.where(small, 1.0, sine)))
    return log


def axis_angle_of(R: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the unit axis k and the angle phi in [0, pi] of a rotation, the inverse of `rotation_about`.

    The identity has no unique axis; the z axis is returned for it.

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        Axis (..., 3) and angle (...) in radians.

    Raises:
        InputError: a wrong shape, or `R` is not a rotation.
    """
    quat = quaternion_of(R)
    vector, scalar = quat[..., :3], quat[..., 3]
    sine = np.sqrt((vector * vector).sum(axis=-1))
    identity = (sine == 0.0)[..., np.newaxis]
    axis = np.where(identity, [0.0, 0.0, 1.0], vector / np.where(identity, 1.0, sine[..., np.newaxis]))
    return axis, 2.0 * np.arctan2(sine, scalar)
