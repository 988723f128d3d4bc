"""Where one model may have to be set for its axes to lie on another's: guesses to be tried, not results."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from urdfkin.model.tree import FloatArray
from urdfkin.sameness.mechanism import Mechanism, Screw
from urdfkin.sameness.rigid import angle_from_to

#: None, and half a turn about x, y, z: the ways in which two lines at an angle lie on themselves.
HALF_TURNS = tuple(
    np.diag(signs)
    for signs in (
        (1.0, 1.0, 1.0, 1.0),
        (1.0, -1.0, -1.0, 1.0),
        (-1.0, -1.0, 1.0, 1.0),
        (-1.0, 1.0, -1.0, 1.0),
    )
)


def zeros(u: Screw, ours: Screw, theirs: Screw, turns: bool) -> Iterator[float]:
    """By how much theirs must be turned about u, or slid along it, to lie as ours does."""
    if not turns:
        across = u.direction - ours.direction * (ours.direction @ u.direction)
        if across @ across > 1e-6:  # a guess to be tried, not a result
            yield float(across @ (ours.point - theirs.point) / (across @ across))
        return
    guesses = angle_from_to(u.direction, theirs.direction, ours.direction)
    if guesses is not None:
        yield guesses
        yield math.remainder(guesses + math.pi, 2.0 * math.pi)
    feet = [
        line.point - line.direction * (line.direction @ (line.point - u.point)) for line in (theirs, ours)
    ]
    guesses = angle_from_to(u.direction, feet[0] - u.point, feet[1] - u.point)
    if guesses is not None:
        yield guesses


def axis_frames(mechanism: Mechanism, body: int) -> Iterator[FloatArray]:
    """Frames on the first axis at a body with x across to the next that is not parallel: one for each way."""
    for first in mechanism.edges_of[body]:
        for second in mechanism.edges_of[first.beyond(body)]:
            if second is first or not all(mechanism.joint(k).kind.has_axis for k in (first, second)):
                continue
            s, t = mechanism.screw(first), mechanism.screw(second)
            x = np.cross(s.direction, t.direction)
            sine = float(np.linalg.norm(x))
            if sine < 1e-3:  # too parallel to begin with
                continue
            x = x / sine
            T = np.eye(4)
            T[:3, :3] = np.stack((x, np.cross(s.direction, x), s.direction), axis=1)
            # The foot of the common normal on the first axis.
            way = t.point - s.point
            along_first = float(np.cross(way, t.direction) @ x) / sine
            T[:3, 3] = s.point + s.direction * along_first
            yield T
