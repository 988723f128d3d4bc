"""Command-line interface; the module of a command is imported only when the command is used.

The summaries of commands are in this module or in `verify/quantities.py`, so that `urdfkin --help` needs
neither NumPy nor Pinocchio.
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
from urdfkin.cli.exit import run
from urdfkin.cli.streams import wrap_streams
from urdfkin.errors import UnknownNameError, UrdfkinError
from urdfkin.verify.quantities import quantities_by_command

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

#: Maps each heading of the help page to the commands below it. Each command has a module in `urdfkin.cli` and
#: a summary. The command is the function `NAME_command` of its module; `make_command` makes the commands of
#: quantities.
_COMPUTE_HEADING = "Compute"
_COMMANDS_BY_HEADING: dict[str, dict[str, tuple[str, str]]] = {
    "Look at a robot": {
        "robots": ("robots", "List the robots of the catalogue, which are loaded by name."),
        "info": ("robots", "Show the whole robot: links, joints, limits, frames and coordinates."),
        "order": ("robots", "Show the order of the joints in MuJoCo, Drake, Isaac Lab and more."),
        "view": ("view", "Show a robot in a browser, with a slider for each joint and verified results."),
        "plot": ("view", "Plot a frame's motion along a trajectory."),
    },
    _COMPUTE_HEADING: {
        "analytical-jacobian": (
            "quantity",
            "Compute the analytical Jacobian: derivatives of a frame's position and angles.",
        ),
        "singular-values": (
            "quantity",
            "Compute a Jacobian's singular values and manipulability; explain a singularity.",
        ),
        "imu": ("quantity", "Compute the readings of an accelerometer and a gyroscope on a frame."),
    },
    "Tables and code": {
        "dh": ("dh", "Derive Denavit-Hartenberg tables, or compare a published table with a robot."),
        "screws": (
            "paths",
            "Compute a path's product of exponentials: pose at q = 0, and joint screws.",
        ),
        "chain": ("paths", "Show the joint axes on the path between two frames."),
        "structure": ("paths", "Classify the arm along a path: wrist, parallel axes, closed-form solvers."),
        "export": ("export", "Export verified kinematics as code in C, Python, MATLAB and other languages."),
    },
    "Compare and calibrate": {
        "same": ("models", "Prove that two robot models move alike, or bound the distances of their frames."),
        "diff": (
            "models",
            "List the changes between two versions of a robot file and their effect on motion.",
        ),
        "calibrate": (
            "calibrate",
            "Fit a robot's parameters to measured poses, and write a calibrated URDF.",
        ),
    },
    "Validate against Pinocchio": {
        "validate": (
            "validate",
            "Compare all frames and joints with Pinocchio at many random configurations.",
        ),
        "verify": (
            "verify",
            "Compare the results of your function or program with those of urdfkin and Pinocchio.",
        ),
        "readers": (
            "models",
            "Compare how MuJoCo, yourdfpy and other installed libraries read a robot file.",
        ),
        "vectors": (
            "export",
            "Write test vectors for other programs: robots, and results computed at 50 digits.",
        ),
        "report": ("reports", "Show, convert, compare or merge the results of validations."),
    },
    "Check files": {
        "check": ("check", "Lint URDF files; every finding has a code, a line and a remedy."),
        "explain": ("explain", "Explain the code of a finding, an equation, or a common question."),
    },
    "Shell": {
        "completion": ("shell", "Print a completion script for bash, zsh or fish."),
        "warm": ("shell", "Compile all kernels in advance, for container images and CI."),
    },
}


def commands_by_heading() -> dict[str, dict[str, tuple[str, str]]]:
    rows = {
        name: ("quantity", f"Compute the {row.summary}.") for name, row in quantities_by_command().items()
    }
    return _COMMANDS_BY_HEADING | {_COMPUTE_HEADING: rows | _COMMANDS_BY_HEADING[_COMPUTE_HEADING]}


def commands() -> dict[str, tuple[str, str]]:
    return {name: entry for entries in commands_by_heading().values() for name, entry in entries.items()}


def _invert_table(table: dict[str, str]) -> dict[str, str]:
    """Invert a table: `{"info": "show tree"}` becomes `{"show": "info", "tree": "info"}`."""
    return {word: key for key, words in table.items() for word in words.split()}


#: Suggested commands for words that are not commands.
#: For example, urdfkin suggests `placement` for the word "fk".
_SYNONYMS = _invert_table(
    {
        "--help": "help usage man",
        "--version": "version",
        "placement": "fk forward forward-kinematics pose transform tf",
        "placement --relative-to FRAME": "relative-placement relative-pose",
        "placement --as rpy or --as quaternion": "rpy quaternion",
        "jacobian": "jac j geometric-jacobian",
        "jacobian-rate": "jdot jacobian-dot jacobian-derivative",
        "velocity": "twist vel",
        "acceleration": "acc accel",
        "acceleration --breakdown": "breakdown acceleration-breakdown coriolis",
        "singular-values": "svd manipulability condition singularity singularities",
        "dh": "dh-table dh-parameters denavit-hartenberg table mdh",
        "screws": "poe product-of-exponentials twists",
        "info": "show joints links frames limits summary tree",
        "view": "visualize visualise viewer display gui",
        "`report compare` (reports), `same` (models) or `diff` (versions of a file)": "compare comparison",
        "report status": "campaign status progress",
        "report merge": "merge",
        "check": "lint validate-urdf check-urdf",
        "validate": "test",
        "export": "codegen generate",
        "calibrate": "identify fit calibration",
        "same": "equal equivalent",
        "robots": "list catalogue catalog",
    }
)
#: Advice for computations that urdfkin lacks, for example "ik".
_ADVICE_BY_WORD = _invert_table(
    {
        "urdfkin has no inverse kinematics; `structure` names closed-form solvers for an arm. For an"
        " iterative solver, `placement` computes the pose, and `jacobian` computes the Jacobian":
            "ik inverse inverse-kinematics solve",
        "urdfkin does not compute dynamics; use Pinocchio (`robot.pinocchio_model()` in Python)":
            "dynamics rnea inertia torque mass-matrix",
        "urdfkin does not check collisions; use Pinocchio": "collision",
    }
)  # fmt: skip


def _unknown_command(name: str) -> UrdfkinError:
    word = name.lower().replace("_", "-")
    if word in commands():
        return UnknownNameError("command", name, [word])
    error = UnknownNameError("command", name, commands())
    if (advice := _ADVICE_BY_WORD.get(word)) is not None:
        error.remedy, error.nearest = advice, ()
    elif (command := _SYNONYMS.get(word)) is not None:
        error.remedy, error.nearest = f"did you mean {command}?", (command,)
    return error


class LazyGroup(click.Group):
    """A command group that imports the module of a command only when the command is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(commands())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in commands():
            return None
        module_name, _ = commands()[cmd_name]
        module = importlib.import_module(f"urdfkin.cli.{module_name}")
        command = getattr(module, f"{cmd_name.replace('-', '_')}_command", None)
        return cast("click.Command", command or module.make_command(quantities_by_command()[cmd_name]))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in commands() and not args[0].startswith("-"):
            # During shell completion, an unknown command is not an error.
            if ctx.resilient_parsing:
                return None, None, args
            raise _unknown_command(args[0])
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        """Return the commands and options that begin with `incomplete`, without importing a command."""
        from click.shell_completion import CompletionItem

        names = [
            CompletionItem(name, help=summary)
            for name, (_, summary) in commands().items()
            if name.startswith(incomplete)
        ]
        return names + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, commands()))
        for heading, entries in commands_by_heading().items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), summary) for name, (_, summary) in entries.items()])


def _version(ctx: click.Context, _option: click.Parameter, wanted: bool) -> None:
    if not wanted:
        return
    from urdfkin.system.lazy_import import urdfkin_version
    from urdfkin.verify.pinocchio import pinocchio, version

    click.echo(f"urdfkin {urdfkin_version()}, Pinocchio {version()}")
    # If Pinocchio is not installed, this call raises an error.
    pinocchio()
    ctx.exit()


@click.group(
    cls=LazyGroup,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": 100,
        "show_default": True,
    },
)
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
    help="Show the versions of urdfkin and Pinocchio and exit.",
)  # fmt: skip
def cli() -> None:
    """Textbook kinematics of URDF robots, with results checked against Pinocchio.

    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input. `urdfkin COMMAND --help`
    shows the options of a command, and an example.
    """


def main() -> None:
    streams.prepare_streams()
    wrap_streams()
    # For small matrices, OpenBLAS is fastest with one thread.
    # OpenBLAS reads this variable when NumPy is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # An error message would disturb shell completion.
    if os.environ.get("_URDFKIN_COMPLETE"):
        sys.stderr = io.StringIO()
    # The warning "not verified" is hidden, because the last line of the output says the same.
    warnings.filterwarnings("ignore", message="not verified")
    sys.exit(run(cli, "urdfkin"))
