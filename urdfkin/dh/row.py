"""One row of a table, and the two conventions in which rows are written."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.elements import along_axis, between_axes
from urdfkin.errors import InputError
from urdfkin.errors.questions import Question
from urdfkin.model.tree import FloatArray, JointKind, Limit, Mimic


class Convention(StrEnum):
    """Where a joint's axis stands: z_{i-1} (standard, distal) or z_i (modified, proximal, Craig)."""

    STANDARD = "standard"
    MODIFIED = "modified"


def convention_of(name: str) -> Convention:
    """The convention by name; raises InputError for anything else."""
    try:
        return Convention(name)
    except (ValueError, TypeError):
        raise InputError(
            "unknown convention",
            found=repr(name),
            remedy="say 'standard' or 'modified'",
            question=Question.WHICH_DH_CONVENTION,
        ) from None


@dataclass(frozen=True, slots=True)
class DHRow:
    """One joint: the constant parts of its parameters, metres and radians.

    Attributes:
        a: Length along x: a_i in a standard table, a_{i-1} in a modified one.
        alpha: Turn about x, likewise.
        d: Offset along the joint's axis; the joint's value is added for a prismatic joint.
        theta: Turn about the joint's axis; the joint's value is added for a turning joint.
        kind: Revolute, continuous or prismatic.
        joint: The joint's name.
        sense: +1, or -1 where the row counts the joint's value the other way.
        beta: Turn about y, after alpha: 0 except in a Hayati row.
        mimic: Whom the joint follows; None if it has a coordinate of its own.
        limit: Its bounds, None where there are none.
    """

    a: float
    alpha: float
    d: float
    theta: float
    kind: JointKind
    joint: str
    sense: int = 1
    beta: float = 0.0
    mimic: Mimic | None = None
    limit: Limit | None = None

    def __post_init__(self) -> None:
        where = f"row of joint {self.joint}"
        for name in ("a", "alpha", "d", "theta", "beta"):
            if not math.isfinite(getattr(self, name)):
                raise InputError(
                    f"{name} is not a finite number", where=where, found=str(getattr(self, name))
                )
        if self.sense not in (1, -1):
            raise InputError("the sense is +1 or -1", where=where, found=str(self.sense))
        if not self.kind.has_axis:
            raise InputError(
                "a row is a revolute, continuous or prismatic joint", where=where, found=self.kind.value
            )

    @property
    def cells(self) -> tuple[float, float, float, float, float]:
        """(a, alpha, d, theta, beta)."""
        return (self.a, self.alpha, self.d, self.theta, self.beta)

    @property
    def foot(self) -> float:
        """Metres: how far away four parameters would put the foot of this row's common normal.

        A Hayati row's x reaches the next axis at `a`, where that axis leans by `beta` along x and by `alpha`
        across. The common normal stands across both; its foot lies at a sin(beta) / sin^2(tilt).
        """
        across, along = math.sin(self.alpha) * math.cos(self.beta), math.sin(self.beta)
        return abs(self.a * along) / (across**2 + along**2) if self.beta else 0.0

    @property
    def X(self) -> FloatArray:
        """(4, 4) Tx(a) Rx(alpha) Ry(beta)."""
        return between_axes(self.a, self.alpha, self.beta)

    def S(self, value: ArrayLike = 0.0) -> FloatArray:
        """(..., 4, 4) Rz(theta) Tz(d) with the joint at `value`, rad or m."""
        moved = self.sense * np.asarray(value, dtype=np.float64)
        return (
            along_axis(self.theta + moved, self.d)
            if self.kind.turns
            else along_axis(self.theta, self.d + moved)
        )
