"""Compute the common normal of two consecutive joint axes, and handle axes without a unique common normal.

The z axis of each joint frame points along the joint's axis. Let A be the constant pose of the next joint's
frame in this joint's frame. `step_between` writes A as a product:

    A = Rz(phi) Tz(delta) . Tx(a) Rx(alpha) Ry(beta) . Rz(phi_next) Tz(delta_next)

The factors Rz(phi) and Tz(delta) commute with the motion of the first joint, so they belong to the first
joint's row. The factors Rz(phi_next) and Tz(delta_next) commute with the motion of the second joint, so they
belong to the second joint's row. For two skew axes, beta is 0. The other six numbers are then unique, except
that the direction of x can be reversed (Denavit and Hartenberg). The number a is the distance between the two
joint axes. The offset delta is measured along the first axis, from the origin of the first joint frame to the
common normal. The offset delta_next is measured along the second axis, from the common normal to the origin
of the second joint frame. Parallel axes have many common normals. The common normal of nearly parallel axes
can be very far from the robot. docs/dh.md explains how urdfkin chooses the numbers in these two cases.

The author of a table can choose the offsets along parallel axes and the directions of the x axes.
`steps_like` makes the same choices as another table. If several axes are parallel, the pose of the tip
determines only the sum of their offsets d. If several axes coincide, the pose of the tip determines only the
sum of their angles theta. For such axes, urdfkin copies d or theta from the other table, except in one row.
In that row, urdfkin computes d or theta so that the sum is correct. If that row is the first row, urdfkin can
change the base instead.

Two parallel axes do not determine the offset d of their row. The two axes of a Hayati row do not determine d
of this row. In both cases, d can be chosen, and the offset of the next row compensates the choice. The x axis
of a Hayati row lies in a plane normal to the joint's axis, and d shifts this plane. Therefore, urdfkin
computes the d of a row before the later rows.

**Noise.** Two correct programs read the same URDF and compute slightly different constant poses between two
joint axes. The program that wrote the file may also have rounded each angle to fifteen digits.
`urdfkin.kinematics.roundings` takes both effects into account. Angles that are written with fourteen or
fifteen digits are therefore treated as round. For example, 1.5707963267949 and 3.14159265358979 differ by 15
eps from a multiple of a right angle, where eps is the machine epsilon. An angle that is written with twelve
digits differs from the multiple by 900 eps or more, and is not treated as round. The option `snap` replaces
such an angle by the nearest multiple of 15 degrees and reports the effect.

If the tilt between two axes is below the noise, urdfkin treats the two axes as parallel. The table then
contains zero instead of the tilt. Otherwise, the common normal could be very far from the robot. `left_out`
returns the sum of these tilts. The orientation error that these tilts cause is at most this sum.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from urdfkin.dh.table import DHRow, DHTable, between_axes, nearest_twelfth, wrapped
from urdfkin.errors import RangeError
from urdfkin.kinematics.roundings import ANGLE, AXES, CONSTANT, DIGITS, EPS, SUMMED, WRITTEN
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, Joint

#: Two axes with a smaller tilt (rad) are nearly parallel.
#: An error of a number in the URDF then moves their common normal by more than 100 times the error.
NEARLY_PARALLEL = 1e-2

#: Two axes with a larger tilt (rad) are never treated as nearly parallel.
#: From `NEARLY_PARALLEL` to this tilt, axes are nearly parallel only if their common normal is far away.
FAR_FEET = 0.35


class NearParallel(StrEnum):
    """Kind of row for two nearly parallel axes: a Hayati row, or a row of four parameters."""

    HAYATI = "hayati"
    STRICT = "strict"


@dataclass(frozen=True, slots=True)
class AxisTransform:
    """The seven numbers of the transform between two joint axes, in metres and radians.

    Attributes:
        free: Whether `phi` was a free choice because the axes coincide.
    """

    phi: float
    delta: float
    a: float
    alpha: float
    beta: float
    phi_next: float
    delta_next: float
    free: bool = False

    def turned(self) -> AxisTransform:
        """Return the numbers for the same two axes and the opposite direction of x."""
        alpha = math.pi if self.alpha == math.pi else -self.alpha
        phi, phi_next = self.phi + math.pi, self.phi_next - math.pi
        return replace(self, phi=phi, a=-self.a, alpha=alpha, beta=-self.beta, phi_next=phi_next, free=False)


def lifted(A: FloatArray, carry: float) -> FloatArray:
    """Return Tz(carry) A: convert a pose in the joint's frame to a pose in the DH frame."""
    raised = A.copy()
    raised[2, 3] += carry
    return raised


def step_between(
    A: FloatArray,
    reach: float,
    near_parallel: NearParallel,
    phi_free: float = 0.0,
    delta_each: bool = False,
    noise: PoseTolerance | None = None,
) -> AxisTransform:
    """Factor the constant pose between two joint axes into the seven numbers of a `AxisTransform`.

    Args:
        A: (4, 4) pose of the next joint's frame in this joint's frame.
        reach: Length in metres. If the common normal is farther from a joint frame than `reach`, a Hayati row
            is possible.
        near_parallel: Kind of row for nearly parallel axes.
        phi_free: Value of phi for coinciding axes, for which every phi is correct.
        delta_each: For parallel axes: True if `delta` contains the offset, False if `delta_next` contains it.
        noise: Limits for tilts and lengths; smaller values are set to zero. None: the limits for the origin
            of a single URDF joint.
    """
    noise = noise or noise_of(1, 0.0, reach)
    sine = tilt_of(A)
    if sine <= noise.radians:
        return _parallel(A, reach, noise, phi_free, delta_each)
    feet = _skew(A, sine, reach, noise)
    if near_parallel is NearParallel.HAYATI and _is_near(feet, sine, reach):
        return hayati_step(A, reach, noise, phi_free)
    return feet


def _is_near(feet: AxisTransform, sine: float, reach: float) -> bool:
    far = max(abs(feet.delta), abs(feet.delta_next)) > reach
    return sine < NEARLY_PARALLEL or (sine < FAR_FEET and far)


def _skew(A: FloatArray, sine: float, reach: float, noise: PoseTolerance) -> AxisTransform:
    """Return the numbers of the transform between two skew axes.

    The x axis points along the cross product of z and z_next. The length a is positive, or 0 if the axes
    intersect.
    """
    phi = math.atan2(A[0, 2], -A[1, 2])
    along = math.cos(phi) * A[0, 3] + math.sin(phi) * A[1, 3]
    across = math.cos(phi) * A[1, 3] - math.sin(phi) * A[0, 3]
    delta_next = cleaned_length(-across / sine, reach, noise.metres)
    delta = cleaned_length(A[2, 3] - delta_next * A[2, 2], reach, noise.metres)
    a, alpha = cleaned_length(along, reach, noise.metres), cleaned_angle(math.atan2(sine, A[2, 2]))
    step = AxisTransform(phi, delta, a, alpha, 0.0, _remaining_rotation(A, phi, alpha, 0.0), delta_next)
    return step.turned() if a < 0.0 else step


def _parallel(
    A: FloatArray, reach: float, noise: PoseTolerance, phi_free: float, delta_each: bool
) -> AxisTransform:
    """Return the numbers of the transform between two parallel axes.

    The x axis is along the perpendicular through the origin of this joint's frame. If the axes coincide, they
    do not determine phi, and the function sets phi to `phi_free`.
    """
    sign = math.copysign(1.0, A[2, 2])
    alpha = 0.0 if sign > 0.0 else math.pi
    offset = cleaned_length(A[2, 3], reach, noise.metres)
    delta, delta_next = (offset, 0.0) if delta_each else (0.0, sign * offset)
    a = cleaned_length(math.hypot(A[0, 3], A[1, 3]), reach, noise.metres)
    phi = math.atan2(A[1, 3], A[0, 3]) if a else phi_free
    return AxisTransform(
        phi, delta, a, alpha, 0.0, _remaining_rotation(A, phi, alpha, 0.0), delta_next, free=not a
    )


def hayati_step(A: FloatArray, reach: float, noise: PoseTolerance, phi_free: float) -> AxisTransform:
    """Return the numbers of the transform between two axes for a Hayati row (Hayati, 1983).

    Consider the plane through the origin of this joint's frame, normal to this joint's axis. The x axis
    points from the origin to the intersection of this plane with the next axis.
    """
    z = A[:3, 2]
    delta_next = cleaned_length(A[2, 3] / z[2], reach, noise.metres)
    across = A[:2, 3] - delta_next * z[:2]
    a = cleaned_length(math.hypot(across[0], across[1]), reach, noise.metres)
    phi = math.atan2(across[1], across[0]) if a else phi_free
    x = math.cos(phi) * z[0] + math.sin(phi) * z[1]
    y = math.cos(phi) * z[1] - math.sin(phi) * z[0]
    alpha = cleaned_angle(math.atan2(-y, z[2]))
    beta = cleaned_angle(math.atan2(x, math.hypot(y, z[2])))
    return AxisTransform(
        phi, 0.0, a, alpha, beta, _remaining_rotation(A, phi, alpha, beta), delta_next, free=not a
    )


def _remaining_rotation(A: FloatArray, phi: float, alpha: float, beta: float) -> float:
    """Return phi_next (rad) by a formula that is accurate for every tilt."""
    turn_phi = np.array([[math.cos(phi), -math.sin(phi), 0], [math.sin(phi), math.cos(phi), 0], [0, 0, 1.0]])
    M = (turn_phi @ between_axes(0.0, alpha, beta)[:3, :3]).T @ A[:3, :3]
    return math.atan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])


def cleaned_length(length: float, reach: float, noise: float = 0.0) -> float:
    """Return a length (metres) without rounding noise.

    `reach` is the magnitude of the numbers from which the length was computed. If the length is below `noise`
    or the rounding error of `reach`, the function returns 0. If the length differs from a decimal number of
    twelve digits only by rounding error, the function returns the decimal number.

        >>> cleaned_length(-5e-17, 1.0), cleaned_length(0.07599999999999998, 1.0), cleaned_length(-5e-12, 1.0)
        (0.0, 0.076, -5e-12)
    """
    if abs(length) <= max(SUMMED * EPS * reach, noise):
        return 0.0
    short = float(f"{length:.12g}")
    return short if abs(length - short) <= DIGITS * EPS * reach else float(length)


def cleaned_angle(angle: float) -> float:
    """Return the angle in (-pi, pi]; within rounding error of a multiple of pi/12, return this multiple."""
    angle = wrapped(angle)
    twelfth = nearest_twelfth(angle)
    return wrapped(twelfth) + 0.0 if abs(angle - twelfth) <= ANGLE * EPS else angle


@dataclass(frozen=True, slots=True)
class PairLike:
    """Two consecutive joint axes of a path, with the corresponding row of another table.

    Attributes:
        A: (4, 4) pose of the next joint's frame in this joint's frame.
        row: The other table's row.
        reach: Metres; see `cleaned_length`.
        noise: Noise of the pose.
    """

    A: FloatArray
    row: DHRow
    reach: float
    noise: PoseTolerance
    near_parallel: NearParallel

    @property
    def slides(self) -> bool:
        return not self.row.kind.turns

    @property
    def passes_on(self) -> bool:
        """Whether the two axes do not determine the row's offset d.

        In this case, d can be chosen, and the offset of the next row compensates the choice.
        """
        return tilt_of(self.A) <= self.noise.radians or self._gets_hayati_row

    @property
    def _gets_hayati_row(self) -> bool:
        """Whether the table has a Hayati row for these two axes.

        If a row of four parameters is possible too, urdfkin uses the kind of row that the other table has.
        """
        sine = tilt_of(self.A)
        leans_there = not self.row.beta and abs(math.sin(self.row.alpha)) >= NEARLY_PARALLEL
        return self.near_parallel is NearParallel.HAYATI and (
            sine < NEARLY_PARALLEL or (sine < FAR_FEET and not leans_there)
        )

    @property
    def foot(self) -> float:
        """Distance (metres) along the first axis, from the frame of its joint to the common normal."""
        return step_between(self.A, self.reach, NearParallel.STRICT, noise=self.noise).delta

    @property
    def cut(self) -> float | None:
        """Distance (metres) along the first axis from the joint's frame to the x axis of the Hayati row.

        This x axis lies in a plane normal to the first axis. The next axis intersects the plane in a point.
        In the other table, the cell a is the distance of this point from the first axis. The component of a
        in the direction of the tilt determines the position of the plane. The position error is then the
        rounding error divided by the tilt. For a slight tilt, urdfkin computes this component from a and from
        the component normal to the tilt, which is more accurate. The result is None if the plane is farther
        away than `reach`.
        """
        across, along = -math.sin(self.row.alpha) * math.cos(self.row.beta), math.sin(self.row.beta)
        sine, lean = tilt_of(self.A), math.hypot(along, across)
        if min(sine, lean) <= self.noise.radians:
            return None
        (x, y, z), p = self.A[:3, 2] / sine, self.A[:3, 3]
        there = self.row.a * along / lean
        beside = p[0] * y - p[1] * x
        if sine * sine <= self.noise.radians and self.row.a**2 * sine < abs(there * beside):
            there = math.copysign(math.sqrt(max(0.0, self.row.a**2 - beside**2)), there)
        cut = float(p[2] + (there - p[0] * x - p[1] * y) * z)
        return cut if abs(cut) <= self.reach else None

    def step(self, carry: float, d: float, phi_free: float = 0.0) -> AxisTransform:
        """Return the numbers of the transform between the two axes.

        `carry` is the offset (metres) along the first axis from the DH frame to the joint's frame. `d` is the
        row's offset, which is used only if the two axes do not determine it.
        """
        if not self.passes_on:
            return step_between(
                lifted(self.A, carry), self.reach, NearParallel.STRICT, phi_free, noise=self.noise
            )
        A = lifted(self.A, carry - d)
        if tilt_of(A) <= self.noise.radians:
            step = step_between(A, self.reach, self.near_parallel, phi_free, noise=self.noise)
        else:
            step = hayati_step(A, self.reach, self.noise, phi_free)
        return replace(step, delta=step.delta + d) if d else step

    def passed_back(self, carry: float) -> float:
        """Return the offset (metres) from this joint's DH frame to this joint's frame, for a row with d = 0.

        `carry` is the offset from the next joint's DH frame to the next joint's frame.
        """
        return float(carry * self.A[2, 2] - self.A[2, 3])


def steps_like(
    pairs: Sequence[PairLike], phi_in: float, carry: float, tip: float | None
) -> tuple[list[AxisTransform], list[float]]:
    """Compute the transforms between consecutive axes of a path, and theta of each row.

    If a number can be chosen freely, the function copies the number from another table. `phi_in` (rad) and
    `carry` (metres) are the angle about the first axis and the offset along it, from frame 0 to the first
    joint's frame. With the offset `tip` (metres) before the last row, d of the last row equals d in the other
    table. If `tip` is None, these two numbers may differ, and the last row or the tool contains the
    difference.
    """
    steps, inputs = list[AxisTransform](), list[tuple[float, float]]()
    for i, pair in enumerate(pairs):
        inputs.append((carry, _offset_without_foot(pairs, i, carry, tip)))
        steps.append(pair.step(*inputs[-1]))
        carry = steps[-1].delta_next
    thetas = []
    for i, pair in enumerate(pairs):
        if steps[i].free:
            steps[i] = pair.step(*inputs[i], _phi_of_coinciding(pairs, steps, i, phi_in))
        else:
            steps[i] = _closer_direction(steps[i], pair, phi_in)
        thetas.append(near(phi_in + steps[i].phi, pair.row.theta))
        phi_in = steps[i].phi_next
    return steps, thetas


def _offset_without_foot(pairs: Sequence[PairLike], i: int, carry: float, tip: float | None) -> float:
    """Return d of a row whose two axes do not determine d.

    The function chooses d so that d of this row, or of a later row, equals d in the other table.
    """
    pair = pairs[i]
    if not pair.passes_on or not (pair.slides or (i == 0 and pair.row.d)):
        return pair.row.d
    end = i + 1
    while end < len(pairs) and pairs[end].passes_on and not pairs[end].slides:
        end += 1
    target = tip
    if end < len(pairs):
        target = None if pairs[end].slides else pairs[end].row.d - pairs[end].foot
    if target is None:
        # The remaining offset becomes part of d of a later prismatic joint, or of the tool.
        # If there is a Hayati row in between, the plane of its x axis may determine d.
        end = max(range(i, end), key=lambda k: tilt_of(pairs[k].A))
        cut = pairs[end].cut
        if cut is None:
            return pair.row.d
        if end == i:
            return cleaned_length(carry + cut, pair.reach, pair.noise.metres)
        target = pairs[end].row.d - cut
    for one in reversed(pairs[i + 1 : end]):
        target = one.row.d + one.passed_back(target)
    return cleaned_length(carry - pair.passed_back(target), pair.reach, pair.noise.metres)


def _phi_of_coinciding(
    pairs: Sequence[PairLike], steps: Sequence[AxisTransform], i: int, phi_in: float
) -> float:
    """Return phi for two coinciding axes, for which any value of phi is correct.

    The function chooses phi so that theta of this row, or of the prismatic rows after it, equals theta in the
    other table.
    """
    own = pairs[i].row.theta - phi_in
    if i > 0 and pairs[i].slides:
        return own
    end = i + 1
    while end < len(pairs) and pairs[end].slides and steps[end].free:
        end += 1
    if end == len(pairs) or not pairs[end].slides:
        return own
    phi = _closer_direction(steps[end], pairs[end]).phi
    for k in range(end - 1, i - 1, -1):
        into = pairs[k + 1].row.theta - phi
        phi = math.copysign(1.0, math.cos(steps[k].alpha)) * (steps[k].phi_next - into)
    return phi


def _closer_direction(step: AxisTransform, pair: PairLike, phi_in: float = 0.0) -> AxisTransform:
    """Return the `AxisTransform` with the direction of x for which the cells are closer to the other table.

    The function compares the cells a, alpha and beta with the same cells of the other table. If the two
    directions of x are equally close, the function compares theta.
    """
    row = pair.row

    def unlike(one: AxisTransform) -> tuple[float, float]:
        apart = abs(math.remainder(one.alpha - row.alpha, 2.0 * math.pi)) + abs(one.beta - row.beta)
        turned = abs(math.remainder(phi_in + one.phi - row.theta, 2.0 * math.pi))
        return round(abs(one.a - row.a) / (pair.reach or 1.0) + apart, 6), turned

    return min((step, step.turned()), key=unlike)


def near(theta: float, there: float) -> float:
    off = math.remainder(theta - there, 2.0 * math.pi)
    return there if abs(off) <= ANGLE * EPS else cleaned_angle(theta)


#: Squares of sums of longer lengths (metres) overflow in common normals and bounds.
LONGEST = 1e150


def demand_squares(joints: Iterable[Joint]) -> None:
    """Raise RangeError unless the square of each joint's offset is a finite double."""
    for joint in joints:
        _check_length(f"joint {joint.name}", float(np.abs(joint.T_parent_joint[:3, 3]).max()))


def demand_squares_of(chain: FrameChain, table: DHTable) -> None:
    """Raise RangeError unless the square of each length of a path and of a table is a finite double."""
    for i, row in enumerate(table.rows):
        for name, length in (("a", row.a), ("d", row.d)):
            _check_length(f"the table, row {i + 1}, {name}", abs(length))
    for name, T in (("base", table.base), ("tool", table.tool)):
        _check_length(f"the table, {name}", float(np.abs(T[:3, 3]).max()))
    for A in chain.constants:
        _check_length(f"{chain.robot}, {chain.base} to {chain.tip}", float(np.abs(A[:3, 3]).max()))


def _check_length(where: str, length: float) -> None:
    if length > LONGEST:
        raise RangeError(
            "the square of this length is outside the range of double precision",
            where=where,
            found=f"{length:.3g} m",
            remedy="give smaller numbers",
        )


@dataclass(frozen=True, slots=True)
class PoseTolerance:
    """Largest angle (radians) and length (metres) that are treated as rounding errors in a constant pose."""

    radians: float
    metres: float


def noise_of(joints: int, length: float, reach: float) -> PoseTolerance:
    """Return the largest angle and length that are treated as rounding errors in a constant pose.

    The pose is the product of the origins of `joints` URDF joints; `length` is the sum of their offsets
    (metres), and `reach` the length of the whole path (metres).

        >>> round(noise_of(1, 0.1, 1.0).radians / EPS, 1), round(noise_of(1, 0.1, 1.0).metres / EPS, 1)
        (63.7, 4.0)
    """
    computed = (AXES + CONSTANT * joints) * EPS
    return PoseTolerance(computed + WRITTEN * joints * EPS, max(SUMMED * EPS * reach, computed * length))


def noises(chain: FrameChain, reach: float) -> list[PoseTolerance]:
    return [
        noise_of(joints, float(length), reach)
        for joints, length in zip(chain.folded, chain.lengths, strict=True)
    ]


def left_out(chain: FrameChain) -> float:
    """Return the sum (rad) of those tilts between consecutive axes that are not larger than rounding errors.

    Tilts of z axes and tilts of x axes are both added.
    """
    found = 0.0
    for A, noise in zip(chain.constants, noises(chain, 0.0), strict=True):
        found += sum(tilt for tilt in (tilt_of(A), abs(float(A[2, 0]))) if tilt <= noise.radians)
    return found


def tilt_of(A: FloatArray) -> float:
    """Return the sine of the angle between the z axis of a pose and the z axis of its reference frame."""
    return math.hypot(A[0, 2], A[1, 2])
