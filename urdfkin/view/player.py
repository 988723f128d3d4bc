"""Play a trajectory in the viewer, and save pictures (PNG) and motions (GIF).

Pinocchio checks the samples of the trajectory. The viewer does not interpolate between samples, because
interpolated numbers would be unchecked.
"""

from __future__ import annotations

import io
import math
import threading
import time
from typing import Any, Protocol

import numpy as np

from urdfkin.errors.escape import markdown_text
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import frame_motion
from urdfkin.robot.trajectory import Trajectory
from urdfkin.view.plot import check_summary

_SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
_UPDATE_RATE = 20.0
#: A saved motion has this many frames per second, at most this many intervals between frames, and this width
#: and height in pixels.
_FRAME_RATE, _MAX_INTERVALS, _SIZE = 12.5, 250, (640, 480)


class Screen(Protocol):
    """The attributes and methods of a `Viewer` that a `Player` uses.

    This module cannot import `Viewer`, because the module of `Viewer` imports this module.
    """

    server: Any
    robot: Robot
    frame: Any
    reference: Any

    @property
    def file_name(self) -> str: ...

    def set_state(self, q: FloatArray, v: FloatArray, a: FloatArray) -> None: ...


class Player:
    """The controls of a trajectory. `sample` is the index of the sample that the viewer shows."""

    def __init__(self, viewer: Screen, trajectory: Trajectory) -> None:
        self._viewer, self.trajectory, self.sample = viewer, trajectory, 0
        self._playing, self._is_setting = threading.Event(), False
        gui, t = viewer.server.gui, trajectory.t
        # Unix times such as 1.7e9 s need many digits to differ.
        ratio = math.log10(np.abs(t).max()) - math.log10(np.diff(t).min())
        self._digits = min(max(4, math.ceil(ratio) + 2), 17)
        with gui.add_folder("Trajectory"):
            self.time = gui.add_slider(
                "time [s]", float(t[0]), float(t[-1]), float(np.diff(t).min()), float(t[0]),
                marks=tuple((float(end), self._format_time(end)) for end in (t[0], t[-1])),
            )  # fmt: skip
            self.time.precision = 4
            self.button = gui.add_button("play")
            self.speed = gui.add_dropdown("speed", _SPEEDS, initial_value="1")
            self.words = gui.add_markdown("")
            save = gui.add_button("save the motion (GIF)")
        self.time.on_update(lambda _: self._show_sample_at_slider())
        self.button.on_click(lambda _: self.pause() if self._playing.is_set() else self.play())
        save.on_click(lambda event: self._save(event.client))

    def check_trajectory(self) -> None:
        viewer, x = self._viewer, self.trajectory
        motion = frame_motion(viewer.robot, x, viewer.frame.value, viewer.reference.value)
        mark = "! " if motion.unverified_reason is not None else "✓ " if motion.agrees else "✗ "
        self._check_line = mark + check_summary(motion, x)
        self._write_text()

    def show(self, sample: int) -> None:
        self.sample, x = sample, self.trajectory
        self._is_setting = True
        try:
            self.time.value = float(x.t[sample])
        finally:
            self._is_setting = False
        self._viewer.set_state(x.q[sample], x.v[sample], x.a[sample])
        self._write_text()

    def _write_text(self) -> None:
        x = self.trajectory
        sample = f"sample {self.sample + 1} of {len(x.t)}, t = {self._format_time(x.t[self.sample])} s"
        self.words.content = f"**{sample}**\n\n{markdown_text(self._check_line)}"

    def _format_time(self, seconds: float) -> str:
        return f"{seconds:.{self._digits}g}"

    def _nearest_sample(self, seconds: float) -> int:
        return int(np.abs(self.trajectory.t - seconds).argmin())

    def _show_sample_at_slider(self) -> None:
        if not self._is_setting:
            self.pause()
            self.show(self._nearest_sample(float(self.time.value)))

    def play(self) -> None:
        if not self._playing.is_set():
            self._playing.set()
            self.button.label = "pause"
            threading.Thread(target=self._run, daemon=True).start()

    def pause(self) -> None:
        self._playing.clear()
        self.button.label = "play"

    def _run(self) -> None:
        t = self.trajectory.t
        now = float(t[0] if self.sample == len(t) - 1 else t[self.sample])
        last = time.perf_counter()
        while self._playing.is_set():
            self.show(self._nearest_sample(now))
            if now >= t[-1]:
                self.pause()
                return
            time.sleep(max(0.0, 1.0 / _UPDATE_RATE - (time.perf_counter() - last)))
            before, last = last, time.perf_counter()
            now = min(float(t[-1]), now + (last - before) * float(self.speed.value))

    def _save(self, client: Any) -> None:
        if client is None:
            return
        self.pause()
        shown, t, speed = self.sample, self.trajectory.t, float(self.speed.value)
        seconds = float(t[-1] - t[0]) / speed
        count = int(np.clip(round(seconds * _FRAME_RATE), 1, _MAX_INTERVALS)) + 1
        note = client.add_notification("Saving the motion", f"0 of {count} pictures", loading=True)
        frames: list[np.ndarray] = []
        try:
            for k, moment in enumerate(np.linspace(t[0], t[-1], count)):
                self.show(self._nearest_sample(float(moment)))
                frames.append(_new_picture(client, frames[-1] if frames else None))
                note.body = f"{k + 1} of {count} pictures"
        except (RuntimeError, TimeoutError):  # Browsers draw nothing in a background tab.
            return
        finally:
            note.remove()
            self.show(shown)
        name = f"{self._viewer.file_name}.gif"
        client.send_file_download(name, as_gif(frames, seconds / (count - 1)), save_immediately=True)


def _new_picture(client: Any, last: np.ndarray | None) -> np.ndarray:
    """Request a picture that differs from `last`, with at most five attempts.

    A busy browser may return the picture of the previous pose.
    """
    for _ in range(5):
        picture: np.ndarray = client.get_render(height=_SIZE[1], width=_SIZE[0], timeout=60.0)
        if last is None or not np.array_equal(picture, last):
            break
    return picture


def as_gif(frames: list[np.ndarray], seconds_per_frame: float) -> bytes:
    """Return an endless animation of frames (height, width, 3 or 4)."""
    images = [_on_white(frame).quantize(128) for frame in frames]
    stream = io.BytesIO()
    # Browsers show GIF frames of 1/100 s for too long.
    milliseconds = max(20, 10 * round(100 * seconds_per_frame))
    images[0].save(stream, "gif", save_all=True, append_images=images[1:], duration=milliseconds, loop=0)
    return stream.getvalue()


def as_png(frame: np.ndarray) -> bytes:
    stream = io.BytesIO()
    _on_white(frame).save(stream, "png", optimize=True)
    return stream.getvalue()


def _on_white(frame: np.ndarray) -> Any:
    from PIL import Image

    image = Image.fromarray(frame).convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")
