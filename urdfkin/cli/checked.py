"""What `urdfkin check` prints: findings in every form, what was mended, what would be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import click

from urdfkin.cli.door import command_lines, harmless, say, say_styled
from urdfkin.errors import UrdfkinError
from urdfkin.lint import Finding, Severity
from urdfkin.lint.excerpt import Excerpts
from urdfkin.lint.formats import as_github, as_json, statistics, summary
from urdfkin.lint.pages import RULES, page
from urdfkin.lint.patch import patch
from urdfkin.lint.runner import Examined
from urdfkin.lint.sarif import as_sarif
from urdfkin.system.versions import installed_version

STYLES = ("terminal", "concise", "json", "sarif", "github")
_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "blue"}


@dataclass(slots=True)
class Outcome:
    """What was found in all files.

    Attributes:
        files: Those that were read, as they were named.
        findings: What is told.
        silenced: What comments silence, each with its reason.
        excerpts: Of each finding, the file's line with a caret.
        unreadable: Why files could not be read.
        unchanged: How many files say what they said before.
        known: How many findings a baseline knows, and how many more it knows that are gone.
        to_fix: How many findings --diff would mend.
        patches: What --diff prints.
        unsafe: How many more findings --unsafe-fixes would mend.
    """

    files: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    silenced: list[tuple[Finding, str]] = field(default_factory=list)
    excerpts: list[str | None] = field(default_factory=list)
    unreadable: list[UrdfkinError] = field(default_factory=list)
    unchanged: int = 0
    known: tuple[int, int] = (0, 0)
    to_fix: int = 0
    patches: list[str] = field(default_factory=list)
    unsafe: int = 0

    def add(self, file: str, found: Examined) -> None:
        """One more file."""
        excerpts = Excerpts(found.data)
        self.files.append(file)
        self.findings += found.findings
        self.silenced += found.silenced
        self.excerpts += [excerpts.of(finding) for finding in found.findings]


def print_outcome(outcome: Outcome, style: str, *, statistics: bool) -> None:
    """All that was found, in one form."""
    findings, version = outcome.findings, installed_version("urdfkin") or "0+unknown"
    if style == "json":
        click.echo(as_json(findings, outcome.files, version, outcome.silenced))
    elif style == "sarif":
        click.echo(as_sarif(findings, version, outcome.silenced))
    elif style == "github":
        if findings:
            command_lines(as_github(findings))
    elif statistics:
        _print_statistics(outcome)
    elif outcome.files or outcome.unchanged:
        _print_terminal(outcome, excerpts=style == "terminal")


def _print_terminal(outcome: Outcome, *, excerpts: bool) -> None:
    for finding, excerpt in zip(outcome.findings, outcome.excerpts, strict=True):
        place, rest = str(finding).split(f": {finding.code} ", 1)
        colour = {"fg": _COLOURS[finding.severity], "bold": True}
        mark = " [*] " if finding.fix and finding.fix.is_safe else " "
        say_styled((place, {"bold": True}), (": ", {}), (finding.code, colour), (f"{mark}{rest}", {}))
        if excerpts and excerpt is not None:
            line, _, caret = excerpt.partition("\n")
            say_styled((line, {}))
            say_styled((caret, colour))
    _print_summary(outcome)
    if any(finding.fix and finding.fix.is_safe for finding in outcome.findings):
        say("[*] --fix mends these, --diff shows how")
    if unsafe := sum(bool(finding.fix and not finding.fix.is_safe) for finding in outcome.findings):
        say(f"--unsafe-fixes mends {unsafe} more, which turns joints by more than rounding")
    worst = next((f.code for f in outcome.findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        say(f"'urdfkin explain {worst}' tells more: {page(worst).title}")


def _print_summary(outcome: Outcome) -> None:
    asides = [
        f"{len(outcome.silenced)} silenced by comments" if outcome.silenced else "",
        f"{outcome.unchanged} files unchanged" if outcome.unchanged else "",
        f"{outcome.known[0]} known before" if outcome.known[0] else "",
        f"{outcome.known[1]} of the baseline are gone: write it again" if outcome.known[1] else "",
    ]
    aside = ", ".join(filter(None, asides))
    say(summary(outcome.findings, len(outcome.files)) + (f" ({aside})" if aside else ""))


def _print_statistics(outcome: Outcome) -> None:
    for line in statistics(outcome.findings):
        say(line)
    _print_summary(outcome)


def say_fixed(file: str, fixed: Sequence[Finding]) -> None:
    """One line for each code that was mended in a file."""
    for code in sorted({finding.code for finding in fixed}):
        these = [finding for finding in fixed if finding.code == code]
        turns = max(finding.fix.turns for finding in these if finding.fix)
        lines = sorted({finding.line for finding in these})
        more = f" and {len(lines) - 4} more" if len(lines) > 4 else ""
        where = f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:4]))}{more}"
        moved = f"; joints turned by up to {turns:.1e} rad each" if turns else "; the robot is the same"
        say(f"{file}: fixed {code} {RULES[code].slug}, {where}{moved}", err=True)


def difference(file: str, before: bytes, after: bytes) -> str:
    """What would be changed, as a patch."""
    return patch(file, before, after, harmless)
