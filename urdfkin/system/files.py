"""Read and write files safely, and replace parts of a text.

By default, the functions read only regular files. An untrusted folder may contain a link to an endless
device, or a named pipe without a writer. A path from the user may be a pipe, such as `<(xacro arm.xacro)` in
bash. The functions wait at most `PIPE_TIMEOUT` seconds for a writer of the pipe; Python's `open` would wait
for ever.
"""

from __future__ import annotations

import errno
import os
import select
import stat
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import InputError, SourceError


@dataclass(frozen=True, slots=True)
class Edit:
    """A replacement of the bytes `data[start:end]` by `text`."""

    start: int
    end: int
    text: str = ""


def apply_edits(data: bytes, edits: Iterable[Edit]) -> bytes:
    """Return the data with all edits applied; raise InputError if two edits overlap.

    >>> apply_edits(b"a=1 b=2", [Edit(6, 7, "3"), Edit(2, 3, "10")])
    b'a=10 b=3'
    """
    parts, cursor = list[bytes](), 0
    for edit in sorted(edits, key=lambda one: (one.start, one.end)):
        if edit.start < cursor:
            raise InputError("two edits overlap", found=f"byte {edit.start}")
        parts += [data[cursor : edit.start], edit.text.encode()]
        cursor = edit.end
    return b"".join([*parts, data[cursor:]])


#: Maximum time to wait for a process that opens the other end of a named pipe, s.
PIPE_TIMEOUT = 10.0
#: Maximum size of a robot, table, settings or cached file, bytes.
MAX_BYTES = 100_000_000
#: Maximum size of data (trajectories, samples, reports), bytes.
MAX_DATA_BYTES = 2_000_000_000
_CHUNK_BYTES = 2**20
_FILE_TYPES = {
    stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a character device",
    stat.S_IFBLK: "a block device",
}  # fmt: skip


def read_bytes(path: Path, max_bytes: int = MAX_BYTES, *, pipes: bool = False) -> bytes:
    """Return the content of a file of at most `max_bytes` bytes, or raise SourceError.

    With `pipes`, the function also reads pipes and devices. Use `pipes` only for paths that the user named.
    """
    data = read_start(path, max_bytes + 1, pipes=pipes)
    if len(data) > max_bytes:
        raise _too_large(abbreviate_path(path), max_bytes)
    return data


def read_start(path: Path, count: int, *, pipes: bool = False) -> bytes:
    """Return the first bytes of a file, at most `count` bytes; `pipes` is as in `read_bytes`."""
    try:
        # Without O_NONBLOCK, opening a pipe blocks until a writer opens the pipe.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
        try:
            kind = os.fstat(descriptor).st_mode
            if stat.S_ISDIR(kind):
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if not pipes:
                _require_regular(path, kind)
            first = _read_first_of_pipe(descriptor, path) if stat.S_ISFIFO(kind) else b""
            os.set_blocking(descriptor, True)
            return _read_at_most(count, descriptor, first)
        finally:
            os.close(descriptor)
    except SourceError:
        raise
    except FileNotFoundError as error:
        raise SourceError("no such file", where=abbreviate_path(path)) from error
    # A null character in the name raises ValueError.
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SourceError("cannot be read", where=abbreviate_path(path), found=reason) from error


def require_regular_file(path: Path) -> None:
    """Raise SourceError for a pipe, a socket or a device, but not for a path that does not exist."""
    try:
        kind = path.stat().st_mode
    except (OSError, ValueError):
        return
    _require_regular(path, kind)


def _require_regular(path: Path, kind: int) -> None:
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise SourceError(
            "not a regular file",
            where=abbreviate_path(path),
            found=_FILE_TYPES.get(stat.S_IFMT(kind), "another kind"),
            remedy="put a regular file in its place",
        )


def read_if_exists(path: Path, max_bytes: int = MAX_BYTES) -> bytes | None:
    try:
        return read_bytes(path, max_bytes)
    except SourceError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return None
        raise


def read_text(path: Path, max_bytes: int = MAX_BYTES, *, pipes: bool = False) -> str:
    try:
        return read_bytes(path, max_bytes, pipes=pipes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SourceError(
            "cannot be read", where=str(path), found=f"text that is not UTF-8 ({error})"
        ) from None


def read_standard_input(max_bytes: int = MAX_BYTES) -> bytes:
    data = read_start_of_standard_input(max_bytes + 1)
    if len(data) > max_bytes:
        raise _too_large("standard input", max_bytes)
    return data


def read_start_of_standard_input(count: int) -> bytes:
    try:
        # The parent process may have closed standard input.
        if sys.stdin is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        data: bytes = sys.stdin.buffer.read(count)
    except OSError as error:
        raise SourceError("cannot be read", where="standard input", found=error.strerror) from error
    return data


def may_exist(path: Path) -> bool:
    """Return whether a path exists, or True if the check fails, for example for a path that is too long."""
    try:
        return path.exists()
    except OSError:
        # The function that reads the path reports the error.
        return True


def is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False


def expand_home(name: str | os.PathLike[str]) -> Path:
    try:
        return Path(name).expanduser()
    except RuntimeError:
        return Path(name)


def abbreviate_path(path: Path) -> str:
    """Return a path for a message, abbreviated if it has more than 300 characters.

    >>> len(abbreviate_path(Path("x" * 5000))) < 200
    True
    """
    text = str(path)
    return text if len(text) <= 300 else f"{text[:60]}...{text[-60:]} ({len(text)} characters)"


def _too_large(where: str, max_bytes: int) -> SourceError:
    return SourceError(
        "too large",
        where=where,
        found=f"more than {max_bytes} bytes",
        remedy="split the file, or remove the parts that are not needed",
    )


def _read_at_most(count: int, descriptor: int, first: bytes) -> bytes:
    pieces, remaining = [first[:count]], count - len(first)
    while remaining > 0 and (piece := os.read(descriptor, min(remaining, _CHUNK_BYTES))):
        pieces.append(piece)
        remaining -= len(piece)
    return b"".join(pieces)


def _read_first_of_pipe(descriptor: int, path: Path) -> bytes:
    """Return available bytes of a pipe; raise SourceError if no writer connects within `PIPE_TIMEOUT` s."""
    events = select.poll()
    events.register(descriptor, select.POLLIN)
    end = time.monotonic() + PIPE_TIMEOUT
    while time.monotonic() < end:
        try:
            if piece := os.read(descriptor, _CHUNK_BYTES):
                return piece
        # A writer is connected, but has written nothing yet.
        except BlockingIOError:
            return b""
        # POLLHUP means that a writer has connected and then closed the pipe.
        if any(event & select.POLLHUP for _, event in events.poll(0)):
            return b""
        time.sleep(0.01)
    raise SourceError(
        "a pipe without a writer",
        where=str(path),
        found=f"nothing in {PIPE_TIMEOUT:g} s",
        remedy="write the text into a file, or pass it on standard input with -",
    )


def write_file(path: Path, data: bytes) -> None:
    """Write a file completely, or raise SourceError and write nothing.

    A link is followed. A device or a pipe, such as `/dev/null`, is written directly.
    """
    name = ""
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        path = path.resolve()
        refuse_read_only(path)
        mode = path.stat().st_mode if path.exists() else 0o666 & ~_umask()
        import tempfile

        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as stream:
            name = stream.name
            stream.write(data)
        Path(name).chmod(mode)
        Path(name).replace(path)
    except OSError as error:
        if name:
            Path(name).unlink(missing_ok=True)
        raise SourceError("cannot be written", where=str(path), found=error.strerror or str(error)) from error


def refuse_read_only(path: Path) -> None:
    """Raise PermissionError for an existing read-only file, which `Path.replace` would replace."""
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
