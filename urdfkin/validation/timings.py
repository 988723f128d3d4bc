"""Measure the computing times of a validation: reading, urdfkin, the oracles, and comparison."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclass(slots=True)
class Timings:
    """Computing times in seconds; `compare` is the total time minus all other times."""

    read: float = 0.0
    urdfkin: float = 0.0
    pinocchio: float = 0.0
    compare: float = 0.0
    second: float = 0.0

    def timed(self, part: str, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call a function. Add its computing time (s) to the attribute named by `part`, such as "urdfkin"."""
        begin = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            setattr(self, part, getattr(self, part) + (time.perf_counter() - begin))

    def close(self, seconds: float) -> None:
        self.compare = max(0.0, seconds - self.read - self.urdfkin - self.pinocchio - self.second)

    def __add__(self, other: Timings) -> Timings:
        return Timings(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def as_dict(self) -> dict[str, Any]:
        parts = {name: round(getattr(self, name), 4) for name in ("read", "urdfkin", "pinocchio", "compare")}
        return parts | ({"second_oracle": round(self.second, 4)} if self.second else {})
