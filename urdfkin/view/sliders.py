"""Sliders in a panel: numbers, each within its own limits, in degrees or radians, that follow what is set.

A slider says something only when a hand moves it, and then of its own number alone. What a program sets is
shown by all of them and comes back from none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.model.tree import FloatArray, Joint
from urdfkin.robot import Robot

#: Limits further apart than this are those of wheels: as good as none.
_FAR = 100.0
#: How a slider steps: radians or metres, and degrees.
_STEP, _DEGREES = 0.001, 0.1
_DIGITS, _DIGITS_OF_DEGREES = 4, 2
#: What is offered where a file says nothing: rad/s or m/s, and of their rates, for a joint and a base.
_RATE, _SECOND_RATE = 3.0, 5.0


@dataclass(frozen=True, slots=True)
class Row:
    """One number.

    Attributes:
        at: Its place among all.
        name: What it is called.
        turns: Whether it is an angle, or an angle's rate.
        lower, upper: Between which it is offered.
    """

    at: int
    name: str
    turns: bool
    lower: float
    upper: float


class Sliders:
    """A slider for each row, in a folder of a panel.

    Args:
        gui: Viser's.
        folder: Where they stand.
        rows: What they are for.
        rate: What stands after a unit: "", "/s" or "/s²".
        moved: Told the place and the number when a hand moved one.
    """

    def __init__(
        self, gui: Any, folder: Any, rows: Iterable[Row], rate: str, moved: Callable[[int, float], None]
    ) -> None:
        self._gui, self._folder, self.rows, self._rate, self._moved = gui, folder, list(rows), rate, moved
        self._setting = False
        self.handles: list[Any] = []

    def build(self, values: FloatArray, *, degrees: bool) -> None:
        """Put them there, in these units, in place of those that stand there."""
        places = [handle.order for handle in self.handles] or [None] * len(self.rows)
        for handle in self.handles:
            handle.remove()
        self._degrees = degrees
        with self._folder:
            self.handles = [
                self._slider(row, float(values[row.at]), place)
                for row, place in zip(self.rows, places, strict=True)
            ]

    def _slider(self, row: Row, value: float, place: float | None) -> Any:
        scale = self._scale(row)
        lower, upper = self._range(row, value)
        unit = ("deg" if self._degrees else "rad") if row.turns else "m"
        handle = self._gui.add_slider(
            f"{row.name} [{unit}{self._rate}]",
            min=scale * lower,
            max=scale * upper,
            step=_DEGREES if row.turns and self._degrees else min(_STEP, (upper - lower) / 100),
            initial_value=scale * value,
            order=place,
        )
        handle.precision = _DIGITS_OF_DEGREES if row.turns and self._degrees else _DIGITS
        handle.on_update(lambda _: self._said(row, handle))
        return handle

    def _said(self, row: Row, handle: Any) -> None:
        if not self._setting:
            self._moved(row.at, float(handle.value) / self._scale(row))

    def show(self, values: FloatArray) -> None:
        """Put every slider where its number is; one beyond its limits moves the slider's end."""
        self._setting = True
        try:
            for row, handle in zip(self.rows, self.handles, strict=True):
                value, scale = float(values[row.at]), self._scale(row)
                lower, upper = (scale * end for end in self._range(row, value))
                if (handle.min, handle.max) != (lower, upper):
                    handle.min, handle.max = lower, upper
                # A slider that a hand has just put there keeps what it says, to the digit.
                if float(handle.value) / scale != value:
                    handle.value = scale * value
        finally:
            self._setting = False

    def _scale(self, row: Row) -> float:
        return math.degrees(1.0) if row.turns and self._degrees else 1.0

    @staticmethod
    def _range(row: Row, value: float) -> tuple[float, float]:
        lower, upper = min(row.lower, value), max(row.upper, value)
        return lower, upper if upper > lower else lower + _STEP


def coordinate_rows(robot: Robot) -> list[Row]:
    """A row for each coordinate that a slider can hold, within its joint's own limits: no quaternion's."""
    rows = []
    for joint, at in zip(robot.tree.joints, robot.tree.q_index, strict=True):
        for k in range(min(joint.nq, 3)):
            turns = _turns(joint, k)
            lower, upper = _limits(joint, math.pi if turns else 1.0)
            rows.append(Row(at + k, robot.coordinate_names[at + k], turns, lower, upper))
    return rows


def rate_rows(robot: Robot, *, second: bool) -> list[Row]:
    """A row for each rate, or rate of a rate."""
    rows = []
    for joint, at in zip(robot.tree.joints, robot.tree.v_index, strict=True):
        for k in range(joint.nv):
            most = _SECOND_RATE if second else _RATE
            if not second and joint.limit is not None and 0.0 < joint.limit.velocity < _FAR:
                most = joint.limit.velocity
            turns = k >= 3 if joint.nv == 6 else _turns(joint, k)
            rows.append(Row(at + k, robot.rate_names[at + k], turns, -most, most))
    return rows


def _turns(joint: Joint, k: int) -> bool:
    return joint.kind.turns or (joint.nv == 3 and k == 2)


def _limits(joint: Joint, otherwise: float) -> tuple[float, float]:
    limit = joint.limit
    if limit is None or joint.kind.value == "continuous" or not limit.upper - limit.lower < _FAR:
        return -otherwise, otherwise
    return limit.lower, limit.upper


def within_limits(robot: Robot, q: FloatArray) -> FloatArray:
    """The configuration nearest to `q` that every joint's limits allow, leaving quaternions alone."""
    out = np.array(q, dtype=np.float64)
    for row in coordinate_rows(robot):
        out[row.at] = min(max(out[row.at], row.lower), row.upper)
    return out


def written(values: FloatArray) -> str:
    """Numbers as `--q` and `set_q` take them, to the last bit."""
    return ",".join(repr(float(value)) for value in values)
