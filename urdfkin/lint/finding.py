"""`Finding`: a problem in a URDF, with a stable code, its position, the found text and a remedy.

A finding is plain data: it can be printed, compared, converted to JSON or SARIF and sent to another process.
This module also contains the automatic fix of a finding (`Fix`), the excerpt of its line (`Excerpts`), and
functions that make quoted text safe to print. Positions count in the bytes after a byte order mark. The rules
and their pages are in `urdfkin.lint.rules`.
"""

from __future__ import annotations

import codecs
import unicodedata
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from urdfkin.errors import UrdfkinError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import log_line, printable
from urdfkin.system.files import Edit, edited

#: Longest quotation from a file in a message, in characters.
QUOTED = 60


def shortened(text: str, limit: int = QUOTED) -> str:
    """Return at most `limit` characters of a text, safe to print."""
    return printable(text if len(text) <= limit else text[: limit - 3] + "...")


def quoted(text: str, limit: int = QUOTED) -> str:
    """Return a text in double quotes, at most `limit` characters of it, safe to print."""
    return '"' + shortened(text, limit).replace('"', '\\"') + '"'


#: Characters of a line in an excerpt, and how many of them are before the marked text.
SHOWN, BEFORE = 100, 60

_TAB = "    "


class Excerpts:
    """Excerpts of one file: the line of a finding, with carets below the marked text.

    Args:
        data: The bytes of the file after a byte order mark.
    """

    def __init__(self, data: bytes) -> None:
        self.lines = data.splitlines()
        self.number, self.text = 0, ""

    def of(self, finding: Finding) -> str | None:
        """Return two lines, the file's and one with carets; None for a finding about the whole file.

        >>> from urdfkin.lint.finding import Severity
        >>> finding = Finding("URDF503", Severity.NOTE, "", column=7, width=11)
        >>> print(Excerpts(b'<axis xyz="0 0 2"/>').of(finding))
          1 | <axis xyz="0 0 2"/>
            |       ^^^^^^^^^^^
        """
        if finding.width <= 0 or not 0 < finding.line <= len(self.lines):
            return None
        if self.number != finding.line:  # decode a line once: it may have megabytes
            self.number = finding.line
            self.text = self.lines[finding.line - 1].decode("utf-8", "replace")
        start = finding.column - 1
        first = max(start - BEFORE, 0) if len(self.text) > SHOWN else 0
        last = first + SHOWN
        end = min(start + finding.width, last)
        before, marked, behind = map(
            _printable, (self.text[first:start], self.text[start:end], self.text[end:last])
        )
        lead, tail = "..." if first else "", "..." if len(self.text) > last else ""
        number = f"{finding.line:>3}"
        caret = " " * (_cells(lead) + _cells(before)) + "^" * max(_cells(marked), 1)
        return f"{number} | {lead}{before}{marked}{behind}{tail}\n{' ' * len(number)} | {caret}"


def _printable(text: str) -> str:
    return printable(text.replace("\t", _TAB))


def _cells(text: str) -> int:
    """Return the number of terminal columns of a text."""
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


#: Largest change (rad) of an angle of one revolution when it is rounded to a double.
ROUNDING = 2.0**-50


@dataclass(frozen=True, slots=True)
class Fix:
    """The automatic fix of a finding.

    Attributes:
        edits: The edits of the text, in file order, without overlap.
        turns: Bound on the rotation (rad) of the joint frame by the fix; 0: the robot does not change.
    """

    edits: tuple[Edit, ...]
    turns: float = 0.0

    @property
    def is_safe(self) -> bool:
        """Whether the fix rotates no joint frame by more than the rounding of one number."""
        return self.turns <= ROUNDING


def apply(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """Apply the fixes that do not overlap; return the new bytes and the applied fixes.

    >>> apply(b'<axis xyz="0 0 2"/>', [Fix((Edit(11, 16, "0 0 1"),))])[0]
    b'<axis xyz="0 0 1"/>'
    """
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    taken, end = list[Fix](), 0
    for fix in sorted(fixes, key=lambda fix: fix.edits[0].start):
        if fix.edits[0].start >= end:
            taken.append(fix)
            end = fix.edits[-1].end
    return mark + edited(data.removeprefix(mark), [edit for fix in taken for edit in fix.edits]), taken


class Severity(Enum):
    """The severity of a finding.

    An error makes the file unusable: it has no meaning, or two readers would read two different robots. A
    warning is legal, but almost certainly a mistake, or read differently by some readers. A note is
    information.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 for errors, 1 for warnings, 2 for notes."""
        return list(Severity).index(self)


class PinocchioReading(Enum):
    """Pinocchio's behaviour for legal content, where it differs from the specification."""

    REFUSES = "refuses"
    DIFFERS = "differs"


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem at one position of a file.

    Attributes:
        code: The stable code, for example `URDF502`.
        severity: Error, warning or note.
        message: The problem in one clause, without a full stop.
        found: The text in the file that causes the finding, or None.
        remedy: The remedy, or None.
        file: The name of the file as given by the user, or `<text>`, `<stdin>`.
        line: Line, from 1.
        column: Column in characters, from 1.
        element: The tag of the element (`joint`, `link`, `origin`, ...); None for the whole file.
        name: The name of the link, joint or material, or None.
        oracle: Set if Pinocchio refuses the file for this reason or reads it differently. Then no result
            from the file can be verified with Pinocchio.
        also: The lines of further findings of the same kind, combined into this one.
        width: Number of marked characters from `column` on; 0: no position in the text.
        fix: The automatic fix, or None.
    """

    code: str
    severity: Severity
    message: str
    found: str | None = None
    remedy: str | None = None
    file: str = "<text>"
    line: int = 1
    column: int = 1
    element: str | None = None
    name: str | None = None
    oracle: PinocchioReading | None = None
    also: tuple[int, ...] = ()
    width: int = 0
    fix: Fix | None = None

    @property
    def subject(self) -> str:
        """The element and its name, for example `joint 'elbow'`; an empty string for the whole file."""
        if self.element is None:
            return ""
        tag = shortened(self.element)
        return tag if self.name is None else f"{tag} '{shortened(self.name)}'"

    @property
    def count(self) -> int:
        """The number of findings, those in `also` included."""
        return 1 + len(self.also)

    @property
    def _others(self) -> str:
        """The number of further findings and their lines."""
        others = tuple(sorted(set(self.also) - {self.line}))
        if len(others) == len(self.also):
            return f"also on {_lines(others)}"
        here = ("this line",) if self.line in self.also else ()
        where = (*here, _lines(others)) if others else here
        return f"{len(self.also)} more on {' and '.join(where)}"

    @property
    def sentence(self) -> str:
        """The finding in one line, without its position and code."""
        subject = f"{self.subject}: " if self.element and self.name is not None else ""
        found = f": found {self.found}" if self.found else ""
        also = f" ({self._others})" if self.also else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{subject}{self.message}{found}{also}{remedy}"

    def __str__(self) -> str:
        place = f"{printable(self.file)}:{self.line}:{self.column}"
        return log_line(f"{place}: {self.code} {self.severity.value}: {self.sentence}")

    def as_dict(self) -> dict[str, Any]:
        """Return the finding for the JSON of a report: enums as strings, tuples as lists, without `fix`."""
        data = asdict(self)
        del data["width"], data["fix"]
        data["severity"] = self.severity.value
        data["oracle"] = self.oracle.value if self.oracle else None
        data["also"] = list(self.also)
        return data


class Findings(list[Finding], Displayable):
    """The findings of one file, by line: a list that displays as a table."""

    def _sheet(self) -> TextDocument:
        rows = [(f"{f.file}:{f.line}:{f.column}", f.code, f.severity.value, f.sentence) for f in self]
        counts = {s: sum(f.count for f in self if f.severity is s) for s in Severity}
        totals = [f"{n} {s.value}{'s' if n > 1 else ''}" for s, n in counts.items() if n]
        table = [Table(("place", "code", "severity", "what"), rows, left=4)] if rows else []
        return TextDocument(", ".join(totals) or "no findings", table)


def _lines(lines: tuple[int, ...], shown: int = 4) -> str:
    numbers = ", ".join(str(line) for line in lines[:shown])
    rest = f" and {len(lines) - shown} more" if len(lines) > shown else ""
    return f"line{'s' if len(lines) > 1 else ''} {numbers}{rest}"


class UrdfError(UrdfkinError, ValueError):
    """A URDF with errors; its message lists them like a linter.

    Attributes:
        findings: All findings of the file by line, warnings and notes included.
    """

    #: Number of errors in the message; further errors are counted.
    SHOWN = 5

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        errors = self._errors = [one for one in self.findings if one.severity is Severity.ERROR]
        file = self.findings[0].file if self.findings else "<text>"
        total = sum(error.count for error in errors)
        count = "an error" if total == 1 else f"{total} errors"
        super().__init__(
            f"the URDF has {count}",
            where=file,
            remedy=f"run 'urdfkin explain {errors[0].code}' for details" if errors else None,
        )

    def __str__(self) -> str:
        lines = [super().__str__(), *(f"  {finding}" for finding in self._errors[: self.SHOWN])]
        rest = sum(error.count for error in self._errors[self.SHOWN :])
        if rest:
            lines.append(f"  ... and {rest} more: see .findings or 'urdfkin check'")
        return "\n".join(lines)


class UrdfWarning(UserWarning):
    """The Python warning for each warning in a loaded URDF."""
