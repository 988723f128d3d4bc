"""Define the viewer: a robot in a browser tab, beside a panel with sliders and checked numbers."""

from __future__ import annotations

import math
import re
import sys
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from urdfkin.dh.table import DHTable
from urdfkin.errors import UrdfkinError
from urdfkin.errors.escape import escape_unprintable, markdown_text
from urdfkin.model.configuration import degrees_messages, parse_finite
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.conventions import Conversion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, Joint
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.robot.trajectory import Trajectory
from urdfkin.verify.pinocchio import version
from urdfkin.view.player import Player, as_png
from urdfkin.view.scene import Shape
from urdfkin.view.stage import (
    NAME_CHOICES,
    PART_COLOURS,
    SEE_THROUGH,
    SHAPE_CHOICES,
    SOLID,
    Stage,
    acceleration_arrows,
    jacobian_arrows,
    velocity_ellipsoid,
)

#: Joint ranges (rad, m) and velocity limits (rad/s, m/s) of at least this size count as unlimited.
_UNLIMITED_RANGE = 100.0
#: Step of a slider for an angle or a derivative of an angle, in degrees and in radians. An arrow key changes
#: the value by one step.
_STEP_DEGREES, _STEP_RADIANS = 1.0, 0.01
#: Minimum number of steps of a slider for a length or a derivative of a length. The slider's step is 1, 2 or
#: 5 times a power of ten.
_MIN_STEPS = 50.0
_DIGITS, _DIGITS_OF_DEGREES = 4, 2
#: Largest joint velocity (rad/s, m/s) of a slider if the joint has no velocity limit. Largest joint
#: acceleration (rad/s^2, m/s^2) of a slider.
_VELOCITY, _ACCELERATION = 3.0, 5.0
#: Maximum number of missing meshes that a message names.
_MOST_MISSING = 5


@dataclass(frozen=True, slots=True)
class SliderRow:
    """A slider for one number of q, v or a. `is_angle` is also True for derivatives of angles."""

    index: int
    name: str
    is_angle: bool
    lower: float
    upper: float


class Sliders:
    """A group of sliders in the viewer's panel, for example for all joint velocities.

    The text `unit_suffix` follows the unit: "" for q, "/s" for v, "/s²" for a. `on_change` receives the index
    and the new number when the user moves a slider, but not when the program sets a slider.
    """

    def __init__(
        self,
        gui: Any,
        folder: Any,
        rows: Iterable[SliderRow],
        unit_suffix: str,
        on_change: Callable[[int, float], None],
    ) -> None:
        self._gui, self._folder, self.rows, self._unit_suffix, self._on_change = (
            gui,
            folder,
            list(rows),
            unit_suffix,
            on_change,
        )
        self._is_setting = False
        self.handles: list[Any] = []

    def build(self, values: FloatArray, *, degrees: bool) -> None:
        orders = [handle.order for handle in self.handles] or [None] * len(self.rows)
        for handle in self.handles:
            handle.remove()
        self._degrees = degrees
        with self._folder:
            self.handles = [
                self._slider(row, float(values[row.index]), order)
                for row, order in zip(self.rows, orders, strict=True)
            ]

    def _slider(self, row: SliderRow, value: float, order: float | None) -> Any:
        scale = self._scale(row)
        lower, upper = self._range(row, value)
        unit = ("deg" if self._degrees else "rad") if row.is_angle else "m"
        handle = self._gui.add_slider(
            f"{row.name} [{unit}{self._unit_suffix}]",
            min=scale * lower,
            max=scale * upper,
            step=self._step(row, upper - lower),
            initial_value=scale * value,
            marks=_marks(scale * lower, scale * upper),
            order=order,
        )
        handle.precision = _DIGITS_OF_DEGREES if row.is_angle and self._degrees else _DIGITS
        handle.on_update(lambda _: self._on_update(row, handle))
        return handle

    def _on_update(self, row: SliderRow, handle: Any) -> None:
        if self._is_setting:
            return
        scale = self._scale(row)
        # The browser rounds a value at an end of the slider, so the value can be beyond this end.
        lower, upper = (
            limit if end == scale * limit else end / scale
            for end, limit in ((handle.min, row.lower), (handle.max, row.upper))
        )
        self._on_change(row.index, min(max(float(handle.value) / scale, lower), upper))

    def show(self, values: FloatArray) -> None:
        self._is_setting = True
        try:
            for row, handle in zip(self.rows, self.handles, strict=True):
                value, scale = float(values[row.index]), self._scale(row)
                lower, upper = (scale * end for end in self._range(row, value))
                if (handle.min, handle.max) != (lower, upper):
                    handle.min, handle.max = lower, upper
                    handle._marks = tuple(
                        replace(mark, value=end, label=label)
                        for mark, (end, label) in zip(handle._marks, _marks(lower, upper), strict=True)
                    )
                # An unchanged value is not set again, because the conversion to degrees could change its last
                # digits.
                if float(handle.value) / scale != value:
                    handle.value = scale * value
        finally:
            self._is_setting = False

    def _scale(self, row: SliderRow) -> float:
        return math.degrees(1.0) if row.is_angle and self._degrees else 1.0

    def _step(self, row: SliderRow, width: float) -> float:
        if row.is_angle:
            return _STEP_DEGREES if self._degrees else _STEP_RADIANS
        size = max(width / _MIN_STEPS, sys.float_info.min)
        power = 10.0 ** math.floor(math.log10(size))
        return next(power * digit for digit in (5.0, 2.0, 1.0) if power * digit <= size * (1.0 + 1e-9))

    @staticmethod
    def _range(row: SliderRow, value: float) -> tuple[float, float]:
        return min(row.lower, value), max(row.upper, value)


def _marks(lower: float, upper: float) -> tuple[tuple[float, str], tuple[float, str]]:
    first, last = (f"{round(x, 1):g}" if abs(x) >= 1.0 else f"{x:.2g}" for x in (lower, upper))
    return (lower, first), (upper, last)


def coordinate_rows(robot: Robot) -> list[SliderRow]:
    """Return the data of a slider for each coordinate that can change, except quaternions.

    For a coordinate without limits, the range is from -pi to pi rad, or from -1 to 1 m.
    """
    rows = []
    for joint, at in zip(robot.tree.joints, robot.tree.q_index, strict=True):
        for k in range(min(joint.nq, 3)):
            turns = _is_angle(joint, k)
            lower, upper = _limits(joint, math.pi if turns else 1.0)
            if upper > lower:
                rows.append(SliderRow(at + k, robot.coordinate_names[at + k], turns, lower, upper))
    return rows


def fixed_coordinates(robot: Robot) -> list[str]:
    lower, upper = robot.limits
    return [robot.coordinate_names[i] for i in np.flatnonzero(lower == upper)]


def velocity_rows(robot: Robot, *, second: bool) -> list[SliderRow]:
    rows = []
    for joint, at in zip(robot.tree.joints, robot.tree.v_index, strict=True):
        for k in range(joint.nv):
            most = _ACCELERATION if second else _VELOCITY
            if not second and joint.limit is not None and 0.0 < joint.limit.velocity < _UNLIMITED_RANGE:
                most = joint.limit.velocity
            turns = k >= 3 if joint.nv == 6 else _is_angle(joint, k)
            rows.append(SliderRow(at + k, robot.velocity_names[at + k], turns, -most, most))
    return rows


def _is_angle(joint: Joint, k: int) -> bool:
    return joint.kind.turns or (joint.nv == 3 and k == 2)


def _limits(joint: Joint, otherwise: float) -> tuple[float, float]:
    limit = joint.limit
    if limit is None or joint.kind.value == "continuous" or not limit.upper - limit.lower < _UNLIMITED_RANGE:
        return -otherwise, otherwise
    return limit.lower, limit.upper


def within_limits(robot: Robot, q: FloatArray) -> FloatArray:
    return np.clip(q, *robot.limits)


def format_values(values: FloatArray) -> str:
    """Return numbers as text without loss of digits, in a form that `--q` and `set_q` read."""
    return ",".join(repr(float(value)) for value in values)


def describe_motion(x: FrameMotion) -> str:
    rows = [
        ("position", "m", x.placement[0, :3, 3]),
        ("velocity", "m/s", x.velocity[0, :3]),
        ("ang. velocity", "rad/s", x.velocity[0, 3:]),
        ("acceleration", "m/s²", x.acceleration[0, :3]),
        ("ang. acceleration", "rad/s²", x.acceleration[0, 3:]),
    ]
    lines = [
        f"**{markdown_text(x.frame)}**, {x.reference.name}",
        "",
        "| | x | y | z |",
        "| --- | ---: | ---: | ---: |",
    ]
    lines += [f"| {name} [{unit}] | {' | '.join(map(_number, vector))} |" for name, unit, vector in rows]
    lines += [
        "",
        f"singular values of J: {', '.join(map(_number, x.singular_values[0]))}",
        "",
        f"manipulability: {_number(x.manipulability()[0])},"
        f" linear {_number(x.manipulability(slice(0, 3))[0])}",
        "",
        check_line(x),
    ]
    return "\n".join(lines)


def check_line(x: FrameMotion) -> str:
    if x.unverified_reason is not None:
        return f"**! not verified** by Pinocchio {version()}: {markdown_text(x.unverified_reason)}"
    figures = ", ".join(f"{quantity} {check.units[0]:.2g}" for quantity, check in x.checks.items())
    mark = "**✓ verified** by" if x.agrees else "**✗ disagrees** with"
    return f"{mark} Pinocchio {version()}, eps·scale: {figures}"


def missing_words(missing: Iterable[Shape]) -> str:
    names = list(dict.fromkeys(shape.address or shape.link for shape in missing))
    shown = "".join(f"\n- {markdown_text(name)}" for name in names[:_MOST_MISSING])
    more = f"\n- and {len(names) - _MOST_MISSING} more" if len(names) > _MOST_MISSING else ""
    packages = any(name.startswith(("package://", "model://")) for name in names)
    remedy = (
        "Set `ROS_PACKAGE_PATH` to the folder that contains the packages of the meshes."
        if packages
        else "Copy the mesh files to the paths that the URDF names."
    )
    what = f"{len(names)} mesh{'es' if len(names) > 1 else ''} not shown"
    return f"**! {what}**, so the skeleton is shown. {remedy}\n{shown}{more}"


def legend() -> str:
    return " ".join(
        f'<span style="color: rgb{colour}">■</span> {name}' for name, colour in PART_COLOURS.items()
    )


def _number(value: float | FloatArray) -> str:
    rounded = round(float(value), 12)  # NumPy's `round` returns inf for numbers above 1.8e296.
    return f"{rounded:.4g}" if rounded else "0"


_REFERENCES = tuple(reference.name.lower() for reference in Reference)


class Viewer:
    """A robot in a browser tab. `q` (nq,) is the configuration of the sliders, in rad and m."""

    def __init__(
        self,
        server: Any,
        robot: Robot,
        q: ConfigurationLike | None = None,
        trajectory: Trajectory | None = None,
        conversion: Conversion | None = None,
    ) -> None:
        self.server, self.robot, self._conversion = server, robot, conversion
        self.stage = Stage(server, robot)
        self._start = within_limits(robot, robot.neutral())
        self.q = self._start if q is None else parse_finite(robot.tree, q, "q").copy()
        self.v, self.a = np.zeros(robot.nv), np.zeros(robot.nv)
        self._rng = np.random.default_rng(0)
        self._table: DHTable | None = None
        self._lock = threading.RLock()
        self.player: Player | None = None
        self._build(trajectory)
        self._set_initial_camera()
        self._write_q_field()
        self.update()
        if self.player is not None:
            self.player.check_trajectory()
            self.player.show(0)

    def _set_initial_camera(self) -> None:
        q = self.q[np.newaxis]
        if self.player is not None:
            samples = self.player.trajectory.q
            q = np.concatenate([q, samples[np.linspace(0, len(samples) - 1, 50).astype(int)]])
        self.stage.set_initial_camera(self.robot.placement(q, self.robot.link_frames, verify=False))

    def _reset_camera(self) -> None:
        with self._lock:
            self._set_initial_camera()
            self.stage.reset_cameras()

    @property
    def file_name(self) -> str:
        return re.sub(r"[^A-Za-z0-9_-]+", "-", self.robot.name).strip("-") or "robot"

    # -- controls ------------------------------------------------------------------------------------

    def _build(self, trajectory: Trajectory | None) -> None:
        gui, robot = self.server.gui, self.robot
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()  # The controls do not cover the picture.
        gui.set_panel_label(escape_unprintable(robot.name))
        if self.stage.missing:
            gui.add_markdown(missing_words(self.stage.missing))
        if trajectory is not None:
            self.player = Player(self, trajectory)
        with gui.add_folder("Show"):
            self.shapes = gui.add_dropdown("shapes", SHAPE_CHOICES)
            self.axes = gui.add_checkbox("link frames", initial_value=False)
            self.dh = gui.add_dropdown("DH frames", ("none", "standard", "modified"))
            self.dh_words = gui.add_markdown("")
            camera, picture = gui.add_button("reset camera"), gui.add_button("save a picture (PNG)")
        joints = gui.add_folder("Joints")
        with joints:
            self.units = gui.add_dropdown("angles", ("degrees", "radians"))
        self.sliders = Sliders(gui, joints, coordinate_rows(robot), "", partial(self._move, "q"))
        self.sliders.build(self.q, degrees=True)
        with joints:
            if fixed := fixed_coordinates(robot):
                gui.add_markdown(f"joints fixed by equal limits: {markdown_text(', '.join(fixed))}")
            tool = "" if self._conversion is None else f" of {self._conversion.convention.name}"
            self.words_of_q = gui.add_text(
                escape_unprintable(f"q{tool}, to copy or type"),
                "",
                hint="Write values as in --q: 0.5, 30deg, ready, ready,elbow=30deg.",
            )
            self.wrong = gui.add_markdown("")
            neutral, random = gui.add_button("neutral, within the limits"), gui.add_button("random")
        with gui.add_folder("Frame"):
            self.frame = gui.add_dropdown("frame", robot.frame_names, initial_value=self._tip())
            self.reference = gui.add_dropdown("reference", _REFERENCES, initial_value="local_world_aligned")
            self.words = gui.add_markdown("")
        with gui.add_folder("Show more"):
            self.skeleton = gui.add_checkbox("skeleton", initial_value=self.stage.skeleton_shown)
            self.names = gui.add_dropdown("names", NAME_CHOICES)
            self.columns = gui.add_dropdown("Jacobian's columns", ("none", "linear", "angular"))
            self.ellipsoid = gui.add_dropdown("velocity ellipsoid", ("none", "linear", "angular"))
            self.parts = gui.add_checkbox("acceleration's parts", initial_value=False)
            gui.add_markdown(legend())
        self._build_velocities()
        for handle in (self.frame, self.reference):
            handle.on_update(lambda _: self._update_dh_table())
        self.dh.on_update(lambda _: self._update_convention())
        for handle in (
            self.shapes, self.skeleton, self.axes, self.names, self.columns, self.ellipsoid, self.parts
        ):  # fmt: skip
            handle.on_update(lambda _: self.update())
        self.units.on_update(lambda _: self._change_units())
        self.words_of_q.on_update(self._read_q_field)
        neutral.on_click(lambda _: self.set_q(self._start))
        random.on_click(lambda _: self.set_q(robot.sample(1, int(self._rng.integers(2**31)))[0]))
        camera.on_click(lambda _: self._reset_camera())
        picture.on_click(lambda event: self._save(event.client))

    def _build_velocities(self) -> None:
        gui, robot = self.server.gui, self.robot
        with gui.add_folder("Joint velocities, accelerations", expand_by_default=False):
            rest, random = gui.add_button("at rest"), gui.add_button("random")
            first = gui.add_folder("v, joint velocities", expand_by_default=True)
            second = gui.add_folder("a, joint accelerations", expand_by_default=False)
        self.rates = Sliders(gui, first, velocity_rows(robot, second=False), "/s", partial(self._move, "v"))
        self.second_rates = Sliders(
            gui, second, velocity_rows(robot, second=True), "/s²", partial(self._move, "a")
        )
        for sliders, values in ((self.rates, self.v), (self.second_rates, self.a)):
            sliders.build(values, degrees=True)
        rest.on_click(lambda _: self.set_velocities(np.zeros(robot.nv), np.zeros(robot.nv)))
        random.on_click(lambda _: self.set_velocities(*self._rng.uniform(-1.0, 1.0, (2, robot.nv))))

    def _tip(self) -> str:
        tip = self.robot.tip_frame
        return tip if tip in self.robot.frame_names else self.robot.frame_names[-1]

    def _move(self, letter: str, at: int, value: float) -> None:
        with self._lock:
            vector = getattr(self, letter).copy()
            vector[at] = value
            setattr(self, letter, vector)
            if letter == "q":
                self._write_q_field()
            self.update()

    def set_q(self, q: ConfigurationLike) -> None:
        with self._lock:
            self.set_state(parse_finite(self.robot.tree, q, "q"), self.v, self.a)

    def set_velocities(self, v: FloatArray, a: FloatArray) -> None:
        with self._lock:
            self.v, self.a = v, a
            self.rates.show(v)
            self.second_rates.show(a)
            self.update()

    def set_state(self, q: FloatArray, v: FloatArray, a: FloatArray) -> None:
        with self._lock:
            self.q, self.v, self.a = q.copy(), v.copy(), a.copy()
            for sliders, values in self._sliders_and_values():
                sliders.show(values)
            self._write_q_field()
            self.update()

    def _sliders_and_values(self) -> list[tuple[Sliders, FloatArray]]:
        return [(self.sliders, self.q), (self.rates, self.v), (self.second_rates, self.a)]

    def _save(self, client: Any) -> None:
        if client is not None:
            height, width = client.camera.image_height, client.camera.image_width
            picture = as_png(client.get_render(height=height, width=width, timeout=60.0))
            client.send_file_download(f"{self.file_name}.png", picture, save_immediately=True)

    def _write_q_field(self) -> None:
        self.words_of_q.value = format_values(
            self.q if self._conversion is None else self._conversion.to(self.q)
        )
        self.wrong.content = ""

    def _read_q_field(self, event: Any) -> None:
        if event.client is None:
            return
        with self._lock:
            try:
                q = self.words_of_q.value
                if self._conversion is not None:
                    q = self._conversion.from_(self._conversion.layout("q").parse(q))
                self.q = parse_finite(self.robot.tree, q, "q", warn=False).copy()
            except UrdfkinError as error:
                self.wrong.content = markdown_text(str(error))
                return
            # The text field keeps the text that the user typed.
            self.wrong.content = markdown_text("; ".join(degrees_messages(self.robot.tree, self.q)))
            self.sliders.show(self.q)
            self.update()

    def _change_units(self) -> None:
        with self._lock:
            for sliders, values in self._sliders_and_values():
                sliders.build(values, degrees=self.units.value == "degrees")

    def _update_convention(self) -> None:
        """Make shapes transparent while a table is shown, because frames of the table are inside shapes."""
        with self._lock:
            shown = self.dh.value != "none"
            if self.shapes.value == (SOLID if shown else SEE_THROUGH):
                self.shapes.value = SEE_THROUGH if shown else SOLID
            self._update_dh_table()

    def _update_dh_table(self) -> None:
        with self._lock:
            self._table, words = None, ""
            if self.dh.value != "none":
                try:
                    self._table = self.robot.dh(self.frame.value, convention=self.dh.value)
                    words = f"{self._table.base_frame} to {self._table.tip_frame}"
                except UrdfkinError as error:
                    words = str(error)
            # Viser would load images even inside Markdown code, so all characters are escaped.
            self.dh_words.content = markdown_text(words)
            self.update()
            if self.player is not None:
                self.player.check_trajectory()

    # -- drawing -------------------------------------------------------------------------------------

    def update(self) -> None:
        with self._lock:
            self.motion = self._motion(Reference.of(self.reference.value))
            aligned = Reference.LOCAL_WORLD_ALIGNED
            drawn = self.motion if self.motion.reference is aligned else self._motion(aligned)
            self.words.content = describe_motion(self.motion)
            self.stage.show(
                shapes=self.shapes.value,
                skeleton=self.skeleton.value,
                axes=self.axes.value,
                names=self.names.value,
            )
            self.stage.move(self.robot.placement(self.q, self.robot.link_frames, verify=False))
            self._draw_overlays(drawn)

    def _motion(self, reference: Reference) -> FrameMotion:
        q, v, a = (x[np.newaxis] for x in (self.q, self.v, self.a))
        return frame_motion(self.robot, (q, v, a), self.frame.value, reference)

    def _draw_overlays(self, x: FrameMotion) -> None:
        stage, reach, rates = self.stage, self.stage.reach, self.robot.velocity_names
        columns, ellipsoid = self.columns.value, self.ellipsoid.value
        stage.draw_arrows(
            "jacobian",
            None if columns == "none" else jacobian_arrows(x, rates, reach, angular=columns == "angular"),
        )
        stage.draw_ellipsoid(
            None if ellipsoid == "none" else velocity_ellipsoid(x, reach, angular=ellipsoid == "angular")
        )
        stage.draw_arrows("acceleration", acceleration_arrows(x, reach) if self.parts.value else None)
        if self._table is None:
            stage.draw_table(None, self.q, np.eye(4))
        else:
            base = self.robot.placement(self.q, self._table.base_frame, verify=False)
            stage.draw_table(self._table, self.robot.select(self._table, self.q), base)
