"""`urdfkin report`: show, convert and compare reports of validations."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from urdfkin.cli.campaign import merge, status
from urdfkin.cli.exit import crash, refuse
from urdfkin.cli.options import NumberFrom, schema_option, together
from urdfkin.cli.output import TEXTS, Answer, answering, check_writable, console, write_file
from urdfkin.cli.streams import say
from urdfkin.errors import SourceError, UrdfkinError
from urdfkin.system.files import is_folder

if TYPE_CHECKING:
    from urdfkin.validation.document import Document


_PATH = click.Path(path_type=Path, dir_okay=False)

#: These options name an output file of a report.
FILES = ("json_", "html", "junit", "markdown")
report_options = together(
    click.option("--html", type=_PATH, help="Write the report as an HTML page that works offline."),
    click.option(
        "--junit", type=_PATH, help="Write JUnit XML, with a test case for each robot and quantity."
    ),
    click.option("--markdown", type=_PATH, help="Write the result as Markdown for a pull request comment."),
    click.option(
        "--cases/--no-cases", default=False, help="Show the command that reproduces each worst case."
    ),
)


def write_reports(document: Document, files: Mapping[str, Path | None]) -> int:
    """Write a report in the requested formats; if one file cannot be written, write the others.

    The result is 0, or the exit code of the first format that could not be written. Its error has been
    printed.
    """
    codes = [_write(document, name, path) for name in FILES if (path := files[name]) is not None]
    return next(filter(None, codes), 0)


def say_written(files: Mapping[str, Path | None]) -> None:
    if named := [str(files[name]) for name in FILES if files[name]]:
        say(f"wrote {', '.join(named)}")


def _write(document: Document, form: str, path: Path) -> int:
    try:
        for place, data in _files(document, form, path):
            if place.parent != path.parent:
                place.parent.mkdir(exist_ok=True)
            write_file(place, data)
    except UrdfkinError as error:
        return refuse(error)
    except OSError as error:
        return refuse(SourceError("cannot be written", where=str(path), found=error.strerror or str(error)))
    except Exception as error:
        return crash(error)
    return 0


def _files(document: Document, form: str, path: Path) -> Iterator[tuple[Path, bytes]]:
    """Yield the path and the content of each file of a report; HTML can have a page and other files."""
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

        yield from ((path.parent / place, text.encode()) for place, text in as_files(document, path.name))


EXAMPLE = "urdfkin report results.json --html report.html --junit report.xml"


class _Results(click.Group):
    """The subcommands of `report`. Without a subcommand, `report FILE` means `report show FILE`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not ctx.resilient_parsing and (not args or args[0] not in (*self.commands, "-h", "--help")):
            args = ["show", *args]
        return super().parse_args(ctx, args)


@click.group("report", cls=_Results, epilog=f"Example: {EXAMPLE}")
def report_command() -> None:
    """Show, convert or compare the results of earlier validations.

    Results are the JSON file of `urdfkin validate --json FILE`, or the folder of `--store DIR`. `urdfkin
    report RESULTS` is short for `urdfkin report show RESULTS`.
    """


@report_command.command("show", epilog=f"Example: {EXAMPLE}")
@click.argument("results", metavar="RESULTS.json|DIR", type=click.Path(path_type=Path), required=False)
@click.option("--json", "json_", type=click.Path(path_type=Path), help="Write the report as JSON.")
@report_options
@schema_option("urdfkin.validation.document:VALIDATION", "a report")
@click.pass_context
def show(context: click.Context, /, results: Path | None, cases: bool, **files: Path | None) -> None:
    """Show a report or convert it to HTML, JUnit or Markdown.

    RESULTS can be the folder of --store, even while the validation runs. If robots are still missing in this
    folder, the command shows the run as interrupted.

    The exit code is that of the validation. 0: everything verified. 1: a disagreement. 2: a robot could
    not be read, or the file cannot be used. 3: a robot was not verified. 130: interrupted.
    """
    from urdfkin.report.reading import read_document, stored_document
    from urdfkin.validation.document import outcome_of

    if results is None:
        raise click.UsageError("name the file of `urdfkin validate --json FILE`, or the folder of `--store`")
    document = stored_document(results) if is_folder(results) else read_document(results)
    check_writable(*files.values())
    failed = write_reports(document, files)
    if not failed:
        say_written(files)
    if not any(files.values()):
        from urdfkin.report.terminal import print_report

        print_report(document, console(), cases=cases)
    context.exit(outcome_of(document).exit_code or failed)


@report_command.command(
    "compare",
    short_help="Compare the reports of two validations.",
    epilog="Example: urdfkin report compare main.json branch.json --markdown comment.md",
)
@click.argument("old", metavar="OLD.json", type=click.Path(path_type=Path))
@click.argument("new", metavar="NEW.json", type=click.Path(path_type=Path))
@click.option(
    "--factor",
    type=NumberFrom(1.0),
    default=2.0,
    show_default=True,
    help="A worst disagreement that grows by more than this factor counts as a regression.",
)
@click.option(
    "--markdown",
    type=click.Path(path_type=Path),
    help="Write the result as Markdown for a pull request comment.",
)
@answering(*TEXTS, "json")
def compare_reports(old: Path, new: Path, factor: float, markdown: Path | None) -> Answer:
    """Compare two reports: versions, robots, verdicts and disagreements.

    Each of these changes is a regression. The run passed before and fails now. A robot is missing, or its
    verdict is worse. More results lie outside their bound. A quantity is no longer compared, or it is
    compared on fewer samples. A bound is wider. A worst disagreement grew by more than the factor and is
    above 2 eps*scale. A changed model is listed joint by joint. A changed model alone is not a regression;
    `same` and `diff` compute how far its frames move. If a report contradicts itself, for example in its
    numbers of samples, the command exits with 2. Exit 0: no regression. 1: a regression. 2: a file that
    cannot be used.
    """
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
@click.argument("paths", metavar="DIR|RESULTS.json...", nargs=-1, type=click.Path(path_type=Path))
@click.option("--all", "all_", is_flag=True, help="Show all runs and changes, not only the latest.")
@schema_option("urdfkin.report.history:HISTORY", "the data")
@answering(*TEXTS, "json")
def report_history(paths: tuple[Path, ...], all_: bool) -> Answer:
    """Show how the validation results of each robot changed over several runs of `urdfkin validate`.

    The arguments are reports (JSON files), the folders of `validate --store`, or folders that contain both.
    Runs are ordered by their start. The command identifies a robot by its source, which is a path or a name.
    If a file was renamed, the command uses the robot's name. Changes and regressions are defined as in
    `report compare`. With `--output history.html`, the command writes an offline page with charts.

    If a file cannot be used, the command prints its name and the reason, and shows the other files. Exit 0:
    every file was used. 2: a file cannot be used.
    """
    from urdfkin.report.history import as_html, document, history

    if not paths:
        raise click.UsageError("give reports, or a folder with reports: urdfkin report history DIR")
    found = history(paths)
    words = shlex.join(["urdfkin", "report", "history", *map(str, paths), "--format"])
    data = {"json": lambda: found.as_dict(f"{words} json"), "html": lambda: as_html(found, f"{words} html")}
    return Answer(lambda: document(found, all_=all_), data, code=found.exit_code)


report_command.add_command(status, "status")
report_command.add_command(merge, "merge")
