"""Which version of a package is installed, told without importing it."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def installed_version(package: str) -> str | None:
    """As pip installed it; None: not at all. Kept, because finding it takes milliseconds each time."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def own_version() -> str:
    """Urdfkin's own; in words where it runs from a checkout that is not installed."""
    return installed_version("urdfkin") or "of a checkout"
