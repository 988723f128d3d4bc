"""Escape names from files, with one function for each output format.

A name in a URDF may contain line ends, terminal escape sequences, bidirectional control characters, HTML or
spreadsheet formulas. Each function escapes these parts of a name for one format.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable
from typing import Any

#: First characters that make a spreadsheet cell a formula.
FORMULA_STARTS = ("=", "+", "-", "@")
#: Pattern of a command of Azure or TeamCity, anywhere in a line. Group 1 is the character to escape.
CI_COMMAND_ANYWHERE = re.compile(r"##(?:vso|teamcity)?(\[)")
#: Patterns of commands of GitHub (for example `::error::`), Azure and TeamCity in logs. GitHub executes a
#: command only at the beginning of a line.
CI_COMMANDS = (re.compile(r"\A\s*:(:)"), CI_COMMAND_ANYWHERE)
_NUMBER = re.compile(r"[-+]?[0-9.]+(?:e[-+]?[0-9]+)?")
#: Invisible character (word joiner) that prevents Markdown links, mentions and issue numbers.
_WORD_JOINER = "&#8288;"


def escape_unprintable(text: str) -> str:
    """Escape unprintable characters and line ends, so that the text is safe for a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def log_line(text: str) -> str:
    r"""Return one line that is safe for a terminal and for the log of a CI service.

    >>> print(log_line("::error::a\n##vso[b]"))
    :\u003aerror::a\n##vso\u005bb]
    """
    line = escape_unprintable(text)
    for command in CI_COMMANDS:
        line = command.sub(lambda found: found[0][:-1] + escape_sequence(found[1]), line)
    return line


def markdown_text(words: str) -> str:
    """Escape a sentence for one line of Markdown.

    The line contains no markup, HTML, links, mentions, lists or rules.
    """
    return re.sub(r"^(\d*)([-+=.])", r"\1\\\2", markdown_cell(words))


def markdown_cell(words: str) -> str:
    """Escape text for a cell of a Markdown table. In a cell, lists and horizontal rules need no escapes."""
    flat = escape_unprintable(re.sub(r"\s+", " ", words)).replace("&", "&amp;")
    flat = flat.replace("<", "&lt;").replace(">", "&gt;")
    flat = re.sub(r"([\\`*_{}\[\]()|~!#$])", r"\\\1", flat.strip())
    return re.sub(r"(?i)(@|\\#|:(?=//)|www(?=\.)|(?:mailto|xmpp):)", rf"\1{_WORD_JOINER}", flat)


def markdown_code(name: str) -> str:
    """Return a name as Markdown code.

    Backticks and bars are escaped, because a backtick ends the code, and a bar ends a table cell.
    """
    return "`" + (escape_unprintable(name).replace("`", r"\x60").replace("|", r"\x7c") or " ") + "`"


_LATEX = {c: f"\\{c}" for c in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def latex_text(text: str) -> str:
    return "".join(_LATEX.get(character, character) for character in escape_unprintable(text))


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    r"""Return rows as CSV. Pass names from files through `csv_cell` first.

    >>> csv_text([["joint", "lower"], ["a, b", 0.5]])
    'joint,lower\n"a, b",0.5\n'
    """
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def json_text(data: Any) -> str:
    r"""Return data as JSON text in ASCII.

    A CI service can interpret text such as `##[error]` as a command. To prevent this, the function escapes
    the second `#` of each `##`. A JSON parser restores the original text.

    >>> print(json_text(["\u202e ##[error]"]))
    ["\u202e #\u0023[error]"]
    """
    text = json.dumps(data, indent=2 if isinstance(data, dict) else None, allow_nan=False)
    return text.replace("##", r"#\u0023").replace("\x7f", r"\u007f")


def escape_sequence(c: str) -> str:
    """Return the escape sequence of a character in Python and TOML.

    JSON uses the same sequence for characters up to U+FFFF.
    """
    return f"\\u{ord(c):04x}" if ord(c) < 0x10000 else f"\\U{ord(c):08x}"


def csv_cell(name: str) -> str:
    r"""Escape a name for a CSV cell.

    The result is one line that no spreadsheet interprets as a formula. An apostrophe before `=`, `+`, `-` or
    `@` marks the cell as text. `from_csv_cell` removes the apostrophe.

    >>> csv_cell("=cmd|'/C calc'!A0"), csv_cell("joint1")
    ("'=cmd|'/C calc'!A0", 'joint1')
    """
    line = escape_unprintable(name).replace("##", r"#\x23")
    return f"'{line}" if line.lstrip("' ").startswith(FORMULA_STARTS) else line


def csv_number_or_text(text: str) -> str:
    """Escape text for a CSV cell as `csv_cell` does, but return a number unchanged.

    >>> csv_number_or_text("-0.5"), csv_number_or_text("-y")
    ('-0.5', "'-y")
    """
    return text if _NUMBER.fullmatch(text) else csv_cell(text)


def from_csv_cell(cell: str) -> str:
    """Return the name from a cell that `csv_cell` wrote. Escaped characters stay escaped."""
    return cell[1:] if cell.startswith("'") and cell.lstrip("' ").startswith(FORMULA_STARTS) else cell
