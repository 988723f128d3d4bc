"""Compute the transform between two consecutive joint axes.

The z axis of each joint frame is the joint's axis. A is the constant pose of the second joint's frame in the
first joint's frame. `find_axis_transform` writes A as a product:

    A = Rz(phi) Tz(delta) . Tx(a) Rx(alpha) Ry(beta) . Rz(phi_next) Tz(delta_next)

Rz(phi) Tz(delta) commutes with the motion of the first joint. The first joint's row therefore contains phi in
theta, and delta in d. Likewise, the second joint's row contains phi_next in theta, and delta_next in d.

If skew axes are not nearly parallel, beta is 0, and the x axis has two possible directions. For each
direction, the six other numbers are unique (Denavit and Hartenberg). The page docs/dh.md explains parallel
and nearly parallel axes.

Parallel axes determine only the sum of their offsets d. Coinciding axes determine only the sum of their
angles theta. `match_axis_transforms` copies these cells from a reference table, except one cell that is
computed from the sum. In a Hayati row, any d is possible, because the axes do not determine d.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.table import DHRow, DHTable, angle_difference, clean_angle, link_transform
from urdfkin.errors import RangeError
from urdfkin.kinematics.roundings import (
    ANGLE_ROUNDINGS,
    AXIS_ROUNDINGS,
    CONSTANT_POSE_ROUNDINGS,
    EPS,
    FILE_ANGLE_ROUNDINGS,
    LENGTH_ROUNDINGS,
    SNAPPED_LENGTH_ROUNDINGS,
)
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, Joint

#: Two axes with a smaller tilt (rad) count as nearly parallel. At this tilt, an error of 1 mm in the URDF can
#: move the common normal by 100 mm.
NEARLY_PARALLEL = 1e-2

#: Two axes get a Hayati row only if the sine of their tilt is below this number.
MAX_HAYATI_TILT_SINE = 0.35


@dataclass(frozen=True, slots=True)
class AxisTransform:
    """Numbers of the transform A between two joint axes (m, rad).

    `phi_is_free`: the axes do not determine phi.
    """

    phi: float = 0.0
    delta: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    phi_next: float = 0.0
    delta_next: float = 0.0
    phi_is_free: bool = False

    def with_reversed_x(self) -> AxisTransform:
        return AxisTransform(
            phi=self.phi + math.pi,
            delta=self.delta,
            a=-self.a,
            alpha=math.pi if self.alpha == math.pi else -self.alpha,
            beta=-self.beta,
            phi_next=self.phi_next - math.pi,
            delta_next=self.delta_next,
        )


def shift_along_z(A: FloatArray, distance: float) -> FloatArray:
    shifted = A.copy()
    shifted[2, 3] += distance
    return shifted


def find_axis_transform(
    A: FloatArray,
    reach: float,
    default_phi: float = 0.0,
    *,
    hayati: bool,
    offset_in_delta: bool = False,
    noise: PoseTolerance | None = None,
) -> AxisTransform:
    """Factor the transform A between two axes.

    `reach` is the length of the path (m). Tilts and lengths up to `noise` become zero. `default_phi` is used
    if the axes do not determine phi. For parallel axes, `delta_next` contains the whole offset, unless
    `offset_in_delta` is true.
    """
    noise = noise or pose_tolerance(1, 0.0, reach)
    sine = tilt_sine(A)
    if sine <= noise.radians:
        return _find_parallel_transform(A, reach, noise, default_phi, offset_in_delta)
    step = _find_normal_transform(A, sine, reach, noise)
    is_far = max(abs(step.delta), abs(step.delta_next)) > reach
    is_near_parallel = sine < NEARLY_PARALLEL or (sine < MAX_HAYATI_TILT_SINE and is_far)
    if hayati and is_near_parallel:
        return find_hayati_transform(A, reach, noise, default_phi)
    return step


def _find_normal_transform(A: FloatArray, sine: float, reach: float, noise: PoseTolerance) -> AxisTransform:
    phi = math.atan2(A[0, 2], -A[1, 2])
    along = math.cos(phi) * A[0, 3] + math.sin(phi) * A[1, 3]
    across = math.cos(phi) * A[1, 3] - math.sin(phi) * A[0, 3]
    delta_next = clean_length(-across / sine, reach, noise.metres)
    delta = clean_length(A[2, 3] - delta_next * A[2, 2], reach, noise.metres)
    a, alpha = clean_length(along, reach, noise.metres), clean_angle(math.atan2(sine, A[2, 2]))
    step = AxisTransform(phi, delta, a, alpha, 0.0, _phi_next(A, phi, alpha, 0.0), delta_next)
    return step.with_reversed_x() if a < 0.0 else step


def _find_parallel_transform(
    A: FloatArray, reach: float, noise: PoseTolerance, default_phi: float, offset_in_delta: bool
) -> AxisTransform:
    sign = math.copysign(1.0, A[2, 2])
    alpha = 0.0 if sign > 0.0 else math.pi
    offset = clean_length(A[2, 3], reach, noise.metres)
    delta, delta_next = (offset, 0.0) if offset_in_delta else (0.0, sign * offset)
    a = clean_length(math.hypot(A[0, 3], A[1, 3]), reach, noise.metres)
    phi = math.atan2(A[1, 3], A[0, 3]) if a else default_phi
    phi_next = _phi_next(A, phi, alpha, 0.0)
    return AxisTransform(phi, delta, a, alpha, 0.0, phi_next, delta_next, phi_is_free=not a)


def find_hayati_transform(
    A: FloatArray, reach: float, noise: PoseTolerance, default_phi: float
) -> AxisTransform:
    """Return a Hayati row's transform.

    The x axis points to the intersection of the next axis with the xy plane.
    """
    z = A[:3, 2]
    delta_next = clean_length(A[2, 3] / z[2], reach, noise.metres)
    across = A[:2, 3] - delta_next * z[:2]
    a = clean_length(math.hypot(across[0], across[1]), reach, noise.metres)
    phi = math.atan2(across[1], across[0]) if a else default_phi
    x = math.cos(phi) * z[0] + math.sin(phi) * z[1]
    y = math.cos(phi) * z[1] - math.sin(phi) * z[0]
    alpha = clean_angle(math.atan2(-y, z[2]))
    beta = clean_angle(math.atan2(x, math.hypot(y, z[2])))
    phi_next = _phi_next(A, phi, alpha, beta)
    return AxisTransform(phi, 0.0, a, alpha, beta, phi_next, delta_next, phi_is_free=not a)


def _phi_next(A: FloatArray, phi: float, alpha: float, beta: float) -> float:
    """Compute phi_next accurately for every tilt."""
    Rz = np.array([[math.cos(phi), -math.sin(phi), 0], [math.sin(phi), math.cos(phi), 0], [0, 0, 1.0]])
    M = (Rz @ link_transform(0.0, alpha, beta)[:3, :3]).T @ A[:3, :3]
    return math.atan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])


def clean_length(length: float, reach: float, noise: float = 0.0) -> float:
    """Remove rounding errors from a length.

    `reach` is the largest length in the computation (m).
    Lengths up to `noise` (m) become 0.

    >>> clean_length(-5e-17, 1.0), clean_length(0.07599999999999998, 1.0), clean_length(-5e-12, 1.0)
    (0.0, 0.076, -5e-12)
    """
    if abs(length) <= max(LENGTH_ROUNDINGS * EPS * reach, noise):
        return 0.0
    short = float(f"{length:.12g}")
    return short if abs(length - short) <= SNAPPED_LENGTH_ROUNDINGS * EPS * reach else float(length)


@dataclass(frozen=True, slots=True)
class PairWithReference:
    """Two consecutive joint axes, and the row of the first joint in the reference table.

    The argument `delta_in` of a method is the offset (m) from the first joint's DH frame to its joint frame,
    along the joint's axis.
    """

    A: FloatArray
    row: DHRow
    reach: float
    noise: PoseTolerance
    hayati: bool

    @property
    def is_prismatic(self) -> bool:
        return not self.row.kind.turns

    @property
    def offset_is_free(self) -> bool:
        """Whether the axes do not determine d, because they are parallel or the row is a Hayati row."""
        return tilt_sine(self.A) <= self.noise.radians or self._needs_hayati_row

    @property
    def _needs_hayati_row(self) -> bool:
        sine = tilt_sine(self.A)
        reference_is_strict = not self.row.beta and abs(math.sin(self.row.alpha)) >= NEARLY_PARALLEL
        return self.hayati and (
            sine < NEARLY_PARALLEL or (sine < MAX_HAYATI_TILT_SINE and not reference_is_strict)
        )

    @property
    def normal_offset(self) -> float:
        return find_axis_transform(self.A, self.reach, hayati=False, noise=self.noise).delta

    @property
    def hayati_offset(self) -> float | None:
        """Height z (m) of a Hayati row's x axis in this joint's frame.

        With this height, the cell a equals the reference.

            p: origin of the next joint's frame
            t: unit vector along the projection of the next axis onto the xy plane
            v: vector of length a along the row's x axis
            v . t = value in the reference
            offset = p_z + (v . t - p . t) cot(tilt)
            small tilt: v . t is inaccurate;  |v . t| = sqrt(a^2 - |v x t|^2),  v x t = p x t
        """
        across, along = -math.sin(self.row.alpha) * math.cos(self.row.beta), math.sin(self.row.beta)
        sine, reference_tilt = tilt_sine(self.A), math.hypot(along, across)
        if min(sine, reference_tilt) <= self.noise.radians:
            return None
        (x, y, z), p = self.A[:3, 2] / sine, self.A[:3, 3]
        a_along_tilt = self.row.a * along / reference_tilt
        a_across_tilt = p[0] * y - p[1] * x
        if sine * sine <= self.noise.radians and self.row.a**2 * sine < abs(a_along_tilt * a_across_tilt):
            square = self.row.a**2 - a_across_tilt**2
            a_along_tilt = math.copysign(math.sqrt(max(0.0, square)), a_along_tilt)
        offset = float(p[2] + (a_along_tilt - p[0] * x - p[1] * y) * z)
        return offset if abs(offset) <= self.reach else None

    def find_transform(self, delta_in: float, d: float, default_phi: float = 0.0) -> AxisTransform:
        """Return the transform. The offset `d` (m) is ignored if the axes determine d."""
        if not self.offset_is_free:
            A = shift_along_z(self.A, delta_in)
            return find_axis_transform(A, self.reach, default_phi, hayati=False, noise=self.noise)
        A = shift_along_z(self.A, delta_in - d)
        if tilt_sine(A) <= self.noise.radians:
            step = find_axis_transform(A, self.reach, default_phi, hayati=self.hayati, noise=self.noise)
        else:
            step = find_hayati_transform(A, self.reach, self.noise, default_phi)
        return replace(step, delta=step.delta + d) if d else step

    def delta_in_for_zero_d(self, delta_next: float) -> float:
        return float(delta_next * self.A[2, 2] - self.A[2, 3])


def match_axis_transforms(
    pairs: Sequence[PairWithReference],
    phi_in: float,
    delta_in: float,
    tip_offset: float | None,
    *,
    keeps_first_d: bool = True,
) -> tuple[list[AxisTransform], list[float]]:
    """Match the reference's cells; return the transform and the first joint's theta of each pair.

    Rz(phi_in) Tz(delta_in) leads from frame 0 to the first joint. `tip_offset` is the required `delta_in` of
    the last joint, or None if any `delta_in` is allowed. Without `keeps_first_d`, a zero d of the reference's
    first row is not copied.
    """
    steps, inputs = list[AxisTransform](), list[tuple[float, float]]()
    for i, pair in enumerate(pairs):
        keeps_d = i > 0 or (keeps_first_d and not pair.row.d)
        inputs.append((delta_in, _choose_d(pairs, i, delta_in, tip_offset, keeps_d)))
        steps.append(pair.find_transform(*inputs[-1]))
        delta_in = steps[-1].delta_next
    thetas = []
    for i, pair in enumerate(pairs):
        if steps[i].phi_is_free:
            steps[i] = pair.find_transform(*inputs[i], _choose_phi(pairs, steps, i, phi_in))
        else:
            steps[i] = _choose_direction(steps[i], pair, phi_in)
        thetas.append(reference_or_clean_theta(phi_in + steps[i].phi, pair.row.theta))
        phi_in = steps[i].phi_next
    return steps, thetas


def _choose_d(
    pairs: Sequence[PairWithReference], i: int, delta_in: float, tip_offset: float | None, keeps_d: bool
) -> float:
    """Choose d of row i.

        axes determine d               any number, because `find_transform` ignores d
        revolute joint, `keeps_d`      d of the reference
        other joints                   d with which another cell equals the reference

    The other cell is d of a later row, or a of a Hayati row. Without such a cell, d equals d of the
    reference.
    """
    pair = pairs[i]
    if not pair.offset_is_free or (keeps_d and not pair.is_prismatic):
        return pair.row.d
    end = i + 1
    while end < len(pairs) and pairs[end].offset_is_free and not pairs[end].is_prismatic:
        end += 1
    target = tip_offset
    if end < len(pairs):
        target = None if pairs[end].is_prismatic else pairs[end].row.d - pairs[end].normal_offset
    if target is None:
        # A later prismatic joint or the tool compensates for any d. Therefore, d is chosen so that the cell a
        # of one Hayati row equals the reference. This row is the one with the most tilted axes.
        end = max(range(i, end), key=lambda k: tilt_sine(pairs[k].A))
        hayati_offset = pairs[end].hayati_offset
        if hayati_offset is None:
            return pair.row.d
        if end == i:
            return clean_length(delta_in + hayati_offset, pair.reach, pair.noise.metres)
        target = pairs[end].row.d - hayati_offset
    for later in reversed(pairs[i + 1 : end]):
        target = later.row.d + later.delta_in_for_zero_d(target)
    return clean_length(delta_in - pair.delta_in_for_zero_d(target), pair.reach, pair.noise.metres)


def _choose_phi(
    pairs: Sequence[PairWithReference], steps: Sequence[AxisTransform], i: int, phi_in: float
) -> float:
    """Return the phi with which theta of row i equals the reference.

    A revolute joint or the base can compensate for a different theta, but a prismatic joint cannot. If
    prismatic joints i + 1 to k follow, row k alone may determine phi. In this case, theta of rows i + 1 to k
    equals the reference instead.
    """
    own = pairs[i].row.theta - phi_in
    if i > 0 and pairs[i].is_prismatic:
        return own
    end = i + 1
    while end < len(pairs) and pairs[end].is_prismatic and steps[end].phi_is_free:
        end += 1
    if end == len(pairs) or not pairs[end].is_prismatic:
        return own
    phi = _choose_direction(steps[end], pairs[end]).phi
    for k in range(end - 1, i - 1, -1):
        into = pairs[k + 1].row.theta - phi
        phi = math.copysign(1.0, math.cos(steps[k].alpha)) * (steps[k].phi_next - into)
    return phi


def _choose_direction(step: AxisTransform, pair: PairWithReference, phi_in: float = 0.0) -> AxisTransform:
    row = pair.row

    def difference(step: AxisTransform) -> tuple[float, float]:
        angles = abs(angle_difference(step.alpha, row.alpha)) + abs(step.beta - row.beta)
        theta = abs(angle_difference(phi_in + step.phi, row.theta))
        return round(abs(step.a - row.a) / (pair.reach or 1.0) + angles, 6), theta

    return min((step, step.with_reversed_x()), key=difference)


def reference_or_clean_theta(theta: float, reference: float) -> float:
    return (
        reference if abs(angle_difference(theta, reference)) <= ANGLE_ROUNDINGS * EPS else clean_angle(theta)
    )


#: Longest permitted length (m). Larger lengths could overflow in sums of squares.
MAX_LENGTH = 1e150


def check_lengths(joints: Iterable[Joint]) -> None:
    for joint in joints:
        _check_length(f"joint {joint.name}", float(np.abs(joint.T_parent_joint[:3, 3]).max()))


def check_lengths_of_table(chain: FrameChain, table: DHTable) -> None:
    for i, row in enumerate(table.rows):
        for name, length in (("a", row.a), ("d", row.d)):
            _check_length(f"the table, row {i + 1}, {name}", abs(length))
    for name, T in (("base", table.base), ("tool", table.tool)):
        _check_length(f"the table, {name}", float(np.abs(T[:3, 3]).max()))
    for A in chain.constants:
        _check_length(f"{chain.robot}, {chain.base} to {chain.tip}", float(np.abs(A[:3, 3]).max()))


def _check_length(where: str, length: float) -> None:
    if length > MAX_LENGTH:
        raise RangeError(
            "the square of this length is outside the range of double precision",
            where=where,
            found=f"{length:.3g} m",
            remedy="give smaller numbers",
        )


@dataclass(frozen=True, slots=True)
class PoseTolerance:
    """The largest tilt and length between consecutive axes that count as rounding errors."""

    radians: float
    metres: float


def pose_tolerance(joints: int, length: float, reach: float) -> PoseTolerance:
    """Bound the rounding errors of a constant pose between two joint frames.

    The bound covers angles rounded to fifteen digits.

    Args:
        joints: Number of joint origins between the two frames.
        length: Sum of the origins' lengths, m.
        reach: Length of the whole path, m.

    >>> tolerance = pose_tolerance(1, 0.1, 1.0)
    >>> round(tolerance.radians / EPS, 1), round(tolerance.metres / EPS, 1)
    (63.7, 4.0)
    """
    computed = (AXIS_ROUNDINGS + CONSTANT_POSE_ROUNDINGS * joints) * EPS
    return PoseTolerance(
        computed + FILE_ANGLE_ROUNDINGS * joints * EPS, max(LENGTH_ROUNDINGS * EPS * reach, computed * length)
    )


def pose_tolerances(chain: FrameChain, reach: float) -> list[PoseTolerance]:
    return [
        pose_tolerance(joints, float(length), reach)
        for joints, length in zip(chain.pose_counts, chain.lengths, strict=True)
    ]


def sum_zeroed_tilts(chain: FrameChain) -> float:
    """Bound the orientation error (rad) of a table with tilts within rounding errors replaced by 0."""
    total = 0.0
    for A, noise in zip(chain.constants, pose_tolerances(chain, 0.0), strict=True):
        total += sum(tilt for tilt in (tilt_sine(A), abs(float(A[2, 0]))) if tilt <= noise.radians)
    return total


def tilt_sine(A: FloatArray) -> float:
    return math.hypot(A[0, 2], A[1, 2])
