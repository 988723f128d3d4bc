"""Nonlinear least squares by damped Gauss-Newton steps (Levenberg, 1944; Marquardt, 1963)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.roundings import EPS

State = TypeVar("State")
Intermediate = TypeVar("Intermediate")

_MOST_STEPS = 100
#: First, smallest and largest damping, as multiples of the largest singular value.
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-14, 1e3
#: Factors of the damping after an accepted step and after a rejected step.
_DAMPING_DECREASE, _DAMPING_INCREASE = 0.03, 10.0
#: A step is slow if the new error is more than this fraction of the old error.
_SLOW_STEP_RATIO = 0.99
#: The iteration ends if a full step would reduce the squared error by at most this fraction.
_LEAST_REDUCTION = 1e-13
#: The norm of n residuals has a relative rounding error of at most `_NORM_ROUNDING * n * eps`.
_NORM_ROUNDING = 4.0


def least_squares(
    start: State,
    residuals: Callable[[State], tuple[FloatArray, Intermediate]],
    derivatives: Callable[[State, Intermediate], FloatArray],
    move: Callable[[State, FloatArray], State],
    *,
    max_step: float = math.inf,
    patience: int = 0,
) -> tuple[State, float]:
    """Search near `start` for a state with the smallest norm of the residuals.

    Return the best state and the norm of its residuals.

    Args:
        start: First state.
        residuals: Computes the residuals (n,) of a state, and a value that is passed to `derivatives`.
        derivatives: Computes the negative derivatives (n, parameters) of the residuals.
        move: Applies a step (parameters,) to a state and returns the new state.
        max_step: Upper bound on the absolute value of each component of a step.
        patience: The search ends after this number of consecutive slow steps. 0 means no limit.
    """
    state, damping, slow = start, _FIRST_DAMPING, 0
    r, intermediate = residuals(start)
    error = float(np.linalg.norm(r))
    for _ in range(_MOST_STEPS):
        J = derivatives(state, intermediate)
        units = np.linalg.norm(J, axis=0)
        units[units == 0.0] = 1.0
        U, S, Vt = np.linalg.svd(J / units, full_matrices=False)
        before, along = error, U.T @ r
        if float(along @ along) <= _LEAST_REDUCTION * error**2:
            break
        while damping <= _MOST_DAMPING:
            step = Vt.T @ (S / (S**2 + (damping * S[0]) ** 2) * along) / units
            if np.abs(step).max() <= max_step:
                trial = move(state, step)
                trial_r, trial_intermediate = residuals(trial)
                if (trial_error := float(np.linalg.norm(trial_r))) < error:
                    state, error, r, intermediate = trial, trial_error, trial_r, trial_intermediate
                    break
            damping *= _DAMPING_INCREASE
        slow = slow + 1 if error > _SLOW_STEP_RATIO * before else 0
        if error >= before * (1.0 - _NORM_ROUNDING * EPS * len(r)) or slow == patience > 0:
            break
        damping = max(_DAMPING_DECREASE * damping, _LEAST_DAMPING)
    return state, error
