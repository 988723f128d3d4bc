"""Identify and fit the parameters of a model from measured poses.

**Identifiability.** A change of parameters without effect on the measurements cannot be identified. The null
space of the stacked Jacobian contains all changes without effect. The rank of this Jacobian is the number of
identifiable parameters. `urdfkin.verify.singular_values` computes a lower bound for each singular value. The
bound takes rounding errors into account (Weyl's inequality). The rank is the number of singular values with
a positive lower bound, so no tolerance is needed.

Some changes of a joint's frame can be compensated by an opposite change of the next frame (Everett, Driels
and Mooring, 1987):

| Joint | Compensated changes | Identifiable parameters |
|---|---|---|
| revolute | shift along the axis, rotation about the axis | 4 of 6 |
| prismatic | any shift, rotation about the joint's direction | 2 of 6 |
| tip | none | 6 of 6 |
| tip, only positions measured | orientation of the tool | 3 of 6 |

Orthogonal elimination chooses the fitted parameters of the base, then of the tool, then of each joint from
base to tip. A fixed joint comes last. Each parameter has a column in the Jacobian.

    remainder of a column: the column minus its projection onto the chosen columns
    length of the remainder: independence from the chosen columns
    candidate: a column with a remainder that is at least half as long as the longest remainder
    next chosen column: the first candidate in the model's order of preference

Columns with shorter remainders are excluded, because fitted parameters with nearly dependent columns can
become very large. For example, four fitted lengths along nearly parallel axes could be hundreds of metres,
and cancel each other.

**Fit.** Damped Gauss-Newton (`urdfkin.kinematics.least_squares`) minimizes the errors of the tip's poses.
Each error is divided by the standard deviation of its noise. At the minimum:

    J                   weighted Jacobian
    r                   weighted residuals
    C = (J^T J)^-1      covariance of the parameters
    H = J C J^T         hat matrix
    1 - H_ii            redundancy of measurement i

If you do not state the noise, the noise is estimated from the residuals. The estimation is repeated until
the estimates are constant (Foerstner's variance components).

    variance of the positions = sum of their squared residuals / sum of their redundancies
    variance of the rotations = sum of their squared residuals / sum of their redundancies

A pose is an **outlier** if its statistic is too large:

    statistic                 r_i^T (1 - H_ii)^-1 r_i
    without outliers          chi^2 distribution
    degrees of freedom        3 for a position, 6 for a full pose
    limit                     without outliers, some statistic exceeds it with a probability of about 1 %

One outlier can hide another, so each step removes only the largest outlier and fits the other poses again.
The steps end when no outlier is left, or at the maximum number of outliers.

**Start values.** Before the fit, start values of base and tool are computed from the measured poses.

    T_i, R_i, p_i       robot's poses, with rotations and positions
    M_i, R_Mi, p_Mi     measured poses
    B, R_B, b           base
    X, R_X, x           tool

    M_i = B T_i X
    R_B^T R_Mi = R_i R_X              linear in R_B and R_X; their entries form the null vector (Shah, 2013)
    p_Mi = R_B (R_i x + p_i) + b      linear in x and b

If only positions are measured, and both base and tool are fitted, the module repeats two steps. The first
step solves for R_B with the last value of x. The second step solves for x and b with this R_B; the equations
are linear. At the beginning, x is 0. If the error stays large, the module starts again with other rotations
R_B.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from urdfkin.calibration.parameters import CalibrationModel
from urdfkin.comparison.result import angle, length
from urdfkin.errors import InputError
from urdfkin.kinematics.least_squares import least_squares
from urdfkin.kinematics.rotation import euler_of, log_rotation
from urdfkin.kinematics.roundings import MIN_DIVISOR
from urdfkin.model.tree import FloatArray
from urdfkin.verify.singular_values import singular_values

#: The remainder of a candidate has at least this fraction of the length of the longest remainder.
_PIVOT_FRACTION = 0.5
#: Maximum number of parameter names in the text "same effect as ...".
_MAX_NAMES = 3
#: The text "same effect as ..." names only parameters with more than this fraction of the fixed parameter's
#: effect.
_MIN_EFFECT_FRACTION = 1e-6


@dataclass(frozen=True)
class Identification:
    """The parameters that can be fitted, and the parameters that stay fixed.

    Attributes:
        free_parameters: Indices of the fitted parameters, which have linearly independent effects.
        fixed_parameters: Indices of the fixed parameters, each with the reason.
        measured_numbers: Number of measured coordinates: 3 per position, or 6 per full pose.
    """

    free_parameters: tuple[int, ...]
    fixed_parameters: dict[int, str]
    measured_numbers: int

    @property
    def rank(self) -> int:
        return len(self.free_parameters)


def stack_jacobian(
    model: CalibrationModel,
    joint_values: FloatArray,
    *,
    full_poses: bool,
    parameter_values: FloatArray | None = None,
) -> FloatArray:
    """Return the dimensionless Jacobian (rows, p) of all measurements.

    Angles and gains are multiplied by `chain.characteristic_length`.
    """
    L = model.chain.characteristic_length
    _, columns = model.chain.poses_and_jacobian(joint_values, parameter_values)
    columns[:, 3:] *= L
    lengths = np.array([1.0 if parameter.unit == "m" else 1.0 / L for parameter in model.chain.parameters])
    J = columns[:, : 6 if full_poses else 3] * lengths
    return J.reshape(-1, len(lengths)) if len(lengths) else np.empty((J.size, 0))


def identify(
    model: CalibrationModel,
    joint_values: FloatArray,
    *,
    full_poses: bool = True,
    parameter_values: FloatArray | None = None,
) -> Identification:
    """Determine the identifiable parameters at joint values (s, n).

    By default, `parameter_values` (p,) are the values of the original model.
    """
    J = stack_jacobian(model, joint_values, full_poses=full_poses, parameter_values=parameter_values)
    error = np.full_like(J, model.chain.rounding_bound(joint_values))
    free_parameters = list[int]()
    for group in model.parameter_groups:
        columns = [*free_parameters, *group]
        count = _rank(J[:, columns], error[:, columns]) - len(free_parameters)
        free_parameters += _most_independent(J, free_parameters, group, count)
    fixed = {
        k: _reason(model, J, error, free_parameters, k)
        for group in model.parameter_groups
        for k in group
        if k not in free_parameters
    }
    return Identification(tuple(free_parameters), fixed, len(J))


def _rank(J: FloatArray, error: FloatArray) -> int:
    if not J.size:
        return 0
    lower = singular_values(J, error, np.ones(J.shape[1], dtype=bool)).values.lower
    return int(np.count_nonzero(lower > 0.0))


def _most_independent(
    J: FloatArray, free_parameters: Sequence[int], group: Sequence[int], count: int
) -> list[int]:
    Q, chosen = np.linalg.qr(J[:, list(free_parameters)])[0], list[int]()
    remainders = J[:, list(group)].copy()
    remainders -= Q @ (Q.T @ remainders)
    for _ in range(max(count, 0)):
        lengths = np.linalg.norm(remainders, axis=0)
        i = int(np.argmax(lengths >= _PIVOT_FRACTION * lengths.max()))
        chosen.append(group[i])
        direction = remainders[:, i] / lengths[i]
        remainders -= np.outer(direction, direction @ remainders)
        remainders[:, i] = 0.0
    return sorted(chosen, key=list(group).index)


def _reason(
    model: CalibrationModel, J: FloatArray, error: FloatArray, free_parameters: Sequence[int], k: int
) -> str:
    column, others = J[:, k], J[:, list(free_parameters)]
    if np.linalg.norm(column) <= np.linalg.norm(error[:, k]):
        return "no effect on the measured numbers"
    shares = np.linalg.lstsq(others, column, rcond=None)[0] * np.linalg.norm(others, axis=0)
    shares = np.abs(shares) / np.linalg.norm(column)
    order = [i for i in np.argsort(-shares, kind="stable") if shares[i] > _MIN_EFFECT_FRACTION]
    names = join_names((str(model.chain.parameters[free_parameters[i]]) for i in order), _MAX_NAMES)
    return f"same effect as {names}{' together' if len(order) > 1 else ''}"


def join_names(names: Iterable[str], limit: int) -> str:
    every = list(names)
    return ", ".join(every[:limit]) + (f" and {len(every) - limit} more" if len(every) > limit else "")


#: `Fit.has_redundancy` is true if the total redundancy is at least this number. The total redundancy is an
#: integer plus rounding errors.
_MIN_TOTAL_REDUNDANCY = 0.5
#: Eigenvalues of the matrix I - H_ii below this fraction of the largest eigenvalue count as zero. A
#: measurement error along an eigenvector with the eigenvalue zero does not change the residuals.
_EIGENVALUE_CUTOFF = 1e-9
_MAX_NOISE_ESTIMATES = 20
#: The noise estimation ends when the relative change of the estimated noise is at most this number.
_NOISE_CONVERGENCE = 1e-3
#: Probability that urdfkin reports at least one outlier in a data set without outliers. The number is also
#: the significance level for additional identifiable parameters.
FALSE_ALARM = 0.01
#: A parameter's change is significant if it exceeds this number of standard deviations.
SIGMAS = 2.0
_MAX_OUTLIER_FRACTION = 0.25


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measured poses or positions.

    The measurements are in the instrument's frame if the model has `base` parameters, else in the base frame.

    Attributes:
        joint_values: (s, n) joint values of the path, rad or m.
        p: (s, 3) positions, m.
        R: (s, 3, 3) orientations; None if only positions were measured.
    """

    joint_values: FloatArray
    p: FloatArray
    R: FloatArray | None = None

    @property
    def full_poses(self) -> bool:
        return self.R is not None

    def __len__(self) -> int:
        return len(self.p)

    def select(self, mask: NDArray[np.bool_]) -> Measurements:
        return Measurements(self.joint_values[mask], self.p[mask], None if self.R is None else self.R[mask])


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the measurements.

    Attributes:
        metres: Standard deviation (m) of each position coordinate.
        radians: Standard deviation (rad) of the rotation about each axis.
    """

    metres: float
    radians: float

    def deviations(self, full_poses: bool) -> FloatArray:
        """Return the standard deviations (6,) of a pose, or (3,) of a position."""
        return np.array([self.metres] * 3 + ([self.radians] * 3 if full_poses else []))


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of a fit.

    Attributes:
        parameter_values: (p,) values of all parameters.
        residuals: (s, 6) or (s, 3) measured minus computed values, in the measurements' frame, m and rad.
        noise: The standard deviations by which the residuals are divided.
        covariance: (k, k) covariance of the fitted parameters, in their units. If the noise is not stated,
            a fit without redundancy has an infinite covariance.
        redundancies: (s, 6) or (s, 3) redundancy 1 - H_ii of each measured coordinate.
        chi_squares: (s,) chi^2 statistic of each pose.
    """

    parameter_values: FloatArray
    residuals: FloatArray
    noise: Noise
    covariance: FloatArray
    redundancies: FloatArray
    chi_squares: FloatArray

    @property
    def total_redundancy(self) -> float:
        """The number of measured coordinates minus the number of fitted parameters."""
        return float(self.redundancies.sum())

    @property
    def has_redundancy(self) -> bool:
        return self.total_redundancy >= _MIN_TOTAL_REDUNDANCY

    @property
    def noise_ratio(self) -> float:
        """The ratio of the noise in the residuals to the stated noise; about 1 if the stated noise is true.

        The ratio is nan if `has_redundancy` is false.
        """
        if not self.has_redundancy:
            return math.nan
        whitened = self.residuals / self.noise.deviations(self.residuals.shape[1] == 6)
        return math.sqrt(float((whitened**2).sum()) / self.total_redundancy)

    @property
    def noise_ratio_deviation(self) -> float:
        """The standard deviation of `noise_ratio` if the stated noise is correct."""
        return 1.0 / math.sqrt(2.0 * max(self.total_redundancy, _MIN_TOTAL_REDUNDANCY))

    def rms(self) -> tuple[float, float | None]:
        """Return the rms errors of position (m) and orientation (rad)."""
        position, rotation = (np.sqrt((x**2).sum(axis=1).mean()) for x in np.hsplit(self.residuals, [3]))
        return float(position), float(rotation) if self.residuals.shape[1] == 6 else None

    @property
    def rms_text(self) -> str:
        metres, radians = self.rms()
        return length(metres) if radians is None else f"{length(metres)}, {angle(radians)}"


def compute_residuals(
    model: CalibrationModel, measurements: Measurements, parameter_values: FloatArray
) -> FloatArray:
    """Return the residuals in the measurements' frame: (s, 3) in m, or (s, 6) in m and rad."""
    return _residuals_of_poses(measurements, model.chain.poses(measurements.joint_values, parameter_values))


def _residuals_of_poses(measurements: Measurements, T: FloatArray) -> FloatArray:
    p = measurements.p - T[:, :3, 3]
    if measurements.R is None:
        return p
    return np.hstack([p, log_rotation(measurements.R @ T[:, :3, :3].swapaxes(-1, -2))])


def fit_parameters(
    model: CalibrationModel,
    measurements: Measurements,
    free_parameters: Sequence[int],
    noise: Noise | None,
    parameter_values: FloatArray,
) -> Fit:
    """Fit the parameters with the indices `free_parameters`, starting from `parameter_values` (p,)."""
    problem = _LeastSquares(
        model,
        measurements,
        list(free_parameters),
        noise or Noise(1.0, 1.0 / model.chain.characteristic_length),
    )
    for _ in range(1 if noise else _MAX_NOISE_ESTIMATES):
        parameter_values = problem.minimize(parameter_values)
        fit = problem.fit(parameter_values)
        if noise or not fit.has_redundancy:
            break
        old, new = problem.noise, _estimate_noise(fit, model, measurements)
        is_constant = abs(new.metres - old.metres) <= _NOISE_CONVERGENCE * old.metres and (
            not measurements.full_poses or abs(new.radians - old.radians) <= _NOISE_CONVERGENCE * old.radians
        )
        problem = replace(problem, noise=new)
        if is_constant:
            break
    fit = problem.fit(parameter_values)
    if noise is None and not fit.has_redundancy:
        fit = replace(fit, covariance=np.full_like(fit.covariance, np.inf))
    return fit


def _estimate_noise(fit: Fit, model: CalibrationModel, measurements: Measurements) -> Noise:
    """Estimate the noise; the estimate is at least the rounding error, because it is later a divisor."""
    rounding = model.chain.rounding_bound(measurements.joint_values)

    def estimate_deviation(part: slice, minimum: float, default: float) -> float:
        redundancy = float(fit.redundancies[:, part].sum())
        size = float((fit.residuals[:, part] ** 2).sum())
        return max(math.sqrt(size / redundancy), minimum) if redundancy > _MIN_TOTAL_REDUNDANCY else default

    return Noise(
        estimate_deviation(slice(0, 3), rounding, fit.noise.metres),
        estimate_deviation(slice(3, 6), rounding / model.chain.characteristic_length, fit.noise.radians),
    )


@dataclass(frozen=True, eq=False)
class _LeastSquares:
    model: CalibrationModel
    measurements: Measurements
    free_parameters: list[int]
    noise: Noise

    def weighted_residuals_and_frames(self, parameter_values: FloatArray) -> tuple[FloatArray, FloatArray]:
        frames = self.model.chain.frames(self.measurements.joint_values, parameter_values)
        residuals = _residuals_of_poses(self.measurements, frames[:, -1])
        return (residuals / self.noise.deviations(self.measurements.full_poses)).ravel(), frames

    def weighted_jacobian(self, parameter_values: FloatArray, frames: FloatArray) -> FloatArray:
        scale = self.noise.deviations(self.measurements.full_poses)
        _, columns = self.model.chain.poses_and_jacobian(
            self.measurements.joint_values, parameter_values, frames
        )
        J = columns[:, : len(scale), self.free_parameters] / scale[:, np.newaxis]
        return J.reshape(len(self.measurements) * len(scale), len(self.free_parameters))

    def minimize(self, parameter_values: FloatArray) -> FloatArray:
        def add_step(parameter_values: FloatArray, step: FloatArray) -> FloatArray:
            trial = parameter_values.copy()
            trial[self.free_parameters] += step
            return trial

        return least_squares(
            parameter_values, self.weighted_residuals_and_frames, self.weighted_jacobian, add_step
        )[0]

    def fit(self, parameter_values: FloatArray) -> Fit:
        r, frames = self.weighted_residuals_and_frames(parameter_values)
        J = self.weighted_jacobian(parameter_values, frames)
        k = self.noise.deviations(self.measurements.full_poses).size
        units = np.linalg.norm(J, axis=0)
        units[units == 0.0] = 1.0
        Q, R = np.linalg.qr(J / units)
        half = np.linalg.solve(R, np.eye(len(R))) / units[:, np.newaxis]
        blocks = Q.reshape(len(self.measurements), k, len(self.free_parameters))
        # `redundancy` contains the diagonal blocks of I - H, where H is the hat matrix.
        redundancy = np.eye(k) - blocks @ blocks.swapaxes(-1, -2)
        own = r.reshape(-1, k)
        inverse = np.linalg.pinv(redundancy, rcond=_EIGENVALUE_CUTOFF, hermitian=True)
        chi_squares = np.einsum("si,sij,sj->s", own, inverse, own)
        redundancies = np.clip(np.einsum("sii->si", redundancy), 0.0, 1.0)
        residuals = _residuals_of_poses(self.measurements, frames[:, -1])
        return Fit(parameter_values.copy(), residuals, self.noise, half @ half.T, redundancies, chi_squares)


def reject_outliers(
    model: CalibrationModel,
    measurements: Measurements,
    free_parameters: Sequence[int],
    noise: Noise | None,
    fit: Fit,
    identify_again: Callable[[Measurements], tuple[Sequence[int], Fit]],
) -> tuple[tuple[int, ...], Fit]:
    """Return the indices of the outliers, and a fit without them.

    One outlier is rejected after another. A large outlier can make parameters seem identifiable, and can lead
    the fit to a wrong minimum. Therefore, `identify_again` determines the free parameters again and fits
    them, after 1, 2, 4, 8, ... rejected poses. It is slower than a fit.
    """
    out = list[int]()
    # The remaining poses must give more numbers than there are parameters.
    max_outliers = len(measurements) - 1 - -(-len(free_parameters) // fit.residuals.shape[1])
    max_outliers = min(int(_MAX_OUTLIER_FRACTION * len(measurements)), max_outliers)
    clean = fit
    while len(out) < max_outliers:
        inside = np.setdiff1d(np.arange(len(measurements)), out)
        worst = int(np.argmax(clean.chi_squares))
        limit = chi2_quantile(1.0 - FALSE_ALARM / len(measurements), clean.residuals.shape[1])
        if clean.chi_squares[worst] <= limit:
            break
        out.append(int(inside[worst]))
        chosen = np.ones(len(measurements), dtype=bool)
        chosen[out] = False
        rest = measurements.select(chosen)
        if len(out).bit_count() == 1:
            free_parameters, clean = identify_again(rest)
        else:
            clean = fit_parameters(model, rest, free_parameters, noise, clean.parameter_values)
    return tuple(sorted(out)), clean


def select_significant(
    changes: FloatArray, covariance: FloatArray, always_selected: Sequence[bool]
) -> NDArray[np.bool_]:
    """Select changes of more than `SIGMAS` standard deviations by backward elimination.

    Each step finds the change with the smallest ratio to its standard deviation, and sets this change to 0.
    The other changes are then estimated again. `always_selected` marks the parameters that are always
    selected. If the covariances are unknown (inf), only these parameters are selected.

    >>> select_significant(np.array([3.0, 1.0]), np.eye(2), [False, False]).tolist()
    [True, False]
    """
    stays, free = np.ones(len(changes), dtype=bool), ~np.array(always_selected, dtype=bool)
    if not np.isfinite(covariance).all():
        return ~free
    x, C = changes.copy(), covariance.copy()
    while (candidates := np.flatnonzero(stays & free)).size:
        # Rounding may make a small variance 0 or negative. The quotient is then very large, and the parameter
        # counts as significant.
        sizes = np.abs(x[candidates]) / np.sqrt(np.maximum(C[candidates, candidates], MIN_DIVISOR))
        k = candidates[int(np.argmin(sizes))]
        if sizes.min() > SIGMAS:
            break
        column, variance = C[:, k].copy(), C[k, k]
        x -= column * (x[k] / variance)
        C -= np.outer(column, column) / variance
        stays[k] = False
    return stays


def chi2_quantile(probability: float, degrees_of_freedom: int) -> float:
    """Return the chi^2 quantile (Wilson and Hilferty, 1931).

    The relative error is below 1 % at the probability 0.99. For 3 or more degrees of freedom, the relative
    error is below 6 % at the probabilities from 0.9 to 0.99999.
    """
    step = 2.0 / (9.0 * degrees_of_freedom)
    return degrees_of_freedom * (1.0 - step + NormalDist().inv_cdf(probability) * math.sqrt(step)) ** 3


#: Maximum number of repetitions in the computation of start values for base and tool.
_MAX_START_REPETITIONS = 200
#: The repetitions end when the relative change of the target's position is at most this number.
_TARGET_CONVERGENCE = 1e-9
#: The repetition can end at a local minimum, for example if the target is far from the tip of a small arm. If
#: the error is not small, the repetition therefore starts again at these rotations of the base.
_START_ROTATIONS = tuple(np.diag(x) for x in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]))
#: If the error of the start values is at most this fraction of the spread of the positions, no other start is
#: tried.
_SMALL_START_ERROR = 0.01
#: Largest plausible spread of measured positions, divided by the spread of the robot's tip positions. The
#: quotient is about 1000 if positions are in millimetres by mistake.
_MAX_SPREAD_RATIO = 100.0
#: The spread of the tip positions counts as at least this fraction of the model's characteristic length. A
#: tip on the last axis hardly moves, but a target beside the axis does.
_MIN_SPREAD_OF_LENGTH = 0.1


def estimate_start_values(model: CalibrationModel, measurements: Measurements) -> FloatArray:
    """Return start values (p,) of all parameters.

    Base and tool are computed from the measured poses. The other parameters have their original values.
    """
    parameter_values = model.chain.initial_values.copy()
    ends = {parameter.element for parameter in model.chain.parameters if parameter.is_base_or_tool}
    if not ends:
        return parameter_values
    T = model.chain.poses(measurements.joint_values)
    free = "base" in ends, "tool" in ends
    if measurements.R is None:
        B, X = _from_positions(T, measurements.p, *free)
    else:
        B, X = _from_poses(T, measurements.p, measurements.R, *free)
    poses = {"base": B, "tool": X}
    six = {end: [*pose[:3, 3], *euler_of("XYZ", pose[:3, :3])] for end, pose in poses.items()}
    for k, parameter in enumerate(model.chain.parameters):
        if parameter.is_base_or_tool:
            parameter_values[k] = six[parameter.element][
                ("x", "y", "z", "rx", "ry", "rz").index(parameter.name)
            ]
    return parameter_values


def _from_poses(
    T: FloatArray, p: FloatArray, R: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    B, X = np.eye(4), np.eye(4)
    if base and tool:
        B[:3, :3], X[:3, :3] = _solve_base_tool_rotations(T[:, :3, :3], R)
    elif base:
        B[:3, :3] = _nearest_rotation(np.einsum("sij,skj->ik", R, T[:, :3, :3]))
    else:
        X[:3, :3] = _nearest_rotation(np.einsum("sji,sjk->ik", T[:, :3, :3], R))
    B[:3, 3], X[:3, 3] = _solve_base_tool_translations(T, p, B[:3, :3], base, tool)
    return B, X


def _from_positions(T: FloatArray, p: FloatArray, base: bool, tool: bool) -> tuple[FloatArray, FloatArray]:
    if not (base and tool):
        return _repeat_from_positions(T, p, base, tool, None)
    enough = _SMALL_START_ERROR * float(np.linalg.norm(p - p.mean(axis=0)))
    best, least = (np.eye(4), np.eye(4)), math.inf
    for R_B in (None, *_START_ROTATIONS):
        B, X = _repeat_from_positions(T, p, base, tool, R_B)
        error = float(np.linalg.norm(p - (B @ T @ X)[:, :3, 3]))
        if error < least:
            best, least = (B, X), error
        if least <= enough:
            break
    return best


def _repeat_from_positions(
    T: FloatArray, p: FloatArray, base: bool, tool: bool, R_B: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Solve for base and tool. Without the start rotation `R_B`, the target is first at the tip."""
    B, X = np.eye(4), np.eye(4)
    for k in range(_MAX_START_REPETITIONS if base and tool else 1):
        if k == 0 and R_B is not None:
            B[:3, :3] = R_B
        elif base:
            points = T[:, :3, :3] @ X[:3, 3] + T[:, :3, 3]
            B[:3, :3] = _nearest_rotation((p - p.mean(axis=0)).T @ (points - points.mean(axis=0)))
        before = X[:3, 3].copy()
        B[:3, 3], X[:3, 3] = _solve_base_tool_translations(T, p, B[:3, :3], base, tool)
        if np.linalg.norm(X[:3, 3] - before) <= _TARGET_CONVERGENCE * np.linalg.norm(X[:3, 3]):
            break
    return B, X


def _solve_base_tool_rotations(R: FloatArray, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve R_B^T M_i = R_i R_X for R_B and R_X.

    The linear form is M_i^T R_B - R_X^T R_i^T = 0.
    """
    unit = np.eye(3)
    left = np.einsum("sab,cd->sacbd", M.swapaxes(-1, -2), unit).reshape(-1, 9)
    right = np.einsum("ab,scd->sacbd", unit, R).reshape(-1, 9)
    null = np.linalg.svd(np.hstack([left, -right]), full_matrices=False)[2][-1]
    B, X_back = null[:9].reshape(3, 3), null[9:].reshape(3, 3)
    sign = np.sign(np.linalg.det(B)) or 1.0
    return _nearest_rotation(sign * B), _nearest_rotation(sign * X_back).T


def _nearest_rotation(M: FloatArray) -> FloatArray:
    U, _, Vt = np.linalg.svd(M)
    if np.linalg.det(U @ Vt) < 0.0:
        U[:, 2] *= -1.0
    return np.asarray(U @ Vt)


def _solve_base_tool_translations(
    T: FloatArray, p: FloatArray, R_B: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    """Solve p_Mi = R_B R_i x + R_B p_i + b for b and x."""
    differences = (p - T[:, :3, 3] @ R_B.T).ravel()
    columns = [np.tile(np.eye(3), (len(p), 1))] if base else []
    columns += [(R_B @ T[:, :3, :3]).reshape(-1, 3)] if tool else []
    found = np.asarray(np.linalg.lstsq(np.hstack(columns), differences, rcond=None)[0], np.float64)
    return found[:3] if base else np.zeros(3), found[-3:] if tool else np.zeros(3)


def check_metres(model: CalibrationModel, measurements: Measurements) -> None:
    """Raise InputError if the measured positions seem to be in millimetres."""
    T = model.chain.poses(measurements.joint_values)
    ours, theirs = (
        float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) for x in (T[:, :3, 3], measurements.p)
    )
    least = _MIN_SPREAD_OF_LENGTH * model.chain.characteristic_length
    if theirs > _MAX_SPREAD_RATIO * max(ours, least):
        raise InputError(
            "the measured positions are much farther apart than the positions of the robot's tip",
            found=f"{theirs:.4g} m, where the robot's tip moves {ours:.4g} m",
            remedy="if the positions are in millimetres, add --unit mm (in Python, multiply them by 0.001)",
        )
