"""Write a table as plain data, or as JSON, TOML or CSV.

`urdfkin.dh.rows.table_from_mapping` reads plain data. `urdfkin.dh.read_table` reads JSON, TOML and CSV files.
All numbers are exact to the last bit.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from urdfkin.dh.snapping import travel_condition
from urdfkin.dh.table import DHRow, DHTable
from urdfkin.dh.units import COLUMNS
from urdfkin.errors.escape import csv_cell, escape_sequence


def to_mapping(table: DHTable) -> dict[str, Any]:
    """Return the table as plain data, in metres and radians."""
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
        if holds_if := travel_condition(table):
            data["snap"]["holds_if"] = holds_if
    elsewhere = [name for name in table.joint_names if name not in {row.joint for row in table.rows}]
    if elsewhere:
        data["coordinates"] = elsewhere
    data["rows"] = [_row(row) for row in table.rows]
    return data


def _row(row: DHRow) -> dict[str, Any]:
    data: dict[str, Any] = {"joint": row.joint, "kind": row.kind.value}
    data |= {name: getattr(row, name) for name in COLUMNS}
    if row.beta:
        data["beta"] = row.beta
    if row.sense != 1:
        data["sense"] = row.sense
    if row.mimic is not None:
        data["mimic"] = asdict(row.mimic)
    if row.limit is not None:
        # JSON cannot store an infinite limit.
        data["limit"] = {name: value for name, value in asdict(row.limit).items() if math.isfinite(value)}
    return data


def write_json(table: DHTable) -> str:
    return json.dumps(to_mapping(table), indent=2, allow_nan=False) + "\n"


def write_toml(table: DHTable) -> str:
    data = to_mapping(table)
    rows = data.pop("rows")
    lines = [f"{key} = {format_toml_value(value)}" for key, value in data.items()]
    lines += ["rows = [", *(f"  {format_toml_value(row)}," for row in rows), "]"]
    return "\n".join(lines) + "\n"


def format_toml_value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {format_toml_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(format_toml_value(item) for item in value) + "]"
    # TOML accepts JSON's numbers and escapes, but no surrogate pairs.
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    return "".join(c if c.isprintable() else escape_sequence(c) for c in text)


_CSV_COLUMNS = (
    *("joint", "kind", "sense", *COLUMNS, "beta"),
    *("mimicked_joint", "multiplier", "offset", "lower", "upper", "velocity", "effort"),
)


def write_csv(table: DHTable) -> str:
    """Return CSV: comments, column names, rows."""
    data = to_mapping(table)
    rows = data.pop("rows")
    data.pop("snap", None)
    out = io.StringIO()
    for key, value in data.items():
        out.write(f"# {key}: {json.dumps(value)}\n".replace("##", "#\\u0023"))
    writer = csv.DictWriter(out, _CSV_COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        flat = {**row, **row.pop("mimic", {}), **row.pop("limit", {})}
        named = {key: csv_cell(flat[key]) for key in ("joint", "mimicked_joint") if key in flat}
        writer.writerow({key: value for key, value in (flat | named).items() if key in _CSV_COLUMNS})
    return out.getvalue()
