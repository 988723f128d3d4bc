"""Make a trajectory from a line between two configurations, or from samples in a CSV or .npz file.

A line is parameterised by s = 10 u^3 - 15 u^4 + 6 u^5 with u = t / duration. It starts and ends at rest, and
its acceleration is continuous. If a file has no joint velocities, they are computed by central differences of
the configurations, after the angles are unwrapped.

A log often wraps the angle of a wheel to [-pi, pi] or [0, 2 pi]. The jump from one end of this range to the
other is not a motion. Its difference quotient, however, would be a huge joint velocity. The angle of a planar
joint wraps in the same way. The quaternion of a floating joint may change its sign without a change of
orientation.
"""

from __future__ import annotations

import csv
import io
import math
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors import InputError, SourceError
from urdfkin.errors.numbers import parse_float, remedy
from urdfkin.errors.validators import real_number, whole_number
from urdfkin.kinematics.inputs import FloatArray, scalars
from urdfkin.kinematics.rotation.quaternion import angular_velocity_from_quaternion_rates, rotation_of
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import checked
from urdfkin.model.configuration_like import Given, listed, wrong_count
from urdfkin.model.integration import difference, integrate
from urdfkin.model.tree import Joint, JointKind, KinematicTree, frozen
from urdfkin.system.files import MOST_DATA, read_bytes, read_text

if TYPE_CHECKING:
    from urdfkin.robot import Robot


#: Shape of each array, by its name, without the first axis, which is the sample index.
Shapes = Mapping[str, tuple[int, ...]]


def read_arrays(path: Path, shapes: Shapes, required: Sequence[str]) -> dict[str, FloatArray]:
    """Read arrays (n, ...) of finite numbers from an .npz file; n is the same for all.

    Pickled objects are rejected, so no code from the file is executed.

    Args:
        path: A file of `numpy.savez`.
        shapes: The allowed arrays.
        required: Names of the required arrays.

    Raises:
        SourceError: the file cannot be read, or is not an .npz file of numbers.
        InputError: an array is unknown, is missing, has a wrong shape, or contains a number that is not
            finite.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path, MOST_DATA, pipes=True)), allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("a single array")
            _check_names(path, archive.files, shapes, required)
            entries = archive.zip.infolist() if archive.zip else []
            size = sum(entry.file_size for entry in entries)
            if size > MOST_DATA:
                raise ValueError(f"arrays of {size} bytes, more than {MOST_DATA}")
            given = {name: archive[name] for name in archive.files}
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
    arrays = {name: scalars(array, f"{path}: {name}") for name, array in given.items()}
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
            "the arrays in the file are not those of a trajectory",
            where=str(path),
            found="; ".join(f"{word}: {', '.join(found)}" for word, found in wrong.items() if found),
            remedy=f"the possible names are {', '.join(shapes)}; required: {', '.join(required)}",
        )


#: Smallest number of samples, because a second difference needs three samples.
_FEWEST = 3
#: Names of the arrays for the fields of `BaseMotion`, in an .npz file.
_BASE = "base_placement", "base_velocity", "base_acceleration"


@dataclass(frozen=True, eq=False)
class Trajectory:
    """n samples of a robot's motion.

    Attributes:
        t: (n,) seconds, increasing.
        q: (n, nq) configurations.
        v: (n, nv) joint velocities.
        a: (n, nv) joint accelerations.
        rates: Origin of v and a, as text.
        exact: Whether v and a are the derivatives of q up to rounding; if False, their error is unknown.
        notes: Remarks for the user about the samples, for example unwrapped angles; one line each.
        base: Motion of the root link, a batch of n; None if it is fixed at the world's origin.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    rates: str
    exact: bool = False
    notes: tuple[str, ...] = ()
    base: BaseMotion | None = None


def line(robot: Robot, start: Given, end: Given, duration: float, samples: int) -> Trajectory:
    """Return a straight line in joint space from rest to rest.

    Planar and floating joints move along one screw.

    Args:
        robot: The robot.
        start: (nq,) rad, m.
        end: (nq,). Continuous joints make all whole turns between start and end; planar and floating joints
            make no whole turn.
        duration: Seconds.
        samples: Number of samples, including both ends.

    Raises:
        InputError: the duration is not positive, or there are fewer than three samples.

    >>> import urdfkin
    >>> robot = urdfkin.load("ur5")
    >>> motion = line(robot, robot.neutral(), robot.neutral() + 1.0, 2.0, 5)
    >>> motion.q[2].round(3).tolist(), motion.v[[0, -1]].any()
    ([0.5, 0.5, 0.5, 0.5, 0.5, 0.5], np.False_)
    """
    duration = real_number(duration, "the duration")
    samples = whole_number(samples, "samples", 0)
    if duration <= 0.0 or samples < _FEWEST:
        raise InputError(
            f"a line needs a duration above 0 and at least {_FEWEST} samples",
            found=f"{duration} s, {samples}",
        )
    q_0, q_1 = checked(robot.tree, start, "q"), checked(robot.tree, end, "q")
    t = np.linspace(0.0, duration, samples)
    u = (t / duration)[:, np.newaxis]
    s = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    s_1 = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    s_2 = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration**2
    step = difference(robot.tree, q_0, q_1)
    for joint, at, to in zip(robot.tree.joints, robot.tree.q_index, robot.tree.v_index, strict=True):
        if joint.nq == 1:
            step[to] = q_1[at] - q_0[at]
    # Along one screw, velocity and acceleration in the moving frame are s' and s'' times the constant step.
    q = integrate(robot.tree, q_0, s * step)
    return Trajectory(frozen(t), frozen(q), frozen(s_1 * step), frozen(s_2 * step), "of the line", exact=True)


def read_trajectory(robot: Robot, path: Path, *, with_base: bool = False) -> Trajectory:
    """Read samples from a CSV file with column names in its first line, or from an .npz file.

    | Content | CSV columns | .npz array |
    |---|---|---|
    | time, s | `t` | t (n,) |
    | configuration | the names of the coordinates | q (n, nq) |
    | joint velocities | `v:NAME` | v (n, nv) |
    | joint accelerations | `a:NAME` | a (n, nv) |

    Without t, the samples are one second apart. v and a must be given together. Without v and a, the angles
    of continuous, planar and floating joints are unwrapped, and v and a are computed by central differences.

    Args:
        robot: The robot.
        path: The file; the suffix .npz selects the second format.
        with_base: Whether an .npz file may also contain the motion of the root link (`BaseMotion`): the
            arrays base_placement (n, 4, 4), base_velocity (n, 6) and base_acceleration (n, 6), all three
            together.

    Raises:
        SourceError: the file cannot be read.
        InputError: a column or array is unknown, missing or duplicate, a cell is not a number, time does not
            increase, or there are too few samples.
    """
    archive = path.suffix.lower() == ".npz"
    data = _arrays(robot, path, with_base=with_base) if archive else _table(robot, path)
    q = data["q"]
    if len(q) < _FEWEST:
        raise InputError(f"a trajectory needs at least {_FEWEST} samples", where=str(path), found=str(len(q)))
    t = data.get("t", np.arange(len(q), dtype=np.float64))
    if (np.diff(t) <= 0.0).any():
        raise InputError(
            "time must increase", where=str(path), found=f"sample {int(np.argmax(np.diff(t) <= 0.0)) + 1}"
        )
    q = checked(robot.tree, q, "q")
    base = BaseMotion(*(data[name] for name in _BASE)) if _BASE[0] in data else None
    if "v" in data:
        v, a = data["v"], data["a"]
        return Trajectory(frozen(t), frozen(q), frozen(v), frozen(a), "as given", base=base)
    found = unwrapped(robot.tree, q)
    v = _rates(robot.tree, found.q, t)
    words = "by central differences"
    if found.joints:
        words += f", after unwrapping {', '.join(found.joints)}"
    rows = frozen(t), frozen(found.q), frozen(v), frozen(_gradient(v, t))
    return Trajectory(*rows, words, notes=found.notes, base=base)


def _table(robot: Robot, path: Path) -> dict[str, FloatArray]:
    """Return the arrays t, q, v and a that a CSV file contains."""
    columns = {x: [f"{x}:{name}" for name in robot.rate_names] for x in "va"}
    optional = ["t", *columns["v"], *columns["a"]]
    text = read_text(path, MOST_DATA, pipes=True)
    data = read_columns(text, str(path), "a trajectory", robot.coordinate_names, optional, named=True)
    found = {"q": _columns(path, data, robot.coordinate_names)}
    if "t" in data:
        found["t"] = data["t"]
    if any(name in data for name in optional[1:]):
        found |= {x: _columns(path, data, names) for x, names in columns.items()}
    return found


def _arrays(robot: Robot, path: Path, *, with_base: bool) -> dict[str, FloatArray]:
    """Return the arrays t, q, v, a and of the base's motion that an .npz file contains."""
    shapes = {"t": (), "q": (robot.nq,), "v": (robot.nv,), "a": (robot.nv,)}
    base = dict(zip(_BASE, ((4, 4), (6,), (6,)), strict=True)) if with_base else {}
    data = read_arrays(path, shapes | base, ["q"])
    for together in (("v", "a"), tuple(base)):
        missing = [name for name in together if name not in data]
        if 0 < len(missing) < len(together):
            raise InputError(
                f"{', '.join(together)} must be given together",
                where=str(path),
                found=f"no {', '.join(missing)}",
            )
    return data


def _rates(tree: KinematicTree, q: FloatArray, t: FloatArray) -> FloatArray:
    """Return central differences (n, nv); for planar and floating joints they are in the moving frame."""
    slopes = _gradient(q, t)
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
            R = rotation_of(quaternion)
            v[:, to : to + 3] = (R.swapaxes(-1, -2) @ slopes[:, at : at + 3, np.newaxis])[..., 0]
            v[:, to + 3 : to + 6] = angular_velocity_from_quaternion_rates(quaternion, rates, "body")
    return v


def _columns(path: Path, data: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    missing = [name for name in names if name not in data]
    if missing:
        raise InputError("columns are missing", where=f"{path}:1", found=", ".join(missing))
    n = len(next(iter(data.values()), ()))
    return np.stack([data[name] for name in names], axis=-1) if names else np.empty((n, 0))


def _gradient(x: FloatArray, t: FloatArray) -> FloatArray:
    slopes: FloatArray = np.gradient(x, t, axis=0, edge_order=2)
    return slopes


def read_columns(
    text: str,
    where: str,
    what: str,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    named: bool = False,
) -> Mapping[str, FloatArray]:
    r"""Parse CSV text into columns of finite numbers.

    Empty lines and lines that begin with # are skipped. The first line that is not skipped may contain the
    names of the columns, in any order. Without names, the columns are those in `required`, in this order.

    Args:
        text: The content of the file.
        where: Name of the file, for messages.
        what: Name of the table, for messages.
        required: Names of the required columns.
        optional: Names of the optional columns.
        named: Whether the first line must contain the names.

    Returns:
        An array (n,) for each column that is present; n may be zero.

    Raises:
        InputError: a column is unknown, missing or duplicate; a line has a wrong number of cells; or a cell
            is not a finite number in decimal digits.

    >>> read_columns("b,a\n1,2\n3,4\n", "x.csv", "q", ["a", "b"])["a"].tolist()
    [2.0, 4.0]
    """
    rows = list(_rows(text, where))
    names = list(required)
    if rows and (named or _is_header(rows[0][1], names)):
        line, names = rows.pop(0)
        _check_columns(names, f"{where}:{line}", what, required, optional)
    table = np.empty((len(rows), len(names)))
    for k, (line, cells) in enumerate(rows):
        table[k] = numbers(cells, f"{where}:{line}", names)
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def width_of(text: str, where: str) -> int:
    """Return the number of cells in the first line that is not skipped; 0 without such a line."""
    return len(next(_rows(text, where), (0, []))[1])


def numbers(cells: Sequence[str], where: str, names: Sequence[str]) -> list[float]:
    """Parse one number for each name.

    Raises:
        InputError: the number of cells is wrong, or a cell is not a finite number.
    """
    if len(cells) != len(names):
        raise wrong_count(names, len(cells), where)
    values = []
    for name, cell in zip(names, cells, strict=True):
        if (value := parse_float(cell)) is None:
            raise InputError(
                "not a finite number", where=f"{where}, {name}", found=repr(cell.strip()), remedy=remedy(cell)
            )
        values.append(value)
    return values


def _rows(text: str, where: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not skipped, each with its line number."""
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for row in reader:
            if row and not row[0].lstrip().startswith("#"):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise InputError("not valid CSV", where=f"{where}:{reader.line_num}", found=str(error)) from None


def _is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a line contains the names of columns; a joint may have the name "1"."""
    return sorted(cells) == sorted(names) or all(parse_float(cell) is None for cell in cells)


def _check_columns(
    names: Sequence[str], where: str, what: str, required: Sequence[str], optional: Sequence[str]
) -> None:
    known = {*required, *optional}
    wrong = {
        "unknown": [name for name in names if name not in known],
        "missing": [name for name in required if name not in names],
        "duplicate": sorted({name for name in names if names.count(name) > 1}),
    }
    if any(wrong.values()):
        also = f", and optionally {listed(optional)}" if optional else ""
        raise InputError(
            f"the first line must name the columns of {what}",
            where=where,
            found="; ".join(f"{word}: {listed(found)}" for word, found in wrong.items() if found),
            remedy=f"name the columns {listed(required)}{also}",
        )


#: Largest span of a column of wrapped angles: one turn, plus a margin for angles rounded to two digits.
_ONE_TURN = math.tau + 0.02
#: A step larger than this is ambiguous, because the step in the other direction is less than twice as long.
_AMBIGUOUS = math.tau / 3.0

#: A whole turn of the mimicked joint shifts a mimic joint. A shift below this number (radians or metres) is
#: rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Unwrapped:
    """Unwrapped configurations.

    Attributes:
        q: (n, nq) configurations.
        joints: Names of the joints with changed coordinates.
        notes: Remarks for the user, one line each.
    """

    q: FloatArray
    joints: tuple[str, ...]
    notes: tuple[str, ...]


def unwrapped(tree: KinematicTree, q: FloatArray) -> Unwrapped:
    """Unwrap the angles of continuous, planar and floating joints.

    Between two samples a joint is assumed to turn in the shorter direction. Angles that span more than one
    turn were not wrapped and stay unchanged. Revolute joints stay unchanged too, since they have limits.

    Args:
        tree: The robot.
        q: (n, nq) samples in the order of time.
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
    return Unwrapped(new, tuple(changed), (*notes, *_mimic_notes(tree, q, new)))


def _turning(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Unwrap a continuous or a planar joint; the last coordinate is the angle."""
    angle, notes = own[:, -1], []
    new = own.copy()
    within_one_turn = bool(np.ptp(angle) <= _ONE_TURN)
    if within_one_turn:
        new[:, -1] = _without_jumps(angle)
    step = np.abs(np.diff(new[:, -1]))
    if step.max(initial=0.0) > _AMBIGUOUS:
        notes.append(_ambiguity_note(joint, step, wrapped=within_one_turn))
    return new, notes


def _without_jumps(angle: FloatArray) -> FloatArray:
    """Add whole turns after each step of more than half a turn; leave all other numbers unchanged.

    >>> _without_jumps(np.array([3.0, -3.0, -2.5])).round(4).tolist()
    [3.0, 3.2832, 3.7832]
    """
    step = np.diff(angle)
    turns = np.where(np.abs(step) > math.pi, -np.round(step / math.tau), 0.0)
    return angle + math.tau * np.concatenate(([0.0], np.cumsum(turns)))


def _floating(joint: Joint, own: FloatArray) -> tuple[FloatArray, list[str]]:
    """Unwrap a floating joint: give each quaternion the sign that brings it nearer to the previous one."""
    along = np.sum(own[1:, 3:] * own[:-1, 3:], axis=1)
    new = own.copy()
    new[1:, 3:] *= np.cumprod(np.where(along < 0.0, -1.0, 1.0))[:, np.newaxis]
    step = 2.0 * np.arccos(np.minimum(1.0, np.abs(along)))
    return new, [_ambiguity_note(joint, step, wrapped=True)] if step.max(initial=0.0) > _AMBIGUOUS else []


def _unwrap_note(joint: Joint, own: FloatArray, new: FloatArray) -> str:
    floating = joint.kind is JointKind.FLOATING
    change = np.sign((new * own)[:, 3:].sum(axis=1)) if floating else (new - own)[:, -1]
    k = np.flatnonzero(np.abs(np.diff(change)) > 1.0)
    what = "quaternion changes its sign" if floating else "angle jumps by a whole turn"
    more = f" and {len(k) - 1} more samples" if len(k) > 1 else ""
    return f"joint {joint.name}: its {what} after sample {k[0]}{more}; this is not a motion and was removed"


_UNWRAP = {JointKind.CONTINUOUS: _turning, JointKind.PLANAR: _turning, JointKind.FLOATING: _floating}


def _ambiguity_note(joint: Joint, step: FloatArray, *, wrapped: bool) -> str:
    k, count = int(step.argmax()), int((step > _AMBIGUOUS).sum())
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
    """Yield a note for each mimic joint that moves when the mimicked joint's angle is unwrapped."""
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        rule = joint.mimic
        if rule is None or np.array_equal(q[:, at], new[:, at]):
            continue
        moved = rule.multiplier * (new[:, at] - q[:, at])
        if joint.kind.turns:
            moved = np.remainder(moved + math.pi, math.tau) - math.pi
        if np.abs(moved).max() > _ROUNDING * max(1.0, abs(rule.multiplier)):
            k = int(np.flatnonzero(np.abs(moved) > _ROUNDING)[0])
            yield (
                f"joint {joint.name} follows {rule.leader} with multiplier {rule.multiplier:g}, also"
                f" beyond one turn: from sample {k} on it is at"
                f" {rule.multiplier * new[k, at] + rule.offset:.4g}, not at"
                f" {rule.multiplier * q[k, at] + rule.offset:.4g}"
            )
