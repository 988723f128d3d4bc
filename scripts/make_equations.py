"""Write docs/equations.md from the registry of equations."""

from __future__ import annotations

from pathlib import Path

from urdfkin.kinematics.registry import table

PAGE = Path(__file__).parents[1] / "docs" / "equations.md"


def main() -> None:
    """Write the page."""
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(table(), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
