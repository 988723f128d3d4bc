"""The viewer listens to this machine alone, follows its controls, and says what to install without viser."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest

import urdfkin
from tests.report.browser import opened, require_chromium
from urdfkin.errors import InputError
from urdfkin.view.server import new_server
from urdfkin.view.viewer import Viewer

viser = pytest.importorskip("viser")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    server = new_server(port=free_port())
    yield Viewer(server, urdfkin.load("ur5"))
    server.stop()


def test_it_answers_on_loopback_and_nowhere_else(viewer: Viewer) -> None:
    port = viewer.server.get_port()
    assert viewer.server.get_host() == "127.0.0.1"
    with urlopen(viewer.server.address) as answer:
        assert answer.status == 200
    own = socket.gethostbyname(socket.gethostname())
    if not own.startswith("127."):
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((own, port), timeout=2).close()


def test_sliders_move_the_robot_and_the_numbers_are_checked(viewer: Viewer) -> None:
    viewer.set_q(viewer.robot.neutral())
    at, slider = viewer.sliders[1]
    slider.value = -0.7
    viewer._read()
    assert viewer.q[at] == -0.7
    expected = viewer.robot.placement(viewer.q, viewer.frame.value)
    np.testing.assert_array_equal(viewer.motion.placement[0], expected)
    assert viewer.motion.agrees
    assert "verified" in viewer.words.content


def test_every_overlay_can_be_shown_in_every_reference(viewer: Viewer) -> None:
    viewer.speed.value, viewer.push.value, viewer.parts.value = 1.0, 0.5, True
    for reference in ("local", "world", "local_world_aligned"):
        for what in ("linear", "angular", "none"):
            viewer.reference.value, viewer.columns.value, viewer.ellipsoid.value = reference, what, what
            viewer.update()
        assert viewer.motion.reference.name.lower() == reference
    for convention in ("standard", "modified", "none"):
        viewer.dh.value = convention
        viewer._choose()
        assert (viewer._table is None) == (convention == "none")
    viewer.frame.value = "base_link"
    viewer._choose()
    viewer.frame.value = viewer.robot.tip_frame
    viewer._choose()


def test_without_the_extra_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(InputError, match=r"pip install 'urdfkin\[view\]'"):
        new_server(port=free_port())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar_two_link", "romeo", "alex_psyonic_hands"])
def test_robots_of_other_kinds_are_shown_too(name: str) -> None:
    server = new_server(port=free_port())
    try:
        viewer = Viewer(server, urdfkin.load(name, root_joint=None))
        viewer.set_q(viewer.robot.sample(1, 0)[0])
        assert viewer.motion.agrees
    finally:
        server.stop()


@pytest.mark.slow
@pytest.mark.browser
def test_a_browser_draws_it_without_errors_and_without_asking_elsewhere(
    viewer: Viewer, tmp_path: Path
) -> None:
    require_chromium()
    viewer.ellipsoid.value, viewer.columns.value = "linear", "linear"
    viewer.update()
    address = f"http://127.0.0.1:{viewer.server.get_port()}"
    with opened(tmp_path) as browser:
        browser.requests()
        browser.chrome.get(viewer.server.address)
        for _ in range(60):
            if "verified" in browser.js("return document.body.innerText"):
                break
            time.sleep(0.5)
        time.sleep(2.0)
        browser.screenshot("viewer")
        assert "verified" in browser.js("return document.body.innerText")
        asked = browser.requests()
        elsewhere = [url for url in asked if not url.startswith((address, "data:", "blob:", "chrome"))]
        assert [url for url in elsewhere if not url.startswith("ws://127.0.0.1")] == []
        # Viser's sorter of splats, which are not drawn here, makes functions of strings: the policy refuses.
        assert [error for error in browser.errors() if "EvalError" not in error] == []


@pytest.mark.slow
def test_the_command_serves_until_it_is_interrupted(tmp_path: Path) -> None:
    port = free_port()
    words = [sys.executable, "-m", "urdfkin", "view", "planar_two_link", "--port", str(port)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if "planar_two_link: http" in line)
            with urlopen(line.split(": ", 1)[1].strip()) as answer:
                assert answer.status == 200
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=30) == 0
        finally:
            process.kill()
