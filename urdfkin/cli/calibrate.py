"""`urdfkin calibrate`: fit a robot's parameters to measured poses, and write the calibrated file."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from urdfkin.cli.options import (
    FILE,
    convention_of_input_option,
    find_conversion,
    load_robot,
    path_options,
    reject_unused_options,
    robot_argument,
)
from urdfkin.cli.output import (
    TEXT_FORMATS,
    Answer,
    certificate_exit_code,
    check_writable,
    format_check_line,
    format_option,
    report_compilation,
)
from urdfkin.cli.streams import say
from urdfkin.errors import InputError
from urdfkin.errors.display import TextDocument
from urdfkin.errors.escape import json_text
from urdfkin.system.files import write_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    from urdfkin.calibration.calibrate import Calibration, ImplausibleError
    from urdfkin.calibration.write_back import UpdatedURDF
    from urdfkin.dh.table import DHTable
    from urdfkin.robot import Robot

_FORMATS = (*TEXT_FORMATS, "json")


@click.command(epilog="Example: urdfkin calibrate ur5 --tip tool0 --fit base,tool,origins")
@robot_argument
@click.option(
    "--poses", type=FILE, help="File of measured poses, CSV or .npz; docs/calibration.md describes it."
)
@convention_of_input_option
@click.option("--ur", type=FILE, help="Factory calibration of a Universal Robots arm (YAML).")
@click.option(
    "--order",
    type=click.Choice(["driver", "urdf"]),
    default="driver",
    help="With --ur: rotation of roll, pitch and yaw in the file. driver: Rx(roll) Ry(pitch) Rz(yaw). urdf:"
    " Rz(yaw) Ry(pitch) Rx(roll), as in a URDF.",
)
@path_options
@click.option(
    "--fit",
    default="origins",
    metavar="SETS",
    help="Parameters to fit, separated by commas: `base`, `tool`, `offsets`, `origins`, `gains`.",
)
@click.option(
    "--positions",
    is_flag=True,
    help="Without --poses: assume that only positions are measured, not orientations.",
)
@click.option(
    "--noise",
    metavar="M,RAD",
    help="Standard deviations of measured positions (m) and orientations (rad).",
    show_default="estimated from the poses",
)
@click.option(
    "--unit",
    type=click.Choice(["m", "mm"]),
    default="m",
    help="Unit of measured positions.",
)
@click.option("--drop-outliers", is_flag=True, help="Exclude outlier poses from the fit.")
@click.option("--radians", is_flag=True, help="Read joint angles as radians, even if they look like degrees.")
@click.option(
    "--all",
    "write_all",
    is_flag=True,
    help="Write all fitted parameters. By default, only changes of more than 2 sigma are written.",
)
@click.option("--force", is_flag=True, help="Write the calibration even if urdfkin finds it implausible.")
@format_option(*_FORMATS, help_="Output format of the report.")
@click.option(
    "--output",
    "-o",
    type=FILE,
    help="Write the calibrated URDF or table (TOML) to this file.",
)
@click.pass_context
def calibrate_command(
    context: click.Context,
    /,
    robot: str,
    ur: Path | None,
    order: str,
    format_: str,
    output: Path | None,
    **_: Any,
) -> None:
    """Fit the parameters of ROBOT to measured poses, and write a calibrated file.

    The new URDF differs from the URDF of ROBOT only in the fitted numbers. Pinocchio checks the new URDF at
    the measured configurations, or with --ur at random configurations.

    If ROBOT is the file of a Denavit-Hartenberg table, the command fits the numbers of the table. Pinocchio
    checks the new table in the zero configuration.

    Without --poses and --ur, the command lists the parameters that are identifiable in principle.

    The command refuses a calibration that is not plausible, and prints the likeliest cause. Possible causes
    are joint angles in degrees, a joint with the wrong sign, or joint values that belong to another pose.
    With --force, the command writes the calibration nevertheless. If the joint values look like degrees,
    --radians is also needed.

    Exit 0: verified, or only a list of parameters. 1: Pinocchio disagrees. 2: bad input. 3: not checked, or
    refused.
    """
    from urdfkin.report.calibration import as_data, displacement_table, document
    from urdfkin.report.diff import lines_of

    check_writable(output)
    sources = [name for name in ("poses", "ur") if context.params[name] is not None]
    if len(sources) > 1:
        raise InputError("--poses and --ur cannot be used together", remedy="leave out one of them")
    _reject_unused(context, sources)
    loaded = load_robot(robot)
    calibration, written = None, None
    with report_compilation():
        if ur is not None:
            _check_suffix(output, is_table=False)
            written = _factory_calibration(loaded, ur, order)
        else:
            calibration = _fit(context, loaded)
            written = calibration.updated_urdf
    data = {} if calibration is None else as_data(calibration)
    data |= {"origins": {joint: T.tolist() for joint, T in written.origins.items()}} if written else {}
    report = TextDocument("") if calibration is None else document(calibration)
    parts = list(report.parts)

    def write_answer(check: str = "", code: int = 0) -> NoReturn:
        whole = TextDocument(report.title, parts)
        # The JSON is passed to `Answer` as text, because `Answer` would add the keys `verified` and `check`
        # to a mapping.
        Answer(lambda: whole, {"json": lambda: json_text(data) + "\n"}, check, code).write(format_, _FORMATS)
        context.exit(code)

    if written is None or (calibration is not None and calibration.full_fit is None):
        write_answer()
    if calibration is not None and calibration.plausibility.objections:
        is_refused = calibration.plausibility.is_in_degrees or not context.params["force"]
        word = "error" if is_refused else "warning"
        say(f"urdfkin: {word}: {_implausible(calibration, is_refused)}", err=True)
        if is_refused:
            write_answer(code=3)
    if written.origins:
        parts.append(displacement_table(written))
    if output is not None:
        table = None if calibration is None else calibration.table
        write_file(output, written.text if table is None else _as_toml(table))
        if table is None:
            parts += lines_of(replace(written.changes, sources=(loaded.source, str(output))))
    certificate = written.certificate if calibration is None else calibration.certificate
    if certificate is None:
        write_answer()
    write_answer(format_check_line(certificate), certificate_exit_code(certificate))


def _implausible(calibration: Calibration, is_refused: bool) -> ImplausibleError:
    from urdfkin.calibration.calibrate import ImplausibleError

    if not is_refused:
        return ImplausibleError(calibration, None)
    if calibration.plausibility.is_in_degrees:
        return ImplausibleError(calibration, "if these values are radians, add --radians")
    return ImplausibleError(calibration, "to write this calibration anyway, add --force")


def _reject_unused(context: click.Context, sources: list[str]) -> None:
    measured = ("convention", "noise", "drop_outliers", "unit", "radians", "write_all", "force")
    for unused, where, because in (
        (measured, sources != ["poses"], "without --poses"),
        (("order",), sources != ["ur"], "without --ur"),
        (("positions",), sources == ["poses"], "with --poses"),
        (("positions", "fit", "tip", "base"), sources == ["ur"], "with --ur"),
        (("output",), not sources, "without --poses and --ur"),
    ):
        if where:
            reject_unused_options(context, unused, because)


def _fit(context: click.Context, robot: Robot) -> Calibration:
    from urdfkin.calibration.calibrate import fit_model, read_poses
    from urdfkin.dh.parse_table import is_table_file, read_table_or_screws
    from urdfkin.dh.table import DHTable
    from urdfkin.robot.trajectory import column_units

    options = context.params
    tip, base = options["tip"], options["base"]
    table = read_table_or_screws(options["robot"]) if is_table_file(options["robot"]) else None
    source = table if isinstance(table, DHTable) else robot
    _check_suffix(options["output"], is_table=source is not robot)
    if source is not robot:
        # The fit uses the table itself, not the robot made from it, so options that change the robot are
        # rejected.
        unused = "mimic", "root_joint", "lock", "joints", "convention"
        reject_unused_options(context, unused, "for a table")
    path = robot.chain(tip, base)
    names: Sequence[str] = path.joint_names if source is robot else source.joint_names
    conversion = find_conversion(robot, options["convention"])
    coordinates, neutral = (robot.coordinate_names, robot.neutral()) if source is robot else (names, None)
    if conversion is not None:
        coordinates, neutral = conversion.coordinate_names, conversion.to(robot.neutral())
        # In some conventions, a mimic joint has its own coordinate, which must agree with the mimicked
        # joint's coordinate.
        mimics = [j.name for j in robot.tree.joints if j.mimic and j.mimic.mimicked_joint in names]
        indices = conversion.q_and_v_indices
        names = [coordinates[i] for name in (*names, *mimics) if name in indices for i in indices[name][0]]
    units = column_units(robot, "q", conversion)
    q, T = (
        read_poses(options["poses"], coordinates, names, options["unit"], units, neutral)
        if options["poses"]
        else (None, None)
    )
    if conversion is not None and q is not None:
        q = conversion.from_(q)
    with warnings.catch_warnings():
        # These warnings were already shown when the robot was loaded.
        warnings.simplefilter("ignore")
        return fit_model(
            source,
            q,
            T,
            tip=tip,
            base=base,
            fit=[name.strip() for name in options["fit"].split(",")],
            noise=_noise(options["noise"]),
            drop_outliers=options["drop_outliers"],
            full_poses=not options["positions"],
            radians=options["radians"],
            write_all=options["write_all"],
        )


def _check_suffix(output: Path | None, *, is_table: bool) -> None:
    """Raise InputError for a wrong suffix, because the written file could not be read again."""
    suffix = "" if output is None else output.suffix.lower()
    if is_table and suffix not in ("", ".toml"):
        raise InputError("--output writes a table as TOML", where=str(output), remedy="use the suffix .toml")
    if not is_table and suffix == ".toml":
        raise InputError("--output writes a URDF", where=str(output), remedy="use the suffix .urdf")


def _noise(text: str | None) -> tuple[float, float] | None:
    from urdfkin.robot.trajectory import parse_numbers

    if text is None:
        return None
    metres, radians = parse_numbers(text.split(","), "--noise", ["metres", "radians"])
    return metres, radians


def _factory_calibration(robot: Robot, path: Path, order: str) -> UpdatedURDF:
    from urdfkin.calibration.universal_robots import (
        ROTATION_ORDERS,
        apply_factory_calibration,
        largest_tip_displacement,
        read_calibrated_origins,
    )
    from urdfkin.comparison.result import angle, length

    metres, radians = largest_tip_displacement(
        *(read_calibrated_origins(path, one) for one in ROTATION_ORDERS)
    )
    say(
        f"using --order {order}; the other --order changes the tool's pose by up to"
        f" {length(metres)} and {angle(radians)} (docs/calibration.md)",
        err=True,
    )
    return apply_factory_calibration(robot, path, order)


def _as_toml(table: DHTable) -> bytes:
    from urdfkin.dh.export import export

    return export(table, "toml").encode()
