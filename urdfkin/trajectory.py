"""Motions in time: a line between two configurations, or a table of samples.

A line runs with s = 10 u^3 - 15 u^4 + 6 u^5, u = t / duration, which starts and ends at rest without a step
in the acceleration. Where a table has no rates, they are central differences of its configurations.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors import InputError, SourceError
from urdfkin.tree import FloatArray, JointKind, frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from urdfkin.robot import Robot

#: Fewer samples than this have no second difference.
_FEWEST = 3


@dataclass(frozen=True, eq=False)
class Trajectory:
    """n samples of a robot's motion.

    Attributes:
        t: (n,) seconds, increasing.
        q: (n, nq).
        v: (n, nv).
        a: (n, nv).
        rates: Where v and a come from, in words.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    rates: str


def line(robot: Robot, start: FloatArray, end: FloatArray, duration: float, samples: int) -> Trajectory:
    """A straight line in joint space from rest to rest.

    Args:
        robot: The robot.
        start: (nq,) rad, m.
        end: (nq,).
        duration: Seconds.
        samples: How many, ends included.

    Raises:
        InputError: a duration that is not positive, fewer than three samples, a floating joint.

    >>> import urdfkin
    >>> robot = urdfkin.load("ur5")
    >>> motion = line(robot, robot.neutral(), robot.neutral() + 1.0, 2.0, 5)
    >>> motion.q[2].round(3).tolist(), motion.v[[0, -1]].any()
    ([0.5, 0.5, 0.5, 0.5, 0.5, 0.5], np.False_)
    """
    if not duration > 0.0 or samples < _FEWEST:
        raise InputError(
            f"a line needs a duration above 0 and {_FEWEST} samples", found=f"{duration} s, {samples}"
        )
    _only_plain_joints(robot)
    q_0, q_1 = robot.checked(start, "q"), robot.checked(end, "q")
    t = np.linspace(0.0, duration, samples)
    u = (t / duration)[:, np.newaxis]
    s = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    s_1 = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    s_2 = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration**2
    step = q_1 - q_0
    return Trajectory(
        frozen(t), frozen(q_0 + s * step), frozen(s_1 * step), frozen(s_2 * step), "of the line, exactly"
    )


def read_trajectory(robot: Robot, path: Path) -> Trajectory:
    """Samples from a CSV file whose first line names the columns.

    `t` holds seconds (without it, samples are a second apart); a coordinate's name holds q; `v:NAME` and
    `a:NAME` hold rates and their rates, all of them or none.

    Raises:
        SourceError: the file cannot be read.
        InputError: a column that is unknown, missing or twice there, a number that is none, time that does
            not increase, too few samples, or a planar or floating joint without rates.
    """
    heads, rows = _cells(path)
    known = ["t", *robot.coordinate_names, *(f"{x}:{name}" for x in "va" for name in robot.rate_names)]
    for head in heads:
        if head not in known or heads.count(head) > 1:
            raise InputError(
                "a column that is unknown or twice there",
                where=f"{path}:1",
                found=repr(head),
                remedy=f"name them t, {', '.join(robot.coordinate_names)}, v:..., a:...",
            )
    data = _numbers(path, heads, rows)
    t = data.get("t", np.arange(len(rows), dtype=np.float64))
    if (np.diff(t) <= 0.0).any():
        raise InputError(
            "time must increase", where=str(path), found=f"sample {int(np.argmax(np.diff(t) <= 0.0)) + 1}"
        )
    q = _columns(path, data, robot.coordinate_names)
    if not any(head.startswith(("v:", "a:")) for head in heads):
        _only_plain_joints(robot)
        v, a, rates = _gradient(q, t), _gradient(_gradient(q, t), t), "by central differences"
    else:
        v, a = (_columns(path, data, [f"{x}:{name}" for name in robot.rate_names]) for x in "va")
        rates = "as given"
    return Trajectory(frozen(t), frozen(robot.checked(q, "q")), frozen(v), frozen(a), rates)


def _only_plain_joints(robot: Robot) -> None:
    for joint in robot.tree.joints:
        if joint.kind in (JointKind.PLANAR, JointKind.FLOATING):
            raise InputError(
                f"a {joint.kind.value} joint's rates are not the rates of its coordinates",
                where=f"joint {joint.name}",
                remedy="give v: and a: columns in a CSV file",
            )


def _cells(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row and not row[0].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError("cannot be read", where=str(path), found=str(error)) from error
    if len(rows) <= _FEWEST:
        raise InputError(f"{_FEWEST} samples are the least, below a line of names", where=str(path))
    return [cell.strip() for cell in rows[0]], rows[1:]


def _numbers(path: Path, heads: list[str], rows: list[list[str]]) -> dict[str, FloatArray]:
    table = np.empty((len(rows), len(heads)))
    for i, row in enumerate(rows):
        if len(row) != len(heads):
            raise InputError(
                f"{len(heads)} cells are expected", where=f"{path}, sample {i}", found=str(len(row))
            )
        for k, cell in enumerate(row):
            try:
                table[i, k] = float(cell)
            except ValueError:
                table[i, k] = math.nan
            if not math.isfinite(table[i, k]):
                raise InputError(
                    "not a finite number", where=f"{path}, sample {i}, {heads[k]}", found=repr(cell)
                )
    return {head: np.ascontiguousarray(table[:, k]) for k, head in enumerate(heads)}


def _columns(path: Path, data: dict[str, FloatArray], names: Sequence[str]) -> FloatArray:
    missing = [name for name in names if name not in data]
    if missing:
        raise InputError("columns are missing", where=f"{path}:1", found=", ".join(missing))
    n = len(next(iter(data.values())))
    return np.stack([data[name] for name in names], axis=-1) if names else np.empty((n, 0))


def _gradient(x: FloatArray, t: FloatArray) -> FloatArray:
    slopes: FloatArray = np.gradient(x, t, axis=0, edge_order=2)
    return slopes
