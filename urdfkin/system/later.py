"""Functions that are named, not imported: whoever only asks for help needs no numpy."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from typing import Any

from urdfkin.system.forking import importing


def later(home: str) -> Callable[..., Any]:
    """The function `module:name`, imported and looked up when it is called."""
    module, _, name = home.partition(":")

    def call(*arguments: Any, **options: Any) -> Any:
        with importing:
            found = import_module(module)
        return attrgetter(name)(found)(*arguments, **options)

    return call
