"""Small serial robots to make tables of."""

from __future__ import annotations

from dataclasses import replace

from tests.random_chains import z_joint
from urdfkin.dh import DHTable
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, build_tree


def arm(*steps: FloatArray, kinds: str = "", tip: FloatArray | None = None) -> KinematicTree:
    """A serial robot whose joints have their axis along z and stand at the given poses; R or P each."""
    named = {"R": JointKind.REVOLUTE, "P": JointKind.PRISMATIC}
    joints = [
        (z_joint(f"j{i + 1}", T, named[kind]), f"l{i}", f"l{i + 1}")
        for i, (T, kind) in enumerate(zip(steps, kinds or "R" * len(steps), strict=True))
    ]
    end = z_joint("end", tip, JointKind.FIXED)
    return build_tree("arm", "l0", [*joints, (end, f"l{len(steps)}", "tip")])


def with_cell(table: DHTable, row: int, cell: str, value: float) -> DHTable:
    """The table with another value in one cell."""
    rows = list(table.rows)
    rows[row] = replace(rows[row], **{cell: value})  # type: ignore[arg-type]
    return replace(table, rows=tuple(rows))
