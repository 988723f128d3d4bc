"""Tables from files: TOML, JSON and CSV. See `urdfkin.dh.rows` for what stands in them."""

from __future__ import annotations

import csv
import json
import os
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from urdfkin.dh.rows import table_from_mapping
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.files import read_text


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """A table from a file whose name ends in .toml, .json or .csv.

    Raises:
        SourceError: the file cannot be read.
        InputError: another ending, broken syntax, or anything `table_from_mapping` rejects, with the file.
    """
    return table_from_text(read_text(Path(path)), Path(path).suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    """A table from the text of a file with a given ending; errors as for `read_table`."""
    data = mapping_from_text(text, suffix, where)
    try:
        return table_from_mapping(data)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}" if error.where else where
        raise


def mapping_from_text(text: str, suffix: str, where: str) -> Mapping[str, Any]:
    """The plain data of a table file; errors as for `read_table`."""
    if suffix not in _PARSERS:
        raise InputError(
            "a table's file ends in .toml, .json or .csv",
            where=where,
            found=repr(suffix),
            remedy="rename the file",
        )
    try:
        data = _PARSERS[suffix](text)
    except (ValueError, csv.Error) as error:
        raise InputError(f"not valid {suffix[1:].upper()}", where=where, found=str(error)) from None
    if not isinstance(data, Mapping):
        raise InputError(
            "a table is a mapping with convention and rows", where=where, found=type(data).__name__
        )
    return data


def _from_csv(text: str) -> dict[str, Any]:
    data: dict[str, Any] = {}
    lines = text.splitlines()
    while lines and lines[0].startswith("#"):
        key, _, value = lines.pop(0)[1:].partition(":")
        try:
            data[key.strip()] = json.loads(value)
        except ValueError:
            data[key.strip()] = value.strip()
    data["rows"] = [_row_from_csv(row) for row in csv.DictReader(lines)]
    return data


def _row_from_csv(row: Mapping[str | None, str | None]) -> dict[str, Any]:
    """Flat columns back into a row; empty cells are not said."""
    said = {str(key).strip(): value.strip() for key, value in row.items() if key is not None and value}
    mimic = {key: said.pop(key) for key in ("leader", "multiplier", "offset") if key in said}
    limit = {key: said.pop(key) for key in ("lower", "upper", "velocity", "effort") if key in said}
    nested: dict[str, Any] = {"mimic": mimic} if mimic else {}
    if limit:
        nested["limit"] = limit
    return {**said, **nested}


_PARSERS: dict[str, Callable[[str], Any]] = {".toml": tomllib.loads, ".json": json.loads, ".csv": _from_csv}
