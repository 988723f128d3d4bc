"""The command line: one file a command, loaded only when it is called.

`urdfkin --help` imports neither numpy nor Pinocchio: the summaries stand here, the commands in their files.
"""

from __future__ import annotations

import importlib
import io
import os
import sys
import warnings
from typing import TYPE_CHECKING, cast

import click

from urdfkin.cli import streams
from urdfkin.cli.crash import run
from urdfkin.cli.door import guard
from urdfkin.errors import UnknownNameError
from urdfkin.verify.quantities import by_command

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

#: Command name -> (module that holds `command`, one-line summary), in the order of the help page, before and
#: after the commands that compute a quantity.
_BEFORE: dict[str, tuple[str, str]] = {
    "robots": ("urdfkin.cli.robots", "robots that can be called by a short name"),
    "info": ("urdfkin.cli.info", "joints, limits, frames and coordinates of a robot"),
}
_AFTER: dict[str, tuple[str, str]] = {
    "analytical-jacobian": (
        "urdfkin.cli.analytical_jacobian",
        "derivatives of a frame's position and orientation angles",
    ),
    "imu": ("urdfkin.cli.imu", "what an accelerometer and a gyroscope in a frame read"),
    "manipulability": (
        "urdfkin.cli.manipulability",
        "singular values of a Jacobian between bounds; their product",
    ),
    "chain": ("urdfkin.cli.chain", "the joint axes between two frames: where they stand and how they point"),
    "dh": ("urdfkin.cli.dh", "Denavit-Hartenberg tables, checked, compared, in many forms"),
    "diff": ("urdfkin.cli.diff", "what changed between two versions of a description, and what that moves"),
    "calibrate": ("urdfkin.cli.calibrate", "a robot's numbers from measured poses, in its own text"),
    "same": ("urdfkin.cli.same", "whether two models are the same robot, proven"),
    "export": ("urdfkin.cli.export", "kinematics as code in many languages, with its proof"),
    "screws": ("urdfkin.cli.screws", "product of exponentials: home pose and screws, checked"),
    "structure": ("urdfkin.cli.structure", "what kind of arm it is, and what can be solved in closed form"),
    "validate": ("urdfkin.cli.validate", "compare everything with Pinocchio on many samples"),
    "campaign": ("urdfkin.cli.campaign", "validations kept in a folder: how far they are, merged"),
    "check": ("urdfkin.cli.check", "check URDFs like a linter: coded findings, each with its place"),
    "explain": ("urdfkin.cli.explain", "what a finding's code means, an equation, or a question"),
    "report": ("urdfkin.cli.report", "show or write the report of an earlier validation"),
    "plot": ("urdfkin.cli.plot", "a frame's motion along a trajectory, as a picture"),
    "view": ("urdfkin.cli.view", "a robot in a browser tab, with sliders and arrows"),
    "completion": ("urdfkin.cli.completion", "makes bash, zsh or fish complete names as they are typed"),
    "warm": ("urdfkin.cli.warm", "compile everything now: for container images and CI"),
    "compare": ("urdfkin.cli.compare", "what changed between two validations"),
}
#: The module that makes a command of a row of the quantities' table; rows whose command has more to it.
_QUANTITY, _OWN = "urdfkin.cli.quantity", {"placement": "urdfkin.cli.placement"}


def commands() -> dict[str, tuple[str, str]]:
    """Every command's module and summary."""
    rows = by_command().items()
    return _BEFORE | {name: (_OWN.get(name, _QUANTITY), row.summary) for name, row in rows} | _AFTER


class LazyGroup(click.Group):
    """A group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the table, which is the order of the work."""
        return list(commands())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command's file."""
        if (found := commands().get(cmd_name)) is None:
            return None
        module = importlib.import_module(found[0])
        made = module.command_of(by_command()[cmd_name]) if found[0] == _QUANTITY else module.command
        return cast("click.Command", made)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does, but an unknown command offers the nearest ones."""
        if args and args[0] not in commands() and not args[0].startswith("-"):
            if ctx.resilient_parsing:  # a shell wants to complete something
                return None, None, args
            raise UnknownNameError("command", args[0], commands())
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        """Commands with their summaries, without importing them; options."""
        from click.shell_completion import CompletionItem  # noqa: PLC0415  only when a key is pressed

        found = [(name, summary) for name, (_, summary) in commands().items() if name.startswith(incomplete)]
        names = [CompletionItem(name, help=summary) for name, summary in found]
        return names + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The table of commands, from the summaries alone."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, summary) in commands().items()])


def _version(ctx: click.Context, _option: click.Parameter, wanted: bool) -> None:
    if not wanted:
        return
    from urdfkin.system.versions import own_version  # noqa: PLC0415
    from urdfkin.verify.pinocchio_module import pinocchio, version  # noqa: PLC0415

    click.echo(f"urdfkin {own_version()}, Pinocchio {version()}")
    pinocchio()  # says why there is none, and what cures it
    ctx.exit()


@click.group(
    cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
    help="Show the versions of urdfkin and Pinocchio and exit.",
)  # fmt: skip
def cli() -> None:
    """Textbook kinematics from any URDF, every number checked against Pinocchio."""


def main() -> None:
    """Entry point of the `urdfkin` command.

    Exit 0: verified. 1: a disagreement. 2: bad input or usage. 3: computed, but Pinocchio did not check it.
    70: a defect of urdfkin. 128 and its number: ended by a signal.
    """
    streams.prepare()
    guard()
    # The matrices are small here: a thread for each processor costs more than it brings. NumPy's OpenBLAS
    # reads this when it is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if os.environ.get("_URDFKIN_COMPLETE"):  # while a key is pressed, nothing that fails is worth a line
        sys.stderr = io.StringIO()
    # The line under a result says that it was not verified, and why; once is enough.
    warnings.filterwarnings("ignore", message="not verified")
    sys.exit(run(cli, "urdfkin"))
