"""Which way each joint and each common normal of a reference table points in the URDF.

A table leaves freedoms that cannot matter: which way a joint counts, which way x points along a common
normal, where theta is zero. They are discrete (signs) or follow from the signs (offsets of theta). A beam
search goes along the chain, joint by joint, keeping the sign patterns whose cells so far come closest to
the reference's; the continuous rest is `urdfkin.dh.compare.fit`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urdfkin.chain import FrameChain
from urdfkin.dh.elements import along_axis
from urdfkin.dh.normals import FAR_FEET, NearParallel, Step, step_between
from urdfkin.dh.table import DHTable
from urdfkin.tree import FloatArray

#: Sign patterns that are kept at each joint.
BEAM = 128
#: Each reversed joint costs this much (metres), so that equal fits keep the URDF's senses.
REVERSAL = 1e-9

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
    """The chain up to one joint: its sense, and the way from its DH frame to its URDF frame."""

    cost: float
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    phi_in: float
    carry: float
    base: FloatArray


def align(chain: FrameChain, reference: DHTable, count: int = 12) -> list[Alignment]:
    """The sign patterns closest to a standard reference table with as many joints of the same kinds.

    Sliding joints leave patterns that cells cannot tell apart; the fit can, so several are returned.
    """
    reach = max(chain.reach, reference.span, 1e-9)
    n = len(reference.rows)
    partials = [_first(sense) for sense in (1, -1)]
    for i in range(n - 1):
        longer = [
            extended
            for partial in partials
            for sense in (1, -1)
            for extended in _extend(partial, chain, reference, i, sense, reach)
        ]
        partials = sorted(longer, key=lambda partial: partial.cost)[:BEAM]
    return [_closed(partial, chain, reference) for partial in partials[:count]]


def _first(sense: int) -> _Partial:
    return _Partial(REVERSAL * (sense < 0), (sense,), (), 0.0, 0.0, np.eye(4))


def _pose(chain: FrameChain, k: int, before: int, after: int) -> FloatArray:
    """The constant A_k with the z of the joints around it turned round where the sense is -1."""
    A = chain.constants[k]
    A = _HALF_TURN @ A if before < 0 else A
    return np.array(A @ _HALF_TURN if after < 0 else A)


def _extend(
    partial: _Partial, chain: FrameChain, reference: DHTable, i: int, sense: int, reach: float
) -> list[_Partial]:
    """Go on from joint i to joint i + 1 (from 0), with both directions of x."""
    row = reference.rows[i]
    A = _pose(chain, i + 1, partial.senses[-1], sense)
    turning = row.kind.turns
    delta = row.d - partial.carry if turning and i > 0 else 0.0
    step = _step(A, row.alpha, delta, reach, row.theta - partial.phi_in)
    found = []
    for candidate in (step, step.turned()):
        theta = partial.phi_in + candidate.phi
        d = partial.carry + candidate.delta
        cost = partial.cost + REVERSAL * (sense < 0)
        cost += reach * (_apart(candidate.alpha, row.alpha) + abs(candidate.beta - row.beta))
        # A sliding axis has no place of its own: where it is drawn counts only between equals.
        cost += abs(candidate.a - row.a) * (1.0 if turning and reference.rows[i + 1].kind.turns else 1e-3)
        if i > 0 and turning and reference.rows[i - 1].kind.turns and reference.rows[i + 1].kind.turns:
            cost += abs(d - row.d)
        if not turning and i > 0:
            cost += reach * _apart(theta, row.theta)
        offset = math.remainder(theta - row.theta, 2.0 * math.pi) if turning else d - row.d
        base = partial.base
        if i == 0:  # the first row's offset goes into the base
            base = along_axis(candidate.phi - row.theta, candidate.delta - row.d)
            offset = 0.0
        found.append(
            _Partial(
                cost,
                (*partial.senses, sense),
                (*partial.offsets, offset),
                candidate.phi_next,
                candidate.delta_next,
                base,
            )
        )
    return found


def _step(A: FloatArray, alpha: float, delta: float, reach: float, phi_free: float) -> Step:
    """A pair taken apart the way the reference's is: by the normal plane where that one is parallel."""
    sine = math.hypot(A[0, 2], A[1, 2])
    if abs(math.sin(alpha)) < FAR_FEET and sine < FAR_FEET:
        lifted = A.copy()
        lifted[2, 3] -= delta
        # Any lateral offset below a hundredth of a millimetre counts as none: x is free there.
        if math.hypot(lifted[0, 3], lifted[1, 3]) < 1e-5:
            lifted[:2, 3] = 0.0
        # Feet count as far, so that a pair that is not exactly parallel is cut by the normal plane.
        step = step_between(lifted, reach if sine < 1e-2 else 0.0, NearParallel.HAYATI, phi_free)
        return Step(
            step.phi,
            step.delta + delta,
            step.a,
            step.alpha,
            step.beta,
            step.phi_next,
            step.delta_next,
            step.free,
        )
    return step_between(A, reach, NearParallel.STRICT, phi_free)


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
