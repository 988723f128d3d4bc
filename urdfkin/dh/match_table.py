"""Derive a table with the URDF's numbers in the frames of a published table.

The author of a table chooses the sense of each joint and the direction of each x. For every pattern of senses
that fits the published table approximately, a table is derived. The result is the table closest to the
published one: first in its cells, then in its zeros, then in base and tool. For Kinova, for example, the
first joint has sense -1, and frame 0 is upright as in the data sheet.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from urdfkin.dh.compare.agreement import check_joints
from urdfkin.dh.compare.align import align
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import Choices, derive
from urdfkin.dh.table import Convention, DHTable
from urdfkin.errors import InputError, Question
from urdfkin.model.chain import FrameChain

#: Differences (relative to the reach, or in rad) of the cells of another robot, and of different zeros.
_ANOTHER, _OTHER = 0.1, 1e-2
#: Cells with a smaller difference (relative to the reach, or in rad) are equal.
_ROUNDING = 1e-12


def derive_like(chain: FrameChain, choices: Choices, reference: DHTable) -> DHTable:
    """Return a chain's table in the frames of another table, in the convention of `choices`.

    Args:
        chain: The path.
        choices: The options, with `flip` from `reversed_like`.
        reference: The other table.
    """
    standard = replace(choices, convention=Convention.STANDARD)
    return to_convention(derive(chain, standard, to_convention(reference, "standard")), choices.convention)


def reversed_like(chain: FrameChain, choices: Choices, reference: DHTable) -> tuple[str, ...]:
    """Return the joints with opposite senses in the table and in the URDF.

    Raises:
        InputError: the table has other joints, or describes another robot.
    """
    check_joints(chain, reference)
    there = to_convention(reference, "standard")
    ends = replace(there, base=np.eye(4), tool=np.eye(4))
    names = [joint.name for joint in chain.joints]
    patterns = [one.senses for one in align(chain, ends)]
    # Base and tool absorb the senses of the first and the last joint.
    patterns += [(-first, *rest) for first, *rest in patterns]
    patterns += [(*rest, -last) for *rest, last in patterns]
    best, flip = (math.inf, 0, 0, 0.0, 0), tuple[str, ...]()
    for senses in dict.fromkeys(patterns):
        reversed_ = tuple(name for name, sense in zip(names, senses, strict=True) if sense < 0)
        found = derive(chain, replace(choices, convention=Convention.STANDARD, flip=reversed_), there)
        if (key := _difference_key(found, there, chain.reach or 1.0)) < best:
            best, flip = key, reversed_
    if best[0] > _ANOTHER:
        raise InputError(
            "the table for `like` describes another robot",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"cells that differ by {best[0]:.0%} of the reach, or by {best[0]:.2g} rad",
            remedy="compare it with the URDF by --compare, which reports the differences",
            question=Question.DH_AND_URDF_DISAGREE,
        )
    return flip


def _difference_key(found: DHTable, there: DHTable, reach: float) -> tuple[float, int, int, float, int]:
    """Return a key that ranks tables by their difference; the smallest is the best.

    The key compares, in this order: the cells, their power of ten, zeros and signs of d, base and tool,
    senses. The line of a prismatic joint is free, so cells that depend on it only affect the power of ten.
    """
    n, cells, lines, zeros = len(found.rows), 0.0, 0.0, 0
    for i, (row, other) in enumerate(zip(found.rows, there.rows, strict=True)):
        apart = abs(row.a - other.a) / reach
        if i < n - 1:  # base and tool absorb the transforms before the first and after the last axis
            placed = row.kind.turns and found.rows[i + 1].kind.turns
            cells = max(cells, abs(_angle(row.alpha, other.alpha)), apart * placed)
            lines = max(lines, abs(row.beta - other.beta), apart)
        if 0 < i < n - 1 and row.kind.turns:
            cells = max(cells, abs(row.d - other.d) / reach)
        elif 0 < i < n - 1:
            lines = max(lines, abs(_angle(row.theta, other.theta)))
        zeros += abs(_angle(row.theta, other.theta)) > _OTHER
        zeros += row.d * other.d < 0.0
    ends = sum(
        float(np.abs(mine[:3, :3] - theirs[:3, :3]).max() > _OTHER)
        for mine, theirs in ((found.base, there.base), (found.tool, there.tool))
    )
    power = math.ceil(math.log10(max(cells, lines, _ROUNDING)))
    return round(cells, 2), power, zeros, ends, sum(row.sense < 0 for row in found.rows)


def _angle(one: float, other: float) -> float:
    return math.remainder(one - other, 2.0 * math.pi)
