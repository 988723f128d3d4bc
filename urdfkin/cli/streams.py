"""Safe standard streams: robust against stream failures, and against control characters in names.

A shell can close standard output. Standard output can be a file on a full disk, or a pipe to a program that
exits early. The encoding of standard output may not support every character of a joint's name. This module
handles all these failures without a traceback.

`guard` wraps standard output and standard error in a `SafeStream`, which escapes control characters and
commands of CI services. All output passes through this stream, also the output of click and Python. A
`SafeStream` does not escape line feeds, because most line feeds end a line of output. Line feeds in names are
escaped earlier, by the function `say` and the class `Terminal`.
"""

from __future__ import annotations

import errno
import io
import os
import re
import signal
import sys
import warnings
from typing import Any, TextIO

import click

from urdfkin.errors import DegreesWarning, SourceError
from urdfkin.errors.escape import COMMAND_ANYWHERE, COMMANDS, escape, printable

#: If the reader of a pipe has exited, the exit code is 128 + SIGPIPE, as in shells.
READER_GONE = 128 + signal.SIGPIPE


def prepare() -> None:
    """Prepare the standard streams; call it once, before a command begins."""
    _occupy_closed()
    sys.stdout = _with_errors(sys.stdout, 1)
    sys.stderr = _with_errors(sys.stderr, 2)
    warnings.showwarning = _warn
    # Each command prints its own line about joint values that look like degrees.
    warnings.filterwarnings("ignore", category=DegreesWarning)


def finish() -> None:
    """Flush standard output while an error can still be reported; raise SourceError if writing fails."""
    sys.stdout.flush()


class _Raw(io.FileIO):
    """Standard output or standard error as a raw file.

    The first failure of standard output ends the command with an error. Failures of standard error are
    ignored.
    """

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self._failed = False

    def write(self, data: Any) -> Any:
        """Write to the file until a write fails, then discard the data."""
        if self._failed:  # Python writes again at exit.
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


def _with_errors(stream: Any, descriptor: int) -> Any:
    """Return a standard stream that reports write errors; return the stream of a test unchanged."""
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
    """Open the null device for each closed stream, so that no other file gets the stream's descriptor.

    If standard input was closed, reading from it fails. If standard output was closed, writing to it fails.
    If standard error was closed, text written to it is lost.
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
    """Print a warning of urdfkin as one line, and other warnings in Python's format."""
    if category.__module__.startswith("urdfkin."):
        say(f"urdfkin: warning: {message}", err=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


#: The package rich writes these escape sequences for colours and for progress bars.
_STYLE = re.compile(r"(\x1b\[[0-9;?]*[A-Za-z]|\r)")
#: This many characters of an unfinished line are searched again together with the next piece.
#: A CI command may be written in two pieces.
_STORED = 64


class SafeStream:
    """A text stream that escapes control characters and CI commands.

    The bytes of a NumPy file are written to the attribute `buffer`, without escapes. Set `styled` only if
    nothing but the package rich writes to the stream: escape sequences for colours are then not escaped.
    `encoding` is the encoding that this stream reports.
    """

    def __init__(self, stream: TextIO, *, styled: bool = False, encoding: str | None = None) -> None:
        self.stream: TextIO = stream.stream if isinstance(stream, SafeStream) else stream
        self.styled = styled
        self.encoding = encoding or self.stream.encoding or "utf-8"
        self._line = ""

    def write(self, text: str) -> int:
        pieces = _STYLE.split(text) if self.styled else [text]
        self._pass(
            "".join(
                piece if k % 2 else self._without_commands(_plain(piece)) for k, piece in enumerate(pieces)
            )
        )
        return len(text)

    def write_commands(self, text: str) -> None:
        self._pass(COMMAND_ANYWHERE.sub(lambda found: found[0][:-1] + escape("["), _plain(text)))

    def write_file(self, text: str) -> None:
        """Write a file's text as UTF-8, whatever the encoding of the stream."""
        self.stream.flush()
        self.stream.buffer.write(self.tamed_file(text).encode())
        self.stream.buffer.flush()

    def tamed_file(self, text: str) -> str:
        """Return the text that `write_file` writes; a carriage return at the end of a line is not escaped."""
        *lines, last = text.split("\n")
        plain = [_plain(line.removesuffix("\r")) + "\r" * line.endswith("\r") for line in lines]
        return self._without_commands("\n".join([*plain, _plain(last)]))

    def _pass(self, text: str) -> None:
        encoding = self.stream.encoding or "utf-8"
        if not text.isascii():
            text = text.encode(encoding, "backslashreplace").decode(encoding)
        self.stream.write(text)

    def _without_commands(self, text: str) -> str:
        """Escape CI commands, including commands that are written in several pieces."""
        first, *rest = text.split("\n")
        lines = [self._line_without_commands(first)]
        for line in rest:
            self._line = ""
            lines.append(self._line_without_commands(line))
        return "\n".join(lines)

    def _line_without_commands(self, piece: str) -> str:
        before = len(self._line)
        whole = self._line + piece
        at = [m.start(1) for command in COMMANDS for m in command.finditer(whole) if m.start(1) >= before]
        # Only the last 16 characters of a long line are stored.
        # An "x" before them means that the removed text was not blank.
        self._line = whole if len(whole) <= _STORED else ("x" if whole.strip() else "") + whole[-16:]
        return "".join(escape(c) if before + k in at else c for k, c in enumerate(piece)) if at else piece

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def _plain(text: str) -> str:
    """Escape unprintable characters as in JSON, TOML and Python, except line feeds and tabs."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or c.isprintable() else escape(c) for c in text)


def guard() -> None:
    """Wrap standard output and standard error in `SafeStream` until the process ends."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, SafeStream):
            # Click bypasses streams with other encodings. SafeStream escapes missing characters.
            setattr(sys, name, SafeStream(stream, encoding="utf-8"))


def say(line: str, *, err: bool = False) -> None:
    """Print one line; control characters are escaped."""
    click.echo(printable(line), err=err)


def say_styled(*words: tuple[str, dict[str, Any]]) -> None:
    """Print one line of words; on a terminal, the words may have styles."""
    stream = SafeStream(sys.stdout, styled=sys.stdout.isatty())
    texts = (
        click.style(printable(text), **style) if stream.styled else printable(text) for text, style in words
    )
    stream.write("".join(texts) + "\n")


def say_file(text: str) -> None:
    SafeStream(sys.stdout).write_file(text)


def harmless(text: str) -> str:
    """Return a text as `say_file` would print it, with control characters escaped."""
    return SafeStream(sys.stdout).tamed_file(text)


def command_lines(text: str) -> None:
    """Write lines that GitHub interprets as commands, for example findings as annotations."""
    SafeStream(sys.stdout).write_commands(text + "\n")
