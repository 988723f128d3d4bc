"""The viewer: controls on one side, the robot on the other, and between them the library with its check."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from urdfkin.dh.table import DHTable
from urdfkin.errors import UrdfkinError
from urdfkin.errors.printable import markdown_text
from urdfkin.model.configuration import checked
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.motion.frame_motion import FrameMotion, frame_motion
from urdfkin.robot import Robot
from urdfkin.view.overlays import acceleration_arrows, jacobian_arrows, velocity_ellipsoid
from urdfkin.view.readings import legend, numbers
from urdfkin.view.stage import Stage

_REFERENCES = tuple(reference.name.lower() for reference in Reference)


class Viewer:
    """A robot in a browser tab.

    Attributes:
        q: (nq,) what the sliders say.
        motion: The chosen frame's motion in the chosen reference, checked.
    """

    def __init__(self, server: Any, robot: Robot) -> None:
        self.server, self.robot = server, robot
        self.stage = Stage(server, robot)
        self.q = robot.neutral()
        self._direction = np.ones((2, robot.nv))
        self._rng = np.random.default_rng(0)
        self._table: DHTable | None = None
        self._lock = threading.RLock()
        self._build()
        self.update()

    # -- controls ------------------------------------------------------------------------------------

    def _build(self) -> None:
        gui = self.server.gui
        gui.configure_theme(show_share_button=False, control_width="large")
        self.words = gui.add_markdown("")
        with gui.add_folder("Frame"):
            self.frame = gui.add_dropdown("frame", self.robot.frame_names, initial_value=self._tip())
            self.reference = gui.add_dropdown("reference", _REFERENCES, initial_value="local_world_aligned")
        with gui.add_folder("Show"):
            self.meshes = gui.add_checkbox("shapes", initial_value=True)
            self.skeleton = gui.add_checkbox("skeleton", initial_value=self.stage.skeleton_shown)
            self.axes = gui.add_checkbox("link frames", initial_value=False)
            self.columns = gui.add_dropdown("Jacobian's columns", ("none", "linear", "angular"))
            self.ellipsoid = gui.add_dropdown("ellipsoid of velocity", ("none", "linear", "angular"))
            self.parts = gui.add_checkbox("acceleration's parts", initial_value=False)
            gui.add_markdown(legend())
            self.dh = gui.add_dropdown("DH frames", ("none", "standard", "modified"))
            self.dh_words = gui.add_markdown("")
        with gui.add_folder("Rates"):
            self.speed = gui.add_slider("v", min=-3.0, max=3.0, step=0.01, initial_value=0.0)
            self.push = gui.add_slider("a", min=-5.0, max=5.0, step=0.01, initial_value=0.0)
            turn = gui.add_button("another direction")
        with gui.add_folder("Joints"):
            neutral, random = gui.add_button("neutral"), gui.add_button("random")
            self.sliders = list(self._sliders())
        if self.stage.missing:
            count = len(self.stage.missing)
            gui.add_markdown(f"{count} mesh{'es' if count > 1 else ''} could not be shown; the skeleton is.")
        for handle in (self.frame, self.reference, self.dh):
            handle.on_update(lambda _: self._choose())
        shown = (self.meshes, self.skeleton, self.axes, self.columns, self.ellipsoid, self.parts)
        for handle in (*shown, self.speed, self.push):
            handle.on_update(lambda _: self.update())
        turn.on_click(lambda _: self._turn())
        neutral.on_click(lambda _: self.set_q(self.robot.neutral()))
        random.on_click(lambda _: self.set_q(self.robot.sample(1, int(self._rng.integers(2**31)))[0]))

    def _tip(self) -> str:
        tip = self.robot.tip_frame
        return tip if tip in self.robot.frame_names else self.robot.frame_names[-1]

    def _sliders(self) -> Any:
        """One for each coordinate that a slider can hold: a quaternion's four numbers cannot."""
        tree = self.robot.tree
        for joint, at in zip(tree.joints, tree.q_index, strict=True):
            if joint.nq == 0 or joint.kind.nq == 7:
                continue
            for k in range(joint.nq):
                name = self.robot.coordinate_names[at + k]
                turns = joint.kind.turns or (joint.nq == 3 and k == 2)
                whole = np.pi if turns else 1.0
                lower, upper = -whole, whole
                if joint.limit is not None and joint.kind.value != "continuous":
                    lower = max(joint.limit.lower, -4.0 * whole)
                    upper = min(joint.limit.upper, 4.0 * whole)
                lower, upper = min(lower, 0.0), max(upper, 1e-6)
                slider = self.server.gui.add_slider(
                    name, min=float(lower), max=float(upper), step=float((upper - lower) / 1000),
                    initial_value=0.0,
                )  # fmt: skip
                slider.on_update(lambda _: self._read())
                yield at + k, slider

    def _read(self) -> None:
        with self._lock:
            q = self.q.copy()
            for at, slider in self.sliders:
                q[at] = slider.value
            self.q = q
            self.update()

    def set_q(self, q: FloatArray) -> None:
        """Put the robot into a configuration and the sliders with it."""
        with self._lock:
            self.q = checked(self.robot.tree, q, "q").copy()
            for at, slider in self.sliders:
                slider.value = float(np.clip(self.q[at], slider.min, slider.max))
            self.q = checked(self.robot.tree, q, "q").copy()
            self.update()

    def _turn(self) -> None:
        self._direction = self._rng.uniform(-1.0, 1.0, self._direction.shape)
        self.update()

    def _choose(self) -> None:
        """Another frame, reference or convention: the table is derived and checked once."""
        with self._lock:
            self._table = None
            self.dh_words.content = ""
            if self.dh.value != "none":
                try:
                    self._table = self.robot.dh(self.frame.value, convention=self.dh.value)
                    table = self._table
                    # Not as code: viser looks for images there, too, and reads their files.
                    self.dh_words.content = markdown_text(f"{table.base_frame} to {table.tip_frame}")
                except UrdfkinError as error:
                    self.dh_words.content = markdown_text(str(error))
            self.update()

    # -- what is seen --------------------------------------------------------------------------------

    def update(self) -> None:
        """Compute, check and draw."""
        with self._lock:
            v, a = self._direction * np.array([[self.speed.value], [self.push.value]])
            self.motion = self._motion(v, a, Reference.of(self.reference.value))
            aligned = Reference.LOCAL_WORLD_ALIGNED
            drawn = self.motion if self.motion.reference is aligned else self._motion(v, a, aligned)
            self.words.content = numbers(self.motion)
            self.stage.show(shapes=self.meshes.value, skeleton=self.skeleton.value, axes=self.axes.value)
            self.stage.move(self.robot.placement(self.q, self.robot.link_frames, verify=False))
            self._draw(drawn)

    def _motion(self, v: FloatArray, a: FloatArray, reference: Reference) -> FrameMotion:
        q, v, a = (x[np.newaxis] for x in (self.q, v, a))
        return frame_motion(self.robot, q, v, a, self.frame.value, reference)

    def _draw(self, x: FrameMotion) -> None:
        stage, reach, rates = self.stage, self.stage.reach, self.robot.rate_names
        columns, ellipsoid = self.columns.value, self.ellipsoid.value
        stage.arrows(
            "jacobian",
            None if columns == "none" else jacobian_arrows(x, rates, reach, angular=columns == "angular"),
        )
        stage.ellipsoid(
            None if ellipsoid == "none" else velocity_ellipsoid(x, reach, angular=ellipsoid == "angular")
        )
        stage.arrows("acceleration", acceleration_arrows(x, reach) if self.parts.value else None)
        if self._table is None:
            stage.table(None, self.q, np.eye(4))
        else:
            base = self.robot.placement(self.q, self._table.base_frame, verify=False)
            stage.table(self._table, self.robot.select(self._table, self.q), base)
