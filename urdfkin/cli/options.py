"""Arguments and options that several commands share, and the rules for all options.

- Numbers are decimal digits in ASCII. Click's own types also accept `1_000`, Arabic digits, `nan` and `inf`.
- The suffix of a file or --format selects the output format. A suffix that contradicts --format is an error.
- An option without an effect is an error, for example --seed without a random value.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from urdfkin.cli.shell import complete_frame, complete_robot
from urdfkin.cli.streams import say
from urdfkin.errors import InputError, QuestionsSection, SourceError
from urdfkin.errors.numbers import number_remedy, parse_float, parse_int
from urdfkin.model.reference import Reference
from urdfkin.system.files import MAX_DATA_BYTES, abbreviate_path, read_standard_input, read_text
from urdfkin.verify.oracles import ORACLES

if TYPE_CHECKING:
    from urdfkin.model.base_motion import BaseMotion
    from urdfkin.model.conventions import Conversion
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot
    from urdfkin.robot.trajectory import Trajectory
    from urdfkin.verify.oracles import OracleName


class _NonEmptyPath(click.Path):
    """A path; the empty string is an error, because `Path("")` is the current folder."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the path is empty.", param, ctx)
        return super().convert(value, param, ctx)


FILE = _NonEmptyPath(path_type=Path, dir_okay=False)
FOLDER = _NonEmptyPath(path_type=Path, file_okay=False)
FILE_OR_FOLDER = _NonEmptyPath(path_type=Path)


class WholeNumber(click.IntRange):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and parse_int(value) is None:
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class FiniteNumber(click.types.FloatParamType):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and parse_float(value) is None:
            hint = number_remedy(value)
            self.fail(f"{value!r} is not a finite number{f': {hint}' if hint else ''}.", param, ctx)
        return super().convert(value, param, ctx)


class NumberInRange(FiniteNumber, click.FloatRange):
    """A finite number in a range."""


def format_from_suffix(
    context: click.Context,
    output: Path | None,
    formats: Mapping[str, Sequence[str]],
    default_format: str,
    parameter: str = "format_",
) -> str:
    """Return the output format that an option or the suffix of the output file selects.

    `parameter` is the name of the option's value in `context.params`. `formats` lists the formats of each
    suffix, for example `{".py": ("numpy", "sympy")}`. The first format is the default. Raise InputError if
    the option contradicts the suffix, or if the suffix is unknown and the option is not given.
    """
    format_: str = context.params[parameter] or default_format
    if output is None:
        return format_
    option = "--" + parameter.strip("_")
    chosen = is_on_command_line(context, parameter)
    suffix = output.suffix.lower()
    if suffix not in formats:
        if not chosen and suffix:
            raise InputError(
                "no output format has this suffix",
                where=abbreviate_path(output),
                remedy=f"use {', '.join(formats)}, or add {option}",
            )
        return format_ if chosen else default_format
    if not chosen:
        return formats[suffix][0]
    if format_ not in formats[suffix]:
        raise InputError(
            f"{option} {format_} contradicts the file's suffix",
            where=str(output),
            remedy=f"leave out {option}, or give the file another name",
        )
    return format_


def is_on_command_line(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def reject_unused_options(context: click.Context, unused: Collection[str], because: str) -> None:
    """Raise InputError if an option in `unused` is given, for example "--format does nothing with --opw"."""
    for parameter in context.command.params:
        if parameter.name in unused and is_on_command_line(context, parameter.name):
            name = "/".join([*parameter.opts[:1], *parameter.secondary_opts[:1]])
            raise InputError(f"{name} does nothing {because}", remedy="leave out this option")


_F = TypeVar("_F", bound=Callable[..., Any])

REFERENCES = tuple(reference.name.lower() for reference in Reference)
#: Number of samples that an option with the value `random` draws, for example `--q random`.
_RANDOM_SAMPLES = 1


def combine(*decorators: Callable[[_F], _F]) -> Callable[[_F], _F]:
    def decorate(function: _F) -> _F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


_LOAD_OPTIONS_KEY = "urdfkin.load_options"


def _store_as(name: str, read: Callable[[Any], Any] | None = None, *, always: bool = False) -> Any:
    """Return a callback that stores an option's value for `load_options`.

    With `always`, the callback also stores the default value of an option that the user omits.
    """

    def store_option(context: click.Context, _: click.Parameter, value: Any) -> None:
        if always or value not in (None, ()):
            context.meta.setdefault(_LOAD_OPTIONS_KEY, {})[name] = value if read is None else read(value)

    return store_option


def _make_pair_reader(
    separator: str, form: str, *, needs_value: bool
) -> Callable[[Sequence[str]], dict[str, str]]:
    def read_pairs(words: Sequence[str]) -> dict[str, str]:
        pairs = dict[str, str]()
        for word in words:
            name, found, value = word.partition(separator)
            if not found or not name or (needs_value and not value):
                raise click.BadParameter(f"{word!r} is not {form}")
            if pairs.setdefault(name, value) != value:
                raise click.BadParameter(f"{name!r} has two values: {pairs[name]!r} and {value!r}")
        return pairs

    return read_pairs


def load_options() -> dict[str, Any]:
    return dict(click.get_current_context().meta.get(_LOAD_OPTIONS_KEY, {}))


source_options = combine(
    click.option(
        "--xacro-arg",
        multiple=True,
        metavar="NAME:=VALUE",
        expose_value=False,
        callback=_store_as(
            "xacro_args", _make_pair_reader(":=", "NAME:=VALUE", needs_value=False), always=True
        ),
        help="Argument of a .xacro file; repeatable. The file is expanded in a restricted process.",
    ),
    click.option(
        "--variant",
        multiple=True,
        metavar="SET=NAME",
        expose_value=False,
        callback=_store_as("variant", _make_pair_reader("=", "SET=NAME", needs_value=True)),
        help="Select a variant of a USD file; repeatable.",
    ),
    click.option(
        "--articulation",
        metavar="PATH",
        expose_value=False,
        callback=_store_as("articulation"),
        help="Path of the robot (articulation) to load from a USD file that has several.",
    ),
)


def mimic_option(help_: str, default: str) -> Callable[[_F], _F]:
    return click.option(
        "--mimic/--no-mimic",
        default=None,
        show_default=default,
        expose_value=False,
        callback=_store_as("mimic", always=True),
        help=help_,
    )


def root_joint_option(help_: str) -> Callable[[_F], _F]:
    joints, store = click.Choice(["floating", "planar"]), _store_as("root_joint", always=True)
    return click.option("--root-joint", type=joints, expose_value=False, callback=store, help=help_)


robot_options = combine(
    mimic_option(
        "Couple each mimic joint to the joint that it mimics, as in the URDF.",
        "mimic; for some robots of the catalogue no-mimic, see `urdfkin robots`",
    ),
    root_joint_option("Add a moving joint between the world and the root link."),
    source_options,
    click.option(
        "--lock",
        multiple=True,
        metavar="NAME=VALUE",
        expose_value=False,
        callback=_store_as("lock", ", ".join),
        help="Fix a joint at a value; repeatable. A fixed joint has no entry in q, v and the Jacobian."
        " With --joints, the first --lock may be a pose's name, such as ready. The pose then sets each"
        " fixed joint that has no --lock value.",
    ),
    click.option(
        "--joints",
        metavar="NAMES",
        expose_value=False,
        callback=_store_as("joints", lambda words: [name.strip() for name in words.split(",")]),
        help="Keep only these joints, separated by commas. All other joints are fixed at their --lock value,"
        " or at 0.",
    ),
)
robot_argument = combine(
    click.argument("robot", metavar="ROBOT", shell_complete=complete_robot), robot_options
)


def frame_name_option(option: str, help_: str, default: str) -> Callable[[_F], _F]:
    return click.option(
        option, metavar="NAME", help=help_, shell_complete=complete_frame, show_default=default
    )


frame_option = frame_name_option("--frame", "Link or joint whose frame is computed.", "the robot's tip")
path_options = combine(
    frame_name_option("--base", "Link or joint where the path begins.", "the robot's base"),
    frame_name_option("--tip", "Link or joint where the path ends.", "the robot's tip"),
)


class _ReferenceName(click.Choice):  # type: ignore[type-arg]  # generic only since click 8.2
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            self.fail(f"{error.message.rstrip('.')}; {QuestionsSection.REFERENCE_FRAMES}", param, ctx)


reference_option = click.option(
    "--reference",
    type=_ReferenceName(REFERENCES, case_sensitive=False),
    default="local_world_aligned",
    help="Reference frame of the result, as in Pinocchio.",
)
verify_option = click.option("--verify/--no-verify", default=True, help="Check each result with Pinocchio.")


def oracle_option(help_: str = "Library that checks each result.") -> Callable[[_F], _F]:
    return click.option("--oracle", type=click.Choice(tuple(ORACLES)), default="pinocchio", help=help_)


seed_option = click.option("--seed", type=WholeNumber(0), default=0, help="Seed of the random values.")


def samples_option(
    default: int, help_: str, minimum: int = 0, maximum: int | None = None
) -> Callable[[_F], _F]:
    return click.option("--samples", type=WholeNumber(minimum, maximum), default=default, help=help_)


def _values_option(name: str, help_: str) -> Callable[[_F], _F]:
    return click.option(name, metavar="VALUES", default="neutral", help=help_)


q_option = _values_option(
    "--q",
    "Configuration. Numbers: '0,30deg,pi/2'. Names: 'shoulder=30deg,elbow=0.5'. A pose: 'ready'. A changed"
    " pose: 'ready,elbow=0.5'. A batch: '@FILE.csv'. Random: 'random', 'random:N'.",
)
v_option = _values_option("--v", "Joint velocities, in the format of --q; 'neutral' means zero.")
a_option = _values_option("--a", "Joint accelerations, in the format of --q; 'neutral' means zero.")
digits_option = click.option(
    "--digits", type=WholeNumber(3, 17), default=10, help="Number of significant digits in printed tables."
)
markdown_option = click.option(
    "--markdown", type=FILE, help="Write the result to this file as Markdown for a pull request comment."
)


def _convention_option(values: str) -> Callable[[_F], _F]:
    help_ = f"Convention of {values}: a tool that `urdfkin order` lists, or a TOML file."
    return click.option("--convention", metavar="NAME|FILE", help=help_, show_default="urdfkin")


convention_option = _convention_option("--q, --v, --a, --trajectory and the result")
convention_of_input_option = _convention_option("the joint values that are read")


def trajectory_option(help_: str) -> Callable[[_F], _F]:
    files = (
        "A CSV file has a column NAME for each joint. The columns t, v:NAME and a:NAME are optional. A column"
        " may state its unit, such as 'elbow [deg]'. An .npz file has the array q; t, v and a are optional."
    )
    return click.option("--trajectory", type=FILE, help=f"{help_} {files}")


def schema_option(layout: str, what: str) -> Callable[[_F], _F]:
    """Make the option --schema, which prints the JSON Schema of `layout` ("module:name")."""

    def print_schema(context: click.Context, _: click.Parameter, wanted: bool) -> None:
        if wanted and not context.resilient_parsing:
            module, name = layout.split(":")
            click.echo(getattr(importlib.import_module(module), name).schema_text(), nl=False)
            context.exit()

    help_ = f"Print the JSON Schema of {what} and exit."
    return click.option("--schema", is_flag=True, expose_value=False, callback=print_schema, help=help_)


def find_conversion(robot: Robot, name: str | None) -> Conversion | None:
    return None if name is None else robot.convention(name)


def read_motion(robot: Robot, path: Path, convention: str | None) -> Trajectory:
    from urdfkin.robot.trajectory import read_trajectory

    motion = read_trajectory(robot, path, convention=convention)
    print_trajectory_notes(motion)
    warn_of_limits(robot, motion.q)
    return motion


def print_trajectory_notes(motion: Trajectory) -> None:
    for note in motion.notes:
        say(f"warning: {note}", err=True)
    if motion.rates_source != "as given":
        say(f"rates {motion.derivation()}", err=True)


def warn_of_limits(robot: Robot, q: FloatArray) -> None:
    for line in robot.limit_violations(q):
        say(f"warning: {line}", err=True)


def lock_settings(robot: Robot) -> dict[str, Any]:
    return {"lock": dict(robot.origin.lock)} if robot.origin.lock else {}


def locked_line(robot: Robot) -> str:
    """Return one line with the value of each locked joint, or "" if no joint is locked."""
    units = {name: "rad" if robot.joints[name].original.kind.turns else "m" for name, _ in robot.origin.lock}
    values = ", ".join(f"{name} at {value:.6g} {units[name]}" for name, value in robot.origin.lock)
    return f"locked: {values}" if values else ""


@dataclass(frozen=True, slots=True)
class Inputs:
    """Inputs of a computation: a robot, a frame, configurations and motions.

    Attributes:
        q: (n, n_q) configurations, rad or m.
        v: (n, n_v) joint velocities.
        a: (n, n_v) joint accelerations.
        t: (n,) times of a trajectory in s; None without times.
        base: Motion of the root link; None if the root link is fixed.
        settings: Other settings that affect the result, for example `{"relative_to": "base"}`.
        conversion: Conversion to the convention of --convention; None for urdfkin's own convention.
    """

    robot: Robot
    frame: str
    q: FloatArray
    v: FloatArray
    a: FloatArray
    t: FloatArray | None = None
    base: BaseMotion | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    conversion: Conversion | None = None
    is_trajectory: bool = False

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        return (self.conversion or self.robot).coordinate_names

    @property
    def velocity_names(self) -> tuple[str, ...]:
        return (self.conversion or self.robot).velocity_names

    def convert_to_given_convention(self) -> Inputs:
        if self.conversion is None:
            return self
        q, v, a = self.conversion.to(self.q, self.v, self.a)
        return replace(self, q=q, v=v, a=a).with_settings(convention=self.conversion.convention.name)

    def with_settings(self, **more: Any) -> Inputs:
        return replace(self, settings={**self.settings, **more})


#: Prefix of the codes of findings about masses, shapes and colours.
_NON_KINEMATIC_FINDINGS = "URDF7"


def load_robot(source: str, *, verify: bool = True, oracle: OracleName = "pinocchio", **how: Any) -> Robot:
    from urdfkin.robot.loading import load
    from urdfkin.urdf.findings import UrdfWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = load(source, **load_options() | how, verify=verify, oracle=oracle)
    without_effect = {str(one) for one in robot.findings if one.code.startswith(_NON_KINEMATIC_FINDINGS)}
    for warning in caught:
        if str(warning.message) in without_effect:
            continue
        of_the_file = issubclass(warning.category, UrdfWarning)
        say(f"{'' if of_the_file else 'urdfkin: warning: '}{warning.message}", err=True)
    return robot


def load_robots(*sources: str) -> tuple[Robot, ...]:
    from urdfkin.urdf.sources import is_usd, is_xacro

    if sources.count("-") > 1:
        raise click.UsageError("only one of the robots can come from standard input")

    def disabled_options(source: str) -> dict[str, Any]:
        """Return arguments of `load` that disable xacro or USD options which only another source needs."""
        none: dict[str, Any] = {}
        if not is_xacro(source) and any(map(is_xacro, sources)):
            none["xacro_args"] = None
        if not is_usd(source) and any(map(is_usd, sources)):
            none |= {"variant": {}, "articulation": None}
        return none

    return tuple(load_robot(source, **disabled_options(source)) for source in sources)


def read_inputs(
    robot: Robot,
    frame: str | None,
    seed: int,
    q: str,
    v: str = "neutral",
    a: str = "neutral",
    *,
    option: str = "--q",
    conversion: Conversion | None = None,
) -> Inputs:
    """Read q, v and a in the convention of `conversion`, and convert them to urdfkin's convention.

    A single sample of q, v or a is repeated for all samples of the other arrays. The argument `option` is the
    option for q. If it is not --q, the caller must reject an unused --seed.
    """
    import numpy as np

    if option == "--q" and not any(text.startswith("random") for text in (q, v, a)):
        reject_unused_options(click.get_current_context(), ("seed",), "without a random --q, --v or --a")
    rng = np.random.default_rng(seed)
    texts = (("q", q, option), ("v", v, "--v"), ("a", a, "--a"))
    rows = [_read_values(robot, letter, text, where, rng, conversion) for letter, text, where in texts]
    q_, v_, a_ = _repeat_single("batches of --q, --v and --a have different lengths", rows)
    if conversion is not None:
        q_, v_, a_ = conversion.from_(q_, v_, a_)
    warn_of_limits(robot, q_)
    settings = lock_settings(robot)
    frame = robot.tip_frame if frame is None else frame
    return Inputs(robot, frame, q_, v_, a_, settings=settings, conversion=conversion)


def _repeat_single(problem: str, batches: Sequence[FloatArray]) -> list[FloatArray]:
    """Repeat arrays with one row up to the length of the longest array."""
    import numpy as np

    n = max(map(len, batches))
    if any(len(batch) not in (1, n) for batch in batches):
        raise InputError(
            problem,
            found=", ".join(str(len(batch)) for batch in batches),
            remedy="give each batch one sample or the same number of samples",
        )
    return [np.ascontiguousarray(np.broadcast_to(batch, (n, *batch.shape[1:]))) for batch in batches]


def _read_values(
    robot: Robot, letter: str, text: str, where: str, rng: Any, conversion: Conversion | None
) -> FloatArray:
    from urdfkin.model.configuration import coordinate_layout, sample
    from urdfkin.robot.trajectory import column_units

    named = conversion or robot
    names = named.coordinate_names if letter == "q" else named.velocity_names
    word, _, count = text.partition(":")
    if word == "random":
        n = _read_count(where, count) if count else _RANDOM_SAMPLES
        try:
            if letter != "q":
                rates: FloatArray = rng.standard_normal((n, len(names)))
                return rates
            drawn = sample(robot.tree, n, rng)
        except (MemoryError, ValueError):  # For more than 2^63 numbers, NumPy raises ValueError.
            problem, remedy = "N random samples do not fit into memory", "draw fewer samples"
            raise InputError(problem, where=where, found=f"N = {n}", remedy=remedy) from None
        return conversion.to(drawn) if conversion else drawn
    if text.startswith("@"):
        return read_batch(text[1:], where, (names,), column_units(robot, letter, conversion))[0]
    layout = conversion.layout(letter) if conversion else coordinate_layout(robot.tree, letter)
    return layout.parse(text, where)[None]


def _read_count(where: str, text: str) -> int:
    count = parse_int(text)
    if count is None or count < 1:
        raise InputError("N in random:N must be a whole number, at least 1", where=where, found=repr(text))
    return count


def read_batch(
    file: str, option: str, layouts: Sequence[Sequence[str]], units: Mapping[str, str] | None = None
) -> tuple[FloatArray, Sequence[str]]:
    """Read a CSV file with one sample per line.

    Return the samples, and the layout with as many names as the file has columns. A layout is a list of
    column names. `units` is as in `read_columns`.
    """
    import numpy as np

    from urdfkin.robot.trajectory import first_cells, read_columns

    if not file:
        raise SourceError("the path is empty", where=option, remedy="give a CSV file after @")
    path = Path(file)
    text = _read_stdin() if file == "-" else read_text(path, MAX_DATA_BYTES, pipes=True)
    width = len(first_cells(text, str(path))) if len(layouts) > 1 else None
    names = next((names for names in layouts if len(names) == width), layouts[0])
    columns = read_columns(text, str(path), option, names, units=units)
    rows = np.stack([columns[name] for name in names], axis=-1) if names else np.empty((0, 0))
    if not len(rows):
        raise InputError(
            "no samples",
            where=str(path),
            remedy="write one line for each sample, with numbers separated by commas",
        )
    return np.ascontiguousarray(rows), names


def _read_stdin() -> str:
    try:
        return read_standard_input(MAX_DATA_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SourceError("cannot be read", where="-", found=f"text that is not UTF-8 ({error})") from None


# -- the motion of the root link ----------------------------------------------------------------------

_POSITION_NAMES = ("x", "y", "z")
_RPY_POSE_NAMES = (*_POSITION_NAMES, "roll", "pitch", "yaw")
_QUATERNION_POSE_NAMES = (*_POSITION_NAMES, "qx", "qy", "qz", "qw")
_VELOCITY_NAMES = ("vx", "vy", "vz", "wx", "wy", "wz")
_ACCELERATION_NAMES = ("ax", "ay", "az", "alphax", "alphay", "alphaz")

_BASE_MOTION_OPTIONS = {
    "q": click.option(
        "--base-placement",
        metavar="VALUES",
        help="Pose of the root link in the world (m, rad): x,y,z,roll,pitch,yaw or x,y,z,qx,qy,qz,qw or"
        " @FILE.csv.",
    ),
    "v": click.option(
        "--base-velocity",
        metavar="VALUES",
        help="Velocity of the root link in world axes (m/s, rad/s): vx,vy,vz,wx,wy,wz or @FILE.csv.",
    ),
    "a": click.option(
        "--base-acceleration",
        metavar="VALUES",
        help="Classical acceleration of the root link in world axes (m/s^2, rad/s^2):"
        " ax,ay,az,alphax,alphay,alphaz or @FILE.csv.",
    ),
}


def base_motion_options(inputs: str) -> Callable[[_F], _F]:
    """Make the options for the motion of the root link.

    `inputs` contains q for the pose, v for the velocity and a for the acceleration.
    """
    return combine(*(_BASE_MOTION_OPTIONS[letter] for letter in inputs))


def with_base_motion(
    x: Inputs, placement: str | None = None, velocity: str | None = None, acceleration: str | None = None
) -> Inputs:
    from urdfkin.model.base_motion import BaseMotion

    if placement is None and velocity is None and acceleration is None:
        return x
    placement, velocity, acceleration = (
        "0,0,0,0,0,0" if text is None else text for text in (placement, velocity, acceleration)
    )
    T = _placements(*_read_rows(placement, "--base-placement", (_RPY_POSE_NAMES, _QUATERNION_POSE_NAMES)))
    v, _ = _read_rows(velocity, "--base-velocity", (_VELOCITY_NAMES,))
    a, _ = _read_rows(acceleration, "--base-acceleration", (_ACCELERATION_NAMES,))
    problem = "the batches of q, v, a and the base motion have different lengths"
    q, v_, a_, *base = _repeat_single(problem, [x.q, x.v, x.a, T, v, a])
    names = "base_placement", "base_velocity", "base_acceleration"
    settings = {name: array.tolist() for name, array in zip(names, base, strict=True)}
    return replace(x, q=q, v=v_, a=a_, base=BaseMotion(*base)).with_settings(**settings)


def _read_rows(text: str, option: str, layouts: Sequence[Sequence[str]]) -> tuple[FloatArray, Sequence[str]]:
    import numpy as np

    from urdfkin.robot.trajectory import parse_numbers

    if text.startswith("@"):
        return read_batch(text[1:], option, layouts)
    cells = text.split(",")
    names = next((names for names in layouts if len(names) == len(cells)), layouts[0])
    return np.array([parse_numbers(cells, option, names)]), names


def _placements(rows: FloatArray, names: Sequence[str]) -> FloatArray:
    import numpy as np

    from urdfkin.kinematics.rotation import rotation_from_quaternion, rotation_from_rpy

    T: FloatArray = np.tile(np.eye(4), (len(rows), 1, 1))
    rotation = rotation_from_quaternion if names is _QUATERNION_POSE_NAMES else rotation_from_rpy
    T[:, :3, :3], T[:, :3, 3] = rotation(rows[:, 3:]), rows[:, :3]
    return T
