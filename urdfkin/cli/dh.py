"""Define the command `urdfkin dh` and its options.

The module `dh_tables` makes the tables with NumPy. Importing NumPy here would slow --help down.
"""

from __future__ import annotations

from typing import Any

import click

from urdfkin.cli.options import (
    FiniteNumber,
    NumberInRange,
    combine,
    digits_option,
    is_on_command_line,
    load_robot,
    path_options,
    reject_unused_options,
    robot_argument,
    verify_option,
)
from urdfkin.cli.output import Answer, answer_command, report_compilation
from urdfkin.cli.shell import complete_table

#: Copy of `urdfkin.dh.export.FORMATS`, plus `urdf` and `svg`. The formats are copied, because an import of
#: `urdfkin.dh.export` would slow `--help` down.
FORMATS = (
    *("terminal", "markdown", "html", "latex", "csv", "json", "toml"),
    *("numpy", "sympy", "casadi", "matlab", "matlab-symbolic", "matlab-rst", "roboticstoolbox", "ets"),
    *("c", "urdf", "svg"),
)

_SUFFIXES = {
    ".txt": ("terminal",), ".md": ("markdown",), ".html": ("html",), ".tex": ("latex",), ".csv": ("csv",),
    ".json": ("json",), ".toml": ("toml",), ".py": ("numpy", "sympy", "casadi", "roboticstoolbox", "ets"),
    ".m": ("matlab", "matlab-symbolic", "matlab-rst"), ".c": ("c",), ".h": ("c",), ".urdf": ("urdf",),
    ".svg": ("svg",),
}  # fmt: skip


def _choice(name: str, choices: tuple[str, ...], help_: str) -> Any:
    return click.option(name, type=click.Choice(choices), default=choices[0], help=help_)


def _columns(_context: click.Context, _option: click.Parameter, value: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in value.split(","))
    if sorted(names) != ["a", "alpha", "d", "theta"]:
        raise click.BadParameter(
            f"{value!r} must be the names `a`, `alpha`, `d` and `theta` in any order, separated by commas"
        )
    return names


path_or_tree_options = combine(
    path_options,
    click.option(
        "--all", "all_", is_flag=True, help="Write a table from the base to each leaf link of the robot."
    ),
    click.option(
        "--tree", is_flag=True, help="Write the Khalil-Kleinfinger parameters of the whole tree of links."
    ),
)
derivation_options = combine(
    _choice(
        "--convention",
        ("standard", "modified"),
        "Denavit-Hartenberg convention: standard (distal) or modified (proximal, Craig's).",
    ),
    _choice(
        "--near-parallel",
        ("hayati", "strict"),
        "Parameters for nearly parallel joint axes. hayati: five parameters, including the angle beta."
        " strict: four parameters, with possibly very large offsets.",
    ),
    click.option(
        "--snap",
        type=FiniteNumber(),
        default=0.0,
        metavar="RAD",
        help="Largest change (rad) of an angle that is rounded to a multiple of 15 degrees.",
    ),
    _choice(
        "--last",
        ("tip", "flange"),
        "Position of the last frame. tip: at the tip. flange: at the flange; a tool transform leads to the"
        " tip.",
    ),
    _choice(
        "--parallel-offset",
        ("last", "first", "each"),
        "Rows with the offsets d of consecutive parallel axes. last: the last row contains their sum."
        " first: the first row contains their sum. each: each row contains its own link's offset.",
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
        "Position of frame 0. base: at the base. joint: at the first joint as in Craig's book; d1 is zero.",
    ),
    _choice(
        "--sign",
        ("theta", "a", "alpha"),
        "Rule for the direction of each x axis. theta: |theta| is at most 90 degrees."
        " a: the length a is not negative. alpha: the angle alpha is not negative.",
    ),
    _choice(
        "--slide",
        ("drawn", "minimal"),
        "Position of a prismatic joint's axis. drawn: as in the URDF. minimal: through the origin of the"
        " next or previous revolute joint; the length a is 0.",
    ),
    click.option(
        "--like",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Use the frames, joint directions and joint zeros of this published table.",
    ),
)
compare_options = combine(
    click.option(
        "--compare",
        metavar="TABLE",
        shell_complete=complete_table,
        help="Compare ROBOT with this table: a file, or a reference table's name such as ur5.",
    ),
    click.option(
        "--tolerance",
        type=NumberInRange(min=0),
        default=0.2,
        metavar="MM",
        help="With --compare: largest allowed error of the tip in millimetres.",
    ),
    click.option(
        "--fit/--no-fit",
        default=True,
        help="With --compare: first fit the table's base, tool, joint offsets and joint signs.",
    ),
)
form_options = combine(
    click.option("--degrees/--radians", default=False, help="Angle unit in printed tables."),
    click.option("--millimetres/--metres", default=False, help="Length unit in printed tables."),
    click.option(
        "--columns",
        metavar="NAMES",
        default="a,alpha,d,theta",
        callback=_columns,
        help="Order of the columns in printed tables.",
    ),
    digits_option,
)


#: Options that cannot be combined with `--like`, because the published table determines their values.
_OPTIONS_FIXED_BY_LIKE = ("last", "parallel_offset", "flip", "first", "sign")
_DERIVATION_OPTIONS = ("convention", "near_parallel", "snap", "slide", "like", *_OPTIONS_FIXED_BY_LIKE)
#: If ROBOT is a Denavit-Hartenberg table, only these options make the command derive a new table.
_NEW_TABLE_OPTIONS = ("base", "tip", "all_", "lock", "joints", *_DERIVATION_OPTIONS[1:])
_PRINTED_TABLE_OPTIONS = ("degrees", "millimetres", "digits", "columns")


def _reject_unused(context: click.Context, is_table: bool, options: dict[str, Any]) -> None:
    compares, tree, form = options["compare"] is not None, options["tree"], options["format_"]
    printed = ("terminal", "markdown", "html", "latex")
    for unused, where, because in (
        (("tolerance", "fit"), not compares, "without --compare"),
        ((*_DERIVATION_OPTIONS, "verify"), compares, "with --compare"),
        ((*_DERIVATION_OPTIONS, "base", "tip"), tree, "with --tree"),
        (("tip", "like"), options["all_"], "with --all"),
        (_OPTIONS_FIXED_BY_LIKE, options["like"] is not None, "with --like"),
        (("columns",), tree or compares, "unless the output is one table"),
        (
            _PRINTED_TABLE_OPTIONS,
            form not in printed,
            f"in the format {form!r}: its numbers are in metres and radians",
        ),
        (("mimic", "root_joint", "xacro_arg"), is_table, "for a robot from a table"),
    ):
        if where:
            reject_unused_options(context, unused, because)


@click.command(epilog="Example: urdfkin dh ur5 --base base --tip tool0 --snap 1e-6 --degrees --millimetres")
@robot_argument
@path_or_tree_options
@derivation_options
@compare_options
@form_options
@verify_option
@answer_command(*FORMATS, suffixes=_SUFFIXES)
def dh_command(robot: str, verify: bool, **options: Any) -> Answer:
    """Write the Denavit-Hartenberg table of the path between two frames. Pinocchio checks the table.

    The path may go down or up the tree of links, or first up and then down. The table has the file's angles
    and lengths, without rounding. The option --snap rounds angles, and prints a bound on the displacement of
    the tip.

    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input. ROBOT can also be a table
    (.toml, .json, .csv, .tsv, .md, .tex, .txt). The command then writes the same table in the chosen
    convention. An option that affects the rows, such as --tip or --snap, makes the command derive a new
    table. See `urdfkin explain urdf-to-dh`.

    Exit 0: verified, or the compared table agrees. 1: Pinocchio disagrees, or the compared table differs or
    contains a likely mistake. 2: bad input. 3: not checked, or a strict table has a larger rounding error
    than the robot.
    """
    from urdfkin.cli.dh_tables import DHRequest, make_dh_answer
    from urdfkin.dh.parse_table import is_table_file

    context, is_table = click.get_current_context(), is_table_file(robot)
    options["format_"] = context.params["format_"]
    _reject_unused(context, is_table, options)
    loaded = load_robot(robot, verify=verify)
    unchanged_table = (
        robot
        if is_table and not any(is_on_command_line(context, name) for name in _NEW_TABLE_OPTIONS)
        else None
    )
    if (unchanged_table or options["like"]) and not is_on_command_line(context, "convention"):
        options["convention"] = None
    with report_compilation():
        dh_arguments = {
            name: options.pop(name) for name in ("near_parallel", "slide", *_OPTIONS_FIXED_BY_LIKE)
        }
        return make_dh_answer(
            DHRequest(robot=loaded, unchanged_table=unchanged_table, dh_arguments=dh_arguments, **options)
        )
