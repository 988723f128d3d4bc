"""Orientation by three angles, in all twelve sequences of axes, turning or fixed.

Section 7.2.4. Names are SciPy's: capitals turn with the body ("ZYZ" is the text's R = Rz Ry Rz), small
letters stay fixed ("xyz" is the URDF's rpy: roll, pitch, yaw). Rates stand in `euler_rates`.


Rates of Euler angles and the angular velocity, each from the other, and where that fails.

Section 7.2.4, equations 7.51 to 7.56, for all 24 sequences of `euler`. Angular velocities are expressed in
the fixed frame 0, as in the text.
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
#: Letters a sequence may have: no axis follows itself.
_TRIPLES = [a + b + c for a in _AXES for b in _AXES for c in _AXES if a != b != c]
#: Every name, twelve turning and twelve fixed.
SEQUENCES = (*(triple.upper() for triple in _TRIPLES), *_TRIPLES)


@dataclass(frozen=True, slots=True)
class Sequence:
    """Which axes a sequence turns about.

    Attributes:
        name: SciPy's name.
        first: Index of the first turning axis (0 is x).
        second: Index of the second.
        third: Index of the third, equal to the first in a proper Euler sequence.
        other: The index that is neither the first nor the second.
        sign: +1 when (first, second, other) is a right-handed row, else -1.
        fixed: Whether the axes stay fixed; the angles then stand in the reverse order.
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
        """Whether the first and third axes are the same, as in ZYZ."""
        return self.first == self.third

    def turning(self, values: FloatArray) -> FloatArray:
        """Angles or rates in the order of the turning axes; the same call puts them back."""
        return values[..., ::-1] if self.fixed else values


def sequence(name: str) -> Sequence:
    """The sequence of this name.

    Args:
        name: Three letters as SciPy writes them: "ZYZ" turning with the body, "xyz" fixed.

    Raises:
        UnknownNameError: not one of the 24 names.
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
    """Rx, Ry or Rz (axis 0, 1, 2) by `angle` (...) in radians, with exact zeros and ones: (..., 3, 3)."""
    angle = np.asarray(angle)
    R = np.zeros((*angle.shape, 3, 3))
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., j, j] = R[..., k, k] = np.cos(angle)
    R[..., k, j] = np.sin(angle)
    R[..., j, k] = -R[..., k, j]
    return R


def rotation_from_euler(name: str, angles: ArrayLike) -> FloatArray:
    """The rotation of three angles: R = Rz(phi) Ry(theta) Rz(psi) for "ZYZ".

    Args:
        name: Sequence, SciPy's name.
        angles: (..., 3) radians, in the order of the name.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        UnknownNameError: no such sequence.
        InputError: a shape or a value that is not finite.
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
    """Angles of a rotation: `rotation_from_euler` of them gives the rotation back to rounding, everywhere.

    The middle angle lies in [0, pi] for a proper sequence, in [-pi/2, pi/2] for the others. At the
    representational singularity the two outer angles are not determined; the third is then measured
    against whatever the first came out to be, so that the product is right all the same.

    Args:
        name: Sequence, SciPy's name.
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3) radians, in the order of the name.

    Raises:
        UnknownNameError: no such sequence.
        InputError: a shape, or `R` is no rotation.
    """
    axes = sequence(name)
    R = rotations(R, "R") + 0.0  # no -0, whose arctan2 is pi
    i, j, m, sign = axes.first, axes.second, axes.other, axes.sign
    if axes.proper:
        first = np.arctan2(R[..., j, i], -sign * R[..., m, i] + 0.0)
        second = np.arctan2(np.hypot(R[..., j, i], R[..., m, i]), R[..., i, i])
    else:
        first = np.arctan2(-sign * R[..., j, m], R[..., m, m])
        second = np.arctan2(sign * R[..., i, m], np.hypot(R[..., j, m], R[..., m, m]))
    # The first turn undone leaves R_second R_third, whose second row is the third turn alone.
    cosine, sine = np.cos(first), np.sin(first)
    row = cosine[..., np.newaxis] * R[..., j, :] + (sign * sine)[..., np.newaxis] * R[..., m, :]
    # R_third turns the plane of the second axis and one more: the other axis, or the first.
    rest, sense = (m, sign) if axes.proper else (i, -sign)
    third = np.arctan2(-sense * row[..., rest], row[..., j])
    return axes.turning(np.stack((first, second, third), axis=-1)).copy()


def rotation_from_rpy(rpy: ArrayLike) -> FloatArray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), the URDF's `rpy`.

    Args:
        rpy: (..., 3) roll, pitch, yaw in radians.

    Returns:
        (..., 3, 3) rotation; zero angles give exactly the identity.

    Raises:
        InputError: a shape or a value that is not finite.
    """
    return rotation_from_euler("xyz", rpy)


def rpy_of(R: ArrayLike) -> FloatArray:
    """Roll, pitch, yaw of a rotation, to rounding also where the pitch is +-pi/2 (see `euler_of`).

    Args:
        R: (..., 3, 3) rotation.

    Returns:
        (..., 3) radians; yaw is 0 where R[0, 0] = R[1, 0] = 0 exactly.

    Raises:
        InputError: a shape, or `R` is no rotation.
    """
    return euler_of("xyz", R)


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
