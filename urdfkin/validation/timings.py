"""Measure the computing times of a validation: reading, urdfkin, the oracles, and comparison."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass
from typing import Any, ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclass(slots=True)
class Clock:
    """Computing time (seconds) of each part; `read` includes the models of urdfkin and Pinocchio.

    The time `compare` of the bounds and the comparison is the total time minus the times of the other parts.
    """

    read: float = 0.0
    urdfkin: float = 0.0
    pinocchio: float = 0.0
    compare: float = 0.0
    second: float = 0.0

    def timed(self, part: str, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call a function, and add its computing time to a part, such as "urdfkin"."""
        begin = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            setattr(self, part, getattr(self, part) + (time.perf_counter() - begin))

    def close(self, seconds: float) -> None:
        """Set `compare` to the total time (s) minus the times of all other parts."""
        self.compare = max(0.0, seconds - self.read - self.urdfkin - self.pinocchio - self.second)

    def as_dict(self) -> dict[str, Any]:
        return {
            "read": round(self.read, 4),
            "urdfkin": round(self.urdfkin, 4),
            "pinocchio": round(self.pinocchio, 4),
            "compare": round(self.compare, 4),
        } | ({"second_oracle": round(self.second, 4)} if self.second else {})


def total(clocks: Iterable[Clock]) -> Clock:
    return Clock(*(sum(seconds) for seconds in zip(*map(astuple, clocks), strict=True)))
