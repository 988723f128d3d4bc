"""Locations of the files of urdfkin and of example-robot-data."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from urdfkin.errors import SourceError


@cache
def robots_dir() -> Path:
    return _find_file("own robots are", "urdfkin/robots/catalogue.toml", "robots/catalogue.toml").parent


def questions_page() -> Path:
    return _find_file("page questions.md is", "urdfkin/questions.md", "docs/questions.md")


def _find_file(what: str, *paths: str) -> Path:
    """Return the first path that exists; `paths` are relative to the folder that contains the package."""
    package_parent = Path(__file__).resolve().parents[2]
    if (file := next((path for path in map(package_parent.joinpath, paths) if path.is_file()), None)) is None:
        raise SourceError(
            f"urdfkin's {what} missing", where=str(package_parent / "urdfkin"), remedy="install urdfkin again"
        )
    return file


@cache
def example_robots_dir() -> Path:
    candidates = list(_example_folder_candidates())
    for folder in candidates:
        if folder.is_dir():
            return folder
    raise SourceError(
        "example-robot-data is not installed",
        found="no folder " + " or ".join(str(folder) for folder in candidates),
        remedy="pip install example-robot-data",
    )


def _example_folder_candidates() -> Iterator[Path]:
    below = Path("share", "example-robot-data", "robots")
    from importlib import metadata

    try:
        distribution = metadata.distribution("example-robot-data")
        yield Path(str(distribution.locate_file("cmeel.prefix"))) / below
    except metadata.PackageNotFoundError:
        pass
    spec = importlib.util.find_spec("pinocchio")
    if spec is not None and spec.origin is not None:
        # `origin` is <prefix>/lib/python3.x/site-packages/pinocchio/__init__.py.
        yield from (prefix / below for prefix in Path(spec.origin).parents[4:5])
    yield Path(sys.prefix) / below
