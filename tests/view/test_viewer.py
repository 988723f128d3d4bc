"""The viewer's sliders, text field and overlays show the checked motion of the robot."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

import urdfkin
from tests.attacks.test_viewer_server import free_port
from tests.report.browser import Browser, opened, require_chromium
from tests.urdfs import joint, limit, loaded
from tests.urdfs import robot as robot_of
from urdfkin.errors import InputError
from urdfkin.errors.escape import markdown_text
from urdfkin.model.configuration import parse_finite
from urdfkin.robot.frame_motion import frame_motion
from urdfkin.urdf.findings import UrdfWarning
from urdfkin.view.scene import Shape
from urdfkin.view.server import new_server, open_page
from urdfkin.view.stage import camera
from urdfkin.view.viewer import (
    Viewer,
    coordinate_rows,
    describe_motion,
    fixed_coordinates,
    format_values,
    missing_words,
    within_limits,
)

viser = pytest.importorskip("viser")


def without_shapes(name: str) -> urdfkin.Robot:
    """Return a robot that a browser draws fast, although it draws in software."""
    return urdfkin.load(re.sub(r"<visual>.*?</visual>", "", urdfkin.load(name).urdf, flags=re.DOTALL))


@contextmanager
def shown_robot(robot: urdfkin.Robot, **how: Any) -> Iterator[Viewer]:
    server = new_server(port=free_port())
    try:
        yield Viewer(server, robot, **how)
    finally:
        server.stop()


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    with shown_robot(urdfkin.load("ur5")) as viewer:
        yield viewer


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Open a browser for the tests that need no pictures."""
    with opened(tmp_path_factory.mktemp("profile"), width=900, height=700, draws=False) as browser:
        yield browser


@pytest.mark.slow
def test_a_slider_moves_only_one_joint_and_the_results_are_checked(viewer: Viewer) -> None:
    viewer.set_q(viewer.robot.sample(1, 5)[0])
    before = viewer.q
    viewer.sliders.handles[1].value = -40.0
    assert viewer.q[1] == pytest.approx(np.deg2rad(-40.0), rel=1e-15)
    np.testing.assert_array_equal(np.delete(viewer.q, 1), np.delete(before, 1))
    expected = viewer.robot.placement(viewer.q, viewer.frame.value)
    np.testing.assert_array_equal(viewer.motion.placement[0], expected)
    assert viewer.motion.agrees
    assert "verified" in viewer.words.content


def shown(viewer: Viewer) -> list[float]:
    scale = np.pi / 180.0 if viewer.units.value == "degrees" else 1.0
    both = zip(viewer.sliders.rows, viewer.sliders.handles, strict=True)
    return [handle.value * (scale if row.is_angle else 1.0) for row, handle in both]


@pytest.mark.slow
@pytest.mark.parametrize("units", ["radians", "degrees"])
def test_the_sliders_show_q_after_every_change_of_q(viewer: Viewer, units: str) -> None:
    viewer.units.value = units
    for seed in range(3):
        q = viewer.robot.sample(1, seed)[0]
        viewer.set_q(q)
        np.testing.assert_array_equal(viewer.q, q)
        np.testing.assert_allclose(shown(viewer), q, rtol=1e-15)
        viewer.sliders.handles[seed].value = 0.25  # 0.25 degrees or radians
        np.testing.assert_allclose(shown(viewer), viewer.q, rtol=1e-15)
        assert parse_finite(viewer.robot.tree, viewer.words_of_q.value, "q").tolist() == viewer.q.tolist()
    far = np.full(viewer.robot.nq, 7.0)  # beyond every limit of a UR5
    viewer.set_q(far)
    np.testing.assert_allclose(shown(viewer), far, rtol=1e-15)
    viewer.units.value = "degrees"


@pytest.mark.slow
def test_the_text_field_shows_and_reads_q_in_a_convention() -> None:
    robot = urdfkin.load("a1", verify=False)
    mujoco = robot.convention("mujoco")
    with shown_robot(robot, conversion=mujoco) as viewer:
        viewer.set_q(q := robot.sample(1, 5)[0])
        numbers = [float(x) for x in viewer.words_of_q.value.split(",")]
        assert numbers == mujoco.to(q).tolist()
        assert viewer.words_of_q.label == "q of mujoco, to copy or type"
        viewer.words_of_q.value = format_values(mujoco.to(other := robot.sample(1, 6)[0]))
        viewer._read_q_field(SimpleNamespace(client=object()))
        np.testing.assert_array_equal(viewer.q, other)


def test_a_quaternion_typed_in_a_convention_must_have_length_1() -> None:
    slides = joint("slides", "prismatic", "a", "b", 'xyz="0 0 1"', "0 1 0", limit(-1, 1))
    robot = loaded(robot_of(slides), root_joint="floating")
    with shown_robot(robot, conversion=robot.convention("mujoco")) as viewer:
        before = viewer.q
        viewer.words_of_q.value = "0,0,0,2,0,0,0,0.5"
        viewer._read_q_field(SimpleNamespace(client=object()))
        assert "must be a unit quaternion" in viewer.wrong.content
        np.testing.assert_array_equal(viewer.q, before)


def test_a_slider_has_the_limits_of_the_joint_and_a_joint_without_a_range_has_no_slider() -> None:
    robot = urdfkin.load("panda")
    rows = {row.name: row for row in coordinate_rows(robot)}
    own = robot.tree.joints[[joint.name for joint in robot.tree.joints].index("panda_joint4")].limit
    assert own is not None
    assert (rows["panda_joint4"].lower, rows["panda_joint4"].upper) == (own.lower, own.upper)
    assert within_limits(robot, robot.neutral())[3] == own.upper < 0.0
    assert [row.name for row in coordinate_rows(urdfkin.load("ur5", root_joint="floating"))][:4] == [
        "root_joint.x", "root_joint.y", "root_joint.z", "shoulder_pan_joint",
    ]  # fmt: skip
    turns = joint("turns", "revolute", "a", "b", 'xyz="0 0 1"', "0 1 0", limit(-1, 1))
    stays = joint("stays", "revolute", "b", "c", 'xyz="0 0 1"', "0 1 0", limit(0.5, 0.5))
    with pytest.warns(UrdfWarning, match="its limits are equal"):
        robot = urdfkin.load(robot_of(turns, stays))
    assert [row.name for row in coordinate_rows(robot)] == ["turns"]
    assert fixed_coordinates(robot) == ["stays"]
    assert within_limits(robot, robot.neutral()).tolist() == [0.0, 0.5]
    far = joint("far", "prismatic", "a", "b", 'xyz="0 0 1"', "0 1 0", limit(1.5, 300))
    robot = loaded(robot_of(far))
    assert within_limits(robot, robot.neutral()).tolist() == [1.5]


def test_a_joint_with_a_denormal_range_has_a_slider() -> None:
    slides = joint("slides", "prismatic", "a", "b", 'xyz="0 0 1"', "0 1 0", limit(0, 1e-322))
    with shown_robot(loaded(robot_of(slides))) as viewer:
        assert viewer.sliders.handles[0].max == 1e-322


def test_a_slider_has_steps_of_one_degree_and_the_limits_at_both_ends(viewer: Viewer) -> None:
    assert viewer.units.value == "degrees"
    assert {handle.step for handle in viewer.sliders.handles} == {1.0}
    viewer.set_q(np.zeros(6))
    for row, handle in zip(viewer.sliders.rows, viewer.sliders.handles, strict=True):
        ends = np.rad2deg([row.lower, row.upper])
        assert [mark.value for mark in handle._marks] == pytest.approx(ends)
        assert [float(mark.label) for mark in handle._marks] == pytest.approx(ends, abs=0.05)


def test_a_value_that_the_browser_rounds_beyond_a_limit_becomes_the_limit() -> None:
    lower, upper = -1.234567, 2.5
    turns = joint("turns", "revolute", "a", "b", 'xyz="0 0 1"', "0 1 0", limit(lower, upper))
    with shown_robot(urdfkin.load(robot_of(turns))) as viewer:
        (handle,) = viewer.sliders.handles
        for end, shown_end in ((upper, 143.24), (lower, -70.74)):  # the browser shows two decimals
            handle.value = shown_end
            assert viewer.q.tolist() == [end]
        viewer.set_q([3.0])
        handle.value = 171.89
        assert viewer.q[0] > upper


def test_missing_meshes_are_listed_with_the_remedy() -> None:
    addresses = [f"package://arm/m{i}.stl" for i in range(7)]
    missing = [Shape("l", "mesh", (1.0, 1.0, 1.0), np.eye(4), None, None, name) for name in addresses]
    words = missing_words(missing)
    assert "7 meshes not shown" in words
    assert "Set `ROS_PACKAGE_PATH`" in words
    assert [markdown_text(name) in words for name in addresses] == [True] * 5 + [False] * 2
    assert "and 2 more" in words
    alone = [Shape("l", "mesh", (1.0, 1.0, 1.0), np.eye(4), None, None, "meshes/a.stl")]
    assert "Copy the mesh files to the paths that the URDF names" in missing_words(alone)


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_the_camera_shows_the_whole_robot_and_the_robot_fills_the_view(aspect: float) -> None:
    points, fov = np.random.default_rng(0).uniform([-1.0, -0.2, 0.0], [0.5, 0.2, 2.0], (500, 3)), 1.0
    position, middle = camera(points, aspect=aspect, fov=fov)
    back = (position - middle) / np.linalg.norm(position - middle)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    seen = points - position
    depth = -seen @ back
    x, y = (seen @ axis / depth / np.tan(fov / 2) for axis in (right, np.cross(back, right)))
    share = max(np.abs(x).max() / aspect, np.abs(y).max())
    assert share == pytest.approx(0.85, abs=1e-9)


def test_each_joint_has_sliders_for_velocity_and_acceleration(viewer: Viewer) -> None:
    viewer.set_velocities(np.zeros(6), np.zeros(6))
    viewer.units.value = "radians"
    viewer.rates.handles[2].value = 0.5
    viewer.second_rates.handles[0].value = -1.0
    viewer.units.value = "degrees"
    assert viewer.v.tolist() == [0.0, 0.0, 0.5, 0.0, 0.0, 0.0]
    assert viewer.a.tolist() == [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    expected = viewer.robot.acceleration(viewer.q, viewer.v, viewer.a, viewer.frame.value)
    np.testing.assert_array_equal(viewer.motion.acceleration[0], expected)
    viewer.set_velocities(np.zeros(6), np.zeros(6))


@pytest.mark.slow
def test_shapes_are_transparent_while_the_frames_of_a_dh_table_are_shown(viewer: Viewer) -> None:
    viewer.dh.value = "modified"
    assert viewer.shapes.value == "see-through"
    assert all(not handle.visible for _, handle in viewer.stage._shapes)
    assert len(viewer.stage._transparent) == len(viewer.stage._shapes) > 0
    assert all(handle.visible and handle.opacity < 0.5 for handle in viewer.stage._transparent)
    viewer.dh.value = "none"
    assert viewer.shapes.value == "solid"
    assert all(handle.visible for _, handle in viewer.stage._shapes)


@pytest.mark.parametrize(("kind", "name"), [("links", "wrist_1_link"), ("joints", "elbow_joint")])
def test_names_of_links_or_joints_are_shown_at_the_frames(viewer: Viewer, kind: str, name: str) -> None:
    viewer.names.value = kind
    labels = [handle for handles in viewer.stage._labels.values() for handle in handles if handle.visible]
    assert name in [handle.text for handle in labels]
    viewer.names.value = "none"
    assert not any(handle.visible for handles in viewer.stage._labels.values() for handle in handles)


def test_the_browser_is_started_with_a_file_that_no_other_user_can_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []
    monkeypatch.setattr("webbrowser.open", asked.append)
    address = "http://127.0.0.1:8080/the-key/"
    with open_page(address):
        (url,) = asked
        assert "the-key" not in url
        page = Path(url.removeprefix("file://"))
        assert address in page.read_text()
        assert page.parent.stat().st_mode & 0o077 == 0
    assert not page.exists()


@pytest.mark.slow
def test_every_overlay_can_be_shown_in_every_reference_frame(viewer: Viewer) -> None:
    viewer.set_velocities(np.ones(6), np.full(6, 0.5))
    viewer.parts.value = True
    for reference in ("local", "world", "local_world_aligned"):
        for what in ("linear", "angular", "none"):
            viewer.reference.value, viewer.columns.value, viewer.ellipsoid.value = reference, what, what
            viewer.update()
        assert viewer.motion.reference.name.lower() == reference
    for convention in ("standard", "modified", "none"):
        viewer.dh.value = convention
        viewer._update_dh_table()
        assert (viewer._table is None) == (convention == "none")
    viewer.frame.value = "base_link"
    viewer._update_dh_table()
    viewer.frame.value = viewer.robot.tip_frame
    viewer._update_dh_table()


def test_without_viser_the_error_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(InputError, match=r"pip install 'viser>=1'"):
        new_server(port=free_port())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar_two_link", "romeo", "alex_psyonic_hands"])
def test_the_viewer_shows_robots_of_other_kinds(name: str) -> None:
    with shown_robot(urdfkin.load(name, root_joint=None)) as viewer:
        viewer.set_q(viewer.robot.sample(1, 0)[0])
        assert viewer.motion.agrees


@pytest.mark.long
@pytest.mark.browser
def test_a_browser_shows_the_viewer_without_errors_and_external_requests(
    viewer: Viewer, tmp_path: Path
) -> None:
    require_chromium()
    viewer.ellipsoid.value, viewer.columns.value = "linear", "linear"
    viewer.update()
    address = f"http://127.0.0.1:{viewer.server.get_port()}"
    with opened(tmp_path, width=640, height=400) as browser:  # the browser draws slowly in software
        browser.requests()
        browser.chrome.get(viewer.server.address)
        browser.wait_for("verified")
        time.sleep(2.0)
        browser.screenshot("viewer")
        asked = browser.requests()
        elsewhere = [url for url in asked if not url.startswith((address, "data:", "blob:", "chrome"))]
        assert [url for url in elsewhere if not url.startswith("ws://127.0.0.1")] == []
        assert browser.errors() == []
        assert browser.js(_UNNAMED) == []


#: Visible controls without a name for a screen reader
_UNNAMED = """return [...document.querySelectorAll("[role=slider], [role=button], input, button")]
  .filter((e) => e.offsetParent !== null && !e.ariaLabel && !e.textContent.trim())
  .map((e) => e.outerHTML.slice(0, 300))"""


@pytest.mark.long
@pytest.mark.browser
@pytest.mark.parametrize("dark", [False, True])
def test_the_viewer_has_the_browsers_theme_sufficient_contrast_and_a_visible_focus(
    viewer: Viewer, chromium: Browser, dark: bool
) -> None:
    chromium.become(900, 700, dark=dark)
    chromium.chrome.get(viewer.server.address)
    chromium.wait_for("verified")
    scheme = "return document.documentElement.dataset.mantineColorScheme"
    assert chromium.js(scheme) == ("dark" if dark else "light")
    for words, behind in chromium.js(_COLOURS):
        assert _contrast(words, behind) >= 4.5, (words, behind)
    kinds = set()
    for _ in range(14):
        chromium.chrome.switch_to.active_element.send_keys("\ue004")
        kind, width, ring, behind = chromium.js(_RING)
        kinds.add(kind)
        assert width >= 2.0, kind
        assert _contrast(ring, behind) >= 3.0, (kind, ring, behind)
    assert kinds >= {"INPUT", "BUTTON"}


#: Colour of each label and button, and the colour of its background
_COLOURS = """return [...document.querySelectorAll("label, button, .mantine-Slider-markLabel")]
  .filter((e) => e.offsetParent !== null && e.textContent.trim()).map((e) => {
    let behind = e;
    const colour = (x) => getComputedStyle(x).backgroundColor;
    while (behind.parentElement && colour(behind) === "rgba(0, 0, 0, 0)") behind = behind.parentElement;
    return [getComputedStyle(e).color, colour(behind)].map((c) => c.match(/[0-9.]+/g).map(Number));
  })"""


def _contrast(*colours: list[float]) -> float:
    """Return the contrast of two opaque colours, as WCAG 2.2 defines it."""
    light = []
    for colour in colours:
        parts = np.array(colour[:3]) / 255.0
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ [0.2126, 0.7152, 0.0722]) + 0.05)
    return max(light) / min(light)


#: Kind of the element with the focus, width and colour of its outline, and colour of its background
_RING = """const e = document.activeElement, style = getComputedStyle(e);
  const colour = (x) => getComputedStyle(x).backgroundColor;
  let behind = e.parentElement;
  while (behind.parentElement && colour(behind) === "rgba(0, 0, 0, 0)") behind = behind.parentElement;
  const numbers = (c) => c.match(/[0-9.]+/g).map(Number);
  return [e.tagName, style.outlineStyle === "none" ? 0 : parseFloat(style.outlineWidth),
    numbers(style.outlineColor), numbers(colour(behind))];"""


@pytest.mark.long
@pytest.mark.browser
def test_folders_of_the_viewer_open_by_keyboard(viewer: Viewer, chromium: Browser) -> None:
    chromium.become(900, 700)
    chromium.chrome.get(viewer.server.address)
    bar = "return [...document.querySelectorAll('[role=button]')].find((b) => b.innerText === 'Show')"
    assert _until(lambda: chromium.js(bar) is not None)
    for expanded in ("false", "true"):
        chromium.js(bar).send_keys("\ue007")
        assert _until(lambda e=expanded: chromium.js(bar).get_attribute("aria-expanded") == e)  # type: ignore[misc]


_PRESS = "[...document.querySelectorAll('button')].find((b) => b.innerText == arguments[0]).click()"
_EDGES = """return [...document.querySelectorAll('[role=slider]')].map((thumb) => {
  const box = thumb.getBoundingClientRect();
  return [box.left, box.right];
})"""


def _sliders(browser: Browser, count: int) -> list[float]:
    code = "return [...document.querySelectorAll('[role=slider]')].map((s) => +s.ariaValueNow)"
    values: list[float] = browser.js(code)
    return [float(np.deg2rad(value)) if k < 7 else value for k, value in enumerate(values[:count])]


def _sliders_in_sight(browser: Browser) -> int:
    code = "[...document.querySelectorAll('[role=slider]')].filter((s) => s.offsetParent !== null).length"
    return int(browser.js(f"return {code}"))


def _until(holds: Callable[[], bool]) -> bool:
    for _ in range(60):
        if holds():
            return True
        time.sleep(0.25)
    return False


@pytest.mark.long
@pytest.mark.browser
@pytest.mark.parametrize("width", [1280, 390])
def test_in_a_browser_each_slider_equals_q_and_a_key_changes_only_one_coordinate(
    chromium: Browser, width: int
) -> None:
    with shown_robot(without_shapes("panda")) as viewer:
        n = len(viewer.sliders.rows)

        def equal() -> bool:
            shown = _sliders(chromium, n)
            return len(shown) == n and bool(np.allclose(shown, viewer.q, rtol=0.0, atol=1e-12))

        chromium.become(width, 844)
        chromium.chrome.get(viewer.server.address)
        if width < 600:
            chromium.wait_for("show the controls")
            assert _until(lambda: _sliders_in_sight(chromium) == 0), "on a phone the panel is folded at first"
            chromium.js(_PRESS, "show the controls")
            assert _until(lambda: _sliders_in_sight(chromium) == n)
        assert _until(equal)
        viewer.set_q(viewer.robot.sample(1, 3)[0])
        assert _until(equal)
        for label in ("random", "neutral, within the limits", "random"):
            before = viewer.q.copy()
            chromium.js(_PRESS, label)
            assert _until(lambda before=before: bool((viewer.q != before).any())), label  # type: ignore[misc]
            assert _until(equal), label
        before = viewer.q.copy()
        chromium.chrome.find_elements("css selector", "[role=slider]")[4].send_keys("\ue014")  # right arrow
        assert _until(lambda: viewer.q[4] != before[4])
        assert (np.delete(viewer.q, 4) == np.delete(before, 4)).all(), "the others stay, to the bit"
        assert abs(np.rad2deg(viewer.q[4] - before[4]) - 1.0) < 0.01, "one key moves one degree"
        assert _until(equal)
        # On a phone, too, all sliders are within the window.
        assert all(0 <= left < right <= width for left, right in chromium.js(_EDGES)[:n])
        chromium.screenshot(f"viewer-{width}")


@pytest.mark.slow
@pytest.mark.parametrize("plays", [False, True])
def test_the_view_command_serves_until_an_interrupt(tmp_path: Path, plays: bool) -> None:
    port = free_port()
    words = [sys.executable, "-m", "urdfkin", "view", "planar_two_link", "--port", str(port)]
    if plays:
        file = tmp_path / "motion.csv"
        file.write_text("t,joint_1,joint_2\n0,0,0\n0.1,0.1,0\n0.2,0.3,0.1\n")
        words += ["--trajectory", str(file)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if "planar_two_link: http" in line)
            with urlopen(line.split(": ", 1)[1].strip(), timeout=60) as answer:
                assert answer.status == 200
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=30) == 0
        finally:
            process.kill()


def test_a_position_beyond_1e296_m_is_not_displayed_as_infinite() -> None:
    slide = loaded(robot_of(joint("slide", "prismatic", "a", "b", more=limit(-1e301, 1e301))))
    motion = frame_motion(slide, ([[1e300]], [[0.0]], [[0.0]]), "b", "world")
    assert "| position [m] | 0 | 0 | 1e+300 |" in describe_motion(motion)
