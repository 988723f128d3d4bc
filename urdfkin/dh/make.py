"""Make the Denavit-Hartenberg table of the path between two frames of a robot.

You can request a table with the same frames as a published table. The author of a table chooses the positive
direction of each joint and the direction of each x axis. `reversed_like` finds all likely combinations of
positive directions. It derives a table for each combination, and selects the table that is closest to the
published table. The closest table is the table whose cells differ least. If several tables have equally close
cells, urdfkin compares the zero positions of the joints, and then base and tool. In the published table of a
Kinova arm, for example, the positive direction of the first joint is opposite to the URDF. The z axis of
frame 0 then points up, as in the data sheet.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from urdfkin.dh.common_normals import NearParallel, demand_squares
from urdfkin.dh.compare.agreement import check_joints
from urdfkin.dh.compare.fit import align
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import Choices, First, Last, ParallelOffset, Sign, Slide, choice, derive
from urdfkin.dh.snapping import checked_tolerance, row_of_constant, snap_chain, snap_thetas, statement
from urdfkin.dh.table import DHConvention, DHTable, convention_of
from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.tree import KinematicTree

#: A table whose cells differ by more than `_ANOTHER` (rad, or relative to the reach) describes another robot.
#: Two zero positions of a joint are different if their angles (rad) differ by more than `_OTHER`.
_ANOTHER, _OTHER = 0.1, 1e-2
#: Two cells with a smaller difference (relative to the reach, or in rad) are treated as equal.
_ROUNDING = 1e-12


def derive_like(chain: FrameChain, choices: Choices, reference: DHTable) -> DHTable:
    """Return a chain's table with the same frames as another table, in the convention of `choices`.

    The attribute `flip` of `choices` must contain the joints from `reversed_like`.
    """
    standard = replace(choices, convention=DHConvention.STANDARD)
    return to_convention(derive(chain, standard, to_convention(reference, "standard")), choices.convention)


def reversed_like(chain: FrameChain, choices: Choices, reference: DHTable) -> tuple[str, ...]:
    """Return the names of the joints that have opposite positive directions in the table and in the URDF.

    If the table has other joints, or describes another robot, InputError is raised.
    """
    check_joints(chain, reference)
    there = to_convention(reference, "standard")
    ends = replace(there, base=np.eye(4), tool=np.eye(4))
    names = [joint.name for joint in chain.joints]
    patterns = [one.senses for one in align(chain, ends)]
    # A change of base or tool can compensate for a reversed sign of the first or of the last joint.
    # Therefore, both signs are tried for each of these two joints.
    patterns += [(-first, *rest) for first, *rest in patterns]
    patterns += [(*rest, -last) for *rest, last in patterns]
    best, flip = (math.inf, 0, 0, 0.0, 0), tuple[str, ...]()
    for senses in dict.fromkeys(patterns):
        reversed_ = tuple(name for name, sense in zip(names, senses, strict=True) if sense < 0)
        found = derive(chain, replace(choices, convention=DHConvention.STANDARD, flip=reversed_), there)
        if (key := _difference_key(found, there, chain.reach or 1.0)) < best:
            best, flip = key, reversed_
    if best[0] > _ANOTHER:
        raise InputError(
            "the table of `like` describes another robot",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"cells of the table that differ by {best[0]:.0%} of the reach, or by {best[0]:.2g} rad",
            remedy="compare the table with the URDF by --compare, which reports the differences",
            question=QuestionsSection.DH_AND_URDF_DISAGREE,
        )
    return flip


def _difference_key(found: DHTable, there: DHTable, reach: float) -> tuple[float, int, int, float, int]:
    """Return a key that ranks tables by their difference from another table; the smallest key is the best.

    The entries of the key are, in this order:

    - the largest difference of the cells,
    - the power of ten of the largest difference, here with the cells next to a prismatic axis, which can be
      shifted,
    - the number of rows with different zero positions, plus the number of rows with different signs of d,
    - the number of poses that differ, among base and tool,
    - the number of joints with reversed positive direction.
    """
    n, cells, lines, zeros = len(found.rows), 0.0, 0.0, 0
    for i, (row, other) in enumerate(zip(found.rows, there.rows, strict=True)):
        apart = abs(row.a - other.a) / reach
        if i < n - 1:  # Base and tool contain the transforms outside the axes.
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


def dh_table(
    tree: KinematicTree,
    tip: str,
    base: str | None = None,
    convention: str = "standard",
    *,
    near_parallel: str = "hayati",
    snap: float = 0.0,
    last: str = "tip",
    parallel_offset: str = "last",
    flip: Collection[str] = (),
    first: str = "base",
    sign: str = "theta",
    slide: str = "drawn",
    like: DHTable | None = None,
) -> DHTable:
    """Return the Denavit-Hartenberg table of the path between two frames, exact to rounding.

    Args:
        tree: The robot.
        tip: Name of a link or joint frame.
        base: Name of a link or joint frame; the root link when None.
        convention: "standard" (distal, the textbook's) or "modified" (proximal, Craig's).
        near_parallel: "hayati" gives nearly parallel axes a fifth parameter beta; "strict" uses only the four
            parameters, and may give offsets of kilometres.
        snap: Tolerance in radians. An angle that differs by at most this tolerance from a multiple of 15
            degrees becomes that multiple. The table's attribute `snap` reports the effect. 0 leaves every
            angle as it is in the file.
        last: "tip": the last row reaches the tip if four parameters suffice. "flange": the tool contains the
            transform from the last axis to the tip.
        parallel_offset: For consecutive parallel axes: the row that contains the offset along these axes.
            "last": the last of these rows contains the sum of the offsets. "first": the first of these rows
            contains the sum. "each": every row contains the offset of its own link.
        flip: Names of joints whose positive direction is reversed. The attribute `sense` of their rows is -1.
        first: "base": if possible, d_1 and theta_1 contain the transform from the base to the first axis.
            "joint": the base contains this transform, so that d_1 and theta_1 are zero (Craig's frame 0).
        sign: Rule for the direction of x. "theta": |theta| is at most a right angle. "a": the cell a is not
            negative. "alpha": the cell alpha is not negative.
        slide: Position of the axes of prismatic joints, which define only a direction. "drawn": the axis
            passes through the joint's origin in the URDF. "minimal": the axis passes through the origin of
            the next revolute joint, so that a is 0.
        like: A published table. The result has the same positive directions of the joints, directions of x,
            and offsets along parallel axes. The zero positions of the first and the last joint are also the
            same. The lengths, the angles, the base and the tool come from the URDF. `flip`, `first`, `last`,
            `sign` and `parallel_offset` are then ignored.

    Raises:
        UnknownNameError: a frame or a joint does not exist.
        InputError: an option has an invalid value, or the path contains a planar or floating joint.
        RangeError: the square of a length is outside the range of doubles.
    """
    exact = chain(tree, tip, base)
    # The whole path from the root is checked, because Pinocchio computes poses relative to the root.
    ends = [tip] if base is None else [base, tip]
    demand_squares(tree.joints[i] for end in ends for i in tree.path(tree.frame_link(end)))
    names = [joint.name for joint in exact.joints]
    for name in flip:
        if name not in names:
            raise UnknownNameError("joint", name, names, where=f"path {exact.base} to {exact.tip}")
    choices = Choices(
        convention_of(convention),
        choice(NearParallel, "near_parallel", near_parallel),
        choice(Last, "last", last),
        choice(ParallelOffset, "parallel_offset", parallel_offset),
        tuple(flip),
        choice(First, "first", first),
        choice(Sign, "sign", sign),
        choice(Slide, "slide", slide),
    )
    if like is not None:
        choices = replace(choices, flip=reversed_like(exact, choices, like))
    tolerance = checked_tolerance(snap)
    if tolerance == 0.0:
        return derive(exact, choices) if like is None else derive_like(exact, choices, like)
    rounder, placed = snap_chain(tree, tip, base, tolerance)
    made = derive(rounder, choices) if like is None else derive_like(rounder, choices, like)
    table, changes = snap_thetas(made, exact, tolerance)
    changes += [replace(change, row=row_of_constant(table, k)) for k, change in placed]
    return replace(table, snap=statement(exact, table, changes, tolerance))
