"""Check reports, comparisons, the documentation site and the viewer in Chromium.

Each page is opened at four widths, in a light and a dark theme. The script runs the accessibility checker
axe, and reports serious violations, errors in the console, sideways scrolling and requests to other hosts.
The script also moves through the page with the Tab key, checks the HTML, and prints the page to a PDF.
`--output` saves pictures of all screens and of the printed pages.

The script needs Debian's chromium and chromium-driver. The extra `test` contains axe-core. Three tools are
optional: a newer axe, the Nu HTML checker (needs Java), and Debian's poppler-utils, which converts the pages
of the PDF to pictures.

    npm install --prefix ~/.cache/urdfkin-audit axe-core vnu-jar
    python -m scripts.audit_pages --output /tmp/audit
    python -m scripts.audit_pages --only one same --output /tmp/audit
"""

import argparse
import base64
import json
import logging
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import util
from itertools import product
from pathlib import Path
from unittest.mock import patch

import numpy as np
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

import urdfkin
from tests.report.browser import Browser, opened
from tests.report.documents import months_runs
from urdfkin.comparison.result import SameQuestion
from urdfkin.comparison.verdict import same
from urdfkin.report.history import as_html as history_page
from urdfkin.report.history import read_history
from urdfkin.report.html import as_files, as_html
from urdfkin.report.same import as_html as same_page
from urdfkin.robot.trajectory import make_line_trajectory
from urdfkin.validation.campaign import validate
from urdfkin.verify.pinocchio import PinocchioOracle

ROOT = Path(__file__).parents[1]
TOOLS = Path.home() / ".cache" / "urdfkin-audit" / "node_modules"
SCREENS = tuple(product((390, 768, 1000, 1280), (False, True)))
#: Time limit of axe-core, in seconds. axe-core needs half a minute for a page of 100,000 elements.
_AXE_SECONDS = 600
#: Severities of accessibility violations that count as errors. Other violations are only printed.
IMPACTS = ("serious", "critical")
UNFOLD = "document.querySelectorAll('details').forEach((part) => { part.open = true; })"
#: Maximum number of Tab presses per page.
_PRESSES = 60
#: Maximum number of PDF pages that become pictures.
_PAGES = 12
FOREIGN = ("Attribute “autocomplete” is only allowed when the input type is",)
#: The site's theme hides some elements if Chromium reports no mouse.
_MOUSE = (
    "--blink-settings=primaryHoverType=2,availableHoverTypes=2,primaryPointerType=4,availablePointerTypes=4"
)

_AXE = """
const done = arguments[0];
axe.run({ resultTypes: ["violations"] })
  .then((found) => done(found.violations.map((v) => [
    v.impact, v.id, v.nodes.length,
    v.nodes.slice(0, 3).map((n) => n.target.join(" ") + " " + n.html.slice(0, 160)),
  ])), (error) => done([["critical", "axe failed: " + error, 1, []]]));
"""
#: JavaScript that returns the name, the width and the available width of each table that is wider than its
#: box.
_CUT = """const own = "body:not(:has(#robots, #history)) section > .scroll > table";  // the page of `same`
return [...document.querySelectorAll(`#overview, .checks, #history, ${own}`)]
  .filter((t) => t.checkVisibility() && t.scrollWidth > t.parentElement.clientWidth)
  .map((t) => [t.id || t.className, t.scrollWidth, t.parentElement.clientWidth]);"""
#: JavaScript that returns the tag and name of the focused element, and three facts: whether an outline or a
#: shadow marks the element, whether it has an area, and whether it has a name.
_FOCUS = """
let e = document.activeElement;
if (!e || e === document.body) return null;
const name = (e.ariaLabel || e.labels?.[0]?.textContent || e.textContent || e.title || "").trim();
const style = getComputedStyle(e), box = e.getBoundingClientRect();
const ringed = (s) => (parseFloat(s.outlineWidth) > 0 && s.outlineStyle !== "none") || s.boxShadow !== "none";
const shown = ringed(style) || [...(e.labels ?? [])].some((l) => ringed(getComputedStyle(l)));
return [e.tagName.toLowerCase() + " " + name.slice(0, 40), shown, box.width * box.height > 0, !!name];
"""
#: JavaScript that returns whether the border of the focused element changes when it loses the focus.
_BORDER = """
const done = arguments[0], e = document.activeElement, border = () => getComputedStyle(e).borderColor;
setTimeout(() => { const focused = border(); e.blur(); setTimeout(() => {
  const changed = border() !== focused; e.focus(); done(changed); }, 300); }, 300);
"""


@dataclass(frozen=True)
class Page:
    name: str
    url: str
    prepare: str = ""
    own: tuple[str, ...] = ("file:", "data:", "blob:", "chrome")
    ready: str = ""
    printed: bool = True
    screens: tuple[tuple[int, bool], ...] = SCREENS
    whole: bool = True  # whether keyboard, HTML and PDF are checked, not only screens


def read_axe_script() -> str | None:
    if (path := TOOLS / "axe-core" / "axe.min.js").is_file():
        return path.read_text("utf-8")
    found = util.find_spec("axe_core_python")
    return (Path(str(found.origin)).parent / "axe.min.js").read_text("utf-8") if found else None


def find_html_checker() -> Path | None:
    path = TOOLS / "vnu-jar" / "build" / "dist" / "vnu.jar"
    return path if path.is_file() and shutil.which("java") else None


def report_makers(folder: Path) -> dict[str, Callable[[], str]]:
    right = PinocchioOracle.velocities
    bad = folder / "broken.urdf"
    bad.write_text('<robot name="broken"><link name="a"/><link name="a"/><joint name="j"/></robot>')

    def make_report(robots: str | list[str], samples: int) -> str:
        return as_html(validate(robots, samples=samples).as_dict())

    def make_disagreement() -> str:
        with patch.object(PinocchioOracle, "velocities", lambda *args: right(*args) * (1.0 + 1e-6)):
            return make_report(["panda", "ur5"], 6)

    def make_history() -> str:
        (folder / "runs").mkdir()
        for i, report in enumerate(months_runs()):
            (folder / "runs" / f"{i}.json").write_text(json.dumps(report), encoding="utf-8")
        (folder / "runs" / "broken.json").write_text("{")
        return history_page(read_history([folder / "runs"]))

    return {
        "good": lambda: make_report(["panda", "ur5", "talos"], 6),
        "one": lambda: make_report("panda", 20),
        "unreadable": lambda: make_report([str(bad), "ur5"], 6),
        "disagreement": make_disagreement,
        "history": make_history,
        "same-same": lambda: make_same_report("ur5", None),
        "same-differs": lambda: make_same_report("ur10", None),
        "same-within": lambda: make_same_report("ur5_limited", 1e-3),
    }


def make_same_report(b: str, within: float | None) -> str:
    robots = urdfkin.load("ur5"), urdfkin.load(b)
    return same_page(same(*robots, within=within), robots, SameQuestion(within))


def fleet_pages(folder: Path) -> Iterator[Page]:
    document = validate(urdfkin.robots(), samples=1).as_dict()
    (folder / "fleet-robots").mkdir()
    texts = {**dict(as_files(document, "fleet.html")), "fleet-text.html": as_html(document)}
    for file_name, text in texts.items():
        (folder / file_name).write_text(text, encoding="utf-8")
    yield (page := Page("fleet", (folder / "fleet.html").as_uri()))
    yield Page("fleet-text", (folder / "fleet-text.html").as_uri())
    for i, robot in enumerate(document["robots"]):
        ready = f"return !!document.querySelector('#robot-{i} :is(.checks, .reason)')"
        name, url, screens = f"fleet-{robot['source']}", f"{page.url}#robot-{i}", ((390, False), (1280, True))
        yield Page(name, url, ready=ready, screens=screens, whole=False)


def site_pages(folder: Path) -> Iterator[Page]:
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    logging.getLogger("mkdocs").setLevel(logging.ERROR)
    config = load_config(str(ROOT / "mkdocs.yml"), site_dir=str(folder / "site"), strict=False)
    config.plugins.on_startup(command="build", dirty=False)
    build(config)
    named = ("index", "questions", "reports", "viewer", "equations", "lessons/planar-arm", "cli", "api/robot")
    for name in named:
        url = (folder / "site" / f"{name}.html").as_uri()
        yield Page(f"site-{name.replace('/', '-')}", url, printed=False)


def iter_pages(folder: Path, is_selected: Callable[[str], bool]) -> Iterator[Page]:
    for name, make in report_makers(folder).items():
        if is_selected(name):
            path = folder / f"{name}.html"
            path.write_text(make(), encoding="utf-8")
            yield Page(name, path.as_uri())
            if name in ("good", "disagreement"):
                yield Page(f"{name}-unfolded", path.as_uri(), UNFOLD)
    for name, pages in (("fleet", fleet_pages), ("site", site_pages)):
        if is_selected(name):
            yield from pages(folder)


@contextmanager
def run_viewer(plays: bool = False) -> Iterator[Page]:
    from urdfkin.view.server import new_server
    from urdfkin.view.viewer import Viewer

    server = new_server(port=8097)
    try:
        robot, q = urdfkin.load("planar_two_link"), np.array([0.4, 0.8])
        Viewer(server, robot, q, make_line_trajectory(robot, q, -q, 2.0, 20) if plays else None)
        host = f"127.0.0.1:{server.get_port()}"
        own = (f"http://{host}", f"ws://{host}", "data:", "blob:", "chrome")
        ready = (  # The viewer hides its controls on a phone.
            "return !!document.querySelector('canvas')"
            " && (!!document.getElementById('fold') || document.body.innerText.includes('verified'))"
        )
        name = "viewer-trajectory" if plays else "viewer"
        yield Page(name, server.address, own=own, ready=ready, printed=False)
    finally:
        server.stop()


def open_page(browser: Browser, page: Page) -> None:
    # A new `#part` of an address does not reload the page.
    browser.chrome.get("about:blank")
    browser.chrome.get(page.url)
    if page.ready:
        browser.wait(page.ready)
    if page.prepare:
        browser.js(page.prepare)
    browser.settle()


def check_screen(
    browser: Browser, page: Page, width: int, dark: bool, axe: str | None, output: Path | None = None
) -> list[str]:
    screen, faults = f"{width} {'dark' if dark else 'light'}", list[str]()
    browser.become(width, 844 if width < 600 else 1000, dark=dark)
    browser.requests()
    browser.errors()
    open_page(browser, page)
    if (wide := browser.js("return document.documentElement.scrollWidth")) > width:
        faults.append(f"{wide} pixels wide")
    faults += [f"asks for {url}" for url in browser.requests() if not url.startswith(page.own)]
    faults += [f"console: {error}" for error in browser.errors()]
    if axe is not None:
        browser.js(axe)
        browser.chrome.set_script_timeout(_AXE_SECONDS)
        for impact, rule, count, nodes in browser.chrome.execute_async_script(_AXE):
            fault = f"{impact} {rule}, {count} times: {'; '.join(nodes)}"
            if impact in IMPACTS:
                faults.append(fault)
            else:
                print(f"  note {screen}: {fault[:300]}", flush=True)
    faults += [
        f"table {name}: {inner} pixels wide, but its box has {room}" for name, inner, room in browser.js(_CUT)
    ]
    if output is not None:
        for k in range(browser.js("return document.querySelectorAll('canvas').length")):
            # The browser draws a 3D view only while it is visible.
            browser.js("document.querySelectorAll('canvas')[arguments[0]].scrollIntoView()", k)
            browser.settle()
        browser.js("scrollTo(0, 0)")
        height = browser.js("return document.documentElement.scrollHeight")
        browser.become(width, min(6000, height), dark=dark)
        browser.settle()
        browser.chrome.save_screenshot(str(output / f"{page.name}-{screen.replace(' ', '-')}.png"))
    return [f"{page.name}, {screen}: {fault}" for fault in dict.fromkeys(faults)]


def check_keyboard(browser: Browser, page: Page) -> list[str]:
    faults, seen = list[str](), list[str]()
    browser.become(1280, 1000)
    open_page(browser, page)
    for _ in range(_PRESSES):
        ActionChains(browser.chrome).send_keys(Keys.TAB).perform()
        stop = browser.js(_FOCUS)
        if stop is None:  # The Tab key moved the focus out of the page.
            break
        element, is_marked, has_area, has_name = stop
        seen.append(element)
        if not is_marked and has_area and not browser.chrome.execute_async_script(_BORDER):
            faults.append(f"no visible focus on {element}")
        if not has_name:
            faults.append(f"no name of {element}")
        if len(seen) > 5 and len(set(seen[-5:])) == 1 and not seen[-1].startswith(("input", "button")):
            faults.append(f"the focus stays on {element}")
            break
    if not seen and browser.js("return document.querySelectorAll('a, button, input, [tabindex]').length"):
        faults.append("the Tab key reaches nothing")
    return [f"{page.name}, keyboard: {fault}" for fault in dict.fromkeys(faults)]


def find_html_errors(page: Page, jar: Path) -> list[str]:
    path = page.url.removeprefix("file://")
    done = subprocess.run(
        ["java", "-Xss4m", "-jar", str(jar), "--format", "json", "--errors-only", path],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    messages = json.loads(done.stderr or "{}").get("messages", [])
    return [
        f"{page.name}, HTML: line {m.get('lastLine')}: {m['message']}: {m.get('extract', '')[:120]!r}"
        for m in messages
        if not m["message"].startswith(FOREIGN)
    ]


def print_to_pdf(browser: Browser, page: Page) -> bytes:
    browser.become(1280, 1000)
    open_page(browser, page)
    a4 = {"printBackground": True, "paperWidth": 8.27, "paperHeight": 11.69}
    return base64.b64decode(browser.chrome.execute_cdp_cmd("Page.printToPDF", a4)["data"])


def audit(browser: Browser, page: Page, output: Path | None, axe: str | None, jar: Path | None) -> list[str]:
    lines = list[str]()
    for width, dark in page.screens:
        lines += check_screen(browser, page, width, dark, axe, output)
    if not page.whole:
        return lines
    lines += check_keyboard(browser, page)
    if jar is not None and page.url.startswith("file:") and not page.prepare:
        lines += find_html_errors(page, jar)
    if output is not None and page.printed:
        pdf = output / f"{page.name}.pdf"
        pdf.write_bytes(print_to_pdf(browser, page))
        if shutil.which("pdftoppm"):
            options = ["-r", "60", "-png", "-l", str(_PAGES)]
            command = ["pdftoppm", *options, str(pdf), str(output / f"{page.name}-print")]
            subprocess.run(command, check=True, timeout=120)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    only = "pages to audit, by the beginnings of their names: good, same, fleet, site, viewer"
    parser.add_argument("--only", nargs="*", default=[""], help=only)
    parser.add_argument("--output", type=Path, help="folder for pictures and printed pages")
    arguments = parser.parse_args()
    axe, jar = read_axe_script(), find_html_checker()
    if arguments.output is not None:
        arguments.output.mkdir(parents=True, exist_ok=True)
    print(f"axe: {axe.splitlines()[0] if axe else 'missing'}; HTML checker: {jar or 'missing'}")
    faults = list[str]()

    def is_selected(name: str) -> bool:
        return name.startswith(tuple(arguments.only))

    def audit_page(browser: Browser, page: Page) -> None:
        # The site stores the theme of the first visit, so this script clears the storage before each page
        # loads.
        script = {"source": "try { localStorage.clear(); } catch {}"}
        browser.chrome.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", script)
        page_faults = audit(browser, page, arguments.output, axe, jar)
        faults.extend(page_faults)
        print(f"{page.name}: {len(page_faults)} faults", *page_faults, sep="\n  ", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        with opened(Path(folder) / "profile", flags=(_MOUSE,)) as browser:
            for page in iter_pages(Path(folder), is_selected):
                audit_page(browser, page)
        for plays in (False, True) if is_selected("viewer") else ():
            profile = Path(folder) / f"viewer-{plays}"
            with opened(profile, flags=(_MOUSE,), draws=False) as browser, run_viewer(plays) as page:
                audit_page(browser, page)
    print(f"{len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
