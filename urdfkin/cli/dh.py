"""`urdfkin dh`: Denavit-Hartenberg tables, checked, compared, in every format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from urdfkin.cli.arguments import load_robot, path_options, robot_argument, together, verify_option
from urdfkin.cli.completing import complete_table
from urdfkin.cli.endings import form_of
from urdfkin.cli.idle import refuse_idle, typed
from urdfkin.cli.numbers import Number, Whole
from urdfkin.cli.output import compiling, output_option
from urdfkin.cli.reports import check_writable

#: Forms of a table. They repeat `urdfkin.dh.export.FORMATS`, whose import --help does not need.
FORMATS = (
    *("terminal", "markdown", "html", "latex", "csv", "json", "toml"),
    *("numpy", "sympy", "casadi", "matlab", "matlab-symbolic", "matlab-rst", "roboticstoolbox", "ets"),
    *("c", "urdf", "svg"),
)

ENDINGS = {
    ".txt": ("terminal",), ".md": ("markdown",), ".html": ("html",), ".tex": ("latex",), ".csv": ("csv",),
    ".json": ("json",), ".toml": ("toml",), ".py": ("numpy", "sympy", "casadi", "roboticstoolbox", "ets"),
    ".m": ("matlab", "matlab-symbolic", "matlab-rst"), ".c": ("c",), ".h": ("c",), ".urdf": ("urdf",),
    ".svg": ("svg",),
}  # fmt: skip

EXAMPLE = "urdfkin dh ur5 --base base --tip tool0 --snap 1e-6 --degrees --millimetres"


def _choice(name: str, choices: tuple[str, ...], text: str) -> Any:
    return click.option(name, type=click.Choice(choices), default=choices[0], show_default=True, help=text)


def _columns(_context: click.Context, _option: click.Parameter, value: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in value.split(","))
    if sorted(names) != ["a", "alpha", "d", "theta"]:
        raise click.BadParameter(f"{value!r} is not a, alpha, d and theta, each once, with commas between")
    return names


part_options = together(
    path_options,
    click.option("--all", "all_", is_flag=True, help="Write a table for each leaf of the robot."),
    click.option(
        "--tree", is_flag=True, help="Write Khalil and Kleinfinger's parameters of the whole robot."
    ),
)
choice_options = together(
    _choice(
        "--convention",
        ("standard", "modified"),
        "Standard (distal) or modified (proximal, Craig's) parameters.",
    ),
    _choice(
        "--near-parallel", ("hayati", "strict"), "Rows of nearly parallel axes: five parameters, or four."
    ),
    click.option(
        "--snap",
        type=Number(),
        default=0.0,
        metavar="RAD",
        help="Round angles within this tolerance to multiples of 15 degrees.",
    ),
    _choice("--last", ("tip", "flange"), "Whether the last row reaches the tip, or the tool holds the rest."),
    _choice(
        "--parallel-offset", ("last", "first", "each"), "The row that takes the offset along parallel axes."
    ),
    click.option("--flip", multiple=True, metavar="JOINT", help="Reverse the sense of a joint; repeatable."),
    _choice(
        "--first", ("base", "joint"), "Where frame 0 is: d1 holds the base's offset, or is zero (Craig's)."
    ),
    _choice(
        "--sign",
        ("theta", "a", "alpha"),
        "How to choose the direction of x: smallest theta, or a (alpha) not negative.",
    ),
    _choice(
        "--slide", ("drawn", "minimal"), "Axis lines of prismatic joints: the URDF's, or those with a = 0."
    ),
    click.option(
        "--like",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Write the URDF's numbers in the frames, senses and zeros of a published table.",
    ),
)
compare_options = together(
    click.option(
        "--compare",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Compare the URDF with a table: a file (as for ROBOT), or the name of a shipped one.",
    ),
    click.option(
        "--tolerance",
        type=Number(),
        default=0.2,
        show_default=True,
        metavar="MM",
        help="Tolerance of --compare at the tip, in millimetres.",
    ),
    click.option(
        "--fit/--no-fit", default=True, help="Fit base, tool and joint offsets in --compare (default)."
    ),
)
form_options = together(
    click.option(
        "--format",
        "format_",
        type=click.Choice(FORMATS),
        default="terminal",
        show_default=True,
        help="Output format; by default chosen by the suffix of the output file.",
    ),
    click.option("--degrees/--radians", default=False, help="Angle unit in printed tables."),
    click.option("--millimetres/--metres", default=False, help="Length unit in printed tables."),
    click.option(
        "--columns",
        metavar="NAMES",
        default="a,alpha,d,theta",
        show_default=True,
        callback=_columns,
        help="Order of the columns in printed tables.",
    ),
    click.option(
        "--digits",
        type=Whole(3, 17),
        default=10,
        show_default=True,
        help="Significant digits in printed tables.",
    ),
)


#: What --like has decided.
_SIGNS = ("last", "parallel_offset", "flip", "first", "sign")
_CHOICES = ("convention", "near_parallel", "snap", "slide", "like", *_SIGNS)
#: What a table that is a robot has to be derived for; without, it is written as it stands.
_DERIVED = ("base", "tip", "all_", *_CHOICES[1:])
_UNITS = ("degrees", "millimetres", "digits", "columns")


def _refuse_idle(context: click.Context, is_table: bool, options: dict[str, Any]) -> None:
    """Which options do nothing beside which others."""
    compares, tree, form = options["compare"] is not None, options["tree"], options["format_"]
    written = ("terminal", "markdown") if tree or compares else ("terminal", "markdown", "html", "latex")
    for idle, where, because in (
        (("tolerance", "fit"), not compares, "without --compare"),
        ((*_CHOICES, "verify"), compares, "with --compare"),
        ((*_CHOICES, "base", "tip"), tree, "with --tree"),
        (("tip", "like"), options["all_"], "with --all"),
        (_SIGNS, options["like"] is not None, "with --like"),
        (("columns",), tree or compares, "but in the form of one table"),
        (
            _UNITS,
            form not in written,
            f"in the form {form!r}, which is in metres and radians, to the last digit",
        ),
        (("mimic", "root_joint", "xacro_arg"), is_table, "for a robot that is a table"),
    ):
        if where:
            refuse_idle(context, idle, because)


@click.command(epilog=f"Example: {EXAMPLE}")
@robot_argument
@part_options
@choice_options
@compare_options
@form_options
@verify_option
@output_option
@click.pass_context
def command(context: click.Context, /, robot: str, verify: bool, output: Path | None, **options: Any) -> None:
    """Write the Denavit-Hartenberg table of the path between two frames, exact to rounding and checked.

    The path may run down the tree, up, or through the common ancestor. Angles and lengths are the file's.
    --snap rounds angles; the table then states by how much the tip moves at most.
    ROBOT is a path, a name that `urdfkin robots` lists, - for standard input, or a table (.toml, .json, .csv,
    .tsv, .md, .tex, .txt). A table is written as it stands, in the convention asked for. Options that choose
    rows derive it anew from the robot that it describes. `urdfkin explain urdf-to-dh` says more.

    Exit 0: verified, or the compared table agrees. 1: the compared table differs, or agrees only while base,
    tool and zeros absorb a mistake that is printed. 2: bad input. 3: not checked, or a strict table that
    loses more to rounding than the robot itself.
    """
    from urdfkin.cli.dh_work import Work, run  # noqa: PLC0415  keeps --help fast
    from urdfkin.dh.read import is_table_file  # noqa: PLC0415

    is_table = is_table_file(robot)
    options["format_"] = form_of(context, output, ENDINGS, "terminal")
    _refuse_idle(context, is_table, options)
    check_writable(output)
    loaded = load_robot(robot, verify=verify)
    written = robot if is_table and not any(typed(context, name) for name in _DERIVED) else None
    if (written or options["like"]) and not typed(context, "convention"):
        options["convention"] = None
    with compiling():
        choices = {name: options.pop(name) for name in ("near_parallel", "slide", *_SIGNS)}
        code = run(Work(robot=loaded, written=written, choices=choices, output=output, **options))
    context.exit(code)
