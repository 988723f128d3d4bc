"""The robots of the textbook, as URDFs in urdfkin and as Denavit-Hartenberg tables at 60 digits."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from tests.high_precision import (
    angular_acceleration,
    angular_velocity,
    array,
    column,
    mp,
    rate,
    second_rate,
    turn,
)
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.loading import load

HALF_PI = mp.pi / 2


@cache
def robot(name: str) -> Robot:
    return load(name)


@dataclass(frozen=True)
class Row:
    """A row of a table as in figure 7.15.

    The joint's coordinate is theta of a revolute joint, and is added to d of a prismatic joint (theta = 0).
    """

    d: Any
    a: Any
    alpha: Any
    turns: bool = True


ROWS = {
    "one_link": (Row(0, mp.mpf(0.8), 0),),
    "planar_two_link": (Row(0, mp.mpf(0.5), 0), Row(0, mp.mpf(0.4), 0)),
    "polar": (Row(0, 0, -HALF_PI), Row(0, 0, HALF_PI, turns=False)),
    "elbow": (
        Row(mp.mpf(0.6), 0, HALF_PI),
        Row(0, mp.mpf(0.5), 0),
        Row(0, 0, -HALF_PI),
        Row(mp.mpf(0.45), 0, HALF_PI),
        Row(0, 0, -HALF_PI),
        Row(0, 0, 0),
    ),
}


@dataclass(frozen=True)
class Motion:
    """A robot of the textbook with the motion q + v t + a t^2 / 2, and its quantities at t = 0."""

    name: str
    q: FloatArray
    v: FloatArray
    a: FloatArray

    @property
    def rows(self) -> tuple[Row, ...]:
        return ROWS[self.name]

    def coordinate(self, i: int, t: Any) -> Any:
        return mp.mpf(self.q[i - 1]) + mp.mpf(self.v[i - 1]) * t + mp.mpf(self.a[i - 1]) * t * t / 2

    def R(self, i: int) -> Callable[[Any], Any]:
        """Return R_0_i as a function of time."""
        return lambda t: self._frames(t)[i][0]

    def d(self, i: int) -> Callable[[Any], Any]:
        """Return d_0i as a function of time."""
        return lambda t: self._frames(t)[i][1]

    def between(self, i: int) -> Callable[[Any], Any]:
        """Return d_{i-1,i} as a function of time."""
        return lambda t: self._frames(t)[i][1] - self._frames(t)[i - 1][1]

    def _frames(self, t: Any) -> list[tuple[Any, Any]]:
        """Return orientation and origin of frames 0 to n; each row is Rz Tz Tx Rx (7.64)."""
        R, d = mp.eye(3), column(0, 0, 0)
        frames = [(R, d)]
        for i, row in enumerate(self.rows, start=1):
            moved = self.coordinate(i, t)
            turned = R * turn("z", moved if row.turns else 0)
            d = d + turned * column(row.a, 0, row.d if row.turns else row.d + moved)
            R = turned * turn("x", row.alpha)
            frames.append((R, d))
        return frames

    # -- at t = 0, as doubles ------------------------------------------------------------------------

    def axis(self, i: int) -> FloatArray:
        """Return z_{i-1}, the axis of joint i."""
        return array(self.R(i - 1)(mp.mpf(0)))[:, 2]

    def x(self, i: int) -> FloatArray:
        """Return x_i."""
        return array(self.R(i)(mp.mpf(0)))[:, 0]

    def rotation(self, i: int) -> FloatArray:
        """Return R_0_i."""
        return array(self.R(i)(mp.mpf(0)))

    def origin(self, i: int) -> FloatArray:
        """Return d_0i."""
        return array(self.d(i)(mp.mpf(0)))

    def w(self, i: int) -> FloatArray:
        """Return w_0i."""
        return array(angular_velocity(self.R(i), 0.0))

    def alpha(self, i: int) -> FloatArray:
        """Return w-dot_0i."""
        return array(angular_acceleration(self.R(i), 0.0))

    def vel(self, i: int) -> FloatArray:
        """Return d-dot_0i."""
        return array(rate(self.d(i), 0.0))

    def acc(self, i: int) -> FloatArray:
        """Return d-dot-dot_0i."""
        return array(second_rate(self.d(i), 0.0))

    def between_rate(self, i: int) -> FloatArray:
        """Return d-dot_{i-1,i} as seen from frame 0."""
        return array(rate(self.between(i), 0.0))


def motion(name: str, seed: int = 1) -> Motion:
    generator = np.random.default_rng(seed)
    n = len(ROWS[name])
    return Motion(name, generator.uniform(0.3, 1.4, n), generator.normal(size=n), generator.normal(size=n))


def only(moving: Motion, i: int) -> Motion:
    unit = np.eye(len(moving.rows))[i - 1]
    return Motion(moving.name, moving.q, moving.v * unit, moving.a * unit)


def close(found: Any, expected: Any, size: float = 1.0) -> bool:
    return bool(np.abs(np.asarray(found) - expected).max() <= 32 * np.finfo(np.float64).eps * size)
