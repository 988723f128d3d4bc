"""Write docs/findings.md: the codes, and the warnings of the robots in the catalogue.

Run this script after a change of a code or a robot: `python scripts/make_findings.py`. A test compares the
page with the output of this script.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # run from a checkout that is not installed

from scripts.pages import inserted
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import WRITTEN_OUT, shortened
from urdfkin.urdf.lint import DEFAULT_LIMITS, Finding, Severity, check
from urdfkin.urdf.lint.pages import RULES
from urdfkin.urdf.lint.pages import page as page_of

PAGE = Path(__file__).parents[1] / "docs" / "findings.md"

FAMILIES = {
    "1": "Text and XML",
    "2": "Dialect, elements and attributes",
    "3": "Numbers",
    "4": "Names and structure",
    "5": "Joints",
    "6": "Suspicious",
    "7": "Inertials, geometry and materials",
}

#: For each code: what the warning means for the robots of the catalogue that have it.
REMARKS = {
    "URDF207": "URDF has no origin in a link; every reader ignores this pose.",
    "URDF405": "A slash in a name is legal; urdfkin does not use names as paths.",
    "URDF508": "The limits are missing or zero, so samples within them do not move the joint.",
    "URDF510": "The value has no effect, as expected.",
    "URDF527": "A mirrored finger has the limits of the mimicked one; kinematics applies the rule.",
    "URDF702": "No body has these moments of inertia; kinematics does not use them.",
    "URDF706": "The address of the mesh is wrong, or is a path on another machine; kinematics needs no mesh.",
    "URDF708": "Only a colour is missing.",
}

LIMITS = """\
| limit | option |
|---|---|
| {limits.bytes:,} bytes | `--max-bytes` |
| {limits.depth:,} levels of nesting | `--max-depth` |
| {limits.elements:,} elements | `--max-elements` |
| {limits.attributes:,} attributes of one element | `--max-attributes` |
| {limits.name:,} characters of a name | `--max-name` |
| {limits.number:,} characters of a number | `--max-number` |
| {limits.markup:,} bytes of one tag or comment | `--max-markup` |
| {written:,} complete findings of a kind, also in JSON and SARIF | |
"""

ROBOTS = "| robot | code | where | what | meaning |\n|---|---|---|---|---|\n"


def page() -> str:
    """Return the page."""
    return inserted(
        PAGE.read_text("utf-8"),
        limits=LIMITS.format(limits=DEFAULT_LIMITS, written=WRITTEN_OUT),
        codes="".join(_tables()),
        robots=ROBOTS + "".join(_robots()),
    )


def _tables() -> Iterator[str]:
    for digit, family in FAMILIES.items():
        yield f"\n### {family}\n\n| code | name | severity | finding | Pinocchio |\n|---|---|---|---|---|\n"
        for rule in RULES.values():
            if rule.id[4] == digit:
                mark = f"*{rule.oracle.value}*" if rule.oracle else ""
                title = _cell(page_of(rule.id).title)
                yield f"| {rule.id} | {rule.slug} | {rule.severity.value} | {title} | {mark} |\n"


def _robots() -> Iterator[str]:
    for name in catalogue():
        for finding in warnings_of(name):
            lines = f"line {finding.line}" + (f" and {len(finding.also)} more" if finding.also else "")
            what = _cell(f"{finding.subject}: {finding.message}" if finding.subject else finding.message)
            yield f"| {name} | {finding.code} | {lines} | {what} | {REMARKS[finding.code]} |\n"


def warnings_of(robot: str) -> list[Finding]:
    """Return the warnings and errors of a robot of the catalogue."""
    return [finding for finding in check(robot, fold=True) if finding.severity is not Severity.NOTE]


def _cell(text: str) -> str:
    """Escape a text for a cell of a Markdown table."""
    return shortened(text, 200).replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
