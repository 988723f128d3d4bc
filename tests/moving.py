"""Smooth motions of three frames and a point, as functions of time at 60 digits."""

from collections.abc import Callable
from typing import Any

from tests.high_precision import (
    about,
    angular_acceleration,
    angular_velocity,
    array,
    column,
    mp,
    rate,
    second_rate,
)
from urdfkin.kinematics.bodies import MovingFrame

#: Time at which the tests compare motions.
T = 0.7

ORIENTATIONS: tuple[Callable[[Any], Any], ...] = (
    lambda t: about(column(1, 2, 3), mp.sin(t)) * about(column(-1, 0, 2), t * t),
    lambda t: about(column(0, 1, -1), mp.exp(t) / 2),
    lambda t: about(column(2, 0, 1), 3 * t) * about(column(0, 1, 0), mp.cos(t)),
)
ORIGINS: tuple[Callable[[Any], Any], ...] = (
    lambda t: column(mp.cos(t), t**3, 1 + t),
    lambda t: column(t, 2 * mp.sin(3 * t), t * t),
    lambda t: column(0, mp.exp(-t), mp.mpf(1) / 3),
)


def point(t: Any) -> Any:
    """Return the position of the moving point in the last frame."""
    return column(mp.sin(5 * t), t * t, 1 - t)


def frame(i: int) -> MovingFrame:
    """Return the motion of frame i + 1 in frame i at the time `T`, with derivatives at 60 digits."""
    R, d = ORIENTATIONS[i], ORIGINS[i]
    return MovingFrame(
        array(R(mp.mpf(T))), array(d(mp.mpf(T))), array(angular_velocity(R, T)), array(rate(d, T)),
        array(angular_acceleration(R, T)), array(second_rate(d, T)),
    )  # fmt: skip
