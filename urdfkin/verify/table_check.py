"""Check the URDF that urdfkin writes for a Denavit-Hartenberg table.

Pinocchio checks a robot's results with the robot's URDF text. For a robot that was made from a table, urdfkin
writes this text. This module checks the text itself. The module compares Pinocchio's placements of the tip
with the products of the table's own matrices (eq. 7.64).
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.convert import link_names
from urdfkin.dh.table import DHTable
from urdfkin.kinematics.roundings import EPS, ROW, of_rows, of_rows_read_back
from urdfkin.model.configuration import sample
from urdfkin.model.tree import FloatArray, LinkFrame
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import Verifier

#: Random configurations for the comparison.
_SAMPLES = 8


def check_table_source(verifier: Verifier, table: DHTable) -> None:
    """Compare the robot that Pinocchio reads from the URDF with the table.

    Args:
        verifier: Verifier of the robot.
        table: The table that the robot was made of.

    Raises:
        TableError: the placements of the tip differ by more than rounding.
    """
    if verifier.cannot() is not None:
        return
    q = sample(verifier.tree, _SAMPLES, np.random.default_rng(0))
    own = table.coupling.select(verifier.tree, q)
    theirs = verifier.oracle().placements(QueryBatch([LinkFrame.of(link_names(table)[-1])], (q,)))[:, 0]
    off = np.abs(theirs - table.placement(own))[:, :3]
    # The matrices of base and tool may be rotations to six digits only, but the URDF contains exact
    # rotations.
    rows, metres, defect = len(table.rows), table.rounding(own), _defect(table)
    turn = EPS * of_rows_read_back(rows) + defect
    allowed = metres * (of_rows_read_back(rows) / of_rows(rows) + defect / (EPS * ROW))
    if (off[..., 3].max(axis=-1) > allowed).any() or (off[..., :3] > turn).any():
        raise TableError(
            "the URDF made of a table differs from the table",
            where=table.robot,
            found=f"a tip {off[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the table",
        )


def _defect(table: DHTable) -> float:
    """Return the distance of base and tool from rigid motions; a table may have only six digits."""
    rotations: list[FloatArray] = [table.base[:3, :3], table.tool[:3, :3]]
    return sum(float(np.linalg.norm(R.T @ R - np.eye(3))) for R in rotations)
