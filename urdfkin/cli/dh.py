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
    click.option("--all", "all_", is_flag=True, help="A table for each leaf of the robot."),
    click.option("--tree", is_flag=True, help="Khalil and Kleinfinger's parameters of the whole robot."),
)
choice_options = together(
    _choice("--convention", ("standard", "modified"), "Distal (the text's), or proximal (Craig's)."),
    _choice("--near-parallel", ("hayati", "strict"), "Nearly parallel axes: a fifth parameter, or four."),
    click.option(
        "--snap",
        type=Number(),
        default=0.0,
        metavar="RAD",
        help="Make angles within this of a multiple of 15 degrees round.",
    ),
    _choice("--last", ("tip", "flange"), "Whether the last row takes the tip where it can."),
    _choice("--parallel-offset", ("last", "first", "each"), "The row of parallel axes with the offset."),
    click.option("--flip", multiple=True, metavar="JOINT", help="Count a joint the other way; repeatable."),
    _choice("--first", ("base", "joint"), "Whether d1 holds the base's offset, or is zero as Craig's."),
    _choice(
        "--sign", ("theta", "a", "alpha"), "What the direction of x keeps small, or from being negative."
    ),
    _choice("--slide", ("drawn", "minimal"), "Lines of sliding joints: the URDF's, or those with a = 0."),
    click.option(
        "--like",
        metavar="TABLE",
        shell_complete=complete_table,
        help="The URDF's numbers in the frames, senses and zeros of a published table (as for --compare).",
    ),
)
compare_options = together(
    click.option(
        "--compare",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Hold the URDF against a table: a file (as for ROBOT), or the name of a shipped one.",
    ),
    click.option(
        "--tolerance",
        type=Number(),
        default=0.2,
        show_default=True,
        metavar="MM",
        help="Millimetres at the tip up to which --compare agrees.",
    ),
    click.option(
        "--fit/--no-fit", default=True, help="Whether --compare fits base, tool and joint offsets (default)."
    ),
)
form_options = together(
    click.option(
        "--format",
        "format_",
        type=click.Choice(FORMATS),
        default="terminal",
        show_default=True,
        help="Form; a file's ending says it, too.",
    ),
    click.option("--degrees/--radians", default=False, help="Angles in what people read."),
    click.option("--millimetres/--metres", default=False, help="Lengths in what people read."),
    click.option(
        "--columns",
        metavar="NAMES",
        default="a,alpha,d,theta",
        show_default=True,
        callback=_columns,
        help="Their order, in what people read.",
    ),
    click.option("--digits", type=Whole(3, 17), default=10, show_default=True, help="Significant."),
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
    """Denavit-Hartenberg table of the path between two frames, exact to rounding and checked.

    The path may run down the tree, up, or through the common ancestor. Angles and lengths stay as the file
    has them unless --snap makes angles round; the table then says by how much the tip moves at most.
    ROBOT is a path, a name that `urdfkin robots` lists, - for standard input, or a table (.toml, .json, .csv,
    .tsv, .md, .tex, .txt), which is written as it stands, in the convention asked for; options that choose
    rows have it derived anew, from the robot that it describes. `urdfkin explain urdf-to-dh` says more.

    Exit 0: verified, or the compared table agrees. 1: a disagreement. 2: bad input. 3: not checked, or a
    strict table that loses more to rounding than the robot itself.
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
