"""The standard streams as commands find them: there, able to hold any name, and in one line when they fail.

A shell can close a stream, connect it to a full disc or to a reader that leaves, or give it an encoding
without the letters of a name; none of these is a reason for a traceback.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import warnings
from typing import Any

from urdfkin.cli.door import say
from urdfkin.errors import SourceError

#: How a process ends that its reader has left: as shells report it of programs that a signal ends.
READER_GONE = 128 + signal.SIGPIPE


def prepare() -> None:
    """Once, before a command begins."""
    _occupy_closed()
    sys.stdout = _told(sys.stdout, 1)
    sys.stderr = _told(sys.stderr, 2)
    warnings.showwarning = _warn


def finish() -> None:
    """Write what is still held back, while a failure can be told.

    Raises:
        SourceError: it cannot be written.
    """
    sys.stdout.flush()


class _Raw(io.FileIO):
    """Standard output, whose failures are told once and end the command; of standard error's, none is."""

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self._failed = False

    def write(self, data: Any) -> Any:
        """As a file does, until it fails."""
        if self._failed:  # Python tries again when it ends
            return len(memoryview(data).cast("B"))
        try:
            return super().write(data)
        except OSError as error:
            self._failed = True
            if self.fileno() == 2:
                return len(memoryview(data).cast("B"))
            if error.errno == errno.EPIPE:
                raise SystemExit(READER_GONE) from None
            raise SourceError(
                "cannot be written", where="standard output", found=error.strerror or str(error)
            ) from None


def _told(stream: Any, descriptor: int) -> Any:
    """A stream of this process in place of Python's; others, as those of a test, stay."""
    try:
        if stream.fileno() != descriptor:
            return stream
    except (AttributeError, OSError, ValueError):
        return stream
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(_Raw(descriptor)),
        encoding=stream.encoding,
        errors="backslashreplace",
        line_buffering=stream.line_buffering,
        write_through=descriptor == 2,
    )


def _occupy_closed() -> None:
    """Put something where a stream is closed: the next file that is opened would take its number.

    Nothing can be written to that output, or read from that input; what is said on standard error is lost.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            flags = (os.O_WRONLY, os.O_RDONLY, os.O_WRONLY)[descriptor]
            opened = os.open(os.devnull, flags)
            if opened != descriptor:
                os.dup2(opened, descriptor)
                os.close(opened)
            mode = "r" if descriptor == 0 else "w"
            setattr(sys, name, open(descriptor, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def _warn(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any
) -> None:
    """Urdfkin's own warnings in a line; others as Python shows them."""
    if category.__module__.startswith("urdfkin."):
        say(f"urdfkin: warning: {message}", err=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))
