"""Findings as text: for a terminal, as JSON, and as GitHub's workflow commands. SARIF has its own module."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from urdfkin.lint.finding import Finding, Severity
from urdfkin.lint.pages import RULES, page

#: Version of the JSON below; it changes when a field changes its meaning or goes away.
JSON_VERSION = 1


def summary(findings: Sequence[Finding], files: int) -> str:
    """One line: how many of what in how many files.

    >>> summary([], 1)
    'no findings in 1 file'
    """
    where = f"{files} file" + ("" if files == 1 else "s")
    counts = {severity: sum(f.count for f in findings if f.severity is severity) for severity in Severity}
    parts = [f"{count} {s.value}{'' if count == 1 else 's'}" for s, count in counts.items() if count]
    return f"{', '.join(parts)} in {where}" if parts else f"no findings in {where}"


def statistics(findings: Sequence[Finding]) -> Iterator[str]:
    """A line for each code: how many, how bad, whether --fix mends some, what it is; the most first."""
    counts, worst, mended = Counter[str](), dict[str, Severity](), set[str]()
    for finding in findings:
        counts[finding.code] += finding.count
        worst[finding.code] = min(
            worst.get(finding.code, finding.severity), finding.severity, key=lambda s: s.rank
        )
        mended |= {finding.code} if finding.fix else set()
    for code, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        mark = "[*]" if code in mended else "   "
        yield f"{count:7}  {code}  {worst[code].value:7}  {mark}  {RULES[code].slug}: {page(code).title}"


def as_json(
    findings: Sequence[Finding],
    files: Sequence[str],
    version: str,
    silenced: Sequence[tuple[Finding, str]] = (),
) -> str:
    """The findings as one JSON document.

    `{"schema": "urdfkin-findings", "version": 1, "urdfkin": "...", "files": [...], "findings": [...],
    "silenced": [...]}`; a finding has the fields of `Finding`, and `title`, the code's claim; one that a
    comment silences has its `reason`. The places of a `fix` are bytes behind a byte order mark.
    """
    document = {
        "schema": "urdfkin-findings",
        "version": JSON_VERSION,
        "urdfkin": version,
        "files": list(files),
        "counts": {s.value: sum(f.count for f in findings if f.severity is s) for s in Severity},
        "findings": [_entry(finding) for finding in findings],
        "silenced": [_entry(finding) | {"reason": reason} for finding, reason in silenced],
    }
    return json.dumps(document, indent=2)


def _entry(finding: Finding) -> dict[str, Any]:
    fix = None if finding.fix is None else asdict(finding.fix)
    return finding.as_dict() | {"width": finding.width, "fix": fix, "title": page(finding.code).title}


def as_github(findings: Sequence[Finding]) -> str:
    """One workflow command a finding, which GitHub shows beside the line; errors first."""
    words = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}
    return "\n".join(
        f"::{words[f.severity]} file={_property(f.file)},line={f.line},col={f.column},"
        f"{_end(f)}title={_property(f.code)}::{_message(f.sentence)}"
        for f in sorted(findings, key=lambda f: f.severity.rank)
    )


def _end(finding: Finding) -> str:
    return f"endColumn={finding.column + finding.width}," if finding.width > 1 else ""


def _message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _message(text).replace(":", "%3A").replace(",", "%2C")
