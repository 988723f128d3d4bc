"""Pieces of a text exchanged where they stand: every other byte stays as it is.

The one reader of files: whole, up to a limit, regular files only, or refused in one clear line.

A folder of a stranger may hold a link to a device that never ends, or a named pipe that nobody writes to.
A path that the caller named may be a pipe, since `urdfkin check <(xacro arm.xacro)` names one; it is given up
after a while, where Python's own `open` would wait for ever.
"""

from __future__ import annotations

import errno
import os
import select
import stat
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import InputError, SourceError


@dataclass(frozen=True, slots=True)
class Edit:
    """The bytes from `start` up to `end` become `text`; nothing is replaced where the two are one."""

    start: int
    end: int
    text: str = ""


def edited(data: bytes, edits: Iterable[Edit]) -> bytes:
    """The text with all edits made.

    >>> edited(b"a=1 b=2", [Edit(6, 7, "3"), Edit(2, 3, "10")])
    b'a=10 b=3'

    Raises:
        InputError: two of them overlap.
    """
    parts, cursor = list[bytes](), 0
    for edit in sorted(edits, key=lambda one: (one.start, one.end)):
        if edit.start < cursor:
            raise InputError("two edits of one place", found=f"byte {edit.start}")
        parts += [data[cursor : edit.start], edit.text.encode()]
        cursor = edit.end
    return b"".join([*parts, data[cursor:]])


#: How long to wait for somebody to open the other end of a named pipe, seconds.
PATIENCE = 10.0
#: Bytes that a file may hold: a robot, a table, a setting, what is kept between runs.
MOST = 100_000_000
#: Bytes of recorded or computed data: trajectories, samples, reports.
MOST_DATA = 2_000_000_000
_AT_A_TIME = 2**20
_KINDS = {
    stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a character device",
    stat.S_IFBLK: "a block device",
}  # fmt: skip


def read_bytes(path: Path, most: int = MOST, *, pipes: bool = False) -> bytes:
    """The content of a file.

    Args:
        path: A regular file, or a link to one.
        most: Bytes that it may hold.
        pipes: Whether pipes and devices are read too: for paths that the caller named.

    Raises:
        SourceError: it cannot be read, is of another kind, or is larger; the message says which.
    """
    data = read_start(path, most + 1, pipes=pipes)
    if len(data) > most:
        raise _too_large(shortened(path), most)
    return data


def read_start(path: Path, count: int, *, pipes: bool = False) -> bytes:
    """The first bytes of a file, at most so many; arguments and errors as `read_bytes`."""
    try:
        # Without O_NONBLOCK, opening a pipe waits for its writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
        try:
            kind = os.fstat(descriptor).st_mode
            if stat.S_ISDIR(kind):
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if not pipes:
                _demand_regular(path, kind)
            first = _first_of_pipe(descriptor, path) if stat.S_ISFIFO(kind) else b""
            os.set_blocking(descriptor, True)
            return _up_to(count, descriptor, first)
        finally:
            os.close(descriptor)
    except SourceError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise SourceError("cannot be read", where=shortened(path), found=reason) from error


def demand_regular(path: Path) -> None:
    """Refuse a pipe, a socket or a device; what is not there is for whoever reads it.

    Raises:
        SourceError: it is one.
    """
    try:
        kind = path.stat().st_mode
    except (OSError, ValueError):
        return
    _demand_regular(path, kind)


def _demand_regular(path: Path, kind: int) -> None:
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise SourceError(
            "not a regular file",
            where=shortened(path),
            found=_KINDS.get(stat.S_IFMT(kind), "another kind"),
            remedy="put a regular file in its place",
        )


def read_if_there(path: Path, most: int = MOST) -> bytes | None:
    """The content of a file, None where there is none; other errors as `read_bytes`."""
    try:
        return read_bytes(path, most)
    except SourceError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return None
        raise


def read_text(path: Path, most: int = MOST, *, pipes: bool = False) -> str:
    """The content of a file as UTF-8 with or without a byte order mark; errors as `read_bytes`."""
    try:
        return read_bytes(path, most, pipes=pipes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SourceError("cannot be read", where=str(path), found=f"no UTF-8 text ({error})") from None


def read_standard_input(most: int = MOST) -> bytes:
    """The content of standard input.

    Raises:
        SourceError: it is closed, cannot be read, or is larger.
    """
    data = read_start_of_standard_input(most + 1)
    if len(data) > most:
        raise _too_large("standard input", most)
    return data


def read_start_of_standard_input(count: int) -> bytes:
    """The first bytes of standard input, at most so many.

    Raises:
        SourceError: it is closed, or cannot be read.
    """
    try:
        if sys.stdin is None:  # closed by whoever started the process
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        data: bytes = sys.stdin.buffer.read(count)
    except OSError as error:
        raise SourceError("cannot be read", where="standard input", found=error.strerror) from error
    return data


def exists(path: Path) -> bool:
    """Whether there is something; True for a name too long for a file, so that reading it says so."""
    try:
        return path.exists()
    except OSError:
        return True


def is_folder(path: Path) -> bool:
    """Whether it is a folder; False for a name too long for one, so that reading it says so."""
    try:
        return path.is_dir()
    except OSError:
        return False


def at_home(name: str | os.PathLike[str]) -> Path:
    """A path whose `~` is the home it stands for; what stands for no home is a name like others."""
    try:
        return Path(name).expanduser()
    except RuntimeError:
        return Path(name)


def shortened(path: Path) -> str:
    """A path for a message: one that no file system takes is not printed at length.

    >>> len(shortened(Path("x" * 5000))) < 200
    True
    """
    text = str(path)
    return text if len(text) <= 300 else f"{text[:60]}...{text[-60:]} ({len(text)} characters)"


def _too_large(where: str, most: int) -> SourceError:
    return SourceError(
        "too large",
        where=where,
        found=f"more than {most} bytes",
        remedy="split it, or leave out what is not needed",
    )


def _up_to(count: int, descriptor: int, first: bytes) -> bytes:
    pieces, left = [first[:count]], count - len(first)
    while left > 0 and (piece := os.read(descriptor, min(left, _AT_A_TIME))):
        pieces.append(piece)
        left -= len(piece)
    return b"".join(pieces)


def _first_of_pipe(descriptor: int, path: Path) -> bytes:
    """What is there already, once somebody has, or had, the other end; if nobody comes, it is refused."""
    events = select.poll()
    events.register(descriptor, select.POLLIN)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            if piece := os.read(descriptor, _AT_A_TIME):
                return piece
        except BlockingIOError:  # a writer that has written nothing yet
            return b""
        if any(event & select.POLLHUP for _, event in events.poll(0)):  # one that came and went
            return b""
        time.sleep(0.01)
    raise SourceError(
        "a pipe that nobody writes to",
        where=str(path),
        found=f"nothing in {PATIENCE:g} s",
        remedy="write the text into a file, or give it on standard input as -",
    )


def write_file(path: Path, data: bytes) -> None:
    """Write beside the target and rename, so that a file is there whole or not at all.

    A link is followed; what is no file (`/dev/null`, a pipe) is written to, never replaced.

    Raises:
        SourceError: no permission, no such folder, no room.
    """
    name = ""
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        path = path.resolve()
        if path.exists() and not os.access(path, os.W_OK):  # renaming would not ask
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        mode = path.stat().st_mode if path.exists() else 0o666 & ~_umask()
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as stream:
            name = stream.name
            stream.write(data)
        Path(name).chmod(mode)
        Path(name).replace(path)
    except OSError as error:
        if name:
            Path(name).unlink(missing_ok=True)
        raise SourceError("cannot be written", where=str(path), found=error.strerror or str(error)) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
