"""Reading what `urdfkin same --certificate` wrote: JSON that keeps to its published schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

from urdfkin.report.document import asset
from urdfkin.report.reading import keeps_to, read_json
from urdfkin.sameness.certificate import LAYOUT


def schema_text() -> str:
    """The JSON Schema (draft 2020-12) of a certificate."""
    return asset("same-1.schema.json")


def read_certificate(path: Path) -> dict[str, Any]:
    """A certificate from a file.

    Raises:
        SourceError: the file cannot be read.
        InputError: it is not JSON, no certificate, of another version, or breaks the schema.
    """
    data = read_json(path)
    keeps_to(json.loads(schema_text()), data, LAYOUT, str(path), "urdfkin same A B --certificate FILE")
    return cast("dict[str, Any]", data)
