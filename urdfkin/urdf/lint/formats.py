"""Write findings as text, JSON, SARIF 2.1.0, or GitHub workflow commands.

SARIF is a format of code-scanning services and editors: OASIS "Static Analysis Results Interchange Format
(SARIF) Version 2.1.0".
"""

from __future__ import annotations

import codecs
import json
import os
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import quote

from urdfkin.urdf.findings import Finding, Fix, Rule, Severity, count_by_severity, format_counts
from urdfkin.urdf.lint.pages import MJCF_AND_USD_RULES, URDF_RULES, find_rule, page

SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def as_sarif(
    findings: Sequence[Finding],
    version: str,
    silenced_findings: Sequence[tuple[Finding, str]] = (),
    files_with_mark: Collection[str] = (),
) -> str:
    """Return a SARIF document with all rules about URDF files, and a result for each finding.

    Rules about MJCF and USD are included only if a finding has their code. `files_with_mark` contains the
    files that begin with a byte order mark. In SARIF, a byte offset of a fix counts this mark.
    """
    codes = {finding.code for finding in findings}
    rules = URDF_RULES | {code: rule for code, rule in MJCF_AND_USD_RULES.items() if code in codes}
    index = {code: number for number, code in enumerate(rules)}
    results = []
    for finding in findings:
        mark = codecs.BOM_UTF8 if finding.file in files_with_mark else b""
        results.append(_result(finding, index[finding.code], len(mark)))
    for finding, reason in silenced_findings:
        suppression = {"kind": "inSource", "justification": reason}
        results.append(_result(finding, index[finding.code]) | {"suppressions": [suppression]})
    driver = {"name": "urdfkin", "version": version, "rules": [_rule(rule) for rule in rules.values()]}
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return json.dumps({"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2)


def _rule(rule: Rule) -> dict[str, Any]:
    content = page(rule.id)
    return {
        "id": rule.id,
        "name": "".join(word.capitalize() for word in rule.slug.split("-")),
        "shortDescription": {"text": content.title},
        "fullDescription": {"text": content.why},
        "help": {"text": f"{content.why}\n\n{content.other_readers}"},
        "defaultConfiguration": {"level": rule.severity.value},
    }


def _result(finding: Finding, rule_index: int, mark_length: int = 0) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": finding.code,
        "ruleIndex": rule_index,
        "level": finding.severity.value,
        "message": {"text": finding.sentence},
        "locations": [_location(finding)],
    }
    if finding.pinocchio_reading is not None:
        result["properties"] = {"pinocchio": finding.pinocchio_reading.value}
    if finding.fix is not None:
        result["fixes"] = [_fix(finding, finding.fix, mark_length)]
    return result


def _fix(finding: Finding, fix: Fix, mark_length: int) -> dict[str, Any]:
    replacements = [
        {
            "deletedRegion": {"byteOffset": mark_length + edit.start, "byteLength": edit.end - edit.start},
            "insertedContent": {"text": edit.text},
        }
        for edit in fix.edits
    ]
    change = {"artifactLocation": {"uri": _uri(finding.file)}, "replacements": replacements}
    return {"description": {"text": finding.remedy or finding.message}, "artifactChanges": [change]}


def _location(finding: Finding) -> dict[str, Any]:
    location: dict[str, Any] = {
        "physicalLocation": {"artifactLocation": {"uri": _uri(finding.file)}, "region": _region(finding)}
    }
    if finding.element and finding.name:
        location["logicalLocations"] = [{"name": finding.name, "kind": finding.element}]
    return location


def _region(finding: Finding) -> dict[str, int]:
    region = {"startLine": finding.line, "startColumn": finding.column}
    return region | ({"endColumn": finding.column + finding.width} if finding.width else {})


def _uri(file: str) -> str:
    if file.startswith("<"):
        return file.strip("<>")
    return Path(file).as_uri() if Path(file).is_absolute() else quote(os.fsencode(Path(file).as_posix()))


#: Version of the JSON format. The number changes if a field is removed or changes its meaning.
JSON_VERSION = 1


def format_summary(findings: Sequence[Finding], files: int) -> str:
    return f"{format_counts(findings)} in {files} file" + ("" if files == 1 else "s")


def format_statistics(findings: Sequence[Finding]) -> Iterator[str]:
    """Yield a line for each code; `[*]` means that `--fix` can fix at least one finding with this code."""
    counts, worst, fixable = Counter[str](), dict[str, Severity](), set[str]()
    for finding in findings:
        counts[finding.code] += finding.count
        severities = worst.get(finding.code, finding.severity), finding.severity
        worst[finding.code] = min(severities, key=lambda severity: severity.rank)
        fixable |= {finding.code} if finding.fix and finding.fix.is_safe else set()
    for code, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        mark = "[*]" if code in fixable else "   "
        yield f"{count:7}  {code}  {worst[code].value:7}  {mark}  {find_rule(code).slug}: {page(code).title}"


def as_json(
    findings: Sequence[Finding],
    files: Sequence[str],
    version: str,
    silenced_findings: Sequence[tuple[Finding, str]] = (),
) -> str:
    """Return a JSON document.

    A position in a `fix` counts bytes from 0. A byte order mark is not counted.
    """
    document = {
        "schema": "urdfkin-findings",
        "version": JSON_VERSION,
        "urdfkin": version,
        "files": list(files),
        "counts": count_by_severity(findings),
        "findings": [_json_entry(finding) for finding in findings],
        "silenced": [_json_entry(finding) | {"reason": reason} for finding, reason in silenced_findings],
    }
    return json.dumps(document, indent=2)


def _json_entry(finding: Finding) -> dict[str, Any]:
    fix = None if finding.fix is None else asdict(finding.fix)
    return finding.as_dict() | {"width": finding.width, "fix": fix, "title": page(finding.code).title}


def as_github(findings: Sequence[Finding]) -> str:
    words = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}
    return "\n".join(
        f"::{words[f.severity]} file={_escape_property(f.file)},line={f.line},col={f.column},"
        f"{_end_column_text(f)}title={_escape_property(f.code)}::{_escape_message(f.sentence)}"
        for f in sorted(findings, key=lambda f: f.severity.rank)
    )


def _end_column_text(finding: Finding) -> str:
    return f"endColumn={finding.column + finding.width}," if finding.width > 1 else ""


def _escape_message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_message(text).replace(":", "%3A").replace(",", "%2C")
