"""Pieces of a file made safe to print: nothing in them may act on a terminal or pretend to be a message."""

from __future__ import annotations

#: Longest piece of a file that is quoted in a message.
QUOTED = 60


def printable(text: str) -> str:
    r"""The text with everything that a terminal could act on written as an escape.

    >>> print(printable("a\u202eb\x1b[31m"))
    a\u202eb\x1b[31m
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, limit: int = QUOTED) -> str:
    """At most `limit` characters of a text, safe to print."""
    return printable(text if len(text) <= limit else text[: limit - 3] + "...")


def quoted(text: str, limit: int = QUOTED) -> str:
    """A piece of the file in double quotes, safe to print, cut when it is long."""
    return '"' + shortened(text, limit).replace('"', '\\"') + '"'
