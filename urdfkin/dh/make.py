"""`dh_table`: a tree, two frames and a few choices in, a table out."""

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
    """The Denavit-Hartenberg table of the path between two frames, exact to rounding.

    Args:
        tree: The robot.
        tip: Name of a link or joint frame.
        base: Likewise; the root link when None.
        convention: "standard" (distal, the text's) or "modified" (proximal, Craig's).
        near_parallel: "hayati" gives nearly parallel axes a fifth parameter beta; "strict" keeps to four,
            which may need offsets of kilometres.
        snap: Radians: angles within this of a multiple of 15 degrees are made round, and the table's `snap`
            says what that moved. 0 leaves every angle as the file has it.
        last: "tip" lets the last row reach the tip where four parameters can; "flange" leaves the tip to
            the tool.
        parallel_offset: Which row of a run of parallel axes has the offset along them: the "last" (first
            after the run), the "first", or "each" its own link's.
        flip: Names of joints to count the other way; their rows get sense -1.
        first: "base" puts the way from the base to the first axis into d_1 and theta_1 where it can; "joint"
            into the base, so that d_1 and theta_1 are zero (Craig's frame 0).
        sign: Which way x points: "theta" keeps theta within a right angle, "a" and "alpha" keep that cell
            from being negative.
        slide: Where the line of a sliding joint is, which has a direction only: "drawn" as in the URDF, or
            "minimal", through the next turning axis' origin, so that its a is zero.
        like: A published table: its senses, directions of x, zeros of the first and last joint and offsets
            along parallel axes are taken, with the URDF's own numbers, base and tool; `flip`, `first`,
            `last`, `sign` and `parallel_offset` then have no say.

    Raises:
        UnknownNameError: a frame or a joint that does not exist.
        InputError: an option's value, or a planar or floating joint on the way.
        RangeError: lengths whose squares leave the range of doubles.
    """
    exact = chain(tree, tip, base)
    # The whole way counts, whatever part of it the table is of: Pinocchio measures from the root.
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
