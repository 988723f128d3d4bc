"""Find the joint signs and directions of x with which a reference table fits a path.

The author of a table makes three choices that do not change the robot:

| Choice | In the search |
|---|---|
| positive direction of each joint | sign, +1 or -1 |
| direction of x along each common normal | sign, +1 or -1 |
| zero position of each theta | computed from the signs |

Each combination of signs gives a table of the path. A beam search keeps the tables that are closest to the
reference table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.common_normals import (
    MAX_HAYATI_TILT_SINE,
    NEARLY_PARALLEL,
    AxisTransform,
    find_axis_transform,
    shift_along_z,
    tilt_sine,
)
from urdfkin.dh.table import DHRow, DHTable, angle_difference, joint_transform
from urdfkin.model.chain import MIN_ROBOT_SIZE, FrameChain
from urdfkin.model.tree import FloatArray

MAX_PATTERNS = 12
BEAM_WIDTH = 128
#: Cost (m) of a joint with sign -1. Because of this cost, the URDF's joint signs are chosen among equally
#: good alignments.
_REVERSAL_COST = 1e-9
#: Weight of length differences next to a prismatic axis. The weight is small, because a prismatic axis can
#: move to any parallel line.
_NEAR_PRISMATIC_WEIGHT = 1e-3
#: Axes closer than this distance (m) count as coinciding, so x can have any direction.
_COINCIDENT_DISTANCE = 1e-5
_DECIMALS = 6

_HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class SignFit:
    """A likely combination of joint signs.

    Attributes:
        senses: Signs of the joints.
            With sign -1, theta or d decreases if the URDF's joint value increases.
        offsets: Joint offsets (rad or m), added to theta or d.
        base: (4, 4) pose T_base_0.
        tool: (4, 4) pose T_n_tip.
    """

    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: FloatArray
    tool: FloatArray


@dataclass(frozen=True, slots=True)
class _PartialAlignment:
    """Signs and offsets with which the first joints of a path match the first rows of a table.

    Rz(phi_in) Tz(delta_in) is the pose of the last joint's URDF frame in its DH frame.
    """

    cost: float  # Weighted sum (m) of the differences of cells, and a penalty for each reversed joint.
    senses: tuple[int, ...]
    offsets: tuple[float, ...]  # The last joint's offset is missing.
    phi_in: float
    delta_in: float
    base: FloatArray
    #: Row index of a joint offset that can be chosen freely, and a sign. With sign -1, an increase of this
    #: offset rotates the axis x about -z.
    free_offset: tuple[int, float] | None = None


def find_sign_fits(
    chain: FrameChain, reference: DHTable, count: int = MAX_PATTERNS, beam_width: int = BEAM_WIDTH
) -> list[SignFit]:
    """Return up to `count` alignments with a standard table, best first.

    Path and table must have equal joint kinds. With prismatic joints, several combinations of signs may give
    equal tables. Only a fit distinguishes these combinations.
    """
    reach = max(chain.reach, reference.span, MIN_ROBOT_SIZE)
    costs = {1: 0.0, -1: _REVERSAL_COST}
    partials = [_PartialAlignment(costs[sense], (sense,), (), 0.0, 0.0, np.eye(4)) for sense in costs]
    for i in range(len(reference.rows) - 1):
        longer = [
            extended
            for partial in partials
            for sense in costs
            for extended in _extend(partial, chain, reference, i, sense, reach)
        ]
        partials = _drop_equivalents(sorted(longer, key=lambda partial: partial.cost))[:beam_width]
    # If axes nearly coincide, many directions of x give nearly equal tables. For each combination of joint
    # signs, one alignment is enough, because the fit can rotate x.
    by_senses: dict[tuple[int, ...], _PartialAlignment] = {}
    for partial in partials:
        by_senses.setdefault(partial.senses, partial)
    return [_make_sign_fit(partial, chain, reference) for partial in list(by_senses.values())[:count]]


def _drop_equivalents(partials: list[_PartialAlignment]) -> list[_PartialAlignment]:
    """Keep one of several alignments that differ only by a rotation about coinciding axes."""
    different: dict[tuple[object, ...], _PartialAlignment] = {}
    for partial in partials:
        # If a joint offset can be chosen freely, a change of this offset by pi reverses x. Both directions of
        # x are then equivalent.
        period = math.pi if partial.free_offset else 2.0 * math.pi
        last_frame = round(partial.phi_in % period, _DECIMALS), round(partial.delta_in, _DECIMALS)
        different.setdefault((partial.senses, partial.free_offset, *last_frame), partial)
    return list(different.values())


def _constant_pose(chain: FrameChain, k: int, sense_before: int, sense_after: int) -> FloatArray:
    """Return A_k; the sign -1 rotates a joint frame by pi about its x axis."""
    A = chain.constants[k]
    A = _HALF_TURN_ABOUT_X @ A if sense_before < 0 else A
    return np.array(A @ _HALF_TURN_ABOUT_X if sense_after < 0 else A)


def _extend(
    partial: _PartialAlignment, chain: FrameChain, reference: DHTable, i: int, sense: int, reach: float
) -> list[_PartialAlignment]:
    """Add joint i + 1 with the sign `sense` in all possible ways."""
    row, turns = reference.rows[i], [one.kind.turns for one in reference.rows]
    both_revolute = turns[i] and turns[i + 1]
    A = _constant_pose(chain, i + 1, partial.senses[-1], sense)
    delta = row.d - partial.delta_in if turns[i] and i > 0 else 0.0
    extended = []
    for step in _possible_transforms(A, row, delta, reach, row.theta - partial.phi_in, both_revolute):
        candidate = _adjust_theta(partial, step, row.theta) if i > 0 and not turns[i] else partial
        theta, d = candidate.phi_in + step.phi, candidate.delta_in + step.delta
        theta_error = angle_difference(theta, row.theta)
        cost = candidate.cost + _REVERSAL_COST * (sense < 0)
        cost += reach * (abs(angle_difference(step.alpha, row.alpha)) + abs(step.beta - row.beta))
        cost += abs(step.a - row.a) * (1.0 if both_revolute else _NEAR_PRISMATIC_WEIGHT)
        if i > 0 and turns[i]:
            cost += abs(d - row.d) * (1.0 if turns[i - 1] and turns[i + 1] else _NEAR_PRISMATIC_WEIGHT)
        elif i > 0:
            cost += reach * abs(theta_error)
        offset, base = theta_error if turns[i] else d - row.d, candidate.base
        if i == 0:  # The first row's offset becomes part of the base.
            base, offset = joint_transform(step.phi - row.theta, step.delta - row.d), 0.0
        senses, offsets = (*candidate.senses, sense), (*candidate.offsets, offset)
        free_offset = _find_free_offset(candidate, step, i, turns[i])
        extended.append(
            _PartialAlignment(cost, senses, offsets, step.phi_next, step.delta_next, base, free_offset)
        )
    return extended


def _find_free_offset(
    partial: _PartialAlignment, step: AxisTransform, i: int, turns: bool
) -> tuple[int, float] | None:
    if not step.phi_is_free:
        return None
    sign = math.copysign(1.0, math.cos(step.alpha))
    if turns or i == 0:
        return i, sign
    return None if partial.free_offset is None else (partial.free_offset[0], sign * partial.free_offset[1])


def _adjust_theta(partial: _PartialAlignment, step: AxisTransform, theta: float) -> _PartialAlignment:
    """Change the free offset so that the last row's angle becomes `theta`.

    The last joint must be prismatic.
    """
    if partial.free_offset is None:
        return partial
    excess = partial.phi_in + step.phi - theta
    index, sign = partial.free_offset
    offsets, base = list(partial.offsets), partial.base
    if index == 0:
        base = base @ joint_transform(sign * excess, 0.0)
    else:
        offsets[index] += sign * excess
    return replace(partial, phi_in=partial.phi_in - excess, offsets=tuple(offsets), base=base)


def _possible_transforms(
    A: FloatArray, row: DHRow, delta: float, reach: float, default_phi: float, both_revolute: bool
) -> Iterator[AxisTransform]:
    steps = []
    sine = tilt_sine(A)
    near = abs(math.sin(row.alpha)) < MAX_HAYATI_TILT_SINE and sine < MAX_HAYATI_TILT_SINE
    if not near or row.beta == 0.0:
        steps.append(find_axis_transform(A, reach, default_phi, hayati=False))
    if near:
        shifted = shift_along_z(A, -delta)
        # The axis of a prismatic joint can be moved to any parallel line. Therefore, x can have any direction
        # if one of the two joints is prismatic.
        if math.hypot(shifted[0, 3], shifted[1, 3]) < _COINCIDENT_DISTANCE or not both_revolute:
            shifted[:2, 3] = 0.0
        # Above `NEARLY_PARALLEL`, a Hayati row needs a common normal that is farther away than the reach. The
        # reach 0 therefore gives a Hayati row, unless the common normal passes through both origins.
        hayati_reach = reach if sine < NEARLY_PARALLEL else 0.0
        step = find_axis_transform(shifted, hayati_reach, default_phi, hayati=True)
        steps.append(replace(step, delta=step.delta + delta))
    for step in steps:
        yield step
        yield replace(step.with_reversed_x(), phi_is_free=step.phi_is_free)


def _make_sign_fit(partial: _PartialAlignment, chain: FrameChain, reference: DHTable) -> SignFit:
    n, last = len(reference.rows), reference.rows[-1]
    base = _constant_pose(chain, 0, 1, partial.senses[0]) @ partial.base
    tip = _constant_pose(chain, n, partial.senses[-1], 1)
    if n == 1:
        base = base @ joint_transform(-last.theta, -last.d)
    else:
        tip = joint_transform(partial.phi_in - last.theta, partial.delta_in - last.d) @ tip
    tool = np.asarray(np.linalg.solve(last.X, tip), np.float64)
    return SignFit(partial.senses, (*partial.offsets, 0.0), base, tool)
