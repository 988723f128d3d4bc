"""Check whether a fit is plausible, and find the likeliest mistake in the measured data if it is not.

A fit always has some result, even if joint angles are in degrees, rows of q are shifted, or the sign of a
joint is reversed. A fit is refused if its residuals are a large fraction of the robot's reach, or if it
hardly improves the original model. A fit that tilts a joint's axis by a large angle, or that has no
redundancy, is refused too. The module then corrects each common mistake in the data and fits again. If the
fit is plausible after a correction, the corrected mistake is the likeliest one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from urdfkin.calibration.fit import (
    Fit,
    Identification,
    Measured,
    Noise,
    best_fit,
    errors,
    first_names,
    identify,
    starting,
)
from urdfkin.calibration.parameters import CalibrationModel, Parameter
from urdfkin.comparison.result import angle, length
from urdfkin.model.tree import LARGEST_ANGLE, FloatArray, JointKind, KinematicTree, far_outside

#: The limits of the rms position error are fractions of the reach.
#: A fit with an error above `_MISSED` is refused.
#: The comments of `_UNEXPLAINED` and `_HARDLY_BELOW` explain `_CLOSE_BY` and `_NO_BETTER`.
#: Above `_SUSPECT`, urdfkin corrects each common mistake in the data and fits again.
_MISSED, _CLOSE_BY, _NO_BETTER, _SUSPECT = 0.05, 0.01, 0.03, 0.002
#: This limit of a fit's error is a fraction of the spread of measured positions.
#: A fit with a larger error is refused if the error also exceeds `_CLOSE_BY` times the reach.
_UNEXPLAINED = 0.25
#: This limit of a fit's error is a fraction of the error before the fit.
#: A fit with a larger error is refused if the error also exceeds `_NO_BETTER` times the reach.
_HARDLY_BELOW = 0.7
#: The limits of the rms orientation error are in radians.
#: A fit with an error above `_MISTURNED` is refused.
#: Above `_SUSPECT_TURN`, urdfkin corrects each common mistake in the data and fits again.
_MISTURNED, _SUSPECT_TURN = 0.2, 0.005
#: These are the largest plausible tilt of a joint's axis (rad) and the largest plausible gain.
_TILTED, _GAINED = 0.5, 0.5
#: Two configurations are treated as one if their joint values (rad, m) differ by less than this number.
_ONE_CONFIGURATION = 1e-6
#: urdfkin subtracts this number of standard deviations from a change, and compares the rest with the limit.
#: The reason is that the tilt of an axis near the target is poorly observable.
_UNCERTAIN = 5.0
#: The limit of the error after a correction is a fraction of the error before the correction.
#: The limit is `_BETTER` for an accepted fit before the correction, and `_NOT_WORSE` for a refused one.
_BETTER, _NOT_WORSE = 0.25, 1.5
#: `_FITTED` is the number of corrections that are fitted; the most promising ones are fitted first.
#: A correction of `_SHIFTS` assigns each row of q to the pose that is one or two rows earlier or later.
_FITTED, _SHIFTS = 4, (1, -1, 2, -2)
#: A message names at most four joints.
_list = partial(first_names, most=4)


@dataclass(frozen=True)
class Plausibility:
    """The reasons why a fit is refused.

    Attributes:
        objections: A message for each reason; empty for a plausible fit.
        reason: The likeliest mistake and its remedy; None if no correction makes the fit plausible.
        is_in_degrees: Whether joint angles look like degrees. The fit is then returned only if `radians` is
            true.
    """

    objections: tuple[str, ...] = ()
    reason: str | None = None
    is_in_degrees: bool = False


@dataclass(frozen=True, eq=False)
class Ended:
    """A fit with its data.

    Attributes:
        q: (s, c) coordinates of the path.
        measured: The poses that were measured at `q`.
        identification: The identifiable and the fixed parameters.
        before: The fit of only base and tool; all other parameters are fixed.
        fitted: The fit of all identifiable parameters.
    """

    q: FloatArray
    measured: Measured
    identification: Identification
    before: Fit
    fitted: Fit


def judge(model: CalibrationModel, ended: Ended, *, radians: bool) -> Plausibility:
    """Check whether a fit is plausible, and find the likeliest mistake if it is not.

    `radians` says whether large joint angles are known to be radians.
    """
    few = _too_few(ended)
    misfits = [*_misfits(model, ended), *_extreme_parameters(model, ended)]
    turned, outside = _out_of_range(model, ended.q)
    in_degrees = bool(turned) and not radians
    beyond = f"joint values of more than one turn look like degrees: joint {_list(turned)}"
    ranges = [beyond] if in_degrees else []
    if outside and (misfits or few):
        ranges.append(f"joint values are far outside the limits: joint {_list(outside)}")
    objections = [*ranges, *misfits, *few]
    reach, fitted = _reach(model, ended), ended.fitted
    metres, turn = fitted.rms()
    zeros = _turned_zeros(model, ended)
    is_suspect = metres > _SUSPECT * reach or (turn or 0.0) > _SUSPECT_TURN
    if few or not (objections or is_suspect or zeros):
        return Plausibility(tuple(objections), is_in_degrees=in_degrees)
    limit = (_NOT_WORSE if objections or zeros else _BETTER) * _left(ended, reach)
    better = _likeliest(model, ended, limit, reach)
    if better is None:
        return Plausibility(tuple(objections), is_in_degrees=in_degrees)
    if not objections:
        half = f"a joint zero changed by half a turn, joint {_list(zeros)}; " if zeros else ""
        objections = [
            f"{half}an rms error of {_rms(fitted)}, but only {_rms(better.ended.fitted)} with a"
            " correction of the data"
        ]
    corrected = f"after this correction the rms error is {_rms(better.ended.fitted)}"
    return Plausibility(tuple(objections), f"{better.correction.reason} ({corrected})", in_degrees)


# -- objections --------------------------------------------------------------------------------------


def _too_few(ended: Ended) -> list[str]:
    steps = np.round(ended.measured.values / _ONE_CONFIGURATION)
    distinct, each = len(np.unique(steps, axis=0)), ended.fitted.errors.shape[1]
    rank = ended.identification.rank
    if distinct * each > rank:
        return []
    among = f" among {len(steps)} poses" if distinct < len(steps) else ""
    return [
        f"{distinct} distinct configuration{'s' * (distinct != 1)}{among} give {distinct * each} numbers "
        f"for {rank} parameters, so the fit cannot be checked"
    ]


def _reach(model: CalibrationModel, ended: Ended) -> float:
    """Return the largest distance (m) of the tip from the base or any joint axis, in the original model."""
    T, columns = model.way.columns(ended.measured.values)
    turning = [k for k, p in enumerate(model.way.parameters) if p.what in ("rz", "theta")]
    levers = np.linalg.norm(columns[:, :3, turning], axis=1).max(initial=0.0)
    away = np.linalg.norm(T[:, :3, 3], axis=1).max(initial=0.0)
    return min(model.way.size, float(max(levers, away))) or model.way.size


def _misfits(model: CalibrationModel, ended: Ended) -> Iterator[str]:
    """Yield a message if position residuals or orientation residuals are too large."""
    reach = _reach(model, ended)
    (metres, turn), (metres_before, _) = ended.fitted.rms(), ended.before.rms()
    p = ended.measured.p
    spread = float(np.sqrt(((p - p.mean(axis=0)) ** 2).sum(axis=1).mean()))
    no_better = metres > _NO_BETTER * reach and metres > _HARDLY_BELOW * metres_before
    unexplained = metres > _CLOSE_BY * reach and metres > _UNEXPLAINED * spread
    if metres > _MISSED * reach or no_better or unexplained:
        yield (
            f"a large rms error of {length(metres)}, which is {metres / reach:.0%} of the reach of"
            f" {length(reach)} "
            f"(before the fit {length(metres_before)})"
        )
    if turn is not None and turn > _MISTURNED:
        yield f"a large rms error of the orientations, {angle(turn)}"


def _extreme_parameters(model: CalibrationModel, ended: Ended) -> Iterator[str]:
    """Yield a message if fitted tilts or gains are larger than those of any real robot."""
    tilted, gained = dict[str, str](), dict[str, str]()
    for parameter, moved, surely in _changes(model, ended):
        if parameter.what in ("rx", "ry", "alpha", "beta") and surely > _TILTED:
            tilted.setdefault(parameter.where, f"{parameter.where!r} by {angle(abs(moved))}")
        if parameter.what == "gain" and surely > _GAINED:
            gained[parameter.where] = f"{parameter.where!r} by {1.0 + moved:.3g}"
    if tilted:
        yield f"the fit tilts the axis of joint {_list(tilted.values())}"
    if gained:
        yield f"the fit scales the values of joint {_list(gained.values())}"


def _turned_zeros(model: CalibrationModel, ended: Ended) -> list[str]:
    """Return the joints whose zero changed by about half a turn, as after a sign error of the next joint."""
    return [
        f"{parameter.where!r} by {angle(abs(moved))}"
        for parameter, moved, surely in _changes(model, ended)
        if parameter.what in ("rz", "theta") and surely > _TILTED and abs(abs(moved) - math.pi) < _TILTED
    ]


def _changes(model: CalibrationModel, ended: Ended) -> Iterator[tuple[Parameter, float, float]]:
    """Yield each fitted parameter of a moving joint, its change, and a lower bound of the change's size.

    The lower bound is the absolute value of the change, minus `_UNCERTAIN` standard deviations of the change.
    If only positions were measured, joints with an axis near the tip of the original model are skipped.
    """
    kept, fitted = ended.identification.kept, ended.fitted
    near = set[str]()
    if not ended.measured.complete:
        _, columns = model.way.columns(ended.measured.values)
        levers = np.linalg.norm(columns[:, :3], axis=1).max(axis=0, initial=0.0)
        least = _MISSED * _reach(model, ended)
        parameters = zip(model.way.parameters, levers.tolist(), strict=True)
        near = {p.where for p, lever in parameters if p.what in ("rz", "theta") and lever < least}
    deviations = np.sqrt(np.diag(fitted.covariance))
    for k, deviation in zip(kept, deviations.tolist(), strict=True):
        parameter = model.way.parameters[k]
        if not parameter.end and parameter.where in model.coupling.joints and parameter.where not in near:
            moved = float(fitted.at[k] - model.way.start[k])
            yield parameter, moved, abs(moved) - _UNCERTAIN * deviation


def _out_of_range(model: CalibrationModel, q: FloatArray) -> tuple[list[str], list[str]]:
    """Return the joints with values that look like degrees, and other joints with values far outside limits.

    The first list contains the joints about which `configuration.warn_of_degrees` warns.
    """
    largest = dict(zip(model.coupling.names, np.abs(q).max(axis=0, initial=0.0).tolist(), strict=True))
    turned, outside = dict[str, str](), dict[str, str]()
    for name, is_turning, lower, upper in _coordinates(model):
        column = q[:, model.coupling.names.index(name)]
        ends = far_outside(lower, upper)
        far = float(column.min()) < ends[0] or float(column.max()) > ends[1]
        is_limited = math.isfinite(lower) and math.isfinite(upper)
        if is_turning and largest[name] > LARGEST_ANGLE and (far or not is_limited):
            turned[name] = f"{name!r} ({largest[name]:.4g})"
        elif far:
            outside[name] = f"{name!r} ({largest[name]:.4g}, limits {lower:.4g} to {upper:.4g})"
    return list(turned.values()), list(outside.values())


def _coordinates(model: CalibrationModel) -> Iterator[tuple[str, bool, float, float]]:
    """Yield (name, is_angle, lower limit, upper limit) for each coordinate of the path."""
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
    """Data with one possible mistake corrected."""

    reason: str
    q: FloatArray
    first: int = 0
    last: int | None = None


def _corrections(model: CalibrationModel, q: FloatArray) -> Iterator[_Correction]:
    turning = np.array([turns for _, turns, *_ in _coordinates(model)], dtype=bool)
    if turning.any():
        yield _Correction(
            "joint angles are in degrees; convert them to radians", np.where(turning, np.radians(q), q)
        )
    if not turning.all():
        if turning.any():
            yield _Correction(
                "all joint values are multiplied by 180/pi; divide them by 180/pi", np.radians(q)
            )
        yield _Correction(
            "prismatic joints are in millimetres; convert them to metres", np.where(turning, q, 1e-3 * q)
        )
    for by in _SHIFTS:
        if len(q) > abs(by) + 1:
            rows = "one row" if abs(by) == 1 else f"{abs(by)} rows"
            way = "later" if by > 0 else "earlier"
            reason = (
                f"q is shifted by {rows} relative to the poses; the correct q of each pose is {rows} {way}"
            )
            shifted = q[by:] if by > 0 else q[:by]
            yield _Correction(reason, shifted, max(-by, 0), len(q) - max(by, 0))
    for j, name in enumerate(model.coupling.names):
        yield _Correction(_sign((name,)), q * np.where(np.arange(q.shape[1]) == j, -1.0, 1.0))


def _sign(names: Sequence[str]) -> str:
    if len(names) == 1:
        return f"the sign of joint {names[0]!r} is wrong; negate its values or its axis"
    return f"the signs of joints {_list(map(repr, names))} are wrong; negate their values or their axes"


def _likeliest(model: CalibrationModel, ended: Ended, limit: float, reach: float) -> _Trial | None:
    """Return the first correction that gives a plausible fit with an error below the limit; else None."""
    trials = [_Trial(model, ended, correction, reach) for correction in _corrections(model, ended.q)]
    trials.sort(key=lambda trial: trial.left_before)
    for trial in trials[:_FITTED]:
        if trial.is_plausible(limit):
            return trial
    several = _several_signs(model, ended, reach)
    return several if several is not None and several.is_plausible(limit) else None


def _several_signs(model: CalibrationModel, ended: Ended, reach: float) -> _Trial | None:
    """Try two or more reversed signs.

    Each step reverses the joint whose reversal gives the smallest error. Only base and tool are fitted for
    this error. The search ends when no reversal reduces the error.
    """
    names, signs = model.coupling.names, np.ones(ended.q.shape[1])
    best, least = None, math.inf
    for _ in names:
        trials = []
        for j in range(len(names)):
            flipped = np.where(np.arange(len(names)) == j, -signs, signs)
            reversed_ = [name for name, sign in zip(names, flipped, strict=True) if sign < 0.0]
            trials.append(
                (_Trial(model, ended, _Correction(_sign(reversed_), ended.q * flipped), reach), flipped)
            )
        trial, flipped = min(trials, key=lambda one: one[0].left_before)
        if trial.left_before >= least:
            break
        best, least, signs = trial, trial.left_before, flipped
    return best if np.count_nonzero(signs < 0.0) > 1 else None


class _Trial:
    def __init__(self, model: CalibrationModel, ended: Ended, correction: _Correction, reach: float) -> None:
        self.model, self.correction, self.reach = model, correction, reach
        chosen = slice(correction.first, correction.last)
        old = ended.measured
        self.measured = Measured(
            model.coupling.values(correction.q), old.p[chosen], None if old.R is None else old.R[chosen]
        )
        self.weights = Noise(1.0, 1.0 / reach)
        self.start = starting(model, self.measured)
        #: This error (m) per pose is that of a fit of only base and tool.
        self.left_before = _size(errors(model, self.measured, self.start), reach) / math.sqrt(
            len(self.measured)
        )
        self.identification = ended.identification

    @cached_property
    def ended(self) -> Ended:
        """The fit of all identifiable parameters."""
        model, measured = self.model, self.measured
        ends = [k for k in self.identification.kept if model.way.parameters[k].end]
        before = best_fit(model, measured, ends, self.weights, self.start)
        found = identify(model, measured.values, complete=measured.complete, at=self.start)
        fit = best_fit(model, measured, found.kept, self.weights, before.at)
        return Ended(self.correction.q, measured, found, before, fit)

    def is_plausible(self, limit: float) -> bool:
        """Return whether the fit after the correction is plausible and has an error below the limit."""
        try:
            ended = self.ended
        except np.linalg.LinAlgError:
            return False
        if not ended.fitted.is_judged or _left(ended, self.reach) > limit:
            return False
        strange = [*_misfits(self.model, ended), *_extreme_parameters(self.model, ended)]
        return not strange and not _turned_zeros(self.model, ended)


def _size(left: FloatArray, reach: float) -> float:
    """Return the norm of residuals (s, 6) or (s, 3), metres; angles are multiplied by the reach."""
    return float(np.linalg.norm(left * ([1.0] * 3 + [reach] * (left.shape[1] - 3))))


def _left(ended: Ended, reach: float) -> float:
    """Return the standard deviation (m) of the residuals."""
    return _size(ended.fitted.errors, reach) / math.sqrt(max(ended.fitted.freedom, 1.0))


def _rms(fit: Fit) -> str:
    metres, turn = fit.rms()
    return length(metres) if turn is None else f"{length(metres)}, {angle(turn)}"
