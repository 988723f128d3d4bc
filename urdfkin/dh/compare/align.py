"""Find the senses and the directions of x with which a reference table fits the URDF.

Three choices of a table do not change the robot: the sense of a joint, the direction of x along a common
normal, and the zero of theta. The first two are signs, and the offsets of theta follow from them. A beam
search extends sign patterns joint by joint and keeps those with the cells closest to the reference.
`urdfkin.dh.compare.fit` and `urdfkin.dh.compare.freedoms` fit the continuous parameters.
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

#: Numbers of sign patterns: returned, and kept at each joint.
PATTERNS, BEAM = 12, 128
#: Cost of each reversed joint (metres), so that the URDF's senses win between equal fits.
REVERSAL = 1e-9
#: Weight of a difference beside a prismatic axis: its line is free, so it decides only between equals.
_SLIDING = 1e-3
#: Axes with a smaller distance (metres) count as coinciding, and leave x free.
_NO_OFFSET = 1e-5
#: Decimals of metres and radians in the comparison of patterns.
_ALIKE = 6

_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Alignment:
    """A sign pattern and its frames.

    Attributes:
        senses: +1 or -1 for each joint: the reference's variable relative to the URDF's coordinate.
        offsets: Offset of each joint at q = 0, to add to the reference's theta (d of a prismatic joint).
        base: (4, 4) pose of the reference's frame 0 in the URDF's base.
        tool: (4, 4) pose of the URDF's tip in the reference's last frame.
        cost: Sum of the cells' differences, with angles times the reach (metres).
    """

    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: FloatArray
    tool: FloatArray
    cost: float


@dataclass(frozen=True, slots=True)
class _Partial:
    """An alignment of the chain up to one joint.

    Attributes:
        cost: Sum of the differences so far (metres).
        senses: Senses of the joints up to this one.
        offsets: Offsets of the joints before this one.
        phi_in: Rotation from this joint's DH frame to its URDF frame (rad).
        carry: Offset from this joint's DH frame to its URDF frame (metres).
        base: (4, 4) contribution of the first row's offset to the base.
        absorber: If the axes before the joint coincide, only the sum of their angles is defined. This is then
            the row with a free offset (that of row 0 is in the base), and the sign of its effect on x.
    """

    cost: float
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    phi_in: float
    carry: float
    base: FloatArray
    absorber: tuple[int, float] | None = None


def align(chain: FrameChain, reference: DHTable, count: int = PATTERNS, beam: int = BEAM) -> list[Alignment]:
    """Return the sign patterns closest to a standard reference table with the same kinds of joints.

    Prismatic joints leave patterns with equal cells. Only a fit can distinguish them, so up to `count`
    patterns are returned.
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
        partials = _without_equivalents(sorted(longer, key=lambda partial: partial.cost))[:beam]
    # If axes nearly coincide, many directions of x are nearly the same. The fit reaches one from another.
    by_senses: dict[tuple[int, ...], _Partial] = {}
    for partial in partials:
        by_senses.setdefault(partial.senses, partial)
    best = list(by_senses.values())[:count]
    return [_close_chain(partial, chain, reference) for partial in best]


def _first(sense: int) -> _Partial:
    return _Partial(REVERSAL * (sense < 0), (sense,), (), 0.0, 0.0, np.eye(4))


def _without_equivalents(partials: list[_Partial]) -> list[_Partial]:
    """Keep the first of several equivalent candidates; coinciding axes have many of them."""
    found: dict[tuple[object, ...], _Partial] = {}
    for one in partials:
        # With a free offset before the joint, both directions of x are equivalent.
        circle = math.pi if one.absorber else 2.0 * math.pi
        ahead = round(one.phi_in % circle, _ALIKE), round(one.carry, _ALIKE)
        found.setdefault((one.senses, one.absorber, *ahead), one)
    return list(found.values())


def _pose(chain: FrameChain, k: int, before: int, after: int) -> FloatArray:
    """Return the constant A_k with the z axis of a neighbouring joint reversed if its sense is -1."""
    A = chain.constants[k]
    A = _HALF_TURN @ A if before < 0 else A
    return np.array(A @ _HALF_TURN if after < 0 else A)


def _extend(
    partial: _Partial, chain: FrameChain, reference: DHTable, i: int, sense: int, reach: float
) -> list[_Partial]:
    """Extend an alignment from joint i to joint i + 1 (from 0), with both directions of x."""
    row, turns = reference.rows[i], [one.kind.turns for one in reference.rows]
    A = _pose(chain, i + 1, partial.senses[-1], sense)
    delta = row.d - partial.carry if turns[i] and i > 0 else 0.0
    found = []
    for step in _steps(A, row, delta, reach, row.theta - partial.phi_in, turns[i] and turns[i + 1]):
        candidate = _absorb(partial, step, row.theta) if i > 0 and not turns[i] else partial
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
    """Return the row before joint i + 1 with a free offset, and the sign of its effect on x, after a step."""
    if not step.free:
        return None
    sign = math.copysign(1.0, math.cos(step.alpha))
    if turns or i == 0:
        return i, sign
    return None if partial.absorber is None else (partial.absorber[0], sign * partial.absorber[1])


def _absorb(partial: _Partial, step: Step, theta: float) -> _Partial:
    """Give a prismatic joint the table's theta, if a free offset before it can absorb the difference."""
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
    """Yield the possible steps of a pair of axes, each with both directions of x.

    If the axes are nearly parallel in the URDF and in the reference, a Hayati step at the reference's d is
    tried too. There x is free if the distance is nearly zero, or if an axis is prismatic and has no fixed
    line (not `placed`). A step along the common normal is tried for prismatic axes too, because it needs no
    line.
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
        # With reach 0 every foot is far, so each pair that is not exactly parallel gets a Hayati step.
        cut = step_between(lifted, reach if sine < NEARLY_PARALLEL else 0.0, NearParallel.HAYATI, phi_free)
        steps.append(replace(cut, delta=cut.delta + delta))
    for step in steps:
        yield step
        yield replace(step.turned(), free=step.free)


def _close_chain(best: _Partial, chain: FrameChain, reference: DHTable) -> Alignment:
    """Return the complete alignment, with the base and tool that close the chain."""
    n = len(reference.rows)
    last = reference.rows[-1]
    start = _pose(chain, 0, 1, best.senses[0]) @ best.base
    rest = along_axis(best.phi_in - last.theta, best.carry - last.d) @ _pose(chain, n, best.senses[-1], 1)
    if n == 1:
        start, rest = start @ along_axis(-last.theta, -last.d), _pose(chain, 1, best.senses[0], 1)
    tool = np.asarray(np.linalg.solve(last.X, rest), np.float64)
    return Alignment(best.senses, (*best.offsets, 0.0), start, tool, best.cost)


def _apart(first: float, second: float) -> float:
    """Return the angle between two directions, 0 to pi."""
    return abs(math.remainder(first - second, 2.0 * math.pi))
