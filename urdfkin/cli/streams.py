"""Write to the standard streams without tracebacks, and escape control characters in names.

A command ends without a traceback if standard output is closed, if the disk is full, or if the reader of a
pipe exits early. The same applies if the encoding does not support a character of a joint's name.

`wrap_streams` wraps standard output and standard error in a `SafeStream`, which escapes control characters
and commands of CI services. A `SafeStream` does not escape line feeds, because most line feeds end a line of
output. The function `say` and the class `Terminal` escape line feeds in names.
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
from urdfkin.errors.escape import CI_COMMAND_ANYWHERE, CI_COMMANDS, escape_sequence, escape_unprintable

#: Exit code of shells for a program that writes to a closed pipe.
BROKEN_PIPE_EXIT_CODE = 128 + signal.SIGPIPE


def prepare_streams() -> None:
    _open_closed_streams()
    sys.stdout = _report_write_errors(sys.stdout, 1)
    sys.stderr = _report_write_errors(sys.stderr, 2)
    warnings.showwarning = _show_warning
    # DegreesWarning is hidden, because each command itself reports joint values that look like degrees.
    warnings.filterwarnings("ignore", category=DegreesWarning)


def flush_output() -> None:
    """Flush standard output now, so that the caller can report a failed write."""
    sys.stdout.flush()


class _RawStream(io.FileIO):
    """A standard stream; a write error on standard output ends the command.

    Write errors on standard error are ignored.
    """

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self._failed = False

    def write(self, data: Any) -> Any:
        if not self._failed:
            try:
                return super().write(data)
            except OSError as error:
                self._failed = True
                if self.fileno() == 1:
                    raise _stop_command(error) from None
        # After a failure, the stream discards all data.
        return len(memoryview(data).cast("B"))


def _stop_command(error: OSError) -> BaseException:
    if error.errno == errno.EPIPE:
        return SystemExit(BROKEN_PIPE_EXIT_CODE)
    return SourceError("cannot be written", where="standard output", found=error.strerror or str(error))


def _report_write_errors(stream: Any, descriptor: int) -> Any:
    """Wrap a standard stream, so that it reports write errors; return other streams unchanged."""
    try:
        if stream.fileno() != descriptor:
            return stream
    except (AttributeError, OSError, ValueError):
        return stream
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(_RawStream(descriptor)),
        encoding=stream.encoding,
        errors="backslashreplace",
        line_buffering=stream.line_buffering,
        write_through=descriptor == 2,
    )


def _open_closed_streams() -> None:
    """Open the null device in place of each closed standard stream.

    Otherwise, the next opened file would get the stream's descriptor.

    Standard input is opened write-only and standard output read-only, so that their use fails.
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


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any
) -> None:
    if category.__module__.startswith("urdfkin."):
        say(f"urdfkin: warning: {message}", err=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


#: Escape sequences that the package `rich` writes for colours and progress bars.
_STYLE = re.compile(r"(\x1b\[[0-9;?]*[A-Za-z]|\r)")
#: Maximum number of stored characters of an unfinished line. A longer line is stored only in part. The stream
#: stores unfinished lines because a CI command may be written in several pieces.
_MAX_STORED = 64


class SafeStream:
    """A text stream that escapes control characters and CI commands.

    With `styled`, the stream does not escape the escape sequences for colours. The caller must therefore
    escape control characters in names. The attribute `buffer` accepts bytes, without escapes.
    """

    def __init__(self, stream: TextIO, *, styled: bool = False, encoding: str | None = None) -> None:
        self.stream: TextIO = stream.stream if isinstance(stream, SafeStream) else stream
        self.styled = styled
        self.encoding = encoding or self.stream.encoding or "utf-8"
        self._line = ""

    def write(self, text: str) -> int:
        pieces = _STYLE.split(text) if self.styled else [text]
        # Control characters and CI commands are escaped only between the escape sequences for colours.
        pieces[::2] = [self._escape_commands(_escape_unprintable(piece)) for piece in pieces[::2]]
        self._write_raw("".join(pieces))
        return len(text)

    def write_github_commands(self, text: str) -> None:
        self._write_raw(
            CI_COMMAND_ANYWHERE.sub(
                lambda found: found[0][:-1] + escape_sequence("["), _escape_unprintable(text)
            )
        )

    def write_file_content(self, text: str) -> None:
        self.stream.flush()
        self.stream.buffer.write(self.escape_file_content(text).encode())
        self.stream.buffer.flush()

    def escape_file_content(self, text: str) -> str:
        """Escape control characters and CI commands in `text`, as `write_file_content` does.

        A carriage return at the end of a line is not escaped.
        """
        *lines, last = text.split("\n")
        plain = [_escape_unprintable(line.removesuffix("\r")) + "\r" * line.endswith("\r") for line in lines]
        return self._escape_commands("\n".join([*plain, _escape_unprintable(last)]))

    def _write_raw(self, text: str) -> None:
        encoding = self.stream.encoding or "utf-8"
        if not text.isascii():
            text = text.encode(encoding, "backslashreplace").decode(encoding)
        self.stream.write(text)

    def _escape_commands(self, text: str) -> str:
        """Escape CI commands in `text`. A command may begin in the text of an earlier call."""
        first, *rest = text.split("\n")
        lines = [self._escape_commands_in_line(first)]
        for line in rest:
            self._line = ""
            lines.append(self._escape_commands_in_line(line))
        return "\n".join(lines)

    def _escape_commands_in_line(self, piece: str) -> str:
        before = len(self._line)
        whole = self._line + piece
        escaped_indices = [
            m.start(1) for command in CI_COMMANDS for m in command.finditer(whole) if m.start(1) >= before
        ]
        # Only the last 16 characters of a long line are stored. The "x" replaces the deleted characters, so
        # that a remaining "::" is not at the start of the line.
        is_long = len(whole) > _MAX_STORED
        self._line = ("x" if whole.strip() else "") + whole[-16:] if is_long else whole
        return (
            "".join(escape_sequence(c) if before + k in escaped_indices else c for k, c in enumerate(piece))
            if escaped_indices
            else piece
        )

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def _escape_unprintable(text: str) -> str:
    """Escape unprintable characters, except line feeds and tabs, as in JSON, TOML and Python."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or c.isprintable() else escape_sequence(c) for c in text)


def wrap_streams() -> None:
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, SafeStream):
            # The encoding is set to UTF-8, because click would bypass a stream that reports the encoding
            # ASCII.
            setattr(sys, name, SafeStream(stream, encoding="utf-8"))


def join_lines(text: str) -> str:
    """Return the lines of a text as one line, separated by semicolons."""
    return "; ".join(map(str.strip, text.splitlines()))


def say(line: str, *, err: bool = False) -> None:
    """Print one line; escape control characters and line ends in `line`."""
    click.echo(escape_unprintable(line), err=err)


def say_styled(*words: tuple[str, dict[str, Any]]) -> None:
    stream = SafeStream(sys.stdout, styled=sys.stdout.isatty())
    texts = (
        click.style(escape_unprintable(text), **style) if stream.styled else escape_unprintable(text)
        for text, style in words
    )
    stream.write("".join(texts) + "\n")


def say_file_content(text: str) -> None:
    SafeStream(sys.stdout).write_file_content(text)


def escape_for_terminal(text: str) -> str:
    """Escape a text as `say_file_content` does, but do not print it."""
    return SafeStream(sys.stdout).escape_file_content(text)


def print_github_commands(text: str) -> None:
    """Write lines that GitHub interprets as commands, for example findings as annotations."""
    SafeStream(sys.stdout).write_github_commands(text + "\n")
