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
from urdfkin.view.plot.panels import PANELS

if TYPE_CHECKING:
    from urdfkin.view.figure import Figure

_PANEL = (5.2, 2.3)
#: Letters of the foot that an inch has room for.
_LETTERS = 15
#: What a check says nothing about.
_RATES_UNCHECKED = "Pinocchio checks the formulas at these q, v and a, not whether v and a are the rates of q"


def sheet(robot: Robot, x: FrameMotion, trajectory: Trajectory, panels: Sequence[str] = ()) -> Figure:
    """A figure of two columns.

    Args:
        robot: The robot.
        x: The frame's motion along the trajectory.
        trajectory: When, and how its rates were found.
        panels: Names out of `PANELS`; none means all.

    Raises:
        UnknownNameError: no such panel.
        InputError: matplotlib is not installed.
    """
    names = list(panels) or list(PANELS)
    for name in names:
        if name not in PANELS:
            raise UnknownNameError("panel", name, PANELS)
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    with style(font_size=9):
        figure = new_figure(_PANEL[0] * columns, _PANEL[1] * rows + 0.9)
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for axes in grid.flat[len(names) :]:
            axes.set_axis_off()
        for axes, name in zip(grid.flat, names, strict=False):
            PANELS[name](axes, x, trajectory.t)
            axes.grid(color="#dddddd", linewidth=0.5)
            if axes.get_legend_handles_labels()[0]:
                axes.legend(fontsize=7, frameon=False, ncols=7, loc="upper left", bbox_to_anchor=(0.0, 1.16))
            axes.tick_params(labelbottom=True)
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        figure.suptitle(
            f"{label(f'{robot.name}: {x.frame}, {x.reference.name}')}\n{way(x, trajectory)}", fontsize=11
        )
        words = textwrap.wrap(label(foot(x, trajectory)), width=int(_LETTERS * _PANEL[0] * columns))
        figure.supxlabel("\n".join(words), fontsize=8, color="#444444")
    return figure


def way(x: FrameMotion, trajectory: Trajectory) -> str:
    """From where to where the frame goes, and in which time."""
    ends = ["({})".format(", ".join(f"{p:.3g}" for p in x.placement[k, :3, 3].round(9))) for k in (0, -1)]
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
