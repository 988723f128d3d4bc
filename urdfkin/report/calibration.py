"""A calibration as a document and as JSON data: parameters, errors and warnings."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from urdfkin.calibration.calibrate import Calibration, doubts
from urdfkin.calibration.fit import Fit
from urdfkin.calibration.write_back import Rewritten
from urdfkin.comparison.result import angle, length
from urdfkin.errors.display import Strong, Table, TextDocument
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import FloatArray
from urdfkin.report.words import counted
from urdfkin.system.documents import as_json_data

#: Residuals below this fraction of the noise are only rounding errors.
_ROUNDING = 0.5


def document(found: Calibration) -> TextDocument:
    model, identification = found.model, found.identification
    poses = f", {counted(len(found.fitted.errors), 'pose')}" if found.fitted is not None else ""
    title = f"{found.robot.name}: {model.base} to {model.tip}{poses}"
    identifiable, fixed = identification.rank, len(identification.still)
    parts: list[str | Table] = [
        f"{identifiable} of {len(found.parameters)} parameters identifiable, {fixed} fixed"
    ]
    if found.fitted is None:
        kept = [(str(found.parameters[k]),) for k in sorted(identification.kept)]
        still = [(str(found.parameters[k]), reason) for k, reason in sorted(identification.still.items())]
        parts += [Table(["identifiable"], kept), Table(["fixed", "reason"], still, left=2)]
    else:
        rows = [
            (
                str(found.parameters[k]),
                _amount(found.values[k], found.parameters[k].unit),
                _amount(found.deviations[k], found.parameters[k].unit),
                _amount(found.written_values[k], found.parameters[k].unit)
                if k in found.written_parameters
                else "",
            )
            for k in sorted(identification.kept)
        ]
        parts.append(Table(["parameter", "change", "standard deviation", "written"], rows))
    if found.fitted is None or found.before is None:
        return TextDocument(title, parts)
    noise = found.fitted.noise
    said = length(noise.metres) + (f", {angle(noise.radians)}" if found.fitted.errors.shape[1] == 6 else "")
    every = sum(p in found.writable for p in identification.kept)
    few = found.written_fit is not None and len(found.written_parameters) < every
    as_written = (
        f"; with only the written parameters: {_rms(found.written_fit)}"
        if few and found.written_fit is not None
        else ""
    )
    parts.append(f"rms error before the fit: {_rms(found.before)}; after: {_rms(found.fitted)}{as_written}")
    if few:
        parts.append(
            f"written: {len(found.written_parameters)} of {every} parameters; only these changed by more than"
            " 2 sigma"
        )
    if not found.stated and not found.fitted.is_judged:
        parts.append("noise: unknown, because there are no redundant measurements")
    elif found.stated:
        ratio = f"{found.fitted.ratio:.3g} +- {found.fitted.spread:.2g}"
        parts.append(f"noise: {said} as stated; the residuals are {ratio} times as large as this noise")
    elif found.fitted.ratio < _ROUNDING:
        parts.append("noise: none, the residuals are only rounding errors")
    else:
        parts.append(f"noise: {said}, estimated from the residuals")
    for name, T in (("base", found.base), ("tool", found.tool)):
        if T is not None:
            parts.append(f"{name}: {_written(T)}")
    for line in doubts(found):
        parts.append(Strong(f"warning: {line}", "bold yellow"))
    return TextDocument(title, parts)


def moved_table(written: Rewritten) -> Table:
    rows = [(joint, length(shift), angle(turn)) for joint, (shift, turn) in written.moved.items()]
    return Table(["joint", "origin moved by", "rotated by"], rows)


def _amount(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "unknown"
    return length(value) if unit == "m" else angle(value) if unit == "rad" else f"{value:.3g}"


def _rms(fit: Fit) -> str:
    metres, radians = fit.rms()
    return length(metres) if radians is None else f"{length(metres)}, {angle(radians)}"


def _written(T: FloatArray) -> str:
    xyz, rpy = (" ".join(f"{x:.9g}" for x in three) for three in (T[:3, 3], rpy_of(T[:3, :3]) + 0.0))
    return f'xyz="{xyz}" rpy="{rpy}"'


def as_data(found: Calibration) -> dict[str, Any]:
    identification = found.identification
    data: dict[str, Any] = {
        "robot": found.robot.name,
        "source": found.robot.source,
        "base": found.model.base,
        "tip": found.model.tip,
        "rank": identification.rank,
        "parameters": [
            {
                "place": parameter.where,
                "name": parameter.what,
                "unit": parameter.unit or "1",
                "fitted": k in identification.kept,
                "moved": float(found.values[k]) if found.fitted is not None else None,
                "deviation": found.deviations[k] if found.fitted is not None else None,
                "written": float(found.written_values[k]) if k in found.written_parameters else None,
                "still_because": identification.still.get(k),
            }
            for k, parameter in enumerate(found.parameters)
        ],
    }
    if found.fitted is None:
        return data
    fitted = found.fitted
    names = ("base", found.base), ("tool", found.tool)
    data |= {
        "covariance_of": [str(found.parameters[k]) for k in identification.kept],
        "covariance": fitted.covariance,
        "noise": {"metres": fitted.noise.metres, "radians": fitted.noise.radians}
        if found.stated or fitted.is_judged
        else None,
        "rms": {
            when: dict(zip(("metres", "radians"), fit.rms(), strict=True))
            for when, fit in (("before", found.before), ("after", fitted), ("as_written", found.written_fit))
            if fit is not None
        },
        "residuals": fitted.errors,
        "odd_poses": list(found.odd),
        "doubts": doubts(found),
        "objections": list(found.plausibility.objections),
        "likeliest_reason": found.plausibility.reason,
        "placements": {name: T for name, T in names if T is not None},
        "origins": found.origins,
    }
    return cast("dict[str, Any]", as_json_data(data))
