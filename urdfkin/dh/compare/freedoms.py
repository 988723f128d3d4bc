"""Fit base, tool and joint offsets of a reference table to a URDF, with its cells unchanged.

The method is damped least squares (`urdfkin.kinematics.least_squares`) on the tip's twists. Two joints with
nearly coinciding axes have nearly the same effect. Opposite changes of their offsets follow a curved valley
of the error, along which the error falls by at most the distance of the axes. The damping therefore decreases
while steps succeed. At the end of a descent, opposite rotations of such pairs are tried as new starts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from urdfkin.dh.compare.align import Alignment, align
from urdfkin.dh.compare.fit import LONGEST_STEP, Model, TargetPoses, columns, moved
from urdfkin.dh.table import DHTable, along_axis, between_axes
from urdfkin.kinematics.least_squares import least_squares
from urdfkin.kinematics.roundings import EPS, of_a_fit
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray

#: A descent ends after this many slow steps.
_PATIENCE = 4
#: Mean error at which a fit ends, relative to the reach.
_ROUNDING = 1e-13
#: A fast fit fits this many sign patterns, and keeps this many at each joint.
HASTY = (3, 16)
#: Tip error that counts as rounding, relative to the reach; the search ends there.
_AT_ROUNDING = 1e-12
#: Fraction of the tip error below which another sign pattern replaces the written one.
_TWICE_AS_GOOD = 0.5
#: Opposite rotations of two consecutive offsets that are tried (rad).
_TURNS = (math.pi, 0.5 * math.pi, -0.5 * math.pi)


def as_written(standard: DHTable) -> Model:
    """Return the table as it is written; its variables are the URDF's coordinates."""
    return Model(
        np.array([(row.theta, row.d, row.a, row.alpha, row.beta) for row in standard.rows]),
        np.array([float(row.kind.turns) for row in standard.rows]),
        np.array([float(row.sense) for row in standard.rows]),
        standard.base,
        standard.tool,
    )


def fitted_model(
    chain: FrameChain,
    standard: DHTable,
    written: Model,
    wanted: TargetPoses,
    enough: float = 0.0,
    *,
    hasty: bool = False,
) -> Model:
    """Return the best fit of the table as it is written and of the likely sign patterns.

    The written signs have priority: another pattern must halve the error.
    """

    def size(model: Model) -> float:
        metres, radians = wanted.apart(model)
        return metres + wanted.scale * radians

    if size(written) <= EPS * of_a_fit(0) * wanted.scale:
        return written
    best, best_size = written, size(written)
    for start in starts(chain, standard, written, *(HASTY if hasty else ())):
        # Least squares minimize the sum, but the worst sample decides. The start may be better there.
        model = min(fit_freedoms(start, wanted, turns=not hasty), start, key=size)
        needed = 1.0 if start is written else _TWICE_AS_GOOD
        if (its_size := size(model)) < needed * best_size:
            best, best_size = model, its_size
        if best_size <= max(enough, _AT_ROUNDING * wanted.scale):
            break
    return ends_gathered(best, written)


def ends_gathered(model: Model, written: Model) -> Model:
    """Move the first joint's offset into the base and the last joint's offset into the tool."""
    cells, n = model.cells.copy(), len(model.cells)
    _, _, a, alpha, beta = cells[-1]
    step = between_axes(a, alpha, beta)
    base, tool = model.base, model.tool
    for i in dict.fromkeys((0, n - 1)):
        k = model.own(i)
        change = cells[i, k] - written.cells[i, k]
        cells[i, k] = written.cells[i, k]
        S = along_axis(change, 0.0) if model.turns[i] else along_axis(0.0, change)
        if i == 0:
            base = base @ S
        else:
            tool = np.linalg.solve(step, S @ step) @ tool
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(tool))


def starts(chain: FrameChain, standard: DHTable, written: Model, *effort: int) -> Iterator[Model]:
    """Yield the starts of fits: the table as it is written, then each likely sign pattern."""
    yield written
    for aligned in align(chain, replace(standard, base=np.eye(4), tool=np.eye(4)), *effort):
        yield _start(standard, aligned)


def _start(standard: DHTable, aligned: Alignment) -> Model:
    """Return the reference with the senses, base, tool and offsets of an alignment."""
    start = replace(
        as_written(standard),
        senses=np.array(aligned.senses, dtype=np.float64),
        base=aligned.base,
        tool=aligned.tool,
    )
    for i, offset in enumerate(aligned.offsets):
        start.cells[i, start.own(i)] += offset
    return start


def fit_freedoms(model: Model, wanted: TargetPoses, *, turns: bool, ends: bool = False) -> Model:
    """Fit base, tool and offsets.

    Args:
        model: The start.
        wanted: Target poses from the URDF.
        turns: Whether to try opposite rotations of consecutive offsets at the end of a descent.
        ends: Whether to fit only base and tool.
    """
    for _ in range(2 * len(model.cells)):
        model, size = _descend(model, wanted, ends)
        if not turns or size <= _ROUNDING * wanted.scale * math.sqrt(6 * len(wanted.values)):
            break
        turned = min(_opposite_rotations(model), key=lambda one: _size(one, wanted), default=model)
        if _size(turned, wanted) >= size:
            break
        model = turned
    return model


def _size(model: Model, wanted: TargetPoses) -> float:
    return float(np.linalg.norm(wanted.errors(model.poses(wanted.values))))


def _descend(model: Model, wanted: TargetPoses, ends: bool) -> tuple[Model, float]:
    def linearized(model: Model) -> tuple[FloatArray, FloatArray]:
        poses, freedoms, _ = columns(model, wanted)
        return wanted.errors(poses), freedoms[:, : 12 if ends else None]

    return least_squares(
        model,
        linearized,
        lambda model: _size(model, wanted),
        lambda model, free: moved(model, free, wanted.scale),
        longest=LONGEST_STEP * wanted.scale,
        patience=_PATIENCE,
    )


def _opposite_rotations(model: Model) -> list[Model]:
    """Return models with opposite rotations of two consecutive offsets, for nearly coinciding axes."""
    found = []
    for i in range(len(model.cells) - 1):
        sense = math.copysign(1.0, math.cos(float(model.cells[i, 3])))
        for turn in _TURNS if model.turns[i] and model.turns[i + 1] else ():
            cells = model.cells.copy()
            cells[i, 0] += turn
            cells[i + 1, 0] -= sense * turn
            found.append(replace(model, cells=cells))
    return found
