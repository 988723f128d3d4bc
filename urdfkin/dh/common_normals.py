"""From one joint axis to the next: the common normal, and what to do where there is none.

A constant pose A between two joint frames (z along each axis) is taken apart as

    A = Rz(phi) Tz(delta) . Tx(a) Rx(alpha) Ry(beta) . Rz(phi_next) Tz(delta_next)

The outer pairs commute with the two joints' motions and go into their rows; the inner triple is the step.
With beta = 0 and skew axes the seven numbers are unique up to a half turn of x (Denavit and Hartenberg):
a is the distance, delta and delta_next lead to the feet of the common normal. Where axes are parallel, or
nearly so, the feet are undetermined or far away; docs/dh.md says what is chosen there and why.


The steps between a chain's axes as another table has them: its feet, its directions of x, its heights.

Along parallel axes only the sum of the rows' d shows, about coinciding axes only the sum of their theta. In
such a run each row has the other table's number, but for one whose number says no more than where a joint's
zero is: d of a joint that slides, theta of one that turns, and what the base takes up of the first row.
That zero is the URDF's, and the row has what the rows after it leave. A nearly parallel pair that is cut by a
normal plane passes an offset on as a parallel one does; where the plane cuts depends on what was passed on,
so that a zero is found before the rows after it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from urdfkin.dh.noise import Noise, noise_of, tilt_of
from urdfkin.dh.table import DHRow, between_axes, nearest_twelfth, wrapped
from urdfkin.kinematics.roundings import ANGLE, DIGITS, EPS, SUMMED
from urdfkin.model.tree import FloatArray

#: Below this tilt (rad) a pair is nearly parallel: the feet would magnify errors in the URDF a hundredfold.
NEARLY_PARALLEL = 1e-2

#: Up to this tilt (rad) a pair counts as nearly parallel when a foot lies farther away than the reach.
FAR_FEET = 0.35


class NearParallel(StrEnum):
    """What a nearly parallel pair of axes gets: a Hayati row, or four parameters at any price."""

    HAYATI = "hayati"
    STRICT = "strict"


@dataclass(frozen=True, slots=True)
class Step:
    """The seven numbers of the module's formula: metres and radians.

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

    def turned(self) -> Step:
        """The same step with x pointing the other way: Rz(pi) X(a, alpha, beta) Rz(-pi)."""
        alpha = math.pi if self.alpha == math.pi else -self.alpha
        return Step(
            self.phi + math.pi,
            self.delta,
            -self.a,
            alpha,
            -self.beta,
            self.phi_next - math.pi,
            self.delta_next,
        )


def lifted(A: FloatArray, carry: float) -> FloatArray:
    """Tz(carry) A: measured from the origin of the DH frame instead of the joint's."""
    raised = A.copy()
    raised[2, 3] += carry
    return raised


def step_between(
    A: FloatArray,
    reach: float,
    near_parallel: NearParallel,
    phi_free: float = 0.0,
    delta_each: bool = False,
    noise: Noise | None = None,
) -> Step:
    """Take a constant pose apart.

    Args:
        A: (4, 4) pose of the next joint's frame in this joint's frame.
        reach: Metres; feet beyond it are far.
        near_parallel: What to do where the axes are nearly parallel.
        phi_free: The value of phi where the axes coincide and any would do.
        delta_each: Leave the offset between parallel axes in this step (`delta`) instead of passing it on.
        noise: Tilts and lengths below this are zero; that of one joint's constant when None.
    """
    noise = noise or noise_of(1, 0.0, reach)
    sine = tilt_of(A)
    if sine <= noise.radians:
        return _parallel(A, reach, noise, phi_free, delta_each)
    feet = _skew(A, sine, reach, noise)
    if near_parallel is NearParallel.HAYATI and _is_near(feet, sine, reach):
        return hayati_step(A, reach, noise, phi_free)
    return feet


def _is_near(feet: Step, sine: float, reach: float) -> bool:
    far = max(abs(feet.delta), abs(feet.delta_next)) > reach
    return sine < NEARLY_PARALLEL or (sine < FAR_FEET and far)


def _skew(A: FloatArray, sine: float, reach: float, noise: Noise) -> Step:
    """X along z cross z_next, a > 0 where the axes do not meet."""
    phi = math.atan2(A[0, 2], -A[1, 2])
    along = math.cos(phi) * A[0, 3] + math.sin(phi) * A[1, 3]
    across = math.cos(phi) * A[1, 3] - math.sin(phi) * A[0, 3]
    delta_next = cleaned_length(-across / sine, reach, noise.metres)
    delta = cleaned_length(A[2, 3] - delta_next * A[2, 2], reach, noise.metres)
    a, alpha = cleaned_length(along, reach, noise.metres), cleaned_angle(math.atan2(sine, A[2, 2]))
    step = Step(phi, delta, a, alpha, 0.0, _rest(A, phi, alpha, 0.0), delta_next)
    return step.turned() if a < 0.0 else step


def _parallel(A: FloatArray, reach: float, noise: Noise, phi_free: float, delta_each: bool) -> Step:
    """The perpendicular from this origin; collinear axes leave phi free."""
    sign = math.copysign(1.0, A[2, 2])
    alpha = 0.0 if sign > 0.0 else math.pi
    offset = cleaned_length(A[2, 3], reach, noise.metres)
    delta, delta_next = (offset, 0.0) if delta_each else (0.0, sign * offset)
    a = cleaned_length(math.hypot(A[0, 3], A[1, 3]), reach, noise.metres)
    phi = math.atan2(A[1, 3], A[0, 3]) if a else phi_free
    return Step(phi, delta, a, alpha, 0.0, _rest(A, phi, alpha, 0.0), delta_next, free=not a)


def hayati_step(A: FloatArray, reach: float, noise: Noise, phi_free: float) -> Step:
    """X from this origin to where the next axis pierces the plane normal to this one (Hayati, 1983)."""
    z = A[:3, 2]
    delta_next = cleaned_length(A[2, 3] / z[2], reach, noise.metres)
    across = A[:2, 3] - delta_next * z[:2]
    a = cleaned_length(math.hypot(across[0], across[1]), reach, noise.metres)
    phi = math.atan2(across[1], across[0]) if a else phi_free
    x = math.cos(phi) * z[0] + math.sin(phi) * z[1]
    y = math.cos(phi) * z[1] - math.sin(phi) * z[0]
    alpha = cleaned_angle(math.atan2(-y, z[2]))
    beta = cleaned_angle(math.atan2(x, math.hypot(y, z[2])))
    return Step(phi, 0.0, a, alpha, beta, _rest(A, phi, alpha, beta), delta_next, free=not a)


def _rest(A: FloatArray, phi: float, alpha: float, beta: float) -> float:
    """phi_next: the turn about the next axis that is left, well conditioned for every tilt."""
    turn_phi = np.array([[math.cos(phi), -math.sin(phi), 0], [math.sin(phi), math.cos(phi), 0], [0, 0, 1.0]])
    M = (turn_phi @ between_axes(0.0, alpha, beta)[:3, :3]).T @ A[:3, :3]
    return math.atan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])


def cleaned_length(length: float, reach: float, noise: float = 0.0) -> float:
    """A length without rounding noise: zero, or twelve digits, where that is no further away than rounding.

    Args:
        length: Metres.
        reach: Metres, from which it is measured.
        noise: Metres below which it is zero, if that is more than `reach` makes it.

    Example:
        >>> cleaned_length(-5e-17, 1.0), cleaned_length(0.07599999999999998, 1.0), cleaned_length(-5e-12, 1.0)
        (0.0, 0.076, -5e-12)
    """
    if abs(length) <= max(SUMMED * EPS * reach, noise):
        return 0.0
    short = float(f"{length:.12g}")
    return short if abs(length - short) <= DIGITS * EPS * reach else float(length)


def cleaned_angle(angle: float) -> float:
    """An angle in (-pi, pi]; one that differs from a multiple of pi/12 by rounding only becomes it."""
    angle = wrapped(angle)
    twelfth = nearest_twelfth(angle)
    return wrapped(twelfth) + 0.0 if abs(angle - twelfth) <= ANGLE * EPS else angle


@dataclass(frozen=True, slots=True)
class PairLike:
    """Two consecutive axes, and the row that the other table has for them.

    Attributes:
        A: (4, 4) pose of the next joint's frame in this joint's frame.
        row: Of the other table.
        reach: Metres; what cleans lengths.
        noise: Of the pose.
        near_parallel: What nearly parallel axes get.
    """

    A: FloatArray
    row: DHRow
    reach: float
    noise: Noise
    near_parallel: NearParallel

    @property
    def slides(self) -> bool:
        """Whether the first of the two joints slides."""
        return not self.row.kind.turns

    @property
    def passes_on(self) -> bool:
        """Whether the row has no foot of its own: what is not in its d is passed on to the next row."""
        return tilt_of(self.A) <= self.noise.radians or self._is_cut

    @property
    def _is_cut(self) -> bool:
        """Whether a normal plane cuts the pair: where both forms have their use, as in the other table."""
        sine = tilt_of(self.A)
        leans_there = not self.row.beta and abs(math.sin(self.row.alpha)) >= NEARLY_PARALLEL
        return self.near_parallel is NearParallel.HAYATI and (
            sine < NEARLY_PARALLEL or (sine < FAR_FEET and not leans_there)
        )

    @property
    def foot(self) -> float:
        """Metres along this axis from its joint's frame to the common normal."""
        return step_between(self.A, self.reach, NearParallel.STRICT, noise=self.noise).delta

    @property
    def cut(self) -> float | None:
        """Metres along this axis from its joint's frame to the plane that cuts the other table's pair.

        None where none is within reach. There x reaches the plane at the other a, of which the lean tells the
        part along itself. That is known to rounding by the tilt; by a slight one better from the part across.
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

    def step(self, carry: float, d: float, phi_free: float = 0.0) -> Step:
        """The pair taken apart, measured from `carry` before its joint, with `d` where that is free."""
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
        """How far before its joint a row with d = 0 begins that passes `carry` on."""
        return float(carry * self.A[2, 2] - self.A[2, 3])


def steps_like(
    pairs: Sequence[PairLike], phi_in: float, carry: float, tip: float | None
) -> tuple[list[Step], list[float]]:
    """The steps, and theta of each row.

    Args:
        pairs: All consecutive axes.
        phi_in: The turn that leads to the first joint's frame.
        carry: The offset that does.
        tip: What is to be passed on to the last row so that its d is the other table's; None where the tool
            or the row itself takes what is left.
    """
    steps, taken = list[Step](), list[tuple[float, float]]()
    for i, pair in enumerate(pairs):
        taken.append((carry, _height(pairs, i, carry, tip)))
        steps.append(pair.step(*taken[-1]))
        carry = steps[-1].delta_next
    thetas = []
    for i, pair in enumerate(pairs):
        if steps[i].free:
            steps[i] = pair.step(*taken[i], _turn(pairs, steps, i, phi_in))
        else:
            steps[i] = _facing(steps[i], pair, phi_in)
        thetas.append(near(phi_in + steps[i].phi, pair.row.theta))
        phi_in = steps[i].phi_next
    return steps, thetas


def _height(pairs: Sequence[PairLike], i: int, carry: float, tip: float | None) -> float:
    """The d of a row without a foot: the other table's, or what leaves the rows after it theirs."""
    pair = pairs[i]
    if not pair.passes_on or not (pair.slides or (i == 0 and pair.row.d)):
        return pair.row.d
    end = i + 1
    while end < len(pairs) and pairs[end].passes_on and not pairs[end].slides:
        end += 1
    wanted = tip
    if end < len(pairs):
        wanted = None if pairs[end].slides else pairs[end].row.d - pairs[end].foot
    if wanted is None:  # what is left goes to a later slide or to the tool: a plane on the way may tell
        end = max(range(i, end), key=lambda k: tilt_of(pairs[k].A))
        cut = pairs[end].cut
        if cut is None:
            return pair.row.d
        if end == i:
            return cleaned_length(carry + cut, pair.reach, pair.noise.metres)
        wanted = pairs[end].row.d - cut
    for one in reversed(pairs[i + 1 : end]):
        wanted = one.row.d + one.passed_back(wanted)
    return cleaned_length(carry - pair.passed_back(wanted), pair.reach, pair.noise.metres)


def _turn(pairs: Sequence[PairLike], steps: Sequence[Step], i: int, phi_in: float) -> float:
    """Phi of a pair that coincides: with the other table's theta, or so that slides after it have theirs."""
    own = pairs[i].row.theta - phi_in
    if i > 0 and pairs[i].slides:
        return own
    end = i + 1
    while end < len(pairs) and pairs[end].slides and steps[end].free:
        end += 1
    if end == len(pairs) or not pairs[end].slides:
        return own
    phi = _facing(steps[end], pairs[end]).phi
    for k in range(end - 1, i - 1, -1):
        into = pairs[k + 1].row.theta - phi
        phi = math.copysign(1.0, math.cos(steps[k].alpha)) * (steps[k].phi_next - into)
    return phi


def _facing(step: Step, pair: PairLike, phi_in: float = 0.0) -> Step:
    """The step with x turned round where the other table's cells say so, and its theta where they do not."""
    row = pair.row

    def unlike(one: Step) -> tuple[float, float]:
        apart = abs(math.remainder(one.alpha - row.alpha, 2.0 * math.pi)) + abs(one.beta - row.beta)
        turned = abs(math.remainder(phi_in + one.phi - row.theta, 2.0 * math.pi))
        return round(abs(one.a - row.a) / (pair.reach or 1.0) + apart, 6), turned

    return min((step, step.turned()), key=unlike)


def near(theta: float, there: float) -> float:
    """An angle, by whole turns near another one, and that one where nothing but rounding is between them."""
    off = math.remainder(theta - there, 2.0 * math.pi)
    return there if abs(off) <= ANGLE * EPS else cleaned_angle(theta)
