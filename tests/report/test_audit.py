"""Accessibility, keyboard control and printing of pages; `scripts/audit_pages.py` has more pages."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from scripts import audit_pages
from scripts.audit_pages import (
    Page,
    check_keyboard,
    check_screen,
    find_html_checker,
    find_html_errors,
    print_to_pdf,
    read_axe_script,
)
from tests.reading import present
from tests.report.browser import Browser, opened
from tests.report.documents import arms, failing, hostile, months_runs, saved
from urdfkin.report.history import as_html as history_page
from urdfkin.report.history import read_history
from urdfkin.report.html import as_html

pytestmark = [pytest.mark.long, pytest.mark.browser]

NAMES = ("arms", "failing", "hostile", "history", "same")
UNFOLD = "document.querySelectorAll('details.robot').forEach((one) => { one.open = true; })"


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Page]:
    folder = tmp_path_factory.mktemp("pages")
    document = arms()
    model = present(document["robots"][0]["model"])
    model["path"] = "/home/somebody" + 12 * "/a_long_name_of_a_folder" + "/arm.urdf"
    texts = {"arms": as_html(document), "failing": as_html(failing()), "hostile": as_html(hostile())}
    (folder / "runs").mkdir()
    for i, report in enumerate([*months_runs(), hostile()]):
        saved(folder / "runs" / f"{i}.json", report)
    texts["history"] = history_page(read_history([folder / "runs"]))
    texts["same"] = audit_pages.make_same_report("ur5_limited", 1e-3)
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return {name: Page(name, (folder / f"{name}.html").as_uri(), audit_pages.UNFOLD) for name in texts}


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with opened(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize(("width", "dark"), [(390, False), (768, True)], ids=["390-light", "768-dark"])
@pytest.mark.parametrize("name", NAMES)
def test_a_page_has_no_serious_violation_no_error_no_horizontal_scrolling_and_no_request(
    name: str, width: int, dark: bool, pages: dict[str, Page], desk: Browser
) -> None:
    axe = read_axe_script()
    if axe is None:
        pytest.skip("axe is not installed: pip install axe-core-python")
    assert check_screen(desk, pages[name], width, dark, axe) == []


def test_the_audit_detects_faults_of_a_page(tmp_path: Path, desk: Browser) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text(
        "<!doctype html><html><title>t</title><style>*:focus{outline:0}</style><p style='width:900px;"
        "color:#ccc'>pale</p><button></button><a href='#'>a</a><script>missing()</script>"
    )
    page = Page("bad", bad.as_uri())
    faults = check_screen(desk, page, 390, False, read_axe_script())
    assert any("900" in line or "pixels wide" in line for line in faults)
    assert any("missing is not defined" in line for line in faults)
    if read_axe_script() is not None:
        assert any("color-contrast" in line for line in faults)
        assert any("button-name" in line for line in faults)
    found = check_keyboard(desk, page)
    assert "bad, keyboard: no visible focus on a a" in found
    assert any("no name of button" in line for line in found)


@pytest.mark.parametrize("name", NAMES)
def test_the_tab_key_reaches_controls_with_a_name_and_a_visible_focus(
    name: str, pages: dict[str, Page], desk: Browser
) -> None:
    assert check_keyboard(desk, pages[name]) == []


@pytest.mark.parametrize("name", NAMES)
def test_the_html_of_a_page_has_no_error(name: str, pages: dict[str, Page]) -> None:
    jar = find_html_checker()
    if jar is None:
        pytest.skip("the Nu HTML checker or Java is not installed: see scripts/audit_pages.py")
    assert find_html_errors(pages[name], jar) == []


def test_a_printed_page_has_every_drawing_in_light_colours(pages: dict[str, Page], desk: Browser) -> None:
    desk.become(1280, 400, dark=True)
    desk.open(Path(pages["arms"].url.removeprefix("file://")))
    desk.js(f"{UNFOLD}; scrollTo(0, 0)")
    drawn = "return [...document.querySelectorAll('canvas')].map((one) => !!one.dataset.drawn)"
    assert not all(desk.js(drawn)), "an invisible robot is not drawn"
    desk.js("dispatchEvent(new Event('beforeprint'))")
    assert desk.js(drawn) == [True, True]
    colour = "return document.querySelector('[data-view]').view.materials.turn.color.getHex()"
    assert desk.js(colour) == 0x2F6FD0
    desk.js("dispatchEvent(new Event('afterprint'))")
    assert desk.js(colour) == 0x6EA3EE


@contextmanager
def printing(desk: Browser) -> Iterator[None]:
    desk.chrome.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        yield
    finally:
        desk.chrome.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_the_reason_has_the_largest_text_of_a_printed_page(pages: dict[str, Page], desk: Browser) -> None:
    desk.become()
    desk.open(Path(pages["failing"].url.removeprefix("file://")))
    with printing(desk):
        sizes = desk.js(
            f"{UNFOLD}; return ['.reason', '.checks td', '.failures code', '.aside'].map((name) =>"
            " parseFloat(getComputedStyle(document.querySelector(name)).fontSize))"
        )
    assert sizes[0] == max(sizes)
    assert min(sizes) >= 7.0


def test_a_printed_page_has_open_robots_only(pages: dict[str, Page], desk: Browser) -> None:
    desk.become()
    desk.open(Path(pages["arms"].url.removeprefix("file://")))
    shown = "return [...document.querySelectorAll('.robot')].map((one) => one.checkVisibility())"
    desk.js("document.querySelectorAll('.robot').forEach((one, i) => { one.open = i === 1; })")
    on_screen = desk.js(shown)
    with printing(desk):
        visible = desk.js(shown)
        note = desk.js("return document.querySelector('main > .paper').checkVisibility()")
    assert (on_screen, visible, note) == ([True, True], [False, True], True)


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="poppler-utils are not installed")
def test_printed_command_lines_take_at_most_half_a_page(
    pages: dict[str, Page], desk: Browser, tmp_path: Path
) -> None:
    (tmp_path / "a.pdf").write_bytes(print_to_pdf(desk, pages["arms"]))
    text = subprocess.run(
        ["pdftotext", "-layout", str(tmp_path / "a.pdf"), "-"], check=True, capture_output=True, text=True,
        timeout=60,
    ).stdout  # fmt: skip
    assert "Worst cases" in text
    assert len(re.findall(r"urdfkin \w+ (?:panda|ur5) --frame", text)) == 0
    assert "has the command that computes each case again" in " ".join(text.split())
