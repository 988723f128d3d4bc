"""How a reference table must change to be the URDF: the freedoms first, then as few cells as possible.

The tip's error is a twist at each of some sampled configurations, and every number of a table moves the tip
by a twist: a turn about a line or a shift along one. Gauss-Newton solves for the numbers. Base, tool and
joint offsets (the freedoms) are eliminated first and take all they can; what is left falls to the cells, and
where several cells could take it (the offsets along parallel axes, say), a reweighted least-norm solution
puts it into as few as possible.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import along_axis, between_axes
from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray

#: Cells in the order in which they act: theta, d, a, alpha, beta.
CELLS = ("theta", "d", "a", "alpha", "beta")
#: Radians, and metres for each metre of reach, that one step goes at most.
LONGEST_STEP = 0.5
#: Steps at most; by which share one must be better, and by how much all are off when nothing is left.
_ROUNDS, _BETTER, _SOLVED = 40, 1e-9, 1e-14
#: Of the largest singular value: below it freedoms undo each other, and cells what other cells do.
_FREE, _CELLS = 1e-8, 1e-9
#: Rounds in which cells are made few, and how small (of the reach) one stays within reach of the next.
_SPARSER, _STAYS = 25, 1e-9
#: How much more willingly the last cell changes than the first, of two equally good ones: one is to win.
_LAST_WINS = 1.2
#: How willingly beta changes at first, and again in each round: only where alpha will not do.
_BETA, _BETA_AGAIN = 0.3, 0.5
#: Of a cell's effect: what freedoms that stand in for it may leave.
_HIDDEN = 1e-6


@dataclass(frozen=True, slots=True)
class Model:
    """A standard table as numbers to be fitted.

    Attributes:
        cells: (n, 5) theta, d, a, alpha, beta of each row.
        turns: (n,) which rows turn.
        senses: (n,) +1 or -1.
        base: (4, 4) and
        tool: (4, 4): the ends.
    """

    cells: FloatArray
    turns: FloatArray
    senses: FloatArray
    base: FloatArray
    tool: FloatArray

    @property
    def first(self) -> FloatArray:
        """(4, 4) pose in the base of the frame about whose z the first turning joint turns, others at 0."""
        turning = np.flatnonzero(self.turns)
        return self._rows(0, int(turning[0]) if turning.size else 0)

    @property
    def last(self) -> FloatArray:
        """(4, 4) pose of the tip in the frame about whose z the last turning joint turned, others at 0."""
        turning, n = np.flatnonzero(self.turns), len(self.cells)
        k = int(turning[-1]) if turning.size else n - 1
        _, _, a, alpha, beta = self.cells[k]
        step = between_axes(a, alpha) @ between_axes(0.0, 0.0, beta)
        return np.asarray(step @ self._rows(k + 1, n) @ self.tool)

    def own(self, i: int) -> int:
        """Which cell of row i the joint's variable is added to."""
        return 0 if self.turns[i] else 1

    def _rows(self, begin: int, end: int) -> FloatArray:
        T = np.eye(4)
        for theta, d, a, alpha, beta in self.cells[begin:end]:
            T = T @ along_axis(theta, d) @ between_axes(a, alpha) @ between_axes(0.0, 0.0, beta)
        return T

    def poses(self, values: FloatArray) -> FloatArray:
        """(s, 4, 4) poses of the tip."""
        thetas, ds, *between = self.cells.T
        moved = self.senses * values
        joints = along_axis(thetas + self.turns * moved, ds + (1.0 - self.turns) * moved)
        T: FloatArray = np.broadcast_to(self.base, (len(values), 4, 4))
        for i, step in enumerate(map(between_axes, *between)):
            T = T @ (joints[:, i] @ step)
        return T @ self.tool

    def walk(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Tip poses (s, 4, 4), then the lines and kinds of motion of every cell.

        Returns:
            poses; origins and axes (s, n, 5, 3) on and along which each cell acts.
        """
        samples, n = len(values), len(self.cells)
        origins, axes = np.empty((2, samples, n, 5, 3))
        T: FloatArray = np.broadcast_to(self.base, (samples, 4, 4))
        for i, (theta, d, a, alpha, beta) in enumerate(self.cells):
            moved = self.senses[i] * values[:, i]
            axes[:, i, :2] = T[:, None, :3, 2]
            origins[:, i, :2] = T[:, None, :3, 3]
            T = T @ along_axis(theta + self.turns[i] * moved, d + (1.0 - self.turns[i]) * moved)
            axes[:, i, 2:4] = T[:, None, :3, 0]
            T = T @ between_axes(a, alpha)
            axes[:, i, 4] = T[:, :3, 1]
            T = T @ between_axes(0.0, 0.0, beta)
            origins[:, i, 2:] = T[:, None, :3, 3]
        return T @ self.tool, origins, axes


@dataclass(frozen=True, slots=True)
class TargetPoses:
    """Where a model's tip is to come.

    Attributes:
        values: (s, n) the URDF's joint values.
        poses: (s, 4, 4) its tip there.
        scale: Metres that a radian counts as much as.
    """

    values: FloatArray
    poses: FloatArray
    scale: float

    def apart(self, model: Model) -> tuple[float, float]:
        """Metres and radians that a model's tip is off at the worst sample."""
        poses = model.poses(self.values)
        metres = np.linalg.norm(poses[:, :3, 3] - self.poses[:, :3, 3], axis=-1).max()
        return float(metres), float(rotation_angle(poses[:, :3, :3], self.poses[:, :3, :3]).max())

    def errors(self, poses: FloatArray) -> FloatArray:
        """(6 s,) twists that would bring a model's poses to these, angles times `scale`."""
        turn = log_rotation(self.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], -1, -2))
        return np.concatenate([self.poses[:, :3, 3] - poses[:, :3, 3], self.scale * turn], axis=-1).ravel()


def columns(model: Model, wanted: TargetPoses) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tip poses and the twists (6 s, parameters) of freedoms and of cells, angles times the scale.

    Freedoms are the base's six, the tool's six and each row's own variable; cells are (n, 5) in order.
    """
    scale = wanted.scale
    poses, origins, axes = model.walk(wanted.values)
    tip = poses[:, None, None, :3, 3]
    turning = np.array([True, False, False, True, True])
    linear = np.where(turning[:, None], np.cross(axes, tip - origins), axes)
    angular = np.where(turning[:, None], axes, 0.0)
    # Cells that are angles are counted in metres at the distance `scale`, like the twist's angular part.
    per_cell = np.where(turning, 1.0 / scale, 1.0)[:, None]
    cells = np.concatenate([linear * per_cell, scale * angular * per_cell], axis=-1)
    n = len(model.cells)
    cells = np.moveaxis(cells.reshape(len(poses), 5 * n, 6), 1, 2).reshape(-1, 5 * n)
    own = [5 * i + model.own(i) for i in range(n)]
    first = np.broadcast_to(model.base @ model.first, poses.shape)
    ends = [_end(poses, first, scale), _end(poses, poses @ np.linalg.inv(model.last), scale)]
    return poses, np.hstack([*ends, cells[:, own]]), cells


def _end(poses: FloatArray, at: FloatArray, scale: float) -> FloatArray:
    """(6 s, 6) twists of shifting and turning everything from a frame on."""
    arm = poses[:, :3, 3] - at[:, :3, 3]
    out = np.zeros((len(poses), 6, 6))
    for k in range(3):
        axis = at[:, :3, k]
        out[:, :3, k] = axis
        out[:, :3, 3 + k] = np.cross(axis, arm) / scale
        out[:, 3:, 3 + k] = axis
    return out.reshape(-1, 6)


def fit_cells(model: Model, wanted: TargetPoses, cells_of: FloatArray, *, free: bool) -> Model:
    """The smallest and fewest changes of cells with which the table is the URDF.

    Args:
        model: The table.
        wanted: What the URDF's tip does.
        cells_of: (n, 5) which cells may change: 1 or 0.
        free: Whether base, tool and offsets may, too.
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
        # Axes that nearly coincide let two offsets grow against each other for nothing: cut those off.
        given = np.linalg.lstsq(freedoms, error - cells @ change, rcond=_FREE)[0]
        shorten = min(1.0, LONGEST_STEP * scale / max(float(np.abs(given).max()), NOT_ZERO))
        model = moved(model, np.asarray(given * shorten, np.float64), scale, change * shorten)
    return best


def _sparse(
    model: Model, start: Model, freedoms: FloatArray, cells: FloatArray, error: FloatArray, scale: float
) -> FloatArray:
    """Changes of cells that take what the freedoms cannot, the sum with those so far having few entries."""
    Q = _span(freedoms)
    cells_left = cells - Q @ (Q.T @ cells)
    in_metres = np.array([scale, 1.0, 1.0, scale, scale])
    so_far = ((model.cells - start.cells) * in_metres).ravel()
    # The freedoms took each row's own variable; a cell that moves nothing else is not asked for anything.
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
    """An orthonormal basis of what the freedoms can do; no column where there are none."""
    return np.linalg.qr(freedoms)[0] if freedoms.any() else np.zeros((len(freedoms), 0))


def hidden_cells(model: Model, wanted: TargetPoses) -> list[tuple[int, int]]:
    """(row, number of the cell) for which the freedoms can stand in, to a share of the cell's effect."""
    _, freedoms, cells = columns(model, wanted)
    Q = _span(freedoms)
    left = np.linalg.norm(cells - Q @ (Q.T @ cells), axis=0)
    seen = np.flatnonzero(left <= _HIDDEN * np.linalg.norm(cells, axis=0))
    return [(int(one) // len(CELLS), int(one) % len(CELLS)) for one in seen]


def moved(model: Model, free: FloatArray, scale: float, change: FloatArray | None = None) -> Model:
    """The model after small changes of its freedoms and cells, all counted in metres."""
    per_cell = np.array([1.0 / scale, 1.0, 1.0, 1.0 / scale, 1.0 / scale])
    cells = model.cells.copy() if change is None else model.cells + change.reshape(-1, 5) * per_cell
    for i, own in enumerate(free[12:]):
        k = model.own(i)
        cells[i, k] += own * per_cell[k]
    # Base and tool are pushed in the axes about which the joints next to them turn: a turn that they share
    # with these joints goes round in a circle then, and not off at a tangent.
    base = _pushed(model.base @ model.first, free[:6], scale) @ np.linalg.inv(model.first)
    tool = np.linalg.inv(model.last) @ _pushed(np.eye(4), free[6:12], scale) @ model.last
    return replace(model, cells=cells, base=np.asarray(base), tool=np.asarray(model.tool @ tool))


def _pushed(T: FloatArray, twist: FloatArray, scale: float) -> FloatArray:
    """T followed by a small shift and turn in its own axes."""
    return T @ pose(exp_rotation(twist[3:] / scale), twist[:3])
