"""One finding about a URDF: a stable code, where it is, what was found and what to do about it.

A finding is plain data, so that it can be printed, compared, turned into JSON or SARIF and sent to another
process. The rules stand in `urdfkin.lint.rules`, with their pages beside them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from urdfkin.errors import UrdfkinError
from urdfkin.errors.printable import log_line, printable
from urdfkin.errors.showing import Sheet, Shown, Table
from urdfkin.lint.escape import shortened
from urdfkin.lint.fixes import Fix


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


class Findings(list[Finding], Shown):
    """Findings about one file, by line: a list that shows itself."""

    def _sheet(self) -> Sheet:
        rows = [(f"{f.file}:{f.line}:{f.column}", f.code, f.severity.value, f.sentence) for f in self]
        counts = {s: sum(f.count for f in self if f.severity is s) for s in Severity}
        said = [f"{n} {s.value}{'s' if n > 1 else ''}" for s, n in counts.items() if n]
        table = [Table(("place", "code", "severity", "what"), rows, left=4)] if rows else []
        return Sheet(", ".join(said) or "no findings", table)


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
