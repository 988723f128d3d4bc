"""Draw a chain with its Denavit-Hartenberg frames, joint axes and common normals, as SVG.

The picture is an orthographic view. Joint axes are dashed lines along z. Offsets d are grey and lie on the
joint axes. Lengths a are orange and lie on the common normals. The module needs the extra
`urdfkin[plots]`.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.table import DHConvention, DHTable
from urdfkin.errors import InputError
from urdfkin.model.tree import FloatArray
from urdfkin.view.figure import BLUE, ORANGE, VERMILION, label, new_figure, style

_X, _Z, _D, _A, _AXIS, _TEXT = VERMILION, BLUE, "#6b7280", ORANGE, "#9aa7b5", "#222222"

#: Direction of view: elevation and azimuth in the base frame, rad.
_ELEVATION, _AZIMUTH = math.radians(20.0), math.radians(-55.0)


def draw_table_svg(table: DHTable, q: ArrayLike | Mapping[str, float] | None = None) -> str:
    """Return an SVG drawing of the table's chain at one configuration.

    `q` contains joint positions (rad or m), or maps joint names to positions. None is the zero configuration.
    """
    frames = table.frames(q)
    if frames.ndim != 3:
        raise InputError(
            "a drawing needs exactly one configuration", found=f"a batch of shape {frames.shape[:-3]}"
        )
    with style(font_size=9):
        axes: Any = new_figure(10.0, 9.0).add_subplot()
        tip = frames[-1] @ table.tool
        points = np.concatenate(
            [frames[:, :3, 3], row_corners(table, frames), tip[None, :3, 3], np.zeros((1, 3))]
        )
        canvas = _Canvas(axes, _projection(), max(float(np.ptp(points, axis=0).max()), 1e-3))
        _draw(canvas, table, frames, tip)
        canvas.draw_labels()
        axes.set_aspect("equal")
        axes.set_axis_off()
        title = label(f"{table.robot}: {table.base_frame} to {table.tip_frame}")
        axes.set_title(f"{title}\n{table.convention} Denavit-Hartenberg frames", color=_TEXT)
        out = io.StringIO()
        axes.figure.savefig(out, format="svg", metadata={"Date": None}, bbox_inches="tight")
    return out.getvalue()


def _projection() -> FloatArray:
    """Return the picture's right and up directions (2, 3) in the base's axes."""
    ca, sa, ce, se = math.cos(_AZIMUTH), math.sin(_AZIMUTH), math.cos(_ELEVATION), math.sin(_ELEVATION)
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce]])


@dataclass
class _Canvas:
    """A two-dimensional drawing of points and directions in the base frame.

    `size` (m) is the largest extent of the chain along an axis of the base.
    """

    axes: Any
    projection: FloatArray
    size: float
    labels: list[tuple[FloatArray, FloatArray, str, str]] = field(default_factory=list)

    def line(self, start: FloatArray, end: FloatArray, **style: Any) -> None:
        (x, y), (u, v) = self.projection @ start, self.projection @ end
        self.axes.plot([x, u], [y, v], solid_capstyle="round", **style)

    def arrow(self, start: FloatArray, along: FloatArray, color: str, name: str) -> None:
        a, b = self.projection @ start, self.projection @ (start + along)
        look = {"arrowstyle": "-|>", "color": color, "lw": 1.5, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", xy=b, xytext=a, zorder=4, arrowprops=look)
        self.add_label(start + 1.25 * along, along, name, color)

    def mark(self, point: FloatArray, **style: Any) -> None:
        self.axes.plot(*(self.projection @ point)[:, None], zorder=5, **style)

    def add_label(self, point: FloatArray, along: FloatArray, text: str, color: str) -> None:
        self.labels.append((self.projection @ point, self.projection @ along, text, color))

    def draw_labels(self) -> None:
        """Join labels of one colour at about the same point, and move other close labels sideways."""
        merged: list[tuple[FloatArray, FloatArray, list[str], str]] = []
        for point, along, text, color in self.labels:
            for other, _, texts, other_color in merged:
                if color == other_color and np.linalg.norm(point - other) < 0.025 * self.size:
                    texts.append(text)
                    break
            else:
                merged.append((point, along, [text], color))
        occupied: list[FloatArray] = []
        for point, along, texts, color in merged:
            position, side = point.copy(), np.array([-along[1], along[0]])
            side *= 0.045 * self.size / max(float(np.linalg.norm(side)), 1e-12)
            for step in (1.0, -2.0, 3.0, -4.0):
                if all(np.linalg.norm(position - other) > 0.04 * self.size for other in occupied):
                    break
                position = position + step * side
            occupied.append(position)
            look = {"color": color, "ha": "center", "va": "center", "zorder": 6}
            # The background keeps a label legible on lines.
            look["bbox"] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.5}
            # Labels of x and z axes are formulas, such as $x_1$. Names of joints and frames are plain text,
            # because names may contain "$".
            self.axes.text(*position, ", ".join(texts), parse_math=color in (_X, _Z), **look)


def row_corners(table: DHTable, frames: FloatArray) -> FloatArray:
    """Return the corners (n, 3), one for each row of the table.

    A corner is the common end of the segments d and a.
    """
    corners = np.empty((len(table.rows), 3))
    for i, row in enumerate(table.rows):
        # In the standard convention, the offset d comes before the length a.
        if table.convention is DHConvention.STANDARD:
            x, z = frames[i + 1, :3, 0], frames[i + 1, :3, 2]
            normal = math.cos(row.beta) * x + math.sin(row.beta) * z
            corners[i] = frames[i + 1, :3, 3] - row.a * normal
        else:
            corners[i] = frames[i, :3, 3] + row.a * frames[i, :3, 0]
    return corners


def _draw(canvas: _Canvas, table: DHTable, frames: FloatArray, tip: FloatArray) -> None:
    size, standard = canvas.size, table.convention is DHConvention.STANDARD
    for i, (row, corner) in enumerate(zip(table.rows, row_corners(table, frames), strict=True)):
        first, second = (_D, _A) if standard else (_A, _D)
        canvas.line(frames[i, :3, 3], corner, color=first, linewidth=2.6)
        canvas.line(corner, frames[i + 1, :3, 3], color=second, linewidth=2.6)
        carrier = frames[i if standard else i + 1]
        origin, z = carrier[:3, 3], carrier[:3, 2]
        dashes = {"color": _AXIS, "linestyle": (0, (6, 4)), "linewidth": 0.9, "zorder": 1}
        canvas.line(origin - 0.2 * size * z, origin + 0.28 * size * z, **dashes)
        marker = {"marker": "o" if row.kind.turns else "s", "color": _TEXT, "markerfacecolor": "white"}
        canvas.mark(origin, markersize=5.5, **marker)
        canvas.add_label(origin - 0.24 * size * z, z, label(row.joint), "#6f7d8c")
    dots = {"color": _D, "linewidth": 1.2, "linestyle": ":"}
    canvas.line(np.zeros(3), frames[0, :3, 3], **dots)
    canvas.line(frames[-1, :3, 3], tip[:3, 3], **dots)
    for i, T in enumerate(frames):
        canvas.arrow(T[:3, 3], 0.13 * size * T[:3, 0], _X, f"$x_{{{i}}}$")
        canvas.arrow(T[:3, 3], 0.13 * size * T[:3, 2], _Z, f"$z_{{{i}}}$")
    canvas.mark(tip[:3, 3], marker="D", color=_TEXT, markersize=4.5)
    canvas.add_label(
        tip[:3, 3] - 0.07 * size * (tip[:3, 0] + tip[:3, 2]), tip[:3, 2], label(table.tip_frame), _TEXT
    )
