"""A model fitted to measured poses: what they tell, what the parameters are then, and what to doubt.

A fit that is not plausible (`plausible.py`) is refused. Of a plausible one the parameters are written that
moved by more than two standard deviations; the others stay as they were, and the rest is fitted anew.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.calibration.fit import (
    WRONGLY,
    Fit,
    Identification,
    Measured,
    Noise,
    best_fit,
    demand_plausible,
    identify,
    odd_poses,
    quantile,
    significant,
    stacked,
    starting,
)
from urdfkin.calibration.parameters import Model, Parameter, table_model, urdf_model
from urdfkin.calibration.plausible import Ended, Plausibility, judge
from urdfkin.calibration.poses import checked_poses
from urdfkin.calibration.write_back import Rewritten
from urdfkin.comparison.result import length
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.errors.validators import as_bool, as_choice, as_names, as_str, real_number, safe_repr
from urdfkin.loading import load
from urdfkin.model.configuration import checked
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Source
from urdfkin.verify.certificate import Certificate

#: Configurations that show what could be found, whatever was measured.
_GENERAL = 40
#: Standard deviations that what is left is off the stated noise by, and nobody wonders.
_UNLIKELY = 4.0
#: How many times as uncertain as general configurations leave a parameter: less is no reason to warn.
_WEAK = 10.0
#: Seed of the general configurations that a parameter's certainty is held against: not those of `general`.
_OTHERS = 1
#: Of the largest entry of R: a column whose own is no larger is one of those before it.
_DEPENDENT = 1e-12
#: By what a robot's size is divided for the x, y and z of a target that is at no special place.
_ASIDE = {"x": 5.0, "y": 6.0, "z": 7.0}
#: Times `Way.rounding`: Pinocchio goes to the base and to the tip, through origins that were written anew.
_READ_BACK = 4.0
#: Parameters or poses that a doubt names.
_NAMED = 6
#: Where no correction makes a fit plausible.
_NO_REASON = "degrees, shifted rows of q and reversed signs of joints do not explain it"


@dataclass(frozen=True, eq=False)
class Calibration:
    """A model after its calibration; make one with `urdfkin.calibrate`.

    Attributes:
        robot: The robot as it was.
        model: What was fitted of it.
        identification: Which parameters the poses tell.
        general: Which general configurations would tell.
        fitted: The fit; None where there are no poses.
        before: The same numbers for the robot as it was, base and tool fitted where they are unknown.
        odd: Numbers of the poses that do not belong to the others.
        without_odd: The fit without these.
        weak: Kept parameters that the poses hardly tell, each with how many times as uncertain it is as
            as many general configurations would leave it.
        certificate: What Pinocchio said of what was written.
        stated: Whether the noise was stated.
        written_fit: The fit of the parameters that are written alone; `fitted` where all are.
        significant: Numbers of the parameters in that fit.
        plausibility: Why the fit is refused, if it is.
    """

    robot: Robot
    model: Model
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
        """All that were to be fitted."""
        return self.model.way.parameters

    @cached_property
    def values(self) -> FloatArray:
        """(p,) by how much each parameter moved, m and rad; 0 for those that stand still."""
        return (
            np.zeros(len(self.parameters)) if self.fitted is None else self.fitted.at - self.model.way.start
        )

    @cached_property
    def writable(self) -> frozenset[int]:
        """Numbers of the parameters that a file has a place for: a URDF has none for ends and gains."""
        is_table = isinstance(self.model.source, DHTable)
        pairs = enumerate(self.parameters)
        return frozenset(k for k, p in pairs if p.what != "gain" and (is_table or not p.end))

    @property
    def written_parameters(self) -> tuple[int, ...]:
        """Numbers of the parameters that are written."""
        return tuple(k for k in self.significant if k in self.writable)

    @cached_property
    def written_values(self) -> FloatArray:
        """(p,) by how much each parameter moves in the fit that is written."""
        found = self.written_fit
        return np.zeros(len(self.parameters)) if found is None else found.at - self.model.way.start

    @cached_property
    def deviations(self) -> FloatArray:
        """(p,) standard deviations; 0 for those that stand still."""
        found = np.zeros(len(self.parameters))
        if self.fitted is not None:
            found[list(self.identification.kept)] = np.sqrt(np.diag(self.fitted.covariance))
        return found

    @property
    def origins(self) -> dict[str, FloatArray]:
        """(4, 4) by joint: the new origins of those that moved."""
        return {} if self.written_fit is None else self.model.origins(self.written_fit.at)

    @property
    def base(self) -> FloatArray | None:
        """(4, 4) of the robot's base in the instrument's frame; None where it was not asked for."""
        return None if self.written_fit is None else self.model.end("base", self.written_fit.at)

    @property
    def tool(self) -> FloatArray | None:
        """(4, 4) of the target in the tip's frame; None where it was not asked for."""
        return None if self.written_fit is None else self.model.end("tool", self.written_fit.at)

    @property
    def table(self) -> DHTable | None:
        """The calibrated table; None where a URDF was calibrated."""
        return None if self.written_fit is None else self.model.table(self.written_fit.at)

    @cached_property
    def written(self) -> Rewritten:
        """The URDF's own text with the new origins in it, and what that moves."""
        return Rewritten(self.robot, self.origins)


class ImplausibleError(InputError):
    """A fit that is not plausible: the measured data or the model have a gross mistake.

    Attributes:
        calibration: The refused calibration.
    """

    def __init__(self, calibration: Calibration, remedy: str) -> None:
        model, judged = calibration.model, calibration.plausibility
        reason = f"likeliest reason: {judged.reason}" if judged.reason else _NO_REASON
        super().__init__(
            "the calibration is refused",
            where=f"{calibration.robot.name}, {model.base} to {model.tip}",
            found="; ".join(judged.objections),
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
    """The model with which a robot, or a table, comes closest to measured poses.

    What is written is loaded anew, and its tip held against Pinocchio's at the measured configurations.

    Args:
        source: A robot, what `load` takes, or a Denavit-Hartenberg table.
        q: (s, nq) configurations; of a table (s, coordinates). None: only what could be found is told.
        poses: (s, 4, 4) of the tip in the base, or (s, 3) positions alone, m.
        tip: A link's or joint's name; the robot's tip when None.
        base: Likewise; the robot's base frame when None.
        fit: Of "base" (where the instrument stands), "tool" (the target on the tip), "offsets" (the joints'
            zeros), "origins" (the six of each joint of the path; all cells of a table), "gains".
        noise: Standard deviations of what was measured: m of a coordinate, rad of a turn about an axis. None:
            estimated from what is left.
        drop_odd: Whether poses that do not belong to the others are left out; they are told in any case.
        complete: Without poses: whether poses will be measured, or positions alone.
        radians: Whether joint angles beyond a turn, which look like degrees, are radians.
        force: Whether a fit that is not plausible is returned, with the objections in `plausibility`.
        every: Whether all fitted parameters are written, also those within two standard deviations of 0.

    Raises:
        InputError: shapes, fewer poses than tell anything, positions that can be no metres.
        ImplausibleError: the fit is not plausible; the message names the likeliest reason.
        UnknownNameError: a frame or a set of parameters that does not exist.
        UrdfError, SourceError: as `load`.
        VerificationError: Pinocchio computes something else of what was written.

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
    if found.plausibility.objections and not as_bool(force, "force"):
        raise ImplausibleError(found, "force=True returns the fit all the same")
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
    judged: bool = True,
) -> Calibration:
    """As `calibrate`, which refuses what is not plausible; `judged` says whether that is asked at all."""
    robot = source if isinstance(source, Robot) else load(source)
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
        raise InputError("q and poses are given together", found="one of the two")
    given = None if q is None or poses is None else _measured(robot, model, q, poses)
    if given is not None:
        complete = given[1].complete
    general = _values(model, robot, robot.sample(_GENERAL))
    if given is None:
        could = identify(model, general, complete=complete, at=_somewhere(model))
        return Calibration(robot, model, could, could)
    path_q, measured = given
    ended, found = _calibrated(robot, model, path_q, measured, noise, drop_odd, every=every)
    found = replace(found, general=identify(model, general, complete=complete, at=ended.fitted.at))
    if judged:
        found = replace(found, plausibility=judge(model, ended, radians=radians))
    return replace(found, certificate=_held(found, measured, np.atleast_2d(np.asarray(q, dtype=np.float64))))


def _somewhere(model: Model) -> FloatArray:
    """(p,) the model as it is, with a target that is fitted at no special place: it may be anywhere."""
    at = model.way.start.copy()
    for k, parameter in enumerate(model.way.parameters):
        if parameter.end and parameter.where == "tool" and parameter.unit == "m":
            at[k] = model.way.size / _ASIDE[parameter.what]
    return at


def _values(model: Model, robot: Robot, q: FloatArray) -> FloatArray:
    return model.coupling.values(model.coupling.select(robot.tree, q))


def _measured(robot: Robot, model: Model, q: ArrayLike, poses: ArrayLike) -> tuple[FloatArray, Measured]:
    """(s, c) coordinates of the path, and what was measured there."""
    T = checked_poses(poses)
    if isinstance(model.source, DHTable):
        path_q = model.coupling.checked(q, "q")
    else:
        path_q = model.coupling.select(robot.tree, np.atleast_2d(checked(robot.tree, q, "q")))
    values = model.coupling.values(path_q)
    if len(values) != len(T) or values.ndim != 2:
        raise InputError(
            "each pose needs its configuration", found=f"{len(T)} poses, q of shape {np.shape(q)}"
        )
    if not len(T):
        raise InputError("no poses", remedy="one is needed at least, and more than there are parameters")
    measured = Measured(values, T[:, :3, 3], T[:, :3, :3]) if T.ndim == 3 else Measured(values, T)
    demand_plausible(model, measured)
    return path_q, measured


def _calibrated(
    robot: Robot,
    model: Model,
    q: FloatArray,
    measured: Measured,
    noise: tuple[float, float] | None,
    drop_odd: bool,
    *,
    every: bool,
) -> tuple[Ended, Calibration]:
    stated, start = None if noise is None else _stated(noise), starting(model, measured)
    identification = identify(model, measured.values, complete=measured.complete, at=start)
    ends = [k for k in identification.kept if model.way.parameters[k].end]
    before = best_fit(model, measured, ends, stated, start)
    found = best_fit(model, measured, identification.kept, stated, before.at)
    identification, found = _more(model, measured, identification, stated, found)
    odd, clean = odd_poses(model, measured, identification.kept, stated, found)
    if drop_odd and odd:
        chosen = np.ones(len(measured), dtype=bool)
        chosen[list(odd)] = False
        q, measured, found = q[chosen], measured.some(chosen), clean
        before = best_fit(model, measured, ends, stated, before.at)
    ended = Ended(q, measured, identification, before, found)
    significant_, written = identification.kept, found
    if not every:
        significant_, written = _significant(model, ended, stated)
    return ended, Calibration(
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
        significant=significant_,
    )


def _significant(model: Model, ended: Ended, stated: Noise | None) -> tuple[tuple[int, ...], Fit]:
    """The parameters that are written, and their fit; base and tool always are in it."""
    kept, found = ended.identification.kept, ended.fitted
    fixed = [model.way.parameters[k].end for k in kept]
    moved = found.at[list(kept)] - model.way.start[list(kept)]
    chosen = tuple(
        k
        for k, is_written in zip(kept, significant(moved, found.covariance, fixed), strict=True)
        if is_written
    )
    if chosen == kept:
        return kept, found
    at = found.at.copy()
    out = [k for k in kept if k not in chosen]
    at[out] = model.way.start[out]
    return chosen, best_fit(model, ended.measured, chosen, stated, at)


def _more(
    model: Model, measured: Measured, identification: Identification, stated: Noise | None, found: Fit
) -> tuple[Identification, Fit]:
    """With what can be told where the fit ended, if that explains more than chance would.

    A model as it was drawn is more special than the robot: a tip on the last axis does not show how far that
    is turned, one beside it does.
    """
    again = identify(model, measured.values, complete=measured.complete, at=found.at)
    more = again.rank - identification.rank
    if more <= 0:
        return identification, found
    trial = best_fit(model, measured, again.kept, stated, found.at)
    scale = trial.noise.of(measured.complete)
    explained = float(((found.errors / scale) ** 2).sum() - ((trial.errors / scale) ** 2).sum())
    return (again, trial) if explained > quantile(1.0 - WRONGLY, more) else (identification, found)


def _stated(noise: tuple[float, float]) -> Noise:
    if not isinstance(noise, tuple | list) or len(noise) != 2:
        raise InputError("noise is two numbers, metres and radians", found=safe_repr(noise))
    metres, radians = (real_number(one, "noise") for one in noise)
    if min(metres, radians) <= 0.0:
        raise InputError(
            "noise is more than nothing", found=str(noise), remedy="leave it out: it is estimated"
        )
    return Noise(metres, radians)


def _weak(
    robot: Robot, model: Model, measured: Measured, kept: Sequence[int], at: FloatArray
) -> dict[int, float]:
    """Kept parameters that as many general configurations would tell much better."""
    general = _values(model, robot, robot.sample(len(measured), seed=_OTHERS))
    sizes = []
    for values in (measured.values, general):
        J = stacked(model, values, complete=measured.complete, at=at)[:, list(kept)]
        _, R = np.linalg.qr(J)
        if (np.abs(np.diag(R)) <= _DEPENDENT * np.abs(R).max(initial=0.0)).any() or len(R) < len(kept):
            return {}
        sizes.append(np.linalg.norm(np.linalg.solve(R, np.eye(len(R))), axis=1))
    ratios = sizes[0] / sizes[1]
    return {k: float(ratio) for k, ratio in zip(kept, ratios, strict=True) if ratio > _WEAK}


def _held(found: Calibration, measured: Measured, q: ArrayLike) -> Certificate | None:
    """Hold what is written against Pinocchio, at the measured configurations.

    A URDF holds neither the ends nor gains; a table is held by `load`.
    """
    model, fitted = found.model, found.written_fit
    if fitted is None:
        return None
    at = fitted.at.copy()
    at[[p.end or p.what == "gain" for p in found.parameters]] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what there is to warn of was warned of when it was loaded
        if (table := found.table) is not None:
            made = load(table)
            made.placement(made.neutral(), made.tip_frame)
            return made.certificate()
        T = found.written.loaded.placement(q, [model.base, model.tip])
    theirs = np.linalg.solve(T[:, 0], T[:, 1])
    away = np.abs(theirs - model.way.poses(measured.values, at))
    bound = _READ_BACK * model.way.rounding(measured.values)
    if away[:, :3, 3].max() > bound or away[:, :3, :3].max() > bound / model.way.size:
        raise UrdfkinError(
            "the URDF that was written is not what was fitted",
            where=f"{found.robot.name}, {model.base} to {model.tip}",
            found=f"{float(away.max()):.3g}, where rounding explains {bound:.3g}",
        )
    return found.written.loaded.certificate()


def doubts(found: Calibration) -> list[str]:
    """What to doubt, a line each."""
    return list(_doubts(found))


def _doubts(found: Calibration) -> Iterator[str]:
    fitted, name = found.fitted, [str(parameter) for parameter in found.parameters]
    if fitted is None:
        return
    lost = found.general.rank - found.identification.rank
    if lost > 0:
        untold = [k for k in found.general.kept if k not in found.identification.kept]
        yield (
            f"these poses tell {found.identification.rank} numbers, general ones would tell {lost} more: "
            f"{_listed(name[k] for k in untold)} stand still"
        )
    if found.weak:
        worst = sorted(found.weak.items(), key=lambda one: -one[1])
        yield (
            "these poses hardly tell "
            + _listed(f"{name[k]} ({ratio:.0f} times as uncertain)" for k, ratio in worst)
            + "; in brackets: as general configurations of their number would leave it"
        )
    if not fitted.is_judged:
        yield "no number is left to judge by: there are as many parameters as measured numbers"
    elif fitted.freedom < len(found.identification.kept):
        yield f"{fitted.freedom:.0f} numbers are left to judge {len(found.identification.kept)} parameters by"
    if found.stated and abs(fitted.ratio - 1.0) > _UNLIKELY * fitted.spread:
        yield (
            f"{fitted.ratio:.3g} times the noise that was stated is left: "
            "it is another, or the model is too simple"
        )
    if found.odd and found.without_odd is not None:
        one = len(found.odd) == 1
        poses = f"pose{'' if one else 's'} {_listed(map(str, found.odd))} "
        if len(fitted.errors) == len(found.without_odd.errors):
            yield poses + f"{'is' if one else 'are'} left out"
        else:
            ours, theirs = (length(each.rms()[0]) for each in (fitted, found.without_odd))
            yield (
                poses + f"{'does' if one else 'do'} not belong to the others: without "
                f"{'it' if one else 'them'} {theirs} are left of {ours} (rms)"
            )
    gains = [k for k in found.identification.kept if found.parameters[k].what == "gain"]
    if gains:
        yield f"a URDF has no gains: {_listed(name[k] for k in gains)} are not written"


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    return ", ".join(every[:_NAMED]) + (f" and {len(every) - _NAMED} more" if len(every) > _NAMED else "")
