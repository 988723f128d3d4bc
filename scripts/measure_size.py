"""Measure the size of an installation of urdfkin in a new environment, and write it into docs/index.md.

    python scripts/measure_size.py

The script also prints the largest packages and the sums. Python, pip and bytecode are not counted.
"""

from __future__ import annotations

import importlib.metadata
import re
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "index.md"
_PLACE = re.compile(r"(<!-- size -->\n).*?(\n<!-- end -->)", re.DOTALL)


def closure(name: str) -> dict[str, int]:
    """Return the sizes in bytes of a package and its dependencies without extras."""
    found: dict[str, int] = {}
    waiting = [name]
    while waiting:
        name = waiting.pop().lower().replace("_", "-")
        if name in found:
            continue
        distribution = importlib.metadata.distribution(name)
        files = [Path(path.locate()) for path in distribution.files or ()]
        found[name] = sum(file.stat().st_size for file in files if file.is_file())
        needs = map(Requirement, distribution.requires or ())
        waiting += [need.name for need in needs if need.marker is None or need.marker.evaluate({"extra": ""})]
    return found


def own() -> int:
    """Return the size in bytes of urdfkin's unpacked wheel: the package and the files from pyproject.toml."""
    places = (ROOT / "urdfkin", ROOT / "robots", ROOT / "docs" / "questions.md")
    files = (file for place in places for file in (place.rglob("*") if place.is_dir() else (place,)))
    return sum(file.stat().st_size for file in files if file.is_file() and file.suffix != ".pyc")


def sentence(all_: int, robots: int, pinocchio: int, checking: int) -> str:
    """Return the sentence of the page from sizes in bytes."""
    return (
        f"An installation takes {all_ / 1e9:.1f} GB: {robots / 1e9:.2f} GB for the robots of"
        f" example-robot-data, {pinocchio / 1e9:.2f} GB for Pinocchio and its\nlibraries, and the rest mostly"
        f" for NumPy, Numba and its compiler. A job that only [checks files](ci.md)\nneeds urdfkin and click,"
        f" {checking / 1e6:.0f} MB."
    )


def page(text: str, said: str) -> str:
    """Return the page with the sentence inserted."""
    found, count = _PLACE.subn(lambda place: place[1] + said + place[2], text)
    if count != 1:
        raise ValueError(f"the page has {count} places for the size")
    return found


def main() -> None:
    """Print the largest packages and the sums, and write the page."""
    sizes = closure("urdfkin") | {"urdfkin": own()}
    for name, size in sorted(sizes.items(), key=lambda item: -item[1])[:10]:
        print(f"{size / 1e6:7.0f} MB  {name}")
    everything, pinocchio = sum(sizes.values()), sum(closure("pin").values())
    checking = own() + sizes["click"]
    print(f"{everything / 1e6:7.0f} MB  urdfkin and the {len(sizes) - 1} packages that it needs")
    print(f"{pinocchio / 1e6:7.0f} MB  of these for pin, which is Pinocchio")
    print(f"{checking / 1e6:7.0f} MB  urdfkin and click, which `urdfkin check` needs")
    said = sentence(everything, sizes["example-robot-data"], pinocchio, checking)
    PAGE.write_text(page(PAGE.read_text("utf-8"), said), "utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
