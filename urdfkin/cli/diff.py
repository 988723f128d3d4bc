"""`urdfkin diff`: list the changes between two versions of a robot description."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import forms, load_two, xacro_option
from urdfkin.cli.completion_items import complete_robot
from urdfkin.cli.output import compiling, console, write_file
from urdfkin.cli.report_options import check_writable
from urdfkin.cli.streams import say_file
from urdfkin.errors.escape import json_text

EXAMPLE = "urdfkin diff arm.urdf my.urdf --markdown comment.md"


@click.command(epilog=f"Example: {EXAMPLE}")
@click.argument("a", metavar="OLD", shell_complete=complete_robot)
@click.argument("b", metavar="NEW", shell_complete=complete_robot)
@click.option("--effects/--no-effects", default=True, help="Bound how far the changes move frames (default).")
@forms("table", "json")
@click.option(
    "--markdown",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write Markdown for a pull request's comment.",
)
@xacro_option
@click.pass_context
def command(
    context: click.Context, a: str, b: str, effects: bool, format_: str, markdown: Path | None
) -> None:
    """List the changes from OLD to NEW, attribute by attribute, and how far they move the robot's frames.

    For each changed joint, the command prints how far its changes alone move the most affected frame. This is
    the maximum over all configurations within limits, at equal coordinates. The last line is for all changes
    together.

    Exit 0: no changes. 1: changes. 2: bad input.
    """
    from urdfkin.comparison.diff import diff  # noqa: PLC0415
    from urdfkin.report.diff import as_data, markdown_of, print_changes  # noqa: PLC0415  keeps --help fast

    check_writable(markdown)
    old, new = load_two(a, b)
    with compiling():
        found = diff(old, new, effects=effects)
    if markdown is not None:
        write_file(markdown, markdown_of(found).encode())
    if format_ == "json":
        say_file(json_text(as_data(found)) + "\n")
    else:
        print_changes(found, console())
    context.exit(1 if found else 0)
