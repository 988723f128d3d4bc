r"""Write the changes of `--fix` as a patch for `git apply` that is safe to print.

A patch contains whole lines of the file. A line can contain text that controls a terminal or a CI service:
a mark for the writing direction, an escape sequence, a workflow command. Escaped text would change the line,
and `git apply` would refuse the patch. For such a file the output is git's binary patch (ASCII characters
only), below the readable patch as a comment.
"""

from __future__ import annotations

import base64
import difflib
import hashlib
import os
import zlib
from collections.abc import Callable
from pathlib import Path

#: Bytes per line of git's binary patch.
_IN_A_LINE = 52
_NO_END = "\\ No newline at end of file\n"


def patch(file: str, before: bytes, after: bytes, shown: Callable[[str], str]) -> str:
    """Return the patch of one file, safe to print; "" if the file does not change.

    Args:
        file: The name of the file, relative to the current folder.
        before: The bytes of the file, in UTF-8 (`--fix` changes no other file).
        after: The new bytes.
        shown: A function that escapes text that controls a terminal or a log, line by line.
    """
    if before == after:
        return ""
    name = _relative(file)
    text = _unified_diff(name, before, after)
    if shown(text) == text:
        return text
    lines = shown(text.replace("\r", "\\r")).splitlines()
    return "".join(f"# {line}\n" for line in lines) + _binary(name, before, after)


def _relative(file: str) -> str:
    """Return a name for `git apply`: relative to the current folder if the file is in it."""
    below = os.path.relpath(file)
    return file if below.startswith(os.pardir) else Path(below).as_posix()


def _unified_diff(name: str, before: bytes, after: bytes) -> str:
    # A tab after the name allows spaces in it.
    end = "\t" if " " in name else ""
    old, new = (f"{_quote(f'{side}/{name}')}{end}" for side in "ab")
    found = difflib.unified_diff(_lines(before.decode()), _lines(after.decode()), old, new)
    return "".join(line if line.endswith("\n") else f"{line}\n{_NO_END}" for line in found)


def _lines(text: str) -> list[str]:
    """Split a text into lines like git: only a line feed ends a line."""
    return [*(f"{line}\n" for line in text.split("\n")[:-1]), *filter(None, text.split("\n")[-1:])]


def _quote(name: str) -> str:
    """Quote a name like git, if it contains a quote, a control character or a non-ASCII letter."""
    if name.isascii() and name.isprintable() and not set(name) & {'"', "\\"}:
        return name
    return '"' + "".join(
        chr(byte) if 0x20 <= byte < 0x7F and chr(byte) not in '"\\' else f"\\{byte:03o}"
        for byte in os.fsencode(name)
    ) + '"'  # fmt: skip


def _binary(name: str, before: bytes, after: bytes) -> str:
    """Return git's binary patch; its file names are relative to the root of the repository."""
    top = next(
        (folder for folder in (Path.cwd(), *Path.cwd().parents) if (folder / ".git").exists()), Path.cwd()
    )
    place = os.path.relpath(name, top)
    old, new = (_quote(f"{side}/{Path(place).as_posix()}") for side in "ab")
    digests = (hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() for data in (before, after))
    head = f"diff --git {old} {new}\nindex {'..'.join(digests)}\nGIT binary patch\n"
    return head + "".join(f"literal {len(data)}\n{_encode(data)}\n" for data in (after, before))


def _encode(data: bytes) -> str:
    packed = zlib.compress(data)
    pieces = (packed[i : i + _IN_A_LINE] for i in range(0, len(packed), _IN_A_LINE))
    return "".join(f"{_length(len(piece))}{base64.b85encode(piece, pad=True).decode()}\n" for piece in pieces)


def _length(count: int) -> str:
    return chr(ord("A") + count - 1) if count <= 26 else chr(ord("a") + count - 27)
