"""A moving base for Pinocchio, from the user's numbers: nothing of `BaseMotion`'s arithmetic is shared.

What a base's rotation means is said in `urdfkin.kinematics.rotation.nearest`: the rotation nearest to the
matrix that was given. urdfkin goes there by a step of Newton's; here it is Davenport's q-method: among unit
quaternions q^T K q = trace(R(q)^T M) is largest for the nearest rotation, so that its quaternion, which a
free-flyer takes, is the eigenvector of the largest eigenvalue of K.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from urdfkin.model.tree import FloatArray


class BaseNumbers(Protocol):
    """A base's motion as the user gave it, each with one leading batch axis or none."""

    @property
    def placement(self) -> FloatArray:
        """(..., 4, 4) T_world_base."""

    @property
    def velocity(self) -> FloatArray:
        """(..., 6) [linear; angular] in world axes."""

    @property
    def acceleration(self) -> FloatArray:
        """(..., 6) likewise, classical."""


def free_flyer(base: BaseNumbers) -> FloatArray:
    """(..., 7) x, y, z, qx, qy, qz, qw of the base."""
    T = np.asarray(base.placement)
    return np.concatenate((T[..., :3, 3], nearest_quaternion(T[..., :3, :3])), axis=-1)


def free_flyer_rates(base: BaseNumbers) -> FloatArray:
    """(..., 6) its rates: the base's velocity in its own axes."""
    return _in_own_axes(free_flyer(base)[..., 3:], np.asarray(base.velocity))


def free_flyer_second_rates(base: BaseNumbers) -> FloatArray:
    """(..., 6) their rates: the spatial acceleration, acc - w x vel, in the base's own axes."""
    vel, acc = np.broadcast_arrays(base.velocity, base.acceleration)
    linear = acc[..., :3] - np.cross(vel[..., 3:], vel[..., :3])
    return _in_own_axes(free_flyer(base)[..., 3:], np.concatenate((linear, acc[..., 3:]), axis=-1))


def nearest_quaternion(M: FloatArray) -> FloatArray:
    """(..., 4) unit quaternion, scalar last, of the rotation nearest to (..., 3, 3)."""
    K = davenport(M)
    q = np.linalg.eigh(K).eigenvectors[..., -1:]
    # Of a rotation K + I is 4 q q^T: multiplied once more, what LAPACK left of other eigenvectors is gone.
    q = (K @ q + q)[..., 0]
    unit: FloatArray = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def davenport(M: NDArray[Any]) -> NDArray[Any]:
    """(..., 4, 4) K of (..., 3, 3), floats or other numbers; of a rotation it is 4 q q^T - I."""
    K = np.empty((*M.shape[:-2], 4, 4), dtype=M.dtype)
    K[..., :3, :3] = M + np.swapaxes(M, -1, -2)
    trace = np.trace(M, axis1=-2, axis2=-1)
    for i in range(3):
        K[..., i, i] -= trace
        K[..., 3, i] = K[..., i, 3] = M[..., i - 1, i - 2] - M[..., i - 2, i - 1]
    K[..., 3, 3] = trace
    return K


def _in_own_axes(quaternion: FloatArray, six: FloatArray) -> FloatArray:
    """R^T of both halves, by the quaternion itself: x + 2 w (x x u) + 2 (x x u) x u."""
    u, w = quaternion[..., np.newaxis, :3], quaternion[..., np.newaxis, 3:]
    x = six.reshape(*six.shape[:-1], 2, 3)
    aside = 2.0 * np.cross(x, u)
    turned: FloatArray = x + w * aside + np.cross(aside, u)
    return turned.reshape(*turned.shape[:-2], 6)
