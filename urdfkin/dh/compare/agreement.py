"""Compare the cells and the tip's pose of a published table with a URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.common_normals import check_lengths_of_table
from urdfkin.dh.compare.fit import (
    CELLS,
    TableArrays,
    TargetPoses,
    find_compensated_cells,
    fit_cells,
    fit_model,
    tip_poses_and_derivatives,
)
from urdfkin.dh.compare.mistakes import MistakeSearch
from urdfkin.dh.compare.result import (
    NEGLIGIBLE_ERROR,
    AbsorbedOffset,
    CellDifference,
    TableComparison,
    has_range,
)
from urdfkin.dh.convert import link_names, make_serial_tree, to_convention, to_free_tree
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHConvention, DHTable, angle_difference
from urdfkin.errors import InputError
from urdfkin.model.chain import MIN_ROBOT_SIZE, FrameChain
from urdfkin.model.configuration import joint_value_range, sample_uniform
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import AS_WRITTEN, Mechanism, tolerance_of, variables_of
from urdfkin.model.mechanisms.upper_bound import FINE_GRID, upper_bounds
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit

#: Default tolerance (m) at the tip. The tolerance covers the effect of two cells that are rounded to 0.1 mm.
TIP_TOLERANCE = 2e-4
FIT_SAMPLES, CHECK_SAMPLES = 40, 200
_FIT_SEED, _CHECK_SEED = 1, 2
#: Differing cells are reported if their correction reduces the tip error to at most this fraction. A
#: remaining tip error of at most `NEGLIGIBLE_ERROR` times the reach also suffices.
_MAX_CELLS_ERROR_FRACTION = 0.5
#: A mistake is reported only if its correction reduces the tip error to the tolerance, or to this fraction of
#: the tip error before the correction.
_MAX_MISTAKE_ERROR_FRACTION = 0.05
_MIN_CHANGE = 1e-10
#: Without a fit, more cells can differ than after a fit. The cells are reported only if at most this number
#: of additional cells differ.
_MAX_MORE_UNFITTED_CELLS = 2
#: If the tip moves by at most this fraction of the path length, the path length is the reach.
_FIXED_TIP_SPREAD = 1e-6
#: Half a unit of each cell's last digit, in metres or radians.
HalfDigits = Sequence[Mapping[str, float]]


def compare(
    chain: FrameChain,
    reference: DHTable,
    tolerance: float = TIP_TOLERANCE,
    *,
    fit: bool = True,
    half_digits: HalfDigits = (),
) -> TableComparison:
    """Compare a table with a path of a URDF.

    The table may have other base and tip frames than the path. The table's base (tip) frame must be fixed
    to the path's base (tip) link. `tolerance` (m) applies at the tip. With `fit`, base, tool, joint offsets
    and signs are fitted first. Mimic rules are not compared: each joint moves independently.
    """
    check_joints(chain, reference)
    standard = to_convention(reference, DHConvention.STANDARD)
    targets, check_targets = _sample_targets(chain)
    written = TableArrays.of(standard)
    fitted = fit_model(chain, standard, targets) if fit else written
    unfitted = _make_unfitted_cells(reference, written, targets, check_targets)
    compared = _ComparedCells(fitted, targets, check_targets) if fit else unfitted
    corrected = fit_cells(compared.model, compared.targets, _cell_mask(reference, compared.model), free=fit)
    metres, radians = check_targets.largest_errors(fitted)
    unfitted_metres, unfitted_radians = check_targets.largest_errors(written)
    residual = compared.check_targets.largest_errors(corrected)[0]
    cells = _find_differences(chain, reference, compared, corrected, half_digits, fit)
    table = _make_fitted_table(chain, standard, fitted)
    metres_bound, radians_bound = max_tip_error_bound(chain, table)
    comparison = TableComparison(
        fitted_table=table,
        reach=targets.scale,
        travel=sum(max(map(abs, ends)) for ends in _prismatic_ranges(chain).values()),
        is_fitted=fit,
        senses=tuple(int(s) * row.sense for s, row in zip(fitted.senses, standard.rows, strict=True)),
        offsets=_joint_offsets(standard, fitted),
        base=_find_absorbed_offset(written.base, fitted.base),
        tool=_find_absorbed_offset(written.tool, fitted.tool),
        differences=cells
        if residual <= max(_MAX_CELLS_ERROR_FRACTION * metres, NEGLIGIBLE_ERROR * targets.scale)
        else (),
        unfitted_differences=(),
        not_compared=_find_compensated_cells(reference, fitted, check_targets) if fit else (),
        mistakes=(),
        residual=residual,
        tolerance=tolerance,
        samples=CHECK_SAMPLES,
        metres_bound=metres_bound,
        radians_bound=radians_bound,
        metres=metres,
        radians=radians,
        unfitted_metres=unfitted_metres,
        unfitted_radians=unfitted_radians,
    )
    if comparison.is_exact_unfitted:
        return comparison
    target_error = tolerance if comparison.agrees else max(tolerance, _MAX_MISTAKE_ERROR_FRACTION * metres)
    search = MistakeSearch(chain, targets, check_targets, target_error)
    if mistakes := search.find(reference, fit=fit, agrees=comparison.agrees):
        cells = tuple(mistake.cell for mistake in mistakes if mistake.cell is not None)
        return replace(comparison, mistakes=mistakes, differences=cells if len(mistakes) == 1 else ())
    if not fit:
        return comparison
    cells = _find_differences_without_fit(chain, reference, unfitted, half_digits)
    few = len(cells) <= len(comparison.differences) + _MAX_MORE_UNFITTED_CELLS
    return replace(comparison, unfitted_differences=cells if few else ())


def fast_fit_errors(chain: FrameChain, reference: DHTable, target_error: float) -> tuple[float, float]:
    """Return the largest tip errors (m, rad) on samples after a fast fit.

    The fit ends if metres + reach * radians <= `target_error` (m).
    """
    check_joints(chain, reference)
    standard = to_convention(reference, DHConvention.STANDARD)
    targets, check_targets = _sample_targets(chain)
    return check_targets.largest_errors(fit_model(chain, standard, targets, target_error, fast=True))


def _reach(chain: FrameChain, poses: FloatArray) -> float:
    """Return the robot's reach (m).

    The path length can be far larger than the reach, because a table without Hayati rows may have offsets of
    kilometres.
    """
    tips = poses[:, :3, 3]
    spread = 2.0 * float(np.linalg.norm(tips - tips.mean(axis=0), axis=-1).max())
    return max(
        min(chain.reach, spread) if spread > _FIXED_TIP_SPREAD * chain.reach else chain.reach, MIN_ROBOT_SIZE
    )


def check_joints(chain: FrameChain, reference: DHTable) -> None:
    in_table, in_urdf = (
        "".join("R" if item.kind.turns else "P" for item in items) for items in (reference.rows, chain.joints)
    )
    if in_table != in_urdf or not in_urdf:
        raise InputError(
            "the table and the path have different joints",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"{in_table or 'none'} in the table, {in_urdf or 'none'} in the URDF",
            remedy="choose a base and a tip with exactly the table's joints on the path",
        )
    check_lengths_of_table(chain, reference)


def _sample_targets(chain: FrameChain) -> tuple[TargetPoses, TargetPoses]:
    values, poses = _sample_poses(chain, FIT_SAMPLES, _FIT_SEED)
    scale = _reach(chain, poses)
    return TargetPoses(values, poses, scale), TargetPoses(
        *_sample_poses(chain, CHECK_SAMPLES, _CHECK_SEED), scale
    )


def _sample_poses(chain: FrameChain, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return `count` joint values and the tip's poses; mimic joints move independently."""
    travels = _prismatic_ranges(chain)
    ranges = [travels.get(joint.name, (-math.pi, math.pi)) for joint in chain.joints]
    values = sample_uniform(ranges, count, seed)
    free = replace(chain, joints=tuple(replace(joint, mimic=None) for joint in chain.joints))
    return values, free.placement(values)


def _prismatic_ranges(chain: FrameChain) -> dict[str, tuple[float, float]]:
    """Return prismatic joints' ranges, m."""
    return {
        joint.name: joint_value_range(joint.kind, joint.limit if has_range(joint.limit) else None)
        for joint in chain.joints
        if not joint.kind.turns
    }


def _joint_offsets(standard: DHTable, fitted: TableArrays) -> tuple[float, ...]:
    offsets = []
    for i, row in enumerate(standard.rows):
        theta, d = fitted.cells[i, :2].tolist()
        offsets.append(row.sense * (angle_difference(theta, row.theta) if row.kind.turns else d - row.d))
    return tuple(offsets)


def _find_absorbed_offset(written: FloatArray, fitted: FloatArray) -> AbsorbedOffset:
    shift = float(np.linalg.norm(fitted[:3, 3] - written[:3, 3]))
    return AbsorbedOffset(shift, float(rotation_angle(written[:3, :3], fitted[:3, :3])))


@dataclass(frozen=True, slots=True)
class _ComparedCells:
    """A standard table and the poses that its cells must reproduce."""

    model: TableArrays
    targets: TargetPoses
    check_targets: TargetPoses


def _make_unfitted_cells(
    reference: DHTable, written: TableArrays, targets: TargetPoses, check_targets: TargetPoses
) -> _ComparedCells:
    """Return the table without a fit.

    For a modified table, a first row without a joint contains a, alpha and beta of the reference's first row.
    Otherwise, the base would contain these cells.
    """
    if reference.convention is not DHConvention.MODIFIED:
        return _ComparedCells(written, targets, check_targets)
    first = reference.rows[0]
    model = TableArrays(
        np.vstack([[0.0, 0.0, first.a, first.alpha, first.beta], written.cells]),
        np.append(1.0, written.turns),
        np.append(0.0, written.senses),
        reference.base,
        written.tool,
    )

    def with_first_value(one: TargetPoses) -> TargetPoses:
        return replace(one, values=np.hstack([np.zeros((len(one.values), 1)), one.values]))

    return _ComparedCells(model, with_first_value(targets), with_first_value(check_targets))


def _reference_row_index(reference: DHTable, i: int, cell: str) -> int | None:
    """Return the index of the reference row that contains a cell of standard row i, or None.

    In a modified table, a, alpha and beta of standard row i are in the next row. For a comparison without a
    fit, row -1 is an additional first row without a joint.
    """
    reference_index = i + (reference.convention is DHConvention.MODIFIED and cell not in ("theta", "d"))
    return reference_index if 0 <= reference_index < len(reference.rows) else None


def _cell_mask(reference: DHTable, model: TableArrays) -> FloatArray:
    """Return an array (n, 5) with 1 for each standard cell that the reference contains, else 0."""
    rows = range(len(reference.rows) - len(model.cells), len(reference.rows))
    return np.array(
        [[float(_reference_row_index(reference, i, cell) is not None) for cell in CELLS] for i in rows]
    )


def _find_compensated_cells(
    reference: DHTable, fitted: TableArrays, check_targets: TargetPoses
) -> tuple[tuple[int, str], ...]:
    """Return row index and name of each cell with an error that a fit can compensate."""
    compensated = list[tuple[int, str]]()
    if reference.convention is DHConvention.MODIFIED:
        # In the standard table, the base contains these cells.
        compensated += [(0, cell) for cell in ("a", "alpha")] + [(0, "beta")] * bool(reference.rows[0].beta)
    for i, k in find_compensated_cells(fitted, check_targets):
        reference_index = _reference_row_index(reference, i, CELLS[k])
        if (
            reference_index is not None
            and k != fitted.variable_indices[i]
            and (CELLS[k] != "beta" or fitted.cells[i, k])
        ):
            compensated.append((reference_index, CELLS[k]))
    return tuple(sorted(compensated))


def _find_differences(
    chain: FrameChain,
    reference: DHTable,
    compared: _ComparedCells,
    corrected: TableArrays,
    half_digits: HalfDigits,
    free: bool,
) -> tuple[CellDifference, ...]:
    """Return differing cells, largest effect first."""
    fitted, check_targets = compared.model, compared.check_targets
    cell_derivatives, scale = tip_poses_and_derivatives(fitted, check_targets)[2], check_targets.scale
    linear = cell_derivatives.reshape(len(check_targets.values), 6, len(fitted.cells), len(CELLS))[:, :3]
    largest = np.linalg.norm(linear, axis=1).max(axis=0)
    first, differences = len(fitted.cells) - len(reference.rows), []
    for i, row in enumerate(fitted.cells):
        for k, cell in enumerate(CELLS):
            change = float(corrected.cells[i, k] - row[k])
            size = abs(change) * (1.0 if cell in ("a", "d") else scale)
            reference_index = _reference_row_index(reference, i - first, cell)
            if (
                reference_index is None
                or (free and k == fitted.variable_indices[i])
                or size <= _MIN_CHANGE * scale
            ):
                continue
            value = getattr(reference.rows[reference_index], cell)
            effect = float(largest[i, k] * size)
            last = half_digits[reference_index].get(cell, 0.0) if reference_index < len(half_digits) else 0.0
            name = chain.joints[reference_index].name
            differences.append(
                CellDifference(reference_index, name, cell, value, value + change, effect, last)
            )
    return tuple(sorted(differences, key=lambda one: (-one.tip_displacement, one.row, one.cell)))


def _find_differences_without_fit(
    chain: FrameChain,
    reference: DHTable,
    unfitted: _ComparedCells,
    half_digits: HalfDigits,
) -> tuple[CellDifference, ...]:
    """Return the differing cells, or an empty tuple if no change of cells removes the tip error."""
    corrected = fit_cells(unfitted.model, unfitted.targets, _cell_mask(reference, unfitted.model), free=False)
    metres, radians = unfitted.check_targets.largest_errors(corrected)
    if metres > NEGLIGIBLE_ERROR * unfitted.targets.scale or radians > NEGLIGIBLE_ERROR:
        return ()
    return _find_differences(chain, reference, unfitted, corrected, half_digits, False)


def _make_fitted_table(chain: FrameChain, standard: DHTable, fitted: TableArrays) -> DHTable:
    rows = []
    for i, (row, joint) in enumerate(zip(standard.rows, chain.joints, strict=True)):
        theta, d = fitted.cells[i, :2].tolist()
        of_joint = {name: getattr(joint, name) for name in ("kind", "mimic", "limit")}
        sense = int(fitted.senses[i])
        rows.append(replace(row, theta=theta, d=d, sense=sense, joint=joint.name, **of_joint))
    ends = fitted.base, fitted.tool, chain.robot, chain.base, chain.tip
    return DHTable(DHConvention.STANDARD, tuple(rows), *ends)


def max_tip_error_bound(path: FrameChain, table: DHTable) -> tuple[float, float]:
    """Return bounds (m, rad) of the tip error.

    The bounds do not include rounding errors, and ignore mimic rules. The bounds hold for all angles, and for
    displacements within the limits. For a prismatic joint without a range (`has_range`), the limits are
    -`ASSUMED_LIMIT` and `ASSUMED_LIMIT`.
    """
    mechanisms = Mechanism(_make_tree_without_mimic(path, table)), Mechanism(to_free_tree(table))
    pair = align(*mechanisms, {row.joint: row.joint for row in table.rows}, AS_WRITTEN)
    variable_indices = variables_of(pair, tolerance_of(*mechanisms))
    tip = link_names(table)[-1]
    frame = next(frame for frame in pair.frames if pair.a.tree.links[frame.a] == tip)
    return upper_bounds(pair, variable_indices, frame, FINE_GRID)


def _make_tree_without_mimic(path: FrameChain, table: DHTable) -> KinematicTree:
    """Convert a path to a tree without mimic rules, with the table's link names."""
    travels, z = _prismatic_ranges(path), np.array([0.0, 0.0, 1.0])
    joints = []
    for joint in path.joints:
        kind = JointKind.CONTINUOUS if joint.kind.turns else JointKind.PRISMATIC
        limit = Limit(*travels[joint.name], math.inf, math.inf) if joint.name in travels else None
        joints.append(Joint(joint.name, kind, 0, joint.T_previous_joint, z, limit))
    joints.append(replace(to_free_tree(table).joints[-1], T_parent_joint=path.T_last_tip))
    return make_serial_tree(path.robot, link_names(table), joints)
