"""Pieces of a file made safe to print: nothing in them may act on a terminal or pretend to be a message.

The line of the file that a finding is about, with a caret below what is meant.

Mechanical cures: which bytes of a file to put others in place of, and everything else left as it is.

Places count in the bytes that follow a byte order mark, as the findings' lines and columns do.


One finding about a URDF: a stable code, where it is, what was found and what to do about it.

A finding is plain data, so that it can be printed, compared, turned into JSON or SARIF and sent to another
process. The rules stand in `urdfkin.lint.rules`, with their pages beside them.
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

#: Longest piece of a file that is quoted in a message.
QUOTED = 60


def shortened(text: str, limit: int = QUOTED) -> str:
    """At most `limit` characters of a text, safe to print."""
    return printable(text if len(text) <= limit else text[: limit - 3] + "...")


def quoted(text: str, limit: int = QUOTED) -> str:
    """A piece of the file in double quotes, safe to print, cut when it is long."""
    return '"' + shortened(text, limit).replace('"', '\\"') + '"'


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


#: Radians: what rounding an angle of a turn to a double moves at most.
ROUNDING = 2.0**-50


@dataclass(frozen=True, slots=True)
class Fix:
    """What cures a finding.

    Attributes:
        edits: What to put where, in the order of the file, none into another.
        turns: By how much it may turn the joint's frame, rad; with 0 the robot stays as it is.
    """

    edits: tuple[Edit, ...]
    turns: float = 0.0

    @property
    def is_safe(self) -> bool:
        """Whether it turns no joint by more than the rounding of one number."""
        return self.turns <= ROUNDING


def apply(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """A file with as many fixes as go together, and which these are; one that overlaps another waits.

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
    """How bad it is.

    An error stops everything: the file has no meaning, or two readers would see two robots. A warning is
    legal and almost certainly not meant, or not what every reader makes of it. A note is worth knowing.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        """0 for errors, 1 for warnings, 2 for notes."""
        return list(Severity).index(self)


class PinocchioReading(Enum):
    """What Pinocchio does with something that is legal, when it does not do what the specification says."""

    REFUSES = "refuses"
    DIFFERS = "differs"


@dataclass(frozen=True, slots=True)
class Finding:
    """What is wrong at one place of a file.

    Attributes:
        code: The stable code, `URDF502`.
        severity: Error, warning or note.
        message: The claim in one clause, without a full stop.
        found: The offending text as the file has it, or None.
        remedy: What to do, or None.
        file: The file's name as it was given, or `<text>`, `<stdin>`.
        line: Line, from 1.
        column: Column in characters, from 1.
        element: The element's tag (`joint`, `link`, `origin`, ...), or None for the file as a whole.
        name: The name of the link, joint or material the finding is about, or None.
        oracle: Set when Pinocchio refuses the file for this, or reads it differently: then nothing that is
            computed from the file can be verified against it.
        also: The line of each further finding that says the same and was folded into this one.
        width: How many characters of the line, from `column` on, it is about; 0: no place of the text.
        fix: What cures it without a person's judgement, or None.
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
        """What the finding is about, as a person would name it: `joint 'elbow'`, or an empty string."""
        if self.element is None:
            return ""
        tag = shortened(self.element)
        return tag if self.name is None else f"{tag} '{shortened(self.name)}'"

    @property
    def count(self) -> int:
        """How many findings it speaks for."""
        return 1 + len(self.also)

    @property
    def _again(self) -> str:
        """How many more there are, and on which lines."""
        others = tuple(sorted(set(self.also) - {self.line}))
        if len(others) == len(self.also):
            return f"also on {_lines(others)}"
        here = ("this line",) if self.line in self.also else ()
        where = (*here, _lines(others)) if others else here
        return f"{len(self.also)} more on {' and '.join(where)}"

    @property
    def sentence(self) -> str:
        """Everything but the place and the code, in one line."""
        subject = f"{self.subject}: " if self.element and self.name is not None else ""
        found = f": found {self.found}" if self.found else ""
        again = f" ({self._again})" if self.also else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{subject}{self.message}{found}{again}{remedy}"

    def __str__(self) -> str:
        place = f"{printable(self.file)}:{self.line}:{self.column}"
        return log_line(f"{place}: {self.code} {self.severity.value}: {self.sentence}")

    def as_dict(self) -> dict[str, Any]:
        """The finding as a report's JSON has it: the words of the enums, lists for tuples, no `fix`."""
        data = asdict(self)
        del data["width"], data["fix"]
        data["severity"] = self.severity.value
        data["oracle"] = self.oracle.value if self.oracle else None
        data["also"] = list(self.also)
        return data


class Findings(list[Finding], Displayable):
    """Findings about one file, by line: a list that shows itself."""

    def _sheet(self) -> TextDocument:
        rows = [(f"{f.file}:{f.line}:{f.column}", f.code, f.severity.value, f.sentence) for f in self]
        counts = {s: sum(f.count for f in self if f.severity is s) for s in Severity}
        said = [f"{n} {s.value}{'s' if n > 1 else ''}" for s, n in counts.items() if n]
        table = [Table(("place", "code", "severity", "what"), rows, left=4)] if rows else []
        return TextDocument(", ".join(said) or "no findings", table)


def _lines(lines: tuple[int, ...], shown: int = 4) -> str:
    numbers = ", ".join(str(line) for line in lines[:shown])
    rest = f" and {len(lines) - shown} more" if len(lines) > shown else ""
    return f"line{'s' if len(lines) > 1 else ''} {numbers}{rest}"


class UrdfError(UrdfkinError, ValueError):
    """A URDF that cannot be used; prints its errors as a linter does.

    Attributes:
        findings: Everything that was found in the file, warnings and notes included, by line.
    """

    #: How many errors the message prints before it says how many there are.
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
            remedy=f"'urdfkin explain {errors[0].code}' tells more" if errors else None,
        )

    def __str__(self) -> str:
        lines = [super().__str__(), *(f"  {finding}" for finding in self._errors[: self.SHOWN])]
        rest = sum(error.count for error in self._errors[self.SHOWN :])
        if rest:
            lines.append(f"  ... and {rest} more: see .findings or 'urdfkin check'")
        return "\n".join(lines)


class UrdfWarning(UserWarning):
    """Warned for each warning in a URDF that was loaded all the same."""
