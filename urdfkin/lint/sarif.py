"""Findings as SARIF 2.1.0, which code-scanning services and editors read.

The format is OASIS "Static Analysis Results Interchange Format (SARIF) Version 2.1.0".
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from urdfkin.lint.finding import Finding
from urdfkin.lint.fixes import Fix
from urdfkin.lint.pages import RULES, page
from urdfkin.lint.rule import Rule

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def as_sarif(findings: Sequence[Finding], version: str, silenced: Sequence[tuple[Finding, str]] = ()) -> str:
    """One SARIF run with every code as a rule and every finding as a result.

    Args:
        findings: What is told.
        version: Of urdfkin.
        silenced: What comments silence, each with its reason: results that are suppressed in the source.
    """
    index = {code: number for number, code in enumerate(RULES)}
    run = {
        "tool": {
            "driver": {
                "name": "urdfkin",
                "version": version,
                "rules": [_rule(rule) for rule in RULES.values()],
            }
        },
        "columnKind": "unicodeCodePoints",
        "results": [
            *(_result(finding, index[finding.code]) for finding in findings),
            *(
                _result(finding, index[finding.code])
                | {"suppressions": [{"kind": "inSource", "justification": reason}]}
                for finding, reason in silenced
            ),
        ],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2)


def _rule(rule: Rule) -> dict[str, Any]:
    said = page(rule.id)
    return {
        "id": rule.id,
        "name": "".join(word.capitalize() for word in rule.slug.split("-")),
        "shortDescription": {"text": said.title},
        "fullDescription": {"text": said.why},
        "help": {"text": f"{said.why}\n\n{said.others}"},
        "defaultConfiguration": {"level": rule.severity.value},
    }


def _result(finding: Finding, rule: int) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": finding.code,
        "ruleIndex": rule,
        "level": finding.severity.value,
        "message": {"text": finding.sentence},
        "locations": [_location(finding)],
    }
    if finding.oracle is not None:
        result["properties"] = {"pinocchio": finding.oracle.value}
    if finding.fix is not None:
        result["fixes"] = [_fix(finding, finding.fix)]
    return result


def _fix(finding: Finding, fix: Fix) -> dict[str, Any]:
    replacements = [
        {
            "deletedRegion": {"byteOffset": edit.start, "byteLength": edit.end - edit.start},
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
    """A file's name as a URI reference: relative where it was given so, `stdin` for standard input.

    A name is bytes, of whatever encoding; those that a URI cannot hold are written as %XX.
    """
    if file.startswith("<"):
        return file.strip("<>")
    return Path(file).as_uri() if Path(file).is_absolute() else quote(os.fsencode(Path(file).as_posix()))
