"""Plot a frame's motion along a trajectory, and the result of the check.

The module needs the extra `urdfkin[plots]`.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from urdfkin.compiled.breakdown import ACCELERATION_KINDS
from urdfkin.compiled.plan import IntArray
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import log_rotation
from urdfkin.kinematics.roundings import EPS
from urdfkin.model import configuration
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion
from urdfkin.robot.trajectory import Trajectory
from urdfkin.verify.pinocchio import version
from urdfkin.view.figure import BAD, COLOURS, label, new_figure, style

if TYPE_CHECKING:
    from urdfkin.view.figure import Axes, Figure


#: A panel draws one diagram, for example the frame's velocity. Its arguments are matplotlib's Axes, the
#: motion and the times (s).
Panel = Callable[["Axes", FrameMotion, FloatArray], None]

#: The dashes of seven lines. The first six lines are distinguishable without colours.
STYLES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), "-")


_LINEAR, _ANGULAR = slice(0, 3), slice(3, 6)
_MOST_NAMES = 14
_UNNAMED_COLOUR = "#9AA7B5"


def _draw_lines(axes: Axes, t: FloatArray, rows: FloatArray, names: Sequence[str]) -> None:
    for k, name in enumerate(names):
        axes.plot(t, rows[:, k], label=name, **_line_style(k))


def _line_style(k: int) -> dict[str, Any]:
    """Return the colour and the dashes of line k.

    The first 21 lines look different from each other.
    """
    return {"color": COLOURS[k % 7], "linestyle": STYLES[(k + 2 * (k // 7)) % 7]}


def _make_xyz_panel(vector: Callable[[FrameMotion], FloatArray], label: str) -> Panel:
    def panel(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
        _draw_lines(axes, t, vector(x), ("x", "y", "z"))
        axes.set_ylabel(label)

    return panel


def _rotation_vectors(x: FrameMotion) -> FloatArray:
    """Return the frame's rotation since the first sample, as rotation vectors (n, 3) in world axes (rad)."""
    R = x.placement[:, :3, :3]
    return log_rotation(R @ R[0].T)


def draw_acceleration_parts(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    sizes = np.linalg.norm(x.breakdown.by_kind[..., :3], axis=-1)
    total = np.linalg.norm(x.acceleration[:, :3], axis=-1)
    used = [k for k in range(len(ACCELERATION_KINDS)) if sizes[:, k].any()]
    names = tuple(ACCELERATION_KINDS[k] for k in used)
    _draw_lines(axes, t, np.column_stack([sizes[:, used], total]), (*names, "sum"))
    axes.set_ylabel("norms of the parts [m/s²]")


def draw_singular_values(axes: Axes, x: FrameMotion, t: FloatArray, rows: slice, unit: str) -> None:
    values = x.singular_values_of(rows)
    largest = values.max(initial=1.0)
    shown = np.where(values > EPS * largest, values, np.nan)
    _draw_lines(axes, t, shown, [f"σ{k + 1}" for k in range(values.shape[1])])
    axes.set_yscale("log")
    axes.minorticks_off()
    lower, upper = axes.get_ylim()
    # If the vertical axis has fewer than two powers of ten, the axis gets three ticks between its ends.
    if np.floor(np.log10(upper)) < np.ceil(np.log10(lower)) + 1.0:
        axes.set_yticks([float(f"{lower * (upper / lower) ** share:.2g}") for share in (0.1, 0.5, 0.9)])
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylabel(f"singular values\n[{unit}] at |v| = 1")


def draw_manipulability(axes: Axes, x: FrameMotion, t: FloatArray, rows: slice, unit: str) -> None:
    _draw_lines(axes, t, x.manipulability(rows)[:, np.newaxis], ("",))
    axes.set_ylabel(f"manipulability\n[{unit}]")
    axes.set_ylim(0.0, 1.08 * float(axes.dataLim.y1) or 1.0)


def draw_disagreement(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    axes.set_ylabel("disagreement [eps·scale]\nthin: bound")
    if x.unverified_reason is not None:
        axes.text(0.5, 0.5, "not verified", transform=axes.transAxes, ha="center", va="center")
        return
    for k, (quantity, check) in enumerate(x.checks.items()):
        axes.plot(t, check.units, label=quantity, **_line_style(k))
        axes.plot(t, check.bound, linewidth=0.6, **_line_style(k))
        outside = check.bound_ratio > 1.0
        if outside.any():
            axes.plot(t[outside], check.units[outside], "x", color=BAD, label="outside the bound")
    # Bounds are about a hundred times the usual disagreement, so the vertical axis is logarithmic. The axis
    # is linear between 0 and 1 eps * scale.
    axes.set_yscale("symlog", linthresh=1.0)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylim(bottom=0.0)


PANELS: dict[str, Panel] = {
    "position": _make_xyz_panel(lambda x: x.placement[:, :3, 3], "position [m]"),
    "orientation": _make_xyz_panel(_rotation_vectors, "rotation [rad]"),
    "velocity": _make_xyz_panel(lambda x: x.velocity[:, :3], "velocity [m/s]"),
    "angular-velocity": _make_xyz_panel(lambda x: x.velocity[:, 3:], "angular velocity\n[rad/s]"),
    "acceleration": _make_xyz_panel(lambda x: x.acceleration[:, :3], "acceleration [m/s²]"),
    "angular-acceleration": _make_xyz_panel(lambda x: x.acceleration[:, 3:], "ang. acceleration\n[rad/s²]"),
    "parts": draw_acceleration_parts,
    "singular-values": partial(draw_singular_values, rows=_LINEAR, unit="m/s"),
    "angular-singular-values": partial(draw_singular_values, rows=_ANGULAR, unit="rad/s"),
    "manipulability": partial(draw_manipulability, rows=_LINEAR, unit="(m/s)³"),
    "angular-manipulability": partial(draw_manipulability, rows=_ANGULAR, unit="(rad/s)³"),
    "disagreement": draw_disagreement,
}

#: Suffix of the unit "rad" or "m" for q, v and a.
_UNIT_SUFFIX = {"q": "", "v": "/s", "a": "/s²"}
#: "q", "v" and "a" select panels of the robot's coordinates. Angles, lengths and quaternions have separate
#: panels.
COORDINATE_PANELS = tuple(_UNIT_SUFFIX)


def make_coordinate_panels(robot: Robot, trajectory: Trajectory, what: str) -> list[Panel]:
    units = np.array(configuration.units(robot.tree, what))
    return [
        partial(
            _draw_coordinates, robot, trajectory, what, unit, np.flatnonzero(units == unit).astype(np.int64)
        )
        for unit in ("rad", "m", "")
        if (units == unit).any()
    ]


def _draw_coordinates(
    robot: Robot,
    trajectory: Trajectory,
    what: str,
    unit: str,
    indices: IntArray,
    axes: Axes,
    x: FrameMotion,
    t: FloatArray,
) -> None:
    """Draw the coordinates in `indices` that change during the trajectory.

    If no coordinate changes, all coordinates are drawn. If more than 14 coordinates are drawn, coordinates
    that are always within their limits are grey.
    """
    del x
    values: FloatArray = getattr(trajectory, what)
    names = robot.coordinate_names if what == "q" else robot.velocity_names
    moves = [i for i in indices if (values[:, i] != values[0, i]).any()] or list(indices)
    outside = {i: mask for i in moves if (mask := _outside(robot, what, i, values[:, i])).any()}
    named = moves if len(moves) <= _MOST_NAMES else [i for i in moves if i in outside]
    others = [i for i in moves if i not in named]
    for i in others:
        count = f"{len(others)} {'others' if named else 'joints'}" if i == others[0] else ""
        axes.plot(t, values[:, i], color=_UNNAMED_COLOUR, linewidth=0.7, label=count)
    _draw_lines(
        axes, t, values[:, named],
        [names[i] if k < _MOST_NAMES else "" for k, i in enumerate(named)],
    )  # fmt: skip
    bounds = {i: [x for x in _limits(robot, what, i) if np.isfinite(x)] for i in named}
    for k, i in enumerate(named):
        for bound in bounds[i]:
            axes.axhline(bound, linewidth=0.6, **_line_style(k))
    crosses = "outside the limits"
    for i, mask in outside.items():
        axes.plot(t[mask], values[mask, i], "x", color=BAD, markersize=3.0, label=crosses)
        crosses = ""
    bounded = any(bounds.values())
    name = f"{unit}{_UNIT_SUFFIX[what]}" if unit else "quaternion"
    axes.set_ylabel(f"{what} [{name}]" + ("\nthin: limits" if bounded else ""))


def _outside(robot: Robot, what: str, i: int, values: FloatArray) -> np.ndarray:
    """Return whether each value is outside the coordinate's limits.

    The double next to a limit counts as inside, because the limit's decimal notation may be rounded.
    """
    lower, upper = _limits(robot, what, i)
    return np.asarray((values < np.nextafter(lower, -np.inf)) | (values > np.nextafter(upper, np.inf)))


def _limits(robot: Robot, what: str, i: int) -> tuple[float, float]:
    if what == "q":
        return float(robot.limits[0, i]), float(robot.limits[1, i])
    largest = float(robot.velocity_limits[i]) if what == "v" else np.inf
    return -largest, largest


#: Width and maximum height of a figure, in inches. This size fits on A4 and US Letter with a margin.
_PAGE_SIZE = (7.6, 10.4)
#: Height of a panel, and height of the title and the footer together, in inches.
_PANEL_HEIGHT, _TEXT_HEIGHT = 2.1, 0.9
#: Numbers of letters per inch in the footer, and in a legend with the font size 6.
_LETTERS_PER_INCH, _LEGEND_LETTERS_PER_INCH = 16, 22
#: Width of a legend entry without its name (the line sample and the gaps), in letters.
_HANDLE_LETTERS = 8
_DERIVATIVES_UNCHECKED = (
    "Pinocchio checks the formulas at these q, v and a, not whether v and a are the derivatives of q"
)


def plot_motion(robot: Robot, x: FrameMotion, trajectory: Trajectory, panels: Sequence[str] = ()) -> Figure:
    """Return a figure with the named panels, or with all panels if no name is given.

    `PANELS` and `COORDINATE_PANELS` contain the names.
    """
    drawn = _select_panels(robot, trajectory, list(panels) or [*COORDINATE_PANELS, *PANELS])
    columns = min(3 if len(drawn) > 8 else 2, len(drawn))
    rows = -(-len(drawn) // columns)
    height = _PANEL_HEIGHT * max(2, rows) + _TEXT_HEIGHT
    width, small = _PAGE_SIZE[0], 6 if columns == 3 else 7
    with style(font_size=small + 1, axes_ymargin=0.08, lines_linewidth=1.2):
        figure = new_figure(width, min(height, _PAGE_SIZE[1]))
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for axes in grid.flat[len(drawn) :]:
            axes.set_axis_off()
        for axes, panel in zip(grid.flat, drawn, strict=False):
            panel(axes, x, trajectory.t)
            axes.grid(color="#dddddd", linewidth=0.5)
            if names := axes.get_legend_handles_labels()[1]:
                letters = _LEGEND_LETTERS_PER_INCH * width / columns * 6 / small
                across = max(1, min(7, int(letters) // (max(map(len, names)) + _HANDLE_LETTERS)))
                axes.legend(
                    fontsize=small,
                    frameon=False,
                    ncols=across,
                    handlelength=1.8,
                    columnspacing=1.0,
                    loc="lower left",
                    bbox_to_anchor=(-0.03, 0.98),
                )
            axes.tick_params(labelbottom=True)
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        title = label(f"{robot.name}: {x.frame}, {x.reference.name}")
        figure.suptitle(f"{title}\n{_endpoints_text(x, trajectory)}", fontsize=10)
        words = textwrap.wrap(label(check_summary(x, trajectory)), width=int(_LETTERS_PER_INCH * width))
        figure.supxlabel("\n".join(words), fontsize=7, color="#444444")
    return figure


def _select_panels(robot: Robot, trajectory: Trajectory, names: Sequence[str]) -> list[Panel]:
    found = list[Panel]()
    for name in names:
        if name in COORDINATE_PANELS:
            found += make_coordinate_panels(robot, trajectory, name)
        elif name in PANELS:
            found.append(PANELS[name])
        else:
            raise UnknownNameError("panel", name, [*COORDINATE_PANELS, *PANELS])
    if not found:
        raise InputError(
            "no panel to draw, because no joint of the robot moves",
            found=", ".join(names),
            remedy=f"choose other panels, such as {next(iter(PANELS))}",
        )
    return found


def _endpoints_text(x: FrameMotion, trajectory: Trajectory) -> str:
    start, end = (", ".join(f"{p:.3g}" for p in x.placement[k, :3, 3].round(9) + 0.0) for k in (0, -1))
    return f"from ({start}) to ({end}) m in {trajectory.t[-1] - trajectory.t[0]:.4g} s"


def check_summary(x: FrameMotion, trajectory: Trajectory) -> str:
    """Return one line with the result of the check, and with the source of v and a."""
    rates = f"rates {trajectory.rates_source}" + (
        ", exactly" if trajectory.exact else f"; {_DERIVATIVES_UNCHECKED}"
    )
    if x.unverified_reason is not None:
        return f"NOT VERIFIED by Pinocchio {version()}: {x.unverified_reason}; {rates}"
    worst = max(float(np.max(check.units, initial=0.0)) for check in x.checks.values())
    share = max(float(np.max(check.bound_ratio, initial=0.0)) for check in x.checks.values())
    verdict = "verified by" if x.agrees else "DISAGREES with"
    return (
        f"{len(trajectory.t)} samples, {verdict} Pinocchio {version()}: worst disagreement {worst:.2g}"
        f" eps*scale ({share:.1%} of the bound); {rates}"
    )
