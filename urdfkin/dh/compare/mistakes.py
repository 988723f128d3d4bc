"""Find a single mistake in a table: a wrong sign, an extra right angle, or rows in the wrong order.

If a cell of a table has a wrong sign, the table often agrees with the URDF after a fit. The fit changes base,
tool, joint offsets and joint signs so that they compensate for the wrong sign. After the correction of the
sign, the table agrees even if fewer parameters are fitted. Usually, no parameter must be fitted.
`MistakeSearch` therefore tries each single change of the table. The likely mistakes are the changes after
which the fewest parameters must be fitted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from urdfkin.dh.compare.fit import (
    HASTY,
    TableArrays,
    TargetPoses,
    as_written,
    ends_gathered,
    fit_freedoms,
    starts,
)
from urdfkin.dh.compare.result import CellDifference, Fitted, Mistake, MistakeKind, resolution
from urdfkin.dh.convert import to_convention
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.kinematics.rotation import log_rotation, polar_factor
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, pose

#: Two angles with a smaller difference (rad) are treated as equal.
_SAME_ANGLE = 1e-9
#: With more possible changes of the table, joint offsets and joint signs are not fitted.
#: A table of nine rows has about this number of possible changes.
_MOST_FITS = 100


@dataclass(frozen=True, slots=True)
class _Change:
    """A table in which one possible mistake is corrected; `cell` is None if the correction exchanges rows."""

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: str | None
    table: DHTable


@dataclass(frozen=True, slots=True)
class MistakeSearch:
    """A search for a single mistake in the table of a path.

    Attributes:
        tried: Samples of the path's tip poses, used in the fits.
        judged: Other samples of the path's tip poses, used to check the fits.
        tolerance: Tolerance at the tip (metres).
    """

    chain: FrameChain
    tried: TargetPoses
    judged: TargetPoses
    tolerance: float

    def mistakes(self, reference: DHTable, *, fit: bool, agrees: bool) -> tuple[Mistake, ...]:
        """Return the changes of the table after which the fewest parameters must be fitted.

        The result is empty if no change reduces the number of these parameters. With `fit`, base, tool, joint
        offsets and joint signs may be fitted after a correction. `agrees` says whether the table agrees after
        a fit of these parameters.

        Some tables agree only after a fit of base, tool and joint offsets. Such a table has a mistake, or its
        frames differ from the URDF's frames. The fit cannot distinguish these two cases. Therefore, a
        correction of such a table is reported only if the corrected table agrees after a fit of only the
        base, after a fit of only the tool, or without a fit.
        """
        if self._agrees(_model(reference)):
            return ()
        stages = [self._as_written]
        if fit and not (agrees and self._needs_one_thing(reference)):
            stages.append(self._with_one_end)
        if fit and not agrees:
            stages += [self._with_both_ends, self._with_zeros]
        changes = list(_changes(reference))
        for stage in stages:
            if stage == self._with_zeros and len(changes) > _MOST_FITS:
                break
            found = [
                self._mistake(reference, change, model)
                for change in changes
                if (model := stage(change.table)) is not None
            ]
            if found:
                least = min(one.fitted.count for one in found)
                return tuple(one for one in found if one.fitted.count == least)
        return ()

    def _needs_one_thing(self, table: DHTable) -> bool:
        """Whether a table agrees after a fit of one parameter: base, tool, a joint offset or a joint sign."""
        if self._with_one_end(table) is not None:
            return True
        model = self._with_zeros(table)
        return model is not None and self._fitted(_model(table), model).count <= 1

    def _agrees(self, model: TableArrays) -> bool:
        metres, radians = self.judged.apart(model)
        return metres <= self.tolerance and radians * self.judged.scale <= self.tolerance

    # -- fits, from no parameters to all parameters -----------------------------------------------------

    def _as_written(self, table: DHTable) -> TableArrays | None:
        model = _model(table)
        return model if self._agrees(model) else None

    def _with_one_end(self, table: DHTable) -> TableArrays | None:
        """Fit only the tool, or else only the base; return None if neither makes the table agree."""
        model = _model(table)
        poses, wanted = model.poses(self.tried.values), self.tried.poses
        tool = replace(model, tool=_mean(model.tool @ np.linalg.inv(poses) @ wanted))
        base = replace(model, base=_mean(wanted @ np.linalg.inv(poses) @ model.base))
        return next((one for one in (tool, base) if self._agrees(one)), None)

    def _with_both_ends(self, table: DHTable) -> TableArrays | None:
        """Fit base and tool; the start value of the base is a solution of A X = X B."""
        model = _model(table)
        poses, wanted = model.poses(self.tried.values), self.tried.poses
        A, B = wanted @ np.linalg.inv(wanted[0]), poses @ np.linalg.inv(poses[0])
        X = _hand_eye(A, B)
        tool = _mean(model.tool @ np.linalg.inv(X @ poses) @ wanted)
        start = replace(model, base=X @ model.base, tool=tool)
        found = start if self._agrees(start) else fit_freedoms(start, self.tried, turns=False, ends=True)
        return found if self._agrees(found) else None

    def _with_zeros(self, table: DHTable) -> TableArrays | None:
        """Fit base, tool, joint offsets and joint signs; return the fit with the fewest changes."""
        standard, written = to_convention(table, DHConvention.STANDARD), _model(table)
        models = [
            ends_gathered(fit_freedoms(start, self.tried, turns=False), written)
            for start in starts(self.chain, standard, written, *HASTY)
        ]
        agreeing = [model for model in models if self._agrees(model)]
        return min(agreeing, key=lambda model: self._fitted(written, model).count, default=None)

    def _fitted(self, written: TableArrays, model: TableArrays) -> Fitted:
        """Return the free parameters whose change is larger than the resolution of the fit."""
        metres, radians = self.judged.apart(model)
        fine = resolution(metres / self.judged.scale, radians)
        own = [model.own(i) for i in range(len(model.cells))]
        index = np.arange(len(own))
        moved = model.cells[index, own] - written.cells[index, own]
        turned = np.abs(np.remainder(moved + math.pi, 2.0 * math.pi) - math.pi)
        zeros = np.where(model.turns > 0.0, turned, np.abs(moved) / self.judged.scale)
        ends = [
            float(np.linalg.norm(one[:3, 3] - other[:3, 3])) > fine * self.judged.scale
            or float(rotation_angle(one[:3, :3], other[:3, :3])) > fine
            for one, other in ((model.base, written.base), (model.tool, written.tool))
        ]
        reversed_ = int((model.senses != written.senses).sum())
        return Fitted(ends[0], ends[1], int((zeros > fine).sum()), reversed_)

    def _mistake(self, reference: DHTable, change: _Change, model: TableArrays) -> Mistake:
        metres, radians = self.judged.apart(model)
        cell = None
        if change.cell is not None:
            row = change.rows[0]
            old, new = (getattr(table.rows[row], change.cell) for table in (reference, change.table))
            before, after = (_model(table).poses(self.judged.values) for table in (reference, change.table))
            tip = float(np.linalg.norm(before[:, :3, 3] - after[:, :3, 3], axis=-1).max())
            cell = CellDifference(row, self.chain.joints[row].name, change.cell, old, new, tip)
        fitted = self._fitted(_model(change.table), model)
        return Mistake(change.kind, change.rows, cell, change.table, fitted, metres, radians)


def _model(table: DHTable) -> TableArrays:
    return as_written(to_convention(table, DHConvention.STANDARD))


def _changes(reference: DHTable) -> Iterator[_Change]:
    for i, row in enumerate(reference.rows):
        for cell in ("a", "alpha", "d", "theta"):
            value = getattr(row, cell)
            if abs(math.sin(value) if cell in ("alpha", "theta") else value) > _SAME_ANGLE:
                yield _Change(MistakeKind.SIGN, (i,), cell, _with_cell(reference, i, cell, -value))
        for turn in (-0.5 * math.pi, 0.5 * math.pi):
            value = math.remainder(row.alpha + turn, 2.0 * math.pi)
            # The change to the opposite sign was already tried above.
            if abs(math.remainder(value + row.alpha, 2.0 * math.pi)) > _SAME_ANGLE:
                table = _with_cell(reference, i, "alpha", value)
                yield _Change(MistakeKind.RIGHT_ANGLE, (i,), "alpha", table)
    orders = list[tuple[MistakeKind, tuple[int, ...], list[DHRow]]]()
    for i, j in combinations(range(len(reference.rows)), 2):
        rows = list(reference.rows)
        rows[i], rows[j] = rows[j], rows[i]
        orders.append((MistakeKind.EXCHANGED, (i, j), rows))
    if len(reference.rows) > 3:  # Reversing three rows exchanges the first and the last.
        backwards = list(reversed(reference.rows))
        orders.append((MistakeKind.REVERSED, tuple(range(len(backwards))), backwards))
    for kind, places, rows in orders:
        same_kinds = [row.kind.turns for row in rows] == [row.kind.turns for row in reference.rows]
        if same_kinds and any(_numbers(rows[i]) != _numbers(reference.rows[i]) for i in places):
            yield _Change(kind, places, None, replace(reference, rows=tuple(rows)))


def _numbers(row: DHRow) -> tuple[float, ...]:
    return (*row.cells, float(row.sense))


def _with_cell(table: DHTable, i: int, cell: str, value: float) -> DHTable:
    number: dict[str, Any] = {cell: value}
    row = replace(table.rows[i], **number)
    return replace(table, rows=(*table.rows[:i], row, *table.rows[i + 1 :]))


def _mean(poses: FloatArray) -> FloatArray:
    """Return the (4, 4) mean of nearly equal poses; the first pose if they are not nearly equal."""
    middle = poses.mean(axis=0)
    R = polar_factor(middle[:3, :3])
    return pose(R, middle[:3, 3]) if np.linalg.det(R) > 0.0 else np.array(poses[0])


def _hand_eye(A: FloatArray, B: FloatArray) -> FloatArray:
    """Solve A X = X B for X (4, 4) in least squares over poses (s, 4, 4): Park and Martin (1994)."""
    turns = log_rotation(A[:, :3, :3]).T @ log_rotation(B[:, :3, :3])
    U, _, Vt = np.linalg.svd(turns)
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ R.T - A[:, :3, 3]).reshape(-1)
    return pose(R, np.linalg.lstsq(left, right, rcond=None)[0])
