"""Collects findings while a file is checked: it knows the file, its bytes and where its attributes stand."""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

from urdfkin.errors import nearest
from urdfkin.lint.finding import Finding, Fix, Severity
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.rule import Rule
from urdfkin.lint.suppressions import Comment, Silences
from urdfkin.system.files import Edit
from urdfkin.urdf.element import ATTRIBUTE, START_TAG, Element

#: How many misspelt names of a file get suggestions, from how many names and after how much comparing.
SEARCHES, CANDIDATES, WORK = 20, 5_000, 250_000

#: From how many of the same kind on warnings and notes are folded into one; what kinematics does not need
#: (URDF7xx) is folded sooner.
FOLDED, FOLDED_EXTRAS = 4, 2

#: How many errors of one kind stand by themselves when findings are folded.
ERRORS_SHOWN = 100

#: How many findings of one kind are written out in full; of the others only the lines are kept.
WRITTEN_OUT = 10_000


@dataclass(slots=True)
class _Kind:
    """The findings of one code and severity, each with its weight; the lines of those beyond the limit."""

    severity: Severity
    found: list[tuple[Finding, float]] = field(default_factory=list)
    lines: array[int] = field(default_factory=lambda: array("q"))


@dataclass(slots=True)
class Reporter:
    """The findings of one file.

    Attributes:
        file: The file's name, for the findings.
        data: The file's bytes, from which positions of attributes are read.
        limits: How large the file, and what it is made of, may be.
        comments: Those of the file that are meant for urdfkin.
        silenced: Findings that a comment silences, each with the reason that it gives.
        silences: What those comments say.
    """

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
    _attributes: dict[str, _Written] = field(default_factory=dict)

    def add(
        self,
        rule: Rule,
        message: str,
        at: Element | None = None,
        *,
        attribute: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
        owner: str | None = None,
        severity: Severity | None = None,
        position: tuple[int, int] = (1, 1),
        weight: float = 0.0,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        """Report one finding.

        Args:
            rule: Which kind.
            message: The claim in one clause.
            at: The element it is about; without it `position` says where.
            attribute: The attribute of `at` to point to.
            found: The offending text, quoted as it should be printed.
            remedy: What to do.
            owner: The tag to name instead of that of the link or joint around the element, for an element
                that is a link or joint itself but stands in the wrong place.
            severity: Overrides the rule's.
            position: (line, column) when there is no element.
            weight: When findings of one kind are folded, the one of the greatest weight stays.
            fix: What makes the fix, called only where it is wanted; None: it takes a person.
        """
        severity = rule.severity if severity is None else severity
        # A file with an error has no one meaning, whatever a comment says.
        said = None if severity is Severity.ERROR else self._silenced_by(rule.id, position[0], at, attribute)
        kind = self._kinds.setdefault((rule.id, severity), _Kind(severity))
        if len(kind.found if said is None else self.silenced) >= WRITTEN_OUT:
            if said is None:
                kind.lines.append(position[0] if at is None else at.line)
            return
        line, column, width = (*position, 0) if position == (1, 1) else (*position, 1)
        name = None
        if at is not None:
            line, column, width = self._place(at, attribute)
            name = at.label if owner is None else at.attributes.get("name")
        finding = Finding(
            rule.id,
            severity,
            message,
            found,
            remedy,
            self.file,
            line,
            column,
            owner if owner or at is None else at.owner,
            name,
            rule.oracle,
            width=width,
            fix=None if fix is None or said is not None else fix(),
        )
        if said is None:
            kind.found.append((finding, weight))
        else:
            self.silenced.append((finding, said))

    def _silenced_by(self, code: str, line: int, at: Element | None, attribute: str | None) -> str | None:
        if not self.silences:
            return None
        return self.silences.reason(code, line if at is None else self._place(at, attribute)[0], at)

    def silence(self, silences: Silences) -> None:
        """Obey comments from here on, and for what was found while the file was parsed."""
        self.silences = silences
        for (code, severity), kind in self._kinds.items():
            if severity is not Severity.ERROR:
                said = [(pair, silences.reason(code, pair[0].line, None)) for pair in kind.found]
                self.silenced += [(finding, reason) for (finding, _), reason in said if reason is not None]
                kind.found = [pair for pair, reason in said if reason is None]

    def nearest(self, word: str, known: Iterable[str]) -> list[str]:
        """Up to three known names that look like `word`; only for the first few, because it is slow."""
        self._searches += 1
        if self._searches > SEARCHES:
            return []
        return nearest(word, islice(known, CANDIDATES), work=WORK)

    def is_full(self, rule: Rule) -> bool:
        """Whether so many of a kind were reported that no more are written out."""
        kind = self._kinds.get((rule.id, rule.severity))
        return kind is not None and len(kind.found) >= WRITTEN_OUT

    @property
    def failed(self) -> bool:
        """Whether an error was reported."""
        return any(severity is Severity.ERROR for _, severity in self._kinds)

    def findings(
        self, *, fold: bool = True, wanted: Callable[[Finding], bool] | None = None
    ) -> tuple[Finding, ...]:
        """Everything reported, by line.

        Args:
            fold: Whether many warnings of one kind become one, and all errors of a kind but the first.
            wanted: Which of them; asked once of each, in the order of the file. None: all.
        """
        kinds = [kind for kind in self._kinds.values() if kind.found]
        if wanted is not None:
            pairs = sorted(
                (pair for kind in kinds for pair in kind.found), key=lambda p: _place_in_file(p[0])
            )
            kept = {id(pair) for pair in pairs if wanted(pair[0])}
            kinds = [
                _Kind(kind.severity, chosen, kind.lines)
                for kind in kinds
                if (chosen := [pair for pair in kind.found if id(pair) in kept])
            ]
        found = (finding for kind in kinds for finding in _summed(kind, fold=fold))
        return tuple(sorted(found, key=_place_in_file))

    @property
    def has_raw_blanks(self) -> bool:
        """Whether any value holds a tab, a line end or a reference, which XML readers turn into others."""
        if self._raw_blanks is None:
            self._raw_blanks = _RAW_BLANK.search(self.data) is not None
        return self._raw_blanks

    def raw(self, at: Element, attribute: str) -> str | None:
        """An attribute's value as the file has it, before XML turns its blanks and references into others."""
        written = self._written(at).get(attribute)
        return None if written is None else self.data[slice(*written.value)].decode("utf-8", "replace")

    def _written(self, at: Element) -> dict[str, _Written]:
        """Where the attributes of an element stand; kept for the next question, mostly about the same one."""
        if self._element is not at:
            self._element, self._attributes = at, dict(_attributes(self.data, at))
        return self._attributes

    def _place(self, at: Element, attribute: str | None) -> tuple[int, int, int]:
        """Line, column and width of an element's start tag, or of one of its attributes."""
        written = None if attribute is None else self._written(at).get(attribute)
        if written is None:
            return at.line, at.column, 1 + len(at.tag)
        first = _NEWLINE.split(self.data[written.start : written.value[1] + 1], 1)[0]
        return written.line, written.column, len(first.decode("utf-8", "replace"))

    def rewritten(self, at: Element, attribute: str, value: str, turns: float = 0.0) -> Fix | None:
        """The fix that gives an attribute another value."""
        written = self._written(at).get(attribute)
        return None if written is None else Fix((Edit(*written.value, value),), turns)

    def without(self, at: Element, *attributes: str) -> Fix | None:
        """The fix that takes attributes away, each with the blanks before it."""
        written = [found for name in attributes if (found := self._written(at).get(name)) is not None]
        spans = sorted((found.start, found.value[1] + 1) for found in written)
        return (
            Fix(tuple(Edit(_blanks_before(self.data, start), end) for start, end in spans)) if spans else None
        )

    def without_element(self, at: Element) -> Fix | None:
        """The fix that takes an element away that holds nothing, and its line where it has one of its own."""
        tag = START_TAG.match(self.data, at.offset)
        if tag is None:
            return None
        end = tag.end()
        if not tag[0].endswith(b"/>"):
            closing = re.compile(rb"[ \t\r\n]*</" + re.escape(at.tag.encode()) + rb"[ \t\r\n]*>")
            if (closed := closing.match(self.data, end)) is None:
                return None
            end = closed.end()
        start = _blanks_before(self.data, at.offset, b" \t")
        rest = _REST_OF_LINE.match(self.data, end)
        alone = rest is not None and self.data[start - 1 : start] in (b"\n", b"\r")
        return Fix((Edit(start, rest.end()) if rest is not None and alone else Edit(at.offset, end),))


@dataclass(frozen=True, slots=True)
class _Written:
    """Where an attribute stands, and the bytes between its quotes."""

    line: int
    column: int
    start: int
    value: tuple[int, int]


#: A value that begins with no blank character but holds one of those that XML changes, or a reference. No run
#: of characters is looked at twice, wherever such text stands.
_RAW_BLANK = re.compile(rb"""=\s*+(?:"[^"<\t\r\n&]*+[\t\r\n&]|'[^'<\t\r\n&]*+[\t\r\n&])""")

_NEWLINE = re.compile(rb"\r\n|\r|\n")
_REST_OF_LINE = re.compile(rb"[ \t]*+(?:\r\n|\r|\n)")


def _attributes(data: bytes, at: Element) -> Iterator[tuple[str, _Written]]:
    """The attributes of an element's start tag, in one walk over it."""
    tag = START_TAG.match(data, at.offset)
    if tag is None:
        return
    line, column, cursor = at.line, at.column, at.offset
    for match in ATTRIBUTE.finditer(data, at.offset + len(at.tag.encode()) + 1, tag.end()):
        lines = _NEWLINE.split(data[cursor : match.start()])
        column = len(lines[-1].decode("utf-8", "replace")) + (column if len(lines) == 1 else 1)
        line, cursor = line + len(lines) - 1, match.start()
        yield match[1].decode(), _Written(line, column, cursor, (match.start(2) + 1, match.end(2) - 1))


def _blanks_before(data: bytes, start: int, blanks: bytes = b" \t\r\n") -> int:
    """Where the blanks that end at a place begin."""
    while start > 0 and data[start - 1] in blanks:
        start -= 1
    return start


def _place_in_file(finding: Finding) -> tuple[int, int, int, str, str]:
    return finding.line, finding.column, finding.severity.rank, finding.code, finding.message


def _summed(kind: _Kind, *, fold: bool) -> list[Finding]:
    """The findings of a kind; the last one, or the weightiest, speaks for those that are not written out."""
    kind.found.sort(key=lambda pair: _place_in_file(pair[0]))
    found = [finding for finding, _ in kind.found]
    warned = fold and kind.severity is not Severity.ERROR
    if warned and len(found) >= (FOLDED_EXTRAS if found[0].code.startswith("URDF7") else FOLDED):
        best = max(range(len(found)), key=lambda i: kind.found[i][1])
        kept, rest = [found.pop(best)], found
    else:
        most = ERRORS_SHOWN if fold else len(found)
        kept, rest = found[:most], found[most:]
    lines = sorted([*(finding.line for finding in rest), *kind.lines])
    if lines:
        kept[-1] = replace(kept[-1], also=tuple(lines))
    return kept
