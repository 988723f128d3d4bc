"""Small serial robots to make tables of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdfkin.dh import DHTable
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, build_tree


def arm(*steps: FloatArray, kinds: str = "", tip: FloatArray | None = None) -> KinematicTree:
    """A serial robot whose joints have their axis along z and stand at the given poses; R or P each."""
    named = {"R": JointKind.REVOLUTE, "P": JointKind.PRISMATIC}
    z = np.array([0.0, 0.0, 1.0])
    joints = [
        (Joint(f"j{i + 1}", named[kind], 0, T, z), f"l{i}", f"l{i + 1}")
        for i, (T, kind) in enumerate(zip(steps, kinds or "R" * len(steps), strict=True))
    ]
    end = Joint("end", JointKind.FIXED, 0, np.eye(4) if tip is None else tip, z)
    return build_tree("arm", "l0", [*joints, (end, f"l{len(steps)}", "tip")])


def with_cell(table: DHTable, row: int, cell: str, value: float) -> DHTable:
    """The table with another value in one cell."""
    rows = list(table.rows)
    rows[row] = replace(rows[row], **{cell: value})  # type: ignore[arg-type]
    return replace(table, rows=tuple(rows))
