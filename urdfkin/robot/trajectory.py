"""Make trajectories from two configurations, or from the samples in a CSV or .npz file.

*Line.* A straight line between two configurations has the parameter s, with u = t / duration:

    s = 10 u^3 - 15 u^4 + 6 u^5

The motion starts and ends at rest, and the acceleration is continuous.

*Differences.* Joint velocities that a file lacks are central differences of the configurations. Their error
is proportional to the square of the time step. Joint accelerations from configurations have a larger error at
the first and last sample, proportional to the time step. To estimate all errors, the differences are also
computed from every second sample.

*Unwrapping.* In a log, the angle of a wheel or of a planar joint is often wrapped to [-pi, pi] or [0, 2 pi].
At the end of this range, a wrapped angle jumps by one turn. The quaternion of a floating joint may change its
sign without a change of orientation. These jumps are removed first, because central differences would turn
them into large, wrong velocities.
"""

from __future__ import annotations

import csv
import io
import math
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors import InputError, QuestionsSection, RangeError, SourceError, UrdfkinError
from urdfkin.errors.numbers import (
    UNIT_SHORT_NAMES,
    number_remedy,
    parse_float,
    parse_quantity,
    radians_from_degrees,
)
from urdfkin.errors.validators import as_finite_float, as_instance, as_int, as_path
from urdfkin.kinematics.inputs import FloatArray, as_finite
from urdfkin.kinematics.rotation import angular_velocity_from_quaternion_rates, rotation_from_quaternion
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import coordinate_layout, parse_finite
from urdfkin.model.configuration_like import ConfigurationLike, join_names, wrong_count_error
from urdfkin.model.integration import difference, integrate
from urdfkin.model.tree import Joint, JointKind, KinematicTree, freeze
from urdfkin.system.files import MAX_DATA_BYTES, read_bytes, read_text

if TYPE_CHECKING:
    from urdfkin.model.conventions import Convention, Conversion
    from urdfkin.robot import Robot


#: Shape of one sample in each array, for example `(nq,)` for q.
Shapes = Mapping[str, tuple[int, ...]]


def read_arrays(path: Path, shapes: Shapes, required: Sequence[str]) -> dict[str, FloatArray]:
    """Read arrays (n, ...) of finite numbers from an .npz file; n is the same for all arrays.

    Pickled objects are rejected, because unpickling can execute code from the file.
    """
    try:
        archive = np.load(io.BytesIO(read_bytes(path, MAX_DATA_BYTES, pipes=True)), allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError("a single array")
        with archive:
            _check_names(path, archive.files, shapes, required)
            entries = archive.zip.infolist() if archive.zip else []
            size = sum(entry.file_size for entry in entries)
            if size > MAX_DATA_BYTES:
                raise ValueError(f"arrays of {size} bytes, more than {MAX_DATA_BYTES}")
            given = {name: archive[name] for name in archive.files}
    except UrdfkinError:  # An InputError is a ValueError.
        raise
    except (
        ValueError,
        EOFError,
        OSError,
        zipfile.BadZipFile,
        zlib.error,
        NotImplementedError,
        MemoryError,
    ) as error:
        raise SourceError(
            "not an .npz file of numbers",
            where=str(path),
            found=str(error),
            remedy="write it with numpy.savez",
        ) from error
    arrays = {name: as_finite(array, f"{path}: {name}") for name, array in given.items()}
    n = len(arrays[required[0]]) if arrays[required[0]].ndim else 0
    for name, array in arrays.items():
        if array.shape != (n, *shapes[name]):
            expected = ", ".join(map(str, ("n", *shapes[name])))
            raise InputError(
                f"{name} must have the shape ({expected})",
                where=str(path),
                found=f"{array.shape} with n = {n}",
            )
    return arrays


def _check_names(path: Path, names: Sequence[str], shapes: Shapes, required: Sequence[str]) -> None:
    unknown = [name for name in names if name not in shapes]
    missing = [name for name in required if name not in names]
    if unknown or missing:
        wrong = {"unknown": unknown, "missing": missing}
        raise InputError(
            "the file has unknown arrays or lacks an array",
            where=str(path),
            found="; ".join(f"{word}: {', '.join(found)}" for word, found in wrong.items() if found),
            remedy=f"the possible names are {', '.join(shapes)}; required: {', '.join(required)}",
        )


#: Minimum number of samples; a second difference needs three.
_MIN_SAMPLES = 3
#: Maximum number of samples. More samples do not fit in memory.
_MAX_SAMPLES = 10**9
#: Names of the .npz arrays with the root link's pose, velocity and acceleration.
_BASE = "base_placement", "base_velocity", "base_acceleration"
#: Maximum rounding error of times, divided by the smallest step.
#: Above this limit, the trajectory has a note.
_TIME_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class TrajectorySamples:
    """The samples in a file, converted to urdfkin's convention.

    The angles are not unwrapped. An array that the file lacks is None.
    """

    where: str
    q: FloatArray
    t: FloatArray | None = None
    v: FloatArray | None = None
    a: FloatArray | None = None
    base: BaseMotion | None = None


@dataclass(frozen=True, eq=False)
class Trajectory:
    """n samples of a robot's motion, from `urdfkin.read_trajectory`.

    Attributes:
        t: (n,) seconds, increasing.
        q: (n, nq) configurations, rad and m.
        v: (n, nv) joint velocities, rad/s and m/s.
        a: (n, nv) joint accelerations, rad/s^2 and m/s^2.
        rates_source: How v and a were obtained, such as "by central differences".
        exact: Whether v and a are the exact derivatives of q, except for rounding. They are not exact if they
            come from a file or from central differences.
        notes: Remarks for the user, one line each. For example, a remark names a joint with unwrapped angles.
        base: Motion of the root link for all n samples; None: fixed at the world origin.
        errors: Estimated largest error of v and estimated largest error of a. None if v and
            a were read from a file or are exact, or if there are fewer than 5 samples.

    >>> import urdfkin
    >>> make_line_trajectory(urdfkin.load("ur5"), "neutral", "ready", 2.0, 101)
    <Trajectory: 101 samples in 2 s, rates of the line>
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    rates_source: str
    exact: bool = False
    notes: tuple[str, ...] = ()
    base: BaseMotion | None = None
    errors: tuple[float, float] | None = None

    def __repr__(self) -> str:
        duration = self.t[-1] - self.t[0]
        return f"<Trajectory: {len(self.t)} samples in {duration:.4g} s, rates {self.rates_source}>"

    def derivation(self) -> str:
        """Return one line that states how v and a were obtained, and their estimated errors.

        >>> import urdfkin
        >>> make_line_trajectory(urdfkin.load("ur5"), "neutral", "ready", 2.0, 101).derivation()
        'of the line'
        """
        if self.errors is None:
            return self.rates_source
        v, a = self.errors
        return (
            f"{self.rates_source}; largest errors about {v:.1e} rad/s or m/s (v) and {a:.1e} rad/s^2 or"
            " m/s^2 (a), estimated by comparison with the results of every second sample"
        )


def _check_robot(robot: object) -> None:
    from urdfkin.robot import Robot

    as_instance(robot, Robot, "robot", "call urdfkin.load")


def make_line_trajectory(
    robot: Robot, start: ConfigurationLike, end: ConfigurationLike, duration: float, samples: int
) -> Trajectory:
    """Return a straight line in joint space between two configurations (nq,), at rest at both ends.

    A planar or floating joint makes a screw motion about a fixed axis. The rotation of this screw motion is
    at most half a turn. A continuous joint moves by `end - start`, even by more than one turn. `duration` is
    in seconds. `samples` is the number of samples, including the first and the last sample.

    Raises:
        InputError: the duration is not above 0 s; `samples` is below 3; a configuration has a wrong length or
            is a batch; or a number is not finite.
        RangeError: the duration is so short that an acceleration is not a finite double.
    """
    _check_robot(robot)
    duration = as_finite_float(duration, "the duration")
    samples = as_int(samples, "samples", 0, _MAX_SAMPLES)
    if duration <= 0.0 or samples < _MIN_SAMPLES:
        raise InputError(
            f"a line trajectory needs a duration above 0 s and at least {_MIN_SAMPLES} samples",
            found=f"{duration} s, {samples}",
        )
    q_0, q_1 = parse_finite(robot.tree, start, "q"), parse_finite(robot.tree, end, "q")
    if q_0.ndim != 1 or q_1.ndim != 1:
        raise InputError("a line needs one start and one end", found=f"shapes {q_0.shape}, {q_1.shape}")
    t = np.linspace(0.0, duration, samples)
    u = (t / duration)[:, np.newaxis]
    s = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    with np.errstate(over="ignore"):
        s_1 = 30.0 * u**2 * (1.0 - u) ** 2 / duration
        s_2 = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration / duration
    if not np.isfinite(s_2).all():
        raise RangeError("the duration is too short", found=f"{duration} s")
    step = difference(robot.tree, q_0, q_1)
    for joint, at, to in zip(robot.tree.joints, robot.tree.q_index, robot.tree.v_index, strict=True):
        if joint.nq == 1:
            step[to] = q_1[at] - q_0[at]
    # For planar and floating joints, `step` is a twist that is constant in the moving frame's axes.
    # Therefore, v = s_1 * step and a = s_2 * step for all joints.
    q = integrate(robot.tree, q_0, s * step)
    return Trajectory(freeze(t), freeze(q), freeze(s_1 * step), freeze(s_2 * step), "of the line", exact=True)


def read_trajectory(
    robot: Robot, path: str | Path, *, convention: str | Path | Convention | None = None
) -> Trajectory:
    r"""Read samples from a CSV file with column names in its first line, or from an .npz file.

    | Content | CSV columns | .npz array |
    |---|---|---|
    | time, s | `t`, `time` or `timestamp` | t (n,) |
    | configuration | the names of the coordinates | q (n, nq) |
    | joint velocities | `v:NAME` | v (n, nv) |
    | joint accelerations | `a:NAME` | a (n, nv) |
    | motion of the root link | | base_placement (n, 4, 4), base_velocity (n, 6), base_acceleration (n, 6) |

    A heading may end with a unit: `elbow [deg]`, `elbow_deg`, `v:elbow [deg/s]`, `lift_mm`, `time [ms]`.
    Without t, the samples are one second apart. If a is missing, urdfkin computes a by central differences.
    If v is missing too, urdfkin also computes v, after unwrapping the angles of continuous, planar and
    floating joints. The attributes `rates_source`, `errors` and `notes` of the result report these
    computations.

    Args:
        robot: The robot.
        path: The file; any suffix but .npz means CSV.
        convention: Convention of the file's names and numbers, as in `Robot.convention`; None: urdfkin's.

    Raises:
        SourceError: the file cannot be read.
        InputError: the header is missing, or a column or an array is unknown, missing or duplicate. Other
            reasons: a cell is not a number, a unit is wrong, time does not increase, or there are too few
            samples.
        UnknownNameError: the convention does not exist.

    >>> import urdfkin
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> arm = urdfkin.load("planar_two_link")
    >>> with TemporaryDirectory() as folder:
    ...     log = Path(folder, "log.csv")
    ...     _ = log.write_text("time,joint_1 [deg],joint_2\n0,0,1\n0.1,9,1\n0.2,18,1\n")
    ...     motion = urdfkin.read_trajectory(arm, log)
    >>> motion.q[2].round(4).tolist(), motion.v[1].round(4).tolist(), motion.rates_source
    ([0.3142, 1.0], [1.5708, 0.0], 'by central differences')
    """
    _check_robot(robot)
    conversion = None if convention is None else robot.convention(convention)
    return complete_rates(robot.tree, read_samples(robot, as_path(path, "path"), conversion))


def read_samples(robot: Robot, path: Path, conversion: Conversion | None = None) -> TrajectorySamples:
    archive = path.suffix.lower() == ".npz"
    data = _read_npz(path, conversion or robot) if archive else _read_table(robot, path, conversion)
    t, v, a = (data.get(name) for name in "tva")
    if a is not None and v is None:
        raise InputError("joint accelerations need joint velocities", where=str(path), found="a without v")
    if t is not None and (np.diff(t) <= 0.0).any():
        found = f"sample {int(np.argmax(np.diff(t) <= 0.0)) + 1}"
        raise InputError("time must increase", where=str(path), found=found)
    q = data["q"]
    if conversion is None:
        q = parse_finite(robot.tree, q, "q")
        v, a = (x if x is None else parse_finite(robot.tree, x, name) for name, x in (("v", v), ("a", a)))
    elif v is None:
        q = conversion.from_(q)
    elif a is None:
        q, v = conversion.from_(q, v)
    else:
        q, v, a = conversion.from_(q, v, a)
    if not len(q):
        raise InputError("no samples", where=str(path), remedy="write one line for each sample")
    base = BaseMotion(*(data[name] for name in _BASE)) if _BASE[0] in data else None
    t, v, a = (x if x is None else freeze(x) for x in (t, v, a))
    return TrajectorySamples(str(path), freeze(q), t, v, a, base)


def complete_rates(tree: KinematicTree, x: TrajectorySamples) -> Trajectory:
    """Return a trajectory, with central differences for missing arrays v and a."""
    n = len(x.q)
    if n < _MIN_SAMPLES:
        raise InputError(f"a trajectory needs at least {_MIN_SAMPLES} samples", where=x.where, found=str(n))
    t = np.arange(n, dtype=np.float64) if x.t is None else x.t
    if x.v is not None and x.a is not None:
        return Trajectory(freeze(t), x.q, x.v, x.a, "as given", base=x.base)
    found = UnwrappedSamples(x.q, (), ()) if x.v is not None else unwrap_angles(tree, x.q)
    v, a = _central_differences(tree, found.q, t, x.v)
    errors = None
    if n >= 2 * _MIN_SAMPLES - 1:
        half = slice(None, None, 2)
        coarse = _central_differences(tree, found.q[half], t[half], None if x.v is None else x.v[half])
        # The error of the acceleration is proportional to h^order, where h is the time step.
        order = 1 if x.v is None else 2
        errors = _estimate_error(v[half], coarse[0], 2), _estimate_error(a[half], coarse[1], order)
    words = "by central differences" if x.v is None else "v as given, a by central differences of v"
    if found.joints:
        words += f", after unwrapping {', '.join(found.joints)}"
    notes = (*found.notes, *_time_notes(t, has_times=x.t is not None))
    rows = freeze(t), freeze(found.q), freeze(v), freeze(a)
    return Trajectory(*rows, words, notes=notes, base=x.base, errors=errors)


def _central_differences(
    tree: KinematicTree, q: FloatArray, t: FloatArray, v: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    v = _central_velocities(tree, q, t) if v is None else v
    return v, _differentiate(v, t)


def _estimate_error(fine: FloatArray, coarse: FloatArray, order: int) -> float:
    """Estimate the largest error of `fine`.

    The error of `coarse` is 2^`order` times as large.
    """
    return float(np.abs(fine - coarse).max(initial=0.0)) / (2.0**order - 1.0)


def _time_notes(t: FloatArray, *, has_times: bool) -> Iterator[str]:
    if not has_times:
        yield "there are no times: the samples are assumed to be one second apart"
        return
    step, rounding = float(np.diff(t).min()), float(np.spacing(np.abs(t).max()))
    if rounding > _TIME_ROUNDING * step:
        yield (
            f"times near {t[-1]:.0f} s are rounded to {rounding:.1g} s, and the smallest step is"
            f" {step:.1g} s; subtract the first time from all times"
        )


def _read_table(robot: Robot, path: Path, conversion: Conversion | None) -> dict[str, FloatArray]:
    names: dict[str, list[str]] = {}
    units = {"t": "s"}
    for x, prefix in (("q", ""), ("v", "v:"), ("a", "a:")):
        own = column_units(robot, x, conversion)
        names[x] = [f"{prefix}{name}" for name in own]
        units |= {f"{prefix}{name}": unit for name, unit in own.items()}
    optional = ["t", *names["v"], *names["a"]]
    if ambiguous := [name for name, count in Counter([*names["q"], *optional]).items() if count > 1]:
        raise InputError(
            "a joint's name is also the name of another column",
            where=str(path),
            found=join_names(ambiguous),
            remedy="use an .npz file",
        )
    what = (
        "a trajectory"
        if conversion is None
        else f"a trajectory in the convention {conversion.convention.name}"
    )
    text = read_text(path, MAX_DATA_BYTES, pipes=True)
    data = read_columns(text, str(path), what, names["q"], optional, requires_header=True, units=units)
    found = {x: _columns(path, data, names[x]) for x in "qva" if x == "q" or any(n in data for n in names[x])}
    return found | ({"t": data["t"]} if "t" in data else {})


def column_units(robot: Robot, letter: str, conversion: Conversion | None = None) -> dict[str, str]:
    """Map the name of each number in q, v or a to its unit, such as "m/s", or to "" for quaternions."""
    layout = conversion.layout(letter) if conversion else coordinate_layout(robot.tree, letter)
    per = {"q": "", "v": "/s", "a": "/s^2"}[letter]
    return {
        name: f"{unit}{per}" if unit else "" for name, unit in zip(layout.names, layout.units, strict=True)
    }


def _read_npz(path: Path, known: Robot | Conversion) -> dict[str, FloatArray]:
    shapes = {"t": (), "q": (known.nq,), "v": (known.nv,), "a": (known.nv,)}
    base = dict(zip(_BASE, ((4, 4), (6,), (6,)), strict=True))
    data = read_arrays(path, shapes | base, ["q"])
    missing = [name for name in base if name not in data]
    if 0 < len(missing) < len(base):
        found = f"no {', '.join(missing)}"
        raise InputError(f"{', '.join(base)} must be given together", where=str(path), found=found)
    return data


def _central_velocities(tree: KinematicTree, q: FloatArray, t: FloatArray) -> FloatArray:
    """Return joint velocities (n, nv).

    The velocities of planar and floating joints are in the axes of the moving frame.
    """
    slopes = _differentiate(q, t)
    v = np.empty((len(q), tree.nv))
    for joint, at, to in zip(tree.joints, tree.q_index, tree.v_index, strict=True):
        if joint.nv == 1:
            v[:, to] = slopes[:, at]
        elif joint.kind is JointKind.PLANAR:
            cosine, sine = np.cos(q[:, at + 2]), np.sin(q[:, at + 2])
            v[:, to] = cosine * slopes[:, at] + sine * slopes[:, at + 1]
            v[:, to + 1] = cosine * slopes[:, at + 1] - sine * slopes[:, at]
            v[:, to + 2] = slopes[:, at + 2]
        elif joint.kind is JointKind.FLOATING:
            quaternion, rates = (x[:, at + 3 : at + 7] for x in (q, slopes))
            R = rotation_from_quaternion(quaternion)
            v[:, to : to + 3] = (R.swapaxes(-1, -2) @ slopes[:, at : at + 3, np.newaxis])[..., 0]
            v[:, to + 3 : to + 6] = angular_velocity_from_quaternion_rates(quaternion, rates, "body")
        elif joint.nv:
            raise NotImplementedError(f"the velocity of a {joint.kind} joint from its coordinates")
    return v


def _columns(path: Path, data: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    missing = [name for name in names if name not in data]
    if missing:
        raise InputError("columns are missing", where=f"{path}:1", found=", ".join(missing))
    n = len(next(iter(data.values()), ()))
    return np.stack([data[name] for name in names], axis=-1) if names else np.empty((n, 0))


def _differentiate(x: FloatArray, t: FloatArray) -> FloatArray:
    return np.gradient(x, t, axis=0, edge_order=2)


def read_columns(
    text: str,
    where: str,
    what: str,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    requires_header: bool = False,
    units: Mapping[str, str] | None = None,
) -> Mapping[str, FloatArray]:
    r"""Parse CSV text into columns (n,) of finite numbers in SI units; n may be zero.

    Empty lines and lines that begin with # are skipped. The first other line may name the columns, in any
    order. A comment above the first number may also name the columns, as in a file of `numpy.savetxt`.
    Otherwise, the columns are `required`. `units` contains the SI unit of each column that may have a unit in
    its heading.

    >>> read_columns("a_deg\n90\n", "x.csv", "q", ["a"], units={"a": "rad"})["a"].tolist()
    [1.5707963267948966]
    """
    rows = _rows(text, where)
    names, written = list(required), list[str]()
    first = next(rows, None)
    if first is not None and not _is_header(first[1], names):
        header = _find_commented_header(text, where, required, optional, units or {})
        if header is not None:
            first, rows = header, chain([first], rows)
    if first is not None and (requires_header or _is_header(first[1], names)):
        line, cells = first
        headings = [_parse_heading(cell, f"{where}:{line}", units or {}) for cell in cells]
        names, written = [name for name, _ in headings], [unit for _, unit in headings]
        if (
            requires_header
            and not {*names} & {*required, *optional}
            and all(parse_float(x) is not None for x in cells)
        ):
            raise InputError(
                f"the header is missing: the first line must name the columns of {what}",
                where=f"{where}:{line}",
                found=f"only numbers: {', '.join(cells[:3])}{', ...' if len(cells) > 3 else ''}",
                remedy=f"add a first line with the column names: {join_names([*optional[:1], *required])}",
            )
        _check_columns(names, cells, f"{where}:{line}", what, required, optional)
    elif first is not None:
        rows = chain([first], rows)
    values = chain.from_iterable(
        parse_numbers(cells, f"{where}:{line}", names, QuestionsSection.JOINT_ORDER) for line, cells in rows
    )
    table = np.fromiter(values, np.float64).reshape(-1, max(1, len(names)))
    found = {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}
    return found | {
        name: _convert_to_si(found[name], unit) for name, unit in zip(names, written, strict=False) if unit
    }


def _find_commented_header(
    text: str, where: str, required: Sequence[str], optional: Sequence[str], units: Mapping[str, str]
) -> tuple[int, list[str]] | None:
    """Return the line and cells of a comment above the first number that names exactly the columns."""
    for line, words in enumerate(text.splitlines(), 1):
        if words.strip() and not words.lstrip().startswith("#"):
            break
        try:
            cells = [cell.strip() for cell in next(csv.reader([words.lstrip().lstrip("#").lstrip()]), [])]
        except csv.Error:
            continue
        if len(cells) < max(1, len(required)):
            continue
        names = [_parse_heading(cell, f"{where}:{line}", units)[0] for cell in cells]
        if {*required} <= {*names} <= {*required, *optional} and len(names) == len({*names}):
            return line, cells
    return None


_TIMES = ("t", "time", "timestamp")
#: Number of time units in one second, by the name of the unit.
_PER_SECOND = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    "ms": 1e3, "us": 1e6, "µs": 1e6, "ns": 1e9,
}  # fmt: skip
#: Patterns of column names that end with a unit: `v:elbow_deg_s`, `a:elbow_rad_per_s2`, `elbow_deg`.
_SUFFIXES = (
    re.compile(r"(.+)_(deg|rad|mm|m)_(?:per_)?(s2?)", re.DOTALL),
    re.compile(r"(.+)_(deg|rad|mm|m|s|ms|us|ns)", re.DOTALL),
)


def _parse_heading(cell: str, where: str, units: Mapping[str, str]) -> tuple[str, str]:
    """Return the column name and the unit in a heading; the unit is "" if it is an SI unit or missing.

    >>> units = {"t": "s", "elbow": "rad", "v:elbow": "rad/s"}
    >>> [_parse_heading(x, "x.csv", units) for x in ("Time [ms]", "elbow_deg", "v:elbow [deg/s]", "wrist")]
    [('t', 'ms'), ('elbow', 'deg'), ('v:elbow', 'deg'), ('wrist', '')]
    """
    if (name := _column_name(cell, units)) in units:
        return name, ""
    found = list[tuple[str, str]]()
    if cell.endswith(("]", ")")):
        at = max(cell.rfind("[" if cell.endswith("]") else "("), 0)
        found.append((cell[:at].rstrip(), cell[at + 1 : -1]))
    matches = (suffix.fullmatch(cell) for suffix in _SUFFIXES)
    found += [(match[1], "/".join(match.groups()[1:])) for match in matches if match]
    for heading, unit in found:
        if (name := _column_name(heading, units)) in units:
            return name, _parse_unit(unit, f"{where}, {cell}", units[name])
    return cell, ""


def _column_name(heading: str, units: Mapping[str, str]) -> str:
    if heading not in units:
        if heading.lower() in _TIMES:
            return "t"
        if heading.startswith("q:"):
            return heading[2:]
    return heading


def _parse_unit(text: str, where: str, expected: str) -> str:
    """Return the short name of the unit `text`: "ms", "deg" also for "deg/s", "" for an SI unit."""
    if expected == "s":
        if (factor := _PER_SECOND.get(text.strip().lower())) is None:
            raise InputError("wrong unit", where=where, found=text, remedy=f"use {', '.join(_PER_SECOND)}")
        return "" if factor == 1.0 else text.strip().lower()
    kind, _, per = expected.partition("/")
    found = parse_quantity(f"1 {text}")
    word = text.lower().replace("°", "deg").partition("/")[0].strip()
    order = ("", "s", "s^2").index(per)
    if (
        found is None
        or word not in UNIT_SHORT_NAMES
        or found.unit != kind
        or found.seconds_exponent not in (0, order)
    ):
        known = {"rad": ("rad", "deg"), "m": ("m", "mm")}.get(kind, ())
        fit = " or ".join("/".join(filter(None, (unit, per))) for unit in known)
        raise InputError("wrong unit", where=where, found=text, remedy=f"use {fit or 'no unit'}")
    return "" if UNIT_SHORT_NAMES[word] == kind else UNIT_SHORT_NAMES[word]


def _convert_to_si(column: FloatArray, unit: str) -> FloatArray:
    if unit == "deg":
        # For k * 15 degrees, `radians_from_degrees` returns the double k * math.pi / 12.
        return np.fromiter(map(radians_from_degrees, column.tolist()), np.float64, len(column))
    return column / _PER_SECOND.get(unit, 1000.0)


def first_cells(text: str, where: str) -> Sequence[str]:
    """Return the cells of the first line, except empty lines and comments; none without such a line."""
    return next(_rows(text, where), (0, []))[1]


def parse_numbers(
    cells: Sequence[str], where: str, names: Sequence[str], question: QuestionsSection | None = None
) -> list[float]:
    """Parse one number for each name."""
    if len(cells) != len(names):
        raise wrong_count_error(names, len(cells), where, question=question)
    values = []
    for name, cell in zip(names, cells, strict=True):
        if (value := parse_float(cell)) is None:
            raise InputError(
                "not a finite number",
                where=f"{where}, {name}",
                found=repr(cell.strip()),
                remedy=number_remedy(cell),
            )
        values.append(value)
    return values


def _rows(text: str, where: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line; skip empty lines and lines that begin with #."""
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for row in reader:
            # A line of blanks is empty; the line `""` has an empty cell.
            is_empty = not row or (len(row) == 1 and row[0].isspace())
            if not is_empty and not row[0].lstrip().startswith("#"):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise InputError("not valid CSV", where=f"{where}:{reader.line_num}", found=str(error)) from None


def _is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a line contains column names, which may be numbers such as "1"."""
    return sorted(cells) == sorted(names) or all(parse_float(cell) is None for cell in cells)


def _check_columns(
    names: Sequence[str],
    headings: Sequence[str],
    where: str,
    what: str,
    required: Sequence[str],
    optional: Sequence[str],
) -> None:
    known, given = {*required, *optional}, Counter(names)
    wrong = {
        "unknown": [name for name in names if name not in known],
        "missing": [name for name in required if name not in given],
        "duplicate": sorted({h for name, h in zip(names, headings, strict=True) if given[name] > 1}),
    }
    if any(wrong.values()):
        also = f", and optionally {join_names(optional)}" if optional else ""
        raise InputError(
            f"the first line must name the columns of {what}",
            where=where,
            found="; ".join(
                f"{word}: {join_names([name or repr(name) for name in found])}"
                for word, found in wrong.items()
                if found
            ),
            remedy=f"name the columns {join_names(required)}{also}",
        )


#: If the samples of a joint span more than this angle (rad), urdfkin does not unwrap them. The margin of 0.02
#: covers the rounding of two angles to two decimals.
_ONE_TURN = math.tau + 0.02
#: If a joint turns by more than this angle (rad) between samples, the direction of rotation is uncertain. For
#: example, rotations by 130 and by -230 degrees lead to the same pose. At 120 degrees, the rotation in the
#: other direction is twice as large.
_MAX_CLEAR_ROTATION = math.tau / 3.0

#: Maximum difference (rad or m) in the value of a mimic joint that counts as a rounding error. For a
#: multiplier m with |m| > 1, the limit is |m| times this value.
_MIMIC_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class UnwrappedSamples:
    q: FloatArray
    joints: tuple[str, ...]
    notes: tuple[str, ...]


def unwrap_angles(tree: KinematicTree, q: FloatArray) -> UnwrappedSamples:
    """Unwrap the angles of continuous, planar and floating joints in samples (n, nq) in the order of time.

    Between two samples, a joint is assumed to turn in the shorter direction. If the samples of an angle span
    more than one turn, the samples stay unchanged.
    """
    new, changed, notes = np.array(q), [], []
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if joint.mimic is not None or joint.kind not in _UNWRAP:
            continue
        own = slice(at, at + joint.kind.nq)
        new[:, own], found = _UNWRAP[joint.kind](joint, q[:, own])
        notes += found
        if not np.array_equal(new[:, own], q[:, own]):
            changed.append(joint.name)
            notes.append(_unwrap_note(joint, q[:, own], new[:, own]))
    return UnwrappedSamples(new, tuple(changed), (*notes, *_mimic_notes(tree, q, new)))


def _unwrap_joint_angle(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Unwrap the angle of a continuous or planar joint; the angle is the joint's last coordinate."""
    angle, notes = own[:, -1], []
    new = own.copy()
    within_one_turn = bool(np.ptp(angle) <= _ONE_TURN)
    if within_one_turn:
        new[:, -1] = _remove_jumps(angle)
    step = np.abs(np.diff(new[:, -1]))
    if step.max(initial=0.0) > _MAX_CLEAR_ROTATION:
        notes.append(_ambiguity_note(joint, step, wrapped=within_one_turn))
    return new, notes


def _remove_jumps(angle: FloatArray) -> FloatArray:
    """Add whole turns after each step of more than half a turn.

    >>> _remove_jumps(np.array([3.0, -3.0, -2.5])).round(4).tolist()
    [3.0, 3.2832, 3.7832]
    """
    step = np.diff(angle)
    turns = np.where(np.abs(step) > math.pi, -np.round(step / math.tau), 0.0)
    return angle + math.tau * np.concatenate(([0.0], np.cumsum(turns)))


def _align_quaternion_signs(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Choose the signs of quaternions so that consecutive quaternions are close."""
    along = np.sum(own[1:, 3:] * own[:-1, 3:], axis=1)
    new = own.copy()
    new[1:, 3:] *= np.cumprod(np.where(along < 0.0, -1.0, 1.0))[:, np.newaxis]
    step = 2.0 * np.arccos(np.minimum(1.0, np.abs(along)))
    return new, [_ambiguity_note(joint, step, wrapped=True)] if step.max(
        initial=0.0
    ) > _MAX_CLEAR_ROTATION else []


def _unwrap_note(joint: Joint, own: FloatArray, new: FloatArray) -> str:
    floating = joint.kind is JointKind.FLOATING
    change = np.sign((new * own)[:, 3:].sum(axis=1)) if floating else (new - own)[:, -1]
    k = np.flatnonzero(np.abs(np.diff(change)) > 1.0)
    what = "quaternion changes its sign" if floating else "angle jumps by a whole turn"
    more = f" and {len(k) - 1} more samples" if len(k) > 1 else ""
    return (
        f"joint {joint.name}: its {what} after sample {k[0]}{more};"
        " urdfkin removed this change, because it is not a motion of the robot"
    )


_UNWRAP = {
    JointKind.CONTINUOUS: _unwrap_joint_angle,
    JointKind.PLANAR: _unwrap_joint_angle,
    JointKind.FLOATING: _align_quaternion_signs,
}


def _ambiguity_note(joint: Joint, step: FloatArray, *, wrapped: bool) -> str:
    k, count = int(step.argmax()), int((step > _MAX_CLEAR_ROTATION).sum())
    more = f", and in {count - 1} more steps" if count > 1 else ""
    assumption = (
        "the shorter direction is assumed, which may be wrong"
        if wrapped
        else "its angles span more than one turn and are not unwrapped"
    )
    return (
        f"joint {joint.name} turns {step[k]:.3g} rad from sample {k} to sample {k + 1}{more}: {assumption};"
        " record more samples per second"
    )


def _mimic_notes(tree: KinematicTree, q: FloatArray, new: FloatArray) -> Iterator[str]:
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        rule = joint.mimic
        if rule is None or np.array_equal(q[:, at], new[:, at]):
            continue
        moved = rule.multiplier * (new[:, at] - q[:, at])
        if joint.kind.turns:
            moved = np.remainder(moved + math.pi, math.tau) - math.pi
        changed = np.abs(moved) > _MIMIC_ROUNDING * max(1.0, abs(rule.multiplier))
        if changed.any():
            k = int(np.flatnonzero(changed)[0])
            yield (
                f"joint {joint.name} mimics {rule.mimicked_joint} with multiplier {rule.multiplier:g};"
                f" unwrapping {rule.mimicked_joint} changes the value of {joint.name}, at sample {k} from"
                f" {rule.multiplier * q[k, at] + rule.offset:.4g} to"
                f" {rule.multiplier * new[k, at] + rule.offset:.4g}"
            )
