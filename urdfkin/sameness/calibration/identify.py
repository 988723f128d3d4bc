"""Which parameters a set of configurations can tell apart, which stand still for that, and why.

A change of parameters that moves no measured number cannot be found: it lies in the null space of the stacked
Jacobian. Its rank is how many numbers can be found, and is decided by what the columns are known to:
a singular value counts when its lower bound (`urdfkin.verify.singular_values`: Weyl, with what the columns
may be off by and what the decomposition leaves) is above 0. There is no tolerance to choose.

A turning joint's frame may slide along its axis and turn about it, a sliding joint's be shifted anywhere and
turn about its direction, if the next frame undoes it: of six for each of n joints and six for the tip, 4 for
each turning and 2 for each sliding joint and 6 can be found (Everett, Driels and Mooring, 1987), of positions
alone 3 fewer, for where the tool points is not seen.

What stands still is chosen place by place, base to tip, by orthogonal elimination: of columns that are nearly
as independent of those kept as the most independent one, the first in the model's order is kept. So no kept
parameter need be large to make up for one that stands still: that is what four parameters of nearly parallel
axes do, hundreds of metres that cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdfkin.model.tree import FloatArray
from urdfkin.sameness.calibration.models import Model
from urdfkin.verify.singular_values import singular_values

#: Of the most independent column: what is as good.
_AS_GOOD = 0.5
#: How many parameters a reason names, and which share of what stands still one does at least.
_NAMED, _SHARE = 3, 1e-6


@dataclass(frozen=True)
class Identification:
    """What can be found.

    Attributes:
        kept: Numbers of the parameters that are fitted: the minimal set.
        still: Those that stand still, each with the reason.
        numbers: How many measured numbers there are.
    """

    kept: tuple[int, ...]
    still: dict[int, str]
    numbers: int

    @property
    def rank(self) -> int:
        """How many numbers can be found."""
        return len(self.kept)


def stacked(model: Model, values: FloatArray, *, complete: bool, at: FloatArray | None = None) -> FloatArray:
    """(rows, p) Jacobian of all that was measured, in metres: angles count at the distance `way.size`.

    Args:
        model: The model.
        values: (s, n) joint values.
        complete: Whether poses were measured, or positions alone.
        at: (p,) where; the model as it is when None.
    """
    L = model.way.size
    _, columns = model.way.columns(values, at)
    columns[:, 3:] *= L
    lengths = np.array([1.0 if parameter.unit == "m" else 1.0 / L for parameter in model.way.parameters])
    seen = columns[:, : 6 if complete else 3] * lengths
    return seen.reshape(-1, len(lengths)) if len(lengths) else np.empty((seen.size, 0))


def identify(
    model: Model, values: FloatArray, *, complete: bool = True, at: FloatArray | None = None
) -> Identification:
    """What configurations tell of a model.

    Args:
        model: The model.
        values: (s, n) joint values.
        complete: Whether poses are measured, or positions alone.
        at: (p,) parameters where this is asked; the model as it is when None.
    """
    J = stacked(model, values, complete=complete, at=at)
    error = np.full_like(J, model.way.rounding(values))
    kept = list[int]()
    for group in model.groups:
        among = [*kept, *group]
        wanted = _rank(J[:, among], error[:, among]) - len(kept)
        kept += _most_independent(J, kept, group, wanted)
    still = {k: _reason(model, J, error, kept, k) for group in model.groups for k in group if k not in kept}
    return Identification(tuple(kept), still, len(J))


def _rank(J: FloatArray, error: FloatArray) -> int:
    if not J.size:
        return 0
    lower = singular_values(J, error, np.ones(J.shape[1], dtype=bool)).values.lower
    return int(np.count_nonzero(lower > 0.0))


def _most_independent(J: FloatArray, kept: Sequence[int], group: Sequence[int], wanted: int) -> list[int]:
    Q, left, chosen = np.linalg.qr(J[:, list(kept)])[0], J[:, list(group)].copy(), list[int]()
    left -= Q @ (Q.T @ left)
    for _ in range(max(wanted, 0)):
        sizes = np.linalg.norm(left, axis=0)
        i = int(np.argmax(sizes >= _AS_GOOD * sizes.max()))
        chosen.append(group[i])
        direction = left[:, i] / sizes[i]
        left -= np.outer(direction, direction @ left)
        left[:, i] = 0.0
    return sorted(chosen, key=list(group).index)


def _reason(model: Model, J: FloatArray, error: FloatArray, kept: Sequence[int], k: int) -> str:
    column = J[:, k]
    if np.linalg.norm(column) <= np.linalg.norm(error[:, k]):
        return "moves nothing that is measured"
    shares = np.linalg.lstsq(J[:, list(kept)], column, rcond=None)[0] * np.linalg.norm(
        J[:, list(kept)], axis=0
    )
    shares = np.abs(shares) / np.linalg.norm(column)
    order = [i for i in np.argsort(-shares, kind="stable") if shares[i] > _SHARE]
    names = [str(model.way.parameters[kept[i]]) for i in order[:_NAMED]]
    more = f" and {len(order) - _NAMED} more" if len(order) > _NAMED else ""
    return f"does what {', '.join(names)}{more} {'do together' if len(order) > 1 else 'does'}"
