"""Debian's Chromium for tests: offline, headless, with a software renderer for WebGL."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

ARTEFACTS = Path(__file__).parents[2] / "artefacts"
_PROBES = (Path(__file__).parent / "probes.js").read_text()
_FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
    "--disable-default-apps", "--disable-extensions", "--hide-scrollbars", "--disable-dev-shm-usage",
)  # fmt: skip


def chromium() -> tuple[str, str] | None:
    """Return the paths of Chromium and its driver; None if one is not installed."""
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


def require_chromium() -> tuple[str, str]:
    """Skip the test without Chromium; in CI, fail the test."""
    found = chromium()
    if found is None:
        if os.environ.get("CI"):
            pytest.fail("CI needs Debian's chromium and chromium-driver")
        pytest.skip("Debian's chromium and chromium-driver are not installed")
    return found


#: Script that disables WebGL drawing, which takes most of the time without a graphics card.
_NOTHING_DRAWN = """for (const what of ["Arrays", "Elements", "RangeElements"])
  for (const many of ["", "Instanced"])
    WebGL2RenderingContext.prototype["draw" + what + many] = () => {};"""


@contextmanager
def opened(
    profile: Path,
    *,
    width: int = 1280,
    height: int = 1000,
    dark: bool = False,
    draws: bool = True,
    flags: tuple[str, ...] = (),
) -> Iterator[Browser]:
    """Yield Chromium with an empty profile; without `draws`, WebGL draws nothing."""
    binary, driver = require_chromium()
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for flag in (*_FLAGS, *flags, f"--user-data-dir={profile}", f"--window-size={width},{height}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    chrome = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    chrome.set_script_timeout(120)  # a script may take long on a busy machine
    try:
        if not draws:
            chrome.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": _NOTHING_DRAWN})
        browser = Browser(chrome)
        browser.become(width, height, dark=dark)
        yield browser
    finally:
        chrome.quit()


class Browser:
    def __init__(self, chrome: webdriver.Chrome) -> None:
        self.chrome = chrome

    def become(self, width: int = 1280, height: int = 1000, *, dark: bool = False) -> None:
        """Set the size of the screen (a phone below 600 pixels) and the theme."""
        screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        theme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.chrome.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": theme})

    def open(self, path: Path) -> None:
        """Load a file, and add the functions of `probes.js`."""
        self.chrome.get(path.as_uri())
        self.js(_PROBES)

    def js(self, code: str, *arguments: Any) -> Any:
        """Run the body of a function in the page."""
        return self.chrome.execute_script(code, *arguments)

    def probe(self, name: str, *arguments: Any) -> Any:
        """Call a function of `probes.js`."""
        return self.js("return probe[arguments[0]](...arguments[1])", name, arguments)

    def settle(self) -> None:
        """Wait until the next two frames are drawn."""
        self.chrome.execute_async_script(
            "const done = arguments[0], next = requestAnimationFrame;"
            "next(() => next(() => setTimeout(done, 50)))"
        )

    def wait(self, code: str) -> None:
        """Wait until the body of a function returns a true value."""
        WebDriverWait(self.chrome, 60).until(lambda _: self.js(code))

    def wait_for(self, words: str) -> None:
        WebDriverWait(self.chrome, 60).until(lambda _: words in self.js("return document.body.innerText"))

    def screenshot(self, name: str) -> None:
        ARTEFACTS.mkdir(exist_ok=True)
        self.chrome.save_screenshot(str(ARTEFACTS / f"{name}.png"))

    def errors(self) -> list[str]:
        """Return the errors in the console since the last call."""
        return [entry["message"] for entry in self._log("browser") if entry["level"] == "SEVERE"]

    def requests(self) -> list[str]:
        """Return the requested addresses since the last call."""
        events = [json.loads(entry["message"])["message"] for entry in self._log("performance")]
        return [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]

    def _log(self, kind: str) -> list[dict[str, Any]]:
        return list(self.chrome.get_log(kind))  # type: ignore[no-untyped-call]
