"""Implement `urdfkin dh`: write, check, compare and export Denavit-Hartenberg tables."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from urdfkin.cli.arguments import load_robot, path_options, robot_argument, together, verify_option
from urdfkin.cli.completion_items import complete_table
from urdfkin.cli.options import Number, Whole, format_from_suffix, reject_unused_options, typed
from urdfkin.cli.output import compiling, output_option, write_file
from urdfkin.cli.report_options import check_writable
from urdfkin.cli.streams import say, say_file
from urdfkin.dh import DHTable, Units, export, read_table, to_convention
from urdfkin.dh.compare import (
    CellDifference,
    CommonMistake,
    Comparison,
    Mistake,
    compare,
    comparison_text,
    convention_that_fits,
    diagnose,
)
from urdfkin.dh.convert import to_urdf
from urdfkin.dh.export.data import to_mapping
from urdfkin.dh.parse_table import read_mapping, read_table_or_screws, table_of
from urdfkin.dh.printed import printed, printed_tree
from urdfkin.dh.references import published, reference_path
from urdfkin.dh.rows import last_digits
from urdfkin.dh.snapping import snap_hint
from urdfkin.dh.tree_parameters import as_mapping, tree_parameters, write_tree
from urdfkin.dh.units import Angles, Lengths
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.system.files import at_home
from urdfkin.verify.pinocchio_module import version
from urdfkin.verify.sampling import draw
from urdfkin.verify.tables import TableCheck
from urdfkin.verify.verifier import TABLE_SAMPLES

#: Formats that can contain several tables.
_FORMATS_OF_SEVERAL = ("terminal", "markdown", "latex", "json")
#: Formats with the check's result below the table; for the others it goes to stderr.
_PRINTED = ("terminal", "markdown")
#: Formats that round numbers, with their digits of base and tool (None: the option --digits).
_ROUNDED = {"terminal": None, "markdown": None, "latex": 6}


@dataclass(frozen=True, slots=True)
class Work:
    """The command's options.

    Attributes:
        written: File of a table that is the robot and is written without a derivation; None otherwise.
        choices: Other arguments of `Robot.dh`.
    """

    robot: Robot
    written: str | None
    choices: dict[str, Any]
    output: Path | None
    base: str | None
    tip: str | None
    all_: bool
    tree: bool
    convention: str | None
    snap: float
    like: str | None
    compare: str | None
    tolerance: float
    fit: bool
    format_: str
    degrees: bool
    millimetres: bool
    digits: int
    columns: tuple[str, ...]

    @property
    def units(self) -> Units:
        """Number format of the options."""
        return Units(
            Angles.DEGREES if self.degrees else Angles.RADIANS,
            Lengths.MILLIMETRES if self.millimetres else Lengths.METRES,
            self.digits,
            self.columns,
        )


def run(work: Work) -> int:
    """Run the command and return its exit code."""
    chosen = [
        name for name, on in (("--all", work.all_), ("--tree", work.tree), ("--compare", work.compare)) if on
    ]
    if len(chosen) > 1:
        raise InputError(f"{' and '.join(chosen)} cannot be used together", remedy="use one at a time")
    if work.compare is not None:
        return _compare(work, work.compare)
    if work.tree:
        return _tree(work)
    return _tables(work)


# -- tables --------------------------------------------------------------------------------------------


def _tables(work: Work) -> int:
    tips = _tips(work)
    if len(tips) > 1 and work.format_ not in _FORMATS_OF_SEVERAL:
        raise InputError(
            f"--all does not support the format {work.format_!r}",
            remedy=f"use --format {', '.join(_FORMATS_OF_SEVERAL)}",
        )
    made = [_table(work, tip) for tip in tips]
    if work.format_ == "json" and work.all_:
        text = json.dumps([_document(table, check) for table, check in made], indent=2) + "\n"
    elif work.format_ == "json":
        text = json.dumps(_document(*made[0]), indent=2) + "\n"
    else:
        text = "\n".join(_format_table(work, table, check) for table, check in made)
    _write_output(work, text)
    if work.format_ not in (*_PRINTED, "json"):
        for table, check in made:
            for line in _notes(work, table, check).split("\n"):
                say(line, err=True)
    return 0 if all(check is not None and check.within for _, check in made) else 3


def _tips(work: Work) -> list[str | None]:
    tree = work.robot.tree
    return [tree.links[leaf] for leaf in tree.leaves()] if work.all_ else [work.tip]


def _table(work: Work, tip: str | None) -> tuple[DHTable, TableCheck | None]:
    robot, table = work.robot, _make_table(work, tip, work.snap)
    return table, robot.verifier.table(table) if robot.verifier.policy else None


def _make_table(work: Work, tip: str | None, snap: float) -> DHTable:
    robot, base = work.robot, work.base
    if work.written is not None:
        table = read_table_or_screws(at_home(work.written))
        if isinstance(table, DHTable):  # a table is derived from screws as from a URDF
            return to_convention(table, work.convention or table.convention)
    like = None
    if work.like is not None:
        like = read_table(reference_path(work.like))
        tip, base = (
            tip or _frame_of_robot(work, like.tip_frame),
            base or _frame_of_robot(work, like.base_frame),
        )
    if base is None and work.all_:
        base = robot.tree.links[1 if robot.tree.links[0] == "universe" else 0]
    return robot.dh(
        tip,
        base,
        work.convention or (like.convention if like else "standard"),
        snap=snap,
        like=like,
        verify=False,
        **work.choices,
    )


def _format_table(work: Work, table: DHTable, check: TableCheck | None) -> str:
    if work.format_ == "urdf":
        return to_urdf(table)
    if work.format_ == "svg":
        from urdfkin.view.dh_drawing import drawing  # noqa: PLC0415  needs an extra

        return drawing(table)
    text = export(table, work.format_, work.units)
    return f"{text}\n{_notes(work, table, check)}\n" if work.format_ in _PRINTED else text


def _notes(work: Work, table: DHTable, check: TableCheck | None) -> str:
    """Return the lines under a table: the check, the error of the printed digits, and hints."""
    lines = [check_line(check)]
    if work.format_ in _ROUNDED:
        lines.append(str(printed(table, work.units, _ROUNDED[work.format_])))
    if work.written is None and (
        hint := snap_hint(table, lambda snap: _make_table(work, table.tip_frame, snap))
    ):
        lines.append(f"hint: {hint}")
    if work.like is None and work.format_ in _PRINTED:
        lines += [f"hint: {line}" for line in published(work.robot.origin.source)]
    return "\n".join(lines)


def _document(table: DHTable, check: TableCheck | None) -> dict[str, Any]:
    return {**to_mapping(table), "checked": check_line(check)}


def check_line(check: TableCheck | None) -> str:
    """Return one line with the result of Pinocchio's check."""
    if check is None:
        return f"NOT VERIFIED by Pinocchio {version()}"
    return f"Pinocchio {version()}: {check}"


# -- the whole tree ------------------------------------------------------------------------------------


def _tree(work: Work) -> int:
    parameters = tree_parameters(work.robot.tree)
    if work.format_ == "json":
        text = json.dumps(as_mapping(parameters), indent=2, allow_nan=False) + "\n"
    elif work.format_ in ("terminal", "markdown", "csv"):
        text = write_tree(parameters, work.format_, work.units)
    else:
        raise InputError(
            f"--tree does not support the format {work.format_!r}",
            remedy="use terminal, markdown, csv or json",
        )
    check = work.robot.verifier.tree_parameters(parameters) if work.robot.verifier.policy else None
    if work.format_ in _PRINTED:
        text += f"\n{check or check_line(None)}\n"
        q = draw(work.robot.tree, TABLE_SAMPLES, np.random.default_rng(1), with_special=True).q
        text += f"{printed_tree(parameters, work.units, q)}\n"
    else:
        say(str(check or check_line(None)), err=True)
    _write_output(work, text)
    return 0 if check is not None else 3


# -- a comparison --------------------------------------------------------------------------------------


def _compare(work: Work, name: str) -> int:
    if work.format_ not in ("terminal", "json"):
        raise InputError(
            f"--compare does not support the format {work.format_!r}", remedy="use terminal or json"
        )
    path = reference_path(name)
    data = read_mapping(path)
    tip = work.tip or _frame_of_robot(work, data.get("tip_frame"))
    base = work.base or _frame_of_robot(work, data.get("base_frame"))
    chain, tolerance = work.robot.chain(tip, base), work.tolerance / 1e3
    note = ""
    if "convention" not in data:
        convention = convention_that_fits(chain, data, tolerance, str(path))
        data = {**data, "convention": convention}
        note = f"The table names no convention; {convention} fits best. Write the convention into it.\n"
    try:
        reference = table_of(data, str(path))
    except InputError as error:
        if slip := diagnose(chain, data, tolerance):
            error.remedy = f"{error.remedy}; {slip}" if error.remedy else str(slip)
        raise
    found = compare(chain, reference, tolerance, fit=work.fit, digits=last_digits(data))
    slip = None if found.agrees or found.mistakes else diagnose(chain, data, tolerance, found.metres)
    if work.format_ == "json":
        text = json.dumps(_comparison(found, reference, slip), indent=2, allow_nan=False) + "\n"
    else:
        text = note + comparison_text(found, work.units) + (f"\nhint: {slip}\n" if slip else "")
    _write_output(work, text)
    return 0 if found.passes else 1


def _frame_of_robot(work: Work, name: object) -> str | None:
    """Return the name of a table's base or tip frame if the robot has a frame of that name."""
    return name if isinstance(name, str) and name in work.robot.frame_names else None


def _comparison(found: Comparison, reference: DHTable, slip: CommonMistake | None) -> dict[str, Any]:
    return {
        "passes": found.passes,
        "agrees": found.agrees,
        "exact": found.exact,
        "read_as": str(reference.convention),
        "tip_off_at_most_m": found.metres,
        "tip_turned_at_most_rad": found.radians,
        "proven_tip_off_at_most_m": found.most_metres,
        "proven_tip_turned_at_most_rad": found.most_radians,
        "as_written_tip_off_at_most_m": found.written_metres,
        "as_written_tip_turned_at_most_rad": found.written_radians,
        "base_took_up": {"metres": found.base.metres, "radians": found.base.radians},
        "tool_took_up": {"metres": found.tool.metres, "radians": found.tool.radians},
        "residual_m": found.residual,
        "samples": found.samples,
        "senses": list(found.senses),
        "offsets": list(found.offsets),
        "not_compared": [{"row": row + 1, "cell": cell} for row, cell in found.hidden],
        "differences": [_difference(one) for one in found.differences],
        "likely_mistakes": [_mistake(one) for one in found.mistakes],
        "would_fit_read_as": slip and slip.as_mapping(),
        "without_fitting": [_difference(one) for one in found.instead],
        "fitted": to_mapping(found.reference),
    }


def _difference(one: CellDifference) -> dict[str, Any]:
    return {
        "row": one.row + 1,
        "joint": one.joint,
        "cell": one.cell,
        "table": one.reference,
        "urdf": one.urdf,
        "tip_m": one.tip,
        "within_last_digit": one.is_rounding,
    }


def _mistake(one: Mistake) -> dict[str, Any]:
    return {
        "kind": str(one.kind),
        "rows": [row + 1 for row in one.rows],
        "cell": one.cell and _difference(one.cell),
        "still_fitted": asdict(one.fitted),
        "tip_off_at_most_m": one.metres,
        "tip_turned_at_most_rad": one.radians,
    }


def _write_output(work: Work, text: str) -> None:
    if work.output is not None:
        write_file(work.output, text.encode())
    elif work.format_ in _PRINTED:
        click.echo(text, nl=False)
    else:
        say_file(text)


#: Formats of a table. They repeat `urdfkin.dh.export.FORMATS`, so that --help need not import that module.
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
        raise click.BadParameter(f"{value!r} is not a, alpha, d and theta, each once, separated by commas")
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
    _choice(
        "--last", ("tip", "flange"), "Whether the last row reaches the tip, or the tool contains the rest."
    ),
    _choice(
        "--parallel-offset", ("last", "first", "each"), "The row that takes the offset along parallel axes."
    ),
    click.option("--flip", multiple=True, metavar="JOINT", help="Reverse the sense of a joint; repeatable."),
    _choice(
        "--first",
        ("base", "joint"),
        "Position of frame 0: d1 contains the base's offset, or is zero (Craig's).",
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
        help="Compare the URDF with a table: a file (as for ROBOT), or the name of a reference table.",
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


#: Options that --like decides.
_SIGNS = ("last", "parallel_offset", "flip", "first", "sign")
_CHOICES = ("convention", "near_parallel", "snap", "slide", "like", *_SIGNS)
#: Options that need a new derivation of a table that is the robot; without them it is written unchanged.
_DERIVED = ("base", "tip", "all_", *_CHOICES[1:])
_UNITS = ("degrees", "millimetres", "digits", "columns")


def _reject_unused(context: click.Context, is_table: bool, options: dict[str, Any]) -> None:
    """Reject options that have no effect together with other options."""
    compares, tree, form = options["compare"] is not None, options["tree"], options["format_"]
    written = ("terminal", "markdown") if tree or compares else ("terminal", "markdown", "html", "latex")
    for idle, where, because in (
        (("tolerance", "fit"), not compares, "without --compare"),
        ((*_CHOICES, "verify"), compares, "with --compare"),
        ((*_CHOICES, "base", "tip"), tree, "with --tree"),
        (("tip", "like"), options["all_"], "with --all"),
        (_SIGNS, options["like"] is not None, "with --like"),
        (("columns",), tree or compares, "except for one table"),
        (
            _UNITS,
            form not in written,
            f"in the format {form!r}, which is exact, in metres and radians",
        ),
        (("mimic", "root_joint", "xacro_arg"), is_table, "for a robot from a table"),
    ):
        if where:
            reject_unused_options(context, idle, because)


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

    The path may lead down the tree, up, or through the common ancestor. Angles and lengths are the file's.
    --snap rounds angles; the table then states a bound of the tip's motion.
    ROBOT is a path, a name that `urdfkin robots` lists, - for standard input, or a table (.toml, .json, .csv,
    .tsv, .md, .tex, .txt). A table is written with its own numbers, in the chosen convention. Options that
    choose rows derive a new table from the robot that it describes. See `urdfkin explain urdf-to-dh`.

    Exit 0: verified, or the compared table agrees. 1: the compared table differs, or agrees only because
    base, tool and zeros absorb a mistake, which is printed. 2: bad input. 3: not checked, or a strict table
    that loses more to rounding than the robot itself.
    """
    from urdfkin.dh.parse_table import is_table_file  # noqa: PLC0415

    is_table = is_table_file(robot)
    options["format_"] = format_from_suffix(context, output, ENDINGS, "terminal")
    _reject_unused(context, is_table, options)
    check_writable(output)
    loaded = load_robot(robot, verify=verify)
    written = robot if is_table and not any(typed(context, name) for name in _DERIVED) else None
    if (written or options["like"]) and not typed(context, "convention"):
        options["convention"] = None
    with compiling():
        choices = {name: options.pop(name) for name in ("near_parallel", "slide", *_SIGNS)}
        code = run(Work(robot=loaded, written=written, choices=choices, output=output, **options))
    context.exit(code)
