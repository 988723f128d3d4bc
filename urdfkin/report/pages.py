"""Prepare one robot's results for display: tables for the terminal, and data for the HTML template."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from urdfkin.dh.units import Units as DisplayUnits
from urdfkin.errors.display import format_count
from urdfkin.model.configuration import format_range
from urdfkin.model.summary import format_axis
from urdfkin.report.words import (
    bound_ratio_cell,
    bound_ratio_of,
    checks_in_order,
    checks_of_quantities,
    disagreement_cell,
    error_cells,
    format_ratio,
    format_units,
    more_accurate,
    quantities_by_heading,
    quantities_disagreement_cell,
    quantity_name,
    worst,
)
from urdfkin.validation.document import (
    Chain,
    ReportedAccuracy,
    ReportedCheck,
    ReportedDHRow,
    ReportedJoint,
    ReportedLimit,
    ReportedModel,
    ReportedRobot,
    Units,
)

_DISPLAY_UNITS = DisplayUnits(digits=6)

#: Ratios of disagreement to bound at which the colour of the heat map changes.
HEAT_EDGES = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True, slots=True)
class HeatCell:
    text: str
    step: int


def overview_row(robot: ReportedRobot, quantities_of: Sequence[Sequence[str]]) -> dict[str, Any]:
    checks = robot["checks"]
    largest, ratio = worst(check["worst"] for check in checks), bound_ratio_of(robot)
    return {
        "source": robot["source"],
        "verdict": robot["verdict"],
        "joints": len(robot["joints"]),
        "frames": len(robot["frames"]),
        "results": robot["results"],
        "failed": robot["failed"],
        "quantities": [
            (quantities_disagreement_cell(robot, names), _disagreement_sort_key(robot, names))
            for names in quantities_of
        ],
        "worst": disagreement_cell(checks),
        "worst_key": _sortable(largest) if checks else -1.0,
        "share": bound_ratio_cell(robot),
        "share_key": _sortable(ratio) if checks else -1.0,
        "findings": ", ".join(
            format_count(count, word)
            for word in ("error", "warning")
            if (count := _count_findings(robot, word))
        ),
        "findings_key": 1e6 * _count_findings(robot, "error") + _count_findings(robot, "warning"),
        "seconds": robot["seconds"],
    }


def reason(robot: ReportedRobot) -> str:
    """Return the reason of the verdict, without errors that the page lists as findings."""
    first, *lines = (robot["reason"] or "").split("\n")
    found = [(one["code"], one["message"]) for one in robot["findings"] if one["severity"] == "error"]
    others = [line for line in lines if not any(code in line and words in line for code, words in found)]
    return "\n".join([first, *others])


def _count_findings(robot: ReportedRobot, severity: str) -> int:
    return sum(finding["severity"] == severity for finding in robot["findings"])


def _disagreement_sort_key(robot: ReportedRobot, names: Sequence[str]) -> float:
    checks = checks_of_quantities(robot, names)
    return _sortable(worst(check["worst"] for check in checks)) if checks else -1.0


def _sortable(value: Units) -> float:
    return 1e308 if value is None else value


def joint_rows(model: ReportedModel) -> list[dict[str, Any]]:
    return [
        {
            "name": joint["name"],
            "kind": joint["kind"],
            "parent": joint["parent"],
            "child": joint["child"],
            "q": _coordinate(joint),
            "axis": format_axis(joint["axis"]) if joint["axis"] else "",
            **_limits(joint["limit"], joint["kind"]),
            "remaining_range": _remaining_range(joint),
        }
        for joint in model["joints"]
    ]


def _remaining_range(joint: ReportedJoint) -> str:
    remaining = joint.get("remaining_range")
    if remaining is None:
        return ""
    if remaining["lower"] is None or remaining["upper"] is None:
        names = ", ".join(remaining["by"])
        return f"{joint['name']}: at most one value keeps the mimic joints within their limits ({names})."
    unit = "m" if joint["kind"] == "prismatic" else "rad"
    ends = f"{format_range((remaining['lower'], remaining['upper']))} {unit}"
    mimics = ", ".join(remaining["by"])
    return (
        f"{joint['name']}: the mimic joints are within their limits only for values from {ends} ({mimics})."
    )


def _coordinate(joint: ReportedJoint) -> str:
    mimic = joint["mimic"]
    if joint["q"] is None:
        return ""
    size = {"planar": 3, "floating": 7}.get(joint["kind"], 1)
    place = f"q[{joint['q']}]" if size == 1 else f"q[{joint['q']}:{joint['q'] + size}]"
    if mimic is None:
        return place
    offset = f" {mimic['offset']:+g}" if mimic["offset"] else ""
    return f"{mimic['multiplier']:g} {place}{offset}"


def _limits(limit: ReportedLimit | None, kind: str) -> dict[str, str]:
    if limit is None:
        return {"lower": "", "upper": "", "velocity": "", "effort": ""}
    unit = "m" if kind == "prismatic" else "rad"
    words = {key: "" if value is None else f"{value:.6g}" for key, value in limit.items()}
    for key, suffix in (("lower", unit), ("upper", unit), ("velocity", f"{unit}/s")):
        words[key] += f" {suffix}" if words[key] else ""
    return words


def heat_map(
    robot: ReportedRobot, model: ReportedModel
) -> tuple[list[str], list[tuple[str, list[HeatCell]]]]:
    """Return the column headings, and a pair (name, cells) for each moving joint."""
    quantities_of = quantities_by_heading([robot])
    frame = {name: i for i, name in enumerate(robot["frames"])}
    moving = {name: i for i, name in enumerate(robot["joints"])}
    own = _columns(model)
    rows = []
    for joint in robot["joints"]:
        subject_indices = {
            "frames": [frame[f"joint:{joint}"]] if f"joint:{joint}" in frame else [],
            "joints": [moving[joint]],
            "columns": own.get(joint, []),
        }
        rows.append(
            (
                joint,
                [
                    _heat_cell(checks_of_quantities(robot, names), subject_indices)
                    for names in quantities_of.values()
                ],
            )
        )
    return list(quantities_of), rows


def _columns(model: ReportedModel) -> dict[str, list[int]]:
    """Return the column indices of each joint, for Jacobians in which mimic joints have their own columns."""
    own: dict[str, list[int]] = {}
    at = 0
    for joint in model["joints"]:
        size = {"fixed": 0, "planar": 3, "floating": 6}.get(joint["kind"], 1)
        own[joint["name"]] = list(range(at, at + size))
        at += size
    return own


def _heat_cell(checks: Sequence[ReportedCheck], subject_indices: dict[str, list[int]]) -> HeatCell:
    found = [check["worst_by_subject"][i] for check in checks for i in subject_indices[check["subjects"]]]
    if not found:
        return HeatCell("", 0)
    largest = worst(found)
    if largest is None:
        return HeatCell("not finite", len(HEAT_EDGES) + 1)
    ratio = max(_bound_ratio(check, i) for check in checks for i in subject_indices[check["subjects"]])
    return HeatCell(format_units(largest), sum(ratio > edge for edge in HEAT_EDGES) + (ratio > 0.0))


def _bound_ratio(check: ReportedCheck, subject: int) -> float:
    """Return an upper limit of the ratio of disagreement to bound, for one frame, joint or column.

    The document has bounds only for the whole check. Therefore, the disagreement is divided by the smallest
    bound.
    """
    value, tightest, most = check["worst_by_subject"][subject], check["bound"][0], check["bound_ratio"]
    # A disagreement of 0 has the ratio 0, even if the bound is 0.
    if not value:
        return math.inf if value is None else 0.0
    if not tightest:
        return math.inf
    return value / tightest if most is None else min(value / tightest, most)


def chain_rows(chain: Chain, convention: str) -> list[list[str]]:
    """Return rows with the cells joint, a, alpha, beta, d and theta.

    The cell beta is missing if beta is 0 in both tables.
    """
    rows = chain["standard"]["rows"] if convention == "standard" else chain["modified"]["rows"]
    return [_dh_cells(row, has_beta(chain)) for row in rows]


def has_beta(chain: Chain) -> bool:
    return any(row["beta"] != 0.0 for row in (*chain["standard"]["rows"], *chain["modified"]["rows"]))


def _dh_cells(row: ReportedDHRow, beta: bool) -> list[str]:
    cells = {"d": _length(row["d"]), "theta": angle(row["theta"])}
    variable = "d" if row["kind"] == "prismatic" else "theta"
    constant, q = cells[variable], "+ q" if row["sense"] > 0 else "− q"
    cells[variable] = q.removeprefix("+ ") if constant == "0" else f"{constant} {q}"
    betas = [angle(row["beta"])] if beta else []
    return [row["joint"], _length(row["a"]), angle(row["alpha"]), *betas, *cells.values()]


def _length(metres: float) -> str:
    return _DISPLAY_UNITS.format_length(metres).replace("-", "−")


def angle(radians: float) -> str:
    """Format an angle; an exact multiple of pi/12 is written with π."""
    return _DISPLAY_UNITS.format_angle(radians, pi="π").replace("-", "−")


def accuracy_rows(study: ReportedAccuracy) -> list[dict[str, Any]]:
    return [
        {
            "quantity": quantity_name(line["quantity"]),
            "reference": line["reference"] or "",
            "numbers": line["numbers"],
            "errors": error_cells(line),
            "more_accurate": more_accurate(line),
        }
        for line in study["lines"]
    ]


def check_rows(robot: ReportedRobot) -> list[dict[str, Any]]:
    return [
        {
            "quantity": quantity_name(check["quantity"]),
            "reference": check["reference"] or "",
            "results": check["results"],
            "failed": check["failed"],
            "median": format_units(check["median"]),
            "p99": format_units(check["p99"]),
            "worst": format_units(check["worst"]),
            "share": format_ratio(check["bound_ratio"]),
            "width": 100.0 if check["bound_ratio"] is None else min(100.0, 100.0 * check["bound_ratio"]),
            "case": check["worst_case"],
            "where": "" if check["worst_case"] is None else check["worst_case"]["frame"],
        }
        for check in checks_in_order(robot)
    ]


def failures(robot: ReportedRobot) -> list[dict[str, Any]]:
    failing = sorted(
        (check for check in robot["checks"] if check["failed"]),
        key=lambda check: -_sortable(check["bound_ratio"]),
    )
    rows = {(row["quantity"], row["reference"]): row for row in check_rows(robot)}
    return [rows[quantity_name(check["quantity"]), check["reference"] or ""] for check in failing]
