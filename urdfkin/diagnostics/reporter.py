"""Collects findings while a file is checked: it knows the file, its bytes and where its attributes stand."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from urdfkin.diagnostics.finding import Finding, Severity

if TYPE_CHECKING:
    from urdfkin.diagnostics.codes.base import Code
    from urdfkin.diagnostics.document import Element

#: How many misspelt names of a file get suggestions.
SEARCHES = 20

#: From how many of the same kind on warnings and notes are folded into one; what kinematics does not need
#: (URDF7xx) is folded sooner.
FOLDED, FOLDED_EXTRAS = 4, 2


@dataclass(slots=True)
class Reporter:
    """The findings of one file.

    Attributes:
        file: The file's name, for the findings.
        data: The file's bytes, from which positions of attributes are read.
    """

    file: str
    data: bytes = b""
    _searches: int = 0
    _raw_blanks: bool | None = None
    _found: list[tuple[Finding, float]] = field(default_factory=list)

    def add(
        self,
        code: Code,
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
            code: Which kind.
            message: The claim in one clause.
            at: The element it is about; without it `position` says where.
            attribute: The attribute of `at` to point to.
            found: The offending text, quoted as it should be printed.
            remedy: What to do.
            owner: The tag to name instead of that of the link or joint around the element, for an element
                that is a link or joint itself but stands in the wrong place.
            severity: Overrides the code's.
            position: (line, column) when there is no element.
            weight: When findings of one kind are folded, the one of the greatest weight stays.
        """
        line, column = position
        name = None
        if at is not None:
            line, column = self._place(at, attribute)
            name = at.label if owner is None else at.attributes.get("name")
        finding = Finding(
            code.id,
            code.severity if severity is None else severity,
            message,
            found,
            remedy,
            self.file,
            line,
            column,
            owner if owner or at is None else at.owner,
            name,
            code.oracle,
        )
        self._found.append((finding, weight))

    def nearest(self, word: str, known: Iterable[str]) -> list[str]:
        """Up to three known names that look like `word`; only for the first few, because it is slow."""
        self._searches += 1
        if self._searches > SEARCHES:
            return []
        return difflib.get_close_matches(word, list(known)[:5000], n=3, cutoff=0.6)

    @property
    def failed(self) -> bool:
        """Whether an error was reported."""
        return any(finding.severity is Severity.ERROR for finding, _ in self._found)

    def findings(self, *, fold: bool = True) -> tuple[Finding, ...]:
        """Everything reported, by line; with `fold`, many warnings of one kind become one."""
        found = self._found
        if fold:
            found = _folded(found)
        return tuple(
            sorted(
                (finding for finding, _ in found),
                key=lambda f: (f.line, f.column, f.severity.rank, f.code, f.message),
            )
        )

    @property
    def has_raw_blanks(self) -> bool:
        """Whether any value holds a tab, a line end or a reference, which XML readers turn into others."""
        if self._raw_blanks is None:
            self._raw_blanks = _RAW_BLANK.search(self.data) is not None
        return self._raw_blanks

    def raw(self, at: Element, attribute: str) -> str | None:
        """An attribute's value as the file has it, before XML turns its blanks and references into others."""
        match = self._attribute(at, attribute)
        return None if match is None else match[2].decode("utf-8", "replace")[1:-1]

    def _attribute(self, at: Element, attribute: str) -> re.Match[bytes] | None:
        tag = _START_TAG.match(self.data, at.offset)
        if tag is None:
            return None
        matches = _ATTRIBUTE.finditer(self.data, at.offset + len(at.tag.encode()) + 1, tag.end())
        return next((match for match in matches if match[1].decode() == attribute), None)

    def _place(self, at: Element, attribute: str | None) -> tuple[int, int]:
        """Line and column of an element's start tag, or of one of its attributes."""
        match = None if attribute is None else self._attribute(at, attribute)
        return (at.line, at.column) if match is None else _position(self.data, at, match.start(1))


_RAW_BLANK = re.compile(rb"""=\s*(?:"[^"<]*[\t\r\n&][^"<]*"|'[^'<]*[\t\r\n&][^'<]*')""")

#: A start tag: '<', then quoted values, in which '>' may stand, and everything else.
_START_TAG = re.compile(rb"""<(?:[^<>"']|"[^"]*"|'[^']*')*>""")
_ATTRIBUTE = re.compile(rb"""([^\s=<>/"']+)\s*=\s*("[^"]*"|'[^']*')""")


def _position(data: bytes, at: Element, offset: int) -> tuple[int, int]:
    between = data[at.offset : offset]
    lines = _NEWLINE.findall(between)
    if not lines:
        return at.line, at.column + len(between.decode("utf-8", "replace"))
    last = re.split(_NEWLINE, between)[-1]
    return at.line + len(lines), len(last.decode("utf-8", "replace")) + 1


_NEWLINE = re.compile(rb"\r\n|\r|\n")


def _folded(found: list[tuple[Finding, float]]) -> list[tuple[Finding, float]]:
    """Fold warnings and notes of one kind, when there are many, into the weightiest of them."""
    groups: dict[tuple[object, ...], list[tuple[Finding, float]]] = {}
    for finding, weight in found:
        own = finding.severity is Severity.ERROR
        key = (finding,) if own else (finding.code, finding.severity, finding.oracle)
        groups.setdefault(key, []).append((finding, weight))
    kept: list[tuple[Finding, float]] = []
    for group in groups.values():
        enough = FOLDED_EXTRAS if group[0][0].code.startswith("URDF7") else FOLDED
        if len(group) < enough or group[0][0].severity is Severity.ERROR:
            kept += group
            continue
        best, weight = max(group, key=lambda pair: pair[1])
        lines = sorted({finding.line for finding, _ in group if finding is not best} - {best.line})
        kept.append((replace(best, also=tuple(lines)), weight))
    return kept
