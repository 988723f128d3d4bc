"""Pieces of a file made safe to print: nothing in them may act on a terminal or pretend to be a message."""

from __future__ import annotations

from urdfkin.errors.printable import printable

#: Longest piece of a file that is quoted in a message.
QUOTED = 60


def shortened(text: str, limit: int = QUOTED) -> str:
    """At most `limit` characters of a text, safe to print."""
    return printable(text if len(text) <= limit else text[: limit - 3] + "...")


def quoted(text: str, limit: int = QUOTED) -> str:
    """A piece of the file in double quotes, safe to print, cut when it is long."""
    return '"' + shortened(text, limit).replace('"', '\\"') + '"'
