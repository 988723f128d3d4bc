"""Findings as text: for a terminal, as JSON, and as GitHub's workflow commands. SARIF has its own module."""

from __future__ import annotations

import json
from collections.abc import Sequence

from urdfkin.lint.finding import Finding, Severity
from urdfkin.lint.pages import page

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


def as_json(findings: Sequence[Finding], files: Sequence[str], version: str) -> str:
    """The findings as one JSON document.

    `{"schema": "urdfkin-findings", "version": 1, "urdfkin": "...", "files": [...], "findings": [...]}`; a
    finding has the fields of `Finding`, and `title`, the code's claim.
    """
    document = {
        "schema": "urdfkin-findings",
        "version": JSON_VERSION,
        "urdfkin": version,
        "files": list(files),
        "counts": {s.value: sum(f.count for f in findings if f.severity is s) for s in Severity},
        "findings": [{**finding.as_dict(), "title": page(finding.code).title} for finding in findings],
    }
    return json.dumps(document, indent=2)


def as_github(findings: Sequence[Finding]) -> str:
    """One workflow command a finding, which GitHub shows beside the line."""
    words = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}
    return "\n".join(
        f"::{words[f.severity]} file={_property(f.file)},line={f.line},col={f.column},"
        f"title={_property(f.code)}::{_message(f.sentence)}"
        for f in findings
    )


def _message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _message(text).replace(":", "%3A").replace(",", "%2C")
