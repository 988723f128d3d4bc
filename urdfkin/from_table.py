"""From a Denavit-Hartenberg table back to a robot that computes, is checked, and can be written as a URDF.

Pinocchio checks the robot's results against its URDF, which urdfkin wrote. That the URDF is the table's is
checked here, once: Pinocchio's placements of the tip against the products of the table's own matrices (7.64).
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.table import DHTable
from urdfkin.dh.to_tree import link_names
from urdfkin.frame_names import LinkFrame
from urdfkin.loading import load
from urdfkin.robot import Robot
from urdfkin.roundings import EPS, ROW, of_rows, of_rows_read_back
from urdfkin.tree import FloatArray
from urdfkin.verification.choosing import Verify
from urdfkin.verification.tables import TableError

#: Configurations that a robot is held against its table in.
_SAMPLES = 8


def robot_from_table(table: DHTable, *, verify: Verify = True) -> Robot:
    """The robot of a table, by way of its URDF, which is also what Pinocchio checks it against.

    Args:
        table: Any table.
        verify: Whether the URDF is held against the table, and every result against Pinocchio's.

    Raises:
        TableError: the URDF is not the table's.

    Example:
        >>> from urdfkin.dh import table_from_rows
        >>> robot = robot_from_table(table_from_rows([[0.4, 0, 0, 0], [0.3, 0, 0, 0]], "standard"))
        >>> float(robot.placement([0.0, 0.0], "tip")[0, 3])
        0.7
    """
    robot = load(table.to_urdf(), verify=verify)
    if verify is not False and robot.cannot_verify() is None:
        _demand_the_tables(robot, table)
    return robot


def _demand_the_tables(robot: Robot, table: DHTable) -> None:
    q = robot.sample(_SAMPLES)
    own = table.coupling.select(robot.tree, q)
    theirs = robot.oracle(None).placements(q, [LinkFrame.of(link_names(table)[-1])])[:, 0]
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
