"""The table as TOML, read back by `urdfkin.dh.read_table` to the bit; the form of the shipped references."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from urdfkin.dh.export.mapping import to_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors.printable import escape


def write(table: DHTable, units: Units) -> str:
    """TOML in metres and radians, one row a line."""
    del units
    data = to_mapping(table)
    rows = data.pop("rows")
    lines = [f"{key} = {_value(value)}" for key, value in data.items()]
    lines += ["rows = [", *(f"  {_value(row)}," for row in rows), "]"]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    # A TOML basic string takes JSON's escapes, but no pairs of surrogates, and both write numbers alike.
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    return "".join(c if c.isprintable() else escape(c) for c in text)
