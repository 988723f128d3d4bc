"""From one joint axis to the next: the common normal, and what to do where there is none.

A constant pose A between two joint frames (z along each axis) is taken apart as

    A = Rz(phi) Tz(delta) . Tx(a) Rx(alpha) Ry(beta) . Rz(phi_next) Tz(delta_next)

The outer pairs commute with the two joints' motions and go into their rows; the inner triple is the step.
With beta = 0 and skew axes the seven numbers are unique up to a half turn of x (Denavit and Hartenberg):
a is the distance, delta and delta_next lead to the feet of the common normal. Where axes are parallel, or
nearly so, the feet are undetermined or far away; docs/dh.md says what is chosen there and why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from urdfkin.dh.elements import between_axes, nearest_twelfth, wrapped
from urdfkin.dh.noise import Noise, noise_of, tilt_of
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
