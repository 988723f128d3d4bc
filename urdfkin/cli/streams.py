"""The standard streams as commands find them: there, able to hold any name, and in one line when they fail.

A shell can close a stream, connect it to a full disc or to a reader that leaves, or give it an encoding
without the letters of a name; none of these is a reason for a traceback.


The one way out to a terminal or a log: nothing that passes it can act on what shows it.

`guard` puts a door before standard output and standard error, so that no message can forget it: click's own
and Python's last words pass it as well. It lets line ends through, and it cannot know which of them a name
brought: whoever prints a line says it with `say` or to the console, which write those as escapes, too.
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

from urdfkin.errors import SourceError
from urdfkin.errors.escape import COMMAND_ANYWHERE, COMMANDS, escape, printable

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


#: What rich writes to a terminal: colours, and moves of the cursor for a bar.
_STYLE = re.compile(r"(\x1b\[[0-9;?]*[A-Za-z]|\r)")
#: How much of a line is remembered for what is written to it next.
_KEPT = 64


class SafeStream:
    """A text stream that hands on what is harmless; machine formats go to its `buffer`, as bytes.

    Args:
        stream: Where to.
        styled: Whether styles pass: only for a stream to which nothing is written but by rich.
        encoding: What it says of itself.
    """

    def __init__(self, stream: TextIO, *, styled: bool = False, encoding: str | None = None) -> None:
        self.stream: TextIO = stream.stream if isinstance(stream, SafeStream) else stream
        self.styled = styled
        self.encoding = encoding or self.stream.encoding or "utf-8"
        self._line = ""

    def write(self, text: str) -> int:
        """As a stream does."""
        pieces = _STYLE.split(text) if self.styled else [text]
        self._hand_on(
            "".join(piece if k % 2 else self._tamed(_plain(piece)) for k, piece in enumerate(pieces))
        )
        return len(text)

    def write_commands(self, text: str) -> None:
        """What is meant as commands for a CI service."""
        self._hand_on(COMMAND_ANYWHERE.sub(lambda found: found[0][:-1] + escape("["), _plain(text)))

    def write_file(self, text: str) -> None:
        """A file's text: the same bytes whatever letters the stream knows."""
        self.stream.flush()
        self.stream.buffer.write(self.tamed_file(text).encode())
        self.stream.buffer.flush()

    def tamed_file(self, text: str) -> str:
        """A file's text as `write_file` writes it: a carriage return before a line feed acts on nothing."""
        *lines, last = text.split("\n")
        plain = [_plain(line.removesuffix("\r")) + "\r" * line.endswith("\r") for line in lines]
        return self._tamed("\n".join([*plain, _plain(last)]))

    def _hand_on(self, text: str) -> None:
        encoding = self.stream.encoding or "utf-8"
        if not text.isascii():
            text = text.encode(encoding, "backslashreplace").decode(encoding)
        self.stream.write(text)

    def _tamed(self, text: str) -> str:
        """Without commands, also where one is written in pieces."""
        first, *rest = text.split("\n")
        lines = [self._tamed_line(first)]
        for line in rest:
            self._line = ""
            lines.append(self._tamed_line(line))
        return "\n".join(lines)

    def _tamed_line(self, piece: str) -> str:
        before = len(self._line)
        whole = self._line + piece
        at = [m.start(1) for command in COMMANDS for m in command.finditer(whole) if m.start(1) >= before]
        # Where the line is long, what was blank from its beginning must still be so.
        self._line = whole if len(whole) <= _KEPT else ("x" if whole.strip() else "") + whole[-16:]
        return "".join(escape(c) if before + k in at else c for k, c in enumerate(piece)) if at else piece

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def _plain(text: str) -> str:
    """Line ends and tabs pass; what else cannot be seen is written as JSON, TOML and Python would."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or c.isprintable() else escape(c) for c in text)


def guard() -> None:
    """From here on everything passes, until Python has said its last word."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, SafeStream):
            # Click would go round a stream that cannot hold everything; this one can, by escapes.
            setattr(sys, name, SafeStream(stream, encoding="utf-8"))


def say(line: str, *, err: bool = False) -> None:
    """One line, whatever names are in it."""
    click.echo(printable(line), err=err)


def say_styled(*words: tuple[str, dict[str, Any]]) -> None:
    """One line of words in several styles, where there is a terminal."""
    door = SafeStream(sys.stdout, styled=sys.stdout.isatty())
    texts = (
        click.style(printable(text), **style) if door.styled else printable(text) for text, style in words
    )
    door.write("".join(texts) + "\n")


def say_file(text: str) -> None:
    """What would be a file, were one named."""
    SafeStream(sys.stdout).write_file(text)


def harmless(text: str) -> str:
    """A file's text of whole lines, as `say_file` writes it."""
    return SafeStream(sys.stdout).tamed_file(text)


def command_lines(text: str) -> None:
    """Lines that a CI service shall take for commands: findings for GitHub."""
    SafeStream(sys.stdout).write_commands(text + "\n")
