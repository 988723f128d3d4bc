"""The reference tables that ship with urdfkin: vendors' and textbooks', each with its source."""

from __future__ import annotations

from pathlib import Path

from urdfkin.dh.parse_table import read_mapping
from urdfkin.errors import UnknownNameError
from urdfkin.system.files import exists
from urdfkin.system.resources import robots_dir


def references() -> dict[str, Path]:
    """Name -> file of each shipped table."""
    return {path.stem: path for path in sorted((robots_dir() / "dh").glob("*.toml"))}


def published(robot: str) -> list[str]:
    """How to have a catalogue robot's published tables, a line for each; none for other robots."""
    lines = []
    for name, path in references().items():
        data = read_mapping(path)
        if data.get("robot") == robot:
            snap = f" --snap {data['snap']:.0e}" if "snap" in data else ""
            lines.append(
                f"the {data['convention']} table that is published of this robot: --like {name}{snap}"
            )
    return lines


def reference_path(name: str) -> Path:
    """The file of a table: a path that exists, or the name of a shipped one.

    Raises:
        UnknownNameError: neither; the nearest names are offered.
    """
    path = Path(name)
    if path.suffix or exists(path):
        return path
    shipped = references()
    if name not in shipped:
        raise UnknownNameError("reference table", name, shipped)
    return shipped[name]
