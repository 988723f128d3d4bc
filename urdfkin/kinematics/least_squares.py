"""Nonlinear least squares by damped Gauss-Newton steps (Levenberg, 1944; Marquardt, 1963)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from urdfkin.kinematics.roundings import EPS, FloatArray

State = TypeVar("State")

_ROUNDS = 100
#: The initial, the smallest and the largest damping, relative to the largest singular value.
_DAMPING, _LEAST, _MOST = 1e-3, 1e-14, 1e3
#: Two factors for the damping: one for a step that reduces the error, and one for a step that does not.
_EASING, _HARDER = 0.03, 10.0
#: A step is slow if the error after the step is more than this fraction of the error before it.
_SLOW = 0.99
#: The iteration ends if a full step can reduce the squared error by at most this fraction.
_NOTHING = 1e-13
#: Rounding error of the sum of squares: the number of eps for each residual.
_ROUNDED = 4.0


def least_squares(
    start: State,
    linearized: Callable[[State], tuple[FloatArray, FloatArray]],
    size: Callable[[State], float],
    moved: Callable[[State, FloatArray], State],
    *,
    longest: float = math.inf,
    patience: int = 0,
) -> tuple[State, float]:
    """Return the state with the smallest residuals near the initial state, and the norm of these residuals.

    Args:
        start: The state from which the iteration starts.
        linearized: Returns the residuals (rows,) of a state and the negative derivatives (rows, parameters)
            of the residuals by the parameters.
        size: Returns the norm of a state's residuals.
        moved: Returns the new state for a state and a step (parameters,).
        longest: Largest component of a step.
        patience: The iteration ends after this many slow steps; 0 means no limit.
    """
    state, now, damping, slow = start, size(start), _DAMPING, 0
    for _ in range(_ROUNDS):
        r, J = linearized(state)
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
                if (after := size(trial)) < now:
                    state, now = trial, after
                    break
            damping *= _HARDER
        slow = slow + 1 if now > _SLOW * before else 0
        if now >= before * (1.0 - _ROUNDED * EPS * len(r)) or slow == patience > 0:
            break
        damping = max(_EASING * damping, _LEAST)
    return state, now
