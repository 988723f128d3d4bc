"""How large an installation of urdfkin is, package by package: what a fresh environment of it holds."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

from packaging.requirements import Requirement


def closure(name: str) -> dict[str, int]:
    """A package and all that it needs without extras -> bytes of its files."""
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


def main() -> None:
    """The largest, and sums."""
    sizes = closure("urdfkin")
    for name, size in sorted(sizes.items(), key=lambda item: -item[1])[:10]:
        print(f"{size / 1e6:7.0f} MB  {name}")
    print(f"{sum(sizes.values()) / 1e6:7.0f} MB  urdfkin and the {len(sizes) - 1} packages that it needs")
    print(f"{sum(closure('pin').values()) / 1e6:7.0f} MB  of these for pin, which is Pinocchio")


if __name__ == "__main__":
    main()
