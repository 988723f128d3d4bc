"""Fit a reference table to the tip poses of a URDF.

| Fit | Changed numbers |
|---|---|
| first | free parameters: base, tool and joint offsets |
| second | free parameters, and as few cells as possible |

Changes of different cells can often cancel the same tip error. The second fit therefore uses reweighted least
squares, which change few cells.

If two joint axes nearly coincide, changes of their joint offsets can cancel at the tip, and a fit can stop
too early. `fit_free_parameters` therefore changes two consecutive offsets by a large angle, and fits again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdfkin.dh.compare.signs import find_sign_fits
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHTable, joint_transform, link_transform
from urdfkin.kinematics.least_squares import least_squares
from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.kinematics.roundings import EPS, MIN_DIVISOR, fitted_table_roundings
from urdfkin.model.chain import FrameChain
from urdfkin.model.path import ElementaryMotion, Path
from urdfkin.model.tree import FloatArray, pose

_CELL_MOTIONS = {
    "theta": ElementaryMotion(2, True),
    "d": ElementaryMotion(2, False),
    "a": ElementaryMotion(0, False),
    "alpha": ElementaryMotion(0, True),
    "beta": ElementaryMotion(1, True),
}
CELLS = tuple(_CELL_MOTIONS)
_IS_ANGLE = np.array([motion.turns for motion in _CELL_MOTIONS.values()])
#: Maximum change of a free parameter in one step of the fit (rad, or a fraction of the reach).
_MAX_STEP = 0.5
_MAX_STEPS = 40
_MIN_DECREASE = 1e-9
#: The fit of the cells ends if the norm of the errors no longer decreases, and is below a limit. For s
#: samples, the limit is 6 s * reach * this number.
_CONVERGED_ERROR = 1e-14
_RCOND_FREE, _RCOND_CELLS = 1e-8, 1e-9
_REWEIGHTINGS = 25
_MIN_WEIGHT = 1e-9
#: Initial weight of the table's last cell; the first cell has weight 1, and the weights increase evenly. Two
#: cells with the same effect have different weights, so that only one of these cells changes.
_LAST_CELL_WEIGHT = 1.2
#: Initial weight of the column beta, and factor of this weight at each reweighting. Both numbers are below 1,
#: so the fit changes beta only if a change of alpha does not suffice.
_BETA_WEIGHT, _BETA_FACTOR = 0.3, 0.5
_SAME_EFFECT_TOLERANCE = 1e-6
_PATIENCE = 4
#: Large changes of joint offsets are tried only if the RMS error exceeds this fraction of the reach.
_EXACT_FIT_ERROR = 1e-13
#: The fit tries no further joint signs if the tip error is at most this fraction of the reach.
_EXACT_TIP_ERROR = 1e-12
#: A fit with other joint signs must reduce the smallest earlier tip error below this fraction.
_OTHER_SIGNS_ERROR_RATIO = 0.5
#: A table with fitted translations is a start table if its tip error is at most this fraction of the reach.
_MAX_START_ERROR = 1e-6
#: Large changes (rad), which the fit adds to theta_i and subtracts from theta_{i+1}. If cos(alpha_i) < 0, the
#: fit adds the change to theta_{i+1} too, because the axes have opposite directions.
_LARGE_ANGLES = (math.pi, 0.5 * math.pi, -0.5 * math.pi)
#: `count` and `beam_width` of `find_sign_fits` in a fast fit.
FAST_SEARCH = (3, 16)


@dataclass(frozen=True)
class TableArrays:
    """Numbers of a standard table.

    Attributes:
        cells: (n, 5) numbers; the columns are theta, d, a, alpha and beta.
        turns: 1 for each revolute joint, 0 for each prismatic joint.
    """

    cells: FloatArray
    turns: FloatArray
    senses: FloatArray
    base: FloatArray
    tool: FloatArray

    @classmethod
    def of(cls, standard: DHTable) -> TableArrays:
        return cls(
            np.array([[getattr(row, cell) for cell in CELLS] for row in standard.rows]),
            np.array([float(row.kind.turns) for row in standard.rows]),
            np.array([float(row.sense) for row in standard.rows]),
            standard.base,
            standard.tool,
        )

    @cached_property
    def T_0_first_revolute(self) -> FloatArray:
        """Pose of the first revolute joint's frame in frame 0, with all joints at zero."""
        turning = np.flatnonzero(self.turns)
        end = len(CELLS) * int(turning[0]) if turning.size else 0
        return Path((np.eye(4), *self._motions[:end])).poses(self.cells.ravel()[:end])

    @cached_property
    def T_last_revolute_tip(self) -> FloatArray:
        """Pose of the tip in the last revolute joint's frame, with the later joints at zero."""
        turning = np.flatnonzero(self.turns)
        begin = len(CELLS) * int(turning[-1] if turning.size else len(self.cells) - 1) + CELLS.index("a")
        return Path((*self._motions[begin:], self.tool)).poses(self.cells.ravel()[begin:])

    @cached_property
    def variable_indices(self) -> tuple[int, ...]:
        """Column index in `CELLS` of each joint's variable."""
        return tuple(CELLS.index("theta" if turns else "d") for turns in self.turns)

    @property
    def _motions(self) -> tuple[ElementaryMotion, ...]:
        return tuple(_CELL_MOTIONS.values()) * len(self.cells)

    def path_and_amounts(self, values: FloatArray) -> tuple[Path, FloatArray]:
        """Return the path and the amount (rad or m) of each elementary motion, (s, 5 n).

        `values` are (s, n) joint values.
        """
        amounts = np.tile(self.cells.ravel(), (len(values), 1))
        for i, k in enumerate(self.variable_indices):
            amounts[:, len(CELLS) * i + k] += self.senses[i] * values[:, i]
        return Path((self.base, *self._motions, self.tool)), amounts

    def poses(self, values: FloatArray) -> FloatArray:
        path, amounts = self.path_and_amounts(values)
        return path.poses(amounts)


@dataclass(frozen=True, slots=True)
class TargetPoses:
    """Sampled poses of the URDF's tip.

    Attributes:
        values: (s, n) joint values.
        scale: Length that converts radians to metres.
    """

    values: FloatArray
    poses: FloatArray
    scale: float

    def largest_errors(self, model: TableArrays) -> tuple[float, float]:
        """Return largest errors (m, rad)."""
        poses = model.poses(self.values)
        metres = np.linalg.norm(poses[:, :3, 3] - self.poses[:, :3, 3], axis=-1).max()
        return float(metres), float(rotation_angle(poses[:, :3, :3], self.poses[:, :3, :3]).max())

    def error_twists(self, poses: FloatArray) -> FloatArray:
        """Return the twists (6 s,) from poses to their targets, with angles multiplied by `scale`."""
        turn = log_rotation(self.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], -1, -2))
        return np.concatenate([self.poses[:, :3, 3] - poses[:, :3, 3], self.scale * turn], axis=-1).ravel()


def tip_poses_and_derivatives(
    model: TableArrays, targets: TargetPoses, frames: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the tip's poses, and their derivatives as twists with angles multiplied by the scale.

    | Result | Shape |
    |---|---|
    | poses of s samples | (s, 4, 4) |
    | twists for base (6), tool (6) and joint offsets (n) | (6 s, 12 + n) |
    | twists for cells | (6 s, 5 n) |
    """
    scale = targets.scale
    path, amounts = model.path_and_amounts(targets.values)
    poses, twists = path.pose_and_jacobian_from_frames(path.frames(amounts) if frames is None else frames)
    n = len(model.cells)
    twists = twists * np.where(np.tile(_IS_ANGLE, n), 1.0 / scale, 1.0)
    twists[:, 3:] *= scale
    cells = twists.reshape(-1, len(CELLS) * n)
    variable_indices = [len(CELLS) * i + k for i, k in enumerate(model.variable_indices)]
    first_frames = np.broadcast_to(model.base @ model.T_0_first_revolute, poses.shape)
    last_frames = poses @ np.linalg.inv(model.T_last_revolute_tip)
    ends = [_tip_twists_of_frame_motions(poses, frame, scale) for frame in (first_frames, last_frames)]
    return poses, np.hstack([*ends, cells[:, variable_indices]]), cells


def _tip_twists_of_frame_motions(poses: FloatArray, frames: FloatArray, scale: float) -> FloatArray:
    """Return the tip's Jacobian (6 s, 6) for motions of a frame along and about the frame's axes."""
    arm = poses[:, :3, 3] - frames[:, :3, 3]
    axes = np.swapaxes(frames[:, :3, :3], 1, 2)
    twists = np.zeros((len(poses), 6, 6))
    twists[:, :3, :3] = twists[:, 3:, 3:] = frames[:, :3, :3]
    twists[:, :3, 3:] = np.swapaxes(np.cross(axes, arm[:, np.newaxis]) / scale, 1, 2)
    return twists.reshape(-1, 6)


def apply_changes(
    model: TableArrays, free: FloatArray, scale: float, cells: FloatArray | None = None
) -> TableArrays:
    """Add changes to free parameters and cells; the change of an angle is in rad times `scale`."""
    units = np.where(_IS_ANGLE, 1.0 / scale, 1.0)
    new_cells = model.cells.copy() if cells is None else model.cells + cells.reshape(-1, len(CELLS)) * units
    for i, offset in enumerate(free[12:]):
        k = model.variable_indices[i]
        new_cells[i, k] += offset * units[k]
    # A change of the base is a twist in the frame of the first revolute joint. A change of the tool is a
    # twist in the frame of the last revolute joint. Rotations about the z axes of these two frames have
    # exactly the same effect as joint offsets.
    base = _apply_twist(model.base @ model.T_0_first_revolute, free[:6], scale) @ np.linalg.inv(
        model.T_0_first_revolute
    )
    tool = (
        np.linalg.inv(model.T_last_revolute_tip)
        @ _apply_twist(np.eye(4), free[6:12], scale)
        @ model.T_last_revolute_tip
    )
    return replace(model, cells=new_cells, base=np.asarray(base), tool=np.asarray(model.tool @ tool))


def _apply_twist(T: FloatArray, twist: FloatArray, scale: float) -> FloatArray:
    """Apply a twist in T's frame."""
    return T @ pose(exp_rotation(twist[3:] / scale), twist[:3])


# -- cells ---------------------------------------------------------------------------------------------


def fit_cells(model: TableArrays, targets: TargetPoses, mask: FloatArray, *, free: bool) -> TableArrays:
    """Fit the table by changing few cells.

    `mask` (n, 5) is 1 for allowed changes. If `free` is true, base, tool and joint offsets change too.
    """
    start, best, best_size, scale = model, model, np.inf, targets.scale
    for _ in range(_MAX_STEPS):
        poses, free_derivatives, cell_derivatives = tip_poses_and_derivatives(model, targets)
        error = targets.error_twists(poses)
        size = float(np.linalg.norm(error))
        if size < best_size * (1.0 - _MIN_DECREASE):
            best, best_size = model, size
        elif size > 2.0 * best_size or size <= _CONVERGED_ERROR * scale * len(error):
            break
        cell_derivatives = cell_derivatives * mask.ravel()
        free_derivatives = free_derivatives if free else np.zeros_like(free_derivatives)
        cells = _sparse_changes(model, start, free_derivatives, cell_derivatives, error, scale)
        # If two axes nearly coincide, large changes of the two offsets can cancel at the tip. The cutoff
        # rcond prevents such changes.
        offsets = np.linalg.lstsq(free_derivatives, error - cell_derivatives @ cells, rcond=_RCOND_FREE)[0]
        shorten = min(1.0, _MAX_STEP * scale / max(float(np.abs(offsets).max()), MIN_DIVISOR))
        model = apply_changes(model, np.asarray(offsets * shorten, np.float64), scale, cells * shorten)
    return best


def _sparse_changes(
    model: TableArrays,
    start: TableArrays,
    free_derivatives: FloatArray,
    cell_derivatives: FloatArray,
    error: FloatArray,
    scale: float,
) -> FloatArray:
    """Return cell changes that remove the tip error, with few differences from the cells of `start`.

    A cell stays unchanged if free parameters can have the same effect on the tip.
    """
    Q = _orthonormal_basis(free_derivatives)
    remaining = cell_derivatives - Q @ (Q.T @ cell_derivatives)
    earlier = ((model.cells - start.cells) * np.where(_IS_ANGLE, scale, 1.0)).ravel()
    target = error - Q @ (Q.T @ error) + remaining @ earlier
    changes = np.zeros(cell_derivatives.shape[1])
    weights = np.linspace(1.0, _LAST_CELL_WEIGHT, cell_derivatives.shape[1])
    betas = slice(CELLS.index("beta"), None, len(CELLS))
    weights[betas] = _BETA_WEIGHT
    orthonormal, triangular = np.linalg.qr(remaining)
    for _ in range(_REWEIGHTINGS):
        scaled = np.linalg.lstsq(triangular * weights, orthonormal.T @ target, rcond=_RCOND_CELLS)[0]
        changes = weights * scaled
        weights = np.abs(changes) + _MIN_WEIGHT * scale
        weights[betas] *= _BETA_FACTOR
    return np.asarray(changes - earlier, np.float64)


def _orthonormal_basis(columns: FloatArray) -> FloatArray:
    return np.linalg.qr(columns)[0] if columns.any() else np.zeros((len(columns), 0))


def find_compensated_cells(model: TableArrays, targets: TargetPoses) -> list[tuple[int, int]]:
    """Find the cells (row, column) that free parameters can compensate."""
    _, free_derivatives, cell_derivatives = tip_poses_and_derivatives(model, targets)
    Q = _orthonormal_basis(free_derivatives)
    remaining = np.linalg.norm(cell_derivatives - Q @ (Q.T @ cell_derivatives), axis=0)
    compensated = np.flatnonzero(
        remaining <= _SAME_EFFECT_TOLERANCE * np.linalg.norm(cell_derivatives, axis=0)
    )
    return [divmod(int(index), len(CELLS)) for index in compensated]


# -- free parameters -----------------------------------------------------------------------------------


def fit_model(
    chain: FrameChain,
    standard: DHTable,
    targets: TargetPoses,
    target_error: float = 0.0,
    *,
    fast: bool = False,
) -> TableArrays:
    """Fit the free parameters and the joint signs; stop if the tip error is at most `target_error` (m)."""
    written = TableArrays.of(standard)

    def largest_error(model: TableArrays) -> float:
        metres, radians = targets.largest_errors(model)
        return metres + targets.scale * radians

    best, best_error = written, largest_error(written)
    if best_error <= EPS * fitted_table_roundings(0) * targets.scale:
        return written
    for i, start in enumerate(start_models(chain, standard, targets, *(FAST_SEARCH if fast else ()))):
        # A fit minimizes the sum of squared errors, so the largest error can increase.
        model = min(fit_free_parameters(start, targets, large_angles=not fast), start, key=largest_error)
        model_error = largest_error(model)
        if model_error < (1.0 if i == 0 else _OTHER_SIGNS_ERROR_RATIO) * best_error:
            best, best_error = model, model_error
        if best_error <= max(target_error, _EXACT_TIP_ERROR * targets.scale):
            break
    return move_end_offsets_to_base_and_tool(best, written)


def move_end_offsets_to_base_and_tool(model: TableArrays, written: TableArrays) -> TableArrays:
    cells, n = model.cells.copy(), len(model.cells)
    _, _, a, alpha, beta = cells[-1]
    X = link_transform(a, alpha, beta)
    base, tool = model.base, model.tool
    for i in dict.fromkeys((0, n - 1)):
        k = model.variable_indices[i]
        offset = cells[i, k] - written.cells[i, k]
        cells[i, k] = written.cells[i, k]
        S = joint_transform(offset, 0.0) if model.turns[i] else joint_transform(0.0, offset)
        if i == 0:
            base = base @ S
        else:
            tool = np.linalg.solve(X, S @ X) @ tool
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(tool))


def start_models(
    chain: FrameChain, standard: DHTable, targets: TargetPoses, *effort: int
) -> Iterator[TableArrays]:
    """Yield the table, then one or two tables for each likely combination of joint signs."""
    yield TableArrays.of(standard)
    for alignment in find_sign_fits(chain, replace(standard, base=np.eye(4), tool=np.eye(4)), *effort):
        senses = np.array(alignment.senses, dtype=np.float64)
        model = replace(TableArrays.of(standard), senses=senses, base=alignment.base, tool=alignment.tool)
        model.cells[range(len(senses)), model.variable_indices] += alignment.offsets
        yield model
        # If axes are nearly parallel, the offset of a prismatic joint can be wrong by hundreds of metres. The
        # steps of a fit are too short to correct such an error.
        moved = _fit_translations(model, targets)
        metres, radians = targets.largest_errors(moved)
        if metres + targets.scale * radians <= _MAX_START_ERROR * targets.scale:
            yield moved


def _fit_translations(model: TableArrays, targets: TargetPoses) -> TableArrays:
    """Fit the offsets of prismatic joints, and the translations of base and tool.

    The tip's position is linear in these parameters, so one step gives the exact fit.
    """
    poses, derivatives, _ = tip_poses_and_derivatives(model, targets)
    translations = np.concatenate([np.tile([True, True, True, False, False, False], 2), model.turns == 0.0])
    positions = np.tile([True, True, True, False, False, False], len(poses))
    free = np.zeros(len(translations))
    free[translations] = np.linalg.lstsq(
        derivatives[positions][:, translations], targets.error_twists(poses)[positions], rcond=None
    )[0]
    return apply_changes(model, free, targets.scale)


def fit_free_parameters(
    model: TableArrays, targets: TargetPoses, *, large_angles: bool, only_ends: bool = False
) -> TableArrays:
    """Fit base and tool. If `only_ends` is false, fit the joint offsets too."""
    for _ in range(2 * len(model.cells)):
        model, size = _least_squares_fit(model, targets, only_ends)
        if not large_angles or size <= _EXACT_FIT_ERROR * targets.scale * math.sqrt(6 * len(targets.values)):
            break
        changed = min(_add_large_angles(model), key=lambda one: _error_norm(one, targets), default=model)
        if _error_norm(changed, targets) >= size:
            break
        model = changed
    return model


def _error_norm(model: TableArrays, targets: TargetPoses) -> float:
    return float(np.linalg.norm(targets.error_twists(model.poses(targets.values))))


def _least_squares_fit(
    model: TableArrays, targets: TargetPoses, only_ends: bool
) -> tuple[TableArrays, float]:
    def errors_and_frames(model: TableArrays) -> tuple[FloatArray, FloatArray]:
        path, amounts = model.path_and_amounts(targets.values)
        frames = path.frames(amounts)
        return targets.error_twists(frames[..., -1, :, :]), frames

    def free_derivatives(model: TableArrays, frames: FloatArray) -> FloatArray:
        return tip_poses_and_derivatives(model, targets, frames)[1][:, : 12 if only_ends else None]

    return least_squares(
        model,
        errors_and_frames,
        free_derivatives,
        lambda model, free: apply_changes(model, free, targets.scale),
        max_step=_MAX_STEP * targets.scale,
        patience=_PATIENCE,
    )


def _add_large_angles(model: TableArrays) -> list[TableArrays]:
    """Return tables with large changes of two consecutive offsets.

    The changes cancel at the tip if the two axes coincide.
    """
    models = []
    for i in range(len(model.cells) - 1):
        sense = math.copysign(1.0, math.cos(float(model.cells[i, CELLS.index("alpha")])))
        for angle in _LARGE_ANGLES if model.turns[i] and model.turns[i + 1] else ():
            cells = model.cells.copy()
            cells[i, 0] += angle
            cells[i + 1, 0] -= sense * angle
            models.append(replace(model, cells=cells))
    return models
