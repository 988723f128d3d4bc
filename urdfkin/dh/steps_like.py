"""The steps between a chain's axes as another table has them: its feet, its directions of x, its heights.

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

from urdfkin.dh.noise import Noise, tilt_of
from urdfkin.dh.normals import (
    FAR_FEET,
    NEARLY_PARALLEL,
    NearParallel,
    Step,
    cleaned_angle,
    cleaned_length,
    hayati_step,
    lifted,
    step_between,
)
from urdfkin.dh.row import DHRow
from urdfkin.kinematics.roundings import ANGLE, EPS
from urdfkin.model.tree import FloatArray


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
