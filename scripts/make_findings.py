"""Write docs/findings.md: all codes, and the findings of the catalogue's robots.

Run it after a change of a code or a robot: `python scripts/make_findings.py`. A test checks that the page
is current.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from urdfkin.lint import DEFAULT_LIMITS, Finding, Severity, check
from urdfkin.lint.finding import shortened
from urdfkin.lint.pages import RULES
from urdfkin.lint.pages import page as page_of
from urdfkin.lint.reporter import WRITTEN_OUT
from urdfkin.urdf.catalogue import catalogue

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

#: Code -> short meaning of the warning for the robots that have it.
REMARKS = {
    "URDF207": "A link has no origin of its own; the pose is lost, as it is for every reader.",
    "URDF405": "A slash in a name is legal; urdfkin never uses names as paths.",
    "URDF508": "Limits were left out or set to zero, so samples within them leave the joint at rest.",
    "URDF510": "The value has no effect, and none is expected.",
    "URDF527": "A mirrored finger has the limits of the one that it mimics; kinematics obeys the rule.",
    "URDF702": "No body has these moments of inertia; kinematics does not use them.",
    "URDF706": "The address of the mesh is wrong or points into another machine; kinematics needs no mesh.",
    "URDF708": "Only a colour is missing.",
}

HEAD = """\
# Findings

`urdfkin check FILE` and `urdfkin.check(source)` say what is wrong with a URDF; `urdfkin.load` refuses a file
with an error and warns of the rest. `urdfkin explain CODE` prints a code's page. This file is written by
`scripts/make_findings.py`.

- An **error** means that the file has no one meaning: it is refused.
- A **warning** is legal and almost certainly not meant, or not what every reader makes of it.
- A **note** is worth knowing.

Codes marked *refuses* or *differs* are legal, but Pinocchio refuses the file or reads another robot from it:
urdfkin computes the robot and reports every result as **not verified**, with the finding as the reason.

[check.md](check.md) is about the command: folders, settings, comments that silence, baselines, cures.

Time and memory grow with the file, and no faster (`scripts/check_growth.py` measures it for every kind of
content). Limits, which options raise: {limits.bytes:,} bytes (`--max-bytes`), {limits.depth:,} levels of
nesting (`--max-depth`), {limits.elements:,} elements (`--max-elements`), {limits.attributes:,} attributes of
one element (`--max-attributes`), {limits.name:,} characters of a name (`--max-name`), {limits.number:,} of a
number (`--max-number`) and {limits.markup:,} bytes of one tag or comment (`--max-markup`). `load` keeps the
same limits.

On a terminal, many warnings of one kind become one that tells the lines, and so do errors from the hundredth
of a kind on; `--each` prints each. Of every kind, {written:,} findings of a file are written out, in JSON and
SARIF too; the last of them tells the lines of the others (`also` in JSON).

## Codes
"""

ROBOTS = """\
## What the robots of the catalogue are told

No robot has an error (alex_psyonic_hands is loaded with mimic off, which its catalogue entry says). These are
the warnings; robots that are not listed have none. Notes, such as rounded multiples of pi, are left out.

| robot | code | where | what | meaning |
|---|---|---|---|---|
"""


def page() -> str:
    """Return the current text of the page."""
    head = HEAD.format(limits=DEFAULT_LIMITS, written=WRITTEN_OUT)
    return head + "".join(_tables()) + "\n" + ROBOTS + "".join(_robots())


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
    """Escape text for a cell of a table."""
    return shortened(text, 200).replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
