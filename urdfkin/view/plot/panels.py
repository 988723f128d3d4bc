"""The panels of `urdfkin plot`: what each draws of a frame's motion over time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from urdfkin.compiled.breakdown import KINDS
from urdfkin.kinematics.rotation import log_rotation
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.motion.frame_motion import FrameMotion

if TYPE_CHECKING:
    from urdfkin.view.figure import Axes

#: Draws into axes: motion and seconds.
Panel = Callable[["Axes", FrameMotion, FloatArray], None]

#: Okabe and Ito's colours, which differ for every kind of eye; line styles differ as well.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
STYLES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), "-")


def _lines(axes: Axes, t: FloatArray, rows: FloatArray, names: tuple[str, ...]) -> None:
    for k, name in enumerate(names):
        axes.plot(t, rows[:, k], color=COLOURS[k % 7], linestyle=STYLES[k % 7], label=name)


def position(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """The origin in the world."""
    _lines(axes, t, x.placement[:, :3, 3], ("x", "y", "z"))
    axes.set_ylabel("position [m]")


def orientation(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """The turn since the start: axis times angle, in world axes."""
    R = x.placement[:, :3, :3]
    _lines(axes, t, log_rotation(R @ R[0].T), ("x", "y", "z"))
    axes.set_ylabel("turned [rad]")


def velocity(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Linear rows."""
    _lines(axes, t, x.velocity[:, :3], ("x", "y", "z"))
    axes.set_ylabel("velocity [m/s]")


def angular_velocity(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Angular rows."""
    _lines(axes, t, x.velocity[:, 3:], ("x", "y", "z"))
    axes.set_ylabel("angular velocity [rad/s]")


def acceleration(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Linear rows, classical."""
    _lines(axes, t, x.acceleration[:, :3], ("x", "y", "z"))
    axes.set_ylabel("acceleration [m/s²]")


def angular_acceleration(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Angular rows."""
    _lines(axes, t, x.acceleration[:, 3:], ("x", "y", "z"))
    axes.set_ylabel("ang. acceleration [rad/s²]")


def parts(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """How large each kind of contribution to the linear acceleration is, and their sum."""
    sizes = np.linalg.norm(x.parts.by_kind[..., :3], axis=-1)
    total = np.linalg.norm(x.acceleration[:, :3], axis=-1)
    used = [k for k in range(len(KINDS)) if sizes[:, k].any()]
    names = tuple(KINDS[k] for k in used)
    _lines(axes, t, np.column_stack([sizes[:, used], total]), (*names, "all together"))
    axes.set_ylabel("parts, size [m/s²]")


def singular_values(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Of the whole Jacobian."""
    values = x.singular_values
    largest = values.max(initial=1.0)
    shown = np.where(values > EPS * largest, values, np.nan)
    _lines(axes, t, shown, tuple(f"σ{k + 1}" for k in range(values.shape[1])))
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylabel("singular values of J [SI]")


def manipulability(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """Yoshikawa's, of all rows and of the linear and angular ones."""
    rows = (slice(0, 6), slice(0, 3), slice(3, 6))
    values = np.column_stack([x.manipulability(part) for part in rows])
    _lines(axes, t, values, ("all rows", "linear", "angular"))
    axes.set_ylabel("manipulability [SI]")


def disagreement(axes: Axes, x: FrameMotion, t: FloatArray) -> None:
    """With Pinocchio at the same q, v and a, in eps * scale; thin, the bound; a cross where it is outside."""
    axes.set_ylabel("disagreement [eps·scale]\nthin: bound")
    if x.not_verified is not None:
        axes.text(0.5, 0.5, "not verified", transform=axes.transAxes, ha="center", va="center")
        return
    for k, (quantity, check) in enumerate(x.checks.items()):
        axes.plot(t, check.units, color=COLOURS[k % 7], linestyle=STYLES[k % 7], label=quantity)
        axes.plot(t, check.bound, color=COLOURS[k % 7], linewidth=0.6, linestyle=STYLES[k % 7])
        outside = check.share > 1.0
        if outside.any():
            axes.plot(t[outside], check.units[outside], "x", color="#B00020", label="outside the bound")
    # Bounds are a hundred times what is usual: below 1, which a rounding gives, the scale is plain.
    axes.set_yscale("symlog", linthresh=1.0)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylim(bottom=0.0)


#: Every panel by name, in the order of the sheet.
PANELS: dict[str, Panel] = {
    "position": position,
    "orientation": orientation,
    "velocity": velocity,
    "angular-velocity": angular_velocity,
    "acceleration": acceleration,
    "angular-acceleration": angular_acceleration,
    "parts": parts,
    "singular-values": singular_values,
    "manipulability": manipulability,
    "disagreement": disagreement,
}
