"""Fit a reference table to the URDF: first its free parameters, then as few cells as possible.

The tip's error at each sampled configuration is a twist. A change of any number of the table also moves the
tip by a twist: a rotation about a line or a translation along one. Gauss-Newton solves for these numbers.
Base, tool and joint offsets are the free parameters; they are eliminated first and absorb as much error as
possible. The cells absorb the rest. If several cells can do so (for example offsets along parallel axes), a
reweighted least-norm solution changes as few cells as possible.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.snapping import rotation_angle
from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.path import Motion, Path
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray

#: Cells in the order of their transforms, and these transforms.
CELLS = ("theta", "d", "a", "alpha", "beta")
_ROW = (Motion(2, True), Motion(2, False), Motion(0, False), Motion(0, True), Motion(1, True))
#: Largest step: radians, and metres per metre of reach.
LONGEST_STEP = 0.5
#: Largest number of steps; smallest relative improvement; mean error that counts as zero.
_ROUNDS, _BETTER, _SOLVED = 40, 1e-9, 1e-14
#: Relative sizes below which a singular value counts as zero: for free parameters, for cells.
_FREE, _CELLS = 1e-8, 1e-9
#: Iterations of the sparse solution, and its smallest weight relative to the reach.
_SPARSER, _STAYS = 25, 1e-9
#: Tie-breaker: weight of the last cell relative to the first, so that one of two equal cells wins.
_LAST_WINS = 1.2
#: Weight of beta at first, and its factor in each iteration: beta changes only if alpha does not suffice.
_BETA, _BETA_AGAIN = 0.3, 0.5
#: Fraction of a cell's effect that free parameters may leave if they can replace it.
_HIDDEN = 1e-6


@dataclass(frozen=True, slots=True)
class Model:
    """A standard table as numbers to fit.

    Attributes:
        cells: (n, 5) theta, d, a, alpha, beta of each row.
        turns: (n,) 1 for revolute rows, 0 for prismatic ones.
        senses: (n,) +1 or -1.
        base: (4, 4) T_base_0 (metres).
        tool: (4, 4) T_n_tip (metres).
    """

    cells: FloatArray
    turns: FloatArray
    senses: FloatArray
    base: FloatArray
    tool: FloatArray

    @property
    def first(self) -> FloatArray:
        """(4, 4) pose of the first revolute joint's frame relative to `base`, with all joints at zero."""
        turning = np.flatnonzero(self.turns)
        end = len(CELLS) * int(turning[0]) if turning.size else 0
        return Path((np.eye(4), *self._motions[:end])).poses(self.cells.ravel()[:end])

    @property
    def last(self) -> FloatArray:
        """(4, 4) pose of the tip in the last revolute joint's frame, with the later joints at zero."""
        turning = np.flatnonzero(self.turns)
        begin = len(CELLS) * int(turning[-1] if turning.size else len(self.cells) - 1) + CELLS.index("a")
        return Path((*self._motions[begin:], self.tool)).poses(self.cells.ravel()[begin:])

    def own(self, i: int) -> int:
        """Return the index of the cell with the joint's variable in row i."""
        return 0 if self.turns[i] else 1

    @property
    def _motions(self) -> tuple[Motion, ...]:
        return _ROW * len(self.cells)

    def path_at(self, values: FloatArray) -> tuple[Path, FloatArray]:
        """Return the path from base to tip, and its amounts (s, 5 n) at joint values (s, n): all cells."""
        amounts = np.tile(self.cells.ravel(), (len(values), 1))
        for i in range(len(self.cells)):
            amounts[:, len(CELLS) * i + self.own(i)] += self.senses[i] * values[:, i]
        return Path((self.base, *self._motions, self.tool)), amounts

    def poses(self, values: FloatArray) -> FloatArray:
        """Return the (s, 4, 4) poses of the tip."""
        path, amounts = self.path_at(values)
        return path.poses(amounts)


@dataclass(frozen=True, slots=True)
class TargetPoses:
    """The target poses of a model's tip.

    Attributes:
        values: (s, n) the URDF's joint values.
        poses: (s, 4, 4) poses of its tip at these values.
        scale: Length that converts radians to metres.
    """

    values: FloatArray
    poses: FloatArray
    scale: float

    def apart(self, model: Model) -> tuple[float, float]:
        """Return the largest tip error of a model on the samples (metres, radians)."""
        poses = model.poses(self.values)
        metres = np.linalg.norm(poses[:, :3, 3] - self.poses[:, :3, 3], axis=-1).max()
        return float(metres), float(rotation_angle(poses[:, :3, :3], self.poses[:, :3, :3]).max())

    def errors(self, poses: FloatArray) -> FloatArray:
        """Return the (6 s,) twists from a model's poses to the targets, angles times `scale`."""
        turn = log_rotation(self.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], -1, -2))
        return np.concatenate([self.poses[:, :3, 3] - poses[:, :3, 3], self.scale * turn], axis=-1).ravel()


def columns(model: Model, wanted: TargetPoses) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the tip's poses, and the twists (6 s, parameters) of free parameters and of cells.

    The free parameters are six of the base, six of the tool, and each row's own variable. Cells are in the
    order of (n, 5). Angles are multiplied by the scale.
    """
    scale = wanted.scale
    path, amounts = model.path_at(wanted.values)
    poses, twists = path.columns(amounts)
    # Angular cells are in metres at the distance `scale`, like the angular part of a twist.
    n, turning = len(model.cells), np.tile([motion.turns for motion in _ROW], len(model.cells))
    twists = twists * np.where(turning, 1.0 / scale, 1.0)
    twists[:, 3:] *= scale
    cells = twists.reshape(-1, len(CELLS) * n)
    own = [5 * i + model.own(i) for i in range(n)]
    first = np.broadcast_to(model.base @ model.first, poses.shape)
    ends = [_end(poses, first, scale), _end(poses, poses @ np.linalg.inv(model.last), scale)]
    return poses, np.hstack([*ends, cells[:, own]]), cells


def _end(poses: FloatArray, at: FloatArray, scale: float) -> FloatArray:
    """Return the (6 s, 6) twists of translations and rotations of the chain after a frame."""
    arm = poses[:, :3, 3] - at[:, :3, 3]
    out = np.zeros((len(poses), 6, 6))
    for k in range(3):
        axis = at[:, :3, k]
        out[:, :3, k] = axis
        out[:, :3, 3 + k] = np.cross(axis, arm) / scale
        out[:, 3:, 3 + k] = axis
    return out.reshape(-1, 6)


def fit_cells(model: Model, wanted: TargetPoses, cells_of: FloatArray, *, free: bool) -> Model:
    """Fit the table to the URDF with the fewest and smallest changes of cells.

    Args:
        model: The table.
        wanted: Target poses from the URDF.
        cells_of: (n, 5) mask: 1 for cells that may change, else 0.
        free: Whether base, tool and offsets may change too.
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
        # For nearly coinciding axes, opposite offsets have almost no effect: rcond removes them.
        offsets = np.linalg.lstsq(freedoms, error - cells @ change, rcond=_FREE)[0]
        shorten = min(1.0, LONGEST_STEP * scale / max(float(np.abs(offsets).max()), NOT_ZERO))
        model = moved(model, np.asarray(offsets * shorten, np.float64), scale, change * shorten)
    return best


def _sparse(
    model: Model, start: Model, freedoms: FloatArray, cells: FloatArray, error: FloatArray, scale: float
) -> FloatArray:
    """Return the changes of cells for the error that the free parameters leave.

    The total change since `start` has as few non-zero entries as possible.
    """
    Q = _span(freedoms)
    cells_left = cells - Q @ (Q.T @ cells)
    in_metres = np.array([scale, 1.0, 1.0, scale, scale])
    so_far = ((model.cells - start.cells) * in_metres).ravel()
    # The free parameters include each row's own variable, so a cell with the same effect stays zero.
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
    """Return an orthonormal basis of the free parameters' twists; no column if there are none."""
    return np.linalg.qr(freedoms)[0] if freedoms.any() else np.zeros((len(freedoms), 0))


def hidden_cells(model: Model, wanted: TargetPoses) -> list[tuple[int, int]]:
    """Return (row, cell index) of the cells that free parameters can replace, up to 1e-6 of the effect."""
    _, freedoms, cells = columns(model, wanted)
    Q = _span(freedoms)
    left = np.linalg.norm(cells - Q @ (Q.T @ cells), axis=0)
    seen = np.flatnonzero(left <= _HIDDEN * np.linalg.norm(cells, axis=0))
    return [(int(one) // len(CELLS), int(one) % len(CELLS)) for one in seen]


def moved(model: Model, free: FloatArray, scale: float, change: FloatArray | None = None) -> Model:
    """Return the model after small changes of its free parameters and cells, all in metres."""
    per_cell = np.array([1.0 / scale, 1.0, 1.0, 1.0 / scale, 1.0 / scale])
    cells = model.cells.copy() if change is None else model.cells + change.reshape(-1, 5) * per_cell
    for i, own in enumerate(free[12:]):
        k = model.own(i)
        cells[i, k] += own * per_cell[k]
    # Base and tool move in the axes of the revolute joints next to them. A rotation that they share with
    # such a joint is then exact, not only to first order.
    base = _apply_twist(model.base @ model.first, free[:6], scale) @ np.linalg.inv(model.first)
    tool = np.linalg.inv(model.last) @ _apply_twist(np.eye(4), free[6:12], scale) @ model.last
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(model.tool @ tool))


def _apply_twist(T: FloatArray, twist: FloatArray, scale: float) -> FloatArray:
    """Return T after a small translation and rotation in its own axes."""
    return T @ pose(exp_rotation(twist[3:] / scale), twist[:3])
