"""Draw the pictures of docs/tour.md into docs/images. This needs matplotlib (the extra `plots`)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import urdfkin
from urdfkin.compiled.breakdown import ACCELERATION_KINDS
from urdfkin.kinematics.bodies import MovingFrame, link_endpoint, link_endpoint_velocity, point_acceleration
from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import (
    angular_velocity_from_euler_rates,
    euler_condition,
    integrate_orientation,
    log_rotation,
    quaternion_of,
    rotation_about,
    rotation_from_euler,
    rotation_from_quaternion,
    turning_vector_rate,
)
from urdfkin.view.figure import BLUE, GREEN, ORANGE, PURPLE, VERMILION

IMAGES = Path(__file__).parents[1] / "docs" / "images"
INK, QUIET = "#1b2a3a", "#8a97a6"
AXES = (VERMILION, GREEN, BLUE)

STYLE: Any = {
    "font.size": 10,
    "font.family": "sans-serif",
    "axes.edgecolor": QUIET,
    "axes.titlesize": 11,
    **dict.fromkeys(("axes.labelcolor", "text.color", "xtick.color", "ytick.color"), INK),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    "figure.facecolor": "white",
    "svg.hashsalt": "urdfkin",
    "svg.fonttype": "none",
}


def draw_arrow(
    axes: Any, start: FloatArray, vector: FloatArray, color: str, label: str | None = None
) -> None:
    units: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1}
    axes.quiver(*start, *vector, color=color, width=0.007, zorder=4, label=label, **units)


def label_plane(axes: Any, title: str) -> None:
    axes.grid(color="#e6eaee", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set(aspect="equal", title=title, xlabel="x0 [m]", ylabel="y0 [m]")


def draw_one_link(figure: Any) -> None:
    """Draw a rotating link (figure 7.1)."""
    axes = figure.subplots()
    a1, rate = 0.8, 1.2
    circle = link_endpoint(np.linspace(0, 2 * np.pi, 200), a1)
    axes.plot(*circle.T, color=QUIET, linewidth=1, linestyle=":")
    for theta, ink in ((0.3, "#c3ccd6"), (1.1, "#8fa0b3"), (2.0, INK)):
        tip = link_endpoint(theta, a1)
        axes.plot([0, tip[0]], [0, tip[1]], color=ink, linewidth=5, solid_capstyle="round")
        draw_arrow(axes, tip, 0.4 * link_endpoint_velocity(theta, rate, a1), VERMILION)
    axes.plot(0, 0, "o", color=INK, markersize=8)
    axes.set(xlim=(-1.1, 1.15), ylim=(-0.95, 1.3))
    label_plane(axes, "7.2: the endpoint's velocity along y1\nis a1 times the joint velocity")


def draw_velocity_field(figure: Any) -> None:
    axes = figure.add_subplot(projection="3d")
    k = np.array([1.0, 0.4, 2.0]) / np.linalg.norm([1.0, 0.4, 2.0])
    x, y = np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7))
    points = np.stack((x, y, np.zeros_like(x)), axis=-1)
    field = turning_vector_rate(1.0 * k, points)
    speed = np.linalg.norm(field, axis=-1)
    colors = plt.get_cmap("viridis")(0.85 * speed.ravel() / speed.max())
    starts, vectors = points.reshape(-1, 3).T, (0.35 * field.reshape(-1, 3)).T
    axes.quiver(*starts, *vectors, colors=colors, arrow_length_ratio=0.3, linewidth=1.4)
    axes.quiver(*(-k), *(2 * k), color=INK, arrow_length_ratio=0.06, linewidth=2)
    axes.text(*(1.08 * k), "w")
    circle = rotation_about(k, np.linspace(0, 2 * np.pi, 100)) @ np.array([0.9, -0.5, 0.0])
    axes.plot(*circle.T, color=VERMILION, linewidth=1.2)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1), xlabel="x0 [m]", ylabel="y0 [m]", zlabel="z0 [m]")
    axes.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-1, 0, 1))
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=24, azim=-58)
    axes.set_title("7.21: the velocity of every point is w x p")


def draw_integral_of_w(figure: Any) -> None:
    """Draw example 7.3 (figure 7.9)."""
    cases = (("case 1: about x0, then about y0", (0, 1)), ("case 2: about y0, then about x0", (1, 0)))
    times = np.linspace(0.0, 2.0, 201)
    for row, (title, order) in enumerate(cases):

        def w(t: float, order: tuple[int, int] = order) -> FloatArray:
            axis: FloatArray = np.eye(3)[order[0 if t < 1.0 else 1]]
            return np.pi / 2 * axis

        quats = integrate_orientation(w, [0.0, 0.0, 0.0, 1.0], times)
        for column, step in enumerate((0, 100, 200)):
            axes = figure.add_subplot(2, 3, 3 * row + column + 1, projection="3d")
            for axis in 1.25 * np.eye(3):
                axes.quiver(0, 0, 0, *axis, color="#cfd6dd", arrow_length_ratio=0.06, linewidth=1)
            for axis, color, name in zip(rotation_from_quaternion(quats[step]).T, AXES, "xyz", strict=True):
                axes.quiver(0, 0, 0, *axis, color=color, arrow_length_ratio=0.12, linewidth=2.2)
                axes.text(*(1.16 * axis), name, color=color, ha="center", va="center")
            path = rotation_from_quaternion(quats[: step + 1])[:, :, 2]
            axes.plot(*path.T, color=BLUE, linewidth=1, linestyle=":")
            axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
            axes.set_box_aspect((1, 1, 1), zoom=1.35)
            axes.set_axis_off()
            axes.view_init(elev=22, azim=35)
            axes.set_title(f"{title}\nt = 0" if column == 0 else f"t = {column}", fontsize=9)


def plot_euler_singularity(figure: Any) -> None:
    axes = figure.subplots()
    middle = np.linspace(0.0, np.pi, 1801)[1:-1]
    for name, color, dashes, label in (("ZYZ", BLUE, "-", "ZYZ"), ("xyz", ORANGE, "--", "roll, pitch, yaw")):
        angles = np.stack((np.zeros_like(middle), middle, np.zeros_like(middle)), axis=-1)
        good = np.abs(np.cos(middle) if name == "xyz" else np.sin(middle)) > 1e-9
        degrees, condition = np.degrees(middle[good]), euler_condition(name, angles[good])
        axes.semilogy(degrees, condition, color=color, linestyle=dashes, label=label, linewidth=2)
    axes.set(xlabel="middle angle [degrees]", ylabel="condition number of Omega")
    axes.set(ylim=(0.9, 2e3), xlim=(0, 180), xticks=range(0, 181, 30))
    axes.grid(color="#e6eaee", linewidth=0.8)
    axes.legend(loc="upper center", ncols=2)
    axes.set_title("7.56: singularities of Euler angle rates")


def plot_convergence(figure: Any) -> None:
    def angles(t: float) -> FloatArray:
        return np.array([0.3 * t, 1.0 + 0.4 * np.sin(2.0 * t), t * t])

    def w(t: float) -> FloatArray:
        rates = np.array([0.3, 0.8 * np.cos(2.0 * t), 2.0 * t])
        return angular_velocity_from_euler_rates("ZYZ", angles(t), rates)

    steps = np.array([10, 20, 40, 80, 160, 320])
    end = rotation_from_euler("ZYZ", angles(2.0))
    start = quaternion_of(rotation_from_euler("ZYZ", angles(0.0)))
    errors = []
    for n in steps:
        quats = integrate_orientation(w, start, np.linspace(0.0, 2.0, n + 1))
        errors.append(np.linalg.norm(log_rotation(rotation_from_quaternion(quats[-1]).T @ end)))
    axes = figure.subplots()
    axes.loglog(2.0 / steps, errors, "o-", color=BLUE, linewidth=2, label="error at t = 2 s")
    fourth = errors[-1] * (steps[-1] / steps) ** 4
    axes.loglog(2.0 / steps, fourth, "--", color=QUIET, label="step to the fourth")
    axes.set(xlabel="step [s]", ylabel="error of the orientation [rad]")
    axes.grid(color="#e6eaee", linewidth=0.8, which="both")
    axes.legend()
    axes.set_title("Integration of equation 7.57: half the step gives 1/16 of the error")


def draw_acceleration_parts(figure: Any) -> None:
    """Draw a sliding point's acceleration (7.125)."""
    axes = figure.subplots()
    theta, w, alpha = 0.5, 1.4, 1.8
    z = np.array([0.0, 0.0, 1.0])
    arm = MovingFrame(rotation_about(z, theta), np.zeros(3), w * z, np.zeros(3), alpha * z)
    p_1, v_1, a_1 = [0.9, 0.0, 0.0], [0.6, 0.0, 0.0], [-0.5, 0.0, 0.0]
    parts = point_acceleration(arm, p_1, v_1, a_1)
    tip = arm.R_0_1 @ p_1
    reach = arm.R_0_1 @ [1.35, 0, 0]
    axes.plot([0, reach[0]], [0, reach[1]], color="#c3ccd6", linewidth=7, solid_capstyle="round", zorder=1)
    names = (("transverse", BLUE), ("centripetal", VERMILION), ("coriolis", ORANGE), ("relative", GREEN))
    start = tip
    for name, color in names:
        vector = 0.35 * getattr(parts, name)
        draw_arrow(axes, start[:2], vector[:2], color, name)
        _write_name(
            axes, start + 0.5 * vector, vector if name in ("transverse", "relative") else -vector, name
        )
        start = start + vector
    draw_arrow(axes, tip[:2], 0.35 * parts.total[:2], INK, "the sum")
    _write_name(axes, tip + 0.09 * parts.total, -parts.total, "the sum")
    axes.plot(*tip[:2], "o", color=INK, markersize=8, zorder=5)
    axes.plot(0, 0, "o", color=INK, markersize=8)
    axes.set(xlim=(-0.75, 1.45), ylim=(-0.2, 1.75))
    label_plane(axes, "7.125: the terms of a slider's acceleration, and their sum")


def _write_name(axes: Any, at: FloatArray, along: FloatArray, name: str) -> None:
    """Name an arrow for readers who cannot see colours."""
    side = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    place = at[:2] + 0.04 * side
    axes.text(*place, name, ha="left" if side[0] > 0.0 else "right", va="center", fontsize=9)


def draw_two_link(figure: Any) -> None:
    axes = figure.subplots()
    robot = urdfkin.load("planar_two_link")
    poses = np.array([[0.15, 0.35], [0.5, 1.0], [0.75, 1.7], [0.9, 2.5]])
    circle = np.stack((np.cos(np.linspace(0, 2 * np.pi, 100)), np.sin(np.linspace(0, 2 * np.pi, 100))))
    for q, ink in zip(poses, ("#c3ccd6", "#a9b6c4", "#8092a5", INK), strict=True):
        joints = robot.placement(q, ["link_1", "link_2", "tip"])[:, :2, 3]
        axes.plot(*joints.T, "-o", color=ink, linewidth=4, markersize=6, solid_capstyle="round", zorder=2)
        ellipse = joints[-1][:, np.newaxis] + 0.22 * robot.jacobian(q, "tip")[:2] @ circle
        axes.plot(*ellipse, color=PURPLE, linewidth=1.4, zorder=3)
        velocity = 0.22 * robot.velocity(q, [0.6, 0.8], "tip")[:2]
        draw_arrow(axes, joints[-1], velocity, VERMILION)
    axes.set(xlim=(-0.25, 1.1), ylim=(-0.1, 0.95))
    label_plane(axes, "7.90: the tip's velocities for joint velocities of norm 1")


def plot_breakdown(figure: Any) -> None:
    robot = urdfkin.load("elbow")
    q, v = [0.4, 0.5, 0.7, 0.3, 0.6, 0.2], [1.0, 0.8, -1.2, 2.0, 1.0, -1.0]
    parts = robot.acceleration_breakdown(q, v, [0.5, 1.0, -0.5, 1.0, 1.0, 1.0], "tool")
    axes = figure.subplots(1, 3, sharey=True)
    colors, hatches = (BLUE, VERMILION, ORANGE, GREEN), ("", "////", "--", "\\\\\\\\")
    for component, panel in enumerate(axes):
        for j in range(len(parts.joints)):
            above = below = 0.0
            for k, color in enumerate(colors):
                value = float(parts.terms[j, k, component])
                look: dict[str, Any] = {"color": color, "hatch": hatches[k], "edgecolor": "white"}
                look |= {"label": ACCELERATION_KINDS[k] if j == 0 else None, "width": 0.7, "linewidth": 0}
                panel.bar(j, value, bottom=above if value >= 0 else below, **look)
                above, below = (above + value, below) if value >= 0 else (above, below + value)
        panel.axhline(0, color=QUIET, linewidth=0.8)
        total = float(parts.total[component])
        panel.axhline(total, color=INK, linewidth=1.4, linestyle="--")
        panel.set_title(f"{'xyz'[component]}0: sum {total:+.2f}")
        panel.set_xticks(range(6), [str(j + 1) for j in range(6)])
        panel.set_xlabel("joint")
    axes[0].set_ylabel("linear acceleration [m/s²]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.suptitle("7.130: the tool's acceleration by joint and term", fontsize=11)


PICTURES: dict[str, tuple[Callable[[Any], None], tuple[float, float]]] = {
    "one-link": (draw_one_link, (5.2, 5.0)),
    "velocity-field": (draw_velocity_field, (5.6, 5.2)),
    "integral-of-w": (draw_integral_of_w, (7.6, 5.2)),
    "euler-singularity": (plot_euler_singularity, (6.2, 3.8)),
    "convergence": (plot_convergence, (5.6, 3.9)),
    "acceleration-parts": (draw_acceleration_parts, (5.6, 5.4)),
    "two-link": (draw_two_link, (5.8, 4.9)),
    "breakdown": (plot_breakdown, (8.2, 3.9)),
}


def main(folder: Path = IMAGES) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, (draw, size) in PICTURES.items():
            figure = plt.figure(figsize=size, layout="constrained")
            draw(figure)
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
            plt.close(figure)
            print(folder / f"{name}.svg")


if __name__ == "__main__":
    main()
