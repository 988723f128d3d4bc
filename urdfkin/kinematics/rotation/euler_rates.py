"""Rates of Euler angles and the angular velocity, each from the other, and where that fails.

Section 7.2.4, equations 7.51 to 7.56, for all 24 sequences of `euler`. Angular velocities are expressed in
the fixed frame 0, as in the text.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import RepresentationSingularityError
from urdfkin.kinematics.inputs import FloatArray, vectors
from urdfkin.kinematics.rotation.euler import coordinate_rotation, sequence

#: Nearer to the singularity than this (radians), rates have lost too many digits.
NEAREST = 1e-9


def euler_rate_matrix(name: str, angles: ArrayLike) -> FloatArray:
    """Omega, with w = Omega (phi-dot, theta-dot, psi-dot); its columns are the three axes (7.51 to 7.55).

    Args:
        name: Sequence, SciPy's name; the text's is "ZYZ".
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (..., 3, 3), without unit, expressed in frame 0.

    Raises:
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.

    Example:
        >>> euler_rate_matrix("ZYZ", [0.0, np.pi / 2, 0.3]).round(15) + 0.0
        array([[0., 0., 1.],
               [0., 1., 0.],
               [1., 0., 0.]])
    """
    axes = sequence(name)
    turns = axes.turning(vectors(angles, "angles"))
    R_0_1 = coordinate_rotation(axes.first, turns[..., 0])
    R_0_2 = R_0_1 @ coordinate_rotation(axes.second, turns[..., 1])
    first = np.broadcast_to(np.eye(3)[axes.first], R_0_1.shape[:-1])
    columns = np.stack((first, R_0_1[..., axes.second], R_0_2[..., axes.third]), axis=-1)
    return axes.turning(columns).copy()


def angular_velocity_from_euler_rates(name: str, angles: ArrayLike, rates: ArrayLike) -> FloatArray:
    """The angular velocity w = Omega (phi-dot, theta-dot, psi-dot) (7.54).

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.
        rates: (..., 3) their rates, rad/s.

    Returns:
        (..., 3) angular velocity, rad/s, expressed in frame 0.

    Raises:
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
    """
    product = euler_rate_matrix(name, angles) @ vectors(rates, "rates")[..., np.newaxis]
    return product[..., 0]


def euler_rates(name: str, angles: ArrayLike, w: ArrayLike, nearest: float = NEAREST) -> FloatArray:
    """Rates of the angles of a body that turns with w: Omega^-1 w, solved in closed form (7.56).

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.
        w: (..., 3) angular velocity, rad/s, expressed in frame 0.
        nearest: How near the singularity may be, radians.

    Returns:
        (..., 3) rates, rad/s, in the order of the name.

    Raises:
        RepresentationSingularityError: a sample is nearer to the singularity than `nearest`, or at it.
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
    """
    return (euler_rate_inverse(name, angles, nearest) @ vectors(w, "w")[..., np.newaxis])[..., 0]


def euler_rate_inverse(name: str, angles: ArrayLike, nearest: float = NEAREST) -> FloatArray:
    """Omega^-1, from the geometry of the axes rather than by elimination (7.56).

    In the frame after the first turn two of the axes are coordinate axes and the third lies in a
    coordinate plane, so that each rate can be read off in turn.

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.
        nearest: How near the singularity may be, radians.

    Returns:
        (..., 3, 3).

    Raises:
        RepresentationSingularityError: a sample is nearer to the singularity than `nearest`, or at it.
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
    """
    angles = vectors(angles, "angles")
    _refuse_singular(name, angles, nearest)
    axes = sequence(name)
    turns = axes.turning(angles)
    cosine, sine = np.cos(turns[..., 1]), np.sin(turns[..., 1])
    # The third axis in that frame: `along` the first axis, and `across` it along the remaining one.
    if axes.proper:
        along, across = cosine, -axes.sign * sine
    else:
        along, across = axes.sign * sine, cosine
    inverse = np.zeros((*angles.shape[:-1], 3, 3))
    inverse[..., 2, axes.other] = 1.0 / across
    inverse[..., 1, axes.second] = 1.0
    inverse[..., 0, axes.first] = 1.0
    inverse[..., 0, axes.other] = -along / across
    inverse = inverse @ coordinate_rotation(axes.first, turns[..., 0]).swapaxes(-1, -2)
    return inverse[..., ::-1, :].copy() if axes.fixed else inverse


def singularity_distance(name: str, angles: ArrayLike) -> FloatArray:
    """How far the middle angle is from the representational singularity.

    A proper Euler sequence such as ZYZ is singular where the middle angle is a multiple of pi (the text
    names only 0), the others where it is an odd multiple of pi/2: gimbal lock.

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (...) radians in [0, pi/2].

    Raises:
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
    """
    middle = vectors(angles, "angles")[..., 1]
    sine, cosine = np.abs(np.sin(middle)), np.abs(np.cos(middle))
    distance: FloatArray = np.arctan2(sine, cosine) if sequence(name).proper else np.arctan2(cosine, sine)
    return distance


def euler_condition(name: str, angles: ArrayLike) -> FloatArray:
    """The condition number of Omega: by how much Omega^-1 can enlarge a relative error of w.

    The middle axis is perpendicular to the other two, which are d apart: the singular values are
    1 and sqrt(1 +- cos d), and their ratio is cot(d / 2).

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (...), 1 where the axes are perpendicular.

    Raises:
        RepresentationSingularityError: a sample is at the singularity; the number does not exist.
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
    """
    angles = vectors(angles, "angles")
    _refuse_singular(name, angles, 0.0)
    condition: FloatArray = 1.0 / np.tan(singularity_distance(name, angles) / 2.0)
    return condition


def _refuse_singular(name: str, angles: FloatArray, nearest: float) -> None:
    distance = singularity_distance(name, angles)
    if distance.size and distance.min() <= nearest:
        sample = np.unravel_index(distance.argmin(), distance.shape)
        raise RepresentationSingularityError(name, float(distance.min()), tuple(int(i) for i in sample))
