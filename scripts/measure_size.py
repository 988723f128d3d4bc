"""Measure the size of an installation of urdfkin, and write the size into docs/install.md.

    python scripts/measure_size.py

All extras must be installed, for example by scripts/test.sh. Python, pip and bytecode are not counted.
"""

import importlib.metadata
import sys
from collections.abc import Iterable
from pathlib import Path

from packaging.requirements import Requirement

from scripts.pages import DOCS, table, update_page

ROOT = Path(__file__).parents[1]
PAGE = DOCS / "install.md"
EXTRAS = ("plots", "view", "xacro", "mujoco", "usd", "descriptions", "cluster")


def measure_packages(name: str, extras: Iterable[str] = (), without: str = "") -> dict[str, int]:
    """Return the sizes (bytes) of a package and its dependencies.

    The result omits the package `without`, and packages that only `without` requires.
    """
    sizes: dict[str, int] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    waiting = [(name, frozenset(extras))]
    while waiting:
        name, selected_extras = waiting.pop()
        name = name.lower().replace("_", "-")
        if (name, selected_extras) in seen or name == without:
            continue
        seen.add((name, selected_extras))
        distribution = importlib.metadata.distribution(name)
        files = [Path(str(path.locate())) for path in distribution.files or ()]
        sizes[name] = sum(file.stat().st_size for file in files if file.is_file())
        for need in map(Requirement, distribution.requires or ()):
            if need.marker is None or any(
                need.marker.evaluate({"extra": extra}) for extra in {"", *selected_extras}
            ):
                waiting.append((need.name, frozenset(need.extras)))
    return sizes


def measure_wheel() -> int:
    """Return the unpacked wheel's size (bytes)."""
    places = (ROOT / "urdfkin", ROOT / "robots", ROOT / "docs" / "questions.md")
    files = (file for place in places for file in (place.rglob("*") if place.is_dir() else (place,)))
    return sum(file.stat().st_size for file in files if file.is_file() and file.suffix != ".pyc")


def make_section(core: dict[str, int], lean: dict[str, int], extras: dict[str, tuple[int, int]]) -> str:
    total, meshes = sum(core.values()), sum(core.values()) - sum(lean.values())
    robots, pinocchio = core["example-robot-data"], sum(measure_packages("pin").values())
    text = (
        f"An installation has {len(core)} packages and takes {total / 1e9:.1f} GB:"
        f" {robots / 1e9:.2f} GB for the robots of\nexample-robot-data, {pinocchio / 1e9:.2f} GB for"
        " Pinocchio and its libraries, and the rest mostly for NumPy, Numba and its\ncompiler."
        f" {len(core) - len(lean)} packages ({meshes / 1e6:.0f} MB) come only with yourdfpy, which needs"
        " `trimesh[easy]`. A job that only\n[checks files](ci.md) needs only urdfkin and click,"
        f" together {(measure_wheel() + core['click']) / 1e6:.0f} MB.\n\n"
    )
    rows = [(f"`[{name}]`", count, f"{size / 1e6:.0f} MB") for name, (count, size) in extras.items()]
    return text + table(("extra", "additional packages", "size"), rows)


if __name__ == "__main__":
    core = measure_packages("urdfkin") | {"urdfkin": measure_wheel()}
    lean = measure_packages("urdfkin", without="yourdfpy") | {"urdfkin": measure_wheel()}
    extras = {}
    for extra in EXTRAS:
        added = {
            name: size for name, size in measure_packages("urdfkin", [extra]).items() if name not in core
        }
        if not added:
            sys.exit(f"the page is not written: install urdfkin again with the extra {extra}")
        extras[extra] = (len(added), sum(added.values()))
    update_page(PAGE, size=make_section(core, lean, extras))
