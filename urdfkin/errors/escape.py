"""Words from a file made safe for what shows them: one function for each target, used wherever names leave.

A name in a URDF may hold anything: line ends, escape sequences, marks that turn the direction of writing,
HTML, formulas. What acts in the target is written as an escape that can be read; nothing is dropped.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable
from typing import Any

#: What a spreadsheet takes for the beginning of a formula.
FORMULA = ("=", "+", "-", "@")
#: What a CI service would take for a command: Azure and TeamCity anywhere, GitHub at a line's beginning. The
#: group, which ends it, is written as an escape; JSON and TOML read it back as it was.
COMMAND_ANYWHERE = re.compile(r"##(?:vso|teamcity)?(\[)")
COMMANDS = (re.compile(r"\A\s*:(:)"), COMMAND_ANYWHERE)
#: Joins letters without being seen: what is split by it is no address, mention or number of an issue.
_JOINER = "&#8288;"


def printable(text: str) -> str:
    r"""One line for a terminal: everything that could act on it is written as an escape, line ends too.

    Example:
        >>> print(printable("a\u202eb\x1b[31m\n"))
        a\u202eb\x1b[31m\n
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def log_line(text: str) -> str:
    r"""One line for a terminal or a CI service's log: as `printable`, and no command for the service.

    Example:
        >>> print(log_line("::error::a\n##vso[b]"))
        :\u003aerror::a\n##vso\u005bb]
    """
    line = printable(text)
    for command in COMMANDS:
        line = command.sub(lambda found: found[0][:-1] + escape(found[1]), line)
    return line


def markdown_text(words: str) -> str:
    r"""Prose for Markdown: no markup, no HTML, no link, no mention, on one line.

    Example:
        >>> markdown_text("<b>*x*")
        '&lt;b&gt;\\*x\\*'
    """
    flat = printable(re.sub(r"\s+", " ", words)).replace("&", "&amp;")
    flat = flat.replace("<", "&lt;").replace(">", "&gt;")
    flat = re.sub(r"([\\`*_{}\[\]()|~!#$])", r"\\\1", flat.strip())
    flat = re.sub(r"^(\d*)([-+=.])", r"\1\\\2", flat)  # no list, no rule
    return re.sub(r"(?i)(@|\\#|:(?=//)|www(?=\.)|(?:mailto|xmpp):)", rf"\1{_JOINER}", flat)


def markdown_code(name: str) -> str:
    r"""A name for Markdown, in prose and in a table's cell: code, in which nothing acts.

    Backticks would end the code and bars the cell: they are written as escapes.

    Example:
        >>> print(markdown_code("a`|b"))
        `a\x60\x7cb`
    """
    return "`" + (printable(name).replace("`", r"\x60").replace("|", r"\x7c") or " ") + "`"


_LATEX = {c: f"\\{c}" for c in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def latex_text(text: str) -> str:
    """Text with LaTeX's special characters made harmless, on one line."""
    return "".join(_LATEX.get(character, character) for character in printable(text))


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    r"""Rows as CSV; words that a file brings go through `csv_cell` first.

    Example:
        >>> csv_text([["joint", "lower"], ["a, b", 0.5]])
        'joint,lower\n"a, b",0.5\n'
    """
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def json_text(data: Any) -> str:
    r"""JSON in ASCII, in which no log finds a command either; what reads it gets the names as they are.

    Example:
        >>> print(json_text(["\u202e ##[error]"]))
        ["\u202e #\u0023[error]"]
    """
    text = json.dumps(data, indent=2 if isinstance(data, dict) else None, allow_nan=False)
    return text.replace("##", r"#\u0023").replace("\x7f", r"\u007f")


def escape(c: str) -> str:
    """A character as JSON (but for rare ones), TOML and Python write it."""
    return f"\\u{ord(c):04x}" if ord(c) < 0x10000 else f"\\U{ord(c):08x}"


def csv_cell(name: str) -> str:
    r"""A name for comma-separated values: one line, and no spreadsheet takes it for a formula.

    An apostrophe before `=`, `+`, `-`, `@` says to a spreadsheet that this is text; `from_csv_cell` drops it.

    Example:
        >>> csv_cell("=cmd|'/C calc'!A0"), csv_cell("joint1")
        ("'=cmd|'/C calc'!A0", 'joint1')
    """
    line = printable(name).replace("##", r"#\x23")
    return f"'{line}" if line.lstrip("' ").startswith(FORMULA) else line


def from_csv_cell(cell: str) -> str:
    """The name that `csv_cell` wrote, where it held nothing that has to be escaped."""
    return cell[1:] if cell.startswith("'") and cell.lstrip("' ").startswith(FORMULA) else cell
