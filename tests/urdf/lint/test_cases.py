"""Every odd document gets the verdict it deserves, at the right line, in words that are kept."""

import re
from pathlib import Path

import pytest

from tests.urdf.lint.cases import CASES
from tests.urdf.lint.cases.arm import Case
from urdfkin.urdf.lint import Finding, Severity, check

SNAPSHOT = Path(__file__).with_name("messages.txt")
EVERY_CASE = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


def verdict(findings: list[Finding]) -> str:
    severities = {finding.severity for finding in findings}
    if Severity.ERROR in severities:
        return "reject"
    return "accept-with-warning" if Severity.WARNING in severities else "accept"


@EVERY_CASE
def test_the_verdict_is_the_one_it_deserves(case: Case) -> None:
    findings = check(case.data)
    assert verdict(findings) == case.verdict, [str(finding) for finding in findings]


@EVERY_CASE
def test_the_findings_stand_on_their_lines(case: Case) -> None:
    findings = check(case.data)
    found = {(finding.code, finding.line) for finding in findings}
    assert case.findings <= found, [str(finding) for finding in findings]


@pytest.mark.slow
@EVERY_CASE
def test_the_column_points_at_what_is_meant(case: Case) -> None:
    lines = re.split(rb"\r\n|\r|\n", case.data)
    for finding in check(case.data):
        assert 1 <= finding.column <= len(lines[finding.line - 1].decode("utf-8", "replace")) + 1


def test_every_error_and_warning_says_what_was_found_or_what_to_do() -> None:
    for case in CASES:
        for finding in check(case.data):
            note = finding.severity is Severity.NOTE
            assert note or finding.found or finding.remedy, str(finding)


def messages() -> str:
    """What is printed for every case, as one text."""
    blocks = []
    for case in CASES:
        lines = [f"== {case.name}", *(str(finding) for finding in check(case.data, fold=True))]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def test_the_messages_are_the_ones_that_were_agreed() -> None:
    assert messages() == SNAPSHOT.read_text("utf-8"), (
        "messages changed: look at them, then run python -m tests.urdf.lint.test_cases to keep them"
    )


if __name__ == "__main__":
    SNAPSHOT.write_text(messages(), "utf-8")
