"""Compute the motion of planar links, moving points and frames, joints and tools, and analytical Jacobians.

The module computes equations of the sections 7.1 and 7.3 to 7.6 of the textbook.

| Argument | Shape | Meaning |
|---|---|---|
| `p_1`, `v_1`, `a_1` | (..., 3) | position, velocity and acceleration of a point in frame 1 |
| `z` | (..., 3) | a joint's unit axis z_{i-1}, in frame 0 |
| `theta`, `rate` | (...) | a joint's angle in rad; the joint's velocity in rad/s or m/s |
| `turns` | | True for a rotary joint, False for a prismatic joint |
| `velocity` | (..., 6) | [linear; angular] velocity of a frame, in frame 0 |
| `R` | (..., 3, 3) | orientation of the end frame in frame 0 |
| `representation` | | SciPy's name of an Euler sequence, or "quaternion" |
| `nearest` | | least allowed distance from the singularity of Euler angles, rad |

Results are relative to frame 0 and expressed in frame 0. Arguments and results have any leading batch shape.
Six-vectors are [linear; angular]. Units are metres, radians and seconds.

There are two Jacobians, which are often confused. The velocity Jacobian J_v (..., 6, n) converts joint
velocities to the end frame's velocity [linear; angular]. The vector x contains the end frame's position and
orientation. The manipulator Jacobian J converts joint velocities to the time derivative of x. Another name
for J is analytical Jacobian.

| Orientation in x | Numbers in x | J |
|---|---|---|
| three Euler angles in any sequence; the textbook uses "ZYZ" | 6 | (..., 6, n) |
| unit quaternion ("quaternion", scalar last) | 7 | (..., 7, n) |

| Argument | InputError for |
|---|---|
| any `ArrayLike` | a wrong shape, or a value that is not finite |
| axis | a length other than 1 |
| rotation matrix | a matrix that is not a rotation |

Functions raise RangeError if a result leaves the range of double precision.
An unknown `representation` raises UnknownNameError. Functions with the argument `nearest` raise
RepresentationSingularityError within this distance of the singularity of Euler angles.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.errors.validators import as_bool, as_str, safe_repr
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
from urdfkin.kinematics.rotation import (
    MIN_SINGULARITY_DISTANCE,
    euler_of,
    euler_rate_inverse,
    euler_rate_matrix,
    quaternion_of,
    quaternion_rate_matrix,
)


@dataclass(frozen=True, slots=True, eq=False)
class MovingFrame:
    """Pose, velocity and acceleration of frame 1 relative to frame 0, in the axes of frame 0.

    Attributes:
        d_0_1: Vector from O_0 to O_1.
        v_0_1: First derivative of `d_0_1`.
        a_0_1: Second derivative of `d_0_1`.
    """

    R_0_1: FloatArray
    d_0_1: FloatArray
    w_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    v_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    alpha_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))
    a_0_1: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for entry in fields(self):
            check = as_rotations if entry.name == "R_0_1" else as_vectors
            array = np.array(check(getattr(self, entry.name), entry.name), order="C")
            array.setflags(write=False)
            object.__setattr__(self, entry.name, array)


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def compose(outer: MovingFrame, inner: MovingFrame) -> MovingFrame:
    """Return the motion of frame 2 relative to frame 0 (7.60, 7.61).

    `inner` is the motion of frame 2 relative to frame 1, in frame 1.

    | quantity | equation |
    |---|---|
    | position, velocity, acceleration | 7.58, 7.124, 7.125: O_2 moves in frame 1 |
    | angular velocity | 7.49: w_01 + w_12 |
    | angular acceleration | derivative of 7.49, with the term w_01 x w_12 |
    """
    for frame in (outer, inner):
        if not isinstance(frame, MovingFrame):
            raise InputError("a moving frame must be a MovingFrame", found=safe_repr(frame))
    R, w = outer.R_0_1, outer.w_0_1
    d_12, v_12, a_12 = (eq.rotate(R, x) for x in (inner.d_0_1, inner.v_0_1, inner.a_0_1))
    w_12, alpha_12 = eq.rotate(R, inner.w_0_1), eq.rotate(R, inner.alpha_0_1)
    composed = (
        R @ inner.R_0_1,
        outer.d_0_1 + d_12,
        w + w_12,
        eq.moving_point_velocity(outer.v_0_1, w, d_12, v_12),
        eq.free_angular_acceleration(outer.alpha_0_1, w, w_12, alpha_12),
        eq.moving_point_acceleration(outer.a_0_1, outer.alpha_0_1, w, d_12, v_12, a_12),
    )
    return MovingFrame(*map(check_range, composed))


def compose_all(frames: Iterable[MovingFrame]) -> MovingFrame:
    """Return the motion of the last frame relative to frame 0 (7.50, 7.61).

    Entry i is the motion of frame i + 1 relative to frame i.
    """
    if not isinstance(frames, Iterable):
        raise InputError("compose_all needs a list of MovingFrames", found=safe_repr(frames))
    return reduce(compose, frames, MovingFrame(np.eye(3), np.zeros(3)))


def relative_pose(T_0_1: FloatArray, T_0_2: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Return T_1_2 = T_0_1^-1 T_0_2."""
    T = np.empty(np.broadcast_shapes(T_0_1.shape, T_0_2.shape)) if out is None else out
    back = T_0_1[..., :3, :3].swapaxes(-1, -2)
    T[..., :3, :3] = back @ T_0_2[..., :3, :3]
    T[..., :3, 3] = eq.rotate(back, T_0_2[..., :3, 3] - T_0_1[..., :3, 3])
    T[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return T


_ZERO = (0.0, 0.0, 0.0)


@range_checked
def _sum_parts(*parts: FloatArray) -> FloatArray:
    return reduce(np.add, parts)


@dataclass(frozen=True, slots=True, eq=False)
class VelocityParts:
    """The three terms w x p, R v_1 and d-dot of a point's velocity (7.124), in m/s."""

    rotation: FloatArray
    relative: FloatArray
    origin: FloatArray

    @property
    def total(self) -> FloatArray:
        return _sum_parts(self.rotation, self.relative, self.origin)


@dataclass(frozen=True, slots=True, eq=False)
class AccelerationParts:
    """The terms of a point's acceleration (7.125), in m/s^2."""

    transverse: FloatArray
    centripetal: FloatArray
    coriolis: FloatArray
    relative: FloatArray
    origin: FloatArray

    @property
    def total(self) -> FloatArray:
        return _sum_parts(self.transverse, self.centripetal, self.coriolis, self.relative, self.origin)


@range_checked
def point_position(frame: MovingFrame, p_1: ArrayLike) -> FloatArray:
    """Return p_0 = d_01 + R p_1 (7.58)."""
    p_0: FloatArray = eq.point_position(frame.d_0_1, frame.R_0_1, as_vectors(p_1, "p_1"))
    return p_0


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def point_velocity(frame: MovingFrame, p_1: ArrayLike, v_1: ArrayLike = _ZERO) -> VelocityParts:
    """Return the terms of a point's velocity (7.124; 7.59 if v_1 = 0).

    The velocity is `w x R p_1 + R v_1 + d-dot_01`.
    """
    p_0 = eq.rotate(frame.R_0_1, as_vectors(p_1, "p_1"))
    rotation = eq.tangential(frame.w_0_1, p_0)
    relative = eq.rotate(frame.R_0_1, as_vectors(v_1, "v_1"))
    return VelocityParts(*map(check_range, np.broadcast_arrays(rotation, relative, frame.v_0_1)))


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def point_acceleration(
    frame: MovingFrame, p_1: ArrayLike, v_1: ArrayLike = _ZERO, a_1: ArrayLike = _ZERO
) -> AccelerationParts:
    """Return the terms of a point's acceleration (7.125; 7.123 if v_1 = a_1 = 0).

    With p = R p_1, the acceleration is:

    `alpha x p + w x (w x p) + 2 w x R v_1 + R a_1 + d-dot-dot`
    """
    p_0 = eq.rotate(frame.R_0_1, as_vectors(p_1, "p_1"))
    v_0 = eq.rotate(frame.R_0_1, as_vectors(v_1, "v_1"))
    a_0 = eq.rotate(frame.R_0_1, as_vectors(a_1, "a_1"))
    transverse = eq.transverse(frame.alpha_0_1, p_0)
    centripetal, coriolis = eq.centripetal(frame.w_0_1, p_0), eq.coriolis(frame.w_0_1, v_0)
    parts = np.broadcast_arrays(transverse, centripetal, coriolis, a_0, frame.a_0_1)
    return AccelerationParts(*map(check_range, parts))


@range_checked
def interorigin_vector(d: ArrayLike, z: ArrayLike, a: ArrayLike, x: ArrayLike) -> FloatArray:
    """Return d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64)."""
    vector: FloatArray = eq.interorigin_vector(
        as_finite(d, "d"), as_unit_vectors(z, "z"), as_finite(a, "a"), as_unit_vectors(x, "x")
    )
    return vector


def joint_angular_velocity(z: ArrayLike, rate: ArrayLike, turns: bool) -> FloatArray:
    """Return theta-dot z (7.62), or 0 for a prismatic joint (7.63)."""
    w: FloatArray = as_finite(rate, "rate")[..., np.newaxis] * as_unit_vectors(z, "z")
    return w if as_bool(turns, "turns") else np.zeros_like(w)


@range_checked
def interorigin_velocity(
    w_0_i: ArrayLike, d_vector: ArrayLike, z: ArrayLike, rate: ArrayLike, turns: bool
) -> FloatArray:
    """Return the derivative of d_{i-1,i} (7.73, 7.74).

    | joint | derivative |
    |---|---|
    | rotary | w_0i x d_{i-1,i} (7.73) |
    | prismatic | w_0i x d_{i-1,i} + d-dot_i z (7.74) |
    | rotary, only joint i moves | w_{i-1,i} x d_{i-1,i} (7.66) |
    | prismatic, only joint i moves | w_{i-1,i} x d_{i-1,i} + d-dot_i z (7.67) |
    """
    rotation: FloatArray = eq.tangential(as_vectors(w_0_i, "w_0_i"), as_vectors(d_vector, "d_vector"))
    sliding: FloatArray = as_finite(rate, "rate")[..., np.newaxis] * as_unit_vectors(z, "z")
    return rotation if as_bool(turns, "turns") else rotation + sliding


@range_checked
def jacobian_column(z: ArrayLike, arm: ArrayLike, turns: bool) -> FloatArray:
    """Return a column of the velocity Jacobian (7.80, 7.85).

    | joint | column |
    |---|---|
    | rotary | [z x arm; z] |
    | prismatic | [z; 0] |

    The arm d_{i-1,n} leads from the joint's origin to the endpoint.
    """
    z, arm = np.broadcast_arrays(as_unit_vectors(z, "z"), as_vectors(arm, "arm"))
    linear, angular = eq.turning_column(z, arm) if as_bool(turns, "turns") else (z, np.zeros_like(z))
    return np.concatenate((linear, angular), axis=-1)


def planar_rotation(theta: ArrayLike) -> FloatArray:
    """Return the planar rotation R(theta) (7.5).

    The columns are x1 and y1 in frame 0.
    """
    theta = as_finite(theta, "theta")
    c, s = np.cos(theta), np.sin(theta)
    return np.stack((np.stack((c, -s), axis=-1), np.stack((s, c), axis=-1)), axis=-2)


def planar_rotation_derivative(theta: ArrayLike) -> FloatArray:
    """Return dR/dtheta in the plane (7.4, figure 7.2)."""
    R = planar_rotation(theta)
    return np.stack((R[..., 1], -R[..., 0]), axis=-1)


def link_endpoint(theta: ArrayLike, length: ArrayLike) -> FloatArray:
    """Return the endpoint d_01 = a x1 (7.1, 7.3)."""
    return as_finite(length, "length")[..., np.newaxis] * planar_rotation(theta)[..., 0]


@range_checked
def link_endpoint_velocity(theta: ArrayLike, rate: ArrayLike, length: ArrayLike) -> FloatArray:
    """Return d-dot_01 = a theta-dot y1 (7.2, 7.4, 7.7)."""
    speed = as_finite(length, "length") * as_finite(rate, "rate")
    return speed[..., np.newaxis] * planar_rotation_derivative(theta)[..., 0]


@range_checked
def tool_velocity(velocity: ArrayLike, d_n_tool: ArrayLike) -> FloatArray:
    """Convert the velocity of frame n to the velocity of the tool.

    In frame 0, the linear velocity of the tool is `d-dot_0n + w x d_{n,tool}`.
    """
    velocity, d = as_vectors(velocity, "velocity", 6), as_vectors(d_n_tool, "d_n_tool")
    linear, w = velocity[..., :3], velocity[..., 3:]
    moved = eq.point_velocity(linear, w, d)
    return np.concatenate(np.broadcast_arrays(moved, w), axis=-1)


def frame_velocity(velocity: ArrayLike, d_n_tool: ArrayLike) -> FloatArray:
    """Convert the tool's velocity to the velocity of frame n (7.115)."""
    return tool_velocity(velocity, -as_vectors(d_n_tool, "d_n_tool"))


QUATERNION = "quaternion"


def orientation_of(representation: str, R: ArrayLike) -> FloatArray:
    return (
        quaternion_of(R)
        if as_str(representation, "representation") == QUATERNION
        else euler_of(representation, R)
    )


def pose_rate_matrix(representation: str, R: ArrayLike) -> FloatArray:
    """Return C = diag(I, Omega) in [d-dot; w] = C x-dot (7.119, 7.120).

    For a quaternion, Omega is 4 E^T, with E of 7.57.
    """
    if as_str(representation, "representation") == QUATERNION:
        return _block_diagonal(4.0 * quaternion_rate_matrix(quaternion_of(R)).swapaxes(-1, -2))
    return _block_diagonal(euler_rate_matrix(representation, euler_of(representation, R)))


def pose_rate_inverse(
    representation: str, R: ArrayLike, nearest: float = MIN_SINGULARITY_DISTANCE
) -> FloatArray:
    """Return C^-1 in x-dot = C^-1 [d-dot; w] (7.122).

    For a quaternion, C (6, 7) has several right inverses (`C C^-1 = I`). The function returns the inverse
    that gives rates perpendicular to the quaternion.
    """
    if as_str(representation, "representation") == QUATERNION:
        return _block_diagonal(quaternion_rate_matrix(quaternion_of(R)))
    return _block_diagonal(euler_rate_inverse(representation, euler_of(representation, R), nearest))


@range_checked
def analytical_jacobian(
    representation: str, R: ArrayLike, J_v: ArrayLike, nearest: float = MIN_SINGULARITY_DISTANCE
) -> FloatArray:
    """Return the manipulator Jacobian J = C^-1 J_v (7.122)."""
    return pose_rate_inverse(representation, R, nearest) @ _as_matrices_with_rows(J_v, "J_v", 6)


@range_checked
def velocity_jacobian(representation: str, R: ArrayLike, J: ArrayLike) -> FloatArray:
    """Return the velocity Jacobian J_v = C J (7.121)."""
    C = pose_rate_matrix(representation, R)
    return C @ _as_matrices_with_rows(J, "J", C.shape[-1])


@range_checked
def pose_rates(
    representation: str, R: ArrayLike, velocity: ArrayLike, nearest: float = MIN_SINGULARITY_DISTANCE
) -> FloatArray:
    """Return x-dot = C^-1 [d-dot; w]."""
    column = as_vectors(velocity, "velocity", 6)[..., np.newaxis]
    return (pose_rate_inverse(representation, R, nearest) @ column)[..., 0]


@range_checked
def velocity_of_pose_rates(representation: str, R: ArrayLike, rates: ArrayLike) -> FloatArray:
    """Return [d-dot; w] = C x-dot (7.119)."""
    C = pose_rate_matrix(representation, R)
    column = as_vectors(rates, "rates", C.shape[-1])[..., np.newaxis]
    return (C @ column)[..., 0]


def _block_diagonal(lower: FloatArray) -> FloatArray:
    rows, columns = lower.shape[-2:]
    C = np.zeros((*lower.shape[:-2], 3 + rows, 3 + columns))
    C[..., :3, :3] = np.eye(3)
    C[..., 3:, 3:] = lower
    return C


def _as_matrices_with_rows(value: ArrayLike, name: str, rows: int) -> FloatArray:
    array = as_finite(value, name)
    columns = array.shape[-1] if array.ndim else 0
    return as_matrices(array, name, rows, columns)
