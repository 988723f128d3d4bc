"""`urdfkin info`: a robot's links, joints, limits and coordinates, as a table that shows the tree."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import click

from urdfkin.cli.arguments import forms, load_robot, robot_argument
from urdfkin.errors.display import ASCII, Table

if TYPE_CHECKING:
    from rich.console import Console

    from urdfkin.robot import Robot

EXAMPLE = "urdfkin info panda"


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@forms("table", "json")
def command(robot: str, format_: str) -> None:
    """Show a robot's links, joints, axes, limits, indices in q and v, and mimic rules.

    Joints are in the order of q, of v and of a Jacobian's columns, which is Pinocchio's order. A line reports
    it if the file has another order. Limits are in rad and rad/s; those of prismatic joints are in m and m/s.
    A link that is not indented is a child of the link above it. If a link has several children, lines lead
    to them.
    """
    loaded = load_robot(robot)
    if format_ == "json":
        from urdfkin.validation.robot_summary import describe  # noqa: PLC0415  keeps --help fast

        json.dump(describe(loaded), sys.stdout, indent=2, allow_nan=False)
        click.echo()
        return
    _print(loaded)


def _print(robot: Robot) -> None:
    """Print the robot's summary in tables that fit the terminal."""
    from urdfkin.cli.output import console  # noqa: PLC0415  json needs no tables

    out = console()
    sheet = robot._sheet()
    for part in (sheet.title, *sheet.parts):
        if isinstance(part, str):
            out.print(part)
        else:
            _print_table(out, part)


def _print_table(out: Console, table: Table) -> None:
    from urdfkin.model.summary import WORDS  # noqa: PLC0415
    from urdfkin.report.listing import fits, make_table, print_named  # noqa: PLC0415

    rows = [[str(cell) for cell in row] for row in table.rows]
    if out.options.ascii_only:
        rows = [[row[0].translate(ASCII), *row[1:]] for row in rows]
    if fits(out, table.heads, rows):
        out.print(make_table(table.heads, rows, left=WORDS))
    else:
        short = [(f"{link} by {joint}" if joint else link, *cells) for link, joint, *cells in rows]
        print_named(out, ("link by joint", *table.heads[2:]), short, left=[max(0, i - 1) for i in WORDS])
