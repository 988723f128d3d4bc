"""The Denavit-Hartenberg tables of a robot's chains for its report, each held against Pinocchio.

The chains are the catalogue's limbs; for other robots the paths from the base to the leaves, one for each
set of moving joints. Tables are exact, in both conventions.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from urdfkin.dh import DHRow, DHTable
from urdfkin.dh.make import dh_table
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.pinocchio import Oracle
from urdfkin.verify.sampling import draw
from urdfkin.verify.tables import check_table

#: A robot with more leaves shows this many chains; `urdfkin dh --all` gives them all.
MOST = 12
_SAMPLES = 10
_CONVENTIONS = ("standard", "modified")


def chains_of(robot: Robot, oracle: Oracle | None) -> tuple[dict[str, Any], ...]:
    """Plain data for JSON: frames, both tables, and how well they agree with Pinocchio.

    Args:
        robot: The robot.
        oracle: Pinocchio's model; None where it cannot check the robot: then nothing is said to be checked.
    """
    found = []
    for limb, base, tip in _chains(robot):
        try:
            tables = {name: dh_table(robot.tree, tip, base, name) for name in _CONVENTIONS}
        except InputError:
            continue  # a planar or floating joint on the way has no row
        if any(table.rows for table in tables.values()):
            found.append({"limb": limb, "base": base, "tip": tip} | _checked(robot, oracle, tables))
    return tuple(found)


def _chains(robot: Robot) -> Iterator[tuple[str | None, str, str]]:
    entry = catalogue().get(robot.source)
    if entry is not None and entry.limbs:
        yield from ((limb, base, tip) for limb, (base, tip) in entry.limbs.items())
        return
    tree, seen = robot.tree, set[tuple[int, ...]]()
    for leaf in sorted(tree.leaves(), key=lambda leaf: tree.links[leaf] != robot.tip_frame):
        moving = tuple(i for i in tree.path(leaf) if tree.joints[i].kind.nv)
        if moving and moving not in seen and len(seen) < MOST:
            seen.add(moving)
            yield None, robot.base_frame, tree.link_frames[leaf]


def _checked(robot: Robot, oracle: Oracle | None, tables: dict[str, DHTable]) -> dict[str, Any]:
    data: dict[str, Any] = {name: _table(table) for name, table in tables.items()}
    if oracle is None:
        return data | {"samples": 0, "metres": None, "worst": None, "share_of_bound": None}
    drawn = draw(robot.tree, _SAMPLES, np.random.default_rng(0), with_special=True)
    checks = [check_table(oracle, robot.tree, table, drawn) for table in tables.values()]
    return data | {
        "samples": checks[0].samples,
        "metres": max(check.metres for check in checks),
        "worst": max(units for check in checks for units in check.units.values()),
        "share_of_bound": max(share for check in checks for share in check.shares.values()),
    }


def _table(table: DHTable) -> dict[str, Any]:
    return {
        "rows": [_row(row) for row in table.rows],
        "base": table.base.tolist(),
        "tool": table.tool.tolist(),
    }


def _row(row: DHRow) -> dict[str, Any]:
    return {
        "joint": row.joint,
        "kind": row.kind.value,
        "a": row.a,
        "alpha": row.alpha,
        "beta": row.beta,
        "d": row.d,
        "theta": row.theta,
        "sense": row.sense,
    }
