"""Arrays by name from an .npz file, whose every mistake is told with the file and the array.

Motions in time: a line between two configurations, or a table of samples.

A line runs with s = 10 u^3 - 15 u^4 + 6 u^5, u = t / duration, which starts and ends at rest without a step
in the acceleration. Where a table has no rates, they are central differences of its configurations, whose
angles are unwrapped first.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors import InputError, SourceError
from urdfkin.errors.validators import real_number, whole_number
from urdfkin.kinematics.inputs import FloatArray, scalars
from urdfkin.kinematics.rotation.quaternion import angular_velocity_from_quaternion_rates, rotation_of
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import checked
from urdfkin.model.configuration_like import Given
from urdfkin.model.integration import difference, integrate
from urdfkin.model.tree import JointKind, KinematicTree, frozen
from urdfkin.motion.columns import read_columns
from urdfkin.motion.unwrapping import unwrapped
from urdfkin.system.files import MOST_DATA, read_bytes, read_text

if TYPE_CHECKING:
    from urdfkin.robot import Robot


#: An array's shape after its first axis, which counts samples.
Shapes = Mapping[str, tuple[int, ...]]


def read_arrays(path: Path, shapes: Shapes, required: Sequence[str]) -> dict[str, FloatArray]:
    """Arrays (n, ...) of finite numbers, n the same for all; nothing in the file is ever executed.

    Args:
        path: What `numpy.savez` has written.
        shapes: The arrays that may be there.
        required: Those that must.

    Raises:
        SourceError: it cannot be read, or is no such file.
        InputError: an array that is unknown, missing, of another shape, or not of finite numbers.
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
            "no .npz file of numbers", where=str(path), found=str(error), remedy="write it with numpy.savez"
        ) from error
    arrays = {name: scalars(array, f"{path}: {name}") for name, array in given.items()}
    n = len(arrays[required[0]]) if arrays[required[0]].ndim else 0
    for name, array in arrays.items():
        if array.shape != (n, *shapes[name]):
            expected = ", ".join(map(str, ("n", *shapes[name])))
            raise InputError(
                f"{name} has the shape ({expected})", where=str(path), found=f"{array.shape}, where n is {n}"
            )
    return arrays


def _check_names(path: Path, names: Sequence[str], shapes: Shapes, required: Sequence[str]) -> None:
    unknown = [name for name in names if name not in shapes]
    missing = [name for name in required if name not in names]
    if unknown or missing:
        wrong = {"unknown": unknown, "missing": missing}
        raise InputError(
            "other arrays than a trajectory has",
            where=str(path),
            found="; ".join(f"{word}: {', '.join(found)}" for word, found in wrong.items() if found),
            remedy=f"name them {', '.join(shapes)}; there must be {', '.join(required)}",
        )


#: Fewer samples than this have no second difference.
_FEWEST = 3
#: Of an .npz file: the fields of `BaseMotion`.
_BASE = "base_placement", "base_velocity", "base_acceleration"


@dataclass(frozen=True, eq=False)
class Trajectory:
    """n samples of a robot's motion.

    Attributes:
        t: (n,) seconds, increasing.
        q: (n, nq).
        v: (n, nv).
        a: (n, nv).
        rates: Where v and a come from, in words.
        exact: Whether v and a are the derivatives of q to rounding; else nobody knows how close they are.
        notes: What a person must know about how the samples were read, a line each.
        base: How the root link moves, a batch of n; None if it stands still at the world's origin.
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
    """A straight line in joint space from rest to rest; planar and floating joints move along one screw.

    Args:
        robot: The robot.
        start: (nq,) rad, m.
        end: (nq,); continuous joints make all turns on the way, planar and floating ones none.
        duration: Seconds.
        samples: How many, ends included.

    Raises:
        InputError: a duration that is not positive, fewer than three samples.

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
            f"a line needs a duration above 0 and {_FEWEST} samples", found=f"{duration} s, {samples}"
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
    # Along one screw the rates in the moving frame keep their directions: they are s' and s'' times the step.
    q = integrate(robot.tree, q_0, s * step)
    return Trajectory(frozen(t), frozen(q), frozen(s_1 * step), frozen(s_2 * step), "of the line", exact=True)


def read_trajectory(robot: Robot, path: Path, *, with_base: bool = False) -> Trajectory:
    """Samples from a CSV file whose first line names the columns, or from the arrays of an .npz file.

    In a CSV file `t` holds seconds, a coordinate's name holds q, `v:NAME` and `a:NAME` hold rates and their
    rates. In an .npz file these are t (n,), q (n, nq), v and a (n, nv). Without t, samples are a second
    apart. v and a are there both or neither: where there are none, the wraps are taken out of the angles of
    continuous, planar and floating joints, and the rates are central differences.

    Args:
        robot: The robot.
        path: The file; its ending says which of the two.
        with_base: Whether an .npz file may also say how the root link moves, by base_placement (n, 4, 4),
            base_velocity and base_acceleration (n, 6), all three of them (`BaseMotion`).

    Raises:
        SourceError: the file cannot be read.
        InputError: a column or array that is unknown, missing or twice there, a number that is none, time
            that does not increase, or too few samples.
    """
    archive = path.suffix.lower() == ".npz"
    data = _arrays(robot, path, with_base=with_base) if archive else _table(robot, path)
    q = data["q"]
    if len(q) < _FEWEST:
        raise InputError(f"{_FEWEST} samples are the least", where=str(path), found=str(len(q)))
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
        words += f", after wraps were taken out of {', '.join(found.joints)}"
    rows = frozen(t), frozen(found.q), frozen(v), frozen(_gradient(v, t))
    return Trajectory(*rows, words, notes=found.notes, base=base)


def _table(robot: Robot, path: Path) -> dict[str, FloatArray]:
    """What a CSV file has of t, q, v and a."""
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
    """What an .npz file has of them, and of the base."""
    shapes = {"t": (), "q": (robot.nq,), "v": (robot.nv,), "a": (robot.nv,)}
    base = dict(zip(_BASE, ((4, 4), (6,), (6,)), strict=True)) if with_base else {}
    data = read_arrays(path, shapes | base, ["q"])
    for together in (("v", "a"), tuple(base)):
        missing = [name for name in together if name not in data]
        if 0 < len(missing) < len(together):
            raise InputError(
                f"{', '.join(together)} are there together or not at all",
                where=str(path),
                found=f"no {', '.join(missing)}",
            )
    return data


def _rates(tree: KinematicTree, q: FloatArray, t: FloatArray) -> FloatArray:
    """(n, nv) central differences; those of planar and floating joints in the moving frame."""
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
