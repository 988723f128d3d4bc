"""Check the plausibility of a fit, and find the likeliest mistake in the data.

Least squares also computes a fit if the data are wrong, for example if joint values are in degrees. A fit is
refused for any of these reasons:

- The rms position error is a large fraction of the robot's reach.
- The rms position error is a smaller fraction of the reach, but a large fraction of the spread of the
  measured positions.
- The rms position error is a smaller fraction of the reach, but a fit of base and tool alone is almost as
  accurate.
- The orientation error, the tilt of a joint's axis, or the change of a gain is large.
- The fit has no redundancy.
- Joint values look like degrees.
- The fit is inaccurate, and a correction of a common mistake in the data makes the fit much more accurate.
- The fit changes a joint's zero by about half a turn, and the fit is plausible after such a correction.

To find the likeliest mistake, the module corrects common mistakes in the data, one at a time, and fits again.
The first correction with a plausible fit shows the likeliest mistake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from urdfkin.calibration.fit import (
    Fit,
    Identification,
    Measurements,
    Noise,
    compute_residuals,
    estimate_start_values,
    fit_parameters,
    identify,
    join_names,
)
from urdfkin.calibration.parameters import CalibrationModel, Parameter
from urdfkin.comparison.result import angle, length
from urdfkin.model.tree import MAX_PLAUSIBLE_ANGLE, FloatArray, JointKind, KinematicTree, limits_with_margin

#: The rms position error of a plausible fit is at most this fraction of the reach.
_MAX_ERROR_OF_REACH = 0.05
#: A fit is not plausible if its rms position error exceeds both fractions, of the reach and of the spread.
#: The spread is the rms distance of the measured positions from their mean.
_UNEXPLAINED_OF_REACH, _UNEXPLAINED_OF_SPREAD = 0.01, 0.25
#: A fit is not plausible if its rms position error exceeds both fractions. The first is a fraction of the
#: reach. The second is a fraction of the rms position error of a fit of base and tool alone.
_NO_BETTER_OF_REACH, _NO_BETTER_OF_BEFORE = 0.03, 0.7
#: Largest plausible rms orientation error, rad.
_MAX_ORIENTATION_ERROR = 0.2
#: If a fit exceeds one of these limits, the module searches for common mistakes in the data. The limits are
#: for the rms position error as a fraction of the reach, and the rms orientation error (rad).
_SUSPECT_ERROR_OF_REACH, _SUSPECT_ORIENTATION_ERROR = 0.002, 0.005
#: Largest plausible tilt of a joint's axis (rad), and largest plausible change of a gain.
_LARGEST_TILT, _LARGEST_GAIN = 0.5, 0.5
#: Joint values are rounded to multiples of this number (rad or m) before configurations are compared.
_JOINT_VALUE_RESOLUTION = 1e-6
#: This number of standard deviations is subtracted from a parameter's change before the limit is applied.
#: Therefore, an uncertain change does not make a fit implausible.
_CHANGE_MARGIN_SIGMAS = 5.0
#: An accepted correction has at most this multiple of the original error.
_MAX_IMPROVED_ERROR_RATIO = 0.25
#: This multiple applies if the original fit is not plausible, or changes a zero position by half a turn.
_MAX_SIMILAR_ERROR_RATIO = 1.5
#: Maximum number of corrections for which all parameters are fitted. The corrections with the smallest errors
#: before this fit are chosen.
_MAX_FITS = 4
#: urdfkin tries these shifts of the rows of q relative to the poses. The shift k means that row i + k of q
#: belongs to pose i.
_ROW_SHIFTS = (1, -1, 2, -2)
_join_names = partial(join_names, limit=4)
#: With too few configurations, urdfkin does not search for a correction of the data.
_TOO_FEW_CONFIGURATIONS = "too few different configurations; measure poses at more configurations"


@dataclass(frozen=True)
class Plausibility:
    """The reasons why a fit is refused.

    Attributes:
        objections: The reasons; empty for a plausible fit.
        reason: The likeliest mistake and its remedy, if found.
        is_in_degrees: Whether `calibrate` refuses the fit even with `force`.
    """

    objections: tuple[str, ...] = ()
    reason: str | None = None
    is_in_degrees: bool = False


@dataclass(frozen=True, eq=False)
class FitWithData:
    """A fit with its data.

    Attributes:
        q: (s, c) values of the path's independent joints.
        base_tool_fit: Fit of base and tool alone.
    """

    model: CalibrationModel
    q: FloatArray
    measurements: Measurements
    identification: Identification
    base_tool_fit: Fit
    full_fit: Fit

    @cached_property
    def reach(self) -> float:
        """Reach of the original model at the measured configurations, m.

        The reach is the largest distance of the tip from the base, or from the axis of a parameter rz or
        theta. The reach is at most `characteristic_length`.
        """
        chain = self.model.chain
        T, columns = chain.poses_and_jacobian(self.measurements.joint_values)
        turning = [k for k, p in enumerate(chain.parameters) if p.name in ("rz", "theta")]
        levers = np.linalg.norm(columns[:, :3, turning], axis=1).max(initial=0.0)
        distance = np.linalg.norm(T[:, :3, 3], axis=1).max(initial=0.0)
        return min(chain.characteristic_length, float(max(levers, distance))) or chain.characteristic_length

    def residual_deviation(self, reach: float) -> float:
        """Return the residuals' standard deviation (m); angles (rad) are multiplied by the reach (m)."""
        return _norm(self.full_fit.residuals, reach) / math.sqrt(max(self.full_fit.total_redundancy, 1.0))

    def redundancy_objections(self) -> list[str]:
        steps = np.round(self.measurements.joint_values / _JOINT_VALUE_RESOLUTION)
        distinct, each = len(np.unique(steps, axis=0)), self.full_fit.residuals.shape[1]
        rank = self.identification.rank
        if distinct * each > rank:
            return []
        among = f" among {len(steps)} poses" if distinct < len(steps) else ""
        return [
            f"{distinct} distinct configuration{'s' * (distinct != 1)}{among} give {distinct * each} numbers "
            f"for {rank} parameters, so the fit cannot be checked"
        ]

    def misfit_objections(self) -> Iterator[str]:
        reach = self.reach
        (metres, radians), (metres_before, _) = self.full_fit.rms(), self.base_tool_fit.rms()
        p = self.measurements.p
        spread = float(np.sqrt(((p - p.mean(axis=0)) ** 2).sum(axis=1).mean()))
        no_better = metres > _NO_BETTER_OF_REACH * reach and metres > _NO_BETTER_OF_BEFORE * metres_before
        unexplained = metres > _UNEXPLAINED_OF_REACH * reach and metres > _UNEXPLAINED_OF_SPREAD * spread
        if metres > _MAX_ERROR_OF_REACH * reach or no_better or unexplained:
            yield (
                f"a large rms error of {length(metres)}, which is {metres / reach:.0%} of the reach of"
                f" {length(reach)} "
                f"(before the fit {length(metres_before)})"
            )
        if radians is not None and radians > _MAX_ORIENTATION_ERROR:
            yield f"a large rms error of the orientations, {angle(radians)}"

    def extreme_parameter_objections(self) -> Iterator[str]:
        tilted, gained = dict[str, str](), dict[str, str]()
        for parameter, change, least in self._joint_parameter_changes():
            if parameter.name in ("rx", "ry", "alpha", "beta") and least > _LARGEST_TILT:
                tilted.setdefault(parameter.element, f"{parameter.element!r} by {angle(abs(change))}")
            if parameter.name == "gain" and least > _LARGEST_GAIN:
                gained[parameter.element] = f"{parameter.element!r} by {1.0 + change:.3g}"
        if tilted:
            yield f"the fit tilts the axis of joint {_join_names(tilted.values())}"
        if gained:
            yield f"the fit scales the values of joint {_join_names(gained.values())}"

    def half_turn_zeros(self) -> list[str]:
        """Describe the joints with zero positions that changed by about half a turn.

        Wrong signs of the next joint's values can be the cause.
        """
        return [
            f"{parameter.element!r} by {angle(abs(change))}"
            for parameter, change, least in self._joint_parameter_changes()
            if parameter.name in ("rz", "theta")
            and least > _LARGEST_TILT
            and abs(abs(change) - math.pi) < _LARGEST_TILT
        ]

    def _joint_parameter_changes(self) -> Iterator[tuple[Parameter, float, float]]:
        """Yield (parameter, change, lower bound of |change|) for moving joints.

        Without measured orientations, a joint is skipped if its axis is near the target in all poses.
        """
        model, fitted = self.model, self.full_fit
        near = set[str]()
        if not self.measurements.full_poses:
            _, columns = model.chain.poses_and_jacobian(self.measurements.joint_values)
            levers = np.linalg.norm(columns[:, :3], axis=1).max(axis=0, initial=0.0)
            least = _MAX_ERROR_OF_REACH * self.reach
            parameters = zip(model.chain.parameters, levers.tolist(), strict=True)
            near = {
                p.element
                for p, lever in parameters
                if p.name in ("rz", "theta") and not p.is_base_or_tool and lever < least
            }
        deviations = np.sqrt(np.diag(fitted.covariance))
        for k, deviation in zip(self.identification.free_parameters, deviations.tolist(), strict=True):
            parameter = model.chain.parameters[k]
            if (
                not parameter.is_base_or_tool
                and parameter.element in model.coupling.joints
                and parameter.element not in near
            ):
                change = float(fitted.parameter_values[k] - model.chain.initial_values[k])
                yield parameter, change, abs(change) - _CHANGE_MARGIN_SIGMAS * deviation


def check_plausibility(fit: FitWithData, *, radians: bool) -> Plausibility:
    few = fit.redundancy_objections()
    misfits = [*fit.misfit_objections(), *fit.extreme_parameter_objections()]
    like_degrees, outside = _find_implausible_values(fit.model, fit.q)
    in_degrees = bool(like_degrees) and not radians
    beyond = f"joint values of more than one turn look like degrees: joint {_join_names(like_degrees)}"
    ranges = [beyond] if in_degrees else []
    if outside and (misfits or few):
        ranges.append(f"joint values are far outside the limits: joint {_join_names(outside)}")
    objections = [*ranges, *misfits, *few]
    metres, turn = fit.full_fit.rms()
    zeros = fit.half_turn_zeros()
    is_suspect = metres > _SUSPECT_ERROR_OF_REACH * fit.reach or (turn or 0.0) > _SUSPECT_ORIENTATION_ERROR
    better = None
    if not few and (objections or is_suspect or zeros):
        better = _find_likeliest_correction(
            fit,
            (_MAX_SIMILAR_ERROR_RATIO if objections or zeros else _MAX_IMPROVED_ERROR_RATIO)
            * fit.residual_deviation(fit.reach),
        )
    if better is None:
        return Plausibility(tuple(objections), _TOO_FEW_CONFIGURATIONS if few else None, in_degrees)
    if not objections:
        half = f"the zero position changed by half a turn: joint {_join_names(zeros)}; " if zeros else ""
        objections = [
            f"{half}an rms error of {fit.full_fit.rms_text}, but only {better.fit.full_fit.rms_text} with a"
            " correction of the data"
        ]
    corrected = f"after this correction the rms error is {better.fit.full_fit.rms_text}"
    return Plausibility(tuple(objections), f"{better.correction.reason} ({corrected})", in_degrees)


def _find_implausible_values(model: CalibrationModel, q: FloatArray) -> tuple[list[str], list[str]]:
    like_degrees, outside = list[str](), list[str]()
    for (name, is_angle, lower, upper), column in zip(_coordinates_with_limits(model), q.T, strict=True):
        largest = float(np.abs(column).max(initial=0.0))
        ends = limits_with_margin(lower, upper)
        is_far = float(column.min()) < ends[0] or float(column.max()) > ends[1]
        is_limited = math.isfinite(lower) and math.isfinite(upper)
        if is_angle and largest > MAX_PLAUSIBLE_ANGLE and (is_far or not is_limited):
            like_degrees.append(f"{name!r} ({largest:.4g})")
        elif is_far:
            outside.append(f"{name!r} ({largest:.4g}, limits {lower:.4g} to {upper:.4g})")
    return like_degrees, outside


def _coordinates_with_limits(model: CalibrationModel) -> Iterator[tuple[str, bool, float, float]]:
    """Yield (name, is_angle, lower limit, upper limit)."""
    kinds = dict(zip(model.coupling.joints, model.coupling.kinds, strict=True))
    for name in model.coupling.names:
        lower, upper, kind = -math.inf, math.inf, kinds.get(name)
        if isinstance(model.source, KinematicTree):
            joint = model.source.joints[model.source.joint_index(name)]
            kind = joint.kind
            if joint.limit is not None and kind is not JointKind.CONTINUOUS:
                lower, upper = joint.limit.lower, joint.limit.upper
        yield name, kind is None or kind.turns, lower, upper


# -- mistakes ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Correction:
    """Configurations after correcting one mistake.

    Row i of `q` belongs to pose `first_pose` + i. The rows end before `end_pose`.
    """

    reason: str
    q: FloatArray
    first_pose: int = 0
    end_pose: int | None = None


def _corrections(model: CalibrationModel, q: FloatArray) -> Iterator[_Correction]:
    is_angle = np.array([is_angle for _, is_angle, *_ in _coordinates_with_limits(model)], dtype=bool)
    if is_angle.any():
        yield _Correction(
            "joint angles are in degrees; convert them to radians", np.where(is_angle, np.radians(q), q)
        )
    if not is_angle.all():
        if is_angle.any():
            yield _Correction(
                "all joint values are multiplied by 180/pi; divide them by 180/pi", np.radians(q)
            )
        yield _Correction(
            "values of prismatic joints are in millimetres; convert them to metres",
            np.where(is_angle, q, 1e-3 * q),
        )
    for shift in _ROW_SHIFTS:
        if len(q) > abs(shift) + 1:
            rows = "one row" if abs(shift) == 1 else f"{abs(shift)} rows"
            sign = "+" if shift > 0 else "-"
            reason = (
                f"q is shifted by {rows} relative to the poses; the correct q of pose i is in row i {sign}"
                f" {abs(shift)}"
            )
            shifted = q[shift:] if shift > 0 else q[:shift]
            yield _Correction(reason, shifted, max(-shift, 0), len(q) - max(shift, 0))
    for j in range(len(model.coupling.names)):
        yield _with_signs(model, q, np.where(np.arange(q.shape[1]) == j, -1.0, 1.0))


def _with_signs(model: CalibrationModel, q: FloatArray, signs: FloatArray) -> _Correction:
    names = [name for name, sign in zip(model.coupling.names, signs, strict=True) if sign < 0.0]
    joints = _join_names(map(repr, names))
    reason = f"the signs of joints {joints} are wrong; negate the joint values or the joint axes"
    if len(names) == 1:
        reason = f"the sign of joint {joints} is wrong; negate the joint values or the joint axis"
    return _Correction(reason, q * signs)


def _find_likeliest_correction(fit: FitWithData, limit: float) -> _Trial | None:
    trials = [_Trial(fit, correction) for correction in _corrections(fit.model, fit.q)]
    trials.sort(key=lambda trial: trial.error_before)
    for trial in trials[:_MAX_FITS]:
        if trial.is_plausible(limit):
            return trial
    several = _find_reversed_signs(fit)
    return several if several is not None and several.is_plausible(limit) else None


def _find_reversed_signs(fit: FitWithData) -> _Trial | None:
    """Reverse the signs of joints one by one while the error decreases.

    Return None for fewer than two reversed joints, because each single joint has its own correction.
    """
    signs = np.ones(fit.q.shape[1])
    best, least = None, math.inf
    for _ in signs:
        trials = list[tuple[_Trial, FloatArray]]()
        for j in range(len(signs)):
            reversed_ = np.where(np.arange(len(signs)) == j, -signs, signs)
            trials.append((_Trial(fit, _with_signs(fit.model, fit.q, reversed_)), reversed_))
        trial, reversed_ = min(trials, key=lambda pair: pair[0].error_before)
        if trial.error_before >= least:
            break
        best, least, signs = trial, trial.error_before, reversed_
    return best if np.count_nonzero(signs < 0.0) > 1 else None


class _Trial:
    def __init__(self, original: FitWithData, correction: _Correction) -> None:
        self.original, self.correction = original, correction
        model, poses = original.model, np.zeros(len(original.measurements), dtype=bool)
        poses[correction.first_pose : correction.end_pose] = True
        chosen = original.measurements.select(poses)
        self.measurements = Measurements(model.coupling.values(correction.q), chosen.p, chosen.R)
        self.start = estimate_start_values(model, self.measurements)
        errors_before = _norm(compute_residuals(model, self.measurements, self.start), original.reach)
        #: Rms pose error (m) at the start values.
        #: Rotations (rad) are multiplied by the reach.
        self.error_before = errors_before / math.sqrt(len(self.measurements))

    @cached_property
    def fit(self) -> FitWithData:
        model, measurements = self.original.model, self.measurements
        noise = Noise(1.0, 1.0 / self.original.reach)
        ends = [
            k
            for k in self.original.identification.free_parameters
            if model.chain.parameters[k].is_base_or_tool
        ]
        before = fit_parameters(model, measurements, ends, noise, self.start)
        identification = identify(
            model, measurements.joint_values, full_poses=measurements.full_poses, parameter_values=self.start
        )
        fitted = fit_parameters(
            model, measurements, identification.free_parameters, noise, before.parameter_values
        )
        return FitWithData(model, self.correction.q, measurements, identification, before, fitted)

    def is_plausible(self, limit: float) -> bool:
        try:
            fit = self.fit
        except np.linalg.LinAlgError:
            return False
        if not fit.full_fit.has_redundancy or fit.residual_deviation(self.original.reach) > limit:
            return False
        return not [*fit.misfit_objections(), *fit.extreme_parameter_objections(), *fit.half_turn_zeros()]


def _norm(residuals: FloatArray, reach: float) -> float:
    """Return the norm (m) of the residuals; rotations (rad) are multiplied by the reach (m)."""
    return float(np.linalg.norm(residuals * ([1.0] * 3 + [reach] * (residuals.shape[1] - 3))))
