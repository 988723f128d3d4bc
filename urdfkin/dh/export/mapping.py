"""A table as plain data, in the form that `urdfkin.dh.rows.table_from_mapping` reads; numbers to the bit."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from urdfkin.dh.row import DHRow
from urdfkin.dh.table import DHTable


def to_mapping(table: DHTable) -> dict[str, Any]:
    """Strings, numbers, lists and mappings only; metres and radians. What was snapped is told in `snap`."""
    data: dict[str, Any] = {
        "convention": str(table.convention),
        "angles": "radians",
        "lengths": "metres",
        "robot": table.robot,
        "base_frame": table.base_frame,
        "tip_frame": table.tip_frame,
        "base": table.base.tolist(),
        "tool": table.tool.tolist(),
    }
    if (snap := table.snap) is not None:
        data["snap"] = {
            "tolerance_rad": snap.tolerance,
            "tip_moves_at_most_m": snap.metres,
            "tip_turns_at_most_rad": snap.radians,
            "changes": [
                {"row": change.row + 1, "what": change.what, "angle_rad": change.angle}
                for change in snap.changes
            ],
        }
    elsewhere = [name for name in table.joint_names if name not in {row.joint for row in table.rows}]
    if elsewhere:
        data["coordinates"] = elsewhere
    data["rows"] = [_row(row) for row in table.rows]
    return data


def _row(row: DHRow) -> dict[str, Any]:
    data: dict[str, Any] = {
        "joint": row.joint,
        "kind": row.kind.value,
        "a": row.a,
        "alpha": row.alpha,
        "d": row.d,
        "theta": row.theta,
    }
    if row.beta:
        data["beta"] = row.beta
    if row.sense != 1:
        data["sense"] = row.sense
    if row.mimic is not None:
        data["mimic"] = asdict(row.mimic)
    if row.limit is not None:
        names = ("lower", "upper", "velocity", "effort")
        # Infinity has no place in JSON; a bound that is not written is infinite.
        limits = {name: getattr(row.limit, name) for name in names}
        data["limit"] = {name: value for name, value in limits.items() if math.isfinite(value)}
    return data
