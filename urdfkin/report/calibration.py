"""A calibration as a document and as JSON data: parameters, errors and warnings."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from urdfkin.calibration.calibrate import Calibration, list_warnings
from urdfkin.calibration.write_back import UpdatedURDF
from urdfkin.comparison.result import angle, length
from urdfkin.errors.display import Strong, Table, TextDocument, format_count
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.tree import FloatArray
from urdfkin.system.documents import as_json_data

#: If the user states no noise, the noise is estimated.
#: The estimated noise is at least the rounding error.
#: Below this `noise_ratio`, the report calls the residuals rounding errors.
_ROUNDING_NOISE_RATIO = 0.5


def document(calibration: Calibration) -> TextDocument:
    model, identification = calibration.model, calibration.identification
    full_fit, written_fit = calibration.full_fit, calibration.written_fit
    poses = f", {format_count(len(full_fit.residuals), 'pose')}" if full_fit is not None else ""
    title = f"{calibration.robot.name}: {model.base} to {model.tip}{poses}"
    identifiable, fixed = identification.rank, len(identification.fixed_parameters)
    parts: list[str | Table] = [
        f"{identifiable} of {len(calibration.parameters)} parameters identifiable, {fixed} fixed"
    ]
    if full_fit is None:
        free_rows = [(str(calibration.parameters[k]),) for k in sorted(identification.free_parameters)]
        fixed_rows = [
            (str(calibration.parameters[k]), reason)
            for k, reason in sorted(identification.fixed_parameters.items())
        ]
        parts += [Table(["identifiable"], free_rows), Table(["fixed", "reason"], fixed_rows, left=2)]
    else:
        rows = [
            (
                str(calibration.parameters[k]),
                _format_value(calibration.changes[k], calibration.parameters[k].unit),
                _format_value(calibration.standard_deviations[k], calibration.parameters[k].unit),
                _format_value(calibration.written_changes[k], calibration.parameters[k].unit)
                if k in calibration.written_parameters
                else "",
            )
            for k in sorted(identification.free_parameters)
        ]
        parts.append(Table(["parameter", "change", "standard deviation", "written"], rows))
    if full_fit is None or calibration.base_tool_fit is None:
        return TextDocument(title, parts)
    noise = full_fit.noise
    noise_text = length(noise.metres) + (
        f", {angle(noise.radians)}" if full_fit.residuals.shape[1] == 6 else ""
    )
    every = sum(p in calibration.writable for p in identification.free_parameters)
    few = written_fit is not None and len(calibration.written_parameters) < every
    as_written = (
        f"; with only the written parameters: {written_fit.rms_text}"
        if few and written_fit is not None
        else ""
    )
    before = calibration.base_tool_fit.rms_text
    parts.append(f"rms error before the fit: {before}; after: {full_fit.rms_text}{as_written}")
    if few:
        parts.append(
            f"written: {len(calibration.written_parameters)} of {every} parameters; only these changed by"
            " more than 2 sigma"
        )
    if not calibration.is_noise_stated and not full_fit.has_redundancy:
        parts.append("noise: unknown, because there are no redundant measurements")
    elif calibration.is_noise_stated:
        ratio = f"{full_fit.noise_ratio:.3g} +- {full_fit.noise_ratio_deviation:.2g}"
        parts.append(f"noise: {noise_text} as stated; the residuals are {ratio} times as large as this noise")
    elif full_fit.noise_ratio < _ROUNDING_NOISE_RATIO:
        parts.append("noise: none, the residuals are only rounding errors")
    else:
        parts.append(f"noise: {noise_text}, estimated from the residuals")
    for name, T in (("base", calibration.base), ("tool", calibration.tool)):
        if T is not None:
            parts.append(f"{name}: {_pose_text(T)}")
    for line in list_warnings(calibration):
        parts.append(Strong(f"warning: {line}", "bold yellow"))
    return TextDocument(title, parts)


def displacement_table(written: UpdatedURDF) -> Table:
    rows = [(joint, length(shift), angle(turn)) for joint, (shift, turn) in written.displacements.items()]
    return Table(["joint", "origin moved by", "rotated by"], rows)


def _format_value(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "unknown"
    return length(value) if unit == "m" else angle(value) if unit == "rad" else f"{value:.3g}"


def _pose_text(T: FloatArray) -> str:
    xyz, rpy = (" ".join(f"{x:.9g}" for x in three) for three in (T[:3, 3], rpy_of(T[:3, :3]) + 0.0))
    return f'xyz="{xyz}" rpy="{rpy}"'


def as_data(calibration: Calibration) -> dict[str, Any]:
    identification = calibration.identification
    data: dict[str, Any] = {
        "robot": calibration.robot.name,
        "source": calibration.robot.source,
        "base": calibration.model.base,
        "tip": calibration.model.tip,
        "rank": identification.rank,
        "parameters": [
            {
                "element": parameter.element,
                "name": parameter.name,
                "unit": parameter.unit or "1",
                "fitted": k in identification.free_parameters,
                "change": float(calibration.changes[k]) if calibration.full_fit is not None else None,
                "deviation": calibration.standard_deviations[k] if calibration.full_fit is not None else None,
                "written": float(calibration.written_changes[k])
                if k in calibration.written_parameters
                else None,
                "fixed_because": identification.fixed_parameters.get(k),
            }
            for k, parameter in enumerate(calibration.parameters)
        ],
    }
    if calibration.full_fit is None:
        return data
    fitted = calibration.full_fit
    names = ("base", calibration.base), ("tool", calibration.tool)
    data |= {
        "covariance_of": [str(calibration.parameters[k]) for k in identification.free_parameters],
        "covariance": fitted.covariance,
        "noise": {"metres": fitted.noise.metres, "radians": fitted.noise.radians}
        if calibration.is_noise_stated or fitted.has_redundancy
        else None,
        "rms": {
            when: dict(zip(("metres", "radians"), fit.rms(), strict=True))
            for when, fit in (
                ("before", calibration.base_tool_fit),
                ("after", fitted),
                ("as_written", calibration.written_fit),
            )
            if fit is not None
        },
        "residuals": fitted.residuals,
        "outliers": list(calibration.outliers),
        "warnings": list_warnings(calibration),
        "objections": list(calibration.plausibility.objections),
        "likeliest_reason": calibration.plausibility.reason,
        "placements": {name: T for name, T in names if T is not None},
        "origins": calibration.origins,
    }
    return cast("dict[str, Any]", as_json_data(data))
