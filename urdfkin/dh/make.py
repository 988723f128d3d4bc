"""Make the Denavit-Hartenberg table of the path between two frames of a robot."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from urdfkin.dh.derive import choices_of, derive
from urdfkin.dh.match_table import derive_like, reversed_like
from urdfkin.dh.noise import demand_squares
from urdfkin.dh.snapping import checked_tolerance, row_of_constant, snap_chain, snap_thetas, statement
from urdfkin.dh.table import DHTable
from urdfkin.model.chain import chain
from urdfkin.model.tree import KinematicTree


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
        near_parallel: "hayati" gives nearly parallel axes a fifth parameter beta; "strict" uses the four
            parameters, with possible offsets of kilometres.
        snap: Tolerance in radians. Angles within it of a multiple of 15 degrees become that multiple, and the
            table's `snap` reports the effect. 0 leaves every angle as it is in the file.
        last: "tip" lets the last row reach the tip where four parameters suffice; "flange" puts the rest into
            the tool.
        parallel_offset: Row that takes the offset along a run of parallel axes: the "last" (the first row
            after the run), the "first", or "each" row its own link's.
        flip: Names of joints to reverse; their rows have sense -1.
        first: "base" puts the transform from the base to the first axis into d_1 and theta_1 where possible;
            "joint" puts it into the base, so that d_1 and theta_1 are zero (Craig's frame 0).
        sign: Direction of x: "theta" limits theta to a right angle; "a" and "alpha" make that cell not
            negative.
        slide: Line of a prismatic joint, of which only the direction is defined: "drawn" as in the URDF, or
            "minimal", through the origin of the next revolute joint, so that a = 0.
        like: A published table. The result takes its senses, directions of x, zeros of the first and last
            joint, and offsets along parallel axes. The lengths, angles, base and tool are the URDF's. `flip`,
            `first`, `last`, `sign` and `parallel_offset` are then ignored.

    Raises:
        UnknownNameError: a frame or a joint that does not exist.
        InputError: an invalid value of an option, or a planar or floating joint on the path.
        RangeError: lengths with squares outside the range of doubles.
    """
    exact = chain(tree, tip, base)
    # Check the whole path from the root, because Pinocchio measures from the root.
    ends = [tip] if base is None else [base, tip]
    demand_squares(tree.joints[i] for end in ends for i in tree.path(tree.frame_link(end)))
    choices = choices_of(
        exact,
        convention=convention,
        near_parallel=near_parallel,
        last=last,
        parallel_offset=parallel_offset,
        flip=flip,
        first=first,
        sign=sign,
        slide=slide,
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
