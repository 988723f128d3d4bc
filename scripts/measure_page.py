"""Measure the times to write, open, search and expand a report of thousands of robots in Chromium.

The script validates a few robots, and copies their results many times under other names. The script
prints medians over several runs, each with a new browser profile. The script needs Debian's chromium and
chromium-driver.

    python scripts/measure_page.py --robots 2000
"""

import argparse
import tempfile
import time
from itertools import cycle, islice
from pathlib import Path
from statistics import median

from tests.report.browser import opened
from urdfkin.report.html import as_files
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document

_ROBOTS = ("ur5", "panda", "z1", "kinova", "planar_two_link")
_PAINTED = "return performance.getEntriesByName('first-contentful-paint')[0].startTime"
_READY = "return performance.getEntriesByType('navigation')[0].domComplete"
_FIND = (
    "/* Type into the search field, and return the milliseconds until the layout is done. */"
    "const t = performance.now(), find = document.querySelector('#find'); find.value = arguments[0];"
    "find.dispatchEvent(new Event('input')); document.body.offsetHeight; return performance.now() - t"
)
_UNFOLD = """
    // Open the section of a robot, and return the milliseconds until its table exists.
    const done = arguments[1], row = document.querySelector(`#robot-${arguments[0]}`), t = performance.now();
    const look = () => row.querySelector('table.checks') ? done(performance.now() - t) : setTimeout(look, 5);
    row.open = true; look();
"""


def make_report(robots: int) -> Document:
    document = validate(list(_ROBOTS), samples=10).as_dict()
    few = islice(cycle(document["robots"]), robots)
    document["robots"] = [robot | {"source": f"fleet/{i:04}.urdf"} for i, robot in enumerate(few)]
    document["robots_requested"] = robots
    return document


def measure_page(page: Path, profile: Path, robots: int) -> dict[str, float]:
    with opened(profile) as browser:
        browser.chrome.get("about:blank")
        browser.open(page)
        return {
            "first paint": browser.js(_PAINTED),
            "loaded": browser.js(_READY),
            "one robot found": browser.js(_FIND, f"{robots - 1:04}"),
            "all found again": browser.js(_FIND, ""),
            "one robot unfolded, its file read": browser.chrome.execute_async_script(_UNFOLD, robots // 2),
        }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page, begin = Path(folder) / "fleet.html", time.process_time()
        (page.parent / "fleet-robots").mkdir()
        sizes = [
            (page.parent / place).write_text(text, encoding="utf-8")
            for place, text in as_files(make_report(options.robots), page.name)
        ]
        print(f"written: {time.process_time() - begin:.1f} s of processor time, {len(sizes)} files,", end=" ")
        print(f"the page {sizes[-1] / 1e6:.2f} MB, {sum(sizes) / 1e6:.0f} MB in total")
        rounds = [
            measure_page(page, Path(folder) / f"profile-{i}", options.robots) for i in range(options.rounds)
        ]
    for name in rounds[0]:
        print(f"{name}: {median(times[name] for times in rounds):.0f} ms", end=" ")
        print(f"({', '.join(f'{times[name]:.0f}' for times in rounds)})")
