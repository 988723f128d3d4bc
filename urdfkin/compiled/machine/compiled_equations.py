"""The textbook's equations, compiled by Numba for each type of argument."""

from __future__ import annotations

from typing import Any

from urdfkin.compiled.machine.compiling import inline
from urdfkin.kinematics.arithmetic import bind_equations

globals().update(vars(bind_equations(decorate=inline)))


def __getattr__(name: str) -> Any:
    # Python calls this function only for names that this module does not contain.
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
