"""Define findings: problems in a URDF, each with a code, a position, the wrong text and a remedy.

Line and column numbers do not count a byte order mark.

A comment in a URDF can silence findings. The comment names the codes of the findings and gives a reason:

    <!-- urdfkin: ignore[URDF601] the vendor's own digits -->

| Position of the comment | Silenced findings |
|---|---|
| after other text on the same line | findings on this line |
| on its own line, before an element | findings in this element |
| before the root element | findings in the whole file |
"""

from __future__ import annotations

import codecs
import re
import unicodedata
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import Enum
from itertools import islice
from typing import Any

from urdfkin.errors import UrdfkinError, find_similar_names
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import escape_unprintable, log_line
from urdfkin.system.files import Edit, apply_edits
from urdfkin.urdf.records import ATTRIBUTE, DEFAULT_LIMITS, START_TAG, Element, Limits

#: Maximum number of characters of a file that a message quotes.
QUOTED = 60


def shortened(text: str, limit: int = QUOTED) -> str:
    return escape_unprintable(text if len(text) <= limit else text[: limit - 3] + "...")


def quoted(text: str, limit: int = QUOTED) -> str:
    return '"' + shortened(text, limit).replace('"', '\\"') + '"'


#: A line of more than `SHOWN` characters is cut; at most `BEFORE` characters precede the underlined text.
SHOWN, BEFORE = 100, 60

_TAB = "    "


class Excerpts:
    """Shows the lines of a file and underlines the wrong text; `data` has no byte order mark."""

    def __init__(self, data: bytes) -> None:
        self.lines = data.splitlines()
        self.number, self.text = 0, ""

    def of(self, finding: Finding) -> str | None:
        """Return the line of a finding, with carets below the wrong text; None if the finding marks no text.

        >>> from urdfkin.urdf.findings import Severity
        >>> finding = Finding("URDF503", Severity.NOTE, "", column=7, width=11)
        >>> print(Excerpts(b'<axis xyz="0 0 2"/>').of(finding))
          1 | <axis xyz="0 0 2"/>
            |       ^^^^^^^^^^^
        """
        if finding.width <= 0 or not 0 < finding.line <= len(self.lines):
            return None
        if self.number != finding.line:  # A line may have megabytes, so it is not decoded for every finding.
            self.number = finding.line
            self.text = self.lines[finding.line - 1].decode("utf-8", "replace")
        start = finding.column - 1
        first = max(start - BEFORE, 0) if len(self.text) > SHOWN else 0
        last = first + SHOWN
        end = min(start + finding.width, last)
        pieces = self.text[first:start], self.text[start:end], self.text[end:last]
        before, marked, behind = (escape_unprintable(piece.replace("\t", _TAB)) for piece in pieces)
        lead, tail = "..." if first else "", "..." if len(self.text) > last else ""
        number = f"{finding.line:>3}"
        caret = " " * (_cells(lead) + _cells(before)) + "^" * max(_cells(marked), 1)
        return f"{number} | {lead}{before}{marked}{behind}{tail}\n{' ' * len(number)} | {caret}"


def _cells(text: str) -> int:
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


#: Upper bound (rad) on the error of rounding an angle of at most one revolution to a double.
ROUNDING = 2.0**-50


@dataclass(frozen=True, slots=True)
class Fix:
    """The automatic fix of a finding.

    Attributes:
        edits: Edits of the text, in file order, without overlap.
        turns: Upper bound on the angle (rad) by which the fix rotates the frame of a joint; 0 if the fix does
            not change the robot.
    """

    edits: tuple[Edit, ...]
    turns: float = 0.0

    @property
    def is_safe(self) -> bool:
        return self.turns <= ROUNDING


def apply(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """Return the fixed bytes and the applied fixes; a fix that overlaps an earlier fix is skipped."""
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    taken, end = list[Fix](), 0
    for fix in sorted(fixes, key=lambda fix: fix.edits[0].start):
        if fix.edits[0].start >= end:
            taken.append(fix)
            end = fix.edits[-1].end
    return mark + apply_edits(data.removeprefix(mark), [edit for fix in taken for edit in fix.edits]), taken


class Severity(Enum):
    """The severity of a finding.

    - Error: the file describes no robot, or different URDF readers build different robots from the file.
    - Warning: legal content that is almost certainly a mistake, or that URDF readers interpret differently.
    - Note: information.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        return list(Severity).index(self)


class PinocchioReading(Enum):
    """How Pinocchio treats legal content: it refuses the file, or deviates from the URDF specification."""

    REFUSES = "refuses"
    DIFFERS = "differs"


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem at one position of a file.

    Attributes:
        code: Code of the kind of problem, for example `URDF502`. Codes do not change between versions.
        severity: Error, warning or note.
        message: The problem in one clause, without a full stop.
        found: The wrong text in the file, in quotes, or None.
        remedy: The remedy, or None.
        file: The name of the file as the user wrote it, or `<text>`, `<stdin>`.
        line: Line number, from 1.
        column: Column number in characters, from 1.
        element: The tag of the element (`joint`, `link`, `origin`, ...); None for the whole file.
        name: The name of the link, joint or material, or None.
        oracle: If this value is not None, Pinocchio refuses the file or reads the content differently, so
            urdfkin cannot verify any result of the robot with Pinocchio.
        also: Line numbers of further findings with the same code that are combined into this finding.
        width: Number of characters to underline, starting at `column`; 0 if nothing is underlined.
        fix: The automatic fix, or None.

    >>> import urdfkin
    >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
    >>> print(finding)
    <text>:1:39: URDF402 error: link 'a': another link has this name; the first is on line 1; rename one link
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
        """The element and its name, for example `joint 'elbow'`; an empty string for the whole file.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.subject
        "link 'a'"
        """
        if self.element is None:
            return ""
        tag = shortened(self.element)
        if self.element == "prim" and self.name is not None and len(self.name) > QUOTED:
            return f"{tag} '...{escape_unprintable(self.name[3 - QUOTED :])}'"
        return tag if self.name is None else f"{tag} '{shortened(self.name)}'"

    @property
    def count(self) -> int:
        """Number of findings that this object represents: 1 plus the length of `also`.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.count
        1
        """
        return 1 + len(self.also)

    @property
    def _other_lines(self) -> str:
        """Text about the line numbers in `also`, for example "also on lines 3, 7"."""
        others = tuple(sorted(set(self.also) - {self.line}))
        if len(others) == len(self.also):
            return f"also on {_lines(others)}"
        here = ("this line",) if self.line in self.also else ()
        where = (*here, _lines(others)) if others else here
        return f"{len(self.also)} more on {' and '.join(where)}"

    @property
    def sentence(self) -> str:
        """The finding in one line, without its position and code.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.sentence
        "link 'a': another link has this name; the first is on line 1; rename one link"
        """
        subject = f"{self.subject}: " if self.element and self.name is not None else ""
        found = f": found {self.found}" if self.found else ""
        also = f" ({self._other_lines})" if self.also else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{subject}{self.message}{found}{also}{remedy}"

    def __str__(self) -> str:
        place = f"{escape_unprintable(self.file)}:{self.line}:{self.column}"
        return log_line(f"{place}: {self.code} {self.severity.value}: {self.sentence}")

    def as_dict(self) -> dict[str, Any]:
        """Return the finding for the JSON of a report: enums as strings, tuples as lists, without `fix`.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.as_dict()["code"]
        'URDF402'
        """
        data = asdict(self)
        del data["width"], data["fix"]
        data["severity"] = self.severity.value
        data["oracle"] = self.oracle.value if self.oracle else None
        data["also"] = list(self.also)
        return data


class Findings(list[Finding], Displayable):
    def _text_document(self) -> TextDocument:
        rows = [(f"{f.file}:{f.line}:{f.column}", f.code, f.severity.value, f.sentence) for f in self]
        table = [Table(("place", "code", "severity", "what"), rows, left=4)] if rows else []
        return TextDocument(totals(self), table)


def severity_counts(findings: Sequence[Finding]) -> dict[str, int]:
    return {s.value: sum(f.count for f in findings if f.severity is s) for s in Severity}


def totals(findings: Sequence[Finding]) -> str:
    words = [f"{n} {word}{'s' if n > 1 else ''}" for word, n in severity_counts(findings).items() if n]
    return ", ".join(words) or "no findings"


def _lines(lines: tuple[int, ...], shown: int = 4) -> str:
    numbers = ", ".join(str(line) for line in lines[:shown])
    rest = f" and {len(lines) - shown} more" if len(lines) > shown else ""
    return f"line{'s' if len(lines) > 1 else ''} {numbers}{rest}"


class UrdfError(UrdfkinError, ValueError):
    """A URDF has errors. The message lists the first five errors, each with file, line and column.

    Attributes:
        findings: All findings of the file by line, warnings and notes included.

    >>> import urdfkin
    >>> try:
    ...     robot = urdfkin.load('<robot name="r"><link name="a"/><link name="a"/></robot>')
    ... except ValueError as error:  # UrdfError is a subclass of ValueError
    ...     print(error.findings[0].code)
    URDF402
    """

    #: Maximum number of errors that the message lists.
    SHOWN = 5

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        errors = self._errors = [one for one in self.findings if one.severity is Severity.ERROR]
        file = self.findings[0].file if self.findings else "<text>"
        total = sum(error.count for error in errors)
        count = "an error" if total == 1 else f"{total} errors"
        remedy = f"run 'urdfkin explain {errors[0].code}' for details" if errors else None
        super().__init__(f"the URDF has {count}", where=file, remedy=remedy)

    def __str__(self) -> str:
        lines = [super().__str__(), *(f"  {finding}" for finding in self._errors[: self.SHOWN])]
        rest = sum(error.count for error in self._errors[self.SHOWN :])
        if rest:
            lines.append(f"  ... and {rest} more: see .findings or 'urdfkin check'")
        return "\n".join(lines)


class UrdfWarning(UserWarning):
    """The class of the Python warnings that `urdfkin.load` issues about a robot's file.

    >>> import urdfkin
    >>> issubclass(urdfkin.UrdfWarning, UserWarning)
    True
    """


ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE
REFUSES, DIFFERS = PinocchioReading.REFUSES, PinocchioReading.DIFFERS


@dataclass(frozen=True, slots=True)
class Rule:
    """A kind of finding.

    Attributes:
        id: The code of the findings: `URDF`, `MJCF` or `USD`, and three digits. A code is never reused. The
            first digit of a URDF code is the topic. 1: text and XML. 2: elements and attributes. 3: numbers.
            4: names and structure. 5: joints. 6: probable mistakes. 7: inertials, geometry and materials.
    """

    id: str
    slug: str
    severity: Severity
    oracle: PinocchioReading | None = None


#: First word of a comment with an instruction for urdfkin.
MARK = "urdfkin:"


@dataclass(slots=True)
class Comment:
    """A comment with an instruction for urdfkin, and the `element` that begins after the comment.

    `behind` is true if other text precedes the comment on the same line.
    """

    text: str
    line: int
    column: int
    behind: bool
    element: Element | None = None


@dataclass(slots=True, eq=False)
class Silence:
    """A comment that silences findings; `used` has the codes of the silenced findings."""

    comment: Comment
    codes: tuple[str, ...]
    reason: str
    used: set[str] = field(default_factory=set)


@dataclass(slots=True)
class Silences:
    all: list[Silence] = field(default_factory=list)
    #: First comment for each key: ("line", number, code), ("element", id, code) or ("file", 0, code).
    _first: dict[tuple[str, int, str], Silence] = field(default_factory=dict)

    def add(self, silence: Silence) -> None:
        self.all.append(silence)
        comment = silence.comment
        if comment.behind:
            place = "line", comment.line
        elif comment.element is None:
            return
        elif comment.element.parent is None:
            place = "file", 0
        else:
            place = "element", id(comment.element)
        for code in silence.codes:
            self._first.setdefault((*place, code), silence)

    def reason(self, code: str, line: int, at: Element | None) -> str | None:
        """Return the reason of the nearest comment that silences a finding, or None."""
        places = [("line", line)]
        while at is not None:
            places.append(("element", id(at)))
            at = at.parent
        for place in (*places, ("file", 0)):
            if (silence := self._first.get((*place, code))) is not None:
                silence.used.add(code)
                return silence.reason
        return None


#: Maximum number of misspelt names in a file for which similar names are suggested.
SEARCHES = 20
#: Limits of one search for similar names: number of names, and number of compared pairs of characters.
CANDIDATES, WORK = 5_000, 250_000

#: If a code has at least this number of warnings or notes, one finding represents all of them.
#: `FOLDED_EXTRAS` applies to the codes URDF7xx, about content that kinematics does not use.
FOLDED, FOLDED_EXTRAS = 4, 2

#: If more errors than this have the same code, the further errors are combined into one.
ERRORS_SHOWN = 100

#: Maximum number of complete findings with one code. For further findings, only the line number is stored.
WRITTEN_OUT = 10_000


@dataclass(slots=True)
class _Kind:
    """Findings of one code and severity.

    Attributes:
        found: Pairs of a finding and its weight; at most `WRITTEN_OUT` pairs.
        lines: Line numbers of all further findings.
    """

    severity: Severity
    found: list[tuple[Finding, float]] = field(default_factory=list)
    lines: array[int] = field(default_factory=lambda: array("q"))


@dataclass(slots=True)
class Reporter:
    file: str
    data: bytes = b""
    limits: Limits = DEFAULT_LIMITS
    comments: list[Comment] = field(default_factory=list)
    silenced: list[tuple[Finding, str]] = field(default_factory=list)
    silences: Silences = field(default_factory=Silences)
    _searches: int = 0
    _raw_blanks: bool | None = None
    _kinds: dict[tuple[str, Severity], _Kind] = field(default_factory=dict)
    _element: Element | None = None
    _attributes: dict[str, _AttributeSpan] = field(default_factory=dict)

    def add(
        self,
        rule: Rule,
        message: str,
        at: Element | None = None,
        *,
        attribute: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
        misplaced: bool = False,
        severity: Severity | None = None,
        position: tuple[int, int] = (1, 1),
        weight: float = 0.0,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        """Add a finding about the element `at`, or about the line and column `position`.

        The finding names the child of `<robot>` that contains `at`. If `misplaced` is True, the finding names
        `at` itself. If warnings or notes are combined, the one with the greatest `weight` is reported.
        """
        severity = rule.severity if severity is None else severity
        reason = None
        if self.silences.all and severity is not Severity.ERROR:  # A comment cannot silence an error.
            start = position[0] if at is None else self._place(at, attribute)[0]
            reason = self.silences.reason(rule.id, start, at)
        kind = self._kinds.setdefault((rule.id, severity), _Kind(severity))
        if len(kind.found if reason is None else self.silenced) >= WRITTEN_OUT:
            if reason is None:
                kind.lines.append(position[0] if at is None else at.line)
            return
        line, column, width = (*position, 0) if position == (1, 1) else (*position, 1)
        element, name = None, None
        if at is not None:
            line, column, width = self._place(at, attribute)
            subject = at if misplaced else at.holder
            element, name = subject.tag, subject.attributes.get("name") if at.parent is not None else None
        finding = Finding(
            rule.id, severity, message, found, remedy, self.file, line, column, element, name, rule.oracle,
            width=width, fix=None if fix is None or reason is not None else fix(),
        )  # fmt: skip
        if reason is None:
            kind.found.append((finding, weight))
        else:
            self.silenced.append((finding, reason))

    def silence(self, silences: Silences) -> None:
        """Apply comments to all findings, including findings that are added later."""
        self.silences = silences
        for (code, severity), kind in self._kinds.items():
            if severity is not Severity.ERROR:
                reasons = [(pair, silences.reason(code, pair[0].line, None)) for pair in kind.found]
                self.silenced += [(finding, reason) for (finding, _), reason in reasons if reason is not None]
                kind.found = [pair for pair, reason in reasons if reason is None]

    def nearest(self, word: str, known: Iterable[str]) -> list[str]:
        """Return up to three similar names, or [] after `SEARCHES` calls."""
        self._searches += 1
        if self._searches > SEARCHES:
            return []
        return find_similar_names(word, islice(known, CANDIDATES), work=WORK)

    def is_full(self, rule: Rule) -> bool:
        kind = self._kinds.get((rule.id, rule.severity))
        return kind is not None and len(kind.found) >= WRITTEN_OUT

    @property
    def failed(self) -> bool:
        return any(severity is Severity.ERROR for _, severity in self._kinds)

    def findings(
        self, *, fold: bool = True, wanted: Callable[[Finding], bool] | None = None
    ) -> tuple[Finding, ...]:
        """Return the findings by line; `wanted` is called once for each finding, in file order."""
        pairs = [pair for kind in self._kinds.values() for pair in kind.found]
        if wanted is not None:
            pairs.sort(key=lambda pair: _place_in_file(pair[0]))
            pairs = [pair for pair in pairs if wanted(pair[0])]
        reported = {id(pair) for pair in pairs}
        found: list[Finding] = []
        for kind in self._kinds.values():
            if own := [pair for pair in kind.found if id(pair) in reported]:
                found += _combine(_Kind(kind.severity, own, kind.lines), fold=fold)
        return tuple(sorted(found, key=_place_in_file))

    @property
    def has_raw_blanks(self) -> bool:
        """Whether an attribute value contains a tab, a line end or a reference such as `&amp;`.

        XML parsers replace these characters.
        """
        if self._raw_blanks is None:
            self._raw_blanks = _RAW_BLANK.search(self.data) is not None
        return self._raw_blanks

    def raw(self, at: Element, attribute: str) -> str | None:
        """Return an attribute value as written in the file."""
        span = self._spans(at).get(attribute)
        return None if span is None else self.data[slice(*span.value)].decode("utf-8", "replace")

    def _spans(self, at: Element) -> dict[str, _AttributeSpan]:
        if self._element is not at:
            self._element, self._attributes = at, dict(_attributes(self.data, at))
        return self._attributes

    def _place(self, at: Element, attribute: str | None) -> tuple[int, int, int]:
        span = None if attribute is None else self._spans(at).get(attribute)
        if span is None:
            return at.line, at.column, 1 + len(at.tag)
        first = NEWLINE.split(self.data[span.start : span.value[1] + 1], 1)[0]
        return span.line, span.column, len(first.decode("utf-8", "replace"))

    def rewritten(self, at: Element, attribute: str, value: str, turns: float = 0.0) -> Fix | None:
        span = self._spans(at).get(attribute)
        return None if span is None else Fix((Edit(*span.value, value),), turns)

    def without(self, at: Element, *attributes: str) -> Fix | None:
        """Return the fix that removes attributes."""
        existing = [span for name in attributes if (span := self._spans(at).get(name)) is not None]
        spans = sorted((span.start, span.value[1] + 1) for span in existing)
        edits = tuple(Edit(blanks_before(self.data, start), end) for start, end in spans)
        return Fix(edits) if edits else None

    def without_element(self, at: Element) -> Fix | None:
        """Return the fix that removes an element; None if the element has content."""
        tag = START_TAG.match(self.data, at.offset)
        if tag is None:
            return None
        end = tag.end()
        if not tag[0].endswith(b"/>"):
            closing = re.compile(rb"[ \t\r\n]*</" + re.escape(at.tag.encode()) + rb"[ \t\r\n]*>")
            if (closed := closing.match(self.data, end)) is None:
                return None
            end = closed.end()
        start = blanks_before(self.data, at.offset, b" \t")
        rest = _REST_OF_LINE.match(self.data, end)
        alone = rest is not None and self.data[start - 1 : start] in (b"\n", b"\r")
        return Fix((Edit(start, rest.end()) if rest is not None and alone else Edit(at.offset, end),))


@dataclass(frozen=True, slots=True)
class _AttributeSpan:
    """Line, column (in characters) and byte indices of an attribute; `value` excludes quotation marks."""

    line: int
    column: int
    start: int
    value: tuple[int, int]


#: An attribute value with a tab, a line end or a reference such as `&amp;`, which XML parsers replace.
#: Possessive quantifiers keep the matching time linear.
_RAW_BLANK = re.compile(rb"""=\s*+(?:"[^"<\t\r\n&]*+[\t\r\n&]|'[^'<\t\r\n&]*+[\t\r\n&])""")

NEWLINE = re.compile(rb"\r\n|\r|\n")
_REST_OF_LINE = re.compile(rb"[ \t]*+(?:\r\n|\r|\n)")


def _attributes(data: bytes, at: Element) -> Iterator[tuple[str, _AttributeSpan]]:
    tag = START_TAG.match(data, at.offset)
    if tag is None:
        return
    line, column, cursor = at.line, at.column, at.offset
    for match in ATTRIBUTE.finditer(data, at.offset + len(at.tag.encode()) + 1, tag.end()):
        lines = NEWLINE.split(data[cursor : match.start()])
        column = len(lines[-1].decode("utf-8", "replace")) + (column if len(lines) == 1 else 1)
        line, cursor = line + len(lines) - 1, match.start()
        yield match[1].decode(), _AttributeSpan(line, column, cursor, (match.start(2) + 1, match.end(2) - 1))


def blanks_before(data: bytes, start: int, blanks: bytes = b" \t\r\n") -> int:
    """Return the index at which the white space before `start` begins."""
    while start > 0 and data[start - 1] in blanks:
        start -= 1
    return start


def _place_in_file(finding: Finding) -> tuple[int, int, int, str, str]:
    return finding.line, finding.column, finding.severity.rank, finding.code, finding.message


def _combine(kind: _Kind, *, fold: bool) -> list[Finding]:
    """Combine findings of one kind.

    The last returned finding contains, in `also`, the line numbers of the findings that are not returned.
    """
    kind.found.sort(key=lambda pair: _place_in_file(pair[0]))
    found = [finding for finding, _ in kind.found]
    into_one = fold and kind.severity is not Severity.ERROR
    if into_one and len(found) >= (FOLDED_EXTRAS if found[0].code.startswith("URDF7") else FOLDED):
        best = max(range(len(found)), key=lambda i: kind.found[i][1])
        complete, rest = [found.pop(best)], found
    else:
        most = ERRORS_SHOWN if fold else len(found)
        complete, rest = found[:most], found[most:]
    lines = sorted([*(finding.line for finding in rest), *kind.lines])
    if lines:
        complete[-1] = replace(complete[-1], also=tuple(lines))
    return complete
