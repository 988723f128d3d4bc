"""Where a robot comes from: a path, a catalogue name, URDF text, bytes, an open file, or `-` for stdin."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from urdfkin.catalogue import Entry, catalogue
from urdfkin.errors import InputError, SourceError, UnknownNameError

#: What `load` and `check` take.
Source = str | os.PathLike[str] | bytes | IO[str] | IO[bytes]


@dataclass(frozen=True, slots=True)
class Text:
    """A URDF that was read.

    Attributes:
        data: Its bytes.
        label: What to call it in messages: the path, `<text>`, `<stdin>`.
        source: What to write on a command line to get it again.
        entry: The catalogue's entry, if that is where it came from.
    """

    data: bytes
    label: str
    source: str
    entry: Entry | None = None


def read_source(source: Source) -> Text:
    """The bytes of a URDF, wherever it is.

    A catalogue name comes before a file of the same name without a folder; write `./panda` for the file.

    Raises:
        SourceError: the file cannot be read.
        UnknownNameError: neither a file nor a name of the catalogue; the nearest names are offered.
        InputError: something else than a source.
    """
    if isinstance(source, bytes):
        return Text(source, "<bytes>", "<bytes>")
    if isinstance(source, os.PathLike):
        return _read_file(Path(source))
    if isinstance(source, str):
        return _read_word(source)
    if hasattr(source, "read"):
        label = str(getattr(source, "name", "<file>"))
        return _encoded(source.read(), label, label)
    raise InputError(
        "a robot comes from a path, a catalogue name, URDF text, bytes or an open file",
        found=type(source).__name__,
    )


def _read_word(word: str) -> Text:
    if not word.strip():
        raise InputError(
            "no robot is named", found=repr(word), remedy="a path, a name that 'urdfkin robots' lists, or '-'"
        )
    if word == "-":
        return Text(sys.stdin.buffer.read(), "<stdin>", "-")
    if word.lstrip("\ufeff \t\r\n").startswith("<"):
        return _encoded(word, "<text>", "<text>")
    if (entry := catalogue().get(word)) is not None:
        read = _read_file(entry.path)
        return Text(read.data, read.label, word, entry)
    path = Path(word).expanduser()
    if path.exists() or os.sep in word or path.suffix:
        return _read_file(path)
    raise UnknownNameError("robot", word, catalogue(), where="neither a file nor in the catalogue")


def _encoded(content: str | bytes, label: str, source: str) -> Text:
    # A lone surrogate cannot be encoded; it reaches the checks as the bytes they refuse.
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    return Text(data, label, source)


def _read_file(path: Path) -> Text:
    try:
        return Text(path.read_bytes(), str(path), str(path))
    except FileNotFoundError:
        raise SourceError("no such file", where=str(path), remedy=_nearest_file(path)) from None
    except IsADirectoryError:
        raise SourceError("a folder, not a file", where=str(path), remedy="name the .urdf inside") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SourceError("cannot be read", where=str(path), found=reason) from error


def _nearest_file(path: Path) -> str:
    import difflib  # noqa: PLC0415  only for the message

    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return f"there is no folder {path.parent}"
    nearest = difflib.get_close_matches(path.name, names, n=3)
    return (
        f"did you mean {', '.join(nearest)}?" if nearest else "'urdfkin robots' lists names that need no file"
    )
