"""Find the reference tables in urdfkin: tables of vendors and textbooks, each with its source."""

from __future__ import annotations

from pathlib import Path

from urdfkin.dh.parse_table import read_mapping
from urdfkin.errors import UnknownNameError
from urdfkin.system.files import exists
from urdfkin.system.resources import robots_dir


def references() -> dict[str, Path]:
    """Return name -> file for each reference table in urdfkin."""
    return {path.stem: path for path in sorted((robots_dir() / "dh").glob("*.toml"))}


def published(robot: str) -> list[str]:
    """Return a line with the option `--like` for each published table of a robot."""
    lines = []
    for name, path in references().items():
        data = read_mapping(path)
        if data.get("robot") == robot:
            snap = f" --snap {data['snap']:.0e}" if "snap" in data else ""
            lines.append(f"published {data['convention']} table of this robot: --like {name}{snap}")
    return lines


def reference_path(name: str) -> Path:
    """Return the file of a table, given its path or the name of a reference table.

    Raises:
        UnknownNameError: neither; the message lists the nearest names.
    """
    path = Path(name)
    if path.suffix or exists(path):
        return path
    shipped = references()
    if name not in shipped:
        raise UnknownNameError("reference table", name, shipped)
    return shipped[name]
