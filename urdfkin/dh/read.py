"""Tables from files: TOML, JSON and CSV. See `urdfkin.dh.rows` for what stands in them."""

from __future__ import annotations

import csv
import json
import os
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeGuard

from urdfkin.dh.digits import Literal
from urdfkin.dh.rows import table_from_mapping
from urdfkin.dh.table import DHTable
from urdfkin.dh.written_row import ORDER
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.printable import from_csv_cell
from urdfkin.system.files import read_text


def is_table_file(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Whether a robot's source is the path of a table, by its name.

    >>> is_table_file("arm.toml"), is_table_file("arm.urdf"), is_table_file("<robot/>")
    (True, False, False)
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    return isinstance(source, str | os.PathLike) and Path(source).suffix.lower() in _PARSERS


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """A table from a file whose name ends in .toml, .json or .csv.

    Raises:
        SourceError: the file cannot be read.
        InputError: another ending, broken syntax, or anything `table_from_mapping` rejects, with the file.
    """
    return table_of(read_mapping(path), str(path))


def read_mapping(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """The plain data of a table's file, its numbers as they are written; errors as for `read_table`."""
    return mapping_from_text(read_text(Path(path)), Path(path).suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    """A table from the text of a file with a given ending; errors as for `read_table`."""
    return table_of(mapping_from_text(text, suffix, where), where)


def table_of(data: Mapping[str, Any], where: str) -> DHTable:
    """The table of a file's plain data; errors as for `read_table`."""
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
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}"
        raise
    except (ValueError, csv.Error, RecursionError) as error:
        raise InputError(f"not valid {suffix[1:].upper()}", where=where, found=str(error)[:200]) from None
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
    reader = csv.reader(lines)
    names = [name.strip() for name in next(reader, [])]
    _check_header(names)
    data["rows"] = [_row_from_csv(names, cells, i) for i, cells in enumerate(filter(any, reader))]
    return data


def _check_header(names: list[str]) -> None:
    missing = [name for name in ORDER if name not in names]
    double = [name for name in names if names.count(name) > 1]
    if missing or double:
        raise InputError(
            f"no column {missing[0]!r}" if missing else f"the column {double[0]!r} stands twice",
            where="header",
            found=", ".join(names) or "nothing",
            remedy=f"the line before the rows names the columns, {', '.join(ORDER)} among them",
        )


def _row_from_csv(names: list[str], cells: list[str], index: int) -> dict[str, Any]:
    """Flat columns back into a row; empty cells are not said, but for the four that a row is made of."""
    if len(cells) != len(names):
        raise InputError(
            f"a row has a cell for each of the {len(names)} columns",
            where=f"row {index + 1}",
            found=f"{len(cells)}: {', '.join(cells)}",
            remedy=f"the columns are {', '.join(names)}",
        )
    said = {name: cell.strip() for name, cell in zip(names, cells, strict=True) if cell or name in ORDER}
    said |= {key: from_csv_cell(said[key]) for key in ("joint", "leader") if key in said}
    mimic = {key: said.pop(key) for key in ("leader", "multiplier", "offset") if key in said}
    limit = {key: said.pop(key) for key in ("lower", "upper", "velocity", "effort") if key in said}
    nested: dict[str, Any] = {"mimic": mimic} if mimic else {}
    if limit:
        nested["limit"] = limit
    return {**said, **nested}


def _from_toml(text: str) -> dict[str, Any]:
    return tomllib.loads(text, parse_float=Literal)


def _from_json(text: str) -> Any:
    return json.loads(text, parse_float=Literal)


_PARSERS: dict[str, Callable[[str], Any]] = {".toml": _from_toml, ".json": _from_json, ".csv": _from_csv}
