"""The URDF's own numbers in the frames of a published table: its senses, its directions of x, its zeros.

A table leaves signs to its author: which way each joint counts, which way x points. Every pattern of senses
with which the URDF's axes come near the table's cells is derived, and the one is taken whose cells are the
table's, whose zeros are, and whose base and tool are, in this order: Kinova's first joint so counts the other
way, and its frame 0 stands upright as on the sheet.
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

#: Of the reach, or radians: cells that differ by more are another robot's; zeros that do are other zeros.
_ANOTHER, _OTHER = 0.1, 1e-2
#: Likewise: cells that differ by less are equal.
_ROUNDING = 1e-12


def derive_like(chain: FrameChain, choices: Choices, reference: DHTable) -> DHTable:
    """A chain's table in the frames of another table, in the convention that the choices say.

    Args:
        chain: The path.
        choices: The options; `flip` holds the senses (`reversed_like`).
        reference: The other table.
    """
    standard = replace(choices, convention=Convention.STANDARD)
    return to_convention(derive(chain, standard, to_convention(reference, "standard")), choices.convention)


def reversed_like(chain: FrameChain, choices: Choices, reference: DHTable) -> tuple[str, ...]:
    """The joints that count the other way in a table than in the URDF.

    Raises:
        InputError: the table has other joints, or is another robot's.
    """
    check_joints(chain, reference)
    there = to_convention(reference, "standard")
    ends = replace(there, base=np.eye(4), tool=np.eye(4))
    names = [joint.name for joint in chain.joints]
    patterns = [one.senses for one in align(chain, ends)]
    # What the first and the last joint count, base and tool take up.
    patterns += [(-first, *rest) for first, *rest in patterns]
    patterns += [(*rest, -last) for *rest, last in patterns]
    best, flip = (math.inf, 0, 0, 0.0, 0), tuple[str, ...]()
    for senses in dict.fromkeys(patterns):
        reversed_ = tuple(name for name, sense in zip(names, senses, strict=True) if sense < 0)
        found = derive(chain, replace(choices, convention=Convention.STANDARD, flip=reversed_), there)
        if (unlike := _unlike(found, there, chain.reach or 1.0)) < best:
            best, flip = unlike, reversed_
    if best[0] > _ANOTHER:
        raise InputError(
            "the table to be like is of another robot",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"cells that differ by {best[0]:.0%} of the reach, or so many radians",
            remedy="hold it against the URDF with --compare, which says what differs",
            question=Question.DH_AND_URDF_DISAGREE,
        )
    return flip


def _unlike(found: DHTable, there: DHTable, reach: float) -> tuple[float, int, int, float, int]:
    """How unlike two tables are: in cells, by powers of ten, in zeros and signs of d, base and tool, senses.

    A slide's line may be anywhere, so that the cells that tell of it decide between equals only.
    """
    n, cells, lines, zeros = len(found.rows), 0.0, 0.0, 0
    for i, (row, other) in enumerate(zip(found.rows, there.rows, strict=True)):
        apart = abs(row.a - other.a) / reach
        if i < n - 1:  # base and tool take up what leads to the first axis and away from the last
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
