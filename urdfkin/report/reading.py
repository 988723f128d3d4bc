"""Reading a report's document: JSON that keeps to its published schema and agrees with itself."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import cast

from urdfkin.errors import InputError
from urdfkin.report.consistency import contradictions
from urdfkin.report.document import Document, schema
from urdfkin.system.files import MOST_DATA, read_bytes
from urdfkin.validation.results import SCHEMA

#: How many contradictions of a report are told.
_SHOWN = 3


def read_document(path: Path) -> Document:
    """A document from a file.

    Raises:
        SourceError: the file cannot be read.
        InputError: it is not JSON, not a validation report, of another version, breaks the schema, or
            contradicts itself.
    """
    return checked(read_json(path), str(path))


def read_json(path: Path) -> object:
    """What a file of JSON says; raises SourceError, or InputError where it is none."""
    try:
        return json.loads(
            read_bytes(path, MOST_DATA, pipes=True), parse_constant=_number, parse_float=_number
        )
    except (ValueError, RecursionError) as error:
        raise InputError("not a JSON file", where=str(path), found=str(error)) from error


def stored_document(folder: Path) -> Document:
    """The document of a campaign's store, held against itself like any other: its files are evidence too.

    Raises:
        SourceError: the store cannot be read.
        InputError: it is none, or contradicts itself.
    """
    from urdfkin.validation.campaign import stored  # noqa: PLC0415  only who has a store needs it

    return checked(json.loads(json.dumps(stored(folder).as_dict(), allow_nan=False)), str(folder))


def _number(word: str) -> float:
    """JSON has no infinity and no NaN, and a number too large for a double would become one."""
    number = float(word)
    if not math.isfinite(number):
        raise ValueError(f"{word[:20]} is no number")
    return number


def checked(data: object, where: str) -> Document:
    """`data` as a document; raises InputError as `read_document` does."""
    keeps_to(schema(), data, SCHEMA, where, "urdfkin validate ROBOT --json FILE")
    document = cast("Document", data)
    if against := list(islice(contradictions(document), _SHOWN + 1)):
        more = " ..." if len(against) > _SHOWN else ""
        raise InputError(
            "the report contradicts itself",
            where=where,
            found="; ".join(against[:_SHOWN]) + more,
            remedy="have it made again: urdfkin validate ROBOT --json FILE",
        )
    return document


def keeps_to(layout: Mapping[str, object], data: object, name: str, where: str, made_by: str) -> None:
    """Demand that data keep to a published schema.

    Args:
        layout: The schema.
        data: What a file says.
        name: The layout's, which the entry "schema" must give.
        where: The file.
        made_by: The command that writes one.

    Raises:
        InputError: another layout, or one that is broken.
    """
    found = data.get("schema") if isinstance(data, dict) else None
    if found != name:
        raise InputError(
            f"not a report with the layout {name}",
            where=where,
            found=repr(found) if found else "no 'schema' entry",
            remedy=f"write one with: {made_by}",
        )
    from jsonschema import Draft202012Validator  # noqa: PLC0415  only who reads files needs it
    from jsonschema.exceptions import best_match  # noqa: PLC0415

    error = best_match(Draft202012Validator(layout).iter_errors(data))
    if error is not None:
        raise InputError(
            f"breaks the layout {name}", where=where, found=f"{error.json_path}: {error.message}"
        )
