"""Whether the URDF that was made of a Denavit-Hartenberg table is the table's.

Pinocchio checks a robot's results against its URDF, which urdfkin wrote. That the URDF is the table's is
checked here, once: Pinocchio's placements of the tip against the products of the table's own matrices (7.64).
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.convert import link_names
from urdfkin.dh.table import DHTable
from urdfkin.kinematics.roundings import EPS, ROW, of_rows, of_rows_read_back
from urdfkin.model.frame_names import LinkFrame
from urdfkin.model.tree import FloatArray
from urdfkin.verify.sampling import sample
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import Verifier

#: Configurations that a robot is held against its table in.
_SAMPLES = 8


def check_table_source(verifier: Verifier, table: DHTable) -> None:
    """Raise TableError where the robot that Pinocchio reads in the URDF is not the table's."""
    if verifier.cannot() is not None:
        return
    q = sample(verifier.tree, _SAMPLES, np.random.default_rng(0))
    own = table.coupling.select(verifier.tree, q)
    theirs = verifier.oracle().placements(q, [LinkFrame.of(link_names(table)[-1])])[:, 0]
    off = np.abs(theirs - table.placement(own))[:, :3]
    # Base and tool may be rotations to six digits only, and Pinocchio's side makes rotations of them.
    rows, metres, defect = len(table.rows), table.rounding(own), _defect(table)
    turn = EPS * of_rows_read_back(rows) + defect
    allowed = metres * (of_rows_read_back(rows) / of_rows(rows) + defect / (EPS * ROW))
    if (off[..., 3].max(axis=-1) > allowed).any() or (off[..., :3] > turn).any():
        raise TableError(
            "the URDF that was made of a table is not the table's",
            where=table.robot,
            found=f"a tip {off[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the table",
        )


def _defect(table: DHTable) -> float:
    """How far base and tool are from rigid motions; a table may hold them to six digits."""
    rotations: list[FloatArray] = [table.base[:3, :3], table.tool[:3, :3]]
    return sum(float(np.linalg.norm(R.T @ R - np.eye(3))) for R in rotations)
