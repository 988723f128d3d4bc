"""Odd documents have the expected verdict, and findings with the expected place and text."""

import re
from pathlib import Path

import pytest

from tests.urdf.lint.cases import CASES
from tests.urdf.lint.cases.arm import Case
from urdfkin.urdf.lint import Finding, Severity, check

SNAPSHOT = Path(__file__).with_name("messages.txt")


def verdict(findings: list[Finding]) -> str:
    severities = {finding.severity for finding in findings}
    if Severity.ERROR in severities:
        return "reject"
    return "accept-with-warning" if Severity.WARNING in severities else "accept"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_document_has_the_expected_verdict_and_each_finding_has_a_place_and_a_remedy(case: Case) -> None:
    findings = check(case.data)
    printed = [str(finding) for finding in findings]
    assert verdict(findings) == case.verdict, printed
    assert case.findings <= {(finding.code, finding.line) for finding in findings}, printed
    lines = re.split(rb"\r\n|\r|\n", case.data)
    for finding in findings:
        assert 1 <= finding.column <= len(lines[finding.line - 1].decode("utf-8", "replace")) + 1
        assert finding.severity is Severity.NOTE or finding.found or finding.remedy, str(finding)


def messages() -> str:
    """Return the printed findings of all cases that have findings."""
    lines: list[str] = []
    for case in CASES:
        if printed := [str(finding) for finding in check(case.data, fold=True)]:
            lines += [f"== {case.name}", *printed]
    return "\n".join(lines) + "\n"


def test_the_messages_of_findings_equal_the_stored_snapshot() -> None:
    assert messages() == SNAPSHOT.read_text("utf-8"), (
        "messages changed: read the changes, then run python -m tests.urdf.lint.test_cases to accept them"
    )


if __name__ == "__main__":
    SNAPSHOT.write_text(messages(), "utf-8")
