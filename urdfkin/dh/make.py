"""Make the Denavit-Hartenberg table of the path between two frames of a robot.

A published table may reverse positive joint directions of the URDF: Kinova's table reverses the first joint.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from urdfkin.dh.common_normals import check_lengths
from urdfkin.dh.compare.agreement import check_joints
from urdfkin.dh.compare.signs import find_sign_fits
from urdfkin.dh.convert import to_convention
from urdfkin.dh.derive import MAX_CELL_DIFFERENCE, DerivationOptions, derive
from urdfkin.dh.snapping import check_snap_tolerance, row_of_constant, snap_chain, snap_report, snap_thetas
from urdfkin.dh.table import DHConvention, DHTable, angle_difference, as_table, convention_of
from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.errors.validators import as_instance, as_names, as_str
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.tree import KinematicTree

#: Two angles theta (rad), or two entries of rotation matrices, count as equal up to this difference.
_SAME_ANGLE_TOLERANCE = 1e-2
#: Largest difference at which two cells are treated as equal (rad, or relative to the reach).
_MIN_CELL_DIFFERENCE = 1e-12
#: With the argument `like`, the published table determines these options.
_SET_BY_LIKE = ("last", "parallel_offset", "flip", "first", "sign")


def derive_matching_table(chain: FrameChain, options: DerivationOptions, reference: DHTable) -> DHTable:
    """Derive a table with the free choices of `reference`; `find_reversed_joints` returns `options.flip`."""
    standard = replace(options, convention=DHConvention.STANDARD)
    return to_convention(derive(chain, standard, to_convention(reference, "standard")), options.convention)


def find_reversed_joints(
    chain: FrameChain, options: DerivationOptions, reference: DHTable
) -> tuple[str, ...]:
    check_joints(chain, reference)
    standard = to_convention(reference, "standard")
    without_ends = replace(standard, base=np.eye(4), tool=np.eye(4))
    names = [joint.name for joint in chain.joints]
    patterns = [fit.senses for fit in find_sign_fits(chain, without_ends)]
    # The base can compensate for a reversed first joint, and the tool for a reversed last joint. Therefore,
    # the opposite directions of these two joints are added.
    patterns += [(-first, *rest) for first, *rest in patterns]
    patterns += [(*rest, -last) for *rest, last in patterns]
    best, best_flip = (math.inf, 0, 0, 0.0, 0), tuple[str, ...]()
    for senses in dict.fromkeys(patterns):
        flip = tuple(name for name, sense in zip(names, senses, strict=True) if sense < 0)
        table = derive(chain, replace(options, convention=DHConvention.STANDARD, flip=flip), standard)
        if (key := _difference_key(table, standard, chain.reach or 1.0)) < best:
            best, best_flip = key, flip
    if best[0] > MAX_CELL_DIFFERENCE:
        raise InputError(
            "the table in the argument `like` describes a different robot",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"cells of the table that differ by {best[0]:.0%} of the reach, or by {best[0]:.2g} rad",
            remedy="use --compare to see the differences between the table and the URDF",
            question=QuestionsSection.DH_AND_URDF_DISAGREE,
        )
    return best_flip


def _difference_key(table: DHTable, reference: DHTable, reach: float) -> tuple[float, int, int, float, int]:
    """Return a sort key; the table most similar to the reference has the smallest key."""
    n, unique, shiftable, zeros = len(table.rows), 0.0, 0.0, 0
    for i, (row, other) in enumerate(zip(table.rows, reference.rows, strict=True)):
        a = abs(row.a - other.a) / reach
        theta = abs(angle_difference(row.theta, other.theta))
        # The tool compensates for differences of a and alpha in the last row.
        if i < n - 1:
            is_unique = row.kind.turns and table.rows[i + 1].kind.turns
            unique = max(unique, abs(angle_difference(row.alpha, other.alpha)), a * is_unique)
            shiftable = max(shiftable, abs(row.beta - other.beta), a)
        if 0 < i < n - 1 and row.kind.turns:
            d = abs(row.d - other.d) / reach
            unique, shiftable = max(unique, d * _has_unique_offset(table, i)), max(shiftable, d)
        elif 0 < i < n - 1:
            shiftable = max(shiftable, theta)
        zeros += (theta > _SAME_ANGLE_TOLERANCE) + (row.d * other.d < 0.0)
    ends = sum(
        float(np.abs(T[:3, :3] - T_reference[:3, :3]).max() > _SAME_ANGLE_TOLERANCE)
        for T, T_reference in ((table.base, reference.base), (table.tool, reference.tool))
    )
    power = math.ceil(math.log10(max(unique, shiftable, _MIN_CELL_DIFFERENCE)))
    return round(unique, 2), power, zeros, ends, sum(row.sense < 0 for row in table.rows)


def _has_unique_offset(table: DHTable, i: int) -> bool:
    """Return whether d of a revolute row is independent of the positions of prismatic axes.

    A prismatic axis can move to any parallel line. Any row of parallel axes can contain their offset.
    """
    rows, first, last = table.rows, i, i
    while first > 0 and abs(math.sin(rows[first - 1].alpha)) <= _SAME_ANGLE_TOLERANCE:
        first -= 1
    while last < len(rows) - 1 and abs(math.sin(rows[last].alpha)) <= _SAME_ANGLE_TOLERANCE:
        last += 1
    return all(row.kind.turns for row in rows[max(first - 1, 0) : last + 2])


def make_dh_table(
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
    """Return the Denavit-Hartenberg table of the path between two frames.

    If `snap` is 0, the table is exact up to rounding errors.

    Args:
        tree: The robot.
        tip: A link or joint frame.
        base: A link or joint frame; None: the root.
        convention: "standard" (distal) or "modified" (proximal, Craig's). The textbook uses "standard".
        near_parallel: "hayati": nearly parallel axes have a fifth parameter, beta. "strict": each row has
            only four parameters; offsets of kilometres are possible.
        snap: Tolerance, rad. An angle becomes a multiple of 15 degrees if it changes by at most `snap`. The
            table's attribute `snap` lists these angles, and bounds of the effect on the tip.
        last: "tip": the last row ends at the tip if possible. "flange": the last row ends on the last joint's
            axis, and the tool leads from this axis to the tip.
        parallel_offset: Selects the rows for the offsets d along consecutive parallel axes. "last": the row
            of the last of these axes contains the sum of the offsets. "first": the row of the first of these
            axes contains the sum. "each": row i contains the offset from joint i to joint i + 1.
        flip: Joints whose positive direction is reversed (`sense` is -1).
        first: "base": d_1 and theta_1 contain the translation along the first axis and the rotation about
            this axis. "joint": d_1 and theta_1 are 0, and the base transform contains the translation and the
            rotation (Craig's frame 0).
        sign: Direction of x, except in the last row, where the tip determines x. "theta": |theta| <= pi/2.
            "a": a >= 0; if a is 0, alpha >= 0. "alpha": alpha >= 0; if alpha is 0, a >= 0. If a and alpha
            are 0, the rule for "theta" applies.
        slide: Position of a prismatic joint's axis. "drawn": the axis passes through the joint's origin.
            There are three exceptions. The axis of the first joint passes through the base's origin. The axis
            of the last joint passes through the tip if a standard table then needs no tool. With
            near_parallel="strict", an axis passes through the origin of a neighbour with a nearly parallel
            axis. "minimal": the axis passes through the origin of a neighbouring revolute joint, so the
            distance a of the two axes is 0. The next joint has priority. Without a revolute neighbour,
            "minimal" equals "drawn".
        like: A published table. The result copies the positive joint directions, the directions of the x axes
            and the offsets d along parallel axes. It also copies theta of the first and last row, and the
            last a and alpha of a standard table. Base and tool are adjusted to the copied cells. The URDF
            determines all other numbers. With `like`, the options `last`, `parallel_offset`, `flip`, `first`
            and `sign` must have their default values.

    Raises:
        UnknownNameError: a frame or a joint does not exist.
        InputError: an option is invalid, or is not allowed with `like`; `like` describes another robot; or a
            joint is planar or floating.
        RangeError: a coordinate of a joint's origin in the URDF, or a length in `like`, is above 1e150 m.
    """
    as_instance(tree, KinematicTree, "tree", "pass robot.tree")
    exact = make_chain(tree, tip, base)
    # The whole path from the root is checked, because Pinocchio computes poses relative to the root.
    ends = [tip] if base is None else [base, tip]
    check_lengths(tree.joints[i] for end in ends for i in tree.path(tree.frame_link(end)))
    names = [joint.name for joint in exact.joints]
    flip = tuple(as_str(name, "each of flip") for name in as_names(flip, "flip"))
    for name in flip:
        if name not in names:
            raise UnknownNameError("joint", name, names, where=f"path {exact.base} to {exact.tip}")
    options = DerivationOptions(
        convention_of(convention),
        near_parallel,
        last,
        parallel_offset,
        flip,
        first,
        sign,
        slide,
    )
    if like is not None:
        as_table(like, "like")
        for name in _SET_BY_LIKE:
            if (value := getattr(options, name)) != getattr(DerivationOptions(), name):
                raise InputError(
                    f"`{name}` and `like` exclude each other: the published table determines the frames",
                    found=f"{name}={value!r}",
                    remedy=f"leave out `{name}` or `like`",
                )
        options = replace(options, flip=find_reversed_joints(exact, options, like))

    def make_table(path: FrameChain) -> DHTable:
        return derive(path, options) if like is None else derive_matching_table(path, options, like)

    tolerance = check_snap_tolerance(snap)
    if tolerance == 0.0:
        return make_table(exact)
    path, pose_changes = snap_chain(tree, tip, base, tolerance)
    table, changes = snap_thetas(make_table(path), exact, tolerance)
    changes += [replace(change, row=row_of_constant(table, k)) for k, change in pose_changes]
    return replace(table, snap=snap_report(exact, table, changes, tolerance))
