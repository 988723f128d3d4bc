"""JSON documents: the common header, schemas, and functions that read and write documents.

A `TypedDict` defines the entries and the JSON Schema of a document. Documents from files are checked against
the `TypedDict`.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, TypedDict, TypeVar, cast

import msgspec
from msgspec import Meta

from urdfkin.errors import InputError
from urdfkin.system.files import MAX_DATA_BYTES, read_bytes

_T = TypeVar("_T")


def doc(text: str) -> Meta:
    return Meta(description=text)


def of_length(n: int) -> Meta:
    return Meta(min_length=n, max_length=n)


Count = Annotated[int, Meta(ge=0)]
NonNegativeFloat = Annotated[float, Meta(ge=0)]
TransformRows = Annotated[
    list[Annotated[list[float], of_length(4)]],
    of_length(4),
    doc("Homogeneous transform (4, 4) as a list of rows, with the translation in metres."),
]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class Header(TypedDict):
    """The first entries of every certificate and report."""

    schema: Annotated[str, doc("Name and version of the layout of this document.")]
    versions: Annotated[
        dict[str, str],
        doc("Version by package name: Python, urdfkin, libraries of urdfkin, and oracles such as Pinocchio."),
    ]
    sha256: Annotated[
        list[Sha256 | None],
        doc(
            "One SHA-256 digest for each robot, in the order of the robots. Each digest is computed from the "
            "URDF text in UTF-8, or from the MJCF or USD file. null means that the digest is unknown."
        ),
    ]
    verdict: Annotated[str, doc("Verdict of the document as a whole.")]
    command: Annotated[
        str | None,
        doc(
            "Command that makes the document again, or null if the command is unknown. If the entry contains "
            "several commands, each command is on a line of its own. All robots of one command have the same "
            "options. A robot that was given as text is written as `-` (standard input). A command reads at "
            "most one robot from standard input."
        ),
    ]


@dataclass(frozen=True, slots=True)
class DocumentKind(Generic[_T]):
    """A kind of document, for example a certificate.

    Attributes:
        verdicts: The possible verdicts; empty if the document has no header.
        command: Command that writes documents of this kind.
        is_open: Whether a document may have unknown entries, for example of a later version of urdfkin.
    """

    name: str
    type: type[_T]
    verdicts: tuple[str, ...]
    command: str
    is_open: bool = False

    def schema(self) -> dict[str, Any]:
        parts: dict[str, Any] = msgspec.json.schema(self.type)["$defs"]
        for name, part in parts.items():
            entries = getattr(sys.modules[self.type.__module__], name).__annotations__
            part["properties"] = {entry: part["properties"][entry] for entry in entries}
            part["description"] = " ".join(part["description"].split())
            if not self.is_open:
                part["additionalProperties"] = False
        whole: dict[str, Any] = parts.pop(self.type.__name__)
        whole["properties"]["schema"]["const"] = self.name
        if self.verdicts:
            whole["properties"]["verdict"]["enum"] = list(self.verdicts)
        head = {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "$id": f"urn:{self.name.replace('-', ':').replace('/', ':')}",
        }
        return head | whole | {"title": self.name, "$defs": parts}

    def schema_text(self) -> str:
        return json.dumps(self.schema(), indent=2) + "\n"

    def read(self, path: Path) -> _T:
        return self.validate(read_json(path), str(path))

    def validate(self, data: object, where: str) -> _T:
        self._check_schema_name(data, where)
        try:
            document = from_data(data, self.type)
        except ValueError as error:
            claim, _, place = str(error).partition(" - at ")
            raise self._layout_error(where, place.strip("`") or "$", claim) from None
        if not self.is_open and (entry := _unknown_entry(data, document)) is not None:
            raise self._layout_error(where, *entry)
        if self.verdicts and (verdict := cast("Header", document)["verdict"]) not in self.verdicts:
            raise self._layout_error(where, "$.verdict", f"{verdict!r} is none of {', '.join(self.verdicts)}")
        return document

    def _check_schema_name(self, data: object, where: str) -> None:
        found = data.get("schema") if isinstance(data, dict) else None
        if found == self.name:
            return
        family, _, version = self.name.rpartition("/")
        if isinstance(found, str) and found.startswith(f"{family}/"):
            raise InputError(
                f"unknown version of the layout {family}",
                where=where,
                found=repr(found),
                remedy=f"this urdfkin reads version {version}: write the file again with: {self.command}",
            )
        raise InputError(
            f"not a file with the layout {self.name}",
            where=where,
            found=repr(found) if found else "no 'schema' entry",
            remedy=f"write one with: {self.command}",
        )

    def _layout_error(self, where: str, place: str, claim: str) -> InputError:
        return InputError(
            f"does not conform to the layout {self.name}",
            where=where,
            found=f"{place}: {claim}",
            remedy=f"write it again with: {self.command}",
        )


def _unknown_entry(data: Any, document: Any, place: str = "$") -> tuple[str, str] | None:
    """Return the JSON path of an unknown entry, and a message.

    `document` is the conversion of `data`, which omits unknown entries.
    """
    if isinstance(data, dict):
        if unknown := [name for name in data if name not in document]:
            return place, f"unknown entry {unknown[0]!r}"
        pairs = [(data[name], document[name], f"{place}.{name}") for name in data]
    elif isinstance(data, list):
        pairs = [(*both, f"{place}[{i}]") for i, both in enumerate(zip(data, document, strict=True))]
    else:
        return None
    return next((found for pair in pairs if (found := _unknown_entry(*pair)) is not None), None)


def as_data(value: Any) -> Any:
    """Convert a result to dicts, lists, strings and numbers.

    `from_data` converts the data back. Infinity and NaN stay numbers.
    """
    return msgspec.to_builtins(value, enc_hook=lambda x: str(x) if isinstance(x, str) else x.tolist())


def from_data(data: object, type_: type[_T]) -> _T:
    try:
        return msgspec.convert(data, type_)
    except msgspec.ValidationError as error:
        raise ValueError(str(error)) from error


def as_json_data(value: Any) -> Any:
    """Convert a result to data for JSON; infinity and NaN become None."""
    return json.loads(json.dumps(as_data(value)), parse_constant=lambda _: None)


def read_json(path: Path) -> object:
    return parse_json(read_bytes(path, MAX_DATA_BYTES, pipes=True), str(path))


def parse_json(content: bytes, where: str) -> object:
    """Parse JSON; raise InputError for invalid JSON, NaN, infinity, and numbers such as 1e999.

    An integer may exceed the range of doubles.
    """
    try:
        return json.loads(content, parse_constant=_parse_finite, parse_float=_parse_finite)
    except (ValueError, RecursionError) as error:
        page = content.lstrip()[:1] == b"<"
        found = "an HTML or XML file" if page else str(error)
        raise InputError("not a JSON file", where=where, found=found) from error


def _parse_finite(word: str) -> float:
    number = float(word)
    if not math.isfinite(number):
        raise ValueError(f"{word[:20]} is not a finite number")
    return number
