"""`urdfkin report`: show, convert and compare results of validations; progress and merging of stores."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.campaign import merge, status
from urdfkin.cli.compare import command as compare
from urdfkin.cli.output import console
from urdfkin.cli.report_options import check_writable, report_options, say_written, write_reports
from urdfkin.system.files import is_folder

EXAMPLE = "urdfkin report results.json --html report.html --junit report.xml"


class _Results(click.Group):
    """The subcommands; `report FILE` without one is `report show FILE`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert `show` unless a subcommand or help is asked for."""
        if not ctx.resilient_parsing and (not args or args[0] not in (*self.commands, "-h", "--help")):
            args = ["show", *args]
        return super().parse_args(ctx, args)


@click.group(cls=_Results, epilog=f"Example: {EXAMPLE}")
def command() -> None:
    """Show, convert or compare the results of earlier validations.

    Results are the JSON file of `urdfkin validate --json FILE`, or the folder of `--store DIR`. `urdfkin
    report RESULTS` is short for `urdfkin report show RESULTS`.
    """


command.add_command(compare, "compare")
command.add_command(status, "status")
command.add_command(merge, "merge")


@command.command("show", epilog=f"Example: {EXAMPLE}")
@click.argument("results", metavar="RESULTS.json|DIR", type=click.Path(path_type=Path), required=False)
@click.option("--json", "json_", type=click.Path(path_type=Path), help="Write the report of a store as JSON.")
@report_options
@click.option("--schema", is_flag=True, help="Print the JSON Schema of the data and exit.")
@click.pass_context
def show(
    context: click.Context, /, results: Path | None, cases: bool, schema: bool, **files: Path | None
) -> None:
    """Show a report or convert it to HTML, JUnit or Markdown.

    A store has a report at any time. An incomplete store is reported as an interrupted run.

    The exit status is that of the run. 0: everything verified. 1: a disagreement. 2: a robot could not be
    read, or the file cannot be used. 3: a robot was not verified. 130: interrupted.
    """
    from urdfkin.report.reading import read_document, stored_document  # noqa: PLC0415
    from urdfkin.validation.document import VALIDATION, outcome_of  # noqa: PLC0415  keeps --help fast

    if schema:
        click.echo(VALIDATION.schema_text(), nl=False)
        return
    if results is None:
        raise click.UsageError("give the file of `urdfkin validate --json FILE`, or the folder of --store")
    document = stored_document(results) if is_folder(results) else read_document(results)
    check_writable(*files.values())
    failed = write_reports(document, files)
    if not failed:
        say_written(files)
    if not any(files.values()):
        from urdfkin.report.terminal import print_report  # noqa: PLC0415

        print_report(document, console(), cases=cases)
    context.exit(outcome_of(document).exit_code or failed)
