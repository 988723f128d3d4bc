"""Lazy imports, versions of installed packages, and hooks.

A hook is a function that other modules call by a registered name. The calling module does not import the
module that defines the hook. `urdfkin/__init__.py` registers the hooks.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from operator import attrgetter
from typing import Any

from urdfkin.system.locks import import_lock


def lazy_import(target: str) -> Callable[..., Any]:
    """Return a function that calls `module:name`; the first call imports the module."""
    module, _, name = target.partition(":")
    get, loaded = attrgetter(name), list[Any]()

    def call(*arguments: Any, **options: Any) -> Any:
        if not loaded:
            with import_lock:
                loaded.append(import_module(module))
        return get(loaded[0])(*arguments, **options)

    return call


def is_instance(x: object, target: str) -> bool:
    """Return whether an object is an instance of the class `module:name`, without importing the module."""
    module, _, name = target.partition(":")
    # A class of an unimported module has no instances.
    return isinstance(x, getattr(sys.modules.get(module), name, ()))


@cache
def installed_version(package: str) -> str | None:
    # A search of the metadata folders is faster than `importlib.metadata`, because the import of
    # `importlib.metadata` takes 15 ms.
    start, end = f"{package.replace('-', '_')}-", ".dist-info"
    for entry in filter(os.path.isdir, sys.path):
        # `os.listdir` is faster than `Path.iterdir`.
        for name in os.listdir(entry):  # noqa: PTH208
            if name.startswith(start) and name.endswith(end):
                return name[len(start) : -len(end)]
    # `metadata` is imported late, because `metadata` imports many modules. At the start of urdfkin, files in
    # the current folder could replace these modules.
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


#: The extras for users and their requirements, as in pyproject.toml.
EXTRA_REQUIREMENTS = {
    "xacro": "xacrodoc>=2",
    "plots": "matplotlib>=3.10.7",
    "view": "viser>=1",
    "mujoco": "mujoco>=4,<5",
    "usd": "usd-core>=25.5",
    "descriptions": "robot_descriptions>=2",
    "cluster": "distributed>=2024.8",
}


def install_command(extra: str) -> str:
    """Return the command that installs the library of an extra, such as `pip install 'viser>=1'`.

    pip cannot install an extra of urdfkin by name, because no package index contains urdfkin yet.
    """
    return f"pip install '{EXTRA_REQUIREMENTS[extra]}'"


def urdfkin_version() -> str:
    return installed_version("urdfkin") or "of a checkout"


_HOOKS_BY_NAME: dict[str, Callable[..., Any]] = {}


def register_hook(name: str, function: Callable[..., Any]) -> None:
    _HOOKS_BY_NAME[name] = function


def get_hook(name: str) -> Callable[..., Any]:
    return _HOOKS_BY_NAME[name]
