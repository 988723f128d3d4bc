"""Histograms of the disagreements with Pinocchio, and the data of the 3D view.

The plot has one row for each quantity, with all reference frames together. The x axis is logarithmic and
shows the disagreement in eps * scale. A triangle shows the worst result. Results have different bounds, so a
horizontal bar shows the interval from the smallest to the largest bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.report.words import (
    checks_of_quantity,
    disagreement_cell,
    format_units,
    quantities,
    quantity_name,
    worst,
)
from urdfkin.validation.document import Chain, ReportedCheck, ReportedDHTable, ReportedModel, ReportedRobot
from urdfkin.view.figure import FIRST, GRID, SECOND, TEXT, THIRD, inline_svg, label, new_figure, style

if TYPE_CHECKING:
    from urdfkin.view.figure import Axes


#: Left end of the x axis, in eps * scale. The percentage at the left end of a row is the share of smaller
#: disagreements.
_X_AXIS_MIN = 1e-2
#: Height of the highest bar, relative to the distance between two rows.
_BAR_HEIGHT = 0.82


def distributions(robot: ReportedRobot, edges: Sequence[float], prefix: str) -> str:
    """Return the plot of one robot as inline SVG, or an empty text if nothing was compared."""
    names = quantities([robot])
    if not names:
        return ""
    with style():
        figure = new_figure(5.6, 0.6 + 0.4 * len(names))
        axes = figure.add_subplot()
        right = _right_limit(robot["checks"], edges)
        for row, name in enumerate(names):
            _draw_row(axes, len(names) - 1 - row, checks_of_quantity(robot, name), np.asarray(edges), right)
        _decorate(axes, names, right)
        descriptions = (
            f"{quantity_name(name)}: worst {disagreement_cell(checks_of_quantity(robot, name))}"
            for name in names
        )
        return inline_svg(
            figure,
            prefix,
            f"Distribution of the disagreement with Pinocchio, {robot['source']}",
            "Histograms of the disagreements of each quantity, in eps*scale, with the bound. "
            f"{'; '.join(descriptions)}.",
        )


def _right_limit(checks: Sequence[ReportedCheck], edges: Sequence[float]) -> float:
    ends = [check["bound"][1] or 1.0 for check in checks] + [check["worst"] or 1.0 for check in checks]
    return float(min(max(ends) * 2.0, edges[-1] * 10.0))


def _draw_row(
    axes: Axes, base: int, checks: Sequence[ReportedCheck], edges: np.ndarray, right: float
) -> None:
    counts = np.sum([check["histogram"] for check in checks], axis=0)
    results = counts.sum()
    first = int(np.searchsorted(edges, _X_AXIS_MIN))
    heights = counts[first + 1 :] / max(1, counts[first + 1 :].max())
    last = int(np.flatnonzero(heights).max(initial=-1)) + 1
    axes.plot([_X_AXIS_MIN, edges[-1] * 10], [base, base], color=GRID, linewidth=0.7, zorder=1)
    if last > 0:
        at = edges[first : first + last + 1]
        tops = base + _BAR_HEIGHT * heights[: len(at) - 1]
        axes.stairs(tops, at, baseline=base, fill=True, color=FIRST, alpha=0.85, linewidth=0, zorder=3)
    exact = counts[: first + 1].sum() / results if results else 0.0
    _annotate_left(axes, f"{exact:.0%}" if exact else "", base, 2, fontsize=8)
    _draw_bound_range(axes, base, checks)
    largest = worst(check["worst"] for check in checks)
    # If the largest result is outside the plot, a text at the right edge shows its value.
    if largest is None or largest > right:
        text = "✗ not finite" if largest is None else f"✗ {format_units(largest)} ▸"
        place: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "center"}
        axes.annotate(text, (1.0, base + 0.13), fontsize=8, weight="bold", color=THIRD, zorder=6, **place)
    elif largest:
        colour = THIRD if any(check["failed"] for check in checks) else TEXT
        axes.plot([largest], [base + 0.13], marker="v", markersize=5, color=colour, zorder=5)


def _annotate_left(axes: Axes, text: str, y: float, points: float, **style: Any) -> None:
    place: dict[str, Any] = {"xytext": (-4, points), "textcoords": "offset points", "ha": "right"}
    axes.annotate(text, (_X_AXIS_MIN, y), color=TEXT, **place, **style)


def _draw_bound_range(axes: Axes, base: int, checks: Sequence[ReportedCheck]) -> None:
    lows = [low for low, _ in (check["bound"] for check in checks) if low is not None]
    highs = [high for _, high in (check["bound"] for check in checks) if high]
    if lows and highs:
        low, high = min(lows), max(highs)
        axes.plot(
            [low, high], [base + 0.13] * 2, color=SECOND, linewidth=3.0, solid_capstyle="butt", zorder=4
        )
        axes.plot([low, low], [base, base + 0.42], color=SECOND, linewidth=1.2, zorder=4)


def _decorate(axes: Axes, names: Sequence[str], right: float) -> None:
    axes.set_xscale("log")
    axes.set_xlim(_X_AXIS_MIN, right)
    axes.set_ylim(-0.15, len(names) - 0.05)
    axes.set_yticks(
        [len(names) - 1 - row for row in range(len(names))], [label(quantity_name(name)) for name in names]
    )
    axes.tick_params(axis="y", length=0, labelsize=9, colors=TEXT, pad=26)
    axes.tick_params(axis="x", which="both", labelsize=8, colors=TEXT, color=GRID)
    axes.minorticks_off()
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    _annotate_left(axes, "exact", len(names) - 0.4, 6, fontsize=7.5, annotation_clip=False)
    axes.set_xlabel("disagreement with Pinocchio, eps·scale", fontsize=9, color=TEXT)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.grid(axis="x", color=GRID, linewidth=0.5, alpha=0.6)
    axes.patch.set_visible(False)


_JOINT_KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")


def scene(model: ReportedModel, chains: list[Chain]) -> dict[str, Any]:
    """Return a robot as data for the script of the page, `assets/view3d.js`.

    The entry `joints` contains a list for each joint. The items of the list are:

    - the name, and the index of the kind in `_JOINT_KINDS`;
    - the indices of the parent link and of the child link;
    - the pose in the parent link: three rows of four numbers;
    - the axis (0: no axis), and the index in q (-1: no index);
    - the lower limit and the upper limit (None: no limit);
    - the mimic rule (0: no rule): the mimicked joint's index in q, the multiplier and the offset.
    """
    links = {name: i for i, name in enumerate(model["links"])}
    joints = {joint["name"]: i for i, joint in enumerate(model["joints"])}
    return {
        "links": model["links"],
        "nq": model["nq"],
        "joints": [_joint(model, i, links) for i in range(len(model["joints"]))],
        "tip": _link(model["tip"], links, joints),
        "chains": [
            {
                "base": _link(chain["base"], links, joints),
                "tip": _link(chain["tip"], links, joints),
                "standard": _table(chain["standard"], joints),
                "modified": _table(chain["modified"], joints),
            }
            for chain in chains
        ],
    }


def _joint(model: ReportedModel, i: int, links: dict[str, int]) -> list[Any]:
    joint = model["joints"][i]
    limit, mimic = joint["limit"], joint["mimic"]
    return [
        joint["name"],
        _JOINT_KINDS.index(joint["kind"]),
        links[joint["parent"]],
        links[joint["child"]],
        _three_rows(joint["placement"]),
        [_round_value(x) for x in joint["axis"]] if joint["axis"] else 0,
        -1 if joint["q"] is None else joint["q"],
        None if limit is None or limit["lower"] is None else _round_value(limit["lower"]),
        None if limit is None or limit["upper"] is None else _round_value(limit["upper"]),
        [joint["q"], mimic["multiplier"], mimic["offset"]] if mimic else 0,
    ]


def _table(table: ReportedDHTable, joints: dict[str, int]) -> dict[str, Any]:
    return {
        "base": _three_rows(table["base"]),
        "tool": _three_rows(table["tool"]),
        "rows": [
            [
                joints[row["joint"]],
                *(_round_value(row[key]) for key in ("a", "alpha", "beta", "d", "theta")),
                row["sense"],
            ]
            for row in table["rows"]
        ],
    }


def _link(frame: str, links: dict[str, int], joints: dict[str, int]) -> int:
    kind, _, rest = frame.partition(":")
    if kind in ("link", "joint") and (rest in links or rest in joints):
        frame = rest
    return links[frame] if frame in links else joints[frame] + 1


def _three_rows(T: Sequence[Sequence[float]]) -> list[float | int]:
    return [_round_value(x) for row in T[:3] for x in row]


def _round_value(value: float) -> float | int:
    rounded = float(f"{value:.7g}")
    return int(rounded) if rounded == int(rounded) else rounded
