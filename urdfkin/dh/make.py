"""`dh_table`: a tree, two frames and a few choices in, a table out."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from urdfkin.dh.derive import choices_of, derive
from urdfkin.dh.lengths import demand_squares
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
    )
    tolerance = checked_tolerance(snap)
    if tolerance == 0.0:
        return derive(exact, choices)
    rounder, placed = snap_chain(tree, tip, base, tolerance)
    table, changes = snap_thetas(derive(rounder, choices), exact, tolerance)
    changes += [replace(change, row=row_of_constant(table, k)) for k, change in placed]
    return replace(table, snap=statement(exact, table, changes, tolerance))
