"""Identify and fit the parameters of a model from measured poses.

**Identifiability.** A change of parameters cannot be identified if it has no effect on the measurements. Such
a change is in the null space of the stacked Jacobian. The rank of this Jacobian is the number of identifiable
parameters. For each singular value, `urdfkin.verify.singular_values` computes a lower bound. The bound takes
rounding errors into account (Weyl's inequality). The rank is the number of singular values with a positive
lower bound. You do not have to choose a tolerance.

The frame of a revolute joint can be shifted along the joint's axis and rotated about it, if the next frame
compensates this change. The frame of a prismatic joint can be shifted anywhere and rotated about the joint's
direction. Therefore, 4 of the 6 parameters of each revolute joint are identifiable. For each prismatic joint,
2 of the 6 parameters are identifiable. All 6 parameters of the tip are identifiable (Everett, Driels and
Mooring, 1987). If only positions are measured, 3 fewer parameters are identifiable, because the tool's
orientation is unknown.

The parameters that are not fitted are fixed. Orthogonal elimination chooses the fixed parameters joint by
joint, from base to tip. Each parameter has a column in the Jacobian. In each step, the elimination subtracts
from every other column its projection onto the kept columns. The length of the remainder measures how
independent the column is. A column is a candidate if its remainder is at least half as long as the longest
remainder. The elimination keeps the first candidate in the model's order of preference. As a result, no
fitted parameter becomes large to compensate for a fixed parameter. Without this choice, four parameters of
nearly parallel axes would become hundreds of metres long and cancel each other.

**Fit.** Damped Gauss-Newton (`urdfkin.kinematics.least_squares`) minimizes the errors of the tip's poses.
Each error is divided by the standard deviation of its noise. At the minimum, let J be the weighted Jacobian
and r the weighted residuals. The covariance of the parameters is

    C = (J^T J)^-1.

The hat matrix is H = J C J^T. The redundancy of measurement i is 1 - H_ii.

Noise that you do not state is estimated from the residuals, separately for positions and rotations. The
variance of the positions is estimated as a quotient. The numerator is the sum of the squared position
residuals. The denominator is the sum of the redundancies 1 - H_ii of the measured position coordinates. The
variance of the rotations is computed in the same way. This estimate is repeated until it is constant
(Foerstner's variance components).

A pose is an **outlier** if r_i^T (1 - H_ii)^-1 r_i is too large. For a correct pose this number is chi^2
distributed, with 3 degrees of freedom for a position and 6 for a full pose. The limit is chosen so that only
one of a hundred data sets without outliers exceeds it. One outlier can hide another. Therefore each step
removes only the largest outlier and fits the other poses again. The steps end when no outlier is left.

**Start values.** Base and tool are computed from the poses before the fit. With the robot's poses T_i, the
measured poses M_i, the base B and the tool X, M_i = B T_i X. The equations R_B^T R_Mi = R_i R_X are linear in
the two unknown rotations. Together these rotations form the null vector of the equations (Shah, 2013). The
measured positions p_Mi = R_B (R_i x + p_i) + b are linear in the unknown translations x and b. If only
positions are measured, the base and the position of the target on the tip are unknown. With a known target,
the equations for the base are linear. With a known base, the equations for the target are linear. The module
therefore computes base and target alternately.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from urdfkin.calibration.parameters import CalibrationModel
from urdfkin.errors import InputError
from urdfkin.kinematics.least_squares import least_squares
from urdfkin.kinematics.rotation import euler_of, log_rotation
from urdfkin.kinematics.roundings import NOT_ZERO
from urdfkin.model.tree import FloatArray
from urdfkin.verify.singular_values import singular_values

#: The elimination may keep a column if its remainder is at least this fraction of the longest remainder.
_AS_GOOD = 0.5
#: If a parameter is fixed, a message names fitted parameters that together have the same effect.
#: It names at most `_NAMED` of them, each with more than the fraction `_SHARE` of the fixed one's effect.
_NAMED, _SHARE = 3, 1e-6


@dataclass(frozen=True)
class Identification:
    """The parameters that the measurements identify, and the parameters that stay fixed.

    Attributes:
        kept: Indices of the fitted parameters. The effects of these parameters are linearly independent.
        still: Indices of the fixed parameters, each with the reason.
        numbers: Total number of measured coordinates; a position has 3 coordinates, and a full pose has 6.
    """

    kept: tuple[int, ...]
    still: dict[int, str]
    numbers: int

    @property
    def rank(self) -> int:
        """The number of identifiable parameters."""
        return len(self.kept)


def stacked(
    model: CalibrationModel, values: FloatArray, *, complete: bool, at: FloatArray | None = None
) -> FloatArray:
    """Return the Jacobian (rows, p) of all measured coordinates, in metres.

    The rows for rotations are multiplied by the length `way.size`, and are then in metres too. The arguments
    are those of `identify`.
    """
    L = model.way.size
    _, columns = model.way.columns(values, at)
    columns[:, 3:] *= L
    lengths = np.array([1.0 if parameter.unit == "m" else 1.0 / L for parameter in model.way.parameters])
    seen = columns[:, : 6 if complete else 3] * lengths
    return seen.reshape(-1, len(lengths)) if len(lengths) else np.empty((seen.size, 0))


def identify(
    model: CalibrationModel, values: FloatArray, *, complete: bool = True, at: FloatArray | None = None
) -> Identification:
    """Determine which parameters of a model are identifiable from the joint values (s, n).

    `complete` is True for measured full poses, False for positions. The Jacobian is computed at the
    parameters `at` (p,), by default the model's start values.
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


def _reason(model: CalibrationModel, J: FloatArray, error: FloatArray, kept: Sequence[int], k: int) -> str:
    column = J[:, k]
    if np.linalg.norm(column) <= np.linalg.norm(error[:, k]):
        return "no effect on the measured numbers"
    shares = np.linalg.lstsq(J[:, list(kept)], column, rcond=None)[0] * np.linalg.norm(
        J[:, list(kept)], axis=0
    )
    shares = np.abs(shares) / np.linalg.norm(column)
    order = [i for i in np.argsort(-shares, kind="stable") if shares[i] > _SHARE]
    names = first_names((str(model.way.parameters[kept[i]]) for i in order), _NAMED)
    return f"same effect as {names}{' together' if len(order) > 1 else ''}"


def first_names(names: Iterable[str], most: int) -> str:
    """Return the first `most` names for a message, and the number of the others."""
    every = list(names)
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")


#: A fit cannot be checked if the sum of all redundancies is below this number.
_ONE_OR_MORE = 0.5
#: An eigenvalue of 1 - H_ii below this fraction of the largest eigenvalue is replaced by zero.
#: The residuals do not show an error of the pose along the eigenvector of such an eigenvalue.
_FOLLOWED = 1e-9
#: At most `_ESTIMATES` noises are estimated; a relative change of at most `_STAYS` ends the estimation.
_ESTIMATES, _STAYS = 20, 1e-3
#: An outlier is reported with this probability for a data set that has no outliers.
WRONGLY = 0.01
#: A parameter that changed by less than this number of standard deviations is not written.
SIGMAS = 2.0
#: At most this share of all poses may be outliers.
_MOST_ODD = 0.25


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured poses or positions.

    Attributes:
        values: (s, n) joint values of the path, rad or m.
        p: (s, 3) positions in the base, m.
        R: (s, 3, 3) orientations in the base; None if only positions were measured.
    """

    values: FloatArray
    p: FloatArray
    R: FloatArray | None = None

    @property
    def complete(self) -> bool:
        return self.R is not None

    def __len__(self) -> int:
        return len(self.p)

    def some(self, which: NDArray[np.bool_]) -> Measured:
        return Measured(self.values[which], self.p[which], None if self.R is None else self.R[which])


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations: of each position coordinate (m), and of the rotation about each axis (rad)."""

    metres: float
    radians: float

    def of(self, complete: bool) -> FloatArray:
        """Return the standard deviations of one pose, (6,), or of one position, (3,)."""
        return np.array([self.metres] * 3 + ([self.radians] * 3 if complete else []))


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of a fit.

    Attributes:
        at: (p,) values of all parameters.
        errors: (s, 6) or (s, 3) residuals: measured minus computed, in the base, m and rad.
        noise: The standard deviations by which the residuals are divided.
        covariance: (k, k) covariance of the fitted parameters, in the units of the parameters. The covariance
            is infinite if the redundancy is 0.
        left: (s, 6) or (s, 3) array with the redundancy of each measured coordinate, which is 1 - H_ii.
        odd: (s,) chi^2 statistic of each pose.
    """

    at: FloatArray
    errors: FloatArray
    noise: Noise
    covariance: FloatArray
    left: FloatArray
    odd: FloatArray

    @property
    def freedom(self) -> float:
        """The total redundancy: the number of measured coordinates minus the number of fitted parameters."""
        return float(self.left.sum())

    @property
    def is_judged(self) -> bool:
        """Whether the redundancy is positive, so that the fit can be checked."""
        return self.freedom >= _ONE_OR_MORE

    @property
    def ratio(self) -> float:
        """The ratio of the noise in the residuals to the stated noise.

        If the stated noise is correct, the ratio is about 1, with the standard deviation 1/sqrt(2 `freedom`).
        """
        if not self.is_judged:
            return math.nan
        whitened = self.errors / self.noise.of(self.errors.shape[1] == 6)
        return math.sqrt(float((whitened**2).sum()) / self.freedom)

    @property
    def spread(self) -> float:
        """The standard deviation of `ratio`."""
        return 1.0 / math.sqrt(2.0 * max(self.freedom, _ONE_OR_MORE))

    def rms(self) -> tuple[float, float | None]:
        """Return the root mean square of the position errors (m) and of the orientation errors (rad)."""
        position, turn = (np.sqrt((x**2).sum(axis=1).mean()) for x in np.hsplit(self.errors, [3]))
        return float(position), float(turn) if self.errors.shape[1] == 6 else None


def errors(model: CalibrationModel, measured: Measured, at: FloatArray) -> FloatArray:
    """Return the residuals, measured minus computed: (s, 6) for poses or (s, 3) for positions.

    Each row contains the position error (m) and, for full poses, the rotation error (rad), along the axes of
    the base frame.
    """
    return _apart(measured, model.way.poses(measured.values, at))


def _apart(measured: Measured, T: FloatArray) -> FloatArray:
    away = measured.p - T[:, :3, 3]
    if measured.R is None:
        return away
    return np.hstack([away, log_rotation(measured.R @ T[:, :3, :3].swapaxes(-1, -2))])


def best_fit(
    model: CalibrationModel, measured: Measured, kept: Sequence[int], noise: Noise | None, at: FloatArray
) -> Fit:
    """Fit the parameters `kept` to measurements by least squares, from the start values `at` (p,).

    If `noise` is None, the noise is estimated from the residuals.
    """
    weights = noise or Noise(1.0, 1.0 / model.way.size)
    for _ in range(1 if noise else _ESTIMATES):
        at = _minimize(model, measured, kept, weights, at)
        found = _evaluate(model, measured, kept, weights, at)
        if noise or not found.is_judged:
            break
        estimated = _estimate_noise(found, model, measured)
        stays = abs(estimated.metres - weights.metres) <= _STAYS * weights.metres and (
            not measured.complete or abs(estimated.radians - weights.radians) <= _STAYS * weights.radians
        )
        weights = estimated
        if stays:
            break
    found = _evaluate(model, measured, kept, weights, at)
    if noise is None and not found.is_judged:
        found = replace(found, covariance=np.full_like(found.covariance, np.inf))
    return found


def _estimate_noise(found: Fit, model: CalibrationModel, measured: Measured) -> Noise:
    """Estimate the noise from the residuals; it is never below rounding error, because it is a divisor."""
    rounding = model.way.rounding(measured.values)

    def of(part: slice, least: float, former: float) -> float:
        left = float(found.left[:, part].sum())
        size = float((found.errors[:, part] ** 2).sum())
        return max(math.sqrt(size / left), least) if left > _ONE_OR_MORE else former

    return Noise(
        of(slice(0, 3), rounding, found.noise.metres),
        of(slice(3, 6), rounding / model.way.size, found.noise.radians),
    )


def _whitened(
    model: CalibrationModel, measured: Measured, noise: Noise, at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the residuals (rows,) divided by the noise, and the poses along the path."""
    frames = model.way.frames(measured.values, at)
    return (_apart(measured, frames[:, -1]) / noise.of(measured.complete)).ravel(), frames


def _whitened_columns(
    model: CalibrationModel,
    measured: Measured,
    kept: Sequence[int],
    noise: Noise,
    at: FloatArray,
    frames: FloatArray,
) -> FloatArray:
    """Return the Jacobian (rows, k) of the fitted parameters, divided by the noise."""
    scale = noise.of(measured.complete)
    _, columns = model.way.columns(measured.values, at, frames)
    J = columns[:, : len(scale), list(kept)] / scale[:, np.newaxis]
    return J.reshape(len(measured) * len(scale), len(kept))


def _minimize(
    model: CalibrationModel, measured: Measured, kept: Sequence[int], noise: Noise, at: FloatArray
) -> FloatArray:
    def moved(at: FloatArray, step: FloatArray) -> FloatArray:
        trial = at.copy()
        trial[list(kept)] += step
        return trial

    return least_squares(
        at,
        lambda at: _whitened(model, measured, noise, at),
        lambda at, frames: _whitened_columns(model, measured, kept, noise, at, frames),
        moved,
    )[0]


def _evaluate(
    model: CalibrationModel, measured: Measured, kept: Sequence[int], noise: Noise, at: FloatArray
) -> Fit:
    r, frames = _whitened(model, measured, noise, at)
    J = _whitened_columns(model, measured, kept, noise, at, frames)
    k = noise.of(measured.complete).size
    units = np.linalg.norm(J, axis=0)
    units[units == 0.0] = 1.0
    Q, R = np.linalg.qr(J / units)
    half = np.linalg.solve(R, np.eye(len(R))) / units[:, np.newaxis]
    blocks = Q.reshape(len(measured), k, len(kept))
    judged = np.eye(k) - blocks @ blocks.swapaxes(-1, -2)
    own = r.reshape(-1, k)
    odd = np.einsum("si,sij,sj->s", own, np.linalg.pinv(judged, rcond=_FOLLOWED, hermitian=True), own)
    left = np.clip(np.einsum("sii->si", judged), 0.0, 1.0)
    return Fit(at, _apart(measured, frames[:, -1]), noise, half @ half.T, left, odd)


def odd_poses(
    model: CalibrationModel, measured: Measured, kept: Sequence[int], noise: Noise | None, found: Fit
) -> tuple[tuple[int, ...], Fit]:
    out = list[int]()
    # Without the outliers, there must still be more measured numbers than parameters.
    # At most a quarter of the poses may be outliers.
    most = min(int(_MOST_ODD * len(measured)), len(measured) - 1 - -(-len(kept) // found.errors.shape[1]))
    clean = found
    while len(out) < most:
        inside = np.setdiff1d(np.arange(len(measured)), out)
        worst = int(np.argmax(clean.odd))
        if clean.odd[worst] <= quantile(1.0 - WRONGLY / len(measured), clean.errors.shape[1]):
            break
        out.append(int(inside[worst]))
        chosen = np.ones(len(measured), dtype=bool)
        chosen[out] = False
        clean = best_fit(model, measured.some(chosen), kept, noise, clean.at)
    return tuple(sorted(out)), clean


def significant(moved: FloatArray, covariance: FloatArray, fixed: Sequence[bool]) -> NDArray[np.bool_]:
    """Select the parameters that changed by more than `SIGMAS` standard deviations, by backward elimination.

    Each step resets the least significant parameter to its old value. It also adjusts the other parameters by
    their covariance with the reset parameter. The elimination ends when all remaining parameters are
    significant. If the measurements determine only a combination of two parameters, one of these two
    parameters remains selected. A `fixed` parameter is always selected. Unknown entries of the covariance are
    inf.

    >>> significant(np.array([3.0, 1.0]), np.eye(2), [False, False]).tolist()
    [True, False]
    """
    stays, free = np.ones(len(moved), dtype=bool), ~np.array(fixed, dtype=bool)
    if not np.isfinite(covariance).all():
        return ~free
    x, C = moved.copy(), covariance.copy()
    while (rest := np.flatnonzero(stays & free)).size:
        # Rounding may make a small variance 0 or negative, because C contains differences of larger numbers.
        # A parameter with such a small variance is known very precisely, so its change is significant.
        sizes = np.abs(x[rest]) / np.sqrt(np.maximum(C[rest, rest], NOT_ZERO))
        k = rest[int(np.argmin(sizes))]
        if sizes.min() > SIGMAS:
            break
        column, variance = C[:, k].copy(), C[k, k]
        x -= column * (x[k] / variance)
        C -= np.outer(column, column) / variance
        stays[k] = False
    return stays


def quantile(share: float, freedom: int) -> float:
    """Return the quantile of the chi^2 distribution, by the approximation of Wilson and Hilferty (1931).

    The relative error is a few per cent, even for probabilities close to 1.
    """
    step = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - step + NormalDist().inv_cdf(share) * math.sqrt(step)) ** 3


#: At most `_TURNS` repetitions compute base and target alternately.
#: They end when the position of the target changes by at most the fraction `_FIXED_END`.
_TURNS, _FIXED_END = 200, 1e-9
#: Measured positions may spread at most this number of times more than the robot's tip positions.
#: With positions in millimetres by mistake, this ratio is about 1000.
_FARTHER = 100.0


def starting(model: CalibrationModel, measured: Measured) -> FloatArray:
    """Return start values (p,): base and tool from the measured poses, other parameters from the model."""
    at = model.way.start.copy()
    places = {parameter.where for parameter in model.way.parameters if parameter.end}
    if not places:
        return at
    T = model.way.poses(measured.values)
    free = "base" in places, "tool" in places
    B, X = (
        _from_poses(T, measured.p, measured.R, *free)
        if measured.R is not None
        else _from_positions(T, measured.p, *free)
    )
    for which, end in (("base", B), ("tool", X)):
        six = [*end[:3, 3], *euler_of("XYZ", end[:3, :3])]
        for k, parameter in enumerate(model.way.parameters):
            if parameter.end and parameter.where == which:
                at[k] = six[("x", "y", "z", "rx", "ry", "rz").index(parameter.what)]
    return at


def _from_poses(
    T: FloatArray, p: FloatArray, R: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    B, X = np.eye(4), np.eye(4)
    if base and tool:
        B[:3, :3], X[:3, :3] = _rotations(T[:, :3, :3], R)
    elif base:
        B[:3, :3] = _rotation(np.einsum("sij,skj->ik", R, T[:, :3, :3]))
    else:
        X[:3, :3] = _rotation(np.einsum("sji,sjk->ik", T[:, :3, :3], R))
    B[:3, 3], X[:3, 3] = _translations(T, p, B[:3, :3], base, tool)
    return B, X


def _from_positions(T: FloatArray, p: FloatArray, base: bool, tool: bool) -> tuple[FloatArray, FloatArray]:
    """Compute the base, and the position of the measured target on the tip, from measured positions."""
    B, X = np.eye(4), np.eye(4)
    for _ in range(_TURNS if base and tool else 1):
        if base:
            points = T[:, :3, :3] @ X[:3, 3] + T[:, :3, 3]
            B[:3, :3] = _rotation((p - p.mean(axis=0)).T @ (points - points.mean(axis=0)))
        before = X[:3, 3].copy()
        B[:3, 3], X[:3, 3] = _translations(T, p, B[:3, :3], base, tool)
        if np.linalg.norm(X[:3, 3] - before) <= _FIXED_END * np.linalg.norm(X[:3, 3]):
            break
    return B, X


def _rotations(R: FloatArray, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve R_B^T M_i = R_i R_X for R_B and R_X, written as M_i^T R_B - R_X^T R_i^T = 0."""
    unit = np.eye(3)
    left = np.einsum("sab,cd->sacbd", M.swapaxes(-1, -2), unit).reshape(-1, 9)
    right = np.einsum("ab,scd->sacbd", unit, R).reshape(-1, 9)
    null = np.linalg.svd(np.hstack([left, -right]), full_matrices=False)[2][-1]
    B, X_back = null[:9].reshape(3, 3), null[9:].reshape(3, 3)
    sign = np.sign(np.linalg.det(B)) or 1.0
    return _rotation(sign * B), _rotation(sign * X_back).T


def _rotation(M: FloatArray) -> FloatArray:
    """Return the rotation nearest to a matrix."""
    U, _, Vt = np.linalg.svd(M)
    if np.linalg.det(U @ Vt) < 0.0:
        U[:, 2] *= -1.0
    return np.asarray(U @ Vt)


def _translations(
    T: FloatArray, p: FloatArray, R_B: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    """Solve p_Mi = R_B R_i x + R_B p_i + b for the vectors b and x."""
    rest = (p - T[:, :3, 3] @ R_B.T).ravel()
    parts = []
    if base:
        parts.append(np.tile(np.eye(3), (len(p), 1)))
    if tool:
        parts.append((R_B @ T[:, :3, :3]).reshape(-1, 3))
    found = np.asarray(np.linalg.lstsq(np.hstack(parts), rest, rcond=None)[0], np.float64)
    nothing = np.zeros(3)
    return found[:3] if base else nothing, found[-3:] if tool else nothing


def demand_plausible(model: CalibrationModel, measured: Measured) -> None:
    """Raise InputError if measured positions spread 100 times more than the tip: they are not in metres."""
    T = model.way.poses(measured.values)
    ours, theirs = (
        float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) for x in (T[:, :3, 3], measured.p)
    )
    if ours > 0.0 and theirs > _FARTHER * ours:
        raise InputError(
            "the measured positions are much farther apart than the positions of the robot's tip",
            found=f"{theirs:.4g} m, where the robot's tip moves {ours:.4g} m",
            remedy="if the positions are in millimetres, add --unit mm (in Python, multiply them by 0.001)",
        )
