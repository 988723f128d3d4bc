"""The elementary transforms of Denavit and Hartenberg, for one row or for a batch.

Every table here is a product of two kinds of factors, in turns:

    S = Rz(theta) Tz(d)              along and about a joint's axis
    X = Tx(a) Rx(alpha) Ry(beta)     from one axis to the next; beta = 0 except in a Hayati row

Standard rows are S_i X_i, modified rows X_{i-1} S_i: the same factors, bracketed differently.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.roundings import ANGLE, EPS
from urdfkin.model.tree import FloatArray

#: How far from a multiple of 15 degrees people write one, as a share of 15 degrees.
_WRITTEN = 1e-3


def along_axis(theta: ArrayLike, d: ArrayLike) -> FloatArray:
    """(..., 4, 4) S = Rz(theta) Tz(d), radians and metres; the arguments are broadcast."""
    theta, d = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(d, np.float64))
    S = np.zeros((*theta.shape, 4, 4))
    S[..., 0, 0] = S[..., 1, 1] = np.cos(theta)
    S[..., 1, 0] = np.sin(theta)
    S[..., 0, 1] = -S[..., 1, 0]
    S[..., 2, 2] = S[..., 3, 3] = 1.0
    S[..., 2, 3] = d
    return S


def between_axes(a: float, alpha: float, beta: float = 0.0) -> FloatArray:
    """(4, 4) X = Tx(a) Rx(alpha) Ry(beta), metres and radians."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array(
        [
            [cb, 0.0, sb, a],
            [sa * sb, ca, -sa * cb, 0.0],
            [-ca * sb, sa, ca * cb, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def as_step(T: FloatArray) -> tuple[float, float] | None:
    """(a, alpha) where a pose is Tx(a) Rx(alpha) to rounding of its rotation, else None.

    Example:
        >>> as_step(between_axes(0.5, math.pi))
        (0.5, 3.141592653589793)
    """
    crossed = (T[0, 1], T[0, 2], T[1, 0], T[2, 0])
    if max(map(abs, crossed)) > ANGLE * EPS or T[0, 0] < 0.0 or T[1, 3] or T[2, 3]:
        return None
    alpha = math.atan2(T[2, 1], T[2, 2])
    twelfth = nearest_twelfth(alpha)
    return float(T[0, 3]), wrapped(twelfth if abs(alpha - twelfth) <= ANGLE * EPS else alpha) + 0.0


def wrapped(angle: float) -> float:
    """The angle's representative in (-pi, pi], where a rounding error below -pi counts as pi.

    Example:
        >>> wrapped(-math.pi) == math.pi, wrapped(7.0) == 7.0 - 2 * math.pi
        (True, True)
    """
    turned = math.remainder(angle, 2.0 * math.pi)
    return math.pi if turned <= -math.pi * (1.0 - EPS) else turned


def looks_round(angle: float, twelfth: float = math.pi / 12.0) -> bool:
    """Whether an angle is a multiple of 15 degrees, and not 0, as far as people write them: 1.571 is.

    >>> looks_round(1.571), looks_round(0.0), looks_round(0.25), looks_round(90.0, twelfth=15.0)
    (True, False, False, True)
    """
    return abs(angle) > 0.5 * twelfth and abs(math.remainder(angle, twelfth)) <= _WRITTEN * twelfth


def nearest_twelfth(angle: float) -> float:
    """The multiple of pi/12 (15 degrees) nearest to an angle."""
    return round(angle * 12.0 / math.pi) * math.pi / 12.0
