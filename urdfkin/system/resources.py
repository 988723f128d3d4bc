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
    """Return the folder `robots`, which is in the installed package or, in a checkout, beside the package."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "robots", here.parent / "robots"):
        if (folder / "catalogue.toml").is_file():
            return folder
    raise SourceError("urdfkin's own robots are missing", where=str(here), remedy="install urdfkin again")


def questions_page() -> Path:
    """Return the path of questions.md, which is in the installed package or, in a checkout, in `docs`."""
    here = Path(__file__).resolve().parents[1]
    for file in (here / "questions.md", here.parent / "docs" / "questions.md"):
        if file.is_file():
            return file
    raise SourceError(
        "urdfkin's page questions.md is missing", where=str(here), remedy="install urdfkin again"
    )


@cache
def example_robots_dir() -> Path:
    """Return the folder `share/example-robot-data/robots` without importing that package."""
    candidates = list(_example_candidates())
    for folder in candidates:
        if folder.is_dir():
            return folder
    raise SourceError(
        "example-robot-data is not installed",
        found="no folder " + " or ".join(str(folder) for folder in candidates),
        remedy="pip install example-robot-data",
    )


def _example_candidates() -> Iterator[Path]:
    below = Path("share", "example-robot-data", "robots")
    from importlib import metadata  # noqa: PLC0415  this import takes as long as loading a robot

    try:
        distribution = metadata.distribution("example-robot-data")
        yield Path(str(distribution.locate_file("cmeel.prefix"))) / below
    except metadata.PackageNotFoundError:
        pass
    spec = importlib.util.find_spec("pinocchio")
    if spec is not None and spec.origin is not None:
        # <prefix>/lib/python3.x/site-packages/pinocchio/__init__.py
        yield from (prefix / below for prefix in Path(spec.origin).parents[4:5])
    yield Path(sys.prefix) / below
