"""One sheet with the panels that were asked for, and a foot that says what was checked."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.errors import UnknownNameError
from urdfkin.motion.frame_motion import FrameMotion
from urdfkin.motion.trajectory import Trajectory
from urdfkin.robot import Robot
from urdfkin.verify.pinocchio_module import version
from urdfkin.view.figure import label, new_figure, style
from urdfkin.view.plot.panels import COORDINATES, PANELS, Panel, coordinate_panels

if TYPE_CHECKING:
    from urdfkin.view.figure import Figure

_PANEL = (5.2, 2.3)
#: Letters of the foot that an inch has room for.
_LETTERS = 15
#: Letters that an axis' width has room for in its legend, and how many of them a line's own mark takes.
_LETTERS_OF_LEGEND, _HANDLE = 80, 8
#: What a check says nothing about.
_RATES_UNCHECKED = "Pinocchio checks the formulas at these q, v and a, not whether v and a are the rates of q"


def sheet(robot: Robot, x: FrameMotion, trajectory: Trajectory, panels: Sequence[str] = ()) -> Figure:
    """A figure of two columns.

    Args:
        robot: The robot.
        x: The frame's motion along the trajectory.
        trajectory: When, and how its rates were found.
        panels: Names out of `COORDINATES` and `PANELS`; none means all.

    Raises:
        UnknownNameError: no such panel.
        InputError: matplotlib is not installed.
    """
    drawn = _drawn(robot, trajectory, list(panels) or [*COORDINATES, *PANELS])
    columns = min(2, len(drawn))
    rows = -(-len(drawn) // columns)
    with style(font_size=9):
        figure = new_figure(_PANEL[0] * columns, _PANEL[1] * rows + 0.9)
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for axes in grid.flat[len(drawn) :]:
            axes.set_axis_off()
        for axes, panel in zip(grid.flat, drawn, strict=False):
            panel(axes, x, trajectory.t)
            axes.grid(color="#dddddd", linewidth=0.5)
            if names := axes.get_legend_handles_labels()[1]:
                across = max(1, min(7, _LETTERS_OF_LEGEND // (max(map(len, names)) + _HANDLE)))
                axes.legend(
                    fontsize=7, frameon=False, ncols=across, loc="lower left", bbox_to_anchor=(-0.02, 0.98)
                )
            axes.tick_params(labelbottom=True)
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        figure.suptitle(
            f"{label(f'{robot.name}: {x.frame}, {x.reference.name}')}\n{way(x, trajectory)}", fontsize=11
        )
        words = textwrap.wrap(label(foot(x, trajectory)), width=int(_LETTERS * _PANEL[0] * columns))
        figure.supxlabel("\n".join(words), fontsize=8, color="#444444")
    return figure


def _drawn(robot: Robot, trajectory: Trajectory, names: Sequence[str]) -> list[Panel]:
    found = list[Panel]()
    for name in names:
        if name in COORDINATES:
            found += coordinate_panels(robot, trajectory, name)
        elif name in PANELS:
            found.append(PANELS[name])
        else:
            raise UnknownNameError("panel", name, [*COORDINATES, *PANELS])
    return found


def way(x: FrameMotion, trajectory: Trajectory) -> str:
    """From where to where the frame goes, and in which time."""
    ends = [
        "({})".format(", ".join(f"{p:.3g}" for p in x.placement[k, :3, 3].round(9) + 0.0)) for k in (0, -1)
    ]
    return f"from {ends[0]} to {ends[1]} m in {trajectory.t[-1] - trajectory.t[0]:.4g} s"


def foot(x: FrameMotion, trajectory: Trajectory) -> str:
    """What was checked, and what was not, in a line."""
    rates = f"rates {trajectory.rates}" + (", exactly" if trajectory.exact else f"; {_RATES_UNCHECKED}")
    if x.not_verified is not None:
        return f"NOT VERIFIED by Pinocchio {version()}: {x.not_verified}; {rates}"
    worst = max(float(np.max(check.units, initial=0.0)) for check in x.checks.values())
    share = max(float(np.max(check.share, initial=0.0)) for check in x.checks.values())
    word = "verified by" if x.agrees else "DISAGREES with"
    return (
        f"{len(trajectory.t)} samples, {word} Pinocchio {version()}: worst disagreement {worst:.2g} eps*scale"
        f" ({share:.1%} of the bound); {rates}"
    )
