"""`urdfkin report`: show, convert and compare the reports of validations."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.campaign import merge, status
from urdfkin.cli.exit import report_crash, report_error
from urdfkin.cli.options import (
    FILE,
    FILE_OR_FOLDER,
    NumberInRange,
    combine,
    markdown_option,
    reject_unused_options,
    schema_option,
)
from urdfkin.cli.output import TEXT_FORMATS, Answer, answer_command, check_writable, make_console
from urdfkin.cli.streams import say
from urdfkin.errors import SourceError, UrdfkinError
from urdfkin.system.files import is_folder, write_file

if TYPE_CHECKING:
    from urdfkin.validation.document import Document


REPORT_FILE_OPTIONS = ("json_", "html", "junit", "markdown")
report_options = combine(
    click.option("--json", "json_", type=FILE, help="Write the report to this file as JSON."),
    click.option(
        "--html",
        type=FILE,
        help="Write the report to this file as an HTML page that works offline. A folder beside a long page"
        " has the robots' details.",
    ),
    click.option(
        "--junit",
        type=FILE,
        help="Write JUnit XML to this file, with a test case for each robot and quantity.",
    ),
    markdown_option,
    click.option(
        "--cases/--no-cases", default=False, help="Show the command that reproduces each worst case."
    ),
)


def write_reports(document: Document, files: Mapping[str, Path | None]) -> int:
    """Write a report in the requested formats, and return the exit code of the first write error, or 0."""
    codes = [
        _write(document, name, path) for name in REPORT_FILE_OPTIONS if (path := files[name]) is not None
    ]
    return next(filter(None, codes), 0)


def say_written(files: Mapping[str, Path | None]) -> None:
    if written := [str(files[name]) for name in REPORT_FILE_OPTIONS if files[name]]:
        say(f"wrote {', '.join(written)}")


def _write(document: Document, form: str, path: Path) -> int:
    try:
        for file, data in _files(document, form, path):
            if file.parent != path.parent:
                file.parent.mkdir(exist_ok=True)
            write_file(file, data)
    except UrdfkinError as error:
        return report_error(error)
    except OSError as error:
        found = error.strerror or str(error)
        return report_error(SourceError("cannot be written", where=str(path), found=found))
    except Exception as error:
        return report_crash(error)
    return 0


def _files(document: Document, form: str, path: Path) -> Iterator[tuple[Path, bytes]]:
    if form == "json_":
        yield path, (json.dumps(document, allow_nan=False) + "\n").encode()
    elif form == "junit":
        from urdfkin.report.junit import as_junit

        yield path, as_junit(document)
    elif form == "markdown":
        from urdfkin.report.markdown import as_markdown

        yield path, as_markdown(document).encode()
    else:
        from urdfkin.report.html import as_files

        yield from ((path.parent / name, text.encode()) for name, text in as_files(document, path.name))


EXAMPLE = "urdfkin report results.json --html report.html --junit report.xml"


class _ReportGroup(click.Group):
    """The subcommands of `report`; `report RESULTS` means `report show RESULTS`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not ctx.resilient_parsing and (not args or args[0] not in (*self.commands, "-h", "--help")):
            args = ["show", *args]
        return super().parse_args(ctx, args)


@click.group("report", cls=_ReportGroup, epilog=f"Example: {EXAMPLE}")
def report_command() -> None:
    """Show, convert or compare the results of earlier validations.

    RESULTS is the JSON file from `urdfkin validate --json FILE`, or the folder from `--store DIR`. `urdfkin
    report RESULTS` is short for `urdfkin report show RESULTS`.
    """


@report_command.command("show", epilog=f"Example: {EXAMPLE}")
@click.argument("results", metavar="RESULTS.json|DIR", type=FILE_OR_FOLDER, required=False)
@report_options
@schema_option("urdfkin.validation.document:VALIDATION", "a report")
@click.pass_context
def show_report(context: click.Context, /, results: Path | None, cases: bool, **files: Path | None) -> None:
    """Show a report, or convert it to HTML, JUnit or Markdown.

    RESULTS is the JSON file from `urdfkin validate --json FILE`, or the folder from `--store DIR`. The
    validation may still be running; a validation with missing robots is shown as interrupted.

    The command ends with the exit code of the validation. 0: everything verified. 1: a disagreement. 2: a
    robot could not be read, or the file cannot be used. 3: a robot was not verified. 130: interrupted.
    """
    from urdfkin.report.reading import read_document, read_stored_document
    from urdfkin.validation.document import outcome_of

    if results is None:
        raise click.UsageError(
            "RESULTS is missing: give the FILE of `urdfkin validate --json FILE`, or the DIR of `--store DIR`"
        )
    if any(files.values()):
        reject_unused_options(context, ("cases",), "if the report is written to a file")
    document = read_stored_document(results) if is_folder(results) else read_document(results)
    check_writable(*files.values())
    failed = write_reports(document, files)
    if not failed:
        say_written(files)
    if not any(files.values()):
        from urdfkin.report.terminal import print_report

        print_report(document, make_console(), cases=cases)
    context.exit(outcome_of(document).exit_code or failed)


@report_command.command(
    "compare",
    short_help="Compare the reports of two validations.",
    epilog="Example: urdfkin report compare main.json branch.json --markdown comment.md",
)
@click.argument("old", metavar="OLD.json", type=FILE_OR_FOLDER)
@click.argument("new", metavar="NEW.json", type=FILE_OR_FOLDER)
@click.option(
    "--factor",
    type=NumberInRange(1.0),
    default=2.0,
    help="Report a regression if a quantity's largest disagreement grows by more than this factor. The factor"
    " also limits the growth of the largest ratio to the bound.",
)
@markdown_option
@answer_command(*TEXT_FORMATS, "json")
def compare_reports(old: Path, new: Path, factor: float, markdown: Path | None) -> Answer:
    """Compare two reports: versions, robots, verdicts and disagreements.

    \b
    Each of these changes is a regression:
    - The run passed before and fails now, or it was interrupted now.
    - A robot is missing, its verdict is worse, or it is new and not verified.
    - More results are outside their bound, or results of a new quantity are.
    - A quantity or table is no longer compared, or not with the second oracle.
    - There are fewer samples or results.
    - A bound is wider for the same joints.
    - The largest disagreement of a quantity grew by more than --factor,
      and is above 2 eps*scale (the error of a single rounding).
    - The largest ratio of a disagreement to its bound grew by more than
      --factor, and is above 0.1.
    - The largest disagreement or ratio became infinite.

    If a model changed, the command lists the changes of each joint. A changed model alone is not a
    regression. `urdfkin same` and `urdfkin diff` compute how far the model's frames move.

    Exit 0: no regression. 1: a regression. 2: a file cannot be used. For example, the file states more
    samples than the validation requested.
    """  # noqa: D301  click needs the character "\b"
    from urdfkin.report.compare import compare, document, markdown_of
    from urdfkin.report.reading import read_document

    before, after = read_document(old), read_document(new)
    check_writable(markdown)
    found = compare(before, after, factor)
    if markdown is not None:
        write_file(markdown, markdown_of(before, after, found).encode())
    words = ["urdfkin", "report", "compare", str(old), str(new), "--factor", str(factor), "--format", "json"]
    data = {
        "json": lambda: found.as_dict(shlex.join(words)),
        "markdown": lambda: markdown_of(before, after, found),
    }
    return Answer(lambda: document(before, after, found), data, code=found.exit_code)


@report_command.command(
    "history",
    short_help="Show how the results of each robot changed over several validations.",
    epilog="Example: urdfkin report history nightly --output history.html",
)
@click.argument("paths", metavar="DIR|RESULTS.json...", nargs=-1, type=FILE_OR_FOLDER)
@click.option("--all", "all_", is_flag=True, help="Show all runs and changes, not only the latest.")
@schema_option("urdfkin.report.history:HISTORY", "the data")
@answer_command(*TEXT_FORMATS, "json")
def report_history(paths: tuple[Path, ...], all_: bool) -> Answer:
    """Show how the validation results of each robot changed over several runs of `urdfkin validate`.

    The arguments are reports (JSON files), stores (folders of `urdfkin validate --store`), or folders with
    reports and stores. Runs are ordered by their start. The command identifies a robot by its source, which
    is a path or a name of the catalogue. If a robot's file was renamed, the command identifies the robot by
    its name. Changes and regressions are defined as in `urdfkin report compare`. With `--output
    history.html`, the command writes an HTML page with charts, which works offline.

    If a file cannot be used, the command prints the file's name and the reason, and shows the other files.
    Exit 0: every file was used. 2: a file cannot be used.
    """
    from urdfkin.report.history import as_html, document, read_history

    if not paths:
        raise click.UsageError("give reports, or a folder with reports: urdfkin report history DIR")
    found = read_history(paths)
    words = shlex.join(["urdfkin", "report", "history", *map(str, paths), "--format"])
    data = {"json": lambda: found.as_dict(f"{words} json"), "html": lambda: as_html(found, f"{words} html")}
    return Answer(lambda: document(found, all_=all_), data, code=found.exit_code)


report_command.add_command(status, "status")
report_command.add_command(merge, "merge")
