"""`urdfkin.check`: findings about anything that can hold a URDF."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import IO, Any

from urdfkin.diagnostics.check import check_robot, read_document
from urdfkin.diagnostics.document import DEFAULT_LIMITS, Limits
from urdfkin.diagnostics.finding import Finding
from urdfkin.diagnostics.meshes import check_meshes
from urdfkin.diagnostics.reporter import Reporter
from urdfkin.errors import InputError, SourceError

#: Anything that can hold a URDF: a path, the text itself, bytes, an open file, "-" for standard input.
SourceLike = str | bytes | PathLike[str] | IO[str] | IO[bytes]


@dataclass(frozen=True, slots=True)
class Document:
    """The bytes of a URDF and where they came from.

    Attributes:
        name: What to call it: the path as given, `<text>`, `<stdin>`.
        data: The bytes.
        path: The file, when it is one.
    """

    name: str
    data: bytes
    path: Path | None = None


def read_source(source: SourceLike, limits: Limits = DEFAULT_LIMITS) -> Document:
    """The bytes behind a source; a file is not read further than the limits allow.

    Args:
        source: A path, URDF text, bytes, an open file, or "-" for standard input.
        limits: How large the file may be.

    Raises:
        SourceError: the file does not exist or cannot be read.
        InputError: the source is none of these.
    """
    if isinstance(source, bytes):
        return Document("<text>", source)
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        return Document("<text>", source.encode("utf-8", "surrogatepass"))
    if isinstance(source, str) and source == "-":
        return Document("<stdin>", sys.stdin.buffer.read(limits.bytes + 1))
    if isinstance(source, (str, PathLike)):
        path = Path(fspath(source))
        return Document(str(path), _read(path, limits), path)
    if hasattr(source, "read"):
        text: Any = source.read(limits.bytes + 1)
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else bytes(text)
        name = getattr(source, "name", None)
        path_of_file = Path(name) if isinstance(name, str) and Path(name).is_file() else None
        return Document(str(name) if isinstance(name, str) else "<text>", data, path_of_file)
    raise InputError(
        "a URDF comes as a path, as text or bytes, or as an open file", found=type(source).__name__
    )


def _read(path: Path, limits: Limits) -> bytes:
    try:
        if path.is_file():
            with path.open("rb") as file:
                return file.read(limits.bytes + 1)
        what = "a folder, not a file" if path.is_dir() else "not a regular file" if path.exists() else None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SourceError("the file cannot be read", where=str(path), found=reason) from error
    if what:
        raise SourceError("the source cannot be read", where=str(path), found=what)
    raise SourceError("no such file", where=str(path), remedy="give a path, URDF text, or - for stdin")


def check(
    source: SourceLike,
    *,
    limits: Limits = DEFAULT_LIMITS,
    mimic: bool = True,
    root_joint: str | None = None,
    fold: bool = False,
) -> list[Finding]:
    """Findings about a URDF, by line, without computing anything.

    Besides what the text itself tells, packages and files that meshes are said to lie in are looked for; no
    mesh is opened.

    Args:
        source: A path, URDF text, bytes, an open file, or "-" for standard input.
        limits: How large the file may be.
        mimic: Whether mimic joints are to follow; without, what is wrong with them is a note.
        root_joint: `"floating"` or `"planar"` when the robot will hang from such a joint.
        fold: Whether many warnings of one kind are folded into one that lists the lines.

    Returns:
        The findings; an empty list for a file nothing can be said against.

    Raises:
        SourceError: the file does not exist or cannot be read.
        InputError: the source is none of these.

    >>> for finding in check('<robot name="r"><link name="base"/><link name="stray"/></robot>'):
    ...     print(finding)  # doctest: +ELLIPSIS
    <text>:1:42: URDF411 error: link 'stray': the link has no parent, and neither has "base"; ...
    """
    document = read_source(source, limits)
    report = Reporter(document.name, document.data)
    root = read_document(report, document.data, limits)
    if root is not None and check_robot(report, root, mimic=mimic, root_joint=root_joint) is not None:
        check_meshes(report, root, document.path)
    return list(report.findings(fold=fold))
