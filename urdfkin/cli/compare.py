"""`urdfkin report compare`: compare two validation reports."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import click

from urdfkin.cli.arguments import forms
from urdfkin.cli.options import NumberFrom
from urdfkin.cli.output import console, write_file
from urdfkin.cli.report_options import check_writable

EXAMPLE = "urdfkin report compare main.json branch.json --markdown comment.md"


@click.command("compare", short_help="Compare the reports of two validations.", epilog=f"Example: {EXAMPLE}")
@click.argument("old", metavar="OLD.json", type=click.Path(path_type=Path))
@click.argument("new", metavar="NEW.json", type=click.Path(path_type=Path))
@click.option(
    "--factor",
    type=NumberFrom(1.0),
    default=2.0,
    show_default=True,
    help="Factor by which a worst disagreement may grow without a regression.",
)
@forms("table", "json")
@click.option(
    "--markdown", type=click.Path(path_type=Path), help="Write Markdown for a pull request comment."
)
@click.pass_context
def command(
    context: click.Context, old: Path, new: Path, factor: float, format_: str, markdown: Path | None
) -> None:
    """Compare two reports: versions, robots, verdicts and disagreements.

    A regression is one of these: the run passed before and fails now; a robot is missing, or its verdict is
    worse; more results lie outside their bound; something is no longer compared, or on fewer samples; a bound
    is wider; a worst disagreement grew by more than the factor and is above 2 eps*scale. A changed model is
    listed joint by joint. It is not a regression by itself; `same` and `diff` compute how far a frame moves.
    A report that contradicts itself is an error.
    Exit 0: no regression. 1: a regression. 2: a file that cannot be used.
    """
    from urdfkin.report.compare import (  # noqa: PLC0415
        compare,
        markdown_of,
        print_comparison,
    )
    from urdfkin.report.reading import read_document  # noqa: PLC0415

    before, after = read_document(old), read_document(new)
    check_writable(markdown)
    found = compare(before, after, factor)
    words = ["urdfkin", "report", "compare", str(old), str(new), "--factor", str(factor), "--format", format_]
    if markdown is not None:
        write_file(markdown, markdown_of(before, after, found).encode())
    if format_ == "json":
        click.echo(json.dumps(found.as_dict(shlex.join(words)), indent=2, allow_nan=False))
    else:
        print_comparison(before, after, found, console())
    context.exit(found.exit_code)
