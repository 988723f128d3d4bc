r"""What `--fix` would change in a file, as a patch that `git apply` takes and no terminal or log acts on.

A patch holds whole lines, and a line may hold what acts on a terminal: a mark that turns the direction of
writing, an escape sequence, a command for a CI service. Written as an escape it would be another line, which
`git apply` refuses. Such a file's patch is therefore git's binary one, letters and digits alone, below the
readable one as a comment.
"""

from __future__ import annotations

import base64
import difflib
import hashlib
import os
import zlib
from collections.abc import Callable
from pathlib import Path

#: Bytes in a line of git's binary patch.
_IN_A_LINE = 52
_NO_END = "\\ No newline at end of file\n"


def patch(file: str, before: bytes, after: bytes, shown: Callable[[str], str]) -> str:
    """The patch of one file, as `shown` leaves it; "" where nothing changes.

    Args:
        file: Its name, from the current folder.
        before: Its bytes, UTF-8: nothing else is mended.
        after: What they become.
        shown: What writes as escapes what acts on a terminal or a log, in a text of whole lines.
    """
    if before == after:
        return ""
    name = _relative(file)
    text = _unified(name, before, after)
    if shown(text) == text:
        return text
    lines = shown(text.replace("\r", "\\r")).splitlines()
    return "".join(f"# {line}\n" for line in lines) + _binary(name, before, after)


def _relative(file: str) -> str:
    """A name as `git apply` takes it: from the current folder, where the file lies in it."""
    below = os.path.relpath(file)
    return file if below.startswith(os.pardir) else Path(below).as_posix()


def _unified(name: str, before: bytes, after: bytes) -> str:
    # A blank in a name ends it, unless a tab does.
    end = "\t" if " " in name else ""
    old, new = (f"{_quoted(f'{side}/{name}')}{end}" for side in "ab")
    found = difflib.unified_diff(_lines(before.decode()), _lines(after.decode()), old, new)
    return "".join(line if line.endswith("\n") else f"{line}\n{_NO_END}" for line in found)


def _lines(text: str) -> list[str]:
    """Lines as git counts them: a line feed ends one, nothing else does."""
    return [*(f"{line}\n" for line in text.split("\n")[:-1]), *filter(None, text.split("\n")[-1:])]


def _quoted(name: str) -> str:
    """A name as git writes one that holds a quote, a control character or a letter beyond ASCII."""
    if name.isascii() and name.isprintable() and not set(name) & {'"', "\\"}:
        return name
    return '"' + "".join(
        chr(byte) if 0x20 <= byte < 0x7F and chr(byte) not in '"\\' else f"\\{byte:03o}"
        for byte in os.fsencode(name)
    ) + '"'  # fmt: skip


def _binary(name: str, before: bytes, after: bytes) -> str:
    """Git's binary patch, which names files from the top of the repository."""
    top = next(
        (folder for folder in (Path.cwd(), *Path.cwd().parents) if (folder / ".git").exists()), Path.cwd()
    )
    place = os.path.relpath(name, top)
    old, new = (_quoted(f"{side}/{Path(place).as_posix()}") for side in "ab")
    digests = (hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() for data in (before, after))
    head = f"diff --git {old} {new}\nindex {'..'.join(digests)}\nGIT binary patch\n"
    return head + "".join(f"literal {len(data)}\n{_encoded(data)}\n" for data in (after, before))


def _encoded(data: bytes) -> str:
    packed = zlib.compress(data)
    pieces = (packed[i : i + _IN_A_LINE] for i in range(0, len(packed), _IN_A_LINE))
    return "".join(f"{_length(len(piece))}{base64.b85encode(piece, pad=True).decode()}\n" for piece in pieces)


def _length(count: int) -> str:
    return chr(ord("A") + count - 1) if count <= 26 else chr(ord("a") + count - 27)
