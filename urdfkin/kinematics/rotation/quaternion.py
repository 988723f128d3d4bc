"""Unit quaternions (qx, qy, qz, qw), scalar last as in a configuration; the text's q0 is qw.

Section 7.2.5. A quaternion and its negative are the same rotation. Rates stand in `quaternion_rates`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, rotations, vectors

#: A quaternion this far from unit length is refused: it was not meant as a rotation.
NORM_TOLERANCE = 1e-6


def unit_quaternions(value: ArrayLike, name: str = "quat") -> FloatArray:
    """`value` as (..., 4) quaternions of unit length, normalised to rounding.

    Args:
        value: (..., 4), scalar last.
        name: How to call it in the message.

    Returns:
        (..., 4) of unit length.

    Raises:
        InputError: a shape, or a norm off one by more than 1e-6.
    """
    quat = vectors(value, name, 4)
    norms = np.sqrt((quat * quat).sum(axis=-1, keepdims=True))
    if (np.abs(norms - 1.0) > NORM_TOLERANCE).any():
        worst = norms.flat[np.abs(norms - 1.0).argmax()]
        raise InputError(f"{name} must be a unit quaternion", found=f"norm {worst:.9g}")
    normalised: FloatArray = quat / norms
    return normalised


def rotation_of(quat: ArrayLike) -> FloatArray:
    """R = (q0^2 - q.q) I + 2 q q^T + 2 q0 S(q), the rotation of a unit quaternion.

    Args:
        quat: (..., 4), scalar last.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        InputError: a shape, or not of unit length.
    """
    x, y, z, w = np.moveaxis(unit_quaternions(quat), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(R: ArrayLike) -> FloatArray:
    """The unit quaternion of a rotation, with qw >= 0 (Shepperd's choice of the largest component).

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a shape, or `R` is no rotation.
    """
    R = rotations(R, "R")
    # K = 4 q q^T is linear in R; its row with the largest diagonal gives q without cancellation.
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
    """The product of two quaternions, so that R(left right) = R(left) R(right).

    Args:
        left: (..., 4), scalar last; any length.
        right: (..., 4), scalar last; any length.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a shape.
    """
    left, right = vectors(left, "left", 4), vectors(right, "right", 4)
    p, p0, q, q0 = left[..., :3], left[..., 3:], right[..., :3], right[..., 3:]
    scalar = p0 * q0 - (p * q).sum(axis=-1, keepdims=True)
    return np.concatenate((p0 * q + q0 * p + np.cross(p, q), scalar), axis=-1)


def conjugate(quat: ArrayLike) -> FloatArray:
    """(-q, q0): the inverse rotation of a unit quaternion.

    Args:
        quat: (..., 4), scalar last.

    Returns:
        (..., 4), scalar last.

    Raises:
        InputError: a shape.
    """
    conjugated: FloatArray = vectors(quat, "quat", 4) * np.array([-1.0, -1.0, -1.0, 1.0])
    return conjugated
