"""`Reporter`: collect the findings of a file during a check, and locate its attributes in the bytes."""

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

#: Limits of the suggestions for misspelt names: names per file, candidates per name, work per comparison.
SEARCHES, CANDIDATES, WORK = 20, 5_000, 250_000

#: Number of warnings or notes of one kind from which they are combined into one. The second number is for
#: URDF7xx, which kinematics does not use.
FOLDED, FOLDED_EXTRAS = 4, 2

#: Number of errors of one kind that are not combined.
ERRORS_SHOWN = 100

#: Number of complete findings of one kind; for further ones only the lines are stored.
WRITTEN_OUT = 10_000


@dataclass(slots=True)
class _Kind:
    """The findings of one code and severity.

    Attributes:
        severity: The severity.
        found: The findings, each with its weight.
        lines: The lines of the findings beyond the limit `WRITTEN_OUT`.
    """

    severity: Severity
    found: list[tuple[Finding, float]] = field(default_factory=list)
    lines: array[int] = field(default_factory=lambda: array("q"))


@dataclass(slots=True)
class Reporter:
    """The findings of one file.

    Attributes:
        file: The name of the file, for the findings.
        data: The bytes of the file, for the positions of attributes.
        limits: Limits on the size of the file and its parts.
        comments: The comments for urdfkin.
        silenced: The findings that a comment silences, each with the reason.
        silences: The parsed comments.
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
        owner: str | None = None,
        severity: Severity | None = None,
        position: tuple[int, int] = (1, 1),
        weight: float = 0.0,
        fix: Callable[[], Fix | None] | None = None,
    ) -> None:
        """Add a finding.

        Args:
            rule: The rule.
            message: The problem in one clause.
            at: The element; without it, `position` is used.
            attribute: The attribute of `at` to mark.
            found: The text that causes the finding, quoted for printing.
            remedy: The remedy.
            owner: The tag for the message, if `at` is a link or joint in the wrong place. The default is the
                tag of the link or joint that contains `at`.
            severity: Severity instead of the rule's.
            position: (line, column) if there is no element.
            weight: If findings of one kind are combined, the one with the greatest weight is reported.
            fix: A function that makes the automatic fix, called on demand; None: there is no automatic fix.
        """
        severity = rule.severity if severity is None else severity
        # A comment cannot silence an error.
        reason = (
            None if severity is Severity.ERROR else self._silenced_by(rule.id, position[0], at, attribute)
        )
        kind = self._kinds.setdefault((rule.id, severity), _Kind(severity))
        if len(kind.found if reason is None else self.silenced) >= WRITTEN_OUT:
            if reason is None:
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
            fix=None if fix is None or reason is not None else fix(),
        )
        if reason is None:
            kind.found.append((finding, weight))
        else:
            self.silenced.append((finding, reason))

    def _silenced_by(self, code: str, line: int, at: Element | None, attribute: str | None) -> str | None:
        if not self.silences:
            return None
        return self.silences.reason(code, line if at is None else self._place(at, attribute)[0], at)

    def silence(self, silences: Silences) -> None:
        """Apply the comments to later findings, and to those that parsing has already added."""
        self.silences = silences
        for (code, severity), kind in self._kinds.items():
            if severity is not Severity.ERROR:
                reasons = [(pair, silences.reason(code, pair[0].line, None)) for pair in kind.found]
                self.silenced += [(finding, reason) for (finding, _), reason in reasons if reason is not None]
                kind.found = [pair for pair, reason in reasons if reason is None]

    def nearest(self, word: str, known: Iterable[str]) -> list[str]:
        """Return up to three known names similar to `word`; none after `SEARCHES` calls, which are slow."""
        self._searches += 1
        if self._searches > SEARCHES:
            return []
        return nearest(word, islice(known, CANDIDATES), work=WORK)

    def is_full(self, rule: Rule) -> bool:
        """Return whether a rule has `WRITTEN_OUT` findings, so that no more are stored completely."""
        kind = self._kinds.get((rule.id, rule.severity))
        return kind is not None and len(kind.found) >= WRITTEN_OUT

    @property
    def failed(self) -> bool:
        """Whether there is an error."""
        return any(severity is Severity.ERROR for _, severity in self._kinds)

    def findings(
        self, *, fold: bool = True, wanted: Callable[[Finding], bool] | None = None
    ) -> tuple[Finding, ...]:
        """Return the findings by line.

        Args:
            fold: Whether to combine many warnings of one kind, and the errors of a kind from the hundredth
                on.
            wanted: A filter, called once for each finding, in file order; None: all findings.
        """
        kinds = [kind for kind in self._kinds.values() if kind.found]
        if wanted is not None:
            pairs = sorted(
                (pair for kind in kinds for pair in kind.found), key=lambda p: _place_in_file(p[0])
            )
            selected = {id(pair) for pair in pairs if wanted(pair[0])}
            kinds = [
                _Kind(kind.severity, chosen, kind.lines)
                for kind in kinds
                if (chosen := [pair for pair in kind.found if id(pair) in selected])
            ]
        found = (finding for kind in kinds for finding in _combine(kind, fold=fold))
        return tuple(sorted(found, key=_place_in_file))

    @property
    def has_raw_blanks(self) -> bool:
        """Whether a value contains a tab, a line end or a reference, which an XML parser replaces."""
        if self._raw_blanks is None:
            self._raw_blanks = _RAW_BLANK.search(self.data) is not None
        return self._raw_blanks

    def raw(self, at: Element, attribute: str) -> str | None:
        """Return the value of an attribute as written, before XML replaces white space and references."""
        span = self._spans(at).get(attribute)
        return None if span is None else self.data[slice(*span.value)].decode("utf-8", "replace")

    def _spans(self, at: Element) -> dict[str, _AttributeSpan]:
        """Return the positions of an element's attributes; those of the last element are cached."""
        if self._element is not at:
            self._element, self._attributes = at, dict(_attributes(self.data, at))
        return self._attributes

    def _place(self, at: Element, attribute: str | None) -> tuple[int, int, int]:
        """Return line, column and width of an element's start tag, or of one of its attributes."""
        span = None if attribute is None else self._spans(at).get(attribute)
        if span is None:
            return at.line, at.column, 1 + len(at.tag)
        first = _NEWLINE.split(self.data[span.start : span.value[1] + 1], 1)[0]
        return span.line, span.column, len(first.decode("utf-8", "replace"))

    def rewritten(self, at: Element, attribute: str, value: str, turns: float = 0.0) -> Fix | None:
        """Return the fix that changes the value of an attribute."""
        span = self._spans(at).get(attribute)
        return None if span is None else Fix((Edit(*span.value, value),), turns)

    def without(self, at: Element, *attributes: str) -> Fix | None:
        """Return the fix that removes attributes, each with the white space before it."""
        existing = [span for name in attributes if (span := self._spans(at).get(name)) is not None]
        spans = sorted((span.start, span.value[1] + 1) for span in existing)
        return (
            Fix(tuple(Edit(_blanks_before(self.data, start), end) for start, end in spans)) if spans else None
        )

    def without_element(self, at: Element) -> Fix | None:
        """Return the fix that removes an empty element, and its line if it is alone on it."""
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
class _AttributeSpan:
    """The position of an attribute in the file.

    Attributes:
        line: Line, from 1.
        column: Column in characters, from 1.
        start: Index of its first byte.
        value: Indices of the first byte between its quotes and of the closing quote.
    """

    line: int
    column: int
    start: int
    value: tuple[int, int]


#: A value with a tab, a line end or a reference, all of which XML replaces. Possessive matching: linear time.
_RAW_BLANK = re.compile(rb"""=\s*+(?:"[^"<\t\r\n&]*+[\t\r\n&]|'[^'<\t\r\n&]*+[\t\r\n&])""")

_NEWLINE = re.compile(rb"\r\n|\r|\n")
_REST_OF_LINE = re.compile(rb"[ \t]*+(?:\r\n|\r|\n)")


def _attributes(data: bytes, at: Element) -> Iterator[tuple[str, _AttributeSpan]]:
    """Yield the attributes of an element's start tag with their positions, in one pass."""
    tag = START_TAG.match(data, at.offset)
    if tag is None:
        return
    line, column, cursor = at.line, at.column, at.offset
    for match in ATTRIBUTE.finditer(data, at.offset + len(at.tag.encode()) + 1, tag.end()):
        lines = _NEWLINE.split(data[cursor : match.start()])
        column = len(lines[-1].decode("utf-8", "replace")) + (column if len(lines) == 1 else 1)
        line, cursor = line + len(lines) - 1, match.start()
        yield match[1].decode(), _AttributeSpan(line, column, cursor, (match.start(2) + 1, match.end(2) - 1))


def _blanks_before(data: bytes, start: int, blanks: bytes = b" \t\r\n") -> int:
    """Return the index of the first of the white-space characters that end at an index."""
    while start > 0 and data[start - 1] in blanks:
        start -= 1
    return start


def _place_in_file(finding: Finding) -> tuple[int, int, int, str, str]:
    return finding.line, finding.column, finding.severity.rank, finding.code, finding.message


def _combine(kind: _Kind, *, fold: bool) -> list[Finding]:
    """Return the findings of a kind; the last one, or the one of greatest weight, lists the other lines."""
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
