"""Euler angles in all 24 sequences: rotations, rates and representational singularities.

Section 7.2.4 of the textbook, equations 7.51 to 7.56. The names of the sequences are SciPy's. Capital letters
are axes that turn with the body: "ZYZ" is the textbook's R = Rz Ry Rz. Small letters are fixed axes: "xyz" is
the URDF's rpy (roll, pitch, yaw). Angular velocities are expressed in the fixed frame 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import RepresentationSingularityError, UnknownNameError
from urdfkin.errors.validators import as_str
from urdfkin.kinematics.inputs import FloatArray, rotations, vectors

_AXES = "xyz"
#: All triples of axes in which neighbouring axes differ.
_TRIPLES = [a + b + c for a in _AXES for b in _AXES for c in _AXES if a != b != c]
#: Names of all sequences: twelve with axes that turn with the body, and twelve with fixed axes.
SEQUENCES = (*(triple.upper() for triple in _TRIPLES), *_TRIPLES)


@dataclass(frozen=True, slots=True)
class Sequence:
    """The axes of an Euler sequence.

    Attributes:
        name: SciPy's name.
        first: Index of the first turning axis: 0 is x, 1 is y, 2 is z.
        second: Index of the second turning axis.
        third: Index of the third turning axis; in a proper Euler sequence it is equal to `first`.
        other: The index that is neither the first nor the second.
        sign: +1 if (first, second, other) is right-handed, else -1.
        fixed: Whether the axes are fixed. The angles are then in the reverse order of the turning axes.
    """

    name: str
    first: int
    second: int
    third: int
    other: int
    sign: float
    fixed: bool

    @property
    def proper(self) -> bool:
        """Whether the first and the third axis have the same index, as in ZYZ."""
        return self.first == self.third

    def turning(self, values: FloatArray) -> FloatArray:
        """Return angles or their rates in the order of the turning axes.

        A second call with the result returns the original order.
        """
        return values[..., ::-1] if self.fixed else values


def sequence(name: str) -> Sequence:
    """Return the Euler sequence with a given name.

    Args:
        name: Three letters as in SciPy: "ZYZ" for axes that turn with the body, "xyz" for fixed axes.

    Raises:
        UnknownNameError: the name is not one of the 24.
    """
    if as_str(name, "an Euler sequence") not in SEQUENCES:
        raise UnknownNameError("Euler sequence", name, SEQUENCES)
    return _sequence(name)


@cache
def _sequence(name: str) -> Sequence:
    fixed = name.islower()
    letters = name.lower()[::-1] if fixed else name.lower()
    first, second, third = (_AXES.index(letter) for letter in letters)
    other = 3 - first - second
    sign = 1.0 if (second - first) % 3 == 1 else -1.0
    return Sequence(name, first, second, third, other, sign, fixed)


def coordinate_rotation(axis: int, angle: FloatArray) -> FloatArray:
    """Return the rotation Rx, Ry or Rz (axis 0, 1 or 2) by `angle` (...), rad.

    The entries that do not depend on the angle are exactly 0 and 1.
    """
    angle = np.asarray(angle)
    R = np.zeros((*angle.shape, 3, 3))
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., j, j] = R[..., k, k] = np.cos(angle)
    R[..., k, j] = np.sin(angle)
    R[..., j, k] = -R[..., k, j]
    return R


def rotation_from_euler(name: str, angles: ArrayLike) -> FloatArray:
    """Return the rotation of three angles, for example R = Rz(phi) Ry(theta) Rz(psi) for "ZYZ".

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
    """
    axes = sequence(name)
    turns = axes.turning(vectors(angles, "angles"))
    product: FloatArray = (
        coordinate_rotation(axes.first, turns[..., 0])
        @ coordinate_rotation(axes.second, turns[..., 1])
        @ coordinate_rotation(axes.third, turns[..., 2])
    )
    return product


def euler_of(name: str, R: ArrayLike) -> FloatArray:
    """Return the Euler angles of a rotation. Up to rounding, it is the inverse of `rotation_from_euler`.

    The middle angle is in [0, pi] for a proper sequence and in [-pi/2, pi/2] for the others. At the
    representational singularity, only the sum or the difference of the first and the third angle is
    determined. The third angle is then computed from the first angle, so that the product of the three
    rotations is correct there too.

    Args:
        name: SciPy's name of the sequence.
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3) radians, in the order of the name.

    Raises:
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or `R` is not a rotation.
    """
    axes = sequence(name)
    R = rotations(R, "R") + 0.0  # adding 0 turns -0 into 0, because arctan2(0, -0) would be pi
    i, j, m, sign = axes.first, axes.second, axes.other, axes.sign
    if axes.proper:
        first = np.arctan2(R[..., j, i], -sign * R[..., m, i] + 0.0)
        second = np.arctan2(np.hypot(R[..., j, i], R[..., m, i]), R[..., i, i])
    else:
        first = np.arctan2(-sign * R[..., j, m], R[..., m, m])
        second = np.arctan2(sign * R[..., i, m], np.hypot(R[..., j, m], R[..., m, m]))
    # R_first^T R = R_second R_third. In this product, the row of the second axis depends on the third angle
    # only.
    cosine, sine = np.cos(first), np.sin(first)
    row = cosine[..., np.newaxis] * R[..., j, :] + (sign * sine)[..., np.newaxis] * R[..., m, :]
    # R_third rotates about the third axis, in the plane of the second axis and a remaining one. In a proper
    # sequence the remaining axis is `other`, else it is the first axis.
    rest, sense = (m, sign) if axes.proper else (i, -sign)
    third = np.arctan2(-sense * row[..., rest], row[..., j])
    return axes.turning(np.stack((first, second, third), axis=-1)).copy()


def rotation_from_rpy(rpy: ArrayLike) -> FloatArray:
    """Return R = Rz(yaw) Ry(pitch) Rx(roll), the rotation of the URDF's `rpy`.

    Args:
        rpy: (..., 3) roll, pitch, yaw in radians.

    Returns:
        (..., 3, 3) rotation; exactly the identity for zero angles.

    Raises:
        InputError: a wrong shape, or a value that is not finite.
    """
    return rotation_from_euler("xyz", rpy)


def rpy_of(R: ArrayLike) -> FloatArray:
    """Return roll, pitch and yaw of a rotation; they are accurate at a pitch of +-pi/2 too (see `euler_of`).

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3) radians; the yaw is 0 if R[0, 0] = R[1, 0] = 0 exactly.

    Raises:
        InputError: a wrong shape, or `R` is not a rotation.
    """
    return euler_of("xyz", R)


#: Least allowed distance from the singularity, radians. At a smaller distance, computed rates of the angles
#: lose too many digits.
NEAREST = 1e-9


def euler_rate_matrix(name: str, angles: ArrayLike) -> FloatArray:
    """Return the matrix Omega in w = Omega (phi-dot, theta-dot, psi-dot) (7.51 to 7.55).

    Its columns are the axes of the three rotations.

    Args:
        name: SciPy's name of the sequence; the textbook's is "ZYZ".
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (..., 3, 3), dimensionless, expressed in frame 0.

    Raises:
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.

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
    """Return the angular velocity w = Omega (phi-dot, theta-dot, psi-dot) (7.54).

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.
        rates: (..., 3) rates of the angles, rad/s.

    Returns:
        (..., 3) angular velocity, rad/s, expressed in frame 0.

    Raises:
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
    """
    product = euler_rate_matrix(name, angles) @ vectors(rates, "rates")[..., np.newaxis]
    return product[..., 0]


def euler_rates(name: str, angles: ArrayLike, w: ArrayLike, nearest: float = NEAREST) -> FloatArray:
    """Return the rates Omega^-1 w of a body's Euler angles from its angular velocity w (7.56).

    They are computed in closed form.

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.
        w: (..., 3) angular velocity, rad/s, expressed in frame 0.
        nearest: Least allowed distance from the singularity, radians.

    Returns:
        (..., 3) rates, rad/s, in the order of the name.

    Raises:
        RepresentationSingularityError: the distance of a sample from the singularity is `nearest` or less.
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
    """
    return (euler_rate_inverse(name, angles, nearest) @ vectors(w, "w")[..., np.newaxis])[..., 0]


def euler_rate_inverse(name: str, angles: ArrayLike, nearest: float = NEAREST) -> FloatArray:
    """Return the matrix Omega^-1, computed from the geometry of the axes and not by elimination (7.56).

    In the frame after the first rotation, the first and the second axis are coordinate axes, and the third
    axis lies in a coordinate plane. The rates then follow from the components of w one after the other.

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.
        nearest: Least allowed distance from the singularity, radians.

    Returns:
        (..., 3, 3).

    Raises:
        RepresentationSingularityError: the distance of a sample from the singularity is `nearest` or less.
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
    """
    angles = vectors(angles, "angles")
    _refuse_singular(name, angles, nearest)
    axes = sequence(name)
    turns = axes.turning(angles)
    cosine, sine = np.cos(turns[..., 1]), np.sin(turns[..., 1])
    # Components of the third axis in the frame after the first rotation: `along` is the component along the
    # first axis, `across` the component along the axis `other`.
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
    """Return the distance of the middle angle from the representational singularity (gimbal lock).

    A proper Euler sequence such as ZYZ is singular if the middle angle is a multiple of pi (the textbook
    names only 0). The other sequences are singular if the middle angle is an odd multiple of pi/2.

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (...) radians in [0, pi/2].

    Raises:
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
    """
    middle = vectors(angles, "angles")[..., 1]
    sine, cosine = np.abs(np.sin(middle)), np.abs(np.cos(middle))
    distance: FloatArray = np.arctan2(sine, cosine) if sequence(name).proper else np.arctan2(cosine, sine)
    return distance


def euler_condition(name: str, angles: ArrayLike) -> FloatArray:
    """Return the condition number of Omega.

    It is the largest factor by which the relative error of the rates exceeds that of the angular velocity w.

    The middle axis is perpendicular to the first and to the third axis. Let d be the angle between the first
    and the third axis. The singular values of Omega are then 1 and sqrt(1 +- cos d), and its condition number
    is cot(d / 2).

    Args:
        name: SciPy's name of the sequence.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (...) condition number; it is 1 if the three axes are perpendicular to each other.

    Raises:
        RepresentationSingularityError: a sample is at the singularity, where no condition number exists.
        UnknownNameError: the sequence does not exist.
        InputError: a wrong shape, or a value that is not finite.
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
