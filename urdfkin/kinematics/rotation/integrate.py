"""Orientation from an angular velocity over time, by quaternion rates with the norm kept.

Section 7.2.5: "one converts from w to q-dot, then integrates". The integral of w itself is no orientation
(example 7.3).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.kinematics.inputs import FloatArray, scalars, vectors
from urdfkin.kinematics.rotation.quaternion import unit_quaternions
from urdfkin.kinematics.rotation.quaternion_rates import ExpressedIn, quaternion_rates


def integrate_orientation(
    w: Callable[[float], ArrayLike], quat: ArrayLike, times: ArrayLike, frame: ExpressedIn = "fixed"
) -> FloatArray:
    """Quaternions at `times` of a body that turns with w(t): Runge-Kutta's fourth order on 7.57.

    The exact flow keeps the quaternion's length; each step's rounding and truncation do not, so the
    result of each step is put back to length one. Halving the steps divides the error by 16.

    Args:
        w: Angular velocity at a time in s: (..., 3) rad/s. Within a step it must be smooth: put a time
            where it jumps. At the ends of a step it is asked for just inside.
        quat: (..., 4) orientation at `times[0]`, unit quaternion, scalar last.
        times: (n,) increasing, in s; one step from each to the next.
        frame: Where w is expressed: the fixed frame 0 or the body's own.

    Returns:
        (n, ..., 4) unit quaternions, scalar last.

    Raises:
        InputError: a shape, or times that do not increase.
    """
    times = scalars(times, "times")
    if times.ndim != 1 or (np.diff(times) <= 0.0).any():
        raise InputError("times must be a row of increasing numbers", found=str(times.shape))
    quats = [unit_quaternions(quat)]
    for start, end in pairwise(times.tolist()):
        quats.append(_step(w, quats[-1], start, end, frame))
    return np.stack(quats)


def _step(
    w: Callable[[float], ArrayLike], quat: FloatArray, start: float, end: float, frame: ExpressedIn
) -> FloatArray:
    """One Runge-Kutta step, back at unit length."""
    step = end - start
    first, middle, last = (
        vectors(w(t), "w") for t in (np.nextafter(start, end), (start + end) / 2.0, np.nextafter(end, start))
    )
    k1 = _rates(quat, first, frame)
    k2 = _rates(quat + step / 2.0 * k1, middle, frame)
    k3 = _rates(quat + step / 2.0 * k2, middle, frame)
    k4 = _rates(quat + step * k3, last, frame)
    stepped = quat + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    normalised: FloatArray = stepped / np.sqrt((stepped * stepped).sum(axis=-1, keepdims=True))
    return normalised


def _rates(quat: FloatArray, w: FloatArray, frame: ExpressedIn) -> FloatArray:
    """7.57 is linear in the quaternion: between the ends of a step its length is not one, and need not be."""
    length = np.sqrt((quat * quat).sum(axis=-1, keepdims=True))
    rates: FloatArray = length * quaternion_rates(quat / length, w, frame)
    return rates
