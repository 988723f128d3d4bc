"""Tables from files: TOML and JSON (`urdfkin.dh.rows` says what stands in them), and sheets of text."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

from urdfkin.dh.digits import Literal
from urdfkin.dh.rows import table_from_mapping
from urdfkin.dh.screws import Screws, screws_of_mapping
from urdfkin.dh.sheet import from_sheet
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, SourceError, UrdfkinError
from urdfkin.system.files import read_text

_T = TypeVar("_T")


def is_table_file(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Whether a robot's source is the path of a table, by its name.

    >>> is_table_file("arm.toml"), is_table_file("arm.urdf"), is_table_file("<robot/>")
    (True, False, False)
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    if not isinstance(source, str | os.PathLike) or (ending := Path(source).suffix.lower()) not in _PARSERS:
        return False
    return ending != ".txt" or not _is_markup(Path(source))


def read_table(path: str | os.PathLike[str]) -> DHTable:
    """A table from a file whose name ends in .toml, .json, .csv, .tsv, .md, .tex or .txt.

    Raises:
        SourceError: the file cannot be read.
        InputError: another ending, broken syntax, or anything `table_from_mapping` rejects, with the file.
    """
    return table_of(read_mapping(path), str(path))


def read_table_or_screws(path: str | os.PathLike[str]) -> DHTable | Screws:
    """A table, or screws where the file has an M; errors as for `read_table`."""
    data = read_mapping(path)
    return _placed(screws_of_mapping, data, str(path)) if "M" in data else table_of(data, str(path))


def read_mapping(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """The plain data of a table's file, its numbers as they are written; errors as for `read_table`."""
    return mapping_from_text(read_text(Path(path), pipes=True), Path(path).suffix.lower(), where=str(path))


def table_from_text(text: str, suffix: str, where: str = "table") -> DHTable:
    """A table from the text of a file with a given ending; errors as for `read_table`."""
    return table_of(mapping_from_text(text, suffix, where), where)


def table_of(data: Mapping[str, Any], where: str) -> DHTable:
    """The table of a file's plain data; errors as for `read_table`."""
    return _placed(table_from_mapping, data, where)


def _placed(make: Callable[[Mapping[str, Any]], _T], data: Mapping[str, Any], where: str) -> _T:
    try:
        return make(data)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}" if error.where else where
        raise


def mapping_from_text(text: str, suffix: str, where: str) -> Mapping[str, Any]:
    """The plain data of a table file; errors as for `read_table`."""
    if suffix not in _PARSERS:
        raise InputError(
            f"a table's file ends in {', '.join(_PARSERS)}",
            where=where,
            found=repr(suffix),
            remedy="rename the file",
        )
    try:
        data = _PARSERS[suffix](text)
    except UrdfkinError as error:
        error.where = f"{where}, {error.where}"
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"not valid {suffix[1:].upper()}", where=where, found=str(error)[:200]) from None
    if not isinstance(data, Mapping):
        raise InputError(
            "a table is a mapping with convention and rows", where=where, found=type(data).__name__
        )
    return data


def _is_markup(path: Path) -> bool:
    """Whether a text file is a URDF, which may end in .txt as well."""
    try:
        return read_text(path.expanduser()).lstrip().startswith("<")
    except SourceError:
        return False


def _from_toml(text: str) -> dict[str, Any]:
    return tomllib.loads(text, parse_float=Literal)


def _from_json(text: str) -> Any:
    return json.loads(text, parse_float=Literal)


_PARSERS: dict[str, Callable[[str], Any]] = {
    ".toml": _from_toml,
    ".json": _from_json,
    **dict.fromkeys((".csv", ".tsv", ".md", ".tex", ".txt"), from_sheet),
}
