"""`urdfkin report`: make a report from the JSON data of an earlier run, or from a campaign's store."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.output import console
from urdfkin.cli.report_options import check_writable, report_options, say_written, write_reports
from urdfkin.system.files import is_folder

EXAMPLE = "urdfkin report results.json --html report.html --junit report.xml"


@click.command(epilog=f"Example: {EXAMPLE}")
@click.argument("results", metavar="RESULTS.json|DIR", type=click.Path(path_type=Path), required=False)
@click.option("--json", "json_", type=click.Path(path_type=Path), help="Write the report of a store as JSON.")
@report_options
@click.option("--schema", is_flag=True, help="Print the JSON Schema of the data and exit.")
@click.pass_context
def command(
    context: click.Context, /, results: Path | None, cases: bool, schema: bool, **files: Path | None
) -> None:
    """Show or write the report of an earlier validation, from its JSON data or its store.

    A store has a report at any time. An incomplete store is reported as an interrupted run.

    The exit status is that of the run. 0: everything verified. 1: a disagreement. 2: a robot could not be
    read, or the file cannot be used. 3: a robot was not verified. 130: interrupted.
    """
    from urdfkin.report.document import asset, outcome_of  # noqa: PLC0415  keeps --help fast
    from urdfkin.report.reading import read_document, stored_document  # noqa: PLC0415

    if schema:
        click.echo(asset("validation-1.schema.json"), nl=False)
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
