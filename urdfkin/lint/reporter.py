"""Collects findings while a file is checked: it knows the file, its bytes and where its attributes stand."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

from urdfkin.errors.nearest import nearest
from urdfkin.lint.finding import Finding, Severity
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.rule import Rule
from urdfkin.urdf.element import Element

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
    """

    file: str
    data: bytes = b""
    limits: Limits = DEFAULT_LIMITS
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
        """
        severity = rule.severity if severity is None else severity
        kind = self._kinds.setdefault((rule.id, severity), _Kind(severity))
        if len(kind.found) >= WRITTEN_OUT:
            kind.lines.append(position[0] if at is None else at.line)
            return
        line, column = position
        name = None
        if at is not None:
            line, column = self._place(at, attribute)
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
        )
        kind.found.append((finding, weight))

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

    def findings(self, *, fold: bool = True) -> tuple[Finding, ...]:
        """Everything reported, by line.

        Args:
            fold: Whether many warnings of one kind become one, and all errors of a kind but the first.
        """
        found = (finding for kind in self._kinds.values() for finding in _summed(kind, fold=fold))
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

    def _place(self, at: Element, attribute: str | None) -> tuple[int, int]:
        """Line and column of an element's start tag, or of one of its attributes."""
        written = None if attribute is None else self._written(at).get(attribute)
        return (at.line, at.column) if written is None else (written.line, written.column)


@dataclass(frozen=True, slots=True)
class _Written:
    """Where an attribute stands, and the bytes between its quotes."""

    line: int
    column: int
    value: tuple[int, int]


#: A value that begins with no blank character but holds one of those that XML changes, or a reference. No run
#: of characters is looked at twice, wherever such text stands.
_RAW_BLANK = re.compile(rb"""=\s*+(?:"[^"<\t\r\n&]*+[\t\r\n&]|'[^'<\t\r\n&]*+[\t\r\n&])""")

#: A start tag: '<', then quoted values, in which '>' may stand, and everything else.
_START_TAG = re.compile(rb"""<(?:[^<>"']++|"[^"]*+"|'[^']*+')*+>""")
_ATTRIBUTE = re.compile(rb"""([^\s=<>/"']++)\s*+=\s*+("[^"]*+"|'[^']*+')""")
_NEWLINE = re.compile(rb"\r\n|\r|\n")


def _attributes(data: bytes, at: Element) -> Iterator[tuple[str, _Written]]:
    """The attributes of an element's start tag, in one walk over it."""
    tag = _START_TAG.match(data, at.offset)
    if tag is None:
        return
    line, column, cursor = at.line, at.column, at.offset
    for match in _ATTRIBUTE.finditer(data, at.offset + len(at.tag.encode()) + 1, tag.end()):
        lines = _NEWLINE.split(data[cursor : match.start()])
        column = len(lines[-1].decode("utf-8", "replace")) + (column if len(lines) == 1 else 1)
        line, cursor = line + len(lines) - 1, match.start()
        yield match[1].decode(), _Written(line, column, (match.start(2) + 1, match.end(2) - 1))


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
