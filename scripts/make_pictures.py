"""Make pictures for the README and the site: the reference frames, and screenshots of report and viewer.

The script needs the extras `plots`, `view` and `test`, and Debian's chromium and chromium-driver.
"""

import io
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import urdfkin
from scripts.make_tour import IMAGES, INK, QUIET, STYLE, draw_arrow
from tests.report.browser import Browser, opened
from urdfkin.report.html import as_html
from urdfkin.view.figure import GREEN, VERMILION
from urdfkin.view.server import new_server
from urdfkin.view.viewer import Viewer

POSE = [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8, 0.04]
THEMES = (("", False), ("-dark", True))


def draw_reference_frames() -> Any:
    arm, q, v = urdfkin.load("planar_two_link"), [0.0, np.pi / 2], [1.0, 1.0]
    figure, panels = plt.subplots(1, 3, figsize=(9.6, 3.6), sharey=True, layout="constrained")
    points = arm.placement(q, ["base", "link_2", "tip"])[:, :2, 3]
    R_tip, tip, world = arm.placement(q, "tip")[:2, :2], points[-1], np.eye(2)
    views = (
        ("local_world_aligned", tip, world, "(-0.8, 0.5): tip velocity in world axes"),
        ("local", tip, R_tip, "(0.5, 0.8): tip velocity in tip axes"),
        ("world", np.zeros(2), world, "(0, -0.5): velocity of the point at the origin"),
    )
    for axes, (reference, origin, R, title) in zip(panels, views, strict=True):
        look: dict[str, Any] = {"color": "#c3ccd6", "linewidth": 7, "markersize": 9, "markerfacecolor": QUIET}
        axes.plot(*points.T, "-o", zorder=1, **look)
        if reference == "world":
            axes.plot(*np.array([tip, origin]).T, color=QUIET, linestyle=":", linewidth=1.2, zorder=0)
        for k, color in enumerate((VERMILION, GREEN)):
            draw_arrow(axes, origin, 0.17 * R[:, k], color)
            label_position = origin + 0.2 * R[:, k] + 0.045 * R[:, 1 - k]
            axes.text(*label_position, "xy"[k], color=color, ha="center", va="center", fontsize=9)
        numbers = arm.velocity(q, v, "tip", reference)[:2]
        draw_arrow(axes, origin, 0.6 * R @ numbers, INK)
        for k, color in enumerate((VERMILION, GREEN)):
            begin = origin + (0.6 * R[:, 0] * numbers[0] if k else 0)
            ends = np.array([begin, begin + 0.6 * R[:, k] * numbers[k]])
            axes.plot(*ends.T, color=color, linewidth=1.2, ls="--")
        axes.set(xlim=(-0.35, 0.95), ylim=(-0.36, 0.8), xticks=(), yticks=())
        axes.set_aspect("equal")
        axes.spines[:].set_visible(False)
        axes.set_title(f"{reference.upper()}\n{title}", fontsize=9)
    return figure


def photograph_report(folder: Path) -> None:
    page = folder / "report.html"
    found = urdfkin.validate(["panda", "ur5"], samples=1000)
    text = as_html(found.as_dict())
    installed = str(Path(urdfkin.load("panda").path or "").parents[2])  # do not show the name of the machine
    page.write_text(text.replace(installed, "example-robot-data"), encoding="utf-8")
    for theme, dark in THEMES:
        with opened(folder / f"report{theme}", width=1000, height=1250, dark=dark) as browser:
            browser.open(page)
            browser.js("document.querySelector('details.robot').open = true; scrollTo(0, 0)")
            browser.settle()
            save_screenshot(browser, f"report{theme}")


def photograph_viewer(folder: Path) -> None:
    server = new_server(port=8099)
    try:
        viewer = Viewer(server, urdfkin.load("panda"), POSE)
        viewer.dh.value = "standard"
        screens = ("viewer", 1100, 1240), ("viewer-phone", 400, 800)
        for (name, width, height), (theme, dark) in product(screens, THEMES):
            with opened(folder / f"{name}{theme}", width=width, height=height, dark=dark) as browser:
                browser.chrome.get(server.address)
                browser.wait("return document.querySelector('canvas') !== null")
                time.sleep(30)  # shapes appear slowly without a GPU
                notes = "document.querySelectorAll('[class*=Notification] button')"
                browser.js(f"{notes}.forEach(b => b.click())")
                if width < 600:
                    browser.wait("return document.getElementById('fold') !== null")
                    browser.js("document.getElementById('fold').click()")
                time.sleep(5)
                # Each animation frame takes seconds, so the script stops the animation before the screenshot.
                browser.js("window.requestAnimationFrame = () => 0")
                time.sleep(2)
                save_screenshot(browser, f"{name}{theme}")
    finally:
        server.stop()


def save_screenshot(browser: Browser, name: str) -> None:
    image = Image.open(io.BytesIO(browser.chrome.get_screenshot_as_png())).convert("RGB")
    image.quantize(128).save(IMAGES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    with mpl.rc_context(STYLE):
        figure = draw_reference_frames()
        figure.savefig(IMAGES / "reference-frames.svg", metadata={"Date": None})
        plt.close(figure)
    with tempfile.TemporaryDirectory() as folder:
        photograph_report(Path(folder))
        photograph_viewer(Path(folder))
