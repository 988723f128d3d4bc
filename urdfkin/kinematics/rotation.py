"""Rotations of rigid bodies, and the time derivatives of rotation matrices, quaternions and Euler angles.

The module computes equations of section 7.2 of the textbook (7.11 to 7.57).

| Argument | Shape | Meaning |
|---|---|---|
| `R`, `R_0_1` | (..., 3, 3) | orientation of frame 1 in frame 0 |
| `w`, `w_0_1` | (..., 3) | angular velocity of frame 1 relative to frame 0, rad/s, in frame 0 |
| `axis`, `angle`, `rate` | (..., 3), (...), (...) | unit axis k, angle phi in rad, phi-dot in rad/s |
| `rotation_vector` | (..., 3) | unit axis times the angle, rad |
| `quat`, `rates` of a quaternion | (..., 4) | orientation of a body in frame 0, scalar last; 1/s |
| `angles`, `rates` of Euler angles | (..., 3) | rad and rad/s, in the order of the sequence's name |
| `name` | | Euler sequence with SciPy's name |
| `nearest` | | least allowed distance from the singularity of Euler angles, rad |

The dots stand for any batch shape. Results have the batch shape of the arguments.

| Argument | InputError for |
|---|---|
| any `ArrayLike` | a wrong shape, or a value that is not finite |
| rotation matrix | a matrix that is not a rotation |
| axis, quaternion | a length other than 1 |
| `frame` | an unknown name |

Functions raise RangeError if a result leaves the range of double precision.

A user's matrix often has only a few digits. Quaternions, Euler angles and Gram-Schmidt give different
rotations for the same rounded matrix. `nearest_rotation` and `polar_factor` return the rotation that is
nearest to a matrix M in the Frobenius norm. `nearest_rotation` requires small errors, and `polar_factor`
accepts errors of any size. The nearest rotation is unique, and is the orthogonal factor U of the polar
decomposition M = U H.

A quaternion is (qx, qy, qz, qw), with the scalar last as in a configuration. The scalar qw is the textbook's
q0. A quaternion and its negative are the same rotation. With `frame="fixed"`, functions express the angular
velocity in the fixed frame 0, as in the textbook. With `frame="body"`, functions express the angular velocity
in the body's own frame. Quaternion rates have no singularity. The integral of an angular velocity is not an
orientation (example 7.3). Therefore, `integrate_orientation` integrates quaternion rates.

Euler angles have 24 sequences. The three letters of a sequence are the axes of the three angles. Capital
letters are axes that turn with the body: "ZYZ" is the textbook's R = Rz Ry Rz. Small letters are fixed axes:
"xyz" is the URDF's rpy (roll, pitch, yaw). An unknown name raises UnknownNameError. Functions with the
argument `nearest` raise RepresentationSingularityError within this distance of the singularity. The functions
for Euler angles express angular velocities in the fixed frame 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, RepresentationSingularityError, UnknownNameError
from urdfkin.errors.validators import as_finite_float, as_str, safe_repr
from urdfkin.kinematics.inputs import (
    FloatArray,
    as_finite,
    as_matrices,
    as_rotations,
    as_unit_vectors,
    as_vectors,
    check_range,
    range_checked,
)
from urdfkin.kinematics.number_kinds import array_equations as eq


def skew(w: ArrayLike) -> FloatArray:
    """Return S(w) with S(w) p = w x p (7.16)."""
    w = as_vectors(w, "w")
    S = np.zeros((*w.shape, 3))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    S[..., 1, 2], S[..., 2, 0], S[..., 0, 1] = -w[..., 0], -w[..., 1], -w[..., 2]
    return S


@range_checked
def unskew(S: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """Return the vector w of S(w) (7.26, 7.37).

    Raise InputError if |S + S^T| / 2 > tolerance * |S|, where |.| is the largest absolute entry.
    """
    S, tolerance = as_matrices(S, "S"), as_finite_float(tolerance, "tolerance")
    size = np.abs(S).max(axis=(-1, -2), initial=0.0)
    symmetric = np.abs(S + S.swapaxes(-1, -2)).max(axis=(-1, -2), initial=0.0) / 2.0
    if (symmetric > tolerance * size).any():
        raise InputError(
            "S must be skew-symmetric, S + S^T = 0", found=f"a symmetric part of {symmetric.max():.3g}"
        )
    pairs = (S[..., 2, 1] - S[..., 1, 2], S[..., 0, 2] - S[..., 2, 0], S[..., 1, 0] - S[..., 0, 1])
    return np.stack(pairs, axis=-1) / 2.0


@range_checked
def rotate_skew(R_0_1: ArrayLike, S_1: ArrayLike) -> FloatArray:
    """Return S(R w) = R S(w) R^T (7.46)."""
    R_0_1 = as_rotations(R_0_1, "R_0_1")
    return R_0_1 @ as_matrices(S_1, "S_1") @ R_0_1.swapaxes(-1, -2)


#: A matrix is used unchanged if no entry differs from the nearest rotation by more than this number.
UNCHANGED_MATRIX_TOLERANCE = 1e-15


def nearest_rotation(M: ArrayLike, name: str = "M") -> FloatArray:
    """Return the nearest rotation to a rotation matrix M, which may be rounded to nine decimals.

    The result is one Newton step (Bjorck and Bowie):

    `M - M (M^T M - I)/2`

    With M = U (I + E), the result is U (I - 3/2 E^2). Since |E| <= 3e-9, the error is at most 3/2 |E|^2,
    about 1.4e-17. This is an eighth of eps/2 = 1.1e-16.
    """
    M = as_rotations(M, name)
    defect = np.swapaxes(M, -1, -2) @ M - np.eye(3)
    return M - M @ (0.5 * defect)


def polar_factor(M: FloatArray) -> FloatArray:
    """Return the rotation nearest to M, a matrix with a positive determinant.

    >>> polar_factor(np.diag([1.0, 1.001, 0.999])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ Vt)


def rotation_with_z_axis(axis: ArrayLike) -> FloatArray:
    """Return a rotation matrix with the third column `axis`.

    | z of `axis` | result |
    |---|---|
    | >= 0 | shortest rotation from z to `axis` |
    | < 0 | half a turn about x, then shortest rotation from -z to `axis` |

    The formula has no singularity (Duff and others, "Building an Orthonormal Basis, Revisited", 2017).
    For a coordinate axis, the entries are exactly 0 and +-1.
    """
    axis = as_unit_vectors(axis, "axis")
    x, y, z = np.moveaxis(axis, -1, 0)
    sign = np.copysign(1.0, z)
    scale = -1.0 / (sign + z)
    first = (1.0 + sign * x * x * scale, sign * x * y * scale, -sign * x)
    second = (x * y * scale, sign + y * y * scale, -y)
    columns = [np.stack(column, axis=-1) for column in (first, second)]
    return np.stack([*columns, axis], axis=-1) + 0.0  # Adding 0 turns -0 into 0.


@range_checked
def rotation_rate(R_0_1: ArrayLike, w_0_1: ArrayLike) -> FloatArray:
    """Return R-dot = S(w) R (7.38, 7.42)."""
    return skew(as_vectors(w_0_1, "w_0_1")) @ as_rotations(R_0_1, "R_0_1")


@range_checked
def angular_velocity_of(R_0_1: ArrayLike, R_rate: ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """Return w with S(w) = R-dot R^T (7.35 to 7.38).

    See `unskew` for `tolerance`.
    """
    R_0_1 = as_rotations(R_0_1, "R_0_1")
    return unskew(as_matrices(R_rate, "R_rate") @ R_0_1.swapaxes(-1, -2), tolerance)


@range_checked
def turning_vector_rate(w_0_1: ArrayLike, p_0: ArrayLike) -> FloatArray:
    """Return the rate w x p (7.39 to 7.41).

    The vector p is fixed in frame 1.
    """
    return np.cross(as_vectors(w_0_1, "w_0_1"), as_vectors(p_0, "p_0"))


@range_checked
def add_angular_velocities(Rs: ArrayLike, ws: ArrayLike) -> FloatArray:
    """Add the angular velocities of a chain (7.43 to 7.50).

    Args:
        Rs: (..., n, 3, 3) orientations of frame i + 1 in frame i.
        ws: (..., n, 3) angular velocities of frame i + 1 relative to frame i, in frame i.

    Returns:
        (..., 3) angular velocity of frame n relative to frame 0, in frame 0.
    """
    Rs, ws = as_rotations(Rs, "Rs"), as_vectors(ws, "ws")
    if Rs.ndim < 3 or ws.ndim < 2 or Rs.shape[-3] != ws.shape[-2]:
        raise InputError(
            "Rs (..., n, 3, 3) and ws (..., n, 3) must have the same n",
            found=f"{Rs.shape} and {ws.shape}",
        )
    batch = np.broadcast_shapes(Rs.shape[:-3], ws.shape[:-2])
    total, R_0_i = np.zeros((*batch, 3)), np.broadcast_to(np.eye(3), (*batch, 3, 3))
    for i in range(ws.shape[-2]):
        total = total + (R_0_i @ ws[..., i, :, np.newaxis])[..., 0]
        R_0_i = R_0_i @ Rs[..., i, :, :]
    return total


#: Largest accepted deviation of a quaternion's norm from 1.
NORM_TOLERANCE = 1e-6


@np.errstate(over="ignore")  # After an overflow, the norm is inf.
def normalise_quaternions(value: ArrayLike, name: str = "quat") -> FloatArray:
    quat = as_vectors(value, name, 4)
    norms = np.sqrt((quat * quat).sum(axis=-1, keepdims=True))
    if (np.abs(norms - 1.0) > NORM_TOLERANCE).any():
        worst = norms.flat[np.abs(norms - 1.0).argmax()]
        raise InputError(f"{name} must be a unit quaternion", found=f"norm {worst:.9g}")
    normalised: FloatArray = quat / norms
    return normalised


def rotation_from_quaternion(quat: ArrayLike) -> FloatArray:
    """Return a unit quaternion's rotation.

    The rotation matrix is `(q0^2 - q.q) I + 2 q q^T + 2 q0 S(q)`.
    """
    rows = eq.rotation_of_quaternion(*np.moveaxis(normalise_quaternions(quat), -1, 0))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(R: ArrayLike) -> FloatArray:
    """Return the unit quaternion with qw >= 0.

    Shepperd's method avoids cancellation.
    """
    R = as_rotations(R, "R")
    # Each row of K = 4 q q^T is a multiple of q.
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


def multiply_quaternions(left: ArrayLike, right: ArrayLike) -> FloatArray:
    """Multiply two quaternions of any length.

    The product's rotation is `R(left) R(right)`.
    """
    left, right = as_vectors(left, "left", 4), as_vectors(right, "right", 4)
    p, p0, q, q0 = left[..., :3], left[..., 3:], right[..., :3], right[..., 3:]
    scalar = p0 * q0 - (p * q).sum(axis=-1, keepdims=True)
    return np.concatenate((p0 * q + q0 * p + np.cross(p, q), scalar), axis=-1)


def conjugate_quaternion(quat: ArrayLike) -> FloatArray:
    """Return the conjugate (-q, q0) of a quaternion of any length."""
    conjugated: FloatArray = as_vectors(quat, "quat", 4) * np.array([-1.0, -1.0, -1.0, 1.0])
    return conjugated


ExpressedIn = Literal["fixed", "body"]


def quaternion_rate_matrix(quat: ArrayLike, frame: ExpressedIn = "fixed") -> FloatArray:
    """Return E in (q-dot, q0-dot) = E w (7.57).

    For the fixed frame, E is `1/2 [q0 I - S(q); -q^T]`. For the body frame, E is `1/2 [q0 I + S(q); -q^T]`.
    In both cases, `E^T E = I/4` and `E^T (q, q0) = 0`.
    """
    if as_str(frame, "frame") not in ("fixed", "body"):
        raise InputError("frame must be 'fixed' or 'body'", found=repr(frame))
    quat = normalise_quaternions(quat)
    q, q0 = quat[..., :3], quat[..., 3]
    turn = -skew(q) if frame == "fixed" else skew(q)
    top = turn + q0[..., np.newaxis, np.newaxis] * np.eye(3)
    return 0.5 * np.concatenate((top, -q[..., np.newaxis, :]), axis=-2)


def quaternion_rates(quat: ArrayLike, w: ArrayLike, frame: ExpressedIn = "fixed") -> FloatArray:
    """Return (q-dot, q0-dot) = E w (7.57)."""
    return (quaternion_rate_matrix(quat, frame) @ as_vectors(w, "w")[..., np.newaxis])[..., 0]


@range_checked
def angular_velocity_from_quaternion_rates(
    quat: ArrayLike, rates: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """Return w = 4 E^T (q-dot, q0-dot) (7.57).

    Rates parallel to the quaternion give w = 0.
    """
    E = quaternion_rate_matrix(quat, frame)
    return 4.0 * (E.swapaxes(-1, -2) @ as_vectors(rates, "rates", 4)[..., np.newaxis])[..., 0]


@range_checked
def integrate_orientation(
    w: Callable[[float], ArrayLike], quat: ArrayLike, times: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """Return the quaternions (n, ..., 4) at n times, by the fourth-order Runge-Kutta method for 7.57.

    `quat` is the orientation at the first time. The `times` (s) increase. `w(t)` is the angular velocity
    (rad/s), expressed in `frame`. Each jump of `w` must be at one of the `times`. The steps evaluate `w` only
    between the `times`.
    """
    if not callable(w):
        raise InputError("w must be a function of the time", found=safe_repr(w))
    times = as_finite(times, "times")
    if times.ndim != 1 or (np.diff(times) <= 0.0).any():
        found = f"shape {times.shape}"
        if times.ndim == 1:
            k = int(np.argmax(np.diff(times) <= 0.0))
            found = f"{times[k]:g}, then {times[k + 1]:g}"
        raise InputError("times must be a one-dimensional array of increasing numbers", found=found)
    quats = [normalise_quaternions(quat)]
    for start, end in pairwise(times.tolist()):
        quats.append(_step(w, quats[-1], start, end, frame))
    return np.stack(quats)


def _step(
    w: Callable[[float], ArrayLike], quat: FloatArray, start: float, end: float, frame: ExpressedIn
) -> FloatArray:
    step = end - start
    first, middle, last = (
        as_vectors(w(t), "w")
        for t in (np.nextafter(start, end), (start + end) / 2.0, np.nextafter(end, start))
    )
    k1 = _rates(quat, first, frame)
    k2 = _rates(quat + step / 2.0 * k1, middle, frame)
    k3 = _rates(quat + step / 2.0 * k2, middle, frame)
    k4 = _rates(quat + step * k3, last, frame)
    stepped = quat + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    normalised: FloatArray = stepped / check_range(np.sqrt((stepped * stepped).sum(axis=-1, keepdims=True)))
    return normalised


def _rates(quat: FloatArray, w: FloatArray, frame: ExpressedIn) -> FloatArray:
    """Return the time derivative (7.57) of a quaternion of any length except 0."""
    length = check_range(np.sqrt((quat * quat).sum(axis=-1, keepdims=True)))
    rates: FloatArray = length * quaternion_rates(quat / length, w, frame)
    return rates


def rotation_about(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return Rodrigues' rotation (7.28).

    The rotation matrix is `I cos(phi) + k k^T (1 - cos(phi)) + S(k) sin(phi)`.
    """
    axis = as_unit_vectors(axis, "axis")
    angle = as_finite(angle, "angle")[..., np.newaxis, np.newaxis]
    # This formula of 1 - cos(phi) has no cancellation for small phi.
    versine = 2.0 * np.sin(angle / 2.0) ** 2
    outer = axis[..., :, np.newaxis] * axis[..., np.newaxis, :]
    return np.eye(3) * np.cos(angle) + outer * versine + skew(axis) * np.sin(angle)


def rotation_about_derivative(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Return dR_k(phi)/dphi = S(k) R_k(phi) (7.29, 7.33)."""
    return skew(axis) @ rotation_about(axis, angle)


def angular_velocity_about(axis: ArrayLike, rate: ArrayLike) -> FloatArray:
    """Return w = phi-dot k (7.12, 7.34)."""
    return as_finite(rate, "rate")[..., np.newaxis] * as_unit_vectors(axis, "axis")


@range_checked
def circular_velocity(axis: ArrayLike, rate: ArrayLike, p: ArrayLike) -> FloatArray:
    """Return the velocity of a point p that rotates about the axis k (7.21).

    The velocity is `phi-dot k x p`.
    """
    return np.cross(angular_velocity_about(axis, rate), as_vectors(p, "p"))


@range_checked
def split_along(axis: ArrayLike, p: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the parts of p parallel and perpendicular to k (7.18)."""
    axis, p = as_unit_vectors(axis, "axis"), as_vectors(p, "p")
    along = axis * (axis * p).sum(axis=-1, keepdims=True)
    return along, p - along


def exp_rotation(rotation_vector: ArrayLike) -> FloatArray:
    """Return the rotation matrix of a rotation vector.

    If the square of the angle is too large for double precision, the function raises RangeError.
    """
    vector = as_vectors(rotation_vector, "rotation_vector")
    with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
        angle = np.sqrt((vector * vector).sum(axis=-1))[..., np.newaxis, np.newaxis]
        S = skew(vector)
        # np.sinc(x) is sin(pi x) / (pi x), and 1 for x = 0.
        half = np.sinc(angle / (2.0 * np.pi))
        R: FloatArray = np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * half**2 * (S @ S)
    return check_range(R)


def log_rotation(R: ArrayLike) -> FloatArray:
    """Return the rotation vector phi k.

    The angle is in [0, pi]. If the angle is pi, the sign of k is arbitrary.
    """
    quat = quaternion_of(R)
    vector, scalar = quat[..., :3], quat[..., 3:]
    sine = np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, scalar)
    # The squares of components below 1e-150 may underflow. If |vector| < 1e-150, the result is 2 * vector.
    small = sine < 1e-150
    return np.where(small, 2.0 * vector, vector * (angle / np.where(small, 1.0, sine)))


def axis_angle_of(R: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the axis and the angle.

    The angle is in [0, pi]. The identity has the axis z.
    """
    quat = quaternion_of(R)
    vector, scalar = quat[..., :3], quat[..., 3]
    sine = np.sqrt((vector * vector).sum(axis=-1))
    identity = (sine == 0.0)[..., np.newaxis]
    axis = np.where(identity, [0.0, 0.0, 1.0], vector / np.where(identity, 1.0, sine[..., np.newaxis]))
    return axis, 2.0 * np.arctan2(sine, scalar)


_AXIS_LETTERS = "xyz"
_TRIPLES = [a + b + c for a in _AXIS_LETTERS for b in _AXIS_LETTERS for c in _AXIS_LETTERS if a != b != c]
#: The first twelve sequences have moving axes. The last twelve have fixed axes.
EULER_SEQUENCES = (*(triple.upper() for triple in _TRIPLES), *_TRIPLES)


@dataclass(frozen=True, slots=True)
class EulerSequence:
    """The axes of an Euler sequence.

    | field | meaning |
    |---|---|
    | `first`, `second`, `third` | axes that turn with the body: 0 is x, 1 is y, 2 is z |
    | `other` | neither the first nor the second axis |
    | `sign` | +1 if (first, second, other) is right-handed, else -1 |
    | `is_fixed` | the letters of `name` are fixed axes, in the order third, second, first |
    """

    name: str
    first: int
    second: int
    third: int
    other: int
    sign: float
    is_fixed: bool

    @property
    def is_proper(self) -> bool:
        return self.first == self.third

    def reorder(self, values: FloatArray) -> FloatArray:
        """Convert the last axis between the order of `name` and the order first, second, third."""
        return values[..., ::-1] if self.is_fixed else values


def find_sequence(name: str) -> EulerSequence:
    if as_str(name, "an Euler sequence") not in EULER_SEQUENCES:
        raise UnknownNameError("Euler sequence", name, EULER_SEQUENCES)
    return _make_sequence(name)


@cache
def _make_sequence(name: str) -> EulerSequence:
    is_fixed = name.islower()
    letters = name.lower()[::-1] if is_fixed else name.lower()
    first, second, third = (_AXIS_LETTERS.index(letter) for letter in letters)
    other = 3 - first - second
    sign = 1.0 if (second - first) % 3 == 1 else -1.0
    return EulerSequence(name, first, second, third, other, sign, is_fixed)


def coordinate_rotation(axis: int, angle: FloatArray) -> FloatArray:
    """Return Rx, Ry or Rz for the axis 0, 1 or 2. The constant entries are exactly 0 and 1."""
    angle = np.asarray(angle)
    R = np.zeros((*angle.shape, 3, 3))
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., j, j] = R[..., k, k] = np.cos(angle)
    R[..., k, j] = np.sin(angle)
    R[..., j, k] = -R[..., k, j]
    return R


def rotation_from_euler(name: str, angles: ArrayLike) -> FloatArray:
    """Return the rotation of Euler angles.

    For "ZYZ", the rotation is `Rz(phi) Ry(theta) Rz(psi)`.
    """
    axes = find_sequence(name)
    turns = axes.reorder(as_vectors(angles, "angles"))
    product: FloatArray = (
        coordinate_rotation(axes.first, turns[..., 0])
        @ coordinate_rotation(axes.second, turns[..., 1])
        @ coordinate_rotation(axes.third, turns[..., 2])
    )
    return product


def euler_of(name: str, R: ArrayLike) -> FloatArray:
    """Return the Euler angles of a rotation.

    | sequence | middle angle |
    |---|---|
    | proper, such as ZYZ | [0, pi] |
    | other | [-pi/2, pi/2] |

    At the singularity, only the sum or difference of the first and third angle is determined. For moving
    axes, the first angle is arbitrary, and the third angle follows from the first angle. For fixed axes, the
    third angle is arbitrary, and the first angle follows from the third angle. For exact entries of R, the
    arbitrary angle is 0.
    """
    axes = find_sequence(name)
    R = as_rotations(R, "R") + 0.0  # Adding 0 turns -0 into 0; arctan2(0, -0) is pi.
    i, j, m, sign = axes.first, axes.second, axes.other, axes.sign
    if axes.is_proper:
        first = np.arctan2(R[..., j, i], -sign * R[..., m, i] + 0.0)
        second = np.arctan2(np.hypot(R[..., j, i], R[..., m, i]), R[..., i, i])
    else:
        first = np.arctan2(-sign * R[..., j, m], R[..., m, m])
        second = np.arctan2(sign * R[..., i, m], np.hypot(R[..., j, m], R[..., m, m]))
    # F, S and T are rotations about the three axes. R = F S T, so F^T R = S T. S is a rotation about axis
    # `j`. Therefore, row `j` of S T is row `j` of T.
    cosine, sine = np.cos(first), np.sin(first)
    row = cosine[..., np.newaxis] * R[..., j, :] + (sign * sine)[..., np.newaxis] * R[..., m, :]
    # Only the entries `j` and `rest` of this row can be nonzero.
    rest, sense = (m, sign) if axes.is_proper else (i, -sign)
    third = np.arctan2(-sense * row[..., rest], row[..., j])
    return axes.reorder(np.stack((first, second, third), axis=-1)).copy()


def rotation_from_rpy(rpy: ArrayLike) -> FloatArray:
    """Return R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return rotation_from_euler("xyz", rpy)


def rpy_of(R: ArrayLike) -> FloatArray:
    """Return roll, pitch and yaw.

    The yaw is 0 if R[0, 0] = R[1, 0] = 0.
    """
    return euler_of("xyz", R)


#: At this distance (rad) or less from the singularity, Euler angle rates have too few correct digits.
MIN_SINGULARITY_DISTANCE = 1e-9


def euler_rate_matrix(name: str, angles: ArrayLike) -> FloatArray:
    """Return Omega in w = Omega (phi-dot, theta-dot, psi-dot) (7.51 to 7.55).

    The columns of Omega are the three rotation axes in frame 0.
    """
    axes = find_sequence(name)
    turns = axes.reorder(as_vectors(angles, "angles"))
    R_0_1 = coordinate_rotation(axes.first, turns[..., 0])
    R_0_2 = R_0_1 @ coordinate_rotation(axes.second, turns[..., 1])
    first = np.broadcast_to(np.eye(3)[axes.first], R_0_1.shape[:-1])
    columns = np.stack((first, R_0_1[..., axes.second], R_0_2[..., axes.third]), axis=-1)
    return axes.reorder(columns).copy()


@range_checked
def angular_velocity_from_euler_rates(name: str, angles: ArrayLike, rates: ArrayLike) -> FloatArray:
    """Return w = Omega (phi-dot, theta-dot, psi-dot) (7.54)."""
    product = euler_rate_matrix(name, angles) @ as_vectors(rates, "rates")[..., np.newaxis]
    return product[..., 0]


@range_checked
def euler_rates(
    name: str, angles: ArrayLike, w: ArrayLike, nearest: float = MIN_SINGULARITY_DISTANCE
) -> FloatArray:
    """Return the Euler angle rates Omega^-1 w (7.56)."""
    return (euler_rate_inverse(name, angles, nearest) @ as_vectors(w, "w")[..., np.newaxis])[..., 0]


def euler_rate_inverse(name: str, angles: ArrayLike, nearest: float = MIN_SINGULARITY_DISTANCE) -> FloatArray:
    """Return Omega^-1 in closed form (7.56).

    F is the rotation by the first angle, and w' = F^T w. In the axes after F, the third rotation axis is
    `along e_first + across e_other`. The rates r_1, r_2 and r_3 of the three angles satisfy:

    `w' = r_1 e_first + r_2 e_second + r_3 (along e_first + across e_other)`

    The three components of this equation give the rates:

        r_3 = w'_other / across
        r_2 = w'_second
        r_1 = w'_first - along r_3
    """
    angles = as_vectors(angles, "angles")
    _refuse_singular(name, angles, nearest)
    axes = find_sequence(name)
    turns = axes.reorder(angles)
    cosine, sine = np.cos(turns[..., 1]), np.sin(turns[..., 1])
    if axes.is_proper:
        along, across = cosine, -axes.sign * sine
    else:
        along, across = axes.sign * sine, cosine
    inverse = np.zeros((*angles.shape[:-1], 3, 3))
    inverse[..., 2, axes.other] = 1.0 / across
    inverse[..., 1, axes.second] = 1.0
    inverse[..., 0, axes.first] = 1.0
    inverse[..., 0, axes.other] = -along / across
    inverse = inverse @ coordinate_rotation(axes.first, turns[..., 0]).swapaxes(-1, -2)
    return inverse[..., ::-1, :].copy() if axes.is_fixed else inverse


def singularity_distance(name: str, angles: ArrayLike) -> FloatArray:
    """Return the middle angle's distance from the singularity.

    | sequence | singular middle angles |
    |---|---|
    | proper, such as ZYZ | multiples of pi; the textbook mentions only 0 |
    | other | odd multiples of pi/2 |

    The distance is in [0, pi/2], rad.
    """
    middle = as_vectors(angles, "angles")[..., 1]
    sine, cosine = np.abs(np.sin(middle)), np.abs(np.cos(middle))
    return np.arctan2(sine, cosine) if find_sequence(name).is_proper else np.arctan2(cosine, sine)


def euler_condition(name: str, angles: ArrayLike) -> FloatArray:
    """Return the condition number of Omega, cot(d / 2).

    The angle d is the angle between the lines of the first and the third rotation axis, from 0 to pi/2. The
    second axis is perpendicular to both. Therefore, Omega has these singular values:

    `1, sqrt(1 + cos d), sqrt(1 - cos d)`

    At the singularity, d is 0, and the function raises RepresentationSingularityError.
    """
    angles = as_vectors(angles, "angles")
    _refuse_singular(name, angles, 0.0)
    return 1.0 / np.tan(singularity_distance(name, angles) / 2.0)


def _refuse_singular(name: str, angles: FloatArray, nearest: float) -> None:
    distance, nearest = singularity_distance(name, angles), as_finite_float(nearest, "nearest")
    if distance.size and distance.min() <= nearest:
        sample = np.unravel_index(distance.argmin(), distance.shape)
        raise RepresentationSingularityError(name, float(distance.min()), tuple(int(i) for i in sample))
