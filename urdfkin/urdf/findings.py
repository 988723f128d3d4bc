"""Findings: problems in a file, each with a code, a position, the wrong text and a remedy.

Line and column numbers do not count a byte order mark.

A comment in a URDF can silence warnings and notes, but not errors. The comment names the codes of the
findings and gives a reason:

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
from urdfkin.urdf.records import ATTRIBUTE, DEFAULT_SIZE_LIMITS, START_TAG, Element, SizeLimits

#: Maximum number of characters of a file that a message quotes.
MAX_QUOTE_LENGTH = 60


def shorten(text: str, limit: int = MAX_QUOTE_LENGTH) -> str:
    return escape_unprintable(text if len(text) <= limit else text[: limit - 3] + "...")


def quote(text: str, limit: int = MAX_QUOTE_LENGTH) -> str:
    return '"' + shorten(text, limit).replace('"', '\\"') + '"'


#: A line of more than `MAX_EXCERPT_LENGTH` characters is cut. A cut line has at most `MAX_EXCERPT_LEAD`
#: characters before the underlined text.
MAX_EXCERPT_LENGTH, MAX_EXCERPT_LEAD = 100, 60

_TAB_SPACES = "    "


class ExcerptFormatter:
    """Show lines of a file, and underline the wrong text of findings.

    `data` has no byte order mark.
    """

    def __init__(self, data: bytes) -> None:
        self.lines = data.splitlines()
        self.number, self.text = 0, ""

    def format(self, finding: Finding) -> str | None:
        """Return the line of a finding, with carets below the wrong text; None if the finding marks no text.

        >>> from urdfkin.urdf.findings import Severity
        >>> finding = Finding("URDF503", Severity.NOTE, "", column=7, width=11)
        >>> print(ExcerptFormatter(b'<axis xyz="0 0 2"/>').format(finding))
          1 | <axis xyz="0 0 2"/>
            |       ^^^^^^^^^^^
        """
        if finding.width <= 0 or not 0 < finding.line <= len(self.lines):
            return None
        # A line of several megabytes is decoded only once.
        if self.number != finding.line:
            self.number = finding.line
            self.text = self.lines[finding.line - 1].decode("utf-8", "replace")
        start = finding.column - 1
        first = max(start - MAX_EXCERPT_LEAD, 0) if len(self.text) > MAX_EXCERPT_LENGTH else 0
        last = first + MAX_EXCERPT_LENGTH
        end = min(start + finding.width, last)
        pieces = self.text[first:start], self.text[start:end], self.text[end:last]
        before, marked, after = (escape_unprintable(piece.replace("\t", _TAB_SPACES)) for piece in pieces)
        lead, tail = "..." if first else "", "..." if len(self.text) > last else ""
        number = f"{finding.line:>3}"
        caret = " " * (_display_width(lead) + _display_width(before)) + "^" * max(_display_width(marked), 1)
        return f"{number} | {lead}{before}{marked}{after}{tail}\n{' ' * len(number)} | {caret}"


def _display_width(text: str) -> int:
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


#: Upper bound (rad) on the rounding error of an angle of at most one revolution.
SAFE_ROTATION = 2.0**-50


@dataclass(frozen=True, slots=True)
class Fix:
    """The automatic fix of a finding.

    Attributes:
        edits: Edits of the text, in file order, without overlap.
        max_rotation: The fix rotates a joint frame by at most this angle (rad). The angle is 0 if the fix
            does not change the robot.
    """

    edits: tuple[Edit, ...]
    max_rotation: float = 0.0

    @property
    def is_safe(self) -> bool:
        return self.max_rotation <= SAFE_ROTATION


def apply_fixes(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """Return the fixed bytes and the applied fixes, in file order.

    A fix that overlaps the previous applied fix is skipped. A byte order mark stays.
    """
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    taken, end = list[Fix](), 0
    for fix in sorted(fixes, key=lambda fix: fix.edits[0].start):
        if fix.edits[0].start >= end:
            taken.append(fix)
            end = fix.edits[-1].end
    return mark + apply_edits(data.removeprefix(mark), [edit for fix in taken for edit in fix.edits]), taken


class Severity(Enum):
    """The severity of a finding: error, warning or note.

    With an error, the file describes no robot, exceeds a limit, or gives different robots in different
    readers. A warning is about legal content that is probably a mistake, or that readers interpret
    differently. A note is information.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    @property
    def rank(self) -> int:
        return list(Severity).index(self)


class PinocchioReading(Enum):
    """Pinocchio's reading of a file that conforms to the URDF specification.

    Pinocchio either refuses the file (`REFUSES`), or deviates from the specification (`DIFFERS`).
    """

    REFUSES = "refuses"
    DIFFERS = "differs"


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem at one position of a file.

    Attributes:
        code: Code of the kind of problem, for example `URDF502`. Codes do not change between versions.
        severity: Error, warning or note.
        message: The problem in one clause, without a full stop.
        found: The wrong text or value, for example `xyz="0 0 0"`, or None.
        remedy: The remedy, or None.
        file: The path of the file, or a name such as `<text>` or `<stdin>`. The path of a xacro file ends
            with ` (expanded)`.
        line: Line number, from 1.
        column: Column number in characters, from 1.
        element: The tag of the element with the problem; None for the whole file. In URDF, the element is
            usually a child of `<robot>`. In MJCF, `equality` means a constraint inside `<equality>`. `joint`
            also means `<freejoint>`, and `flex` also means `<flexcomp>`. In USD, the value is `prim`.
        name: The name of the element with the problem, or None. In MJCF, urdfkin may name an element without
            a name by its index, such as `joint3` or `0`. In USD, the value is the path of the prim.
        pinocchio_reading: If this value is not None, Pinocchio refuses the file or reads the content
            differently. Pinocchio then cannot verify any result of the robot.
        other_lines: Line numbers of other findings with the same code that are combined with this finding.
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
    pinocchio_reading: PinocchioReading | None = None
    other_lines: tuple[int, ...] = ()
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
        tag = shorten(self.element)
        if self.element == "prim" and self.name is not None and len(self.name) > MAX_QUOTE_LENGTH:
            return f"{tag} '...{escape_unprintable(self.name[3 - MAX_QUOTE_LENGTH :])}'"
        return tag if self.name is None else f"{tag} '{shorten(self.name)}'"

    @property
    def count(self) -> int:
        """Number of findings that this object represents: 1 plus the length of `other_lines`.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.count
        1
        """
        return 1 + len(self.other_lines)

    @property
    def _other_lines_text(self) -> str:
        others = tuple(sorted(set(self.other_lines) - {self.line}))
        if len(others) == len(self.other_lines):
            return f"also on {_line_numbers_text(others)}"
        here = ("this line",) if self.line in self.other_lines else ()
        where = (*here, _line_numbers_text(others)) if others else here
        return f"{len(self.other_lines)} more on {' and '.join(where)}"

    @property
    def sentence(self) -> str:
        """The finding in one line, without its position, code and severity.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.sentence
        "link 'a': another link has this name; the first is on line 1; rename one link"
        """
        subject = f"{self.subject}: " if self.element and self.name is not None else ""
        found = f": found {self.found}" if self.found else ""
        also = f" ({self._other_lines_text})" if self.other_lines else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{subject}{self.message}{found}{also}{remedy}"

    def __str__(self) -> str:
        place = f"{escape_unprintable(self.file)}:{self.line}:{self.column}"
        return log_line(f"{place}: {self.code} {self.severity.value}: {self.sentence}")

    def as_dict(self) -> dict[str, Any]:
        """Return the finding for a JSON report: enums as strings, tuples as lists, no `width` and `fix`.

        >>> import urdfkin
        >>> finding = urdfkin.check('<robot name="r"><link name="a"/><link name="a"/></robot>')[0]
        >>> finding.as_dict()["code"]
        'URDF402'
        """
        data = asdict(self)
        del data["width"], data["fix"]
        data["severity"] = self.severity.value
        data["pinocchio_reading"] = self.pinocchio_reading.value if self.pinocchio_reading else None
        data["other_lines"] = list(self.other_lines)
        return data


class Findings(list[Finding], Displayable):
    def _text_document(self) -> TextDocument:
        rows = [(f"{f.file}:{f.line}:{f.column}", f.code, f.severity.value, f.sentence) for f in self]
        table = [Table(("place", "code", "severity", "what"), rows, left=4)] if rows else []
        return TextDocument(format_counts(self), table)


def count_by_severity(findings: Sequence[Finding]) -> dict[str, int]:
    return {s.value: sum(f.count for f in findings if f.severity is s) for s in Severity}


def format_counts(findings: Sequence[Finding]) -> str:
    words = [f"{n} {word}{'s' if n > 1 else ''}" for word, n in count_by_severity(findings).items() if n]
    return ", ".join(words) or "no findings"


def _line_numbers_text(lines: tuple[int, ...], shown: int = 4) -> str:
    numbers = ", ".join(str(line) for line in lines[:shown])
    rest = f" and {len(lines) - shown} more" if len(lines) > shown else ""
    return f"line{'s' if len(lines) > 1 else ''} {numbers}{rest}"


class UrdfError(UrdfkinError, ValueError):
    """A URDF has errors. The message lists the first five errors, each with file, line and column.

    Attributes:
        findings: The findings of the file, including warnings and notes. If `load` raises the error, one
            finding can represent several findings with the same code (`Finding.other_lines`).

    >>> import urdfkin
    >>> try:
    ...     robot = urdfkin.load('<robot name="r"><link name="a"/><link name="a"/></robot>')
    ... except ValueError as error:  # UrdfError is a subclass of ValueError
    ...     print(error.findings[0].code)
    URDF402
    """

    #: Maximum number of errors that the message lists.
    MAX_SHOWN_ERRORS = 5

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        errors = self._errors = [one for one in self.findings if one.severity is Severity.ERROR]
        file = self.findings[0].file if self.findings else "<text>"
        total = sum(error.count for error in errors)
        count = "an error" if total == 1 else f"{total} errors"
        remedy = f"run 'urdfkin explain {errors[0].code}' for details" if errors else None
        super().__init__(f"the URDF has {count}", where=file, remedy=remedy)

    def __str__(self) -> str:
        lines = [super().__str__(), *(f"  {finding}" for finding in self._errors[: self.MAX_SHOWN_ERRORS])]
        rest = sum(error.count for error in self._errors[self.MAX_SHOWN_ERRORS :])
        if rest:
            lines.append(f"  ... and {rest} more: see .findings or 'urdfkin check'")
        return "\n".join(lines)


class UrdfWarning(UserWarning):
    """The class of the Python warnings that `urdfkin.load` issues about a robot's file or table.

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
        id: The code of the findings: `URDF`, `MJCF` or `USD`, and three digits. A code is never reused.

    The first digit of a URDF code is the topic:

    | Digit | Topic |
    |---|---|
    | 1 | text and XML |
    | 2 | elements and attributes |
    | 3 | numbers |
    | 4 | names and structure |
    | 5 | joints |
    | 6 | probable mistakes |
    | 7 | inertials, geometry and materials |
    """

    id: str
    slug: str
    severity: Severity
    pinocchio_reading: PinocchioReading | None = None


#: First word of a comment with an instruction for urdfkin.
COMMENT_MARK = "urdfkin:"


@dataclass(slots=True)
class Comment:
    """A comment with an instruction for urdfkin.

    `element` begins after the comment. `follows_text` is true if other text precedes the comment on the same
    line.
    """

    text: str
    line: int
    column: int
    follows_text: bool
    element: Element | None = None


@dataclass(slots=True, eq=False)
class IgnoreComment:
    """A comment that silences findings."""

    comment: Comment
    codes: tuple[str, ...]
    reason: str
    used_codes: set[str] = field(default_factory=set)  # Codes of the silenced findings.


@dataclass(slots=True)
class CommentIndex:
    comments: list[IgnoreComment] = field(default_factory=list)
    #: First comment for each key: ("line", number, code), ("element", id, code) or ("file", 0, code).
    _comment_by_key: dict[tuple[str, int, str], IgnoreComment] = field(default_factory=dict)

    def add(self, ignore: IgnoreComment) -> None:
        self.comments.append(ignore)
        comment = ignore.comment
        if comment.follows_text:
            place = "line", comment.line
        elif comment.element is None:
            return
        elif comment.element.parent is None:
            place = "file", 0
        else:
            place = "element", id(comment.element)
        for code in ignore.codes:
            self._comment_by_key.setdefault((*place, code), ignore)

    def find_reason(self, code: str, line: int, element: Element | None) -> str | None:
        """Return the reason of the nearest comment that silences a finding, and mark the code as used."""
        places = [("line", line)]
        while element is not None:
            places.append(("element", id(element)))
            element = element.parent
        for place in (*places, ("file", 0)):
            if (ignore := self._comment_by_key.get((*place, code))) is not None:
                ignore.used_codes.add(code)
                return ignore.reason
        return None


#: Maximum number of misspelt names in a file that get suggestions.
MAX_NAME_SEARCHES = 20
#: Maximum number of names, and of compared pairs of characters, in one search for similar names.
MAX_CANDIDATES, MAX_COMPARED_PAIRS = 5_000, 250_000

#: With `fold`, one finding represents `MIN_FOLDED` or more warnings or notes with one code. For the codes
#: URDF7xx, the minimum is `MIN_FOLDED_EXTRAS`. These codes are about inertials, shapes and materials, which
#: kinematics does not use.
MIN_FOLDED, MIN_FOLDED_EXTRAS = 4, 2

#: With `fold`, the maximum number of errors with the same code that are reported separately.
MAX_ERRORS_PER_CODE = 100

#: Maximum number of findings with one code and severity that are stored completely. For further findings,
#: only the line numbers are stored.
MAX_COMPLETE_FINDINGS = 10_000


@dataclass(slots=True)
class _FindingGroup:
    """Findings of one code and severity."""

    severity: Severity
    #: At most `MAX_COMPLETE_FINDINGS` pairs (finding, weight).
    weighted_findings: list[tuple[Finding, float]] = field(default_factory=list)
    #: Line numbers of all further findings.
    further_lines: array[int] = field(default_factory=lambda: array("q"))


@dataclass(slots=True)
class Reporter:
    file: str
    data: bytes = b""
    limits: SizeLimits = DEFAULT_SIZE_LIMITS
    comments: list[Comment] = field(default_factory=list)
    silenced_findings: list[tuple[Finding, str]] = field(default_factory=list)
    comment_index: CommentIndex = field(default_factory=CommentIndex)
    _name_search_count: int = 0
    _replaced_characters: bool | None = None
    _groups: dict[tuple[str, Severity], _FindingGroup] = field(default_factory=dict)
    #: Cache of `_spans` for one element.
    _cached_element: Element | None = None
    _cached_spans: dict[str, _AttributeSpan] = field(default_factory=dict)
    #: Elements of the findings that are added before the call of `silence`, by the id of the finding.
    _elements_before_silence: dict[int, Element] = field(default_factory=dict)

    def add(
        self,
        rule: Rule,
        message: str,
        element: Element | None = None,
        *,
        attribute: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
        names_element: bool = False,
        severity: Severity | None = None,
        position: tuple[int, int] = (1, 1),
        weight: float = 0.0,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        """Add a finding about an element, or about the line and column `position`.

        The finding names `element` if `names_element` is True, otherwise the child of `<robot>` that contains
        `element`. If several warnings or notes are combined into one finding, the finding with the greatest
        `weight` represents all of them.
        """
        severity = rule.severity if severity is None else severity
        reason = None
        if (
            self.comment_index.comments and severity is not Severity.ERROR
        ):  # A comment cannot silence an error.
            start = position[0] if element is None else self._locate(element, attribute)[0]
            reason = self.comment_index.find_reason(rule.id, start, element)
        group = self._groups.setdefault((rule.id, severity), _FindingGroup(severity))
        if (
            len(group.weighted_findings if reason is None else self.silenced_findings)
            >= MAX_COMPLETE_FINDINGS
        ):
            if reason is None:
                group.further_lines.append(position[0] if element is None else element.line)
            return
        line, column, width = (*position, 0) if position == (1, 1) else (*position, 1)
        tag, name = None, None
        if element is not None:
            line, column, width = self._locate(element, attribute)
            subject = element if names_element else element.top_level_element
            tag, name = subject.tag, subject.attributes.get("name") if element.parent is not None else None
        finding = Finding(
            rule.id, severity, message, found, remedy, self.file, line, column, tag, name,
            rule.pinocchio_reading, width=width, fix=None if fix is None or reason is not None else fix(),
        )  # fmt: skip
        if reason is None:
            group.weighted_findings.append((finding, weight))
            if element is not None and self.comments and not self.comment_index.comments:
                self._elements_before_silence[id(finding)] = element
        else:
            self.silenced_findings.append((finding, reason))

    def silence(self, comment_index: CommentIndex) -> None:
        """Silence all warnings and notes that the file's comments name, also those added after this call."""
        self.comment_index = comment_index
        for (code, severity), group in self._groups.items():
            if severity is not Severity.ERROR:
                elements = self._elements_before_silence
                reasons = [
                    (pair, comment_index.find_reason(code, pair[0].line, elements.get(id(pair[0]))))
                    for pair in group.weighted_findings
                ]
                self.silenced_findings += [
                    (finding, reason) for (finding, _), reason in reasons if reason is not None
                ]
                group.weighted_findings = [pair for pair, reason in reasons if reason is None]

    def find_nearest_names(self, word: str, known: Iterable[str]) -> list[str]:
        """Return up to three similar names, or [] after `MAX_NAME_SEARCHES` calls."""
        self._name_search_count += 1
        if self._name_search_count > MAX_NAME_SEARCHES:
            return []
        return find_similar_names(word, islice(known, MAX_CANDIDATES), work=MAX_COMPARED_PAIRS)

    def is_full(self, rule: Rule) -> bool:
        group = self._groups.get((rule.id, rule.severity))
        return group is not None and len(group.weighted_findings) >= MAX_COMPLETE_FINDINGS

    @property
    def has_errors(self) -> bool:
        return any(severity is Severity.ERROR for _, severity in self._groups)

    def findings(
        self, *, fold: bool = True, is_reported: Callable[[Finding], bool] | None = None
    ) -> tuple[Finding, ...]:
        """Return the findings, sorted by line; omit findings for which `is_reported` returns False.

        Call `is_reported` once for each complete finding, in file order, because the function may count
        findings.
        """
        pairs = [pair for group in self._groups.values() for pair in group.weighted_findings]
        if is_reported is not None:
            pairs.sort(key=lambda pair: _sort_key(pair[0]))
            pairs = [pair for pair in pairs if is_reported(pair[0])]
        reported = {id(pair) for pair in pairs}
        findings: list[Finding] = []
        for group in self._groups.values():
            if pairs_of_group := [pair for pair in group.weighted_findings if id(pair) in reported]:
                findings += _combine(
                    _FindingGroup(group.severity, pairs_of_group, group.further_lines), fold=fold
                )
        return tuple(sorted(findings, key=_sort_key))

    @property
    def has_replaced_characters(self) -> bool:
        """Whether an attribute value may contain a tab, a line end or a reference such as `&amp;`.

        XML parsers replace these characters.
        """
        if self._replaced_characters is None:
            self._replaced_characters = _REPLACED_CHARACTER.search(self.data) is not None
        return self._replaced_characters

    def raw_value(self, element: Element, attribute: str) -> str | None:
        span = self._spans(element).get(attribute)
        return None if span is None else self.data[slice(*span.value)].decode("utf-8", "replace")

    def _spans(self, element: Element) -> dict[str, _AttributeSpan]:
        if self._cached_element is not element:
            self._cached_element = element
            self._cached_spans = dict(_find_attribute_spans(self.data, element))
        return self._cached_spans

    def _locate(self, element: Element, attribute: str | None) -> tuple[int, int, int]:
        span = None if attribute is None else self._spans(element).get(attribute)
        if span is None:
            return element.line, element.column, 1 + len(element.tag)
        first = NEWLINE.split(self.data[span.start : span.value[1] + 1], 1)[0]
        return span.line, span.column, len(first.decode("utf-8", "replace"))

    def make_value_fix(
        self, element: Element, attribute: str, value: str, max_rotation: float = 0.0
    ) -> Fix | None:
        span = self._spans(element).get(attribute)
        return None if span is None else Fix((Edit(*span.value, value),), max_rotation)

    def make_removal_fix(self, element: Element, *attributes: str) -> Fix | None:
        """Return the fix that removes attributes and the white space before each attribute."""
        existing = [span for name in attributes if (span := self._spans(element).get(name)) is not None]
        spans = sorted((span.start, span.value[1] + 1) for span in existing)
        edits = tuple(Edit(start_of_blanks(self.data, start), end) for start, end in spans)
        return Fix(edits) if edits else None

    def make_element_removal_fix(self, element: Element) -> Fix | None:
        """Return the fix that removes an element; None if the element has content."""
        tag = START_TAG.match(self.data, element.offset)
        if tag is None:
            return None
        end = tag.end()
        if not tag[0].endswith(b"/>"):
            closing = re.compile(rb"[ \t\r\n]*</" + re.escape(element.tag.encode()) + rb"[ \t\r\n]*>")
            if (closed := closing.match(self.data, end)) is None:
                return None
            end = closed.end()
        start = start_of_blanks(self.data, element.offset, b" \t")
        rest = _BLANKS_TO_LINE_END.match(self.data, end)
        alone = rest is not None and self.data[start - 1 : start] in (b"\n", b"\r")
        return Fix((Edit(start, rest.end()) if rest is not None and alone else Edit(element.offset, end),))


@dataclass(frozen=True, slots=True)
class _AttributeSpan:
    """Line, column (in characters) and byte indices of an attribute; `value` excludes quotation marks."""

    line: int
    column: int
    start: int
    value: tuple[int, int]


#: Matches an attribute value up to its first tab, line end or reference such as `&amp;`. Possessive
#: quantifiers keep the matching time linear.
_REPLACED_CHARACTER = re.compile(rb"""=\s*+(?:"[^"<\t\r\n&]*+[\t\r\n&]|'[^'<\t\r\n&]*+[\t\r\n&])""")

NEWLINE = re.compile(rb"\r\n|\r|\n")
_BLANKS_TO_LINE_END = re.compile(rb"[ \t]*+(?:\r\n|\r|\n)")


def _find_attribute_spans(data: bytes, element: Element) -> Iterator[tuple[str, _AttributeSpan]]:
    tag = START_TAG.match(data, element.offset)
    if tag is None:
        return
    line, column, cursor = element.line, element.column, element.offset
    for match in ATTRIBUTE.finditer(data, element.offset + len(element.tag.encode()) + 1, tag.end()):
        lines = NEWLINE.split(data[cursor : match.start()])
        column = len(lines[-1].decode("utf-8", "replace")) + (column if len(lines) == 1 else 1)
        line, cursor = line + len(lines) - 1, match.start()
        yield match[1].decode(), _AttributeSpan(line, column, cursor, (match.start(2) + 1, match.end(2) - 1))


def start_of_blanks(data: bytes, start: int, blanks: bytes = b" \t\r\n") -> int:
    """Return the first index of the white space that ends before the index `start`."""
    while start > 0 and data[start - 1] in blanks:
        start -= 1
    return start


def _sort_key(finding: Finding) -> tuple[int, int, int, str, str]:
    return finding.line, finding.column, finding.severity.rank, finding.code, finding.message


def _combine(group: _FindingGroup, *, fold: bool) -> list[Finding]:
    """Return the findings to report. The last finding lists the lines of the findings left out."""
    group.weighted_findings.sort(key=lambda pair: _sort_key(pair[0]))
    findings = [finding for finding, _ in group.weighted_findings]
    into_one = fold and group.severity is not Severity.ERROR
    if into_one and len(findings) >= (
        MIN_FOLDED_EXTRAS if findings[0].code.startswith("URDF7") else MIN_FOLDED
    ):
        best = max(range(len(findings)), key=lambda i: group.weighted_findings[i][1])
        complete, not_returned = [findings.pop(best)], findings
    else:
        max_complete = MAX_ERRORS_PER_CODE if fold else len(findings)
        complete, not_returned = findings[:max_complete], findings[max_complete:]
    lines = sorted([*(finding.line for finding in not_returned), *group.further_lines])
    if lines:
        complete[-1] = replace(complete[-1], other_lines=tuple(lines))
    return complete
