"""Fit a reference table to the URDF: first the table's free parameters, then as few cells as possible.

The tip's error at each sampled configuration is a twist. A small change of any number in the table also moves
the tip by a twist: a rotation about a line or a translation along a line. The Gauss-Newton method finds the
changes that remove the error. Base, tool and joint offsets are the free parameters. urdfkin first fits the
free parameters. It then changes cells of the table to remove the remaining error. Sometimes different cells
can remove the same error, for example offsets along parallel axes. A reweighted least-norm solution then
changes as few cells as possible.

**Free parameters.** `fit_freedoms` fits base, tool and joint offsets, with the cells unchanged. The method is
damped least squares (`urdfkin.kinematics.least_squares`) on the tip's twists. Two joints with nearly
coinciding axes have nearly the same effect. If one joint offset increases by an angle and the other joint
offset decreases by this angle, the tip moves by at most the angle times the distance of the two axes.
Therefore, such a change of the two offsets reduces the error only slightly. To make long steps possible, the
damping decreases while steps succeed. When the error no longer decreases, urdfkin adds a large angle to one
of the two offsets, and subtracts the angle from the other offset. Then it fits again.

**Signs.** `align` finds the joint signs and the directions of x with which a reference table fits the URDF.
The author of a table has three choices that do not change the robot: the positive direction of a joint, the
direction of x along a common normal, and the zero position of theta. The signs +1 and -1 represent the two
possible directions. The zero positions of theta follow from the signs of all joints and of all x axes. Each
combination of signs gives a table for the URDF. A beam search chooses the signs joint by joint. At each
joint, it keeps the combinations whose tables are closest to the reference table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdfkin.dh.common_normals import (
    LARGEST_HAYATI_TILT,
    NEARLY_PARALLEL,
    AxisTransform,
    NearParallel,
    step_between,
)
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHRow, DHTable, along_axis, between_axes
from urdfkin.kinematics.least_squares import least_squares
from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.kinematics.roundings import EPS, NOT_ZERO, of_a_fit
from urdfkin.model.chain import LEAST_SIZE, FrameChain
from urdfkin.model.path import ElementaryMotion, Path
from urdfkin.model.tree import FloatArray, pose

#: The cells have the order of their transforms in a row, which `_ROW` contains.
CELLS = ("theta", "d", "a", "alpha", "beta")
_ROW = (
    ElementaryMotion(2, True),
    ElementaryMotion(2, False),
    ElementaryMotion(0, False),
    ElementaryMotion(0, True),
    ElementaryMotion(1, True),
)
#: The step of the fit is limited, in radians for angles, and in metres per metre of reach for lengths.
LONGEST_STEP = 0.5
#: The fit of the cells ends after `_ROUNDS` steps.
#: A step is an improvement if it reduces the error by more than the fraction `_BETTER`.
#: A mean error of at most `_SOLVED`, relative to the reach, is treated as zero.
_ROUNDS, _BETTER, _SOLVED = 40, 1e-9, 1e-14
#: A singular value is treated as zero if it is below this fraction of the largest singular value.
#: `_FREE` is for the fit of the free parameters, and `_CELLS` is for the fit of the cells.
_FREE, _CELLS = 1e-8, 1e-9
#: Each of `_SPARSER` iterations computes new weights of the cells.
#: The smallest weight is the fraction `_STAYS` of the reach.
_SPARSER, _STAYS = 25, 1e-9
#: The weights of the cells increase from 1 for the first cell to this number for the last cell.
#: If two cells have the same effect on the tip, the solution then changes only one of them.
_LAST_WINS = 1.2
#: The weight of beta begins with `_BETA`, and each iteration multiplies it by `_BETA_AGAIN`.
#: With a small weight, beta changes only if a change of alpha is not enough.
_BETA, _BETA_AGAIN = 0.3, 0.5
#: A cell cannot be determined if a change of free parameters has the same effect on the tip.
#: The two effects are treated as equal if they differ by at most this fraction.
_HIDDEN = 1e-6


@dataclass(frozen=True)
class TableArrays:
    """The numbers of a standard table, as arrays for a fit.

    Attributes:
        cells: (n, 5) theta, d, a, alpha, beta of each row.
        turns: (n,) 1 for revolute rows, 0 for prismatic rows.
        senses: (n,) +1 or -1.
        base: (4, 4) T_base_0 (metres).
        tool: (4, 4) T_n_tip (metres).
    """

    cells: FloatArray
    turns: FloatArray
    senses: FloatArray
    base: FloatArray
    tool: FloatArray

    @cached_property
    def first(self) -> FloatArray:
        """(4, 4) pose of the first revolute joint's frame relative to frame 0, with all joints at zero."""
        turning = np.flatnonzero(self.turns)
        end = len(CELLS) * int(turning[0]) if turning.size else 0
        return Path((np.eye(4), *self._motions[:end])).poses(self.cells.ravel()[:end])

    @cached_property
    def last(self) -> FloatArray:
        """(4, 4) pose of the tip in the last revolute joint's frame, with the later joints at zero."""
        turning = np.flatnonzero(self.turns)
        begin = len(CELLS) * int(turning[-1] if turning.size else len(self.cells) - 1) + CELLS.index("a")
        return Path((*self._motions[begin:], self.tool)).poses(self.cells.ravel()[begin:])

    def own(self, i: int) -> int:
        """Return the index of the cell in row i that contains the joint's variable, which is theta or d."""
        return 0 if self.turns[i] else 1

    @property
    def _motions(self) -> tuple[ElementaryMotion, ...]:
        return _ROW * len(self.cells)

    def path_at(self, values: FloatArray) -> tuple[Path, FloatArray]:
        """Return the path from base to tip, and an array (s, 5 n) with the angles and lengths of its motions.

        `values` (s, n) contains the joint values of s samples. Each cell of the table is the angle or length
        of one motion.
        """
        amounts = np.tile(self.cells.ravel(), (len(values), 1))
        for i in range(len(self.cells)):
            amounts[:, len(CELLS) * i + self.own(i)] += self.senses[i] * values[:, i]
        return Path((self.base, *self._motions, self.tool)), amounts

    def poses(self, values: FloatArray) -> FloatArray:
        path, amounts = self.path_at(values)
        return path.poses(amounts)


@dataclass(frozen=True, slots=True)
class TargetPoses:
    """The target poses of the tip: the poses of the URDF's tip that the table should have.

    Attributes:
        values: (s, n) joint values of the URDF in s samples.
        poses: (s, 4, 4) poses of the URDF's tip at these values.
        scale: Length (metres) that converts radians to metres.
    """

    values: FloatArray
    poses: FloatArray
    scale: float

    def apart(self, model: TableArrays) -> tuple[float, float]:
        """Return the largest errors of a model's tip on the samples, in metres and in radians."""
        poses = model.poses(self.values)
        metres = np.linalg.norm(poses[:, :3, 3] - self.poses[:, :3, 3], axis=-1).max()
        return float(metres), float(rotation_angle(poses[:, :3, :3], self.poses[:, :3, :3]).max())

    def errors(self, poses: FloatArray) -> FloatArray:
        """Return the twists (6 s,) from a model's poses to the target poses, with angles times `scale`."""
        turn = log_rotation(self.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], -1, -2))
        return np.concatenate([self.poses[:, :3, 3] - poses[:, :3, 3], self.scale * turn], axis=-1).ravel()


def columns(
    model: TableArrays, wanted: TargetPoses, frames: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the tip's poses, and their derivatives by the free parameters and by the cells, as twists.

    Each of the two arrays of derivatives has six rows for each sample, and a column for each parameter or
    cell. The free parameters are six numbers of the base, six of the tool, and the variable of each row. The
    cells are in row order: five cells of row 1, five cells of row 2, and so on. Angles are multiplied by the
    scale. `frames` are the poses of all frames of the model at all samples, which are computed if None.
    """
    scale = wanted.scale
    path, amounts = model.path_at(wanted.values)
    poses, twists = path.columns_at(path.frames(amounts) if frames is None else frames)
    # Changes of angles, and the angular parts of twists, are in metres after the factor `scale`.
    n, turning = len(model.cells), np.tile([motion.turns for motion in _ROW], len(model.cells))
    twists = twists * np.where(turning, 1.0 / scale, 1.0)
    twists[:, 3:] *= scale
    cells = twists.reshape(-1, len(CELLS) * n)
    own = [5 * i + model.own(i) for i in range(n)]
    first = np.broadcast_to(model.base @ model.first, poses.shape)
    ends = [_end(poses, first, scale), _end(poses, poses @ np.linalg.inv(model.last), scale)]
    return poses, np.hstack([*ends, cells[:, own]]), cells


def _end(poses: FloatArray, at: FloatArray, scale: float) -> FloatArray:
    """Return the twists of the tip when the frame `at`, and everything after it, is translated or rotated.

    The result (6 samples, 6) has three columns for translations along the axes of the frame, and three
    columns for rotations about these axes.
    """
    arm = poses[:, :3, 3] - at[:, :3, 3]
    axes = np.swapaxes(at[:, :3, :3], 1, 2)
    out = np.zeros((len(poses), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = at[:, :3, :3]
    out[:, :3, 3:] = np.swapaxes(np.cross(axes, arm[:, np.newaxis]) / scale, 1, 2)
    return out.reshape(-1, 6)


def fit_cells(model: TableArrays, wanted: TargetPoses, cells_of: FloatArray, *, free: bool) -> TableArrays:
    """Fit the table to the URDF with the fewest and smallest changes of cells.

    `cells_of` is an (n, 5) mask: 1 for cells that may change, 0 for all other cells. With `free`, base, tool
    and joint offsets may change too.
    """
    start, best, best_size, scale = model, model, np.inf, wanted.scale
    for _ in range(_ROUNDS):
        poses, freedoms, cells = columns(model, wanted)
        error = wanted.errors(poses)
        size = float(np.linalg.norm(error))
        if size < best_size * (1.0 - _BETTER):
            best, best_size = model, size
        elif size > 2.0 * best_size or size <= _SOLVED * scale * len(error):
            break
        cells = cells * cells_of.ravel()
        freedoms = freedoms if free else np.zeros_like(freedoms)
        change = _sparse(model, start, freedoms, cells, error, scale)
        # For two nearly coinciding axes, opposite changes of the two offsets have almost no effect.
        # The argument rcond removes these changes.
        offsets = np.linalg.lstsq(freedoms, error - cells @ change, rcond=_FREE)[0]
        shorten = min(1.0, LONGEST_STEP * scale / max(float(np.abs(offsets).max()), NOT_ZERO))
        model = moved(model, np.asarray(offsets * shorten, np.float64), scale, change * shorten)
    return best


def _sparse(
    model: TableArrays,
    start: TableArrays,
    freedoms: FloatArray,
    cells: FloatArray,
    error: FloatArray,
    scale: float,
) -> FloatArray:
    """Return the changes of cells that remove the error which remains after the fit of the free parameters.

    After these changes, as few cells as possible differ from the cells of `start`.
    """
    Q = _span(freedoms)
    cells_left = cells - Q @ (Q.T @ cells)
    in_metres = np.array([scale, 1.0, 1.0, scale, scale])
    so_far = ((model.cells - start.cells) * in_metres).ravel()
    # The free parameters include the joint offset of each row.
    # A cell with the same effect as a joint offset therefore does not change.
    target = error - Q @ (Q.T @ error) + cells_left @ so_far
    total = np.zeros(cells.shape[1])
    weights = np.linspace(1.0, _LAST_WINS, cells.shape[1])
    betas = slice(CELLS.index("beta"), None, len(CELLS))
    weights[betas] = _BETA
    turned, square = np.linalg.qr(cells_left)
    for _ in range(_SPARSER):
        total = weights * np.linalg.lstsq(square * weights, turned.T @ target, rcond=_CELLS)[0]
        weights = np.abs(total) + _STAYS * scale
        weights[betas] *= _BETA_AGAIN
    return np.asarray(total - so_far, np.float64)


def _span(freedoms: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the free parameters' twists; no columns if all twists are zero."""
    return np.linalg.qr(freedoms)[0] if freedoms.any() else np.zeros((len(freedoms), 0))


def hidden_cells(model: TableArrays, wanted: TargetPoses) -> list[tuple[int, int]]:
    """Return (row, cell index) of each cell whose value cannot be determined from the tip's poses.

    For such a cell, some change of the free parameters has the same effect on the tip as a change of the
    cell. Two effects are treated as the same if they differ by at most a millionth.
    """
    _, freedoms, cells = columns(model, wanted)
    Q = _span(freedoms)
    left = np.linalg.norm(cells - Q @ (Q.T @ cells), axis=0)
    seen = np.flatnonzero(left <= _HIDDEN * np.linalg.norm(cells, axis=0))
    return [(int(one) // len(CELLS), int(one) % len(CELLS)) for one in seen]


def moved(
    model: TableArrays, free: FloatArray, scale: float, change: FloatArray | None = None
) -> TableArrays:
    """Return the model after small changes of its free parameters and cells.

    All changes are in metres: changes of angles are multiplied by `scale`.
    """
    per_cell = np.array([1.0 / scale, 1.0, 1.0, 1.0 / scale, 1.0 / scale])
    cells = model.cells.copy() if change is None else model.cells + change.reshape(-1, 5) * per_cell
    for i, own in enumerate(free[12:]):
        k = model.own(i)
        cells[i, k] += own * per_cell[k]
    # The change of the base is expressed in the frame of the first revolute joint.
    # The change of the tool is expressed in the frame of the last revolute joint.
    # A rotation about the axis of this joint then exactly equals a change of the joint's offset.
    base = _apply_twist(model.base @ model.first, free[:6], scale) @ np.linalg.inv(model.first)
    tool = np.linalg.inv(model.last) @ _apply_twist(np.eye(4), free[6:12], scale) @ model.last
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(model.tool @ tool))


def _apply_twist(T: FloatArray, twist: FloatArray, scale: float) -> FloatArray:
    """Return T after a small translation and rotation, which are expressed in the frame of T."""
    return T @ pose(exp_rotation(twist[3:] / scale), twist[:3])


#: The fit of the free parameters ends after this number of slow steps.
_PATIENCE = 4
#: A fit ends at this mean error, relative to the reach.
_ROUNDING = 1e-13
#: A fast fit calls `align` with these arguments `count` and `beam`.
HASTY = (3, 16)
#: The search ends at this tip error, relative to the reach, because such an error is only rounding.
_AT_ROUNDING = 1e-12
#: Other joint signs than in the file are used only if the tip error falls below this fraction.
_TWICE_AS_GOOD = 0.5
#: The fit adds one of these angles (rad) to a joint offset, and subtracts it from the next joint offset.
_TURNS = (math.pi, 0.5 * math.pi, -0.5 * math.pi)


def as_written(standard: DHTable) -> TableArrays:
    return TableArrays(
        np.array([(row.theta, row.d, row.a, row.alpha, row.beta) for row in standard.rows]),
        np.array([float(row.kind.turns) for row in standard.rows]),
        np.array([float(row.sense) for row in standard.rows]),
        standard.base,
        standard.tool,
    )


def fitted_model(
    chain: FrameChain,
    standard: DHTable,
    written: TableArrays,
    wanted: TargetPoses,
    enough: float = 0.0,
    *,
    hasty: bool = False,
) -> TableArrays:
    """Return the best of several fits.

    The fits start from the written table, and from tables with other joint signs. Other joint signs are used
    only if they halve the error.
    """

    def size(model: TableArrays) -> float:
        metres, radians = wanted.apart(model)
        return metres + wanted.scale * radians

    if size(written) <= EPS * of_a_fit(0) * wanted.scale:
        return written
    best, best_size = written, size(written)
    for start in starts(chain, standard, written, *(HASTY if hasty else ())):
        # Least squares minimize the sum over all samples, but models are compared by their worst sample.
        # Therefore, the model before the fit may be better than the fitted model.
        model = min(fit_freedoms(start, wanted, turns=not hasty), start, key=size)
        needed = 1.0 if start is written else _TWICE_AS_GOOD
        if (its_size := size(model)) < needed * best_size:
            best, best_size = model, its_size
        if best_size <= max(enough, _AT_ROUNDING * wanted.scale):
            break
    return ends_gathered(best, written)


def ends_gathered(model: TableArrays, written: TableArrays) -> TableArrays:
    """Move the fitted offset of the first joint into the base, and of the last joint into the tool."""
    cells, n = model.cells.copy(), len(model.cells)
    _, _, a, alpha, beta = cells[-1]
    step = between_axes(a, alpha, beta)
    base, tool = model.base, model.tool
    for i in dict.fromkeys((0, n - 1)):
        k = model.own(i)
        change = cells[i, k] - written.cells[i, k]
        cells[i, k] = written.cells[i, k]
        S = along_axis(change, 0.0) if model.turns[i] else along_axis(0.0, change)
        if i == 0:
            base = base @ S
        else:
            tool = np.linalg.solve(step, S @ step) @ tool
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(tool))


def starts(chain: FrameChain, standard: DHTable, written: TableArrays, *effort: int) -> Iterator[TableArrays]:
    """Yield the table as it is written, then the table with each likely combination of joint signs."""
    yield written
    for aligned in align(chain, replace(standard, base=np.eye(4), tool=np.eye(4)), *effort):
        yield _start(standard, aligned)


def _start(standard: DHTable, aligned: SignedFit) -> TableArrays:
    senses = np.array(aligned.senses, dtype=np.float64)
    start = replace(as_written(standard), senses=senses, base=aligned.base, tool=aligned.tool)
    for i, offset in enumerate(aligned.offsets):
        start.cells[i, start.own(i)] += offset
    return start


def fit_freedoms(model: TableArrays, wanted: TargetPoses, *, turns: bool, ends: bool = False) -> TableArrays:
    """Fit base, tool and offsets, or with `ends` only base and tool.

    With `turns`, `_opposite_rotations` is called when the error no longer decreases.
    """
    for _ in range(2 * len(model.cells)):
        model, size = _descend(model, wanted, ends)
        if not turns or size <= _ROUNDING * wanted.scale * math.sqrt(6 * len(wanted.values)):
            break
        turned = min(_opposite_rotations(model), key=lambda one: _size(one, wanted), default=model)
        if _size(turned, wanted) >= size:
            break
        model = turned
    return model


def _size(model: TableArrays, wanted: TargetPoses) -> float:
    return float(np.linalg.norm(wanted.errors(model.poses(wanted.values))))


def _descend(model: TableArrays, wanted: TargetPoses, ends: bool) -> tuple[TableArrays, float]:
    def residuals(model: TableArrays) -> tuple[FloatArray, FloatArray]:
        path, amounts = model.path_at(wanted.values)
        frames = path.frames(amounts)
        return wanted.errors(frames[..., -1, :, :]), frames

    def derivatives(model: TableArrays, frames: FloatArray) -> FloatArray:
        return columns(model, wanted, frames)[1][:, : 12 if ends else None]

    return least_squares(
        model,
        residuals,
        derivatives,
        lambda model, free: moved(model, free, wanted.scale),
        longest=LONGEST_STEP * wanted.scale,
        patience=_PATIENCE,
    )


def _opposite_rotations(model: TableArrays) -> list[TableArrays]:
    """Return models with an angle added to one joint offset and subtracted from the next joint offset.

    If the axes of the two joints nearly coincide, this change has little effect on the tip.
    """
    found = []
    for i in range(len(model.cells) - 1):
        sense = math.copysign(1.0, math.cos(float(model.cells[i, 3])))
        for turn in _TURNS if model.turns[i] and model.turns[i + 1] else ():
            cells = model.cells.copy()
            cells[i, 0] += turn
            cells[i + 1, 0] -= sense * turn
            found.append(replace(model, cells=cells))
    return found


#: `align` returns `PATTERNS` combinations of signs, and keeps `BEAM` combinations at each joint.
PATTERNS, BEAM = 12, 128
#: Each reversed joint adds this number (metres) to the cost of a combination.
#: Among equally good combinations, the search therefore selects the joint signs of the URDF.
REVERSAL = 1e-9
#: A prismatic axis can be shifted freely.
#: Differences of lengths next to such an axis are therefore multiplied by this small weight.
_SLIDING = 1e-3
#: Parallel axes with a smaller distance (metres) are treated as coinciding.
#: The direction of x can then be chosen.
_NO_OFFSET = 1e-5
#: Numbers (metres, radians) of equal candidates agree after rounding to this number of decimals.
_ALIKE = 6

_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class SignedFit:
    """A combination of joint signs, with the joint offsets, the base and the tool that belong to these signs.

    Attributes:
        senses: +1 or -1 for each joint. With -1, the reference's variable decreases if the URDF's joint value
            increases.
        offsets: Constant of each joint that is added to theta in the reference table (to d for a prismatic
            joint).
        base: (4, 4) pose of the reference's frame 0 in the URDF's base.
        tool: (4, 4) pose of the URDF's tip in the reference's last frame.
        cost: Sum of the differences between the cells of the two tables, in metres. Differences of angles are
            multiplied by the reach.
    """

    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    base: FloatArray
    tool: FloatArray
    cost: float


@dataclass(frozen=True, slots=True)
class _Partial:
    """An alignment of the first joints of the chain, which will be extended joint by joint.

    Attributes:
        cost: Sum of the differences between the cells of the two tables (metres), for all rows before the row
            of the last joint.
        senses: Sign (+1 or -1) of each of these joints.
        offsets: Offsets of these joints except the last joint.
        phi_in: Rotation about z from the last joint's DH frame to its URDF frame (rad).
        carry: Offset along z from the last joint's DH frame to its URDF frame (metres).
        base: (4, 4) transform that becomes part of the base, instead of an offset in the first row.
        absorber: (row index, sign) for a row whose joint offset can be chosen freely. None if no joint offset
            can be chosen. If axes before the last joint coincide, only the sum of their joint angles is
            defined, so one joint offset can be chosen. The sign says in which direction this joint offset
            rotates x. If the index is 0, the joint offset is part of the base.
    """

    cost: float
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    phi_in: float
    carry: float
    base: FloatArray
    absorber: tuple[int, float] | None = None


def align(chain: FrameChain, reference: DHTable, count: int = PATTERNS, beam: int = BEAM) -> list[SignedFit]:
    """Return the joint signs with which the table of a path is closest to a reference table.

    The reference table must be standard and have the same kinds of joints. With prismatic joints, several
    combinations of signs may give equal tables. Only a fit can distinguish these combinations, so the
    function returns up to `count` combinations.
    """
    reach = max(chain.reach, reference.span, LEAST_SIZE)
    n = len(reference.rows)
    partials = [_Partial(REVERSAL * (sense < 0), (sense,), (), 0.0, 0.0, np.eye(4)) for sense in (1, -1)]
    for i in range(n - 1):
        longer = [
            extended
            for partial in partials
            for sense in (1, -1)
            for extended in _extend(partial, chain, reference, i, sense, reach)
        ]
        partials = _without_equivalents(sorted(longer, key=lambda partial: partial.cost))[:beam]
    # If axes nearly coincide, many directions of x are nearly equivalent.
    # A fit that starts from one of these directions can reach all of them.
    # Therefore, only the best candidate is kept for each combination of joint signs.
    by_senses: dict[tuple[int, ...], _Partial] = {}
    for partial in partials:
        by_senses.setdefault(partial.senses, partial)
    best = list(by_senses.values())[:count]
    return [_close_chain(partial, chain, reference) for partial in best]


def _without_equivalents(partials: list[_Partial]) -> list[_Partial]:
    """Keep only the first of several equivalent candidates, which coinciding axes lead to."""
    found: dict[tuple[object, ...], _Partial] = {}
    for one in partials:
        # If `absorber` names a row, the joint offset of this row can reverse x.
        # The two directions of x are then equivalent.
        circle = math.pi if one.absorber else 2.0 * math.pi
        ahead = round(one.phi_in % circle, _ALIKE), round(one.carry, _ALIKE)
        found.setdefault((one.senses, one.absorber, *ahead), one)
    return list(found.values())


def _pose(chain: FrameChain, k: int, before: int, after: int) -> FloatArray:
    """Return the constant pose A_k; reverse the z axis of each neighbouring joint with sign -1."""
    A = chain.constants[k]
    A = _HALF_TURN @ A if before < 0 else A
    return np.array(A @ _HALF_TURN if after < 0 else A)


def _extend(
    partial: _Partial, chain: FrameChain, reference: DHTable, i: int, sense: int, reach: float
) -> list[_Partial]:
    """Extend an alignment from joint i to joint i + 1; try both directions of x."""
    row, turns = reference.rows[i], [one.kind.turns for one in reference.rows]
    A = _pose(chain, i + 1, partial.senses[-1], sense)
    delta = row.d - partial.carry if turns[i] and i > 0 else 0.0
    found = []
    for step in _steps(A, row, delta, reach, row.theta - partial.phi_in, turns[i] and turns[i + 1]):
        candidate = _absorb(partial, step, row.theta) if i > 0 and not turns[i] else partial
        theta, d = candidate.phi_in + step.phi, candidate.carry + step.delta
        cost = candidate.cost + REVERSAL * (sense < 0)
        cost += reach * (_apart(step.alpha, row.alpha) + abs(step.beta - row.beta))
        cost += abs(step.a - row.a) * (1.0 if turns[i] and turns[i + 1] else _SLIDING)
        if i > 0 and turns[i]:
            cost += abs(d - row.d) * (1.0 if turns[i - 1] and turns[i + 1] else _SLIDING)
        if not turns[i] and i > 0:
            cost += reach * _apart(theta, row.theta)
        offset = math.remainder(theta - row.theta, 2.0 * math.pi) if turns[i] else d - row.d
        base = candidate.base
        if i == 0:  # The base contains the first row's offset.
            base, offset = along_axis(step.phi - row.theta, step.delta - row.d), 0.0
        senses, offsets = (*candidate.senses, sense), (*candidate.offsets, offset)
        absorber = _absorber(candidate, step, i, turns[i])
        found.append(_Partial(cost, senses, offsets, step.phi_next, step.delta_next, base, absorber))
    return found


def _absorber(partial: _Partial, step: AxisTransform, i: int, turns: bool) -> tuple[int, float] | None:
    if not step.phi_is_free:
        return None
    sign = math.copysign(1.0, math.cos(step.alpha))
    if turns or i == 0:
        return i, sign
    return None if partial.absorber is None else (partial.absorber[0], sign * partial.absorber[1])


def _absorb(partial: _Partial, step: AxisTransform, theta: float) -> _Partial:
    """Set theta of a prismatic joint to theta in the reference table.

    The joint offset of the row in `partial.absorber` changes by the difference between the old and the new
    theta. If `partial.absorber` is None, the alignment is unchanged.
    """
    if partial.absorber is None:
        return partial
    excess = partial.phi_in + step.phi - theta
    index, sign = partial.absorber
    offsets, base = list(partial.offsets), partial.base
    if index == 0:
        base = base @ along_axis(sign * excess, 0.0)
    else:
        offsets[index] += sign * excess
    return replace(partial, phi_in=partial.phi_in - excess, offsets=tuple(offsets), base=base)


def _steps(
    A: FloatArray, row: DHRow, delta: float, reach: float, phi_free: float, placed: bool
) -> Iterator[AxisTransform]:
    """Yield the possible transforms (`AxisTransform`) between two axes, with both directions of x.

    If the axes are nearly parallel in the URDF and in the reference table, the function yields the transform
    of a Hayati row. The x axis of this row is at the offset d of the reference table. If the distance of the
    axes is nearly zero, the direction of x can be chosen freely. The argument `placed` is False if one of the
    joints is prismatic. The axis of a prismatic joint can be shifted, so the direction of x can then be
    chosen too. If beta is 0 in the reference row, the function also yields the transform along the common
    normal. A shift of a prismatic axis does not change the direction of the common normal.
    """
    steps = []
    sine = math.hypot(A[0, 2], A[1, 2])
    near = abs(math.sin(row.alpha)) < LARGEST_HAYATI_TILT and sine < LARGEST_HAYATI_TILT
    if not near or row.beta == 0.0:
        steps.append(step_between(A, reach, NearParallel.STRICT, phi_free))
    if near:
        lifted = A.copy()
        lifted[2, 3] -= delta
        if math.hypot(lifted[0, 3], lifted[1, 3]) < _NO_OFFSET or not placed:
            lifted[:2, 3] = 0.0
        # With reach 0, `step_between` makes a Hayati row for all axes that are not exactly parallel.
        cut = step_between(lifted, reach if sine < NEARLY_PARALLEL else 0.0, NearParallel.HAYATI, phi_free)
        steps.append(replace(cut, delta=cut.delta + delta))
    for step in steps:
        yield step
        yield replace(step.with_reversed_x(), phi_is_free=step.phi_is_free)


def _close_chain(best: _Partial, chain: FrameChain, reference: DHTable) -> SignedFit:
    n = len(reference.rows)
    last = reference.rows[-1]
    start = _pose(chain, 0, 1, best.senses[0]) @ best.base
    rest = along_axis(best.phi_in - last.theta, best.carry - last.d) @ _pose(chain, n, best.senses[-1], 1)
    if n == 1:
        start, rest = start @ along_axis(-last.theta, -last.d), _pose(chain, 1, best.senses[0], 1)
    tool = np.asarray(np.linalg.solve(last.X, rest), np.float64)
    return SignedFit(best.senses, (*best.offsets, 0.0), start, tool, best.cost)


def _apart(first: float, second: float) -> float:
    return abs(math.remainder(first - second, 2.0 * math.pi))
