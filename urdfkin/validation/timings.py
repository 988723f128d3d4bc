"""Where a validation's time goes: reading, urdfkin, Pinocchio, comparing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import astuple, dataclass
from typing import Any, ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclass(slots=True)
class Clock:
    """Seconds by whose work they were; `compare` is what remains of the whole.

    Attributes:
        read: Reading the file and building both models.
        urdfkin: Computing with urdfkin.
        pinocchio: Computing with Pinocchio.
        second: Computing with a second witness.
        compare: Bounds and comparison.
    """

    read: float = 0.0
    urdfkin: float = 0.0
    pinocchio: float = 0.0
    compare: float = 0.0
    second: float = 0.0

    def ours(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call something of urdfkin's."""
        with self._counted("urdfkin"):
            return function(*args, **kwargs)

    def theirs(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call something of Pinocchio's."""
        with self._counted("pinocchio"):
            return function(*args, **kwargs)

    def witness(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call something of a second witness's."""
        with self._counted("second"):
            return function(*args, **kwargs)

    @contextmanager
    def _counted(self, whose: str) -> Iterator[None]:
        begin = time.perf_counter()
        try:
            yield
        finally:
            setattr(self, whose, getattr(self, whose) + (time.perf_counter() - begin))

    def close(self, seconds: float) -> None:
        """What the whole took."""
        self.compare = max(0.0, seconds - self.read - self.urdfkin - self.pinocchio - self.second)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "read": round(self.read, 4),
            "urdfkin": round(self.urdfkin, 4),
            "pinocchio": round(self.pinocchio, 4),
            "compare": round(self.compare, 4),
        } | ({"witness": round(self.second, 4)} if self.second else {})


def total(clocks: Iterable[Clock]) -> Clock:
    """The sum of several."""
    return Clock(*(sum(seconds) for seconds in zip(*map(astuple, clocks), strict=True)))
