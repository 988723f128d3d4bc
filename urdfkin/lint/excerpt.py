"""The line of the file that a finding is about, with a caret below what is meant."""

from __future__ import annotations

import unicodedata

from urdfkin.errors.printable import printable
from urdfkin.lint.finding import Finding

#: Characters of a line that are shown, and how many of them before what is meant.
SHOWN, BEFORE = 100, 60

_TAB = "    "


class Excerpts:
    """Lines of one file.

    Args:
        data: Its bytes behind a byte order mark.
    """

    def __init__(self, data: bytes) -> None:
        self.lines = data.splitlines()
        self.number, self.text = 0, ""

    def of(self, finding: Finding) -> str | None:
        """Two lines: the file's, and the caret's; None for a finding about the file as a whole.

        >>> from urdfkin.lint.finding import Severity
        >>> finding = Finding("URDF503", Severity.NOTE, "", column=7, width=11)
        >>> print(Excerpts(b'<axis xyz="0 0 2"/>').of(finding))
          1 | <axis xyz="0 0 2"/>
            |       ^^^^^^^^^^^
        """
        if finding.width <= 0 or not 0 < finding.line <= len(self.lines):
            return None
        if self.number != finding.line:  # one file may be one line, of megabytes
            self.number = finding.line
            self.text = self.lines[finding.line - 1].decode("utf-8", "replace")
        start = finding.column - 1
        first = max(start - BEFORE, 0) if len(self.text) > SHOWN else 0
        last = first + SHOWN
        end = min(start + finding.width, last)
        before, meant, behind = map(
            _shown, (self.text[first:start], self.text[start:end], self.text[end:last])
        )
        lead, tail = "..." if first else "", "..." if len(self.text) > last else ""
        number = f"{finding.line:>3}"
        caret = " " * (_cells(lead) + _cells(before)) + "^" * max(_cells(meant), 1)
        return f"{number} | {lead}{before}{meant}{behind}{tail}\n{' ' * len(number)} | {caret}"


def _shown(text: str) -> str:
    return printable(text.replace("\t", _TAB))


def _cells(text: str) -> int:
    """How many columns of a terminal a text takes."""
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )
