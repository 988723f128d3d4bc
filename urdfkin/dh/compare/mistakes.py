"""Find a single mistake in a table: a wrong sign, an alpha wrong by a right angle, or a wrong order of rows.

A fit of base, tool, joint offsets and joint signs often compensates for a wrong sign in a cell. If the
cell is corrected first, the fit changes fewer parameters.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from urdfkin.dh.compare.fit import (
    FAST_SEARCH,
    TableArrays,
    TargetPoses,
    fit_free_parameters,
    move_end_offsets_to_base_and_tool,
    start_models,
)
from urdfkin.dh.compare.result import CellDifference, FitChanges, Mistake, MistakeKind, fit_resolution
from urdfkin.dh.convert import to_convention
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHConvention, DHRow, DHTable, angle_difference
from urdfkin.dh.units import COLUMNS
from urdfkin.kinematics.rotation import log_rotation, polar_factor
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, pose

_SAME_VALUE_TOLERANCE = 1e-9
#: Maximum number of possible corrections for which joint offsets and joint signs are fitted.
_MAX_FITTED_CORRECTIONS = 100


@dataclass(frozen=True, slots=True)
class _TableCorrection:
    """A corrected table; `cell` is None for a correction of the order of rows."""

    kind: MistakeKind
    rows: tuple[int, ...]
    cell: str | None
    table: DHTable


@dataclass(frozen=True, slots=True)
class MistakeSearch:
    """Search for a single mistake.

    Attributes:
        tolerance: Tolerance at the tip, m.
    """

    chain: FrameChain
    targets: TargetPoses
    check_targets: TargetPoses
    tolerance: float

    def find(self, reference: DHTable, *, fit: bool, agrees: bool) -> tuple[Mistake, ...]:
        """Return the mistakes that explain the table with the fewest fitted parameters.

        | Arguments | Allowed fit of the corrected table |
        |---|---|
        | `fit` is false | none |
        | `agrees` is true | only base or only tool |
        | otherwise | base, tool, joint offsets and joint signs |

        If `agrees` is true, the table may be correct, with other frames. The result is empty if the original
        table fits equally well.
        """
        if self._without_fit(reference) is not None:
            return ()
        fits = [self._without_fit]
        if fit and not (agrees and self._agrees_after_one_fit_change(reference)):
            fits.append(self._fit_one_end)
        if fit and not agrees:
            fits += [self._fit_both_ends, self._fit_zeros_and_senses]
        corrections = list(_corrections(reference))
        for fit_table in fits:
            if fit_table == self._fit_zeros_and_senses and len(corrections) > _MAX_FITTED_CORRECTIONS:
                break
            mistakes = [
                self._make_mistake(reference, correction, model)
                for correction in corrections
                if (model := fit_table(correction.table)) is not None
            ]
            if mistakes:
                least = min(mistake.fit_changes.count for mistake in mistakes)
                return tuple(mistake for mistake in mistakes if mistake.fit_changes.count == least)
        return ()

    def _agrees_after_one_fit_change(self, table: DHTable) -> bool:
        """Return whether at most one change of base, tool, a joint offset or a joint sign is necessary."""
        if self._fit_one_end(table) is not None:
            return True
        model = self._fit_zeros_and_senses(table)
        return model is not None and self._find_changed_parameters(_make_model(table), model).count <= 1

    def _agrees(self, model: TableArrays) -> bool:
        metres, radians = self.check_targets.largest_errors(model)
        return metres <= self.tolerance and radians * self.check_targets.scale <= self.tolerance

    # -- fits; each function returns None if the fitted table does not agree with the URDF ---------------

    def _without_fit(self, table: DHTable) -> TableArrays | None:
        model = _make_model(table)
        return model if self._agrees(model) else None

    def _fit_one_end(self, table: DHTable) -> TableArrays | None:
        """Fit only the tool, or only the base."""
        model = _make_model(table)
        poses, target_poses = model.poses(self.targets.values), self.targets.poses
        with_tool = replace(model, tool=_mean_pose(model.tool @ np.linalg.inv(poses) @ target_poses))
        with_base = replace(model, base=_mean_pose(target_poses @ np.linalg.inv(poses) @ model.base))
        return next((fitted for fitted in (with_tool, with_base) if self._agrees(fitted)), None)

    def _fit_both_ends(self, table: DHTable) -> TableArrays | None:
        model = _make_model(table)
        poses, target_poses = model.poses(self.targets.values), self.targets.poses
        A, B = target_poses @ np.linalg.inv(target_poses[0]), poses @ np.linalg.inv(poses[0])
        X = _solve_hand_eye(A, B)
        tool = _mean_pose(model.tool @ np.linalg.inv(X @ poses) @ target_poses)
        fitted = replace(model, base=X @ model.base, tool=tool)
        if not self._agrees(fitted):
            fitted = fit_free_parameters(fitted, self.targets, large_angles=False, only_ends=True)
        return fitted if self._agrees(fitted) else None

    def _fit_zeros_and_senses(self, table: DHTable) -> TableArrays | None:
        """Fit base, tool, joint offsets and joint signs."""
        standard, written = to_convention(table, DHConvention.STANDARD), _make_model(table)
        fits = [
            fit_free_parameters(start, self.targets, large_angles=False)
            for start in start_models(self.chain, standard, self.targets, *FAST_SEARCH)
        ]
        models = [move_end_offsets_to_base_and_tool(fit, written) for fit in fits]
        agreeing = [model for model in models if self._agrees(model)]
        return min(
            agreeing, key=lambda model: self._find_changed_parameters(written, model).count, default=None
        )

    def _find_changed_parameters(self, written: TableArrays, model: TableArrays) -> FitChanges:
        metres, radians = self.check_targets.largest_errors(model)
        fine = fit_resolution(metres / self.check_targets.scale, radians)
        rows = np.arange(len(model.cells))
        offsets = model.cells[rows, model.variable_indices] - written.cells[rows, model.variable_indices]
        angles = np.abs(np.remainder(offsets + math.pi, 2.0 * math.pi) - math.pi)
        zeros = np.where(model.turns > 0.0, angles, np.abs(offsets) / self.check_targets.scale)
        base, tool = (
            float(np.linalg.norm(T[:3, 3] - T_written[:3, 3])) > fine * self.check_targets.scale
            or float(rotation_angle(T[:3, :3], T_written[:3, :3])) > fine
            for T, T_written in ((model.base, written.base), (model.tool, written.tool))
        )
        reversed_ = int((model.senses != written.senses).sum())
        return FitChanges(base, tool, int((zeros > fine).sum()), reversed_)

    def _make_mistake(
        self, reference: DHTable, correction: _TableCorrection, fitted_model: TableArrays
    ) -> Mistake:
        metres, radians = self.check_targets.largest_errors(fitted_model)
        tables, cell = (reference, correction.table), None
        if correction.cell is not None:
            row = correction.rows[0]
            old, new = (getattr(table.rows[row], correction.cell) for table in tables)
            before, after = (_make_model(table).poses(self.check_targets.values) for table in tables)
            tip = float(np.linalg.norm(before[:, :3, 3] - after[:, :3, 3], axis=-1).max())
            cell = CellDifference(row, self.chain.joints[row].name, correction.cell, old, new, tip)
        fitted = self._find_changed_parameters(_make_model(correction.table), fitted_model)
        return Mistake(correction.kind, correction.rows, cell, correction.table, fitted, metres, radians)


def _make_model(table: DHTable) -> TableArrays:
    return TableArrays.of(to_convention(table, DHConvention.STANDARD))


def _corrections(reference: DHTable) -> Iterator[_TableCorrection]:
    for i, row in enumerate(reference.rows):
        for cell in COLUMNS:
            value = getattr(row, cell)
            if abs(math.sin(value) if cell in ("alpha", "theta") else value) > _SAME_VALUE_TOLERANCE:
                yield _TableCorrection(
                    MistakeKind.SIGN, (i,), cell, _replace_cell(reference, i, cell, -value)
                )
        for right_angle in (-0.5 * math.pi, 0.5 * math.pi):
            value = math.remainder(row.alpha + right_angle, 2.0 * math.pi)
            is_opposite_sign = abs(angle_difference(value, -row.alpha)) <= _SAME_VALUE_TOLERANCE
            if not is_opposite_sign:
                table = _replace_cell(reference, i, "alpha", value)
                yield _TableCorrection(MistakeKind.RIGHT_ANGLE, (i,), "alpha", table)
    orders = list[tuple[MistakeKind, tuple[int, ...], list[DHRow]]]()
    for i, j in combinations(range(len(reference.rows)), 2):
        rows = list(reference.rows)
        rows[i], rows[j] = rows[j], rows[i]
        orders.append((MistakeKind.EXCHANGED, (i, j), rows))
    # In a table of two or three rows, a reversal only exchanges the first and the last row. The loop above
    # already yields this correction.
    if len(reference.rows) > 3:
        backwards = list(reversed(reference.rows))
        orders.append((MistakeKind.REVERSED, tuple(range(len(backwards))), backwards))
    for kind, indices, rows in orders:
        same_kinds = [row.kind.turns for row in rows] == [row.kind.turns for row in reference.rows]
        if same_kinds and any(_row_numbers(rows[i]) != _row_numbers(reference.rows[i]) for i in indices):
            yield _TableCorrection(kind, indices, None, replace(reference, rows=tuple(rows)))


def _row_numbers(row: DHRow) -> tuple[float, ...]:
    return (*row.cells, float(row.sense))


def _replace_cell(table: DHTable, i: int, cell: str, value: float) -> DHTable:
    number: dict[str, Any] = {cell: value}
    row = replace(table.rows[i], **number)
    return replace(table, rows=(*table.rows[:i], row, *table.rows[i + 1 :]))


def _mean_pose(poses: FloatArray) -> FloatArray:
    """Average nearly equal poses."""
    mean = poses.mean(axis=0)
    R = polar_factor(mean[:3, :3])
    return pose(R, mean[:3, 3]) if np.linalg.det(R) > 0.0 else np.array(poses[0])


def _solve_hand_eye(A: FloatArray, B: FloatArray) -> FloatArray:
    """Solve A X = X B: Park and Martin (1994)."""
    turns = log_rotation(A[:, :3, :3]).T @ log_rotation(B[:, :3, :3])
    U, _, Vt = np.linalg.svd(turns)
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ R.T - A[:, :3, 3]).reshape(-1)
    return pose(R, np.linalg.lstsq(left, right, rcond=None)[0])
