"""A robot in a notebook's cell, in a real browser: drawn, at the configuration asked for, asking nobody."""

from __future__ import annotations

from pathlib import Path

import pytest

import urdfkin
from tests.report.browser import opened, require_chromium


@pytest.mark.slow
def test_a_robot_in_a_cell_is_drawn_where_it_was_put_and_asks_for_nothing(tmp_path: Path) -> None:
    require_chromium()
    cell = urdfkin.load("panda", verify=False).view("ready, panda_joint1=30deg")
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f'<!doctype html><meta charset="utf-8"><body>{cell._repr_html_()}', encoding="utf-8")
    with opened(tmp_path / "profile") as browser:
        browser.open(notebook)
        browser.chrome.switch_to.frame(0)
        browser.wait("return Number(document.querySelector('canvas').dataset.drawn || 0) > 0")
        outputs = browser.js(
            "return [...document.querySelectorAll('.sliders output')].map((o) => o.textContent)"
        )
        assert outputs == ["30.0°", "-45.0°", "0.0°", "-135.0°", "0.0°", "90.0°", "45.0°", "0.0010 m"]
        browser.screenshot("cell")
        assert browser.errors() == []
        assert [url for url in browser.requests() if url.startswith(("http", "ws"))] == []
