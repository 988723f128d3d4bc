"""Define the options of `urdfkin dh`; `urdfkin.cli.dh_tables` computes, so that --help needs no NumPy."""

from __future__ import annotations

from typing import Any

import click

from urdfkin.cli.completion import complete_table
from urdfkin.cli.options import (
    FiniteNumber,
    Whole,
    load_robot,
    path_options,
    reject_unused_options,
    robot_argument,
    together,
    typed,
    verify_option,
)
from urdfkin.cli.output import Answer, answering, compiling

#: The formats are copied from `urdfkin.dh.export.FORMATS`, whose import would slow --help down.
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


def _choice(name: str, choices: tuple[str, ...], text: str) -> Any:
    return click.option(name, type=click.Choice(choices), default=choices[0], show_default=True, help=text)


def _columns(_context: click.Context, _option: click.Parameter, value: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in value.split(","))
    if sorted(names) != ["a", "alpha", "d", "theta"]:
        raise click.BadParameter(
            f"{value!r} is not the list of `a`, `alpha`, `d` and `theta` in any order, separated by commas"
        )
    return names


part_options = together(
    path_options,
    click.option(
        "--all", "all_", is_flag=True, help="Write a table from the base to each leaf link of the robot."
    ),
    click.option("--tree", is_flag=True, help="Write the Khalil-Kleinfinger parameters of the whole tree."),
)
choice_options = together(
    _choice(
        "--convention",
        ("standard", "modified"),
        "Denavit-Hartenberg convention: standard (distal) or modified (proximal, Craig's).",
    ),
    _choice(
        "--near-parallel",
        ("hayati", "strict"),
        "For nearly parallel joint axes, write five parameters (hayati) or four (strict).",
    ),
    click.option(
        "--snap",
        type=FiniteNumber(),
        default=0.0,
        metavar="RAD",
        help="Round the table's angles to multiples of 15 degrees if they are within this tolerance.",
    ),
    _choice(
        "--last",
        ("tip", "flange"),
        "End the table at the tip; or at the flange, so that the tool transform leads to the tip.",
    ),
    _choice(
        "--parallel-offset",
        ("last", "first", "each"),
        "For parallel axes: put the sum of the offsets along them into d of the last or of the first one,"
        " or each offset into its own row.",
    ),
    click.option(
        "--flip",
        multiple=True,
        metavar="JOINT",
        help="Reverse the positive direction of this joint; repeatable.",
    ),
    _choice(
        "--first",
        ("base", "joint"),
        "Place frame 0 at the base; or at the first joint as in Craig's book, so that d1 is zero.",
    ),
    _choice(
        "--sign",
        ("theta", "a", "alpha"),
        "Choose the direction of the x axes so that |theta| is smallest, or that a or alpha is not negative.",
    ),
    _choice(
        "--slide",
        ("drawn", "minimal"),
        "For a prismatic joint: use the axis in the URDF (drawn), or a parallel axis with a = 0 (minimal).",
    ),
    click.option(
        "--like",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Use the frames, joint directions and joint zeros of this published table.",
    ),
)
compare_options = together(
    click.option(
        "--compare",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Compare the URDF with a table: a file (as for ROBOT), or the name of a reference table.",
    ),
    click.option(
        "--tolerance",
        type=FiniteNumber(),
        default=0.2,
        show_default=True,
        metavar="MM",
        help="With --compare: largest allowed error of the tip in millimetres.",
    ),
    click.option(
        "--fit/--no-fit",
        default=True,
        help="With --compare: fit base, tool and joint offsets first (default).",
    ),
)
form_options = together(
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


#: The option --like replaces these options.
_SIGNS = ("last", "parallel_offset", "flip", "first", "sign")
_CHOICES = ("convention", "near_parallel", "snap", "slide", "like", *_SIGNS)
#: If ROBOT is a table, the command writes the table unchanged, unless the user gives one of these options.
#: With one of them, the command makes a robot from the table and derives a new table from this robot.
_DERIVED = ("base", "tip", "all_", *_CHOICES[1:])
_UNITS = ("degrees", "millimetres", "digits", "columns")


def _reject_unused(context: click.Context, is_table: bool, options: dict[str, Any]) -> None:
    compares, tree, form = options["compare"] is not None, options["tree"], options["format_"]
    written = ("terminal", "markdown", "html", "latex")
    for idle, where, because in (
        (("tolerance", "fit"), not compares, "without --compare"),
        ((*_CHOICES, "verify"), compares, "with --compare"),
        ((*_CHOICES, "base", "tip"), tree, "with --tree"),
        (("tip", "like"), options["all_"], "with --all"),
        (_SIGNS, options["like"] is not None, "with --like"),
        (("columns",), tree or compares, "unless the output is one table"),
        (_UNITS, form not in written, f"in the format {form!r}, which is exact, in metres and radians"),
        (("mimic", "root_joint", "xacro_arg"), is_table, "for a robot from a table"),
    ):
        if where:
            reject_unused_options(context, idle, because)


@click.command(epilog="Example: urdfkin dh ur5 --base base --tip tool0 --snap 1e-6 --degrees --millimetres")
@robot_argument
@part_options
@choice_options
@compare_options
@form_options
@verify_option
@answering(*FORMATS, suffixes=ENDINGS)
def command(robot: str, verify: bool, **options: Any) -> Answer:
    """Write the Denavit-Hartenberg table of the path between two frames. Pinocchio checks the table.

    The path may go down or up the tree of links, or first up and then down. The table has the file's angles
    and lengths, without rounding. --snap rounds angles, and prints a bound on the displacement of the tip.
    ROBOT is a path, a name that `urdfkin robots` lists, - for standard input, or a table (.toml, .json, .csv,
    .tsv, .md, .tex, .txt). If ROBOT is a table, the command writes the same table in the chosen convention.
    With an option that affects the rows, such as --tip or --snap, the command derives a new table of the same
    robot. See `urdfkin explain urdf-to-dh`.

    Exit 0: verified, or the compared table agrees. 1: the compared table differs, or a mistake in the table
    is hidden by the fitted base, tool and joint offsets. 2: bad input. 3: not checked, or the rounding error
    of a strict table is larger than that of the robot.
    """
    from urdfkin.cli.dh_tables import Work, run
    from urdfkin.dh.parse_table import is_table_file

    context, is_table = click.get_current_context(), is_table_file(robot)
    options["format_"] = context.params["format_"]
    _reject_unused(context, is_table, options)
    loaded = load_robot(robot, verify=verify)
    written = robot if is_table and not any(typed(context, name) for name in _DERIVED) else None
    if (written or options["like"]) and not typed(context, "convention"):
        options["convention"] = None
    with compiling():
        choices = {name: options.pop(name) for name in ("near_parallel", "slide", *_SIGNS)}
        return run(Work(robot=loaded, written=written, choices=choices, **options))
