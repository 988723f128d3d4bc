"""Calibrate a robot: fit its parameters to measured poses, and report uncertainties and warnings.

A fit that is not plausible (`plausible.py`) is refused. Otherwise the parameters that changed by more than
two standard deviations are fitted again and written. The other parameters keep their original values.

`read_poses` reads measured poses. A CSV file has a column for each coordinate, with the coordinate's name.
The columns x, y, z contain the position. The optional columns qx, qy, qz, qw contain the orientation. The
columns T00 to T23, or T00 to T33, can contain the pose matrix instead of position and orientation. The
command `urdfkin placement --format csv` writes such matrices. An .npz file contains q (n, nq) and the poses:
either T (n, 4, 4), or p (n, 3) with an optional quat (n, 4), scalar last.
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
    Measured,
    Noise,
    best_fit,
    demand_metres,
    first_names,
    identify,
    outliers,
    quantile,
    significant,
    stacked,
    start_values,
)
from urdfkin.calibration.parameters import CalibrationModel, Parameter, table_model, urdf_model
from urdfkin.calibration.plausible import FitWithData, Plausibility, check_plausibility
from urdfkin.calibration.write_back import Rewritten
from urdfkin.comparison.result import length
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_choice, as_names, as_str, real_number, safe_repr
from urdfkin.kinematics.inputs import as_finite, rotation_defect
from urdfkin.kinematics.rotation import polar_factor, rotation_from_quaternion
from urdfkin.model.configuration import parse_finite
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.loading import as_robot, load
from urdfkin.robot.trajectory import read_arrays, read_columns
from urdfkin.system.files import MOST_DATA, read_text
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: Number of random configurations for `Calibration.general`.
_GENERAL = 40
#: A warning is given if the residuals differ from the stated noise by more standard deviations than this.
_UNLIKELY = 4.0
#: Ratio of uncertainties (`Calibration.weak`) above which a parameter is poorly observable.
_WEAK = 10.0
_WEAK_SEED = 1
#: A Jacobian J = Q R counts as rank-deficient if an |R_ii| is at most this fraction of the largest |R_ij|.
_DEPENDENT = 1e-12
#: The coordinates of a target are the robot's size divided by these numbers.
#: Such a target lies on no joint axis.
_TARGET_DIVISORS = {"x": 5.0, "y": 6.0, "z": 7.0}
#: Factor of `ParametricChain.rounding` for the comparison with Pinocchio.
#: Pinocchio rounds more often, because it reads the written file and computes base and tip separately.
_READ_BACK = 4.0
#: Maximum number of parameters or poses that a warning names.
_NAMED = 6
_NO_REASON = (
    "the reason is unknown: degrees, shifted rows of q or reversed signs of joints do not explain the error"
)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated model; the result of `urdfkin.calibrate`.

    Attributes:
        robot: The robot before the calibration.
        model: The model with the parameters to fit.
        identification: The parameters that are identifiable from the measured poses.
        general: The parameters that are identifiable from random poses.
        fitted: The fit; None without poses.
        before: The fit of only base and tool, with the robot's original parameters.
        odd: Indices of the outlier poses.
        without_odd: The fit without the outliers.
        weak: Indices of poorly observable parameters, each with a ratio of two uncertainties. The first is
            the uncertainty at the measured configurations. It is divided by the uncertainty at the same
            number of random configurations.
        certificate: The result of checking the written model with Pinocchio.
        stated: Whether the user stated the noise.
        written_fit: The fit of the written parameters; the other parameters have their original values.
        significant: Indices of the parameters that `written_fit` fits.
        plausibility: The reasons why the fit is refused; empty for a plausible fit.
    """

    robot: Robot
    model: CalibrationModel
    identification: Identification
    general: Identification
    fitted: Fit | None = None
    before: Fit | None = None
    odd: tuple[int, ...] = ()
    without_odd: Fit | None = None
    weak: dict[int, float] | None = None
    certificate: Certificate | None = None
    stated: bool = False
    written_fit: Fit | None = None
    significant: tuple[int, ...] = ()
    plausibility: Plausibility = field(default_factory=Plausibility)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.model.chain.parameters

    @cached_property
    def values(self) -> FloatArray:
        """(p,) change of each parameter, m and rad; 0 for fixed parameters."""
        return self._change(self.fitted)

    def _change(self, fit: Fit | None) -> FloatArray:
        return np.zeros(len(self.parameters)) if fit is None else fit.at - self.model.chain.start

    @cached_property
    def writable(self) -> frozenset[int]:
        """Indices of the parameters that the file can store; a URDF cannot store base, tool and gains."""
        is_table = isinstance(self.model.source, DHTable)
        pairs = enumerate(self.parameters)
        return frozenset(k for k, p in pairs if p.what != "gain" and (is_table or not p.end))

    @property
    def written_parameters(self) -> tuple[int, ...]:
        return tuple(k for k in self.significant if k in self.writable)

    @cached_property
    def written_values(self) -> FloatArray:
        """(p,) change of each parameter in the written fit, m and rad."""
        return self._change(self.written_fit)

    @cached_property
    def deviations(self) -> FloatArray:
        """(p,) standard deviations, m and rad; 0 for fixed parameters."""
        deviations = np.zeros(len(self.parameters))
        if self.fitted is not None:
            deviations[list(self.identification.kept)] = np.sqrt(np.diag(self.fitted.covariance))
        return deviations

    @property
    def origins(self) -> dict[str, FloatArray]:
        """The new origin (4, 4) of each joint whose origin moved, by joint name."""
        return {} if self.written_fit is None else self.model.origins(self.written_fit.at)

    @property
    def base(self) -> FloatArray | None:
        """(4, 4) pose of the robot's base in the instrument's frame; None if it was not fitted."""
        return None if self.written_fit is None else self.model.end("base", self.written_fit.at)

    @property
    def tool(self) -> FloatArray | None:
        """(4, 4) pose of the target in the tip's frame; None if it was not fitted."""
        return None if self.written_fit is None else self.model.end("tool", self.written_fit.at)

    @property
    def table(self) -> DHTable | None:
        """The calibrated table; None for a URDF."""
        return None if self.written_fit is None else self.model.table(self.written_fit.at)

    @cached_property
    def written(self) -> Rewritten:
        """The original text of the URDF with the new origins, and the effect of the changes."""
        return Rewritten(self.robot, self.origins)


class ImplausibleError(InputError):
    """The measured data or the model contain a gross mistake; `calibration` is the refused calibration."""

    def __init__(self, calibration: Calibration, remedy: str) -> None:
        model, plausibility = calibration.model, calibration.plausibility
        reason = f"likeliest reason: {plausibility.reason}" if plausibility.reason else _NO_REASON
        super().__init__(
            "the calibration is not plausible and was refused",
            where=f"{calibration.robot.name}, {model.base} to {model.tip}",
            found="; ".join(plausibility.objections),
            remedy=f"{reason}; {remedy}",
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
    drop_odd: bool = False,
    complete: bool = True,
    radians: bool = False,
    force: bool = False,
    every: bool = False,
) -> Calibration:
    """Fit the parameters of a robot or a table to measured poses.

    Afterwards urdfkin loads the written model, and compares the tip's poses with the poses that Pinocchio
    computes. A URDF is compared at the measured configurations, and a table at q = 0.

    Args:
        source: A robot, a source for `load`, or a Denavit-Hartenberg table.
        q: (s, nq) configurations, rad and m; for a table (s, coordinates). None: only report which parameters
            could be identified.
        poses: (s, 4, 4) poses of the tip in the base, or only the positions (s, 3), m.
        tip: Name of a link or joint; the robot's tip when None.
        base: Name of a link or joint; the robot's base frame when None.
        fit: Names of the sets of parameters to fit. "base": the pose of the robot's base in the instrument's
            frame. "tool": the pose of the target on the tip. "offsets": the zero positions of the joints.
            "origins": six numbers of each joint origin, or all cells of a table. "gains": the scale factors
            of the joint values.
        noise: Standard deviations of the measurements, for a position coordinate (m) and for a rotation about
            an axis (rad). None: the noise is estimated from the residuals.
        drop_odd: Whether to exclude outlier poses from the fit; outliers are always reported.
        complete: Whether you will measure full poses, and not only positions. This argument is used only if
            `poses` is None.
        radians: Whether joint angles of more than one turn are in radians, although they look like degrees.
        force: Whether to return a fit even if it is not plausible; `plausibility` then contains the reasons.
            Joint values that look like degrees are refused in any case, unless `radians` is True.
        every: Whether to write all fitted parameters, including parameters that changed by less than two
            standard deviations.

    Raises:
        InputError: an array has a wrong shape, there are too few poses, or the positions are not in metres.
        ImplausibleError: the fit is not plausible; the message names the likeliest reason.
        UnknownNameError: a frame or a set of parameters does not exist.
        UrdfError, SourceError: as for `load`.
        VerificationError: for the written model, the results of urdfkin and Pinocchio differ.

    Example:
        >>> import urdfkin
        >>> found = urdfkin.calibrate("ur5", fit=["base", "tool", "origins"], tip="tool0")
        >>> found.identification.rank, len(found.parameters)
        (30, 54)
    """
    found = fitted_model(
        source,
        q,
        poses,
        tip=tip,
        base=base,
        fit=fit,
        noise=noise,
        drop_odd=drop_odd,
        complete=complete,
        radians=as_bool(radians, "radians"),
        every=as_bool(every, "every"),
    )
    force = as_bool(force, "force")
    if found.plausibility.is_in_degrees:
        raise ImplausibleError(found, "if these values are radians, pass radians=True")
    if found.plausibility.objections and not force:
        raise ImplausibleError(found, "to return this fit anyway, pass force=True")
    return found


def fitted_model(
    source: Robot | Source | DHTable,
    q: ArrayLike | None,
    poses: ArrayLike | None,
    *,
    tip: str | None,
    base: str | None,
    fit: Collection[str] = ("origins",),
    noise: tuple[float, float] | None = None,
    drop_odd: bool = False,
    complete: bool = True,
    radians: bool = False,
    every: bool = True,
    check: bool = True,
) -> Calibration:
    """Fit as `calibrate` does, but also return implausible fits."""
    robot = as_robot(source)
    names = tuple(as_str(name, "each of fit") for name in as_names(fit, "fit"))
    model = (
        table_model(source, names)
        if isinstance(source, DHTable)
        else urdf_model(
            robot.tree,
            as_choice(tip, robot.tip_frame, "tip"),
            as_choice(base, robot.base_frame, "base"),
            names,
        )
    )
    drop_odd, complete = as_bool(drop_odd, "drop_odd"), as_bool(complete, "complete")
    if (q is None) != (poses is None):
        raise InputError("`q` and `poses` must be given together", found="only one of the two")
    general = _values(model, robot, robot.sample(_GENERAL))
    if q is None or poses is None:
        identifiable = identify(model, general, complete=complete, at=_general_target(model))
        return Calibration(robot, model, identifiable, identifiable)
    path_q, measured = _check_measured(robot, model, q, poses)
    data, found = _fit(robot, model, path_q, measured, noise, drop_odd, every=every)
    identifiable = identify(model, general, complete=measured.complete, at=data.fitted.at)
    found = replace(found, general=identifiable)
    if check:
        found = replace(found, plausibility=check_plausibility(data, radians=radians))
    return replace(
        found, certificate=_verify_written(found, measured, np.atleast_2d(np.asarray(q, dtype=np.float64)))
    )


def _general_target(model: CalibrationModel) -> FloatArray:
    """Return the parameters (p,) of the original model.

    If the tool is fitted, its target is moved to a position that lies on no joint axis.
    """
    at = model.chain.start.copy()
    for k, parameter in enumerate(model.chain.parameters):
        if parameter.end and parameter.where == "tool" and parameter.unit == "m":
            at[k] = model.chain.size / _TARGET_DIVISORS[parameter.what]
    return at


def _values(model: CalibrationModel, robot: Robot, q: FloatArray) -> FloatArray:
    return model.coupling.values(model.coupling.select(robot.tree, q))


def _check_measured(
    robot: Robot, model: CalibrationModel, q: ArrayLike, poses: ArrayLike
) -> tuple[FloatArray, Measured]:
    """Check the arguments; return the path's coordinates (samples, n) and the measured poses."""
    T = checked_poses(poses)
    if isinstance(model.source, DHTable):
        path_q = model.coupling.parse(q, "q")
    else:
        path_q = model.coupling.select(
            robot.tree, np.atleast_2d(parse_finite(robot.tree, q, "q", warn=False))
        )
    values = model.coupling.values(path_q)
    if len(values) != len(T) or values.ndim != 2:
        raise InputError(
            "the number of poses and the number of configurations differ",
            found=f"{len(T)} poses, q of shape {np.shape(q)}",
        )
    if not len(T):
        raise InputError("no poses", remedy="give poses; a fit needs more measured numbers than parameters")
    measured = Measured(values, T[:, :3, 3], T[:, :3, :3]) if T.ndim == 3 else Measured(values, T)
    demand_metres(model, measured)
    return path_q, measured


def _fit(
    robot: Robot,
    model: CalibrationModel,
    q: FloatArray,
    measured: Measured,
    noise: tuple[float, float] | None,
    drop_odd: bool,
    *,
    every: bool,
) -> tuple[FitWithData, Calibration]:
    stated, start = None if noise is None else _parse_noise(noise), start_values(model, measured)
    identification = identify(model, measured.values, complete=measured.complete, at=start)
    ends = [k for k in identification.kept if model.chain.parameters[k].end]
    before = best_fit(model, measured, ends, stated, start)
    found = best_fit(model, measured, identification.kept, stated, before.at)
    identification, found = _add_identifiable(model, measured, identification, stated, found)
    odd, clean = outliers(model, measured, identification.kept, stated, found)
    if drop_odd and odd:
        chosen = np.ones(len(measured), dtype=bool)
        chosen[list(odd)] = False
        q, measured, found = q[chosen], measured.some(chosen), clean
        before = best_fit(model, measured, ends, stated, before.at)
    fit = FitWithData(model, q, measured, identification, before, found)
    chosen_parameters, written = identification.kept, found
    if not every:
        chosen_parameters, written = _significant(fit, stated)
    return fit, Calibration(
        robot,
        model,
        identification,
        identification,
        found,
        before,
        odd,
        clean if odd else None,
        _weak(robot, model, measured, identification.kept, found.at),
        stated=noise is not None,
        written_fit=written,
        significant=chosen_parameters,
    )


def _significant(fit: FitWithData, stated: Noise | None) -> tuple[tuple[int, ...], Fit]:
    model, kept, found = fit.model, fit.identification.kept, fit.fitted
    is_end = [model.chain.parameters[k].end for k in kept]
    change = found.at[list(kept)] - model.chain.start[list(kept)]
    chosen = tuple(np.array(kept, dtype=int)[significant(change, found.covariance, is_end)].tolist())
    if chosen == kept:
        return kept, found
    at = found.at.copy()
    out = [k for k in kept if k not in chosen]
    at[out] = model.chain.start[out]
    return chosen, best_fit(model, fit.measured, chosen, stated, at)


def _add_identifiable(
    model: CalibrationModel,
    measured: Measured,
    identification: Identification,
    stated: Noise | None,
    found: Fit,
) -> tuple[Identification, Fit]:
    """Add parameters that are identifiable at the fitted values, if they significantly reduce the residuals.

    Fewer parameters are identifiable in special geometries, and the original model often has such a geometry.
    For example, if the tip lies on the last joint's axis, the tip's position does not depend on the last
    joint's angle.
    """
    again = identify(model, measured.values, complete=measured.complete, at=found.at)
    more = again.rank - identification.rank
    if more <= 0:
        return identification, found
    trial = best_fit(model, measured, again.kept, stated, found.at)
    scale = trial.noise.of(measured.complete)
    explained = float(((found.errors / scale) ** 2).sum() - ((trial.errors / scale) ** 2).sum())
    return (again, trial) if explained > quantile(1.0 - FALSE_ALARM, more) else (identification, found)


def _parse_noise(noise: tuple[float, float]) -> Noise:
    if not isinstance(noise, tuple | list) or len(noise) != 2:
        raise InputError("`noise` must be two numbers, in metres and radians", found=safe_repr(noise))
    metres, radians = (real_number(one, "noise") for one in noise)
    if min(metres, radians) <= 0.0:
        raise InputError(
            "`noise` must be positive",
            found=str(noise),
            remedy="omit `noise` to estimate it from the residuals",
        )
    return Noise(metres, radians)


def _weak(
    robot: Robot, model: CalibrationModel, measured: Measured, kept: Sequence[int], at: FloatArray
) -> dict[int, float]:
    general = _values(model, robot, robot.sample(len(measured), seed=_WEAK_SEED))
    uncertainties = []
    for values in (measured.values, general):
        J = stacked(model, values, complete=measured.complete, at=at)[:, list(kept)]
        _, R = np.linalg.qr(J)
        if (np.abs(np.diag(R)) <= _DEPENDENT * np.abs(R).max(initial=0.0)).any() or len(R) < len(kept):
            return {}
        uncertainties.append(np.linalg.norm(np.linalg.solve(R, np.eye(len(R))), axis=1))
    ratios = uncertainties[0] / uncertainties[1]
    return {k: float(ratio) for k, ratio in zip(kept, ratios, strict=True) if ratio > _WEAK}


def _verify_written(found: Calibration, measured: Measured, q: ArrayLike) -> Certificate | None:
    """Compare the written model with Pinocchio.

    A URDF is compared at the measured configurations, and a table at q = 0. A URDF cannot contain base, tool
    or gains, so these parameters are 0 in the comparison of a URDF.
    """
    model, fitted = found.model, found.written_fit
    if fitted is None:
        return None
    at = fitted.at.copy()
    at[[p.end or p.what == "gain" for p in found.parameters]] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # The first `load` gave these warnings.
        if (table := found.table) is not None:
            robot = load(table)
            robot.placement(robot.neutral(), robot.tip_frame)
            return robot.certificate()
        T = found.written.loaded.placement(q, [model.base, model.tip])
    theirs = np.linalg.solve(T[:, 0], T[:, 1])
    error = np.abs(theirs - model.chain.poses(measured.values, at))
    bound = _READ_BACK * model.chain.rounding(measured.values)
    if error[:, :3, 3].max() > bound or error[:, :3, :3].max() > bound / model.chain.size:
        raise UrdfkinError(
            "the written URDF disagrees with the fit",
            where=f"{found.robot.name}, {model.base} to {model.tip}",
            found=f"a difference of {error.max():.3g} m or rad, but rounding explains only {bound:.3g}",
            remedy="please report this as an error of urdfkin, with the robot and the poses",
        )
    return found.written.loaded.certificate()


def doubts(found: Calibration) -> list[str]:
    return list(_warnings(found))


def _warnings(found: Calibration) -> Iterator[str]:
    fitted, name = found.fitted, [str(parameter) for parameter in found.parameters]
    if fitted is None:
        return
    lost = found.general.rank - found.identification.rank
    if lost > 0:
        others = [k for k in found.general.kept if k not in found.identification.kept]
        yield (
            f"{found.identification.rank} parameters are identifiable from these poses; more varied poses "
            f"would identify {lost} more: {first_names((name[k] for k in others), _NAMED)}"
        )
    if found.weak:
        worst = sorted(found.weak.items(), key=lambda one: -one[1])
        yield (
            "poorly observable: "
            + first_names((f"{name[k]} ({x:.0f} times the usual uncertainty)" for k, x in worst), _NAMED)
            + "; the usual uncertainty is the uncertainty at the same number of random configurations"
        )
    if not fitted.is_judged:
        yield "the fit cannot be checked, because there are as many parameters as measured numbers"
    elif fitted.freedom < len(found.identification.kept):
        yield (
            f"there are only {fitted.freedom:.0f} redundant measured numbers for "
            f"{len(found.identification.kept)} parameters"
        )
    if found.stated and abs(fitted.ratio - 1.0) > _UNLIKELY * fitted.spread:
        yield (
            f"the residuals are {fitted.ratio:.3g} times the stated noise: "
            "the true noise differs, or the model is too simple"
        )
    if found.odd and found.without_odd is not None:
        one = len(found.odd) == 1
        poses = f"pose{'' if one else 's'} {first_names(map(str, found.odd), _NAMED)} "
        if len(fitted.errors) == len(found.without_odd.errors):
            yield poses + f"{'is' if one else 'are'} excluded as {'an outlier' if one else 'outliers'}"
        else:
            ours, theirs = (length(each.rms()[0]) for each in (fitted, found.without_odd))
            yield (
                poses + f"{'is an outlier' if one else 'are outliers'}: the rms error is {theirs} without "
                f"{'it' if one else 'them'}, {ours} with {'it' if one else 'them'}"
            )
    gains = [k for k in found.identification.kept if found.parameters[k].what == "gain"]
    if gains:
        yield (
            "these gains are not written, because a URDF cannot store them: "
            + first_names((name[k] for k in gains), _NAMED)
        )


#: Largest accepted error of a rotation matrix or of a quaternion's length; numbers in files are rounded.
_WRITTEN = 1e-3
_POSITION, _QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
_MATRIX = tuple(f"T{i}{j}" for i in range(3) for j in range(4))
_LAST_ROW = tuple(f"T3{j}" for j in range(4))
UNITS = {"m": 1.0, "mm": 1e-3}


def read_poses(
    path: Path,
    coordinates: Sequence[str],
    needed: Sequence[str],
    unit: str = "m",
    units: Mapping[str, str] | None = None,
    rest: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Read configurations (s, nq), and poses (s, 4, 4) or positions (s, 3) in metres, from a file.

    `needed` names the coordinates that a CSV file must contain. `rest` (nq,) contains the values of
    coordinates without a column.
    """
    if path.suffix.lower() == ".npz":
        q, T = _archive(path, len(coordinates))
    else:
        rest = np.zeros(len(coordinates)) if rest is None else rest
        q, T = _table(path, coordinates, needed, units or {}, rest)
    T = T.copy()
    positions = T if T.ndim == 2 else T[:, :3, 3]
    positions *= UNITS[unit]
    return q, T


def _table(
    path: Path,
    coordinates: Sequence[str],
    needed: Sequence[str],
    units: Mapping[str, str],
    rest: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    text, where = read_text(path, MOST_DATA, pipes=True), str(path)
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    names = {cell.strip() for cell in first.split(",")}
    kind = _MATRIX if "T00" in names else _POSITION
    others = [name for name in coordinates if name not in needed]
    optional = [*others, "sample", "t", *(_QUATERNION if kind is _POSITION else _LAST_ROW)]
    required = [*needed, *kind]
    data = read_columns(text, where, "measured poses", required, optional, named=True, units=units)
    s = len(data[kind[0]])
    values = [data.get(name, np.full(s, x)) for name, x in zip(coordinates, rest, strict=True)]
    q = np.stack(values, axis=-1) if values else np.empty((s, 0))
    part = [name for name in _QUATERNION if name in data]
    if 0 < len(part) < len(_QUATERNION):
        missing = ", ".join(name for name in _QUATERNION if name not in part)
        raise InputError(
            "a quaternion needs four columns: qx, qy, qz, qw", where=where, found=f"no {missing}"
        )
    if kind is _MATRIX:
        rows = np.stack([data[name] for name in _MATRIX], axis=-1).reshape(s, 3, 4)
        T = np.concatenate([rows, np.broadcast_to([[0.0, 0.0, 0.0, 1.0]], (s, 1, 4))], axis=1)
        return q, _with_exact_rotations(T, where)
    p = np.stack([data[name] for name in _POSITION], axis=-1)
    return q, p if not part else _with_quaternions(
        p, np.stack([data[n] for n in _QUATERNION], axis=-1), where
    )


def _archive(path: Path, nq: int) -> tuple[FloatArray, FloatArray]:
    data = read_arrays(path, {"q": (nq,), "T": (4, 4), "p": (3,), "quat": (4,)}, ["q"])
    if ("T" in data) == ("p" in data) or ("quat" in data and "p" not in data):
        found = ", ".join(data)
        raise InputError(
            "a file of measured poses must contain the arrays `q` and `T`, `q` and `p`, or `q`, `p` and"
            " `quat`",
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
    if errors.max(initial=0.0) > _WRITTEN:
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
    """Replace each measured rotation by the nearest rotation matrix, because the input may be rounded."""
    R = T[:, :3, :3]
    wrong = rotation_defect(R) > _WRITTEN
    if wrong.any():
        raise InputError(
            "a pose must be a rotation and a translation",
            where=f"{where}, pose {int(wrong.argmax())}",
            found=str(T[wrong.argmax()].tolist()),
        )
    exact = T.copy()
    exact[:, :3, :3] = polar_factor(R)
    return exact


def checked_poses(poses: ArrayLike) -> FloatArray:
    """Return poses (s, 4, 4) or positions (s, 3) as an array."""
    array = as_finite(poses, "poses")
    if array.ndim == 2 and array.shape[1] == 3:
        return array
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        return _with_exact_rotations(array, "poses")
    raise InputError(
        "`poses` must have the shape (n, 4, 4), or (n, 3) for positions", found=f"shape {array.shape}"
    )
