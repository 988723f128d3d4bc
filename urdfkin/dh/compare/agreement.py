"""Compare a URDF with a published table: compare the cells, and compute the error of the tip's pose.

`max_tip_error_bound` proves a bound of the tip error for every configuration, by the method of `urdfkin
same`. The path and the table become two mechanisms with the same joints. `urdfkin.model.mechanisms` matches
the joints of the two mechanisms without a fit. It then computes an upper bound of the tip error that the
differences cause. The computation begins at the tip and proceeds joint by joint to the base. At each joint it
uses support functions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from urdfkin.dh.common_normals import check_lengths_of_table
from urdfkin.dh.compare.fit import (
    CELLS,
    TableArrays,
    TargetPoses,
    as_written,
    columns,
    fit_cells,
    fitted_model,
    hidden_cells,
)
from urdfkin.dh.compare.mistakes import MistakeSearch
from urdfkin.dh.compare.result import EXPLAINED, AbsorbedOffset, CellDifference, TableComparison
from urdfkin.dh.convert import free_tree, link_names, to_convention
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHConvention, DHTable
from urdfkin.errors import InputError
from urdfkin.model.chain import LEAST_SIZE, FrameChain
from urdfkin.model.configuration import values_within
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import AS_WRITTEN, Mechanism, tolerance_of, variables_of
from urdfkin.model.mechanisms.upper_bound import FINE, upper_bounds
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, build_tree, is_bounded

#: This is the default tolerance for the tip's position (metres).
#: The tip error is two thirds of this tolerance if one or two cells are rounded to 0.1 mm.
TOLERANCE = 2e-4
#: The fit uses `FIT_SAMPLES` configurations, and its check uses `CHECK_SAMPLES` other configurations.
FIT_SAMPLES, CHECK_SAMPLES = 40, 200
_FIT_SEED, _CHECK_SEED = 1, 2
#: Differing cells are reported if their correction reduces the tip error to at most this fraction.
_EXPLAINS = 0.5
#: At most this fraction of the tip error may remain after the correction of a single mistake.
_LEFT = 0.05
#: Smaller changes of a cell, relative to the reach, are not reported (a tenth of `EXPLAINED`).
_MOVED = 1e-10
#: A tip that moves by less than this fraction of the path length is treated as fixed.
#: For such a tip, the reach is the length of the path.
_FIXED_TIP = 1e-6
#: A prismatic joint without limits is sampled in this range (metres).
_SLIDE = (-0.5, 0.5)
#: The rounding error (metres or radians) of each cell of each row is half a unit of its last digit.
Digits = Sequence[Mapping[str, float]]


def compare(
    chain: FrameChain,
    reference: DHTable,
    tolerance: float = TOLERANCE,
    *,
    fit: bool = True,
    digits: Digits = (),
) -> TableComparison:
    """Compare a reference table with a path of a URDF.

    Args:
        chain: The path, from base to tip. The table may have other base and tip frames than the path, if they
            are fixed to the same links.
        reference: The table in either convention, with a row for each moving joint in the path's order.
        tolerance: Tolerance at the tip (metres).
        fit: Whether to fit base, tool, joint offsets and joint signs. If False, the table is compared as it
            is written.
        digits: Precision of each cell in the table's file (`urdfkin.dh.rows.last_digits`).

    Raises:
        InputError: the joints of the table differ in number or kind from those of the path.
    """
    check_joints(chain, reference)
    standard = to_convention(reference, DHConvention.STANDARD)
    tried, judged = _target_poses(chain)
    written = as_written(standard)
    fitted = fitted_model(chain, standard, written, tried) if fit else written
    complete = fit_cells(fitted, tried, _cells_of(reference), free=fit)
    metres, radians = judged.apart(fitted)
    written_metres, written_radians = judged.apart(written)
    residual = judged.apart(complete)[0]
    cells = _differences(chain, reference, fitted, complete, judged, digits, fit)
    table = _fitted_table(chain, standard, fitted)
    most_metres, most_radians = max_tip_error_bound(chain, table, _slides(chain))
    found = TableComparison(
        reference=table,
        reach=tried.scale,
        fitted=fit,
        senses=tuple(int(s) * row.sense for s, row in zip(fitted.senses, standard.rows, strict=True)),
        offsets=_offsets(standard, fitted),
        base=_absorbed_offset(written.base, fitted.base),
        tool=_absorbed_offset(written.tool, fitted.tool),
        differences=cells if residual <= max(_EXPLAINS * metres, EXPLAINED * tried.scale) else (),
        instead=(),
        hidden=_hidden(reference, fitted, judged) if fit else (),
        mistakes=(),
        residual=residual,
        tolerance=tolerance,
        samples=CHECK_SAMPLES,
        most_metres=most_metres,
        most_radians=most_radians,
        metres=metres,
        radians=radians,
        written_metres=written_metres,
        written_radians=written_radians,
    )
    if found.as_written:
        return found
    enough = tolerance if found.agrees else max(tolerance, _LEFT * found.metres)
    if mistakes := MistakeSearch(chain, tried, judged, enough).mistakes(
        reference, fit=fit, agrees=found.agrees
    ):
        cells = tuple(one.cell for one in mistakes if one.cell is not None)
        blamed = cells if len(mistakes) == 1 else ()
        return replace(found, mistakes=mistakes, differences=blamed)
    if fit:
        found = replace(found, instead=_instead(chain, reference, written, found, (tried, judged), digits))
    return found


def best_fit(chain: FrameChain, reference: DHTable, enough: float) -> tuple[float, float]:
    """Return the largest tip error on samples (metres, radians) after a fast fit of base, tool and offsets.

    To be fast, the fit tries only a few combinations of joint signs and directions of x. If two axes nearly
    coincide, the fit does not try large opposite changes of their two joint offsets. The fit stops at the tip
    error `enough` (metres). If the joints differ in number or kind, InputError is raised.
    """
    check_joints(chain, reference)
    standard = to_convention(reference, DHConvention.STANDARD)
    tried, judged = _target_poses(chain)
    return judged.apart(fitted_model(chain, standard, as_written(standard), tried, enough, hasty=True))


def _reach(chain: FrameChain, wanted: FloatArray) -> float:
    """Return the robot's reach, which converts radians to metres: the spread of the tip's positions.

    A URDF made from a table without Hayati rows may contain an offset of kilometres, and a second offset that
    compensates it. The path length along the links is then far larger than the reach.
    """
    tips = wanted[:, :3, 3]
    across = 2.0 * float(np.linalg.norm(tips - tips.mean(axis=0), axis=-1).max())
    return max(min(chain.reach, across) if across > _FIXED_TIP * chain.reach else chain.reach, LEAST_SIZE)


def check_joints(chain: FrameChain, reference: DHTable) -> None:
    """Check that a table and a path have the same number (at least one) and the same kinds of joints.

    Raises:
        InputError: the joints are different.
        RangeError: the square of a length is outside the range of doubles.
    """
    theirs = [row.kind.turns for row in reference.rows]
    ours = [joint.kind.turns for joint in chain.joints]
    if theirs != ours or not ours:
        words = ["".join("R" if turns else "P" for turns in kinds) or "none" for kinds in (theirs, ours)]
        raise InputError(
            "the table and the path have different joints",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"{words[0]} in the table, {words[1]} in the URDF",
            remedy="choose a base and a tip so that the path has exactly the joints of the table",
        )
    check_lengths_of_table(chain, reference)


def _target_poses(chain: FrameChain) -> tuple[TargetPoses, TargetPoses]:
    """Return the samples on which a fit is made, and other samples on which the fit is checked."""
    values, poses = _samples(chain, FIT_SAMPLES, _FIT_SEED)
    scale = _reach(chain, poses)
    return TargetPoses(values, poses, scale), TargetPoses(*_samples(chain, CHECK_SAMPLES, _CHECK_SEED), scale)


def _samples(chain: FrameChain, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return random joint values (count, n), and the tip's poses at these values; mimic rules are ignored."""
    slides = _slides(chain)
    ranges = [slides.get(joint.name, (-math.pi, math.pi)) for joint in chain.joints]
    values = values_within(ranges, count, seed)
    free = replace(chain, joints=tuple(replace(joint, mimic=None) for joint in chain.joints))
    return values, free.placement(values)


def _slides(chain: FrameChain) -> dict[str, tuple[float, float]]:
    limits = {joint.name: joint.limit for joint in chain.joints if not joint.kind.turns}
    return {
        name: (limit.lower, limit.upper) if is_bounded(limit) and limit.lower < limit.upper else _SLIDE
        for name, limit in limits.items()
    }


def _offsets(standard: DHTable, fitted: TableArrays) -> tuple[float, ...]:
    offsets = []
    for i, row in enumerate(standard.rows):
        k = fitted.own(i)
        offset = float(fitted.cells[i, k]) - (row.d if k else row.theta)
        offsets.append(row.sense * (offset if k else math.remainder(offset, 2.0 * math.pi)))
    return tuple(offsets)


def _absorbed_offset(written: FloatArray, fitted: FloatArray) -> AbsorbedOffset:
    shift = float(np.linalg.norm(fitted[:3, 3] - written[:3, 3]))
    return AbsorbedOffset(shift, float(rotation_angle(written[:3, :3], fitted[:3, :3])))


def _cell_at(reference: DHTable, i: int, cell: str) -> int:
    """Return the index of the row that contains a cell of the standard row i in the reference table.

    In a modified table, a, alpha and beta are in row i + 1. If no row contains the cell, the result is the
    number of rows.
    """
    return i + (reference.convention is DHConvention.MODIFIED and cell not in ("theta", "d"))


def _cells_of(reference: DHTable) -> FloatArray:
    """Return an (n, 5) mask of cells in standard rows: 1 if the reference table contains the cell, else 0."""
    n = len(reference.rows)
    return np.array([[float(_cell_at(reference, i, cell) < n) for cell in CELLS] for i in range(n)])


def _hidden(reference: DHTable, fitted: TableArrays, judged: TargetPoses) -> tuple[tuple[int, str], ...]:
    """Return the cells that have the same effect as base, tool or joint offsets; a beta of 0 is left out."""
    found = [
        (_cell_at(reference, i, CELLS[k]), CELLS[k])
        for i, k in hidden_cells(fitted, judged)
        if k != fitted.own(i) and (CELLS[k] != "beta" or fitted.cells[i, k])
    ]
    return tuple(sorted(one for one in found if one[0] < len(reference.rows)))


def _differences(
    chain: FrameChain,
    reference: DHTable,
    fitted: TableArrays,
    complete: TableArrays,
    judged: TargetPoses,
    digits: Digits,
    free: bool,
) -> tuple[CellDifference, ...]:
    """Return the cells that the fit changed by more than rounding, in descending order of their effect."""
    twists, scale = columns(fitted, judged)[2], judged.scale
    linear = np.linalg.norm(twists.reshape(len(judged.values), 6, -1)[:, :3], axis=1).max(axis=0)
    found = []
    for i, row in enumerate(fitted.cells):
        for k, cell in enumerate(CELLS):
            change = float(complete.cells[i, k] - row[k])
            size = abs(change) * (1.0 if cell in "da" else scale)
            at = _cell_at(reference, i, cell)
            if (free and k == fitted.own(i)) or size <= _MOVED * scale or at >= len(reference.rows):
                continue
            value = getattr(reference.rows[at], cell)
            effect = float(linear[5 * i + k] * size)
            last = digits[at].get(cell, 0.0) if at < len(digits) else 0.0
            name = chain.joints[at].name
            found.append(CellDifference(at, name, cell, value, value + change, effect, last))
    return tuple(sorted(found, key=lambda one: (-one.tip, one.row, one.cell)))


def _instead(
    chain: FrameChain,
    reference: DHTable,
    written: TableArrays,
    found: TableComparison,
    wanted: tuple[TargetPoses, TargetPoses],
    digits: Digits,
) -> tuple[CellDifference, ...]:
    """Return the cells that must change if base, tool and offsets are not fitted.

    The result is empty if these changes do not explain the difference between table and URDF.
    """
    tried, judged = wanted
    complete = fit_cells(written, tried, _cells_of(reference), free=False)
    metres, radians = judged.apart(complete)
    if metres > EXPLAINED * found.reach or radians > EXPLAINED:
        return ()
    cells = _differences(chain, reference, written, complete, judged, digits, False)
    return cells if len(cells) <= len(found.differences) + 2 else ()


def _fitted_table(chain: FrameChain, standard: DHTable, fitted: TableArrays) -> DHTable:
    """Return the fitted reference table, with the joint names and limits of the URDF."""
    rows = []
    for i, (row, joint) in enumerate(zip(standard.rows, chain.joints, strict=True)):
        theta, d = fitted.cells[i, :2].tolist()
        of_joint = {name: getattr(joint, name) for name in ("kind", "mimic", "limit")}
        sense = int(fitted.senses[i])
        rows.append(replace(row, theta=theta, d=d, sense=sense, joint=joint.name, **of_joint))
    ends = fitted.base, fitted.tool, chain.robot, chain.base, chain.tip
    return DHTable(DHConvention.STANDARD, tuple(rows), *ends)


def max_tip_error_bound(
    path: FrameChain, table: DHTable, slides: Mapping[str, tuple[float, float]]
) -> tuple[float, float]:
    """Return an upper bound of a table's tip error (metres, radians); rounding errors are not included.

    The mimic rules of the path are ignored. The variables of the table are the path's joint values, and its
    rows contain the joint signs and joint offsets. `slides` are the ranges of the prismatic joints (metres).
    """
    mechanisms = Mechanism(_free(path, table, slides)), Mechanism(free_tree(table))
    found = align(*mechanisms, {row.joint: row.joint for row in table.rows}, AS_WRITTEN)
    variables = variables_of(found, tolerance_of(*mechanisms))
    tip = link_names(table)[-1]
    frame = next(frame for frame in found.frames if found.a.tree.links[frame.a] == tip)
    return upper_bounds(found, variables, frame, FINE)


def _free(path: FrameChain, table: DHTable, slides: Mapping[str, tuple[float, float]]) -> KinematicTree:
    """Return a path as a tree without mimic rules, with the link names of the table."""
    names, z = link_names(table), np.array([0.0, 0.0, 1.0])
    joints = list[tuple[Joint, str, str]]()
    for i, joint in enumerate(path.joints):
        kind = JointKind.CONTINUOUS if joint.kind.turns else JointKind.PRISMATIC
        limit = Limit(*slides[joint.name], math.inf, math.inf) if joint.name in slides else None
        one = Joint(joint.name, kind, 0, joint.T_previous_joint, z, limit)
        joints.append((one, names[i], names[i + 1]))
    last = free_tree(table).joints[-1]
    joints.append((replace(last, T_parent_joint=path.T_last_tip), names[-2], names[-1]))
    return build_tree(path.robot, names[0], joints)
