"""Which way each joint and each common normal of a reference table points in the URDF.

A table leaves freedoms that cannot matter: which way a joint counts, which way x points along a common
normal, where theta is zero. They are discrete (signs) or follow from the signs (offsets of theta). A beam
search goes along the chain, joint by joint, keeping the sign patterns whose cells so far come closest to
the reference's; the continuous rest is `urdfkin.dh.compare.fit`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.common_normals import FAR_FEET, NEARLY_PARALLEL, NearParallel, Step, step_between
from urdfkin.dh.table import DHRow, DHTable, along_axis
from urdfkin.model.chain import LEAST_SIZE, FrameChain
from urdfkin.model.tree import FloatArray

#: Sign patterns that are handed out, and that are kept at each joint.
PATTERNS, BEAM = 12, 128
#: Each reversed joint costs this much (metres), so that equal fits keep the URDF's senses.
REVERSAL = 1e-9
#: What is left of a difference where an axis slides, and where it is drawn counts only between equals.
_SLIDING = 1e-3
#: Metres: an offset between axes that is smaller counts as none, and leaves x free.
_NO_OFFSET = 1e-5
#: Decimals of metres and radians to which patterns are alike.
_ALIKE = 6

_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Alignment:
    """A sign pattern and the frames that it gives.

    Attributes:
        senses: Of each joint: +1 or -1, the reference's variable against the URDF's coordinate.
        offsets: Of each joint: what to add to the reference's theta (d of a sliding joint) at q = 0.
        base: (4, 4) pose of the reference's frame 0 in the URDF's base.
        tool: (4, 4) pose of the URDF's tip in the reference's last frame.
        cost: Metres: the sum of the cells' differences, angles times the reach.
    """

    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: FloatArray
    tool: FloatArray
    cost: float


@dataclass(frozen=True, slots=True)
class _Partial:
    """The chain up to one joint: its sense, and the way from its DH frame to its URDF frame.

    Where the axes before the joint coincide, only the sum of their angles shows; `absorber` is the row whose
    offset may still change (row 0's stands in the base), and the sign with which it turns the joint's x.
    """

    cost: float
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    phi_in: float
    carry: float
    base: FloatArray
    absorber: tuple[int, float] | None = None


def align(chain: FrameChain, reference: DHTable, count: int = PATTERNS, beam: int = BEAM) -> list[Alignment]:
    """The sign patterns closest to a standard reference table with as many joints of the same kinds.

    Sliding joints leave patterns that cells cannot tell apart; the fit can, so up to `count` are returned.
    """
    reach = max(chain.reach, reference.span, LEAST_SIZE)
    n = len(reference.rows)
    partials = [_first(sense) for sense in (1, -1)]
    for i in range(n - 1):
        longer = [
            extended
            for partial in partials
            for sense in (1, -1)
            for extended in _extend(partial, chain, reference, i, sense, reach)
        ]
        partials = _unlike_each_other(sorted(longer, key=lambda partial: partial.cost))[:beam]
    # Where axes nearly coincide, many patterns of x are nearly the same: the fit finds from one to another.
    by_senses: dict[tuple[int, ...], _Partial] = {}
    for partial in partials:
        by_senses.setdefault(partial.senses, partial)
    best = list(by_senses.values())[:count]
    return [_closed(partial, chain, reference) for partial in best]


def _first(sense: int) -> _Partial:
    return _Partial(REVERSAL * (sense < 0), (sense,), (), 0.0, 0.0, np.eye(4))


def _unlike_each_other(partials: list[_Partial]) -> list[_Partial]:
    """Of those that go on alike the first: coinciding axes have many, which would crowd others out."""
    found: dict[tuple[object, ...], _Partial] = {}
    for one in partials:
        # What an offset before it may still turn goes on alike whichever way x points.
        circle = math.pi if one.absorber else 2.0 * math.pi
        ahead = round(one.phi_in % circle, _ALIKE), round(one.carry, _ALIKE)
        found.setdefault((one.senses, one.absorber, *ahead), one)
    return list(found.values())


def _pose(chain: FrameChain, k: int, before: int, after: int) -> FloatArray:
    """The constant A_k with the z of the joints around it turned round where the sense is -1."""
    A = chain.constants[k]
    A = _HALF_TURN @ A if before < 0 else A
    return np.array(A @ _HALF_TURN if after < 0 else A)


def _extend(
    partial: _Partial, chain: FrameChain, reference: DHTable, i: int, sense: int, reach: float
) -> list[_Partial]:
    """Go on from joint i to joint i + 1 (from 0), with both directions of x."""
    row, turns = reference.rows[i], [one.kind.turns for one in reference.rows]
    A = _pose(chain, i + 1, partial.senses[-1], sense)
    delta = row.d - partial.carry if turns[i] and i > 0 else 0.0
    found = []
    for step in _steps(A, row, delta, reach, row.theta - partial.phi_in, turns[i] and turns[i + 1]):
        candidate = _absorbed(partial, step, row.theta) if i > 0 and not turns[i] else partial
        theta, d = candidate.phi_in + step.phi, candidate.carry + step.delta
        cost = candidate.cost + REVERSAL * (sense < 0)
        cost += reach * (_apart(step.alpha, row.alpha) + abs(step.beta - row.beta))
        cost += abs(step.a - row.a) * (1.0 if turns[i] and turns[i + 1] else _SLIDING)
        if i > 0 and turns[i]:
            cost += abs(d - row.d) * (1.0 if turns[i - 1] and turns[i + 1] else _SLIDING)
        if not turns[i] and i > 0:
            cost += reach * _apart(theta, row.theta)
        offset = math.remainder(theta - row.theta, 2.0 * math.pi) if turns[i] else d - row.d
        base = candidate.base
        if i == 0:  # the first row's offset goes into the base
            base, offset = along_axis(step.phi - row.theta, step.delta - row.d), 0.0
        found.append(
            _Partial(
                cost,
                (*candidate.senses, sense),
                (*candidate.offsets, offset),
                step.phi_next,
                step.delta_next,
                base,
                _absorber(candidate, step, i, turns[i]),
            )
        )
    return found


def _absorber(partial: _Partial, step: Step, i: int, turns: bool) -> tuple[int, float] | None:
    """The row before joint i + 1 whose offset turns its x and shows nowhere else, after a step."""
    if not step.free:
        return None
    sign = math.copysign(1.0, math.cos(step.alpha))
    if turns or i == 0:
        return i, sign
    return None if partial.absorber is None else (partial.absorber[0], sign * partial.absorber[1])


def _absorbed(partial: _Partial, step: Step, theta: float) -> _Partial:
    """The chain with a sliding joint's theta as it is in the table, if an offset before it can do that."""
    if partial.absorber is None:
        return partial
    excess = partial.phi_in + step.phi - theta
    index, sign = partial.absorber
    offsets, base = list(partial.offsets), partial.base
    if index == 0:
        base = base @ along_axis(sign * excess, 0.0)
    else:
        offsets[index] += sign * excess
    return replace(partial, phi_in=partial.phi_in - excess, offsets=tuple(offsets), base=base)


def _steps(
    A: FloatArray, row: DHRow, delta: float, reach: float, phi_free: float, placed: bool
) -> Iterator[Step]:
    """A pair taken apart in the ways the reference's may be, with both directions of x.

    Axes that are nearly parallel in both are cut by the normal plane too, at the reference's own d. An offset
    of nearly nothing, or of an axis that slides and has no place (not `placed`), counts as none: x is free
    there. Across both axes x needs no place, and is tried for sliding ones too.
    """
    steps = []
    sine = math.hypot(A[0, 2], A[1, 2])
    near = abs(math.sin(row.alpha)) < FAR_FEET and sine < FAR_FEET
    if not near or row.beta == 0.0:
        steps.append(step_between(A, reach, NearParallel.STRICT, phi_free))
    if near:
        lifted = A.copy()
        lifted[2, 3] -= delta
        if math.hypot(lifted[0, 3], lifted[1, 3]) < _NO_OFFSET or not placed:
            lifted[:2, 3] = 0.0
        # Without a reach every foot is far, and a pair that is not exactly parallel is cut by the plane.
        cut = step_between(lifted, reach if sine < NEARLY_PARALLEL else 0.0, NearParallel.HAYATI, phi_free)
        steps.append(replace(cut, delta=cut.delta + delta))
    for step in steps:
        yield step
        yield replace(step.turned(), free=step.free)


def _closed(best: _Partial, chain: FrameChain, reference: DHTable) -> Alignment:
    """Base and tool that make the ends meet."""
    n = len(reference.rows)
    last = reference.rows[-1]
    start = _pose(chain, 0, 1, best.senses[0]) @ best.base
    rest = along_axis(best.phi_in - last.theta, best.carry - last.d) @ _pose(chain, n, best.senses[-1], 1)
    if n == 1:
        start, rest = start @ along_axis(-last.theta, -last.d), _pose(chain, 1, best.senses[0], 1)
    tool = np.asarray(np.linalg.solve(last.X, rest), np.float64)
    return Alignment(best.senses, (*best.offsets, 0.0), start, tool, best.cost)


def _apart(first: float, second: float) -> float:
    """The angle between two directions, 0 to pi."""
    return abs(math.remainder(first - second, 2.0 * math.pi))
