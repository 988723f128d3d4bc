"""`urdfkin check`: findings about URDFs, as a linter prints them."""

from __future__ import annotations

import importlib.metadata
import re
import sys
from collections.abc import Sequence
from dataclasses import replace

import click

from urdfkin.cli.arguments import xacro_args, xacro_option
from urdfkin.cli.door import command_lines, say, say_styled
from urdfkin.cli.numbers import Whole
from urdfkin.errors import SourceError, UnknownNameError, UrdfkinError
from urdfkin.lint import DEFAULT_LIMITS, Finding, Limits, Severity, check
from urdfkin.lint.formats import as_github, as_json, summary
from urdfkin.lint.pages import find_rule, page
from urdfkin.lint.sarif import as_sarif
from urdfkin.urdf.xacro import XacroError

_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "blue"}


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--format",
    "style",
    type=click.Choice(["terminal", "json", "sarif", "github"]),
    default="terminal",
    show_default=True,
    help="How to print the findings.",
)
@click.option("--strict", is_flag=True, help="Turn warnings into errors.")
@click.option("--ignore", multiple=True, metavar="CODE", help="Leave out a code; may be repeated, or a,b,c.")
@click.option("--each", is_flag=True, help="Print each place instead of folding many of a kind into one.")
@click.option("--no-notes", is_flag=True, help="Leave out notes.")
@click.option("--mimic/--no-mimic", default=None, help="Whether mimic joints follow.  [default: they do]")
@click.option(
    "--root-joint", type=click.Choice(["floating", "planar"]), help="Check the names this joint needs, too."
)
@xacro_option
@click.option("--max-bytes", type=Whole(1), default=DEFAULT_LIMITS.bytes, show_default=True)
@click.option("--max-depth", type=Whole(1), default=DEFAULT_LIMITS.depth, show_default=True)
@click.option("--max-elements", type=Whole(1), default=DEFAULT_LIMITS.elements, show_default=True)
@click.option("--max-attributes", type=Whole(1), default=DEFAULT_LIMITS.attributes, show_default=True)
@click.option("--max-name", type=Whole(1), default=DEFAULT_LIMITS.name, show_default=True)
@click.option("--max-number", type=Whole(1), default=DEFAULT_LIMITS.number, show_default=True)
@click.option("--max-markup", type=Whole(1), default=DEFAULT_LIMITS.markup, show_default=True)
def command(
    files: Sequence[str],
    style: str,
    strict: bool,
    ignore: Sequence[str],
    each: bool,
    no_notes: bool,
    mimic: bool | None,
    root_joint: str | None,
    max_bytes: int,
    max_depth: int,
    max_elements: int,
    max_attributes: int,
    max_name: int,
    max_number: int,
    max_markup: int,
) -> None:
    """Check URDFs and print what is wrong with them: code, place, what was found, what to do.

    FILE is a path, or - for standard input. A .xacro file is expanded by a process that can compute and read
    its package's files, no more (docs/xacro.md). Exit 0 when there is no error, 1 when there is, 2 when a
    file cannot be read or an option is wrong.

    \b
    Example:
      urdfkin check arm.urdf
      urdfkin check --strict --ignore URDF601 robots/*.urdf
      urdfkin explain URDF502
    """  # noqa: D301 - click's mark for a paragraph to leave alone is a backspace
    ignored = _codes(ignore)
    limits = Limits(max_bytes, max_depth, max_elements, max_attributes, max_name, max_number, max_markup)
    fold = style == "terminal" and not each
    findings: list[Finding] = []
    read: list[str] = []
    unreadable: list[UrdfkinError] = []
    for file in files:
        try:
            found = check(
                _as_path(file),
                limits=limits,
                mimic=mimic,
                root_joint=root_joint,
                xacro_args=xacro_args(),
                fold=fold,
            )
        except (SourceError, UnknownNameError, XacroError) as error:
            unreadable.append(error)
            continue
        read.append(file)
        findings += [_judged(f, strict) for f in found if _wanted(f, ignored, no_notes)]
    _print(findings, read, style)
    for failure in unreadable:
        say(f"urdfkin: error: {failure}", err=True)
    failed = any(finding.severity is Severity.ERROR for finding in findings)
    sys.exit(2 if unreadable else 1 if failed else 0)


def _as_path(file: str) -> str:
    # A file whose name begins like a tag is a file here: text is not given on the command line.
    return f"./{file}" if file.lstrip().startswith("<") else file


def _codes(words: Sequence[str]) -> set[str]:
    try:
        return {find_rule(part).id for word in words for part in re.split(r"[,\s]+", word) if part}
    except UnknownNameError as error:
        raise click.UsageError(f"--ignore: {error}") from error


def _wanted(finding: Finding, ignored: set[str], no_notes: bool) -> bool:
    return finding.code not in ignored and not (no_notes and finding.severity is Severity.NOTE)


def _judged(finding: Finding, strict: bool) -> Finding:
    raised = strict and finding.severity is Severity.WARNING
    return replace(finding, severity=Severity.ERROR) if raised else finding


def _print(findings: list[Finding], files: Sequence[str], style: str) -> None:
    version = _version()
    if style == "json":
        click.echo(as_json(findings, files, version))
    elif style == "sarif":
        click.echo(as_sarif(findings, version))
    elif style == "github":
        if findings:
            command_lines(as_github(findings))
    elif files:
        _print_terminal(findings, len(files))


def _version() -> str:
    try:
        return importlib.metadata.version("urdfkin")
    except importlib.metadata.PackageNotFoundError:  # run from a checkout that is not installed
        return "0+unknown"


def _print_terminal(findings: list[Finding], files: int) -> None:
    for finding in findings:
        place, rest = str(finding).split(f": {finding.code} ", 1)
        colour = {"fg": _COLOURS[finding.severity], "bold": True}
        say_styled((place, {"bold": True}), (": ", {}), (finding.code, colour), (f" {rest}", {}))
    click.echo(summary(findings, files))
    worst = next((f.code for f in findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        click.echo(f"'urdfkin explain {worst}' tells more: {page(worst).title}")
