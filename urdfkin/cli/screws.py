"""`urdfkin screws`: the product of exponentials of a path, checked, as text and code."""

from __future__ import annotations

from pathlib import Path

import click

from urdfkin.cli.arguments import load_robot, path_options, robot_argument, verify_option
from urdfkin.cli.numbers import Whole
from urdfkin.cli.output import end_of_path, output_option, write_file

FORMS = ("terminal", "latex", "toml", "json", "numpy", "matlab")


@click.command(epilog="Example: urdfkin screws ur5 --tip tool0")
@robot_argument
@path_options
@click.option(
    "--format", "format_", type=click.Choice(FORMS), default="terminal", show_default=True, help="Form."
)
@click.option("--digits", type=Whole(3, 17), default=10, show_default=True, help="Significant.")
@verify_option
@output_option
@click.pass_context
def command(
    context: click.Context,
    robot: str,
    base: str | None,
    tip: str | None,
    format_: str,
    digits: int,
    verify: bool,
    output: Path | None,
) -> None:
    """Home pose M and a screw for each joint, in space and body, as Lynch and Park have them.

    Screws are (w, v), angular first; code has them as columns, Slist and Blist. A file that is written as
    toml or json is a robot for every command, and so is one with M and space, or body, written by hand.

    Exit 0: verified. 1: a disagreement. 2: bad input. 3: not checked.
    """
    from urdfkin.cli.door import say, say_file  # noqa: PLC0415  keeps --help fast
    from urdfkin.dh.export.screws import write_screws  # noqa: PLC0415
    from urdfkin.verify.screws import check_screws  # noqa: PLC0415

    loaded = load_robot(robot, verify=verify)
    screws = loaded.screws(tip, base, verify=False)
    said = check_screws(loaded.verifier, screws) if verify else None
    line, code = end_of_path(said)
    text = write_screws(screws, format_, digits)
    text = f"{text}\n{line}\n" if format_ == "terminal" else text
    if output is not None:
        write_file(output, text.encode())
    elif format_ == "terminal":
        for one in text.splitlines():
            say(one)
    else:
        say_file(text)
    if format_ != "terminal":
        say(line, err=True)
    context.exit(code)
