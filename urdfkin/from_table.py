"""From a Denavit-Hartenberg table back to a robot that computes, is checked, and can be written as a URDF."""

from __future__ import annotations

from urdfkin.dh.table import DHTable
from urdfkin.loading import load
from urdfkin.robot import Robot
from urdfkin.verification.choosing import Verify


def robot_from_table(table: DHTable, *, verify: Verify = True) -> Robot:
    """The robot of a table, by way of its URDF, which is also what Pinocchio checks it against.

    Args:
        table: Any table.
        verify: Whether every result is held against Pinocchio's.

    Example:
        >>> from urdfkin.dh import table_from_rows
        >>> robot = robot_from_table(table_from_rows([[0.4, 0, 0, 0], [0.3, 0, 0, 0]], "standard"))
        >>> float(robot.placement([0.0, 0.0], "tip")[0, 3])
        0.7
    """
    return load(table.to_urdf(), verify=verify)
