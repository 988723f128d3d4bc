"""Functions that are named, not imported: whoever only asks for help needs no numpy.

Which version of a package is installed, told without importing it.

What a lower room has done by a higher one: it asks by a word, and knows nobody above it.

Who answers is said where the package is put together, in `urdfkin/__init__.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module, metadata
from operator import attrgetter
from typing import Any

from urdfkin.system.processes import importing


def lazy_import(home: str) -> Callable[..., Any]:
    """The function `module:name`, imported and looked up when it is called."""
    module, _, name = home.partition(":")

    def call(*arguments: Any, **options: Any) -> Any:
        with importing:
            found = import_module(module)
        return attrgetter(name)(found)(*arguments, **options)

    return call


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


_ANSWERS: dict[str, Callable[..., Any]] = {}


def register_hook(word: str, function: Callable[..., Any]) -> None:
    """Have a function answer to a word."""
    _ANSWERS[word] = function


def hook(word: str) -> Callable[..., Any]:
    """The function that answers to a word."""
    return _ANSWERS[word]
