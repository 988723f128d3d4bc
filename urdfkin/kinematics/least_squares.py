"""Nonlinear least squares by damped Gauss-Newton steps (Levenberg, 1944; Marquardt, 1963)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from urdfkin.kinematics.roundings import EPS, FloatArray

State = TypeVar("State")
Seen = TypeVar("Seen")

_ROUNDS = 100
#: The damping is relative to the largest singular value; these are its first, smallest and largest value.
_DAMPING, _LEAST, _MOST = 1e-3, 1e-14, 1e3
#: The damping is multiplied by `_EASING` if a step reduces the error, else by `_HARDER`.
_EASING, _HARDER = 0.03, 10.0
#: A step is slow if the error after the step is more than this fraction of the error before it.
_SLOW = 0.99
#: The iteration ends if a full step can reduce the squared error by at most this fraction.
_NOTHING = 1e-13
#: The norm of n residuals has a relative rounding error of n times this number of eps.
_ROUNDED = 4.0


def least_squares(
    start: State,
    residuals: Callable[[State], tuple[FloatArray, Seen]],
    derivatives: Callable[[State, Seen], FloatArray],
    moved: Callable[[State, FloatArray], State],
    *,
    longest: float = math.inf,
    patience: int = 0,
) -> tuple[State, float]:
    """Return the state with the smallest residuals near the initial state, and the norm of these residuals.

    Args:
        start: The state from which the iteration starts.
        residuals: Returns the residuals (rows,) of a state, and intermediate results for `derivatives`.
        derivatives: Returns the negative derivatives (rows, parameters) of the residuals.
        moved: Returns the new state after a step (parameters,) from a state.
        longest: Largest component of a step.
        patience: The iteration ends after this many slow steps; 0 means no limit.
    """
    state, damping, slow = start, _DAMPING, 0
    r, seen = residuals(start)
    now = float(np.linalg.norm(r))
    for _ in range(_ROUNDS):
        J = derivatives(state, seen)
        units = np.linalg.norm(J, axis=0)
        units[units == 0.0] = 1.0
        U, S, Vt = np.linalg.svd(J / units, full_matrices=False)
        before, along = now, U.T @ r
        if float(along @ along) <= _NOTHING * now**2:
            break
        while damping <= _MOST:
            step = Vt.T @ (S / (S**2 + (damping * S[0]) ** 2) * along) / units
            if np.abs(step).max() <= longest:
                trial = moved(state, step)
                left, seen_there = residuals(trial)
                if (after := float(np.linalg.norm(left))) < now:
                    state, now, r, seen = trial, after, left, seen_there
                    break
            damping *= _HARDER
        slow = slow + 1 if now > _SLOW * before else 0
        if now >= before * (1.0 - _ROUNDED * EPS * len(r)) or slow == patience > 0:
            break
        damping = max(_EASING * damping, _LEAST)
    return state, now
