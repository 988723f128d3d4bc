"""Plot the times of all contenders, and urdfkin's time for several numbers of joints and batch sizes."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from urdfkin.view.figure import BLUE, GREEN, VERMILION, figure_bytes, new_figure, style

#: Colour, hatch and legend for each prefix of a contender's name.
KINDS = {
    "urdfkin": (BLUE, "", "urdfkin"),
    "Pinocchio": (VERMILION, "////", "Pinocchio"),
    "generated": (GREEN, "--", "generated code"),
    "output": ("#CCCCCC", "", "writing the output only"),
    "": ("#999999", "\\\\\\\\", "others"),
}
MARKS = {"jacobian": ("o", "-"), "acceleration": ("s", "--")}
TITLES = {"jacobian": "Jacobian", "acceleration": "acceleration"}

#: A `Row` as a mapping.
Entry = Mapping[str, Any]


def draw(figures: Mapping[str, Any], path: Path) -> bytes:
    rows = figures["rows"]
    with style(font_size=11, svg_fonttype="none", hatch_linewidth=0.8):
        figure = new_figure(11.0, 12.0)  # The longest name of a contender fits into this width.
        grid = figure.add_gridspec(3, 2, height_ratios=[1.2, 1.2, 1.0])
        for row, quantity in enumerate(MARKS):
            bars = figure.add_subplot(grid[row, :])
            _draw_bars(bars, _select_rows(rows, "batch", quantity), quantity)
        if rows:
            bars.legend(frameon=False, loc="upper right")
        _draw_growth(figure.add_subplot(grid[2, 0]), rows, "joints", "joints of a chain", "joint")
        _draw_growth(
            figure.add_subplot(grid[2, 1]), rows, "sizes", "configurations in a batch", "configuration"
        )
        return (
            _shrink_svg(figure_bytes(figure, path)) if path.suffix == ".svg" else figure_bytes(figure, path)
        )


def _shrink_svg(svg: bytes) -> bytes:
    """Remove comments, indentation and fallback fonts."""
    text = re.sub(r"<!--.*?-->", "", svg.decode(), flags=re.DOTALL)
    text = re.sub(r"('DejaVu Sans'|DejaVu Sans)(, [^;\"]*)?", "sans-serif", text)
    return re.sub(r"\s*\n\s*", "\n", text).encode()


def _select_rows(rows: Sequence[Entry], section: str, quantity: str) -> list[Entry]:
    found = [row for row in rows if row["section"] == section and row["quantity"] == quantity]
    return [row for row in found if section == "joints" or row["robot"] == found[0]["robot"]]


def _draw_bars(axes: Any, rows: Sequence[Entry], quantity: str) -> None:
    ordered = sorted(rows, key=lambda row: -float(row["median_ns"]))
    costs = [row["median_ns"] for row in ordered]
    names = [row["label"] for row in ordered]
    kinds = [next(word for word in KINDS if name.startswith(word)) for name in names]
    for word, (colour, hatch, name) in KINDS.items():
        places = [i for i, kind in enumerate(kinds) if kind == word]
        if places:
            axes.barh(
                places, [costs[i] for i in places], color=colour, hatch=hatch, edgecolor="white", linewidth=0,
                height=0.7, label=name,
            )  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    for i, cost in enumerate(costs):
        axes.text(cost * 1.1, i, f"{cost:,.0f}" if cost >= 10 else f"{cost:.1f}", va="center")
    axes.set_xlabel("time [ns]")
    axes.set_xscale("log")
    axes.set_xlim(0.5 * min(costs, default=1.0), 6 * max(costs, default=1.0))
    _format_ticks(axes)
    robot = rows[0]["robot"] if rows else ""
    axes.set_title(f"{robot}, {TITLES[quantity]}: time for one configuration", loc="left", fontsize=12)


def _draw_growth(axes: Any, rows: Sequence[Entry], section: str, label: str, unit: str) -> None:
    for quantity, (mark, line) in MARKS.items():
        chosen = [row for row in _select_rows(rows, section, quantity) if row["label"].startswith("urdfkin")]
        sizes = [row["size"] for row in chosen]
        costs = [row["median_ns"] / (row["size"] if section == "joints" else 1) for row in chosen]
        axes.plot(sizes, costs, color=BLUE, marker=mark, linestyle=line, label=TITLES[quantity])
    axes.set_xscale("log")
    _format_ticks(axes)
    if sizes := sorted({row["size"] for row in rows if row["section"] == section}):
        axes.set_xticks(sizes, [f"{size:,}" for size in sizes])
    axes.set_ylim(0.0, 1.1 * max(float(axes.dataLim.y1), 1.0) if rows else None)
    axes.set_xlabel(label)
    axes.set_ylabel("time [ns]")
    axes.set_title(f"urdfkin, 1 thread: time for one {unit}", loc="left", fontsize=12)
    axes.legend(frameon=False)


def _format_ticks(axes: Any) -> None:
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:,.0f}" if x >= 1 else f"{x:g}")
    axes.minorticks_off()
