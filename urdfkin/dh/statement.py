"""What snapping moved, said in metres and radians that are guaranteed, and measured besides.

Turning one constant rotation of the chain by an angle eps about a joint's origin moves the tip by at most
eps times the tip's distance from that origin. That distance never exceeds the length of the way: the sum of
the constant offsets in between and the travel of the sliding joints. The changes add up. The bound so holds
for every configuration; nothing in it was sampled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from urdfkin.model.tree import FloatArray


@dataclass(frozen=True, slots=True)
class SnapChange:
    """One constant rotation that was made round.

    Attributes:
        row: Index of the row in which it shows (0 is the first); -1 for the base, the number of rows for the
            tool.
        what: The joint and the quantity.
        angle: By how much everything beyond turned, radians.
        lever: Metres: the tip is never farther from the pivot than this while sliding joints are at zero.
        sliders: Names of the sliding joints beyond the pivot, whose travel lengthens the lever.
    """

    row: int
    what: str
    angle: float
    lever: float
    sliders: tuple[str, ...] = ()

    @property
    def tip(self) -> float:
        """Metres: how far this change moves the tip at most, with the sliding joints at zero."""
        return self.angle * self.lever


@dataclass(frozen=True, slots=True)
class SnapStatement:
    """All that was snapped, and how far the tip moves.

    Attributes:
        tolerance: Radians, as asked for.
        changes: What was moved, base to tip.
        metres: Guaranteed: the tip's position moves by no more, within the limits of sliding joints.
        radians: Guaranteed: its orientation turns by no more.
        per_metre: What each metre of travel of a sliding joint adds, for joints without limits too.
        measured_metres: The largest displacement seen on samples.
        measured_radians: The largest turn seen on them.
        samples: How many.
    """

    tolerance: float
    changes: tuple[SnapChange, ...]
    metres: float
    radians: float
    per_metre: Mapping[str, float]
    measured_metres: float = 0.0
    measured_radians: float = 0.0
    samples: int = 0

    @property
    def rows(self) -> tuple[int, ...]:
        """Rows (from 0) that show a change, in order; -1 is the base, the number of rows the tool."""
        return tuple(sorted({change.row for change in self.changes}))

    def bound(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """(...,) metres: the guarantee at given values (by joint name) of the sliding joints."""
        at_zero = sum(change.tip for change in self.changes)
        travel = [np.abs(values[name]) * rate for name, rate in self.per_metre.items()]
        return np.asarray(at_zero + sum(travel, np.zeros(())), dtype=np.float64)
