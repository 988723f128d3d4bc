"""The table as comma-separated values, for spreadsheets; read back by `urdfkin.dh.read_table` to the bit."""

from __future__ import annotations

import csv
import io
import json

from urdfkin.dh.export.mapping import to_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors.printable import csv_cell

COLUMNS = (
    *("joint", "kind", "sense", "a", "alpha", "d", "theta", "beta"),
    *("leader", "multiplier", "offset", "lower", "upper", "velocity", "effort"),
)


def write(table: DHTable, units: Units) -> str:
    """Comment lines `# key: value` for what is said once, then a line of column names, then the rows."""
    del units
    data = to_mapping(table)
    rows = data.pop("rows")
    data.pop("snap", None)
    out = io.StringIO()
    for key, value in data.items():
        out.write(f"# {key}: {json.dumps(value)}\n".replace("##", "#\\u0023"))
    writer = csv.DictWriter(out, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        flat = {**row, **row.pop("mimic", {}), **row.pop("limit", {})}
        named = {key: csv_cell(flat[key]) for key in ("joint", "leader") if key in flat}
        writer.writerow({key: value for key, value in (flat | named).items() if key in COLUMNS})
    return out.getvalue()
