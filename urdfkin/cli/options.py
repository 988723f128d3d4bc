"""Arguments and options that commands share, and the rules for all options.

- Numbers are decimal digits in ASCII. Click's own types also accept `1_000`, Arabic digits, `nan` and `inf`.
- The suffix of a file or --format selects the output format. If the suffix and --format contradict each
  other, urdfkin reports an error.
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

from urdfkin.cli.completion import complete_frame, complete_robot
from urdfkin.cli.streams import say
from urdfkin.errors import InputError, QuestionsSection, SourceError
from urdfkin.errors.numbers import parse_float, parse_int, remedy
from urdfkin.model.reference import Reference
from urdfkin.system.files import MOST_DATA, read_standard_input, read_text, shortened
from urdfkin.verify.oracles import ORACLES

if TYPE_CHECKING:
    from urdfkin.model.base_motion import BaseMotion
    from urdfkin.model.conventions import Conversion
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot
    from urdfkin.robot.trajectory import Trajectory
    from urdfkin.verify.oracles import OracleName


class Whole(click.IntRange):
    """The type of a whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and parse_int(value) is None:
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class FiniteNumber(click.types.FloatParamType):
    """The type of a finite number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return super().convert(_finite(self, value, param, ctx), param, ctx)


class NumberFrom(click.FloatRange):
    """The type of a finite number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return super().convert(_finite(self, value, param, ctx), param, ctx)


def _finite(kind: Any, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
    if isinstance(value, str) and parse_float(value) is None:
        hint = remedy(value)
        kind.fail(f"{value!r} is not a finite number{f': {hint}' if hint else ''}.", param, ctx)
    return value


def format_from_suffix(
    context: click.Context, output: Path | None, endings: Mapping[str, Sequence[str]], plain: str
) -> str:
    """Return the output format of the running command.

    `endings` are the formats of each suffix, for example `{".py": ("numpy", "sympy")}`; the first format is
    the default. `plain` is the format if the file's name has no suffix. InputError is raised if --format
    contradicts the suffix, or if the suffix has no format.
    """
    format_: str = context.params["format_"]
    if output is None:
        return format_
    chosen = context.get_parameter_source("format_") is click.core.ParameterSource.COMMANDLINE
    ending = output.suffix.lower()
    if ending not in endings:
        if not chosen and ending:
            raise InputError(
                "no output format has this suffix",
                where=shortened(output),
                remedy=f"use {', '.join(endings)}, or add --format",
            )
        return format_ if chosen else plain
    if not chosen:
        return endings[ending][0]
    if format_ not in endings[ending]:
        raise InputError(
            f"--format {format_} contradicts the file's suffix",
            where=str(output),
            remedy="leave out --format, or give the file another name",
        )
    return format_


def typed(context: click.Context, name: str) -> bool:
    """Return whether a parameter of the running command was given on the command line."""
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def reject_unused_options(context: click.Context, idle: Collection[str], because: str) -> None:
    """Raise InputError if one of the parameters `idle`, which have no effect, was given on the command line.

    With the reason "with --opw", the error message is "--format does nothing with --opw".
    """
    for parameter in context.command.params:
        if parameter.name in idle and typed(context, parameter.name):
            name = "/".join([*parameter.opts[:1], *parameter.secondary_opts[:1]])
            raise InputError(f"{name} does nothing {because}", remedy="leave out this option")


_F = TypeVar("_F", bound=Callable[..., Any])

REFERENCES = tuple(reference.name.lower() for reference in Reference)
#: `random` draws this number of samples; `random:N` draws N samples.
_RANDOM_SAMPLES = 1


def together(*decorators: Callable[[_F], _F]) -> Callable[[_F], _F]:
    def decorate(function: _F) -> _F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


_HOW = "urdfkin.how_to_load"


def _storing(name: str, read: Callable[[Any], Any] | None = None, *, always: bool = False) -> Any:
    """Return a callback that stores an option for `how_to_load`, by default only if the option was given."""

    def store(context: click.Context, _: click.Parameter, value: Any) -> None:
        if always or value not in (None, ()):
            context.meta.setdefault(_HOW, {})[name] = value if read is None else read(value)

    return store


def _pairs(mark: str, form: str, *, demand_value: bool) -> Callable[[Sequence[str]], dict[str, str]]:
    """Return a function that splits words such as SET=NAME, and rejects words of another form."""

    def read(words: Sequence[str]) -> dict[str, str]:
        pairs = {}
        for word in words:
            name, found, value = word.partition(mark)
            if not found or not name or (demand_value and not value):
                raise click.BadParameter(f"{word!r} is not {form}")
            pairs[name] = value
        return pairs

    return read


def how_to_load() -> dict[str, Any]:
    """Return the options of the running command that are arguments of `load`, for example `mimic`."""
    return dict(click.get_current_context().meta.get(_HOW, {}))


xacro_option = click.option(
    "--xacro-arg",
    multiple=True,
    metavar="NAME:=VALUE",
    expose_value=False,
    callback=_storing("xacro_args", _pairs(":=", "NAME:=VALUE", demand_value=False), always=True),
    help="Argument of a .xacro file; repeatable. xacro runs in a restricted process.",
)


usd_options = together(
    click.option(
        "--variant",
        multiple=True,
        metavar="SET=NAME",
        expose_value=False,
        callback=_storing("variant", _pairs("=", "SET=NAME", demand_value=True)),
        help="Select a variant of a USD stage; repeatable.",
    ),
    click.option(
        "--articulation",
        metavar="PATH",
        expose_value=False,
        callback=_storing("articulation"),
        help="Path of the articulation to load, if a USD stage has several.",
    ),
)
#: These options concern the robot's file.
source_options = together(xacro_option, usd_options)


def mimic_option(help_: str) -> Callable[[_F], _F]:
    store = _storing("mimic", always=True)
    return click.option("--mimic/--no-mimic", default=None, expose_value=False, callback=store, help=help_)


def root_joint_option(help_: str) -> Callable[[_F], _F]:
    joints, store = click.Choice(["floating", "planar"]), _storing("root_joint", always=True)
    return click.option("--root-joint", type=joints, expose_value=False, callback=store, help=help_)


lock_options = together(
    click.option(
        "--lock",
        multiple=True,
        metavar="NAME=VALUE",
        expose_value=False,
        callback=_storing("lock", ", ".join),
        help="Fix a joint at a value, so that q, v and the Jacobian have no entry for this joint; repeatable."
        " With --joints, the value of the first --lock may be a pose, such as ready.",
    ),
    click.option(
        "--joints",
        metavar="NAMES",
        expose_value=False,
        callback=_storing("joints", lambda words: [name.strip() for name in words.split(",")]),
        help="Joints that remain, separated by commas. All others are fixed at 0, or at the value of --lock.",
    ),
)
robot_options = together(
    mimic_option("Couple mimic joints to the mimicked joints, as in the URDF (default)."),
    root_joint_option("Add a moving joint between the world and the root link."),
    source_options,
    lock_options,
)
robot_argument = together(
    click.argument("robot", metavar="ROBOT", shell_complete=complete_robot), robot_options
)


def frame_name(option: str, help_: str) -> Callable[[_F], _F]:
    return click.option(option, metavar="NAME", help=help_, shell_complete=complete_frame)


frame_option = frame_name("--frame", "Link or joint to compute. Default: the robot's tip.")
path_options = together(
    frame_name("--base", "Link or joint where the path begins. Default: the robot's base frame."),
    frame_name("--tip", "Link or joint where the path ends. Default: the robot's tip."),
)


class _ReferenceName(click.Choice):  # type: ignore[type-arg]  # the class is generic from click 8.2 on
    """The name of a reference frame; the error for an unknown name refers to the explanation."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            self.fail(f"{error.message.rstrip('.')}; {QuestionsSection.REFERENCE_FRAMES}", param, ctx)


reference_option = click.option(
    "--reference",
    type=_ReferenceName(REFERENCES, case_sensitive=False),
    default="local_world_aligned",
    show_default=True,
    help="Reference frame of the result, as in Pinocchio.",
)
verify_option = click.option(
    "--verify/--no-verify", default=True, help="Check each result with Pinocchio (default)."
)
oracle_option = click.option(
    "--oracle",
    type=click.Choice(tuple(ORACLES)),
    default="pinocchio",
    help="Library that checks the results: Pinocchio (default) or MuJoCo.",
)
seed_option = click.option(
    "--seed", type=Whole(0), default=0, show_default=True, help="Seed of the value `random`."
)
_VALUES = (
    "Configuration: numbers '0,30deg,pi/2', names 'shoulder=30deg,elbow=0.5', a pose 'neutral' or 'ready',"
    " a pose with changes 'ready,elbow=0.5', a batch '@FILE.csv', 'random' or 'random:N'."
)
q_option = click.option("--q", metavar="VALUES", default="neutral", show_default=True, help=_VALUES)
v_option = click.option(
    "--v", metavar="VALUES", default="neutral", help="Joint velocities, written like --q; `neutral` is zero."
)
a_option = click.option(
    "--a",
    metavar="VALUES",
    default="neutral",
    help="Joint accelerations, written like --q; `neutral` is zero.",
)

convention_option = click.option(
    "--convention",
    metavar="NAME|FILE",
    help="Convention of --q, --v, --a, --trajectory and of the result: the name of a tool (`urdfkin order`"
    " lists them), or a TOML file.",
)
#: This --convention is for commands that convert only the joint values that they read.
convention_of_input_option = click.option(
    "--convention",
    metavar="NAME|FILE",
    help="Convention of the joint values that are read: the name of a tool (`urdfkin order` lists them), or"
    " a TOML file.",
)


def trajectory_option(help_: str) -> Callable[[_F], _F]:
    files = (
        "CSV with the columns t, NAME, v:NAME and a:NAME for each joint, with units as in 'elbow [deg]';"
        " or .npz with the arrays t, q, v and a"
    )
    return click.option(
        "--trajectory", type=click.Path(path_type=Path), metavar="FILE", help=f"{help_} File: {files}."
    )


def schema_option(layout: str, what: str) -> Callable[[_F], _F]:
    """Make the option --schema, which prints the JSON Schema of a layout such as "urdfkin.module:SAME"."""

    def show(context: click.Context, _: click.Parameter, wanted: bool) -> None:
        if wanted and not context.resilient_parsing:
            module, name = layout.split(":")
            click.echo(getattr(importlib.import_module(module), name).schema_text(), nl=False)
            context.exit()

    help_ = f"Print the JSON Schema of {what} and exit."
    return click.option("--schema", is_flag=True, expose_value=False, callback=show, help=help_)


def conversion_of(robot: Robot, name: str | None) -> Conversion | None:
    return None if name is None else robot.convention(name)


def read_motion(robot: Robot, path: Path, convention: str | None) -> Trajectory:
    """Read a trajectory with joint velocities and accelerations, and write remarks about it to stderr."""
    from urdfkin.robot.trajectory import read_trajectory

    motion = read_trajectory(robot, path, convention=convention)
    tell_notes(motion)
    tell_limits(robot, motion.q)
    return motion


def tell_notes(motion: Trajectory) -> None:
    """Write remarks about a trajectory to stderr, for example how v and a were computed."""
    for note in motion.notes:
        say(f"warning: {note}", err=True)
    if motion.rates != "as given":
        say(f"rates {motion.derivation()}", err=True)


def tell_limits(robot: Robot, q: FloatArray) -> None:
    """Write a warning to stderr for each joint outside its limits."""
    for line in robot.limit_violations(q):
        say(f"warning: {line}", err=True)


def said_of(robot: Robot) -> dict[str, Any]:
    """Return the robot's locked joints, for the JSON output."""
    return {"lock": dict(robot.origin.lock)} if robot.origin.lock else {}


@dataclass(frozen=True, slots=True)
class Inputs:
    """A robot, a frame and the values to compute with.

    Attributes:
        q: (n, n_q) configurations, rad or m.
        v: (n, n_v) joint velocities.
        a: (n, n_v) joint accelerations.
        t: (n,) times of a trajectory in s, or None.
        base: Motion of the root link, from the file of --trajectory or from the --base options. None: not
            given.
        said: Other settings that affect the result, for example `{"relative_to": "base"}`. The title of a
            table and the JSON output list these settings.
        conversion: The conversion that --convention requests; None for urdfkin's own convention.
        along: Whether the samples come from --trajectory. CSV output then has one line for each sample.
    """

    robot: Robot
    frame: str
    q: FloatArray
    v: FloatArray
    a: FloatArray
    t: FloatArray | None = None
    base: BaseMotion | None = None
    said: Mapping[str, Any] = field(default_factory=dict)
    conversion: Conversion | None = None
    along: bool = False

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        return (self.conversion or self.robot).coordinate_names

    @property
    def rate_names(self) -> tuple[str, ...]:
        return (self.conversion or self.robot).rate_names

    def converted(self) -> Inputs:
        """Return a copy with q, v and a in the convention of --convention."""
        if self.conversion is None:
            return self
        q, v, a = self.conversion.to(self.q, self.v, self.a)
        return replace(self, q=q, v=v, a=a).saying(convention=self.conversion.convention.name)

    def saying(self, **more: Any) -> Inputs:
        """Return a copy with more settings in `said`."""
        return replace(self, said={**self.said, **more})


def load_robot(source: str, *, verify: bool = True, oracle: OracleName = "pinocchio", **how: Any) -> Robot:
    """Load a robot with the options of the command line; `how` overrides them. Warnings go to stderr."""
    from urdfkin.robot.loading import load
    from urdfkin.urdf.findings import UrdfWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = load(source, **how_to_load() | how, verify=verify, oracle=oracle)
    for warning in caught:
        of_the_file = issubclass(warning.category, UrdfWarning)
        say(f"{'' if of_the_file else 'urdfkin: warning: '}{warning.message}", err=True)
    return robot


def load_several(*sources: str) -> tuple[Robot, ...]:
    """Load a command's robots; `--xacro-arg` applies to .xacro files, `--variant` to USD files.

    UsageError is raised if two of the robots are `-`, that is, standard input.
    """
    from urdfkin.urdf.sources import is_usd, is_xacro

    if sources.count("-") > 1:
        raise click.UsageError("only one of the robots can come from standard input")

    def others(source: str) -> dict[str, Any]:
        """Return arguments with which `load` ignores the options for file formats of the other robots."""
        none: dict[str, Any] = {}
        if not is_xacro(source) and any(map(is_xacro, sources)):
            none["xacro_args"] = None
        if not is_usd(source) and any(map(is_usd, sources)):
            none |= {"variant": {}, "articulation": None}
        return none

    return tuple(load_robot(source, **others(source)) for source in sources)


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
    """Read the values of q, v and a from the command line.

    If --q, --v and --a name several samples, their numbers of samples must be equal; a single sample is
    repeated. If `conversion` is given, it converts the values to urdfkin's convention. Error messages name
    `option` as the source of q.

    Raises:
        InputError: A number is invalid, or there are too few or too many numbers. The numbers of samples
            differ. Or --seed has no effect.
        SourceError: a file that cannot be read.
    """
    import numpy as np

    if not any(text.startswith("random") for text in (q, v, a)):
        reject_unused_options(click.get_current_context(), ("seed",), "without a random --q, --v or --a")
    rng = np.random.default_rng(seed)
    given = (("q", q, option), ("v", v, "--v"), ("a", a, "--a"))
    rows = [_values(robot, letter, text, where, rng, conversion) for letter, text, where in given]
    lengths = {len(part) for part in rows if len(part) != 1}
    if len(lengths) > 1:
        raise InputError(
            "batches of --q, --v and --a have different lengths",
            found=", ".join(str(len(part)) for part in rows),
        )
    n = lengths.pop() if lengths else 1
    q_, v_, a_ = (np.ascontiguousarray(np.broadcast_to(part, (n, part.shape[1]))) for part in rows)
    if conversion is not None:
        q_, v_, a_ = conversion.from_(q_, v_, a_)
    tell_limits(robot, q_)
    return Inputs(robot, frame or robot.tip_frame, q_, v_, a_, said=said_of(robot), conversion=conversion)


def _values(
    robot: Robot, letter: str, text: str, where: str, rng: Any, conversion: Conversion | None
) -> FloatArray:
    """Return the values of --q, --v or --a as an array with one row for each sample."""
    from urdfkin.model.configuration import coordinate_layout, sample
    from urdfkin.robot.trajectory import column_units

    known = conversion or robot
    names = known.coordinate_names if letter == "q" else known.rate_names
    word, _, count = text.partition(":")
    if word == "random":
        n = _count(where, count) if count else _RANDOM_SAMPLES
        if letter != "q":
            found: FloatArray = rng.standard_normal((n, len(names)))
            return found
        drawn = sample(robot.tree, n, rng)
        return conversion.to(drawn) if conversion else drawn
    if text.startswith("@"):
        return read_batch(Path(text[1:]), where, (names,), column_units(robot, letter, conversion))[0]
    layout = conversion.layout(letter) if conversion else coordinate_layout(robot.tree, letter)
    return layout.read(text, where)[None]


def _count(where: str, text: str) -> int:
    count = parse_int(text)
    if count is None or count < 1:
        raise InputError("N in random:N must be a whole number, at least 1", where=where, found=repr(text))
    return count


def read_batch(
    path: Path, option: str, layouts: Sequence[Sequence[str]], units: Mapping[str, str] | None = None
) -> tuple[FloatArray, Sequence[str]]:
    """Read a CSV file with one sample a line, as an array with one row for each sample.

    If the first line names the columns, they may be in any order. The name of a column in `units` may contain
    a unit, for example "elbow [deg]". The second result is the list of column names from `layouts` whose
    length is the number of columns in the file.
    """
    import numpy as np

    from urdfkin.robot.trajectory import read_columns, width_of

    text = _standard_input() if str(path) == "-" else read_text(path, MOST_DATA, pipes=True)
    width = width_of(text, str(path)) if len(layouts) > 1 else None
    names = next((names for names in layouts if len(names) == width), layouts[0])
    columns = read_columns(text, str(path), option, names, units=units)
    found = np.stack([columns[name] for name in names], axis=-1) if names else np.empty((0, 0))
    if not len(found):
        raise InputError(
            "no samples",
            where=str(path),
            remedy="write one line for each sample, with numbers separated by commas",
        )
    return np.ascontiguousarray(found), names


def _standard_input() -> str:
    try:
        return read_standard_input(MOST_DATA).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SourceError("cannot be read", where="-", found=f"text that is not UTF-8 ({error})") from None


# -- the motion of the root link ----------------------------------------------------------------------

_POSITION = ("x", "y", "z")
_RPY = (*_POSITION, "roll", "pitch", "yaw")
_QUATERNION = (*_POSITION, "qx", "qy", "qz", "qw")
_RATES = ("vx", "vy", "vz", "wx", "wy", "wz")

_OPTIONS = {
    "q": click.option(
        "--base-placement",
        metavar="VALUES",
        help="Pose of the root link in the world: x,y,z,roll,pitch,yaw (m, rad), x,y,z,qx,qy,qz,qw, or"
        " @FILE.csv.",
    ),
    "v": click.option(
        "--base-velocity",
        metavar="VALUES",
        help="Velocity of the root link: vx,vy,vz,wx,wy,wz in the world's axes, m/s and rad/s, or @FILE.csv.",
    ),
    "a": click.option(
        "--base-acceleration",
        metavar="VALUES",
        help="Classical acceleration of the root link: ax,ay,az,alphax,alphay,alphaz in the world's"
        " axes, m/s^2 and rad/s^2, or @FILE.csv.",
    ),
}


def base_options(inputs: str) -> Callable[[_F], _F]:
    """Make the options for the base's motion, for a quantity of q, v and a; `with_base` reads them."""
    return together(*(_OPTIONS[letter] for letter in inputs))


def with_base(
    x: Inputs, placement: str | None = None, velocity: str | None = None, acceleration: str | None = None
) -> Inputs:
    """Return the inputs with the motion of the base, if any was given; one motion may apply to all samples.

    Raises:
        InputError: A number is invalid, or there are too few or too many numbers. A quaternion is not of
            length 1. Or the numbers of samples differ.
        SourceError: a file that cannot be read.
    """
    import numpy as np

    from urdfkin.model.base_motion import BaseMotion

    if placement is None and velocity is None and acceleration is None:
        return x
    still = "0,0,0,0,0,0"
    T = _placements(*_rows(placement or still, "--base-placement", (_RPY, _QUATERNION)))
    v, _ = _rows(velocity or still, "--base-velocity", (_RATES,))
    a, _ = _rows(acceleration or still, "--base-acceleration", (_RATES,))
    parts = [x.q, x.v, x.a, T, v, a]
    n = max(map(len, parts))
    if any(len(part) not in (1, n) for part in parts):
        raise InputError(
            "the batches of q, v, a and the base motion have different lengths",
            found=", ".join(str(len(part)) for part in parts),
        )
    q, v_, a_, *base = (np.ascontiguousarray(np.broadcast_to(part, (n, *part.shape[1:]))) for part in parts)
    inputs = replace(x, q=q, v=v_, a=a_, base=BaseMotion(*base))
    names = "base_placement", "base_velocity", "base_acceleration"
    return inputs.saying(**{name: part.tolist() for name, part in zip(names, base, strict=True)})


def _rows(text: str, option: str, layouts: Sequence[Sequence[str]]) -> tuple[FloatArray, Sequence[str]]:
    """Return the numbers, one row for each sample, and the list of names from `layouts` that fits them."""
    import numpy as np

    from urdfkin.robot.trajectory import numbers

    if text.startswith("@"):
        return read_batch(Path(text[1:]), option, layouts)
    cells = text.split(",")
    names = next((names for names in layouts if len(names) == len(cells)), layouts[0])
    return np.array([numbers(cells, option, names)]), names


def _placements(rows: FloatArray, names: Sequence[str]) -> FloatArray:
    import numpy as np

    from urdfkin.kinematics.rotation import rotation_from_rpy, rotation_of

    T: FloatArray = np.tile(np.eye(4), (len(rows), 1, 1))
    turn = rotation_of if names is _QUATERNION else rotation_from_rpy
    T[:, :3, :3], T[:, :3, 3] = turn(rows[:, 3:]), rows[:, :3]
    return T
