"""The chapter's equations, compiled for whatever kind of number they are called with."""

from __future__ import annotations

from typing import Any

from urdfkin.compiled.compiling import compiled
from urdfkin.kinematics.number_kinds import bound

globals().update(vars(bound(made=compiled)))


def __getattr__(name: str) -> Any:
    # Only a name that `equations` does not have comes here.
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
