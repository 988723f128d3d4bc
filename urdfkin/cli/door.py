"""The one way out to a terminal or a log: nothing that passes it can act on what shows it.

`guard` puts a door before standard output and standard error, so that no message can forget it: click's own
and Python's last words pass it as well. It lets line ends through, and it cannot know which of them a name
brought: whoever prints a line says it with `say` or to the console, which write those as escapes, too.
"""

from __future__ import annotations

import re
import sys
from typing import Any, TextIO

import click

from urdfkin.errors.printable import COMMAND_ANYWHERE, COMMANDS, escape, printable

#: What rich writes to a terminal: colours, and moves of the cursor for a bar.
_STYLE = re.compile(r"(\x1b\[[0-9;?]*[A-Za-z]|\r)")
#: How much of a line is remembered for what is written to it next.
_KEPT = 64


class Door:
    """A text stream that hands on what is harmless; machine formats go to its `buffer`, as bytes.

    Args:
        stream: Where to.
        styled: Whether styles pass: only for a stream to which nothing is written but by rich.
        encoding: What it says of itself.
    """

    def __init__(self, stream: TextIO, *, styled: bool = False, encoding: str | None = None) -> None:
        self.stream: TextIO = stream.stream if isinstance(stream, Door) else stream
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
        if stream is not None and not isinstance(stream, Door):
            # Click would go round a stream that cannot hold everything; this one can, by escapes.
            setattr(sys, name, Door(stream, encoding="utf-8"))


def say(line: str, *, err: bool = False) -> None:
    """One line, whatever names are in it."""
    click.echo(printable(line), err=err)


def say_styled(*words: tuple[str, dict[str, Any]]) -> None:
    """One line of words in several styles, where there is a terminal."""
    door = Door(sys.stdout, styled=sys.stdout.isatty())
    texts = (
        click.style(printable(text), **style) if door.styled else printable(text) for text, style in words
    )
    door.write("".join(texts) + "\n")


def say_file(text: str) -> None:
    """What would be a file, were one named."""
    Door(sys.stdout).write_file(text)


def harmless(text: str) -> str:
    """A file's text of whole lines, as `say_file` writes it."""
    return Door(sys.stdout).tamed_file(text)


def command_lines(text: str) -> None:
    """Lines that a CI service shall take for commands: findings for GitHub."""
    Door(sys.stdout).write_commands(text + "\n")
