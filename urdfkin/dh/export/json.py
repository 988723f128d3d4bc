"""The table as JSON, read back by `urdfkin.dh.read_table` to the bit."""

from __future__ import annotations

import json

from urdfkin.dh.export.mapping import to_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units


def write(table: DHTable, units: Units) -> str:
    """JSON in metres and radians, whatever the units for people are."""
    del units
    return json.dumps(to_mapping(table), indent=2, allow_nan=False) + "\n"
