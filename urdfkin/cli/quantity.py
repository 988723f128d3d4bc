"""Define the commands that compute a quantity of a frame, such as `urdfkin jacobian`.

`make_command` uses the quantities in `verify/quantities.py`.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from urdfkin.cli.options import (
    Inputs,
    NumberInRange,
    a_option,
    base_motion_options,
    combine,
    convention_option,
    find_conversion,
    frame_name_option,
    frame_option,
    load_robot,
    lock_settings,
    oracle_option,
    print_trajectory_notes,
    q_option,
    read_inputs,
    reference_option,
    reject_unused_options,
    robot_argument,
    seed_option,
    trajectory_option,
    v_option,
    verify_option,
    warn_of_limits,
    with_base_motion,
)
from urdfkin.cli.output import (
    TEXT_FORMATS,
    Answer,
    answer_command,
    certificate_exit_code,
    format_check_line,
    report_compilation,
)
from urdfkin.errors.display import Table, TextDocument, format_number, noise_limit
from urdfkin.errors.escape import csv_cell
from urdfkin.verify.quantities import (
    ACCELERATION_BREAKDOWN,
    ANALYTICAL_JACOBIAN,
    IMU,
    PLACEMENT,
    SIX_VECTOR_LABELS,
    Quantity,
    format_replay_command,
)

if TYPE_CHECKING:
    from urdfkin.compiled.breakdown import AccelerationBreakdown
    from urdfkin.model.conventions import Conversion
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot
    from urdfkin.verify.singular_values import SingularValues

_F = TypeVar("_F", bound=Callable[..., Any])
_JOINT_VALUE_OPTIONS = {"q": q_option, "v": v_option, "a": a_option}
_BASE_MOTION_OPTION_NAMES = ("base_placement", "base_velocity", "base_acceleration")
_trajectory_option = trajectory_option(
    "Read q, v and a from this file instead of --q, --v and --a. CSV output has one row for each time."
)
_MAX_SAMPLES = 5


def quantity_options(inputs: str, *own: Any, last: tuple[Any, ...] = ()) -> Callable[[_F], _F]:
    values = (_JOINT_VALUE_OPTIONS[letter] for letter in inputs)
    return combine(
        *(robot_argument, frame_option, *own, convention_option, *values, _trajectory_option),
        *(base_motion_options(inputs), seed_option, verify_option, oracle_option(), *last),
        answer_command(*TEXT_FORMATS, "json", "csv", "npy"),
    )


def _read_options() -> Inputs:
    options = click.get_current_context().params
    values: dict[str, Any] = {letter: options[letter] for letter in "qva" if letter in options}
    robot = load_robot(options["robot"], verify=options["verify"], oracle=options.get("oracle", "pinocchio"))
    conversion = find_conversion(robot, options["convention"])
    if options["trajectory"] is not None:
        inputs = _read_trajectory(robot, options["frame"], options["trajectory"], "".join(values), conversion)
    else:
        inputs = read_inputs(robot, options["frame"], options["seed"], **values, conversion=conversion)
    return with_base_motion(inputs, *map(options.get, _BASE_MOTION_OPTION_NAMES))


def _read_trajectory(
    robot: Robot, frame: str | None, path: Path, letters: str, conversion: Conversion | None
) -> Inputs:
    import numpy as np

    from urdfkin.robot.trajectory import complete_rates, read_samples

    context = click.get_current_context()
    reject_unused_options(context, ("q", "v", "a", "seed"), "along a --trajectory")
    x = read_samples(robot, path, conversion)
    settings = lock_settings(robot)
    if x.base is not None:
        reject_unused_options(context, _BASE_MOTION_OPTION_NAMES, "along a --trajectory with a moving base")
        arrays = x.base.placement, x.base.velocity, x.base.acceleration
        settings |= {name: y.tolist() for name, y in zip(_BASE_MOTION_OPTION_NAMES, arrays, strict=True)}
    q, t, rates = x.q, x.t, {letter: getattr(x, letter) for letter in letters[1:]}
    if any(value is None for value in rates.values()):
        motion = complete_rates(robot.tree, x)
        q, t, rates = motion.q, motion.t, {letter: getattr(motion, letter) for letter in letters[1:]}
        settings["derivatives"] = motion.rates_source
        print_trajectory_notes(motion)
    warn_of_limits(robot, q)
    v, a = (rates.get(letter, np.zeros((len(q), robot.nv))) for letter in "va")
    frame = robot.tip_frame if frame is None else frame
    return Inputs(robot, frame, q, v, a, t, x.base, settings, conversion, is_trajectory=True)


def _verified_answer(
    x: Inputs, title: str, parts: Callable[[], Iterable[str | Table]], **data: Any
) -> Answer:
    certificate = x.robot.certificate()
    check = format_check_line(certificate)
    if x.conversion is not None:
        check += f", before the conversion to {x.conversion.convention.name}"
    return Answer(
        lambda: TextDocument(f"{x.robot.name}: {title}", list(parts())),
        data,
        check,
        certificate_exit_code(certificate),
    )


def _format_samples(
    x: Inputs, max_samples: int, other_formats: str, make_parts: Callable[[int], Iterable[str | Table]]
) -> Iterator[str | Table]:
    n = len(x.q)
    for k in range(min(n, max_samples)):
        if n > 1:
            yield f"sample {k}" if x.t is None else f"t = {x.t[k]:.6g} s"
        yield from make_parts(k)
    if n > max_samples:
        yield f"... and {n - max_samples} more samples: --format {other_formats} writes all"


_ROBOT_HELP = (
    "ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input. The path may also lead to"
    " a Denavit-Hartenberg table: .toml, .json, .csv, .tsv, .md, .tex or .txt."
)
_breakdown_option = click.option(
    "--breakdown",
    is_flag=True,
    help="Split the acceleration by joint and by term, such as Coriolis.",
)


def make_command(quantity: Quantity) -> click.Command:
    has_breakdown = ACCELERATION_BREAKDOWN.command == f"{quantity.command} --breakdown"

    own = [reference_option] if quantity.has_reference else []

    @quantity_options(quantity.inputs, *own, last=(_breakdown_option,) if has_breakdown else ())
    def compute(*, reference: str = "local_world_aligned", breakdown: bool = False, **_: Any) -> Answer:
        if breakdown:
            reject_unused_options(click.get_current_context(), ("convention",), "with --breakdown")
        x = _read_options()
        with report_compilation():
            if breakdown:
                terms = x.robot.acceleration_breakdown(x.q, x.v, x.a, x.frame, reference, base=x.base)
                return _breakdown_answer(x, reference, terms)
            inputs = [getattr(x, letter) for letter in quantity.inputs]
            result = x.robot.compute(quantity.name, inputs, x.frame, reference, base=x.base)
            if x.conversion is not None:
                J = partial(x.robot.jacobian, x.q, x.frame, reference, base=x.base)
                result = x.conversion.convert_result(quantity.name, (x.q, x.v), result, J)
        return _answer(x, quantity, result, reference if quantity.has_reference else None)

    summary = f"{quantity.summary[0].upper()}{quantity.summary[1:]} (eq. {', '.join(quantity.equations)})."
    compute.__doc__ = f"{summary}\n\n{quantity.help_text}\n\n{_ROBOT_HELP}"
    return click.command(quantity.command, epilog=f"Example: {quantity.example}")(compute)


# -- the result of a quantity ------------------------------------------------------------------------


def _answer(x: Inputs, quantity: Quantity, result: FloatArray, reference: str | None = None) -> Answer:
    x = x.convert_to_given_convention()
    if x.conversion and x.conversion.angular_first and quantity.labels == SIX_VECTOR_LABELS:
        units = dict(reversed(list(quantity.units.items())))
        quantity = replace(quantity, labels=(*SIX_VECTOR_LABELS[3:], *SIX_VECTOR_LABELS[:3]), units=units)
    settings = [
        f"{name.replace('_', ' ')} {word}" for name, word in x.settings.items() if isinstance(word, str)
    ]
    base = ["moving base"] if x.base is not None else []
    where = "".join(f", {word}" for word in [*([reference] if reference else []), *settings, *base])
    return _verified_answer(
        x,
        f"{quantity.name} of {x.frame}{where}",
        lambda: _format_samples(
            x, _MAX_SAMPLES, "csv, json or npy", lambda k: [_table(x, quantity, result[k])]
        ),
        json=lambda: _data(x, quantity, reference, result),
        csv=lambda: _rows(x, quantity, result),
        npy=lambda: result,
    )


def _data(x: Inputs, quantity: Quantity, reference: str | None, result: FloatArray) -> dict[str, Any]:
    about = {"quantity": quantity.name, "frame": x.frame, "reference": reference}
    rows = list(quantity.labels) or None
    return _metadata(x, quantity.inputs, **about, rows=rows) | {"result": result.tolist()}


def _metadata(x: Inputs, letters: str, **about: Any) -> dict[str, Any]:
    times = {} if x.t is None else {"t": x.t.tolist()}
    return {
        "robot": x.robot.name,
        "source": x.robot.source,
        "path": x.robot.path,
        "sha256": x.robot.sha256,
        "urdfkin": x.robot.certificate().urdfkin,
        **about,
        "coordinates": list(x.coordinate_names),
        "rates": list(x.velocity_names),
        **times,
        **{letter: getattr(x, letter).tolist() for letter in letters},
        **x.settings,
    }


def _rows(x: Inputs, quantity: Quantity, result: FloatArray) -> Iterator[list[object]]:
    if quantity.has_columns and not x.is_trajectory:
        rates = [csv_cell(name) for name in x.velocity_names]
        # In the CSV of a Hessian, each line contains the derivatives of one Jacobian entry.
        keys = [[row] for row in quantity.labels]
        for _ in range(2, quantity.ndim):
            keys = [[*key, rate] for key in keys for rate in rates]
        yield ["sample", "row", *["column"] * (quantity.ndim - 2), *rates]
        for k, J in enumerate(result.reshape(len(result), len(keys), len(rates)).tolist()):
            yield from ([k, *key, *map(repr, row)] for key, row in zip(keys, J, strict=True))
    else:
        names = list(quantity.labels) or [f"T{i}{j}" for i in range(4) for j in range(4)]
        if quantity.has_columns:
            several = product(names, *[x.velocity_names] * (quantity.ndim - 1))
            names = [csv_cell(" ".join(words)) for words in several]
        yield [_SAMPLE_HEADINGS[x.t is not None], *names]
        samples = zip(_sample_cells(x), result.reshape(len(result), -1).tolist(), strict=True)
        yield from ([t, *map(repr, row)] for t, row in samples)


#: Headings of the first column of CSV output, for samples without times and with times.
_SAMPLE_HEADINGS = ("sample", "t")


def _sample_cells(x: Inputs) -> Iterable[object]:
    return range(len(x.q)) if x.t is None else map(repr, x.t.tolist())


def _table(x: Inputs, quantity: Quantity, value: FloatArray) -> Table:
    if quantity.has_columns:
        return _jacobian_column_table(quantity, x.velocity_names, value)
    if not quantity.units:
        relative_to = x.settings.get("relative_to", "the world")
        heads = (f"axis of {relative_to}", "x of frame", "y of frame", "z of frame", "position [m]")
        return Table(heads, [(axis, *row) for axis, row in zip("xyz", value[:3].tolist(), strict=True)])
    # A table with the columns x, y and z needs three numbers in each row. A pose with a quaternion has seven
    # numbers, so it becomes a single row.
    if len(value) != 3 * len(quantity.units):
        return Table(quantity.labels, [value.tolist()], left=0)
    names = [f"{name} [{unit}]" for name, unit in quantity.units.items()]
    rows = zip(names, value.reshape(-1, 3).tolist(), strict=True)
    return Table(("", "x", "y", "z"), [(name, *row) for name, row in rows])


def _jacobian_column_table(quantity: Quantity, rates: Sequence[str], value: FloatArray) -> Table:
    """Return a table with one row for each column of a Jacobian.

    For a Hessian, each row contains the derivative of one Jacobian column with respect to one joint
    coordinate. Rows with only rounding errors are left out.
    """
    import numpy as np

    if quantity.ndim == len(("row", "rate")):
        return Table(("joint", *quantity.labels), list(zip(rates, *value.tolist(), strict=True)), names=(0,))
    seen = np.abs(value).max(axis=0, initial=0.0) > noise_limit(float(np.abs(value).max(initial=0.0)))
    pairs = zip(*np.nonzero(seen), strict=True)
    rows = [(rates[i], rates[j], *value[:, i, j].tolist()) for i, j in pairs]
    return Table(("column", "changed by", *quantity.labels), rows, left=2, names=(0, 1))


# -- the parts of an acceleration --------------------------------------------------------------------


def _breakdown_answer(x: Inputs, reference: str, found: AccelerationBreakdown) -> Answer:
    from urdfkin.compiled.breakdown import ACCELERATION_KINDS

    heads = ("joint", "kind", *(f"{side} {axis}" for side in ("lin", "ang") for axis in "xyz"))

    def table(k: int) -> Iterator[Table]:
        noise = noise_limit(float(abs(found.terms[k]).max(initial=0.0)))
        rows = [*found.contributions((k,)), ("sum", "", found.total[k])]
        # With four digits, a row fits on a terminal.
        cells = [(*names, *(format_number(n, noise, digits=4) for n in six.tolist())) for *names, six in rows]
        yield Table(heads, cells, left=2)

    def parts() -> Iterator[str | Table]:
        yield (
            "The numbers are in m/s^2 and rad/s^2. The kinds are terms of equation 7.125: transverse"
            " (a z x d), centripetal, Coriolis (2 w x u) and sliding (a z). z is the joint's axis, a is the"
            " joint's acceleration, and d is the vector from the joint to the frame. w is the angular"
            " velocity of the joint's parent link, and u is the frame's velocity due to this joint alone."
        )
        yield from _format_samples(x, 2, "csv, json or npy", table)

    def csv_rows() -> Iterator[list[object]]:
        yield [_SAMPLE_HEADINGS[x.t is not None], "joint", "kind", *SIX_VECTOR_LABELS]
        for k, t in enumerate(_sample_cells(x)):
            for joint, kind, six in found.contributions((k,)):
                yield [t, csv_cell(joint), kind, *map(repr, six.tolist())]
            yield [t, "sum", "", *map(repr, found.total[k].tolist())]

    def data() -> dict[str, Any]:
        about = {"quantity": "acceleration breakdown", "frame": x.frame, "reference": reference}
        axes = {
            "rows": list(SIX_VECTOR_LABELS),
            "joints": list(found.joints),
            "kinds": list(ACCELERATION_KINDS),
        }
        return _metadata(x, "qva", **about, **axes) | {
            name: getattr(found, name).tolist() for name in ("base", "terms", "total")
        }

    title = f"acceleration of {x.frame}, {reference}, by joint"
    return _verified_answer(x, title, parts, json=data, csv=csv_rows, npy=lambda: found.terms)


# -- commands with options of their own --------------------------------------------------------------

_POSITION = ("x", "y", "z")
#: Choices of `placement --as` except matrix
_POSE_FORMS = {
    name: replace(
        PLACEMENT,
        shape=(3 + len(names),),
        labels=(*_POSITION, *names),
        units={"x, y, z": "m", ", ".join(names): unit},
    )
    for name, names, unit in (
        ("rpy", ("roll", "pitch", "yaw"), "rad"),
        ("quaternion", ("qx", "qy", "qz", "qw"), "1"),
        ("wxyz", ("qw", "qx", "qy", "qz"), "1"),
    )
}


@click.command("placement", epilog=f"Example: {PLACEMENT.example}")
@quantity_options(
    PLACEMENT.inputs,
    frame_name_option("--relative-to", "Link or joint that is the reference frame of the pose.", "the world"),
    click.option(
        "--as",
        "form",
        type=click.Choice(["matrix", *_POSE_FORMS]),
        default="matrix",
        help="Form of the pose. rpy: x, y, z, roll, pitch, yaw (URDF's <origin>)."
        " quaternion: x, y, z, qx, qy, qz, qw. wxyz: x, y, z, qw, qx, qy, qz.",
    ),
)
def placement_command(relative_to: str | None, form: str, verify: bool, **_: Any) -> Answer:
    """Compute the pose of a frame (eq. 7.77) in the world or in another frame, in metres.

    The pose is a matrix T with the frame's axes and origin. With --as, the pose is a position and three
    angles, or a position and a quaternion. Pinocchio checks that the angles or the quaternion give the same
    rotation as T.

    ROBOT is a path, a name that `urdfkin robots` lists, or - for standard input. The file at the path may
    also be a Denavit-Hartenberg table: .toml, .json, .csv, .tsv, .md, .tex or .txt.
    """
    if relative_to is not None:
        reject_unused_options(click.get_current_context(), ("base_placement",), "with --relative-to")
    x = _read_options()
    with report_compilation():
        if relative_to is None:
            T = x.robot.placement(x.q, x.frame, base=x.base)
        else:
            T = x.robot.relative_placement(x.q, x.frame, relative_to)
            x = x.with_settings(relative_to=relative_to)
    if form == "matrix":
        return _answer(x, PLACEMENT, T)
    x = x.with_settings(written_as=form)
    return _answer(x, _POSE_FORMS[form], _convert_poses(x, T, form, verify=verify))


def _convert_poses(x: Inputs, T: FloatArray, form: str, *, verify: bool) -> FloatArray:
    """Convert each pose to a position with three angles (six numbers) or a quaternion (seven numbers)."""
    import numpy as np

    from urdfkin.kinematics.rotation import quaternion_of, rpy_of

    R = T[:, :3, :3]
    orientation = np.asarray(rpy_of(R) if form == "rpy" else quaternion_of(R))
    if verify and x.robot.certificate().verified:
        from urdfkin.verify.conversions import check_orientations

        check_orientations(orientation, R, x.frame, lambda k: _replay_command(x, k, form))
    if form == "wxyz":
        orientation = np.roll(orientation, 1, axis=-1)
    return np.hstack((T[:, :3, 3], orientation))


def _replay_command(x: Inputs, k: int, form: str) -> str:
    line = format_replay_command(x.robot.origin, "placement", x.frame, None, {"q": x.q[k].tolist()})
    options = click.get_current_context().params
    for name in ("relative_to", "base_placement"):
        if options[name] is not None:
            line += f" --{name.replace('_', '-')} {shlex.quote(options[name])}"
    return f"{line} --as {form}"


#: Copy of `urdfkin.kinematics.rotation.EULER_SEQUENCES` in small letters.
#: An import of that module would slow `--help` down.
_EULER_SEQUENCES = [a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c]
REPRESENTATIONS = (
    "rpy",
    "quaternion",
    *(sequence.upper() for sequence in _EULER_SEQUENCES),
    *_EULER_SEQUENCES,
)


@click.command(
    "analytical-jacobian", epilog="Example: urdfkin analytical-jacobian ur5 --q random --representation rpy"
)
@quantity_options(
    ANALYTICAL_JACOBIAN.inputs,
    click.option(
        "--representation",
        type=click.Choice(REPRESENTATIONS),
        metavar="NAME",
        default="ZYZ",
        help="Representation of the orientation. rpy: roll, pitch, yaw as in a URDF. quaternion: qx, qy, qz,"
        " qw. ZYZ: Euler angles about moving axes (capital letters). xyz: fixed axes (small letters); the"
        " same as rpy.",
    ),
    click.option(
        "--nearest",
        type=NumberInRange(min=0.0),
        metavar="RAD",
        help="The command fails if the Euler angles are at most RAD from their singularity.",
        show_default="1e-9",
    ),
)
def analytical_jacobian_command(representation: str, nearest: float | None, **_: Any) -> Answer:
    """Compute a frame's analytical Jacobian J = C^-1 J_v (eq. 7.118, 7.122).

    Each row of the printed table contains the time derivatives of the position and of the numbers that
    represent the orientation. These numbers are Euler angles or a quaternion. In row i, the joint velocity
    v_i is 1, and all other joint velocities are 0. `urdfkin jacobian` prints angular velocities instead.
    """
    from urdfkin.kinematics.rotation import MIN_SINGULARITY_DISTANCE

    x, nearest = _read_options(), MIN_SINGULARITY_DISTANCE if nearest is None else nearest
    with report_compilation():
        J = x.robot.analytical_jacobian(x.q, x.frame, representation, nearest=nearest, base=x.base)
    if x.conversion is not None:
        J = x.conversion.columns(x.q, J)
    row = replace(ANALYTICAL_JACOBIAN, labels=("x", "y", "z", *orientation_labels(representation)))
    return _answer(x.with_settings(representation=representation), row, J)


def orientation_labels(representation: str) -> tuple[str, ...]:
    """Return the names of the numbers that represent an orientation.

    >>> orientation_labels("xyz"), orientation_labels("ZYZ")
    (('roll', 'pitch', 'yaw'), ('Z1', 'Y2', 'Z3'))
    """
    angles = ("roll", "pitch", "yaw")
    named = {"rpy": angles, "xyz": angles, "quaternion": ("qx", "qy", "qz", "qw")}
    return named.get(representation) or tuple(f"{axis}{k}" for k, axis in enumerate(representation, 1))


@click.command(
    "imu", epilog="Example: urdfkin imu panda --frame panda_hand --trajectory log.csv --format csv"
)
@quantity_options(
    IMU.inputs,
    click.option(
        "--gravity",
        metavar="X,Y,Z",
        default="0,0,-9.81",
        help="Acceleration of gravity in the world's axes, m/s^2.",
    ),
)
def imu_command(gravity: str, **_: Any) -> Answer:
    """Compute the readings of an accelerometer and a gyroscope on a frame, in the frame's own axes.

    The accelerometer reads the proper acceleration in m/s^2. The proper acceleration is the second time
    derivative of the frame's position, minus the acceleration of gravity. With the default --gravity, an
    accelerometer at rest reads 9.81 m/s^2 upwards. The gyroscope reads the angular velocity in rad/s.

    The input is a configuration --q, joint velocities --v and joint accelerations --a. The input may also be
    a batch of configurations, or a --trajectory.

    The --base options, such as --base-velocity, set the motion of the root link. An .npz file may also
    contain this motion. With --root-joint floating, the pose of the root link is part of --q. See `urdfkin
    explain gravity-in-an-acceleration`.
    """
    from urdfkin.robot.trajectory import parse_numbers

    x = _read_options()
    g = parse_numbers(gravity.split(","), "--gravity", ("x", "y", "z"))
    with report_compilation():
        result = x.robot.imu(x.q, x.v, x.a, x.frame, gravity=g, base=x.base)
    return _answer(x.with_settings(gravity=g), IMU, result)


@click.command(
    "singular-values",
    epilog="Example: urdfkin singular-values panda --q random --frame panda_hand --rows linear",
)
@robot_argument
@frame_option
@click.option(
    "--rows",
    type=click.Choice(["all", "linear", "angular"]),
    default="all",
    help="Rows of the Jacobian to use; `all` mixes metres and radians.",
)
@convention_option
@q_option
@_trajectory_option
@seed_option
@verify_option
@answer_command()
def singular_values_command(rows: str, **_: Any) -> Answer:
    """Compute the singular values, condition number and manipulability of a frame's Jacobian.

    Each value has a guaranteed lower and upper bound. The bounds include the error of the Jacobian and the
    rounding errors of the decomposition. The manipulability is Yoshikawa's sqrt(det J J^T), the product of
    the singular values. The command also computes the manipulability's derivative with respect to each joint,
    from the frame's Hessian.

    At a singularity, the command prints the rank, the lost directions, and the joints that cause the
    singularity. The manipulability may have no derivative at a singularity. CSV then contains nan, and JSON
    contains null. See `urdfkin explain singularity`.

    With --convention, the derivatives are with respect to the joint coordinates of that convention. The
    singular values are always for joint velocities in rad/s and m/s.
    """
    from urdfkin.system.documents import as_json_data

    x = _read_options()
    with report_compilation():
        found = x.robot.singular_values(x.q, x.frame, rows, base=x.base)
        gradient = found.manipulability_gradient(x.robot.hessian(x.q, x.frame, base=x.base))
    if x.conversion is not None:
        gradient = x.conversion.columns(x.q, gradient[:, None])[:, 0]
    x = x.convert_to_given_convention()
    names = [f"sigma_{k + 1}" for k in range(found.values.value.shape[-1])]

    def parts(k: int) -> Iterator[str | Table]:
        lines = [
            (name, *(f"{n:.15g}" for n in sides)) for name, sides in _values_with_bounds(names, found, k)
        ]
        yield Table(("", "value", "lower bound", "upper bound"), lines)
        if singularity := found.singularity(k):
            # At a singularity, the manipulability may have no derivative.
            yield from str(singularity).splitlines()
        else:
            slopes = zip(x.velocity_names, gradient[k].tolist(), strict=True)
            yield Table(("joint", "manipulability changes by"), list(slopes), names=(0,))

    def data() -> dict[str, Any]:
        return _metadata(x, "q", quantity="singular values", frame=x.frame, rows=rows) | {
            "singular_values": as_json_data(found.values._asdict()),
            "condition": as_json_data(found.condition._asdict()),
            "manipulability": as_json_data(found.manipulability._asdict()),
            "manipulability_gradient": as_json_data(gradient),
            "singularities": [
                {
                    "rank": one.rank,
                    "full": one.full_rank,
                    "lost": one.lost_directions.tolist(),
                    "reasons": one.reasons,
                }
                if one
                else None
                for one in map(found.singularity, range(len(gradient)))
            ],
        }

    def csv_rows() -> Iterator[list[object]]:
        sides = ("", " lower", " upper")
        heads = [name + side for name in (*names, "condition", "manipulability") for side in sides]
        yield [
            _SAMPLE_HEADINGS[x.t is not None],
            *heads,
            *(csv_cell(f"by {rate}") for rate in x.velocity_names),
        ]
        for k, (t, slopes) in enumerate(zip(_sample_cells(x), gradient.tolist(), strict=True)):
            numbers = [n for _, sides in _values_with_bounds(names, found, k) for n in sides]
            yield [t, *map(repr, numbers), *map(repr, slopes)]

    settings = "".join(f", {name} {word}" for name, word in x.settings.items() if isinstance(word, str))
    title = f"singular values of {x.frame}, {rows} rows{settings}"
    return _verified_answer(
        x, title, lambda: _format_samples(x, _MAX_SAMPLES, "csv or json", parts), json=data, csv=csv_rows
    )


def _values_with_bounds(names: list[str], found: SingularValues, k: int) -> Iterator[tuple[str, list[float]]]:
    """Yield each quantity of sample `k`: its name and the list [value, lower bound, upper bound]."""
    for i, name in enumerate(names):
        yield name, [float(side[k, i]) for side in found.values]
    yield "condition", [float(side[k]) for side in found.condition]
    yield "manipulability", [float(side[k]) for side in found.manipulability]
