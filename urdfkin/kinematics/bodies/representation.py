"""The manipulator Jacobian: rates of position and of an orientation's *representation*.

Section 7.5, equations 7.116 to 7.122. The velocity Jacobian J_v gives linear and angular velocity; the
manipulator (or analytical) Jacobian J gives the rates of x = (position, orientation), where the orientation
is three Euler angles in any sequence ("ZYZ" is the text's) or a unit quaternion ("quaternion"). People have
mixed the two up: the text warns of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray, matrices, scalars, vectors
from urdfkin.kinematics.rotation.euler import euler_of
from urdfkin.kinematics.rotation.euler_rates import NEAREST, euler_rate_inverse, euler_rate_matrix
from urdfkin.kinematics.rotation.quaternion import quaternion_of
from urdfkin.kinematics.rotation.quaternion_rates import quaternion_rate_matrix

QUATERNION = "quaternion"


def orientation_of(representation: str, R: ArrayLike) -> FloatArray:
    """The numbers that represent a rotation: the last entries of the text's x.

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3) angles in radians, or (..., 4) quaternion, scalar last.

    Raises:
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    return quaternion_of(R) if representation == QUATERNION else euler_of(representation, R)


def representation_matrix(representation: str, R: ArrayLike) -> FloatArray:
    """C, with [d-dot; w] = C x-dot: the identity and Omega on its diagonal (7.119, 7.120).

    For a quaternion Omega is 4 E^T, three by four, with E that of 7.57.

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the end frame.

    Returns:
        (..., 6, 6), or (..., 6, 7) for a quaternion.

    Raises:
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    if representation == QUATERNION:
        return _blocks(4.0 * quaternion_rate_matrix(quaternion_of(R)).swapaxes(-1, -2))
    return _blocks(euler_rate_matrix(representation, euler_of(representation, R)))


def representation_inverse(representation: str, R: ArrayLike, nearest: float = NEAREST) -> FloatArray:
    """C^-1, with x-dot = C^-1 [d-dot; w] (7.122).

    For a quaternion it is the right inverse whose rates keep the length: there is no singularity.

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the end frame.
        nearest: How near the representational singularity may be, radians.

    Returns:
        (..., 6, 6), or (..., 7, 6) for a quaternion.

    Raises:
        RepresentationSingularityError: Euler angles of a sample are nearer than `nearest` to where Omega
            cannot be inverted; the error says how near.
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    if representation == QUATERNION:
        return _blocks(quaternion_rate_matrix(quaternion_of(R)))
    return _blocks(euler_rate_inverse(representation, euler_of(representation, R), nearest))


def analytical_jacobian(
    representation: str, R: ArrayLike, J_v: ArrayLike, nearest: float = NEAREST
) -> FloatArray:
    """J = C^-1 J_v, the manipulator Jacobian (7.122).

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the end frame.
        J_v: (..., 6, n) velocity Jacobian, [linear; angular], in frame 0.
        nearest: How near the representational singularity may be, radians.

    Returns:
        (..., 6, n), or (..., 7, n) for a quaternion: the derivatives of x by the joint coordinates.

    Raises:
        RepresentationSingularityError: see `representation_inverse`.
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    J: FloatArray = representation_inverse(representation, R, nearest) @ _rows(J_v, "J_v", 6)
    return J


def velocity_jacobian(representation: str, R: ArrayLike, J: ArrayLike) -> FloatArray:
    """J_v = C J, the velocity Jacobian back from the manipulator Jacobian (7.121); never singular.

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the end frame.
        J: (..., 6, n), or (..., 7, n) for a quaternion.

    Returns:
        (..., 6, n), [linear; angular], in frame 0.

    Raises:
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    C = representation_matrix(representation, R)
    J_v: FloatArray = C @ _rows(J, "J", C.shape[-1])
    return J_v


def pose_rates(
    representation: str, R: ArrayLike, velocity: ArrayLike, nearest: float = NEAREST
) -> FloatArray:
    """Rates x-dot = C^-1 [d-dot; w]: the rates of position and representation of a moving frame.

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the frame.
        velocity: (..., 6) [linear; angular] in frame 0, m/s and rad/s.
        nearest: How near the representational singularity may be, radians.

    Returns:
        (..., 6), or (..., 7) for a quaternion.

    Raises:
        RepresentationSingularityError: see `representation_inverse`.
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    column = vectors(velocity, "velocity", 6)[..., np.newaxis]
    return (representation_inverse(representation, R, nearest) @ column)[..., 0]


def velocity_of_pose_rates(representation: str, R: ArrayLike, rates: ArrayLike) -> FloatArray:
    """[d-dot; w] = C x-dot (7.119).

    Args:
        representation: An Euler sequence by SciPy's name, or "quaternion".
        R: (..., 3, 3) orientation of the frame.
        rates: (..., 6), or (..., 7) for a quaternion.

    Returns:
        (..., 6) [linear; angular] in frame 0, m/s and rad/s.

    Raises:
        UnknownNameError: no such representation.
        InputError: a shape, or `R` is no rotation.
    """
    C = representation_matrix(representation, R)
    column = vectors(rates, "rates", C.shape[-1])[..., np.newaxis]
    return (C @ column)[..., 0]


def _blocks(lower: FloatArray) -> FloatArray:
    """The identity and `lower` on the diagonal."""
    rows, columns = lower.shape[-2:]
    C = np.zeros((*lower.shape[:-2], 3 + rows, 3 + columns))
    C[..., :3, :3] = np.eye(3)
    C[..., 3:, 3:] = lower
    return C


def _rows(value: ArrayLike, name: str, rows: int) -> FloatArray:
    array = scalars(value, name)
    columns = array.shape[-1] if array.ndim else 0
    return matrices(array, name, rows, columns)
