"""Calibrate a robot: fit its parameters to measured poses, and report uncertainties and warnings.

A fit that is not plausible (`plausible.py`) is refused. Without `write_all`, joint parameters that changed by
at most two standard deviations get their original values. The other parameters of joints and all identifiable
parameters of base and tool are fitted again. Parameters that the file can store are then written.

`read_poses` reads measured poses:

| File | Content |
|---|---|
| CSV | a column for each coordinate, with the coordinate's name |
| | position: x, y, z; optional orientation: qx, qy, qz, qw |
| | or pose matrix: T00 to T23, or T00 to T33, as written by `urdfkin placement --format csv` |
| .npz | configurations: q (n, nq) |
| | poses: T (n, 4, 4) |
| | or positions: p (n, 3); optional orientations: quat (n, 4), quaternions, scalar last |
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.calibration.fit import (
    FALSE_ALARM,
    Fit,
    Identification,
    Measurements,
    Noise,
    check_metres,
    chi2_quantile,
    estimate_start_values,
    fit_parameters,
    identify,
    join_names,
    reject_outliers,
    select_significant,
    stack_jacobian,
)
from urdfkin.calibration.parameters import CalibrationModel, Parameter, make_table_model, make_urdf_model
from urdfkin.calibration.plausible import FitWithData, Plausibility, check_plausibility
from urdfkin.calibration.write_back import UpdatedURDF
from urdfkin.comparison.result import length
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_choice, as_finite_float, as_names, as_str, safe_repr
from urdfkin.kinematics.inputs import as_finite, rotation_defect
from urdfkin.kinematics.rotation import polar_factor, rotation_from_quaternion
from urdfkin.model.configuration import parse_finite
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.loading import as_robot, load
from urdfkin.robot.trajectory import first_cells, read_arrays, read_columns
from urdfkin.system.files import MAX_DATA_BYTES, read_text
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: Number of random configurations for `Calibration.general_identification`.
_GENERAL_CONFIGURATIONS = 40
#: If the noise is stated, a warning is given if `Fit.noise_ratio` differs from 1 by more than this number of
#: standard deviations.
_NOISE_RATIO_SIGMAS = 4.0
#: A parameter is poorly observable if its ratio of uncertainties (`Calibration.poorly_observable`) exceeds
#: this number.
_MAX_UNCERTAINTY_RATIO = 10.0
_RANDOM_SEED = 1
#: A Jacobian J = Q R counts as rank-deficient if an |R_ii| is at most this fraction of the largest |R_ij|.
_RANK_TOLERANCE = 1e-12
#: If the tool is fitted without poses, the target is assumed at (L/5, L/6, L/7) in the tip's frame. L is
#: `ParametricChain.characteristic_length` (m). A joint axis hardly ever passes through this position.
_ASSUMED_TARGET_DIVISORS = {"x": 5.0, "y": 6.0, "z": 7.0}
#: Factor of `ParametricChain.rounding_bound` for the comparison with Pinocchio. Pinocchio rounds more often,
#: because it reads the written file and computes base and tip separately.
_ROUNDING_FACTOR = 4.0
#: Maximum number of parameters or poses that a warning names.
_MAX_NAMES = 6
_UNKNOWN_REASON = (
    "the reason is unknown: degrees, shifted rows of q or reversed joint signs do not explain the error"
)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated model; the result of `urdfkin.calibrate`.

    Attributes:
        robot: The robot before the calibration.
        model: The model with the parameters to fit.
        identification: The parameters that are identifiable from the measured poses. Without poses, the same
            as `general_identification`.
        general_identification: The parameters that are identifiable from random poses. Parameters that only
            noise makes identifiable are not included.
        full_fit: The fit; None without poses.
        base_tool_fit: A fit of base and tool alone.
        outliers: Indices of the outlier poses.
        fit_without_outliers: The fit without the outliers.
        poorly_observable: Maps the index of each poorly observable parameter to its uncertainty at the
            measured configurations, divided by its uncertainty at equally many random configurations.
        certificate: The result of checking the written model with Pinocchio.
        is_noise_stated: Whether the user stated the noise.
        written_fit: The fit of `selected_parameters`; all other joint parameters keep their original values.
        selected_parameters: Indices of the parameters that `written_fit` fits.
        plausibility: The reasons why the fit is refused; empty for a plausible fit.
    """

    robot: Robot
    model: CalibrationModel
    identification: Identification
    general_identification: Identification
    full_fit: Fit | None = None
    base_tool_fit: Fit | None = None
    outliers: tuple[int, ...] = ()
    fit_without_outliers: Fit | None = None
    poorly_observable: dict[int, float] | None = None
    certificate: Certificate | None = None
    is_noise_stated: bool = False
    written_fit: Fit | None = None
    selected_parameters: tuple[int, ...] = ()
    plausibility: Plausibility = field(default_factory=Plausibility)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.model.chain.parameters

    @cached_property
    def changes(self) -> FloatArray:
        """(p,) changes of the parameters: m, rad, and gains without a unit.

        A fixed parameter of a joint has the change 0. A fixed parameter of base or tool has its start value.
        """
        return self._parameter_changes(self.full_fit)

    def _parameter_changes(self, fit: Fit | None) -> FloatArray:
        return (
            np.zeros(len(self.parameters))
            if fit is None
            else fit.parameter_values - self.model.chain.initial_values
        )

    @cached_property
    def writable(self) -> frozenset[int]:
        """Indices of the parameters that the file can store.

        A URDF cannot store base, tool and gains.
        """
        is_table = isinstance(self.model.source, DHTable)
        pairs = enumerate(self.parameters)
        return frozenset(k for k, p in pairs if p.name != "gain" and (is_table or not p.is_base_or_tool))

    @property
    def written_parameters(self) -> tuple[int, ...]:
        return tuple(k for k in self.selected_parameters if k in self.writable)

    @cached_property
    def written_changes(self) -> FloatArray:
        """(p,) changes of all parameters by `written_fit`, m and rad. The file stores the `writable` ones."""
        return self._parameter_changes(self.written_fit)

    @cached_property
    def standard_deviations(self) -> FloatArray:
        """(p,) standard deviations, m and rad; 0 for fixed parameters."""
        deviations = np.zeros(len(self.parameters))
        if self.full_fit is not None:
            deviations[list(self.identification.free_parameters)] = np.sqrt(np.diag(self.full_fit.covariance))
        return deviations

    @property
    def origins(self) -> dict[str, FloatArray]:
        """The new origin (4, 4) of each changed joint, by joint name."""
        return {} if self.written_fit is None else self.model.origins(self.written_fit.parameter_values)

    @property
    def base(self) -> FloatArray | None:
        """(4, 4) pose of the base in the instrument's frame; None if not fitted."""
        return (
            None
            if self.written_fit is None
            else self.model.base_or_tool_pose("base", self.written_fit.parameter_values)
        )

    @property
    def tool(self) -> FloatArray | None:
        """(4, 4) pose of the target in the tip's frame; None if not fitted."""
        return (
            None
            if self.written_fit is None
            else self.model.base_or_tool_pose("tool", self.written_fit.parameter_values)
        )

    @property
    def table(self) -> DHTable | None:
        """The calibrated table; None for a URDF."""
        return None if self.written_fit is None else self.model.table(self.written_fit.parameter_values)

    @cached_property
    def updated_urdf(self) -> UpdatedURDF:
        """The original URDF with the new origins."""
        return UpdatedURDF(self.robot, self.origins)


class ImplausibleError(InputError):
    """The measured data or the model contain a gross mistake.

    Attributes:
        calibration: The refused calibration.
    """

    def __init__(self, calibration: Calibration, remedy: str | None) -> None:
        """Without `remedy`, the message does not state that the calibration was refused."""
        model, plausibility = calibration.model, calibration.plausibility
        reason = f"likeliest reason: {plausibility.reason}" if plausibility.reason else _UNKNOWN_REASON
        super().__init__(
            "the calibration is not plausible" + (" and was refused" if remedy else ""),
            where=f"{calibration.robot.name}, {model.base} to {model.tip}",
            found="; ".join(plausibility.objections),
            remedy=f"{reason}; {remedy}" if remedy else reason,
        )
        self.calibration = calibration


def calibrate(
    source: Robot | Source | DHTable,
    q: ArrayLike | None = None,
    poses: ArrayLike | None = None,
    *,
    tip: str | None = None,
    base: str | None = None,
    fit: Collection[str] = ("origins",),
    noise: tuple[float, float] | None = None,
    drop_outliers: bool = False,
    full_poses: bool = True,
    radians: bool = False,
    force: bool = False,
    write_all: bool = False,
) -> Calibration:
    """Fit the parameters of a robot or a table to measured poses.

    Pinocchio checks the tip's poses of the written model:

        written model    configurations of the check
        URDF             measured configurations
        table            q = 0

    Args:
        source: A robot, a source for `load`, or a Denavit-Hartenberg table.
        q: (s, nq) configurations, rad and m; for a table (s, coordinates). Without q and poses, the result
            only states which parameters could be identified.
        poses: (s, 4, 4) poses of the tip in the base, or only the positions (s, 3), m. If `fit` contains
            "base", the poses are in the instrument's frame. If `fit` contains "tool", the poses are those of
            the target.
        tip: Name of a link or joint (default: the robot's tip). Must be None for a table.
        base: Name of a link or joint (default: the robot's base frame). Must be None for a table.
        fit: Names of the sets of parameters to fit. "base": the pose of the base in the instrument's frame.
            "tool": the pose of the target on the tip. "offsets": the zero positions of the joints. "gains":
            the scale factors of the joint values. "origins": six numbers of each joint origin. For a table,
            "origins" means the cells of the table. A row has the cell beta only if the next axis is nearly
            parallel or beta is not 0.
        noise: Standard deviations of the measurements: of a position coordinate (m) and of a rotation about
            an axis (rad). By default, the noise is estimated from the residuals.
        drop_outliers: Whether to exclude outlier poses from the fit; outliers are always reported.
        full_poses: Whether you will measure full poses, not only positions. The argument has no effect if
            `poses` is given.
        radians: True if joint angles of more than one turn are in radians.
        force: Whether to return a fit that is not plausible; `plausibility` then contains the reasons.
            Joint values that look like degrees are refused even with `force`. Convert degrees to radians, or
            pass `radians=True` if the values are in radians.
        write_all: Whether to also write changes of less than two standard deviations.

    Raises:
        InputError: an array has a wrong shape, a number is not finite, there are no poses, or the positions
            are not in metres. Also raised if only one of `q` and `poses` is given, and if `tip` or `base` is
            given for a table.
        ImplausibleError: the fit is not plausible; the message names the likeliest reason.
        UnknownNameError: a frame or a set of parameters does not exist.
        UrdfError, SourceError: as for `load`.
        VerificationError: for the written model, the results of urdfkin and Pinocchio differ.
        UrdfkinError: the tip's poses of the written URDF differ from the fit.

    Example:
        >>> import urdfkin
        >>> calibration = urdfkin.calibrate("ur5", fit=["base", "tool", "origins"], tip="tool0")
        >>> calibration.identification.rank, len(calibration.parameters)
        (30, 54)
    """
    calibration = fit_model(
        source,
        q,
        poses,
        tip=tip,
        base=base,
        fit=fit,
        noise=noise,
        drop_outliers=drop_outliers,
        full_poses=full_poses,
        radians=as_bool(radians, "radians"),
        write_all=as_bool(write_all, "write_all"),
    )
    force = as_bool(force, "force")
    if calibration.plausibility.is_in_degrees:
        raise ImplausibleError(calibration, "if these values are radians, pass radians=True")
    if calibration.plausibility.objections and not force:
        raise ImplausibleError(calibration, "to return this fit anyway, pass force=True")
    return calibration


def fit_model(
    source: Robot | Source | DHTable,
    q: ArrayLike | None,
    poses: ArrayLike | None,
    *,
    tip: str | None,
    base: str | None,
    fit: Collection[str] = ("origins",),
    noise: tuple[float, float] | None = None,
    drop_outliers: bool = False,
    full_poses: bool = True,
    radians: bool = False,
    write_all: bool = True,
    check: bool = True,
) -> Calibration:
    """Return the calibration of a model, even if the fit is not plausible.

    `calibrate` describes the arguments. Without `check`, `plausibility` is empty.
    """
    robot = as_robot(source)
    names = tuple(as_str(name, "each of fit") for name in as_names(fit, "fit"))
    if isinstance(source, DHTable):
        if tip is not None or base is not None:
            raise InputError(
                "a table is fitted from its base to its tip",
                where="tip" if tip is not None else "base",
                found=safe_repr(tip if tip is not None else base),
                remedy="leave out the tip and the base, or remove rows from the table",
            )
        model = make_table_model(source, names)
    else:
        tip, base = as_choice(tip, robot.tip_frame, "tip"), as_choice(base, robot.base_frame, "base")
        model = make_urdf_model(robot.tree, tip, base, names)
    drop_outliers, full_poses = as_bool(drop_outliers, "drop_outliers"), as_bool(full_poses, "full_poses")
    if (q is None) != (poses is None):
        raise InputError("`q` and `poses` must be given together", found="only one of the two")
    general = _path_joint_values(model, robot, robot.sample(_GENERAL_CONFIGURATIONS))
    if q is None or poses is None:
        identifiable = identify(
            model, general, full_poses=full_poses, parameter_values=_values_with_assumed_target(model)
        )
        return Calibration(robot, model, identifiable, identifiable)
    if not isinstance(source, DHTable):
        q = np.atleast_2d(parse_finite(robot.tree, q, "q", warn=False))
    path_q, measurements = _check_measured(robot, model, q, poses)
    data, calibration = _fit(robot, model, path_q, measurements, noise, drop_outliers, write_all=write_all)
    # At the fitted values, noise can make more parameters identifiable, for example a tip beside an axis.
    for fitted in (data.base_tool_fit, data.full_fit):
        identifiable = identify(
            model, general, full_poses=measurements.full_poses, parameter_values=fitted.parameter_values
        )
        if identifiable.rank >= data.identification.rank:
            break
    calibration = replace(calibration, general_identification=identifiable)
    if check:
        calibration = replace(calibration, plausibility=check_plausibility(data, radians=radians))
    return replace(calibration, certificate=_verify_written(calibration, measurements, q))


def _values_with_assumed_target(model: CalibrationModel) -> FloatArray:
    """Return the original parameters (p,); if the tool is fitted, the target has its assumed position."""
    parameter_values = model.chain.initial_values.copy()
    for k, parameter in enumerate(model.chain.parameters):
        if parameter.is_base_or_tool and parameter.element == "tool" and parameter.unit == "m":
            parameter_values[k] = model.chain.characteristic_length / _ASSUMED_TARGET_DIVISORS[parameter.name]
    return parameter_values


def _path_joint_values(model: CalibrationModel, robot: Robot, q: FloatArray) -> FloatArray:
    return model.coupling.values(model.coupling.select(robot.tree, q))


def _check_measured(
    robot: Robot, model: CalibrationModel, q: ArrayLike, poses: ArrayLike
) -> tuple[FloatArray, Measurements]:
    """Return (samples, n) values of the path's independent joints, and the measured poses."""
    T = as_pose_array(poses)
    if isinstance(model.source, DHTable):
        path_q = as_finite(model.coupling.parse(q, "q"), "q")
    else:
        path_q = model.coupling.select(robot.tree, q)
    values = model.coupling.values(path_q)
    if len(values) != len(T) or values.ndim != 2:
        raise InputError(
            "the number of poses and the number of configurations differ",
            found=f"{len(T)} poses, q of shape {np.shape(q)}",
        )
    if not len(T):
        raise InputError("no poses", remedy="give poses; a fit needs more measured numbers than parameters")
    measurements = Measurements(values, T[:, :3, 3], T[:, :3, :3]) if T.ndim == 3 else Measurements(values, T)
    check_metres(model, measurements)
    return path_q, measurements


def _fit(
    robot: Robot,
    model: CalibrationModel,
    q: FloatArray,
    measurements: Measurements,
    noise: tuple[float, float] | None,
    drop_outliers: bool,
    *,
    write_all: bool,
) -> tuple[FitWithData, Calibration]:
    stated = None if noise is None else _parse_noise(noise)
    identification, before, full_fit = _fit_identifiable(model, measurements, stated)

    def identify_again(rest: Measurements) -> tuple[Sequence[int], Fit]:
        found, _, fit = _fit_identifiable(model, rest, stated)
        return found.free_parameters, fit

    odd, clean = reject_outliers(
        model, measurements, identification.free_parameters, stated, full_fit, identify_again
    )
    if drop_outliers and odd:
        chosen = np.ones(len(measurements), dtype=bool)
        chosen[list(odd)] = False
        q, measurements = q[chosen], measurements.select(chosen)
        # An outlier can make parameters seem identifiable that the other poses do not identify.
        identification, before, full_fit = _fit_identifiable(model, measurements, stated)
        clean = full_fit
    fit = FitWithData(model, q, measurements, identification, before, full_fit)
    chosen_parameters, written = identification.free_parameters, full_fit
    if not write_all:
        chosen_parameters, written = _refit_significant(fit, stated)
    return fit, Calibration(
        robot,
        model,
        identification,
        identification,
        full_fit,
        before,
        odd,
        clean if odd else None,
        _find_poorly_observable(
            robot, model, measurements, identification.free_parameters, full_fit.parameter_values
        ),
        is_noise_stated=noise is not None,
        written_fit=written,
        selected_parameters=chosen_parameters,
    )


def _fit_identifiable(
    model: CalibrationModel, measurements: Measurements, stated: Noise | None
) -> tuple[Identification, Fit, Fit]:
    """Return the identifiable parameters, a fit of base and tool alone, and a fit of all these parameters."""
    start = estimate_start_values(model, measurements)
    identification = identify(
        model, measurements.joint_values, full_poses=measurements.full_poses, parameter_values=start
    )
    ends = [k for k in identification.free_parameters if model.chain.parameters[k].is_base_or_tool]
    before = fit_parameters(model, measurements, ends, stated, start)
    full_fit = fit_parameters(
        model, measurements, identification.free_parameters, stated, before.parameter_values
    )
    identification, full_fit = _add_identifiable(model, measurements, identification, stated, full_fit)
    return identification, before, full_fit


def _refit_significant(fit: FitWithData, stated: Noise | None) -> tuple[tuple[int, ...], Fit]:
    model, kept, full_fit = fit.model, fit.identification.free_parameters, fit.full_fit
    is_end = [model.chain.parameters[k].is_base_or_tool for k in kept]
    change = full_fit.parameter_values[list(kept)] - model.chain.initial_values[list(kept)]
    chosen = tuple(
        np.array(kept, dtype=int)[select_significant(change, full_fit.covariance, is_end)].tolist()
    )
    if chosen == kept:
        return kept, full_fit
    parameter_values = full_fit.parameter_values.copy()
    out = [k for k in kept if k not in chosen]
    parameter_values[out] = model.chain.initial_values[out]
    return chosen, fit_parameters(model, fit.measurements, chosen, stated, parameter_values)


def _add_identifiable(
    model: CalibrationModel,
    measurements: Measurements,
    identification: Identification,
    stated: Noise | None,
    full_fit: Fit,
) -> tuple[Identification, Fit]:
    """Add parameters that are identifiable at the fitted values and significantly reduce the residuals.

    At the original values, fewer parameters can be identifiable, for example if the tip lies on the last
    joint's axis.
    """
    again = identify(
        model,
        measurements.joint_values,
        full_poses=measurements.full_poses,
        parameter_values=full_fit.parameter_values,
    )
    more = again.rank - identification.rank
    if more <= 0:
        return identification, full_fit
    trial = fit_parameters(model, measurements, again.free_parameters, stated, full_fit.parameter_values)
    scale = trial.noise.deviations(measurements.full_poses)
    explained = float(((full_fit.residuals / scale) ** 2).sum() - ((trial.residuals / scale) ** 2).sum())
    return (
        (again, trial) if explained > chi2_quantile(1.0 - FALSE_ALARM, more) else (identification, full_fit)
    )


def _parse_noise(noise: tuple[float, float]) -> Noise:
    if not isinstance(noise, tuple | list) or len(noise) != 2:
        raise InputError("`noise` must be two numbers, in metres and radians", found=safe_repr(noise))
    metres, radians = (as_finite_float(one, "noise") for one in noise)
    if min(metres, radians) <= 0.0:
        raise InputError(
            "`noise` must be positive",
            found=str(noise),
            remedy="omit `noise` to estimate it from the residuals",
        )
    return Noise(metres, radians)


def _find_poorly_observable(
    robot: Robot,
    model: CalibrationModel,
    measurements: Measurements,
    kept: Sequence[int],
    parameter_values: FloatArray,
) -> dict[int, float]:
    general = _path_joint_values(model, robot, robot.sample(len(measurements), seed=_RANDOM_SEED))
    uncertainties = []
    for values in (measurements.joint_values, general):
        J = stack_jacobian(
            model, values, full_poses=measurements.full_poses, parameter_values=parameter_values
        )[:, list(kept)]
        _, R = np.linalg.qr(J)
        if (np.abs(np.diag(R)) <= _RANK_TOLERANCE * np.abs(R).max(initial=0.0)).any() or len(R) < len(kept):
            return {}
        uncertainties.append(np.linalg.norm(np.linalg.solve(R, np.eye(len(R))), axis=1))
    ratios = uncertainties[0] / uncertainties[1]
    return {k: float(ratio) for k, ratio in zip(kept, ratios, strict=True) if ratio > _MAX_UNCERTAINTY_RATIO}


def _verify_written(calibration: Calibration, measurements: Measurements, q: ArrayLike) -> Certificate | None:
    """Check the written model with base, tool and gains set to 0, because a file cannot contain them."""
    model, fitted = calibration.model, calibration.written_fit
    if fitted is None:
        return None
    parameter_values = fitted.parameter_values.copy()
    parameter_values[[p.is_base_or_tool or p.name == "gain" for p in calibration.parameters]] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # The first `load` has already given the warnings.
        if (table := calibration.table) is not None:
            robot = load(table)
            robot.placement(robot.neutral(), robot.tip_frame)
            return robot.certificate()
        T = calibration.updated_urdf.new_robot.placement(q, [model.base, model.tip])
    theirs = np.linalg.solve(T[:, 0], T[:, 1])
    error = np.abs(theirs - model.chain.poses(measurements.joint_values, parameter_values))
    bound = _ROUNDING_FACTOR * model.chain.rounding_bound(measurements.joint_values)
    if error[:, :3, 3].max() > bound or error[:, :3, :3].max() > bound / model.chain.characteristic_length:
        raise UrdfkinError(
            "the written URDF disagrees with the fit",
            where=f"{calibration.robot.name}, {model.base} to {model.tip}",
            found=(
                f"a difference of {error.max():.3g} m or rad; the rounding error is at most {bound:.3g} m and"
                f" {bound / model.chain.characteristic_length:.3g} rad"
            ),
            remedy="please report this as an error of urdfkin, with the robot and the poses",
        )
    return calibration.updated_urdf.new_robot.certificate()


def list_warnings(calibration: Calibration) -> list[str]:
    return list(_warnings(calibration))


def _warnings(calibration: Calibration) -> Iterator[str]:
    fitted, name = calibration.full_fit, [str(parameter) for parameter in calibration.parameters]
    if fitted is None:
        return
    general, identification = calibration.general_identification, calibration.identification
    lost = general.rank - identification.rank
    if lost > 0:
        others = [k for k in general.free_parameters if k not in identification.free_parameters]
        yield (
            f"{identification.rank} parameters are identifiable from these poses; {lost} more would be "
            f"identifiable from more varied poses: {join_names((name[k] for k in others), _MAX_NAMES)}"
        )
    if calibration.poorly_observable:
        worst = sorted(calibration.poorly_observable.items(), key=lambda one: -one[1])
        yield (
            "poorly observable: "
            + join_names((f"{name[k]} ({x:.0f} times the usual uncertainty)" for k, x in worst), _MAX_NAMES)
            + "; the usual uncertainty is computed for the same number of random configurations"
        )
    if not fitted.has_redundancy:
        yield "the fit cannot be checked, because there are as many parameters as measured numbers"
    elif fitted.total_redundancy < len(calibration.identification.free_parameters):
        yield (
            f"there are only {fitted.total_redundancy:.0f} redundant measured numbers for "
            f"{len(calibration.identification.free_parameters)} parameters"
        )
    if (
        calibration.is_noise_stated
        and abs(fitted.noise_ratio - 1.0) > _NOISE_RATIO_SIGMAS * fitted.noise_ratio_deviation
    ):
        yield (
            f"the residuals are {fitted.noise_ratio:.3g} times the stated noise: "
            "the true noise differs, or the model is too simple"
        )
    if calibration.outliers and calibration.fit_without_outliers is not None:
        one = len(calibration.outliers) == 1
        poses = f"pose{'' if one else 's'} {join_names(map(str, calibration.outliers), _MAX_NAMES)} "
        if len(fitted.residuals) == len(calibration.fit_without_outliers.residuals):
            yield poses + f"{'is' if one else 'are'} excluded as {'an outlier' if one else 'outliers'}"
        else:
            ours, theirs = (length(each.rms()[0]) for each in (fitted, calibration.fit_without_outliers))
            yield (
                poses + f"{'is an outlier' if one else 'are outliers'}: the rms error is {theirs} without "
                f"{'it' if one else 'them'}, {ours} with {'it' if one else 'them'}"
            )
    gains = [
        k for k in calibration.identification.free_parameters if calibration.parameters[k].name == "gain"
    ]
    if gains:
        yield (
            "these gains are not written, because neither a URDF nor a table can store them: "
            + join_names((name[k] for k in gains), _MAX_NAMES)
        )


#: Largest accepted error of a rotation matrix, of a pose's last row, or of the length of a quaternion. The
#: tolerance is large, because numbers in files are rounded.
_ROTATION_TOLERANCE = 1e-3
_POSITION_COLUMNS, _QUATERNION_COLUMNS = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
_MATRIX_COLUMNS = tuple(f"T{i}{j}" for i in range(3) for j in range(4))
_LAST_ROW_COLUMNS = tuple(f"T3{j}" for j in range(4))
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
METRES_PER_UNIT = {"m": 1.0, "mm": 1e-3}


def read_poses(
    path: Path,
    coordinates: Sequence[str],
    required_coordinates: Sequence[str],
    unit: str = "m",
    units: Mapping[str, str] | None = None,
    default_q: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Read configurations (s, nq), and poses (s, 4, 4) or positions (s, 3), m.

    A CSV file must contain `required_coordinates`. `default_q` (nq,) contains the values of coordinates
    without a column.
    """
    if path.suffix.lower() == ".npz":
        q, T = _read_npz_poses(path, len(coordinates))
    else:
        default_q = np.zeros(len(coordinates)) if default_q is None else default_q
        q, T = _read_csv_poses(path, coordinates, required_coordinates, units or {}, default_q)
    T = T.copy()
    positions = T if T.ndim == 2 else T[:, :3, 3]
    positions *= METRES_PER_UNIT[unit]
    return q, T


def _read_csv_poses(
    path: Path,
    coordinates: Sequence[str],
    required_coordinates: Sequence[str],
    units: Mapping[str, str],
    default_q: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    text, where = read_text(path, MAX_DATA_BYTES, pipes=True), str(path)
    kind = _MATRIX_COLUMNS if "T00" in first_cells(text, where) else _POSITION_COLUMNS
    pose_rest = _QUATERNION_COLUMNS if kind is _POSITION_COLUMNS else _LAST_ROW_COLUMNS
    if ambiguous := [name for name in required_coordinates if name in (*kind, *pose_rest)]:
        raise InputError(
            "a coordinate and a column of the measured poses have the same name",
            where=where,
            found=", ".join(ambiguous),
            remedy=(
                "give the poses as the columns T00 to T23, or give an .npz file"
                if kind is _POSITION_COLUMNS
                else "give an .npz file"
            ),
        )
    others = [name for name in coordinates if name not in required_coordinates]
    optional = [*others, "sample", "t", *pose_rest]
    required = [*required_coordinates, *kind]
    data = read_columns(text, where, "measured poses", required, optional, requires_header=True, units=units)
    s = len(data[kind[0]])
    values = [data.get(name, np.full(s, x)) for name, x in zip(coordinates, default_q, strict=True)]
    q = np.stack(values, axis=-1) if values else np.empty((s, 0))
    part = [name for name in _QUATERNION_COLUMNS if name in data and kind is _POSITION_COLUMNS]
    if 0 < len(part) < len(_QUATERNION_COLUMNS):
        missing = ", ".join(name for name in _QUATERNION_COLUMNS if name not in part)
        raise InputError(
            "a quaternion needs four columns: qx, qy, qz, qw", where=where, found=f"no {missing}"
        )
    if kind is _MATRIX_COLUMNS:
        last_row = zip(_LAST_ROW_COLUMNS, _LAST_ROW, strict=True)
        cells = [data[name] for name in _MATRIX_COLUMNS]
        cells += [data.get(name, np.full(s, x)) for name, x in last_row]
        return q, _with_exact_rotations(np.stack(cells, axis=-1).reshape(s, 4, 4), where)
    p = np.stack([data[name] for name in _POSITION_COLUMNS], axis=-1)
    return q, p if not part else _with_quaternions(
        p, np.stack([data[n] for n in _QUATERNION_COLUMNS], axis=-1), where
    )


def _read_npz_poses(path: Path, nq: int) -> tuple[FloatArray, FloatArray]:
    data = read_arrays(path, {"q": (nq,), "T": (4, 4), "p": (3,), "quat": (4,)}, ["q"])
    if ("T" in data) == ("p" in data) or ("quat" in data and "p" not in data):
        found = ", ".join(data)
        raise InputError(
            "a file of measured poses must contain the arrays (q, T), (q, p) or (q, p, quat)",
            where=str(path),
            found=found,
        )
    if "T" in data:
        return data["q"], _with_exact_rotations(data["T"], str(path))
    return data["q"], data["p"] if "quat" not in data else _with_quaternions(
        data["p"], data["quat"], str(path)
    )


def _with_quaternions(p: FloatArray, quat: FloatArray, where: str) -> FloatArray:
    lengths = np.linalg.norm(quat, axis=-1, keepdims=True)
    errors = np.abs(lengths - 1.0)
    if errors.max(initial=0.0) > _ROTATION_TOLERANCE:
        worst = int(errors.argmax())
        raise InputError(
            "an orientation must be a quaternion of length 1, scalar last",
            where=f"{where}, pose {worst}",
            found=f"length {float(lengths[worst, 0]):.6g}",
        )
    T = np.broadcast_to(np.eye(4), (len(p), 4, 4)).copy()
    T[:, :3, :3], T[:, :3, 3] = rotation_from_quaternion(quat / lengths), p
    return T


def _with_exact_rotations(T: FloatArray, where: str) -> FloatArray:
    R = T[:, :3, :3]
    wrong = rotation_defect(R) > _ROTATION_TOLERANCE
    wrong |= (np.abs(T[:, 3] - _LAST_ROW) > _ROTATION_TOLERANCE).any(axis=-1)
    if wrong.any():
        raise InputError(
            "a pose must be a rotation and a translation, with the last row 0 0 0 1",
            where=f"{where}, pose {int(wrong.argmax())}",
            found=str(T[wrong.argmax()].tolist()),
        )
    exact = T.copy()
    exact[:, :3, :3], exact[:, 3] = polar_factor(R), _LAST_ROW
    return exact


def as_pose_array(poses: ArrayLike) -> FloatArray:
    """Return checked poses (s, 4, 4) or positions (s, 3)."""
    array = as_finite(poses, "poses")
    if array.ndim == 2 and array.shape[1] == 3:
        return array
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        return _with_exact_rotations(array, "poses")
    raise InputError(
        "`poses` must have the shape (n, 4, 4), or (n, 3) for positions", found=f"shape {array.shape}"
    )
