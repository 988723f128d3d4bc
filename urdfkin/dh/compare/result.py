"""What a comparison found: cells, what was fitted, and how far the tip is off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from urdfkin.dh.table import DHTable
from urdfkin.kinematics.roundings import EPS, of_a_fit

#: Metres for each metre of reach, and radians, that changed cells may leave and explain all of a difference:
#: far above what a fit rounds, far below the last digit of any sheet.
EXPLAINED = 1e-9
#: Radians, or of the reach: fitted numbers are shown no finer, however well the table fits.
_FINEST = 1e-12
#: By how much more than half a digit a half may be, a decimal that was read as a double and subtracted.
_HALF = 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class CellDifference:
    """One cell that is not the URDF's.

    Attributes:
        row: Index of the row in the reference table, from 0.
        joint: Name of the joint in the URDF.
        cell: "a", "alpha", "d", "theta" or "beta".
        reference: The table's value, metres or radians.
        urdf: What it would have to be.
        tip: Metres: how far this cell alone moves the tip, at the worst of the samples.
        last_digit: Half a unit of the last digit that the table's file gives, metres or radians; 0 where the
            value was written exactly, or how it was written is not known.
    """

    row: int
    joint: str
    cell: str
    reference: float
    urdf: float
    tip: float
    last_digit: float = 0.0

    @property
    def difference(self) -> float:
        """URDF less reference, metres or radians."""
        return self.urdf - self.reference

    @property
    def is_rounding(self) -> bool:
        """Whether the table could not have said it better with the digits that it gives."""
        return abs(self.difference) <= self.last_digit * _HALF


@dataclass(frozen=True, slots=True)
class TakenUp:
    """What fitting gave to one end of a table, away from what is written: metres and radians."""

    metres: float
    radians: float


class MistakeKind(StrEnum):
    """How a table was mistyped."""

    SIGN = "sign"
    RIGHT_ANGLE = "right angle"
    EXCHANGED = "rows exchanged"
    REVERSED = "rows reversed"


@dataclass(frozen=True, slots=True)
class Fitted:
    """What has to be fitted for a table to agree.

    Attributes:
        base: Whether the base is.
        tool: Whether the tool is.
        zeros: How many joints have another zero.
        reversed: How many joints count the other way.
    """

    base: bool = False
    tool: bool = False
    zeros: int = 0
    reversed: int = 0

    @property
    def count(self) -> int:
        """How much that is: each end and each joint's zero and sense is one."""
        return self.base + self.tool + self.zeros + self.reversed

    def __str__(self) -> str:
        ends = [name for name, fitted in (("base", self.base), ("tool", self.tool)) if fitted]
        joints = ((self.zeros, "zero"), (self.reversed, "sense"))
        counted = [f"{count} {name}{'s' * (count > 1)} of joints" for count, name in joints if count]
        return ", ".join([*ends, *counted]) or "nothing"


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """One change of a table after which less has to be fitted.

    Attributes:
        kind: How the table was mistyped.
        rows: Indices of the rows that change, from 0.
        cell: The cell that changes; None where rows change places.
        table: The table after the change.
        fitted: What still has to be fitted.
        metres: How far the tip is then off at the worst of the samples.
        radians: Likewise its orientation.
    """

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: CellDifference | None
    table: DHTable
    fitted: Fitted
    metres: float
    radians: float


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What a comparison found.

    Attributes:
        reference: The table, its joints named as in the URDF, with base, tool, senses and offsets fitted:
            its `placement` takes the URDF's coordinates.
        reach: Metres: the robot's, by which rounding and angles are measured.
        fitted: Whether base, tool, senses and offsets were free.
        senses: Of each joint: the table's variable is sense * q + offset.
        offsets: Likewise, radians or metres.
        base: What fitting gave to the base.
        tool: What it gave to the tool.
        metres: How far the tip is off at the worst of the samples, with what was fitted.
        radians: Likewise its orientation.
        most_metres: How far the tip is off at most at any values of the joints, proven, with what was fitted
            and without what counts as rounding (`urdfkin.dh.compare.proof`).
        most_radians: Likewise its orientation.
        written_metres: Likewise the tip's distance with the table exactly as it is written.
        written_radians: Likewise its orientation.
        differences: The cells that differ, the largest effect at the tip first; the cell of the single
            mistake where there is one.
        instead: The cells that would have to change if nothing were fitted; none if that does not explain
            the URDF, or nothing but the cells of `differences` is to be explained.
        hidden: (row, cell) that base, tool and offsets stand in for: no sample can tell these.
        mistakes: Single changes of the table after which the least has to be fitted, less than without them.
        residual: Metres left when the cells are the URDF's: rounding, unless no cells explain the URDF.
        tolerance: Metres up to which the two are said to agree.
        samples: How many configurations were tried.
    """

    reference: DHTable
    reach: float
    fitted: bool
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: TakenUp
    tool: TakenUp
    metres: float
    radians: float
    most_metres: float
    most_radians: float
    written_metres: float
    written_radians: float
    differences: tuple[CellDifference, ...]
    instead: tuple[CellDifference, ...]
    hidden: tuple[tuple[int, str], ...]
    mistakes: tuple[Mistake, ...]
    residual: float
    tolerance: float
    samples: int

    @property
    def agrees(self) -> bool:
        """Whether the tip is never off by more than the tolerance, nor by its turn times the reach."""
        return self.metres <= self.tolerance and self.radians * self.reach <= self.tolerance

    @property
    def passes(self) -> bool:
        """Whether the table agrees and no single change of it would leave less to be fitted."""
        return self.agrees and not self.mistakes

    @property
    def rounding(self) -> float:
        """Radians, and metres for each metre of the robot's reach, that count as rounding."""
        return EPS * of_a_fit(len(self.reference.rows))

    @property
    def exact(self) -> bool:
        """Whether rounding explains all of the difference, in every configuration: proven."""
        return self.most_metres <= self.rounding * self.reach and self.most_radians <= self.rounding

    @property
    def as_written(self) -> bool:
        """Whether the table is the URDF's as it is written, base, tool and offsets too, to rounding."""
        return self.written_metres <= self.rounding * self.reach and self.written_radians <= self.rounding


def resolution(share: float, radians: float) -> float:
    """A power of ten below which fitted numbers only reflect how well a table fits.

    Args:
        share: How far the tip is off, metres for each metre of reach.
        radians: How far it is turned.
    """
    return float(10.0 ** math.ceil(math.log10(2.0 * max(share, radians, _FINEST))))
