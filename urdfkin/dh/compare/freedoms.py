"""Base, tool and offsets with which a reference table comes closest to a URDF, its cells untouched.

Damped least squares (Levenberg, 1944; Marquardt, 1963) on the tip's twists. Two joints whose axes nearly
coincide do nearly the same: their offsets may grow against each other along a valley that bends round, and
whose floor falls by no more than the distance of the axes. So the damping is taken away as long as steps
succeed, and where the descent ends, turns of such pairs against each other are tried from there.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from urdfkin.dh.compare.fit import LONGEST_STEP, Model, Wanted, columns, moved

_ROUNDS = 60
#: Of the largest singular value: where damping starts, and between what it stays.
_DAMPING, _LEAST, _MOST = 1e-3, 1e-14, 1e2
#: What a success leaves of the damping, and how much more of it there is after a failure.
_EASING, _HARDER = 0.03, 10.0
#: A step that leaves more than this is slow; after so many of them in turn a descent ends.
_SLOW, _PATIENCE = 0.99, 4
#: Fit up to which nothing better is looked for, metres for each metre of reach.
_ROUNDING = 1e-13
#: Turns that are tried of one offset against the next.
_TURNS = (math.pi, 0.5 * math.pi, -0.5 * math.pi)


def fit_freedoms(model: Model, wanted: Wanted, *, turns: bool) -> Model:
    """The table's best fit.

    Args:
        model: Where to begin.
        wanted: What the URDF's tip does.
        turns: Whether offsets of neighbours are turned against each other where a descent ends.
    """
    for _ in range(2 * len(model.cells)):
        model, size = _descended(model, wanted)
        if not turns or size <= _ROUNDING * wanted.scale * math.sqrt(6 * len(wanted.values)):
            break
        turned = min(_turned(model), key=lambda one: _size(one, wanted), default=model)
        if _size(turned, wanted) >= size:
            break
        model = turned
    return model


def _size(model: Model, wanted: Wanted) -> float:
    return float(np.linalg.norm(wanted.errors(model.poses(wanted.values))))


def _descended(model: Model, wanted: Wanted) -> tuple[Model, float]:
    size, damping, slow = _size(model, wanted), _DAMPING, 0
    for _ in range(_ROUNDS):
        poses, freedoms, _ = columns(model, wanted)
        U, S, Vt = np.linalg.svd(freedoms, full_matrices=False)
        along = U.T @ wanted.errors(poses)
        before = size
        while damping <= _MOST:
            free = Vt.T @ (S / (S**2 + (damping * S[0]) ** 2) * along)
            if np.abs(free).max() <= LONGEST_STEP * wanted.scale:
                trial = moved(model, free, wanted.scale)
                if (trial_size := _size(trial, wanted)) < size:
                    model, size = trial, trial_size
                    break
            damping *= _HARDER
        slow = slow + 1 if size > _SLOW * before else 0
        if size == before or slow == _PATIENCE:
            break
        damping = max(_EASING * damping, _LEAST)
    return model, size


def _turned(model: Model) -> list[Model]:
    """The model with one offset turned and the next one turned back: little moves if the axes coincide."""
    found = []
    for i in range(len(model.cells) - 1):
        sense = math.copysign(1.0, math.cos(float(model.cells[i, 3])))
        for turn in _TURNS if model.turns[i] and model.turns[i + 1] else ():
            cells = model.cells.copy()
            cells[i, 0] += turn
            cells[i + 1, 0] -= sense * turn
            found.append(replace(model, cells=cells))
    return found
