"""The viewer plays the samples of a trajectory, checks each sample, and saves pictures and motions."""

import io
import struct
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.report.browser import opened, require_chromium
from tests.view.test_viewer import _PRESS, _until, shown_robot, without_shapes
from urdfkin.robot.trajectory import make_line_trajectory
from urdfkin.view.player import Player, as_gif, as_png
from urdfkin.view.viewer import Viewer

viser = pytest.importorskip("viser")


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    robot = without_shapes("ur5")
    motion = make_line_trajectory(robot, np.zeros(6), np.full(6, 0.8), 0.4, 9)
    with shown_robot(robot, trajectory=motion) as viewer:
        yield viewer


@pytest.fixture
def player(viewer: Viewer) -> Player:
    assert viewer.player is not None
    return viewer.player


def test_the_time_slider_selects_the_nearest_sample_and_shows_checked_results(
    viewer: Viewer, player: Player
) -> None:
    x = player.trajectory
    player.time.value = float(x.t[5]) + 0.01
    assert player.sample == 5
    for shown, given in ((viewer.q, x.q[5]), (viewer.v, x.v[5]), (viewer.a, x.a[5])):
        np.testing.assert_array_equal(shown, given)
    expected = viewer.robot.acceleration(x.q[5], x.v[5], x.a[5], viewer.frame.value)
    np.testing.assert_array_equal(viewer.motion.acceleration[0], expected)
    assert "verified" in viewer.words.content
    assert "sample 6 of 9" in player.words.content
    np.testing.assert_allclose(viewer.sliders.handles[0].value, np.rad2deg(x.q[5, 0]), rtol=1e-14)


@pytest.mark.slow
def test_the_player_plays_to_the_end_at_the_chosen_speed_and_a_pause_holds_the_sample(player: Player) -> None:
    player.show(0)
    player.speed.value = "0.5"
    begin = time.perf_counter()
    player.play()
    assert player.button.label == "pause"
    assert _until(lambda: player.button.label == "play")
    assert player.sample == 8
    assert time.perf_counter() - begin > 0.7, "0.4 s at half the speed"
    player.speed.value = "1"
    player.show(0)
    player.speed.value = "0.1"
    player.play()
    assert _until(lambda: player.sample > 0)
    player.pause()
    time.sleep(0.2)
    kept = player.sample
    time.sleep(0.6)
    assert player.sample == kept < 8
    player.speed.value = "1"


def test_two_samples_at_unix_times_are_displayed_with_different_times() -> None:
    robot = without_shapes("planar_two_link")
    motion = make_line_trajectory(robot, np.zeros(2), np.ones(2), 0.5, 3)
    motion = replace(motion, t=motion.t + 1.7e9)
    with shown_robot(robot, trajectory=motion) as viewer:
        assert viewer.player is not None
        assert "t = 1700000000 s" in viewer.player.words.content
        viewer.player.show(1)
        assert "t = 1700000000.25 s" in viewer.player.words.content
        assert [mark.label for mark in viewer.player.time._marks] == ["1700000000", "1700000000.5"]


def test_the_whole_trajectory_is_checked_for_each_frame(viewer: Viewer, player: Player) -> None:
    assert "9 samples, verified by Pinocchio" in player.words.content
    viewer.frame.value = "forearm_link"
    assert "9 samples, verified by Pinocchio" in player.words.content


def test_a_saved_gif_has_all_frames_and_a_saved_png_is_opaque() -> None:
    frames = [np.full((8, 10, 3), 40 * k, dtype=np.uint8) for k in range(5)]
    image = Image.open(io.BytesIO(as_gif(frames, 0.08)))
    assert image.size == (10, 8)
    assert image.n_frames == 5
    assert image.info["duration"] == 80
    assert image.info["loop"] == 0
    clear = np.zeros((4, 4, 4), dtype=np.uint8)
    assert np.asarray(Image.open(io.BytesIO(as_png(clear)))).tolist() == [[[255, 255, 255]] * 4] * 4


@pytest.mark.long
@pytest.mark.browser
def test_a_browser_saves_a_picture_and_an_animation(viewer: Viewer, tmp_path: Path) -> None:
    require_chromium()
    saved = tmp_path / "saved"
    saved.mkdir()
    with opened(tmp_path / "profile", width=700, height=500) as browser:
        behaviour = {"behavior": "allow", "downloadPath": str(saved)}
        browser.chrome.execute_cdp_cmd("Page.setDownloadBehavior", behaviour)
        browser.chrome.get(viewer.server.address)
        browser.wait_for("verified")
        for label, ending, head in (
            ("save a picture (PNG)", "png", b"\x89PNG"),
            ("save the motion (GIF)", "gif", b"GIF89a"),
        ):
            browser.js(_PRESS, label)
            file = saved / f"{viewer.file_name}.{ending}"
            deadline = time.monotonic() + 120.0
            while not file.exists() and time.monotonic() < deadline:
                time.sleep(0.25)
            content = file.read_bytes()
            assert content.startswith(head), label
        assert struct.unpack("<HH", content[6:10]) == (640, 480)
        image = Image.open(io.BytesIO(content))
        assert image.n_frames == 6
        first = np.asarray(image.convert("RGB"), dtype=float)
        image.seek(5)
        assert np.abs(np.asarray(image.convert("RGB"), dtype=float) - first).max() > 50.0, "the robot moves"
        assert browser.errors() == []
